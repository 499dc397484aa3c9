"""GET /studies/{id}/answers: what people ask of a study first."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Final

from fastapi import Query
from starlette.responses import Response

from sprag.service.answers import key as m
from sprag.service.http.api.curves import Chosen, Fixed, Point, pairs
from sprag.service.http.api.document import files, problems
from sprag.service.http.api.document import not_modified as documented_304
from sprag.service.http.api.drawn_format import DrawnFormat
from sprag.service.http.context import StudyId
from sprag.service.http.drawing import DRAWN_FORMATS, Drawing, attached, conditional, picture
from sprag.service.http.reading import FileChoice
from sprag.service.http.routers import api_router
from sprag.service.http.work import CHECK_PROBLEMS, Attended
from sprag.service.jobs import key_answers
from sprag.service.jobs.answers import FEW
from sprag.service.results.defaults import completed
from sprag.worker import models

if TYPE_CHECKING:
    from sprag.service.results.curves import CurveQuery
    from sprag.service.storage.records import StudyRecord
    from sprag.worker.study import Study

router = api_router("results", "/studies/{study_id:study}")

_WRITERS: Final[dict[str, Callable[..., bytes]]] = {
    "json": key_answers.answers_as_json,
    "csv": key_answers.answers_as_csv,
}


@router.get(
    "/answers",
    response_model=m.AnswerReport,
    responses={
        **files("Answers, as JSON, a table or a picture.", DRAWN_FORMATS.values()),
        **problems("invalid-parameter", "invalid-selection", "study-not-found", "not-acceptable", *CHECK_PROBLEMS),
        **documented_304(),
    },
)
async def get_answers(
    work: Attended,
    study_id: StudyId,
    choice: FileChoice,
    chosen: DrawnFormat,
    x: Annotated[
        str | None,
        Query(description="path of the axis along the curves; default: that of the page", examples=["shaft.load"]),
    ] = None,
    by: Annotated[
        list[str] | None,
        Query(description="axis with one curve for each of its values; may be repeated"),
    ] = None,
    at: Fixed = None,
    of: Chosen = None,
    point: Point = None,
) -> Response:
    """What one asks of a study first: no-load speed, largest power, best efficiency, stall torque, a working point."""

    def query(study: Study) -> CurveQuery | None:
        """The chosen curves; None for those of the page."""
        if not (x or by or at or of):
            return None
        infos = models.study_results(study)
        return completed(study, infos, x, (), tuple(by or ()), pairs(at), pairs(of, "of"))

    def make(record: StudyRecord) -> Response | Drawing:
        study = work.context.store.study(study_id)
        shown = (work.context.library, study_id, query(study), point)
        if chosen == "json" or chosen == "csv":  # noqa: PLR1714 - narrows the type
            headers = attached(f"{study_id}-answers.csv") if chosen == "csv" else {}
            more = (choice,) if chosen == "csv" else ()
            drawing = Drawing(_WRITERS[chosen], (*shown, *more), DRAWN_FORMATS[chosen], headers)
            return drawing if study.cases > FEW // 2 else drawing.here()
        return picture(key_answers.answers_picture, chosen, *shown, choice, record.name or record.model)

    return await conditional(work, study_id, chosen, make)
