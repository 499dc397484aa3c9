"""The page of one case: its parameters, ending and results, its motion over time, its strobes and its orbit."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Final
from urllib.parse import urlencode

from fastapi import Query
from starlette.responses import RedirectResponse, Response

from sprag.service.faults import FaultError
from sprag.service.figures.pictures.curves import draw_motion
from sprag.service.http.context import CaseNumber, Ctx, StartNumber, StudyId, study_with
from sprag.service.http.current import current
from sprag.service.http.drawing import Columns, picture, unchanging
from sprag.service.http.reading import FileChoice, address_pairs
from sprag.service.http.respond import json_response
from sprag.service.http.routers import page_router
from sprag.service.http.threads import in_thread
from sprag.service.http.web.figures.motion import SAMPLES, motion_figures
from sprag.service.http.web.form.own_machine import case_address
from sprag.service.http.web.study import study_frame
from sprag.service.http.web.templates import page
from sprag.service.http.work import Attended
from sprag.service.languages import _
from sprag.service.reading.catalogue import unit_of
from sprag.service.reading.reader import meanings, shown
from sprag.service.reading.wording import number
from sprag.service.results.defaults import main_results
from sprag.service.results.regimes import ORDER, motion_sentence
from sprag.service.results.selection import axis_name, own_paths
from sprag.service.results.start_states import check_start
from sprag.service.results.sweeps import direction_texts
from sprag.service.views import trajectory
from sprag.service.views.library import reading_of
from sprag.worker import models
from sprag.worker.codes import PENDING
from sprag.worker.models.abilities import has_transients
from sprag.worker.models.starts import motion_of

if TYPE_CHECKING:
    from sprag.service.http.context import Context
    from sprag.service.storage.studies.records import CaseRow
    from sprag.worker.study import Study

router = page_router()

#: The ending of a machine that has no motion of the required mean speed, for which no spec of it alone is valid.
_NO_MOTION: Final = "inertia_insufficient"

#: Periods of the motion that are shown first, at the end of the evaluated window.
_FIRST_PERIODS = 4
#: Result with the start that a row describes.
_START = "regime.start"

Begin = Annotated[str, Query(alias="from", max_length=80)]
End = Annotated[str, Query(alias="to", max_length=80)]


def _span(study: Study, case: int, begin: str, end: str) -> tuple[float, float]:
    """First and last time shown (s): as requested, otherwise the last periods of the window."""
    if begin.strip() or end.strip():
        return trajectory.span(study, case, begin.strip() or None, end.strip() or None)
    extent = models.extent(study, case)
    if extent.along == "angle":
        return 0.0, extent.end
    window, last = study.run.get("window"), extent.end
    if window:
        last = min(window[1][0] * (extent.period if window[1][1] == "periods" else 1.0), extent.end)
    return max(last - _FIRST_PERIODS * extent.period, 0.0), last


def _rows(context: Context, study: Study, study_id: str, case: int) -> tuple[CaseRow, ...]:
    """The rows of a case: one, or one for each regime; none while it is not finished."""
    if models.numbered_by(study.model, models.variant_of(study)) is not None:
        rows = context.store.rows.of_case(study_id, case)
        if rows:
            return rows
    row = context.store.rows.case(study_id, case)
    return () if row is None else (row,)


def _start_of(row: CaseRow | None) -> int | None:
    """The start whose motion a row describes; None where a case has one start."""
    start = None if row is None else row.results.get(_START)
    return start if isinstance(start, int) else None


def _motion(row: CaseRow) -> str:
    """The settled motion in a sentence; nothing where a flag explains it, or the study has no regimes."""
    regime, order, after = (row.results.get(name) for name in ("regime", ORDER, "regime.settled_after"))
    if not isinstance(regime, str) or regime in row.flags:
        return ""
    sentence = shown(motion_sentence(regime, order if isinstance(order, int) else None))
    if isinstance(after, float):
        sentence += " " + _("From its start it is settled after {n} periods.", n=number(after, 3))
    return sentence


def _parameters(study: Study, case: int) -> list[tuple[str, float, str, str]]:
    """Name, value, unit and (of a derived one) formula of each parameter that a case has for itself."""
    values = study.case_parameters(case)
    return [
        (axis_name(study, path), values[path], unit_of(study, path), study.derive.get(path, ""))
        for path in own_paths(study)
    ]


@router.get("/studies/{study_id:study}/cases/{case:case}")
def case_page(
    context: Ctx, study_id: StudyId, case: CaseNumber, begin: Begin = "", end: End = "", which: StartNumber = None
) -> Response:
    """One case."""
    study = study_with(context, study_id, case)
    rows = _rows(context, study, study_id, case)
    # The motion that is shown is that of the regime on the page.
    row = next(
        (row for row in rows if which is not None and row.results.get(_START) == which), rows[0] if rows else None
    )
    which = _start_of(row) if which is None else which
    check_start(study, which)
    faults: tuple[Any, ...] = ()
    span = None
    try:
        span = _span(study, case, begin, end)
    except FaultError as error:
        faults = error.faults
    start = [] if which is None else [("start", str(which))]
    chosen = address_pairs(current().choice)
    query = urlencode([("from", repr(span[0])), ("to", repr(span[1])), *start]) if span else ""
    own = f"/studies/{study_id}/cases/{case}"
    infos = models.study_results(study)
    extent = models.extent(study, case)
    endings, flags = meanings(models.ENDING_SENTENCES), meanings(models.flags_of(study.model))
    return page(
        "case.html",
        status=422 if faults else 200,
        **study_frame(context, study_id),
        tab="/rows",
        case=case,
        row=row,
        regimes=[row for row in rows if row.results.get("regime.number") is not None],
        start="" if which is None else str(which),
        ending=PENDING if row is None else row.ending,
        sentence=_("The case has not been run yet.") if row is None else endings.get(row.ending, ""),
        motion="" if row is None else _motion(row),
        flags=[(flag, flags.get(flag, "")) for flag in (() if row is None else row.flags)],
        parameters=_parameters(study, case),
        value_texts=direction_texts(study, case),
        infos=infos,
        shown=models.presentation_of(study),
        main=[info for info in infos if info.name in main_results(study, infos)],
        faults=faults,
        span=span,
        begin=begin,
        end=end,
        extent=extent,
        figures=f"{own}/motion?columns=2&{query}&{urlencode(chosen)}",
        picture=f"{own}/motion.svg?{query}&{urlencode(chosen)}",
        chosen=urlencode(chosen),
        file=f"/api/v1{own}/trajectory?{query}&points={SAMPLES}&format=csv",
        own=own,
        has_clutches=models.has_clutches(study),
        has_strobes=models.has_strobes(study),
        has_transients=has_transients(study),
        has_motion=row is None or row.ending != _NO_MOTION,
        settled=models.is_settled(study.run),
        last=study.cases - 1,
    )


@router.get("/studies/{study_id:study}/cases/{case:case}/motion")
async def motion(
    work: Attended,
    study_id: StudyId,
    case: CaseNumber,
    choice: FileChoice,
    begin: Begin = "",
    end: End = "",
    which: StartNumber = None,
    columns: Columns = 2,
) -> Response:
    """The figures of a motion."""
    study, span = await work.case_of(study_id, case, lambda study: _span(study, case, begin, end), which)

    async def make() -> Response:
        reading = await in_thread(reading_of, work.context.store, study_id, choice)
        figures = await work.run_case(motion_figures, *motion_of(study, case, which), *span, columns, reading)
        return json_response(figures)

    return await unchanging(work, study_id, make)


@router.get("/studies/{study_id:study}/cases/{case:case}/laboratory")
async def in_laboratory(work: Attended, study_id: StudyId, case: CaseNumber, which: StartNumber = None) -> Response:
    """The machine of a case in the laboratory, in the motion that the case comes to."""
    study, spec = await work.case_of(study_id, case, lambda _: work.context.store.studies.spec(study_id), which)
    moving = models.has_strobes(study)
    state = await work.run_case(models.run_end_state, *motion_of(study, case, which)) if moving else None
    mark = f"{study_id}/{case}" if which is None else f"{study_id}/{case}/{which}"
    address = await work.check(case_address, spec, study, case, mark, state or {})
    return RedirectResponse(address, status_code=303)


@router.get("/studies/{study_id:study}/cases/{case:case}/motion.svg")
async def motion_picture(
    work: Attended,
    study_id: StudyId,
    case: CaseNumber,
    choice: FileChoice,
    begin: Begin = "",
    end: End = "",
    which: StartNumber = None,
) -> Response:
    """The motion as one picture, for pages without JavaScript."""
    study, span = await work.case_of(study_id, case, lambda study: _span(study, case, begin, end), which)

    async def make() -> Response:
        made = await work.run_case(models.run_trajectory, *motion_of(study, case, which), *span, SAMPLES // 3)
        reading = await in_thread(reading_of, work.context.store, study_id, choice)
        shown, title = models.presentation_of(study), f"{study.name}, case {case}"
        return await picture(draw_motion, "svg", made, shown, reading, title, (), None).response(work)

    return await unchanging(work, study_id, make)
