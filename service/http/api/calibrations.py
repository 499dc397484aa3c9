"""GET /studies/{id}/calibration: what a calibration has found."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from starlette.responses import Response

from sprag.service.answers import calibration as m
from sprag.service.http.api.document import files, problems
from sprag.service.http.api.document import not_modified as documented_304
from sprag.service.http.api.drawn_format import DrawnFormat
from sprag.service.http.context import StudyId
from sprag.service.http.drawing import DRAWN_FORMATS, Drawing, attached, conditional, picture
from sprag.service.http.reading import FileChoice
from sprag.service.http.routers import api_router
from sprag.service.http.work import CHECK_PROBLEMS, Attended
from sprag.service.jobs import answers
from sprag.service.results.calibration import plan_of

if TYPE_CHECKING:
    from sprag.service.storage.records import StudyRecord

router = api_router("results", "/studies/{study_id:study}")

_WRITERS: Final = {"json": answers.calibration_as_json, "csv": answers.calibration_as_csv}


@router.get(
    "/calibration",
    response_model=m.CalibrationReport,
    responses={
        **files("The calibration, as JSON, a table of the measured values or a picture.", DRAWN_FORMATS.values()),
        **problems("invalid-parameter", "invalid-selection", "study-not-found", "not-acceptable", *CHECK_PROBLEMS),
        **documented_304(),
    },
)
async def get_calibration(
    work: Attended,
    study_id: StudyId,
    choice: FileChoice,
    chosen: DrawnFormat,
) -> Response:
    """What a calibration has found: values with intervals, correlations, residuals, the next point to measure."""

    def make(record: StudyRecord) -> Response | Drawing:
        plan_of(work.context.store.study(study_id))
        shown = (work.context.library, study_id)
        if chosen == "json" or chosen == "csv":  # noqa: PLR1714 - narrows the type
            headers = attached(f"{study_id}-calibration.csv") if chosen == "csv" else {}
            return Drawing(_WRITERS[chosen], shown, DRAWN_FORMATS[chosen], headers)
        return picture(answers.calibration_picture, chosen, *shown, choice, record.name or record.model)

    return await conditional(work, study_id, chosen, make)
