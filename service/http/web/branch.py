"""The page of a branch: the periodic motions that the motion of a case becomes along a parameter."""

from __future__ import annotations

from typing import Any

from starlette.responses import Response

from sprag.service.faults import FaultError
from sprag.service.http.context import CaseNumber, Ctx, StartNumber, StudyId, study_with
from sprag.service.http.routers import page_router
from sprag.service.http.web.along import Begin, End, Text, along_frame, query_of
from sprag.service.http.web.templates import page
from sprag.service.languages import _
from sprag.service.results.start_states import check_start
from sprag.service.views.branch import along_of, result_of, usual_along
from sprag.service.views.portrait import require_strobes
from sprag.worker.models.abilities import branch_results

router = page_router()


@router.get("/studies/{study_id:study}/cases/{case:case}/branch")
def branch_page(
    context: Ctx, study_id: StudyId, case: CaseNumber, along: Text = "", low: Begin = "", high: End = "",
    y: Text = "", which: StartNumber = None,
) -> Response:  # fmt: skip
    """The form of a branch, and its figure."""
    study = study_with(context, study_id, case)
    require_strobes(study)
    check_start(study, which)
    path = along or usual_along(study)
    faults: tuple[Any, ...] = ()
    query = ""
    try:
        result = result_of(study, y)
        if path:
            along_of(study, case, path, low, high)
            query = query_of({"along": path, "from": low, "to": high, "y": result}, which)
    except FaultError as error:
        result, faults = y, error.faults
    return page(
        "branch.html",
        status=422 if faults else 200,
        **along_frame(context, study_id, study, case, {"along": path, "low": low, "high": high, "y": result}, which),
        title=_("Branch"),
        faults=faults,
        results=branch_results(study),
        branch=query,
    )
