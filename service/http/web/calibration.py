"""What a calibration has found as a page: values, measured points on the fitted curve, residuals, what to do next."""

from __future__ import annotations

from typing import TYPE_CHECKING
from urllib.parse import urlencode

from starlette.responses import Response

from sprag.service.http import views
from sprag.service.http.context import Context, StudyId
from sprag.service.http.drawing import Columns
from sprag.service.http.reading import FileChoice, file_pairs, read_as
from sprag.service.http.routers import page_router
from sprag.service.http.threads import in_thread
from sprag.service.http.web.figures.studies import figure_of
from sprag.service.http.web.study import study_frame
from sprag.service.http.web.templates import page
from sprag.service.http.work import Attended
from sprag.service.reading.catalogue import unit_of
from sprag.service.views.calibration import calibration_report
from sprag.worker import models

if TYPE_CHECKING:
    from sprag.service.answers.calibration import CalibrationReport

router = page_router()


@router.get("/studies/{study_id:study}/calibration")
async def calibration_page(work: Attended, study_id: StudyId) -> Response:
    """Values with their intervals, the measured points on the fitted curve, correlations, residuals."""
    found = await work.check(calibration_report, work.context.library, study_id)
    return await in_thread(_page, work.context, study_id, found)


def _page(context: Context, study_id: str, found: CalibrationReport) -> Response:
    results = list(dict.fromkeys(point["result"] for point in found["points"]))
    study = context.store.studies.study(study_id)
    units = {axis.paths[0]: unit_of(study, axis.paths[0]) for axis in study.axes}
    return page(
        "calibration.html",
        **study_frame(context, study_id),
        tab="/calibration",
        found=found,
        results=results,
        units=units,
        result_units={info.name: info.unit for info in models.study_results(study)},
        figure=f"/studies/{study_id}/figures/calibration?columns=2{read_as()}",
        files=f"{views.study_address(study_id)}/calibration?{urlencode(file_pairs())}",
    )


@router.get("/studies/{study_id:study}/figures/calibration")
async def drawn(work: Attended, study_id: StudyId, choice: FileChoice, columns: Columns = 2) -> Response:
    """The figure of the measured points on the fitted curves, and of the residuals."""
    return await figure_of(work, study_id, "calibration", lambda _study: (), choice, columns)
