"""Figures of a study alone, at addresses of their own."""

from __future__ import annotations

from typing import TYPE_CHECKING

from starlette.responses import Response

from sprag.service.http.context import StudyId
from sprag.service.http.drawing import Columns
from sprag.service.http.reading import FileChoice
from sprag.service.http.routers import page_router
from sprag.service.http.web.figures.studies import figure_of
from sprag.service.http.web.sheet.chart import chosen_curves
from sprag.service.http.work import Attended
from sprag.service.results.choice import characteristic, curve_query, map_query
from sprag.service.results.curves import CurveQuery
from sprag.service.views.answers import AnswersChoice
from sprag.worker import models

if TYPE_CHECKING:
    from sprag.worker.study import Study

router = page_router()


@router.get("/studies/{study_id:study}/figures/curves")
async def curves_of(work: Attended, study_id: StudyId, choice: FileChoice, columns: Columns = 1) -> Response:
    """The figure of curves: as many points as the eye can distinguish, always including the highest and lowest."""

    def chosen(study: Study) -> CurveQuery | None:
        return curve_query(study, models.study_results(study), work.request.query_params)

    return await figure_of(work, study_id, "curves", chosen, choice, columns)


@router.get("/studies/{study_id:study}/figures/answers")
async def answers_of(work: Attended, study_id: StudyId, choice: FileChoice, columns: Columns = 1) -> Response:
    """The figure of the main results with the answers of the study marked."""

    def chosen(study: Study) -> AnswersChoice:
        given = work.request.query_params
        query = chosen_curves(study, given, characteristic(study, models.study_results(study)))
        return AnswersChoice(query, given.get("point") or None, given.get("curve") or "")

    return await figure_of(work, study_id, "answers", chosen, choice, columns)


@router.get("/studies/{study_id:study}/figures/map")
async def map_of(work: Attended, study_id: StudyId, choice: FileChoice, kind: str = "heatmap") -> Response:
    """The figure of a map."""

    def chosen(study: Study) -> tuple[CurveQuery, bool] | None:
        query = map_query(study, models.study_results(study), work.request.query_params)
        if query is None:
            return None
        return CurveQuery(query.x, (query.z,), (query.y,), query.at), kind == "contour"

    return await figure_of(work, study_id, "map", chosen, choice)


@router.get("/studies/{study_id:study}/figures/calibration")
async def calibration_of(work: Attended, study_id: StudyId, choice: FileChoice, columns: Columns = 2) -> Response:
    """The figure of the measured points on the fitted curves, and of the residuals."""
    return await figure_of(work, study_id, "calibration", lambda _study: (), choice, columns)
