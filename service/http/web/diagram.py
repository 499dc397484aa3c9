"""The page of a bifurcation diagram and a Poincare section: strobes of settled motions at a phase of the excitation."""

from __future__ import annotations

from typing import Annotated, Any, Final

from fastapi import Query
from starlette.responses import Response

from sprag.service.faults import FaultError
from sprag.service.http.context import CaseNumber, Ctx, StartNumber, StudyId, study_with
from sprag.service.http.routers import page_router
from sprag.service.http.web.along import Begin, End, Text, along_frame, query_of
from sprag.service.http.web.templates import page
from sprag.service.languages import _
from sprag.service.results.start_states import check_start
from sprag.service.views.branch import usual_along
from sprag.service.views.portrait import require_strobes
from sprag.service.views.sections import diagram_of, section_of, variable_of, variables

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
