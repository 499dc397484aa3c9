"""``sprag diagram``, ``section``, ``basin`` and ``regimes``: the motions of one case, run here."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

import typer

from sprag.service.cli.console import WrongInputError, show_table, write_json, wrong_option
from sprag.service.cli.file_formats import value_format
from sprag.service.cli.files import output, read_study, require_cases
from sprag.service.cli.options import (
    AlongOption,
    CaseOption,
    FromOption,
    JsonFlag,
    OutputFile,
    PointsFile,
    SpecFile,
    StartOption,
    ToOption,
    ValueFormatOption,
)
from sprag.service.faults import Fault, FaultError
from sprag.service.languages import N_, _
from sprag.worker.limits import MAX_BASIN_POINTS

if TYPE_CHECKING:
    from sprag.worker.study import Study

_Phase = Annotated[str | None, typer.Option("--phase", metavar="ANGLE", help="Phase of the excitation; default: 0.")]
_End = Annotated[
    str | None, typer.Option(metavar="VALUE", help="SI or with a unit; default: as in the study's starts.")
]
#: What is shown of each regime.
_SHOWN = (
    "regime.number", "regime", "regime.order", "regime.share", "regime.share.low", "regime.share.high", "regime.start",
    "shaft.speed.mean",
)  # fmt: skip


def diagram(
    spec: SpecFile,
    along: AlongOption,
    case: CaseOption = 0,
    low: FromOption = None,
    high: ToOption = None,
    phase: _Phase = None,
    values: Annotated[int, typer.Option(min=2, max=500, help="Equally spaced values of the parameter.")] = 200,
    strobes: Annotated[int, typer.Option(min=1, max=200, help="Most strobes of each motion.")] = 64,
    start: StartOption = None,
    points: PointsFile = None,
    file: OutputFile = None,
    form: ValueFormatOption = None,
    as_json: JsonFlag = False,
) -> None:
    """Bifurcation diagram: the strobes of the settled motions of one case along a parameter."""
    from sprag.service.results.sections import diagram_of, sections_file

    written = value_format(form, file, as_json)
    study = study_of(spec, points, case, start)
    with naming_options(study):
        asked = diagram_of(study, case, along, (low, high), phase, (values, strobes))
    _write(file, sections_file(study, case, asked, written, False, start))


def section(
    spec: SpecFile,
    case: CaseOption = 0,
    phase: _Phase = None,
    strobes: Annotated[int, typer.Option(min=1, max=5000, help="Most strobes.")] = 1000,
    start: StartOption = None,
    points: PointsFile = None,
    file: OutputFile = None,
    form: ValueFormatOption = None,
    as_json: JsonFlag = False,
) -> None:
    """Poincare section: the strobes of the settled motion of one case at a phase of the excitation."""
    from sprag.service.results.sections import section_of, sections_file

    written = value_format(form, file, as_json)
    study = study_of(spec, points, case, start)
    with naming_options(study):
        asked = section_of(study, case, phase, strobes)
    _write(file, sections_file(study, case, asked, written, True, start))


def basin(
    spec: SpecFile,
    case: CaseOption = 0,
    x: Annotated[
        str | None, typer.Option("--x", metavar="PATH", help="Initial value across; default: first of the starts.")
    ] = None,
    y: Annotated[str | None, typer.Option("--y", metavar="PATH", help="The other one; default: the next one.")] = None,
    x_from: _End = None,
    x_to: _End = None,
    y_from: _End = None,
    y_to: _End = None,
    grid: Annotated[int, typer.Option("--grid", min=2, max=MAX_BASIN_POINTS, help="Values of each.")] = 20,
    points: PointsFile = None,
    file: OutputFile = None,
    form: ValueFormatOption = None,
    as_json: JsonFlag = False,
) -> None:
    """Basin: the regime to which one case comes from each start of a grid of two initial values."""
    from sprag.service.results.basins import basin_file, basin_query

    written = value_format(form, file, as_json)
    study = study_of(spec, points, case, None)
    with naming_options(study):
        query = basin_query(study, case, x, y, {"x": (x_from, x_to), "y": (y_from, y_to)}, grid)
    _write(file, basin_file(study, case, query, written))


def regimes(spec: SpecFile, case: CaseOption = 0, points: PointsFile = None, as_json: JsonFlag = False) -> None:
    """The regimes to which one case comes from its many starts, with their shares."""
    import numpy as np

    from sprag.worker.models import run_chunk, study_results
    from sprag.worker.models.starts import has_starts
    from sprag.worker.reuse import taken

    study = study_of(spec, points, case, None)
    if not has_starts(study.run):
        raise wrong_option(
            "/starts",
            "required",
            N_("is required"),
            None,
            allowed=_("`starts` in the spec of a settled study"),
            detail=_("the study has no starts"),
        )
    done = run_chunk(taken(study, np.array([case])) if study.axes else study, 0, 1)
    infos = {info.name: (place, info) for place, info in enumerate(study_results(study))}
    further = () if done.further is None else done.further.values
    rows = [
        {name: infos[name][1].cell(float(row[infos[name][0]])) for name in _SHOWN} for row in (done.values[0], *further)
    ]
    if as_json:
        write_json({"case": case, "ending": done.endings[0], "regimes": rows})
        return
    show_table(
        _("Case {case}: {count} starts", case=case, count=study.run["starts"]["count"]),
        [(name.removeprefix("regime."), name != "regime") for name in _SHOWN],
        [tuple(row.values()) for row in rows],
    )


def study_of(spec: str, points: str | None, case: int, start: int | None) -> Study:
    """The study of a file, which has that case and that start of it."""
    from sprag.service.results.start_states import check_start

    study = read_study(spec, points).study
    require_cases(study, [case])
    with naming_options(study):
        check_start(study, start)
    return study


@contextmanager
def naming_options(study: Study, lacks: str = N_("has no motion that settles")) -> Iterator[None]:
    """Name the options of a command instead of the parameters of a request; WrongInputError for each fault."""
    try:
        yield
    except FaultError as error:
        if not error.faults:
            raise wrong_option("/model", "wrong-type", lacks, study.model, detail=error.detail) from error
        raise WrongInputError("invalid-parameter", _("invalid option"), tuple(map(_option, error.faults))) from error


def _option(fault: Fault) -> Fault:
    return Fault(f"--{fault.where}".replace("_", "-"), fault.code, fault.message, fault.value, fault.allowed)


def _write(file: str | None, content: bytes) -> None:
    with output(file) as write:
        write(content if content.endswith(b"\n") else content + b"\n")
