"""GET /studies/{id}/explore: cases chosen by ranges and kinds, sorted over all rows, with histograms."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Final

from fastapi import APIRouter, Depends, Query
from starlette.responses import Response

from sprag.service.answers import explore as m
from sprag.service.http.api.document import files, format_query, problems
from sprag.service.http.api.document import not_modified as documented_304
from sprag.service.http.context import StudyId
from sprag.service.http.drawing import DRAWN_FORMATS, Drawing, attached, conditional, picture
from sprag.service.http.requests import strict_query
from sprag.service.http.respond import choose_format
from sprag.service.http.work import CHECK_PROBLEMS, Attended
from sprag.service.jobs import explore
from sprag.service.jobs.answers import FEW
from sprag.service.results.explore import ROWS, ExploreQuery
from sprag.worker.limits import MAX_SELECTED

if TYPE_CHECKING:
    from sprag.service.storage.records import StudyRecord

router = APIRouter(prefix="/studies/{study_id:study}", tags=["results"], dependencies=[Depends(strict_query)])

_WRITERS: Final = {"json": explore.explored_as_json, "csv": explore.explored_as_csv}
_OfKind = Annotated[str, Query(max_length=40, description="only cases of this kind")]


@router.get(
    "/explore",
    response_model=m.Exploration,
    responses={
        **files("A selection of cases, as JSON, a table or a picture.", DRAWN_FORMATS.values()),
        **problems("invalid-parameter", "invalid-selection", "study-not-found", "not-acceptable", *CHECK_PROBLEMS),
        **documented_304(),
    },
)
async def get_exploration(
    work: Attended,
    study_id: StudyId,
    where: Annotated[
        list[str] | None,
        Query(
            description="`NAME >= VALUE` or `NAME <= VALUE` of a parameter that varies or a numeric result, SI or with "
            "a unit; may be repeated: all must hold",
            examples=[["shaft.load <= 2 N*m"]],
        ),
    ] = None,
    ending: _OfKind = "",
    regime: _OfKind = "",
    flag: _OfKind = "",
    sort: Annotated[
        str,
        Query(
            max_length=100,
            description='parameter, result or "case" to sort all rows by; "-" before it: from the largest down; cases '
            "without the number come last",
            examples=["-efficiency"],
        ),
    ] = "case",
    limit: Annotated[int, Query(ge=1, le=MAX_SELECTED, description="most rows", examples=[10])] = ROWS,
    show: Annotated[
        list[str] | None,
        Query(
            description="quantity of histograms and rows; may be repeated; default: axes and the model's main results",
            examples=[["efficiency"]],
        ),
    ] = None,
    x: Annotated[str, Query(max_length=100, description="of a picture: shown quantity to the right")] = "",
    y: Annotated[str, Query(max_length=100, description="of a picture: the same upwards")] = "",
    form: Annotated[str | None, format_query(DRAWN_FORMATS)] = None,
) -> Response:
    """Cases within ranges of parameters and results, sorted over all rows, with a histogram of each quantity."""
    chosen = choose_format(work.request, form, DRAWN_FORMATS)
    query = ExploreQuery(tuple(where or ()), ending, regime, flag, sort, limit, tuple(show or ()))

    def make(record: StudyRecord) -> Response | Drawing:
        study = work.context.store.study(study_id)
        if chosen not in _WRITERS:
            asked = (work.context.library, study_id, query, x, y, record.name or record.model)
            return picture(explore.explore_picture, chosen, *asked)  # type: ignore[arg-type]
        headers = attached(f"{study_id}-selection.csv") if chosen == "csv" else {}
        shown = (work.context.library, study_id, query)
        drawing = Drawing(_WRITERS[chosen], shown, DRAWN_FORMATS[chosen], headers)
        return drawing if study.cases > FEW or limit > FEW // 10 else drawing.here()

    return await conditional(work, study_id, chosen, make)
