"""GET /studies/{id}/sensitivity: what the results of a study depend on."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from fastapi import Query
from starlette.responses import Response

from sprag.service.answers import results as m
from sprag.service.faults import warned
from sprag.service.http.api.document import files, problems
from sprag.service.http.api.document import not_modified as documented_304
from sprag.service.http.api.drawn_format import DrawnFormat
from sprag.service.http.context import StudyId
from sprag.service.http.drawing import DRAWN_FORMATS, Drawing, attached, conditional, picture
from sprag.service.http.reading import FileChoice
from sprag.service.http.routers import api_router
from sprag.service.http.work import CHECK_PROBLEMS, Attended
from sprag.service.jobs import sensitivities

if TYPE_CHECKING:
    from sprag.service.storage.records import StudyRecord

router = api_router("results", "/studies/{study_id:study}")


@router.get(
    "/sensitivity",
    response_model=m.SensitivityReport,
    responses={
        **files("Effects, as JSON, a table of indices or a picture.", DRAWN_FORMATS.values()),
        **problems("invalid-parameter", "invalid-selection", "study-not-found", "not-acceptable", *CHECK_PROBLEMS),
        **documented_304(),
    },
)
async def get_sensitivity(
    work: Attended,
    study_id: StudyId,
    choice: FileChoice,
    chosen: DrawnFormat,
    y: Annotated[
        list[str], Query(description="result; may be repeated", examples=[["shaft.speed.mean"]], min_length=1)
    ],
) -> Response:
    """Main effects of every axis on results, and shares of their variance (Sobol indices) or elementary effects."""
    names = tuple(dict.fromkeys(y))

    def make(record: StudyRecord) -> Response | Drawing:
        asked = (work.context.library, study_id, names)
        if chosen == "json":
            warnings = warned(work.context.unaffected.of(work.context.store, record))
            return Drawing(sensitivities.sensitivities_as_json, (*asked, warnings), DRAWN_FORMATS[chosen])
        if chosen == "csv":
            headers = attached(f"{study_id}-sensitivity.csv")
            return Drawing(sensitivities.sensitivities_as_csv, (*asked, choice), DRAWN_FORMATS[chosen], headers)
        title = record.name or record.model
        return picture(sensitivities.sensitivities_picture, chosen, *asked, choice, title)

    return await conditional(work, study_id, chosen, make)
