"""What the sheet of a study shows of its rows, found in one place so that another process can do it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from starlette.datastructures import QueryParams

from sprag_study.service.faults import SelectionError
from sprag_study.service.http.web.held import fixed_choices, with_held
from sprag_study.service.http.web.sheet.chart import CHOICES, chart_of, chosen_curves, point_of
from sprag_study.service.http.web.sheet.machine import Machine, machine_of
from sprag_study.service.http.web.sheet.side import Side, side_of
from sprag_study.service.http.web.view_forms import Fact, fact_of
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.results.choice import value_choices
from sprag_study.service.spec.fields import renamed
from sprag_study.service.views.headline import headline_of, usual_query
from sprag_study.service.views.library import reading_of
from sprag_study.service.views.relatives import asked_by

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.faults import Fault
    from sprag_study.service.http.web.sheet.chart import Chart
    from sprag_study.service.reading.reader import Choice, Reading
    from sprag_study.service.results.curves import CurveQuery
    from sprag_study.service.results.headlines.headline import Gap
    from sprag_study.service.views.headline import Headline
    from sprag_study.service.views.library import Library
    from sprag_study.worker.study import Study


@dataclass(frozen=True, slots=True)
class Missing:
    """A place without a case that can be run: path, value to send and in print, further cases, name of their study."""

    path: str
    value: str
    said: str
    cases: int
    name: str


@dataclass(frozen=True, slots=True)
class Sheet:
    """What a sheet shows of its rows.

    Attributes
    ----------
    faults : why it is not what was asked for
    say : the sentences of the answer; ``of`` says of which curve
    gap : the place that was asked for, where it can be run
    fixed, choices : axes that are held, and values of the axes that tell curves apart
    design : of a search a case of its best design
    """

    faults: tuple[Fault, ...]
    say: list[str]
    of: str
    numbers: list[Fact]
    dimensions: list[Fact]
    limits: list[Fact]
    chart: Chart | None
    machine: Machine
    side: Side
    gap: Missing | None = None
    fixed: list[dict[str, Any]] = field(default_factory=list)
    choices: list[dict[str, Any]] = field(default_factory=list)
    design: int | None = None


def sheet_of(library: Library, study_id: str, given: Sequence[tuple[str, str]], choice: Choice, cases: str) -> Sheet:
    """The sheet of a study for the parameters of its address; without them where they cannot be shown.

    ``cases`` is the address of the cases of the study. Raises StudyNotFoundError.
    """
    study = library.store.studies.study(study_id)
    reading = reading_of(library.store, study_id, choice)
    params = with_held(QueryParams(list(given)), study, reading)
    usual = usual_query(library, study_id)
    try:
        return _sheet(library, study_id, study, params, usual, reading, cases)
    except SelectionError as error:
        found = _sheet(library, study_id, study, QueryParams(), usual, reading, cases)
        return replace(found, faults=error.faults)


def _sheet(
    library: Library,
    study_id: str,
    study: Study,
    params: QueryParams,
    usual: CurveQuery | None,
    reading: Reading,
    cases: str,
) -> Sheet:
    headline = _headline(library, study_id, study, params, usual, reading)
    progress = library.store.studies.progress(study_id)
    asked = any(params.get(name) for name in (*CHOICES, "z", "point"))
    chart = chart_of(library, study_id, params, usual, reading, cases) if progress.done or asked else None
    best = {
        one.label: one.value
        for one in (*headline.numbers, *headline.dimensions)
        if isinstance(one.value, float) and one.label in study.base
    }
    design = headline.case if asked_by(study) == "best" else None
    own = f"/studies/{study_id}/cases/"
    variant = f"{cases.removesuffix(own)}/new?clone={study_id}" + ("" if design is None else f"&case={design}")
    drawn, at = _roles(chart)
    return Sheet(
        (),
        list(map(reading.say, headline.sentence)),
        reading.say(headline.of),
        [fact_of(one, reading, own) for one in headline.numbers],
        [fact_of(one, reading, own) for one in headline.dimensions],
        [fact_of(one, reading, own) for one in headline.limits],
        chart,
        machine_of(study, library.store.studies.spec(study_id), reading, best, variant),
        side_of(library, study_id, headline, reading),
        _missing(study, headline.gap, library.store.studies.get(study_id).name, reading),
        fixed_choices(study, drawn, at, reading) if drawn else [],
        value_choices(study, chart.curves) if chart is not None and chart.curves is not None else [],
        design,
    )


def _missing(study: Study, gap: Gap | None, name: str, reading: Reading) -> Missing | None:
    """The place without a case as a further value of its axis; None where the study cannot be extended by one."""
    if gap is None or study.combine != "grid" or study.plan is not None:
        return None
    axis, si = study.axis_with(gap.path), unit_of(study, gap.path)
    if axis.index_of(gap.value) is not None:  # its case waits
        return None
    value, unit, said = reading.value(gap.value, si), reading.unit(si), reading.quantity(gap.value, si)
    typed = f"{value:.10g}" if unit == "1" else f"{value:.10g} {unit}"
    return Missing(gap.path, typed, said, study.cases // len(axis), renamed(name, f", {said}"))


def _roles(chart: Chart | None) -> tuple[tuple[str, ...], tuple[tuple[str, str], ...]]:
    """The drawn axes of a chart, and what is held."""
    if chart is None:
        return (), ()
    if chart.map is not None:
        return (chart.map.x, chart.map.y), chart.map.at
    return ((chart.curves.x, *chart.curves.by), chart.curves.at) if chart.curves is not None else ((), ())


def _headline(
    library: Library, study_id: str, study: Study, params: QueryParams, usual: CurveQuery | None, reading: Reading
) -> Headline:
    """The headline of the curves and the point of the address."""
    if params.get("z"):
        return headline_of(library, study_id)
    query = chosen_curves(study, params, usual)
    point = point_of(study, query or usual, params, reading)
    return headline_of(library, study_id, query if query != usual else None, point, params.get("curve") or "")
