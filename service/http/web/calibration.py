"""What a calibration has found as a page: values, measured points on the fitted curve, residuals, what to do next."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from fastapi import APIRouter
from starlette.concurrency import run_in_threadpool
from starlette.responses import Response

from sprag.service.http import views
from sprag.service.http.context import Context, StudyId
from sprag.service.http.drawing import Drawing, conditional
from sprag.service.http.respond import JSON
from sprag.service.http.web.figures import answers as figures
from sprag.service.http.web.study import study_frame
from sprag.service.http.web.templates import page
from sprag.service.http.work import Attended
from sprag.service.jobs import answers
from sprag.service.spec.catalogue import unit_of

if TYPE_CHECKING:
    from sprag.service.storage.records import StudyRecord

router = APIRouter(include_in_schema=False)


@router.get("/studies/{study_id:study}/calibration")
async def calibration_page(work: Attended, study_id: StudyId) -> Response:
    """Values with their intervals, the measured points on the fitted curve, correlations, residuals."""
    found = json.loads(await work.check(answers.calibration_as_json, work.context.library, study_id))
    return await run_in_threadpool(_page, work.context, study_id, found)


def _page(context: Context, study_id: str, found: dict[str, Any]) -> Response:
    results = list(dict.fromkeys(point["result"] for point in found["points"]))
    study = context.store.study(study_id)
    units = {axis.paths[0]: unit_of(study, axis.paths[0]) for axis in study.axes}
    return page(
        "calibration.html",
        **study_frame(context, study_id),
        tab="/calibration",
        found=found,
        results=results,
        units=units,
        figure=f"/studies/{study_id}/figures/calibration",
        files=f"{views.study_address(study_id)}/calibration",
    )


@router.get("/studies/{study_id:study}/figures/calibration")
async def figure_of(work: Attended, study_id: StudyId) -> Response:
    """The figure of the measured points on the fitted curves, and of the residuals."""

    def make(_record: StudyRecord) -> Response | Drawing:
        return Drawing(figures.calibration_json, (work.context.library, study_id), JSON)

    return await conditional(work, study_id, "figure", make)
