"""The page of a bifurcation diagram and a Poincare section: strobes of settled motions at a phase of the excitation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Final

from fastapi import Query
from starlette.responses import Response

from sprag.service.faults import FaultError
from sprag.service.http.context import CaseNumber, Ctx, StartNumber, StudyId, study_with
from sprag.service.http.drawing import unchanging
from sprag.service.http.reading import FileChoice
from sprag.service.http.respond import json_response
from sprag.service.http.routers import page_router
from sprag.service.http.threads import in_thread
from sprag.service.http.web.along import Begin, End, Text, along_frame, query_of
from sprag.service.http.web.figures.plotly import plotly_figure
from sprag.service.http.web.templates import page
from sprag.service.http.work import Attended
from sprag.service.jobs.reading import reading_of
from sprag.service.languages import _
from sprag.service.results.branches import usual_along
from sprag.service.results.figures.read import read_figure
from sprag.service.results.figures.sections import diagram_figure, section_figure
from sprag.service.results.portraits import require_strobes
from sprag.service.results.sections import diagram_of, section_of, variable_of, variables
from sprag.service.results.start_states import check_start
from sprag.worker.models.abilities import run_sections
from sprag.worker.models.starts import motion_of

if TYPE_CHECKING:
    from sprag.worker.models.sections import Sampling
    from sprag.worker.study import Study

router = page_router()

Phase = Annotated[str, Query(max_length=80)]

#: Values of the parameter and strobes of each; strobes of a section.
_SIZE: Final = (200, 64)
_SECTION: Final = 1000


@router.get("/studies/{study_id:study}/cases/{case:case}/diagram")
def diagram_page(
    context: Ctx, study_id: StudyId, case: CaseNumber, along: Text = "", low: Begin = "", high: End = "",
    phase: Phase = "", y: Text = "", which: StartNumber = None,
) -> Response:  # fmt: skip
    """The form of a diagram, its figure, and the section of the case."""
    study = study_with(context, study_id, case)
    require_strobes(study)
    check_start(study, which)
    path = along or usual_along(study)
    faults: tuple[Any, ...] = ()
    diagram = section = ""
    try:
        shown = variable_of(study, y)
        section_of(study, case, phase, _SECTION)
        section = query_of({"phase": phase}, which)
        if path:
            diagram_of(study, case, path, (low, high), phase, _SIZE)
            diagram = query_of({"along": path, "from": low, "to": high, "phase": phase, "y": shown}, which)
    except FaultError as error:
        shown, faults = y, error.faults
    entered = {"along": path, "low": low, "high": high, "phase": phase, "y": shown}
    return page(
        "diagram.html",
        status=422 if faults else 200,
        **along_frame(context, study_id, study, case, entered, which, initial=True),
        title=_("Bifurcation diagram"),
        faults=faults,
        variables=variables(study),
        diagram=diagram,
        section=section,
    )


@router.get("/studies/{study_id:study}/cases/{case:case}/diagram/figure")
async def diagram_drawn(
    work: Attended, study_id: StudyId, case: CaseNumber, along: Text, low: Begin = "", high: End = "",
    phase: Phase = "", y: Text = "", which: StartNumber = None, *, choice: FileChoice,
) -> Response:  # fmt: skip
    """The figure of a bifurcation diagram."""

    def look(study: Study) -> tuple[Sampling, str]:
        return diagram_of(study, case, along, (low, high), phase, _SIZE), variable_of(study, y)

    study, (asked, shown) = await work.case_of(study_id, case, look, which)

    async def make() -> Response:
        made = await work.run_case(run_sections, *motion_of(study, case, which), asked)
        reading = await in_thread(reading_of, work.context.store, study_id, choice)
        return json_response(plotly_figure(read_figure(diagram_figure(made, study, asked, shown), reading)))

    return await unchanging(work, study_id, make)


@router.get("/studies/{study_id:study}/cases/{case:case}/section/figure")
async def section_drawn(
    work: Attended,
    study_id: StudyId,
    case: CaseNumber,
    choice: FileChoice,
    phase: Phase = "",
    which: StartNumber = None,
) -> Response:
    """The figure of a Poincare section."""

    def look(study: Study) -> Sampling:
        return section_of(study, case, phase, _SECTION)

    study, asked = await work.case_of(study_id, case, look, which)

    async def make() -> Response:
        made = await work.run_case(run_sections, *motion_of(study, case, which), asked)
        reading = await in_thread(reading_of, work.context.store, study_id, choice)
        return json_response(plotly_figure(read_figure(section_figure(made, study, asked), reading)))

    return await unchanging(work, study_id, make)
