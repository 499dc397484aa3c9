"""``sprag calibrate``: the parameters of a measured machine."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Annotated

import typer

from sprag_study.service import languages
from sprag_study.service.cli.configured import read_settings
from sprag_study.service.cli.console import WrongInputError, say, warning_lines, write_json
from sprag_study.service.cli.file_formats import PICTURES, file_format
from sprag_study.service.cli.files import MAX_DATA_BYTES, decode, read_bytes, read_spec, spec_failure, write_pieces
from sprag_study.service.cli.options import (
    JsonFlag,
    PictureLanguage,
    Processes,
    SpecFile,
)
from sprag_study.service.cli.running import run_parsed
from sprag_study.service.cli.shown import show_calibration
from sprag_study.service.cli.stores import store_of
from sprag_study.service.faults import Fault
from sprag_study.service.languages import N_, _

if TYPE_CHECKING:
    from sprag_study.service.spec.document import ParsedSpec

_FORMS = ("csv", *PICTURES)
_File = Annotated[
    str | None,
    typer.Option("-o", "--output", metavar="FILE", help="File to write: .csv with the residuals, or .svg, .png, .pdf."),
]


def calibrate(
    spec: SpecFile,
    measured: Annotated[
        str | None,
        typer.Option("--measured", metavar="FILE", help="CSV file of measured points, instead of those of the spec."),
    ] = None,
    file: _File = None,
    db: Annotated[
        str | None,
        typer.Option("--db", metavar="URL", help="Database to keep the study in; default: a temporary database."),
    ] = None,
    processes: Processes = None,
    language: PictureLanguage = None,
    as_json: JsonFlag = False,
) -> None:
    """Find the parameters that explain measured points, here, without a service: values with their intervals.

    The spec has `calibrate`: the unknown parameters with their ranges, and the measured points.
    """
    form = None if file is None else file_format(file, _FORMS)
    parsed = _read(spec, measured)
    say(*warning_lines(parsed.warnings))
    with _found(parsed, db, processes) as written:
        answer = json.loads(written("json"))
        if file is not None and form is not None:
            with languages.language(language or languages.ENGLISH):
                write_pieces(file, [written(form)])
    if as_json:
        write_json(answer)
    else:
        show_calibration(answer)
    if file is not None:
        say(_("file: {file}", file=file))


def _read(path: str, measured: str | None) -> ParsedSpec:
    from sprag_study.service.spec.document import SpecError, parse_spec

    data = read_spec(path)
    if isinstance(data, Mapping) and not isinstance(data.get("calibrate"), Mapping):
        problem = Fault("/calibrate", "required", N_("is required"), None, _("unknown parameters and measured points"))
        raise WrongInputError("invalid-spec", _("{file}: not a calibration", file=path), [problem])
    if measured is not None and isinstance(data, Mapping):
        text = decode(measured, read_bytes(measured, MAX_DATA_BYTES))
        data = {**data, "calibrate": {**data["calibrate"], "measured": {"csv": text}}}
    try:
        return parse_spec(data)
    except SpecError as error:
        raise spec_failure(path, error) from error


@contextmanager
def _found(parsed: ParsedSpec, db: str | None, processes: int | None) -> Iterator[Callable[[str], bytes]]:
    """Run the study to its end; what writes the calibration in a form."""
    from sprag_study.service.reading.quantities import SI
    from sprag_study.service.reading.reader import CAPTIONS, Choice
    from sprag_study.service.results.rounds import sentence
    from sprag_study.service.views.calibration import CalibrationView
    from sprag_study.service.views.library import Library
    from sprag_study.service.views.study_view import study_file

    settings = read_settings(database=db, processes=processes)
    if db is not None:
        store_of(db).close()
    with run_parsed(
        parsed,
        settings,
        lambda now: sentence(now.rounds, now.state) if now.rounds else "",
        title=_("calibration"),
        db=db,
        processes=processes,
    ) as done:
        library, title = Library(done.store), parsed.study.name
        choice = Choice(SI, CAPTIONS)
        yield partial(study_file, library, done.record.id, CalibrationView(), None, choice, title)
