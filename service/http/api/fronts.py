"""GET /studies/{id}/front: the designs of a study with a goal."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Final

from fastapi import Query
from starlette.responses import Response

from sprag.service.answers import goals as m
from sprag.service.http.api.document import files, problems
from sprag.service.http.api.document import not_modified as documented_304
from sprag.service.http.api.drawn_format import DrawnFormat
from sprag.service.http.context import StudyId
from sprag.service.http.drawing import DRAWN_FORMATS, Drawing, attached, conditional, picture
from sprag.service.http.reading import FileChoice
from sprag.service.http.routers import api_router
from sprag.service.http.work import CHECK_PROBLEMS, Attended
from sprag.service.jobs import answers
from sprag.service.results.fronts import DESIGNS, MOST_DESIGNS, goal_of

if TYPE_CHECKING:
    from sprag.service.storage.records import StudyRecord

router = api_router("results", "/studies/{study_id:study}")

_WRITERS: Final = {"json": answers.front_as_json, "csv": answers.front_as_csv}


@router.get(
    "/front",
    response_model=m.FrontReport,
    responses={
        **files("Designs, as JSON, a table or a picture.", DRAWN_FORMATS.values()),
        **problems("invalid-parameter", "invalid-selection", "study-not-found", "not-acceptable", *CHECK_PROBLEMS),
        **documented_304(),
    },
)
async def get_front(
    work: Attended,
    study_id: StudyId,
    choice: FileChoice,
    chosen: DrawnFormat,
    exact: Annotated[
        bool, Query(description="designs must meet equalities of real numbers to 1e-6 to be feasible")
    ] = False,
    limit: Annotated[int, Query(ge=1, le=MOST_DESIGNS, description="most designs", examples=[100])] = DESIGNS,
    x: Annotated[str | None, Query(description="of a picture: goal, variable or limited result to the right")] = None,
    y: Annotated[str | None, Query(description="of a picture: the same upwards; by default two goals")] = None,
) -> Response:
    """The designs of a study with a goal, the best first: variables, goals, limits, ranks, and the search's history."""

    def make(record: StudyRecord) -> Response | Drawing:
        study = work.context.store.study(study_id)
        goal_of(study)
        shown = (work.context.library, study_id, exact)
        if chosen == "json" or chosen == "csv":  # noqa: PLR1714 - narrows the type
            headers = attached(f"{study_id}-front.csv") if chosen == "csv" else {}
            drawing = Drawing(_WRITERS[chosen], (*shown, limit), DRAWN_FORMATS[chosen], headers)
            return drawing if study.cases > answers.FEW // 10 else drawing.here()
        return picture(answers.front_picture, chosen, *shown, (x, y), choice, record.name or record.model)

    return await conditional(work, study_id, chosen, make)
