"""Cases chosen by ranges and kinds, sorted over all rows: with histograms (explore), or as a new study (select)."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Final

from fastapi import Query
from starlette.responses import Response

from sprag.service.answers import explore as m
from sprag.service.answers.studies import StudySummary
from sprag.service.http.api.document import Ranges, files, located, problems
from sprag.service.http.api.document import not_modified as documented_304
from sprag.service.http.api.drawn_format import DrawnFormat
from sprag.service.http.api.studies import SelectKey, given_options, taken_in
from sprag.service.http.context import Ctx, StudyId
from sprag.service.http.drawing import DRAWN_FORMATS, Drawing, attached, conditional, picture
from sprag.service.http.reading import FileChoice
from sprag.service.http.routers import api_router
from sprag.service.http.threads import in_thread
from sprag.service.http.work import CHECK_PROBLEMS, Attended
from sprag.service.jobs import checks, explore
from sprag.service.jobs.answers import FEW
from sprag.service.results.explore import ROWS, ExploreQuery
from sprag.worker.limits import MAX_POINTS_SELECTED, MAX_SELECTED

if TYPE_CHECKING:
    from sprag.service.storage.records import StudyRecord

router = api_router(path="/studies/{study_id:study}")

_WRITERS: Final[dict[str, Callable[..., bytes]]] = {"json": explore.explored_as_json, "csv": explore.explored_as_csv}
_OfKind = Annotated[str | None, Query(min_length=1, max_length=40, description="only cases of this kind")]
_Sort = Annotated[
    str,
    Query(
        max_length=100,
        description='parameter, result, "case", "ending", "flags" or "regime" to sort all rows by; "-" before it: from '
        "the largest down; cases without it come last",
        examples=["-efficiency"],
    ),
]


@router.get(
    "/explore",
    tags=["results"],
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
    choice: FileChoice,
    chosen: DrawnFormat,
    where: Ranges = None,
    ending: _OfKind = None,
    regime: _OfKind = None,
    flag: _OfKind = None,
    sort: _Sort = "case",
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
) -> Response:
    """Cases within ranges of parameters and results, sorted over all rows, with a histogram of each quantity."""
    query = ExploreQuery(tuple(where or ()), ending or "", regime or "", flag or "", sort, limit, tuple(show or ()))

    def make(record: StudyRecord) -> Response | Drawing:
        study = work.context.store.study(study_id)
        if chosen not in _WRITERS:
            asked = (work.context.library, study_id, query, x, y, choice, record.name or record.model)
            return picture(explore.explore_picture, chosen, *asked)  # type: ignore[arg-type]
        headers = attached(f"{study_id}-selection.csv") if chosen == "csv" else {}
        shown = (work.context.library, study_id, query, *([choice] if chosen == "csv" else []))
        drawing = Drawing(_WRITERS[chosen], shown, DRAWN_FORMATS[chosen], headers)
        return drawing if study.cases > FEW or limit > FEW // 10 else drawing.here()

    return await conditional(work, study_id, chosen, make)


@router.post(
    ":select",
    tags=["studies"],
    status_code=202,
    response_model=StudySummary,
    responses=located(202)
    | problems(
        "invalid-parameter",
        "invalid-selection",
        *CHECK_PROBLEMS,
        "study-not-found",
        "invalid-spec",
        "idempotency-conflict",
        "storage-full",
        "queue-full",
    ),
)
async def select_cases(
    context: Ctx,
    work: Attended,
    study_id: StudyId,
    where: Ranges = None,
    ending: _OfKind = None,
    regime: _OfKind = None,
    flag: _OfKind = None,
    sort: _Sort = "case",
    limit: Annotated[int, Query(ge=1, le=MAX_POINTS_SELECTED, description="most cases", examples=[10])] = ROWS,
    idempotency_key: SelectKey = None,
) -> Response:
    """Submit a study of the first cases of a selection as points.

    Derived parameters follow from the others; a case of a drive with tolerances keeps the values of its drive.
    """
    query = ExploreQuery(tuple(where or ()), ending or "", regime or "", flag or "", sort, limit)
    given = given_options(where=where, ending=ending, regime=regime, flag=flag, sort=sort, limit=limit)
    made = await work.check(checks.selected_study, context.library, study_id, query, context.store.clock.now(), given)
    return await in_thread(taken_in, context, made, idempotency_key, 0)
