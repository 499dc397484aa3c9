"""The basin of a case: a page, and the figure that it shows."""

from __future__ import annotations

from urllib.parse import urlencode

from fastapi import APIRouter
from starlette.concurrency import run_in_threadpool
from starlette.responses import Response

from sprag.service.http.basin_query import Across, Along, End, Points
from sprag.service.http.context import CaseNumber, StudyId
from sprag.service.http.drawing import unchanging
from sprag.service.http.respond import json_response
from sprag.service.http.web.figures.answers import basin_plot
from sprag.service.http.web.study import study_frame
from sprag.service.http.web.templates import page
from sprag.service.http.work import Attended
from sprag.service.results import basins

router = APIRouter(include_in_schema=False)


@router.get("/studies/{study_id:study}/cases/{case:case}/basin")
async def basin_page(
    work: Attended,
    study_id: StudyId,
    case: CaseNumber,
    x: Across = None,
    y: Along = None,
    x_from: End = None,
    x_to: End = None,
    y_from: End = None,
    y_to: End = None,
    points: Points = 20,
) -> Response:
    """To which regime a case comes from each start of a grid."""
    ends = {"x": (x_from or None, x_to or None), "y": (y_from or None, y_to or None)}
    study, query = await work.case_of(
        study_id, case, lambda study: basins.basin_query(study, x or None, y or None, ends, points)
    )
    frame = await run_in_threadpool(study_frame, work.context, study_id)
    given = {
        "x": query.paths[0], "y": query.paths[1], "x_from": repr(query.x[0]), "x_to": repr(query.x[1]),
        "y_from": repr(query.y[0]), "y_to": repr(query.y[1]), "points": str(points),
    }  # fmt: skip
    own, text = f"/studies/{study_id}/cases/{case}/basin", urlencode(given)
    return page(
        "basin.html",
        **frame,
        tab="/cases",
        case=case,
        given=given,
        known=basins.initial_values(study),
        figure=f"{own}/figure?{text}",
        file=f"/api/v1{own}?{text}",
    )


@router.get("/studies/{study_id:study}/cases/{case:case}/basin/figure")
async def basin(
    work: Attended,
    study_id: StudyId,
    case: CaseNumber,
    x: Across = None,
    y: Along = None,
    x_from: End = None,
    x_to: End = None,
    y_from: End = None,
    y_to: End = None,
    points: Points = 20,
) -> Response:
    """The figure of a basin."""
    ends = {"x": (x_from, x_to), "y": (y_from, y_to)}
    study, query = await work.case_of(study_id, case, lambda study: basins.basin_query(study, x, y, ends, points))

    async def make() -> Response:
        return json_response(await work.run_case(basin_plot, study, case, query))

    return await unchanging(work, study_id, make)
