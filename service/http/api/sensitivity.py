"""GET /studies/{id}/sensitivity: what the results of a study depend on."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

from fastapi import APIRouter, Depends, Query, Request
from starlette.responses import Response

from sprag.service.answers import results as m
from sprag.service.http.api.document import files, format_query, problems
from sprag.service.http.api.document import not_modified as documented_304
from sprag.service.http.context import Ctx, StudyId
from sprag.service.http.drawing import Drawing, attachment, conditional, picture, picture_of
from sprag.service.http.requests import strict_query
from sprag.service.http.respond import choose_format, json_response
from sprag.service.http.work import CHECK_PROBLEMS, Attended
from sprag.service.results import exports
from sprag.service.results.pictures import curves as pictures
from sprag.service.results.pictures.sensitivity import draw_sensitivity
from sprag.service.results.sensitivity import Sensitivity, sensitivity

if TYPE_CHECKING:
    from sprag.service.storage.records import StudyRecord

router = APIRouter(prefix="/studies/{study_id:study}", tags=["results"], dependencies=[Depends(strict_query)])

_FORMATS: dict[str, str] = {
    "json": "application/json",
    "csv": exports.MEDIA_TYPES["csv"],
    **{str(picture): media for picture, media in pictures.MEDIA_TYPES.items()},
}


@router.get(
    "/sensitivity",
    response_model=m.SensitivityReport,
    responses={
        **files("Effects, as JSON, a table of indices or a picture.", _FORMATS.values()),
        **problems("invalid-parameter", "invalid-selection", "study-not-found", "not-acceptable", *CHECK_PROBLEMS),
        **documented_304(),
    },
)
async def get_sensitivity(
    context: Ctx,
    work: Attended,
    request: Request,
    study_id: StudyId,
    y: Annotated[
        list[str], Query(description="result; may be repeated", examples=[["shaft.speed.mean"]], min_length=1)
    ],
    form: Annotated[str | None, format_query(_FORMATS)] = None,
) -> Response:
    """Main effects of every axis on results, and shares of their variance (Sobol indices)."""
    chosen = choose_format(request, form, _FORMATS)

    def make(record: StudyRecord) -> Response | Drawing:
        store = context.store
        names = list(dict.fromkeys(y))
        fetch = partial(store.rows_for_cases, study_id)
        found = sensitivity(store.study(study_id), store.spec(study_id), names, fetch)
        if chosen == "json":
            data = {"study": study_id, "results": [item.to_json() for item in found]}
            return json_response({**data, "warnings": list(context.unaffected.of(store, record))})
        if chosen == "csv":
            return attachment(indices_csv(found), _FORMATS["csv"], f"{study_id}-sensitivity.csv")
        return picture(draw_sensitivity, picture_of(chosen), found, record.name or record.model)

    return await conditional(context, work, request, study_id, chosen, make)


def indices_csv(found: list[Sensitivity]) -> bytes:
    """A row for each result and axis: the indices with the half widths of their intervals."""
    rows: list[list[Any]] = [
        [
            item.info.name,
            " ".join(effect.paths),
            effect.first,
            effect.first_error,
            effect.total,
            effect.total_error,
            item.method,
            item.cases,
            "; ".join(item.notes),
        ]
        for item in found
        for effect in item.effects
    ]
    header = ["result", "paths", "first_order", "first_order_error", "total", "total_error", "method", "cases", "notes"]
    return exports.table_csv(header, zip(*rows, strict=True) if rows else [[] for _ in header])
