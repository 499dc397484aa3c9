"""GET /studies/{id}/ribbon and /yield: what the drives of a study with tolerances do."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Final

from fastapi import Query
from pydantic import Field
from starlette.responses import Response

from sprag.service.answers import tolerances as m
from sprag.service.faults import parameter_error
from sprag.service.http.api.curves import Fixed, pairs
from sprag.service.http.api.document import files, problems
from sprag.service.http.api.document import not_modified as documented_304
from sprag.service.http.api.drawn_format import DrawnFormat
from sprag.service.http.context import StudyId
from sprag.service.http.drawing import DRAWN_FORMATS, Drawing, attached, conditional, picture
from sprag.service.http.reading import FileChoice
from sprag.service.http.routers import api_router
from sprag.service.http.work import CHECK_PROBLEMS, Attended, Work
from sprag.service.jobs import answers, batch_answers
from sprag.service.jobs.batch_answers import RibbonQuery, YieldQuery
from sprag.service.results.tolerances.batch import Asked
from sprag.service.results.tolerances.ribbons import MOST_QUANTILES, QUANTILES

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from sprag.service.reading.reader import Choice
    from sprag.service.storage.records import StudyRecord

router = api_router("results", "/studies/{study_id:study}")

#: Most drives in a list of the worst ones.
MOST_WORST: Final = 1000
_RIBBON: Final = {"json": batch_answers.ribbon_as_json, "csv": batch_answers.ribbon_as_csv}
_YIELD: Final = {"json": batch_answers.yield_as_json, "csv": batch_answers.yield_as_csv}
_PROBLEMS = ("invalid-parameter", "invalid-selection", "study-not-found", "not-acceptable", *CHECK_PROBLEMS)

Along = Annotated[
    str | None,
    Query(description="path of the axis along the lines; default: that of the curves", examples=["shaft.load"]),
]
By = Annotated[
    list[str] | None,
    Query(description="axis with one line for each of its values; may be repeated"),
]
Probability = Annotated[float, Field(gt=0.0, lt=1.0)]


@router.get(
    "/ribbon",
    response_model=m.RibbonReport,
    responses={
        **files("Quantiles over the drives, as JSON, a table or a picture.", DRAWN_FORMATS.values()),
        **problems(*_PROBLEMS),
        **documented_304(),
    },
)
async def get_ribbon(
    work: Attended,
    study_id: StudyId,
    choice: FileChoice,
    chosen: DrawnFormat,
    x: Along = None,
    y: Annotated[
        list[str] | None,
        Query(description="result; may be repeated; default: those of the page", examples=[["shaft.speed.mean"]]),
    ] = None,
    by: By = None,
    at: Fixed = None,
    quantile: Annotated[
        list[Probability] | None,
        Query(
            description="probability of a quantile; may be repeated; default: 0.05, 0.5 and 0.95",
            examples=[[0.05, 0.5, 0.95]],
            max_length=MOST_QUANTILES,
        ),
    ] = None,
    mapped: Annotated[
        bool, Query(alias="map", description="of a picture: a map of the quantile over `x` and `by`")
    ] = False,
) -> Response:
    """Quantiles of results over the drives along an axis, with 95 % intervals, the nominal drive, and the causes."""
    if mapped and quantile is not None and len(quantile) > 1:
        raise parameter_error("quantile", "too-many", "a map shows one quantile", quantile, "one")
    query = RibbonQuery(
        tuple(dict.fromkeys(y or ())),
        Asked(x, tuple(dict.fromkeys(by or ())), pairs(at)),
        tuple(quantile) if quantile else (0.5,) if mapped else QUANTILES,
    )
    return await _answered(
        work, study_id, choice, chosen, "ribbon", _RIBBON, batch_answers.ribbon_picture, query, mapped
    )


@router.get(
    "/yield",
    response_model=m.YieldReport,
    responses={
        **files("Yields, as JSON, a table or a picture.", DRAWN_FORMATS.values()),
        **problems(*_PROBLEMS),
        **documented_304(),
    },
)
async def get_yield(
    work: Attended,
    study_id: StudyId,
    choice: FileChoice,
    chosen: DrawnFormat,
    condition: Annotated[
        list[str],
        Query(
            description="`RESULT >= VALUE`, `<=` or `=`, the value with a unit or as `N % of nominal`; may be "
            "repeated: all must hold",
            examples=[["shaft.speed.mean >= 90 % of nominal"]],
            min_length=1,
        ),
    ],
    x: Along = None,
    by: By = None,
    at: Fixed = None,
    worst: Annotated[int, Query(ge=0, le=MOST_WORST, description="most drives in the list of the worst")] = 10,
    mapped: Annotated[
        bool, Query(alias="map", description="of a picture: a map of the yield over `x` and `by`")
    ] = False,
) -> Response:
    """The share of drives that reach conditions, at each place and at all places, its causes, and the worst drives."""
    query = YieldQuery(tuple(condition), Asked(x, tuple(dict.fromkeys(by or ())), pairs(at)), worst)
    return await _answered(work, study_id, choice, chosen, "yield", _YIELD, batch_answers.yield_picture, query, mapped)


async def _answered(
    work: Work,
    study_id: str,
    choice: Choice,
    chosen: DrawnFormat,
    part: str,
    writers: Mapping[str, Callable[..., bytes]],
    draw: Callable[..., bytes],
    query: RibbonQuery | YieldQuery,
    mapped: bool,
) -> Response:

    def make(record: StudyRecord) -> Response | Drawing:
        if chosen == "json" or chosen == "csv":  # noqa: PLR1714 - narrows the type
            headers = attached(f"{study_id}-{part}.csv") if chosen == "csv" else {}
            drawing = Drawing(writers[chosen], (work.context.library, study_id, query), DRAWN_FORMATS[chosen], headers)
            return drawing if record.cases > answers.FEW // 10 else drawing.here()
        return picture(draw, chosen, work.context.library, study_id, query, mapped, choice, record.name or record.model)

    return await conditional(work, study_id, chosen, make)
