"""``sprag calibrate``: the parameters of a measured machine."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from sprag.service.cli.configured import read_settings
from sprag.service.cli.console import WrongInputError, say, warning_lines, write_json
from sprag.service.cli.file_formats import file_format
from sprag.service.cli.files import MAX_DATA_BYTES, decode, read_bytes, read_spec, spec_failure, write_pieces
from sprag.service.cli.options import (
    JsonFlag,
    Processes,
    SpecFile,
)
from sprag.service.cli.running import run_parsed
from sprag.service.cli.shown import show_calibration
from sprag.service.cli.stores import store_of
from sprag.service.faults import Fault
from sprag.service.languages import N_, _

if TYPE_CHECKING:
    from sprag.service.figures.pictures.curves import Picture
    from sprag.service.results.calibration import Calibration
    from sprag.service.spec.document import ParsedSpec

_FORMS = ("csv", "svg", "png", "pdf")
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
    as_json: JsonFlag = False,
) -> None:
    """Find the parameters that explain measured points, here, without a service: values with their intervals.

    The spec has `calibrate`: the unknown parameters with their ranges, and the measured points.
    """
    form = None if file is None else file_format(file, _FORMS)
    parsed = _read(spec, measured)
    say(*warning_lines(parsed.warnings))
    found, study_id = _run(parsed, db, processes)
    if file is not None and form is not None:
        write_pieces(file, [_content(found, form, parsed.study.name)])
    answer = _report(study_id, found)
    if as_json:
        write_json(answer)
    else:
        show_calibration(answer)
    if file is not None:
        say(_("file: {file}", file=file))


def _read(path: str, measured: str | None) -> ParsedSpec:
    from sprag.service.spec.document import SpecError, parse_spec

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


def _run(parsed: ParsedSpec, db: str | None, processes: int | None) -> tuple[Calibration, str]:
    """Run the study to its end; what it has found, and its id."""
    from sprag.service.results.calibration import calibration_of
    from sprag.service.results.rounds import sentence

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
        study_id, store = done.record.id, done.store
        rows = partial(store.rows.for_cases, study_id)
        return calibration_of(store.studies.study(study_id), store.studies.rounds(study_id), rows), study_id


def _content(found: Calibration, form: str, title: str) -> bytes:
    from sprag.service.figures.calibration import calibration_figure
    from sprag.service.figures.pictures.curves import draw_figure
    from sprag.service.figures.read import read_figure
    from sprag.service.reading.reader import Reading
    from sprag.service.results.calibration import calibration_csv

    if form == "csv":
        return calibration_csv(found)
    figure = read_figure(calibration_figure(found), Reading(found.study.model))
    return draw_figure(figure, title, cast("Picture", form))


def _report(study_id: str, found: Calibration) -> dict[str, Any]:
    from sprag.service.results.calibration import calibration_json

    return cast("dict[str, Any]", calibration_json(study_id, found))
