"""The page of a branch: the periodic motions that the motion of a case becomes along a parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from starlette.responses import Response

from sprag.service.faults import FaultError
from sprag.service.http.context import CaseNumber, Ctx, StartNumber, StudyId, study_with
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
from sprag.service.results.branches import along_of, neighbours, result_of, usual_along
from sprag.service.results.figures.branch import OwnCases, branch_figure
from sprag.service.results.figures.read import read_figure
from sprag.service.results.portraits import require_strobes
from sprag.service.results.start_states import check_start
from sprag.worker.models.abilities import branch_results, run_branch
from sprag.worker.models.starts import motion_of

if TYPE_CHECKING:
    from sprag.service.http.context import Context
    from sprag.worker.models.branches import Along
    from sprag.worker.study import Study

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


@router.get("/studies/{study_id:study}/cases/{case:case}/branch/figure")
async def branch_drawn(
    work: Attended, study_id: StudyId, case: CaseNumber, along: Text, low: Begin = "", high: End = "",
    y: Text = "", which: StartNumber = None, *, choice: FileChoice,
) -> Response:  # fmt: skip
    """The figure of a branch, with the cases of the study along its parameter."""

    def look(study: Study) -> tuple[Along, str]:
        return along_of(study, case, along, low, high), result_of(study, y)

    study, (asked, result) = await work.case_of(study_id, case, look, which)
    made = await work.run_case(run_branch, *motion_of(study, case, which), asked)
    own = await in_thread(_own_cases, work.context, study_id, study, case, asked, result)
    reading = await in_thread(reading_of, work.context.store, study_id, choice)
    return json_response(plotly_figure(read_figure(branch_figure(made, study, asked, result, own), reading)))


def _own_cases(context: Context, study_id: str, study: Study, case: int, along: Along, result: str) -> OwnCases:
    """The finished cases of the study that differ from this one in the parameter only."""
    cases = neighbours(study, case, along)
    columns = context.store.rows_for_cases(study_id, cases, [result])
    y = columns.values[result]
    x = study.columns(cases)[along.paths[0]] if cases.size else np.empty(0)
    kept = np.isfinite(y)
    return OwnCases(x[kept], y[kept], cases[kept])
