"""GET /studies/{id}/sensitivity: what the results of a study depend on."""

from __future__ import annotations

from dataclasses import fields
from functools import partial
from typing import TYPE_CHECKING, Annotated

from fastapi import APIRouter, Depends, Query
from starlette.responses import Response

from sprag.service.answers import results as m
from sprag.service.faults import warned
from sprag.service.http.api.document import files, format_query, problems
from sprag.service.http.api.document import not_modified as documented_304
from sprag.service.http.context import StudyId
from sprag.service.http.drawing import DRAWN_FORMATS, Drawing, conditional, picture, table
from sprag.service.http.requests import strict_query
from sprag.service.http.respond import choose_format, json_response
from sprag.service.http.work import CHECK_PROBLEMS, Attended
from sprag.service.results import exports
from sprag.service.results.pictures.sensitivity import draw_sensitivity
from sprag.service.results.sensitivity import Sensitivity, sensitivity
from sprag.service.results.sensitivity_indices import Indices

if TYPE_CHECKING:
    from sprag.service.storage.records import StudyRecord

router = APIRouter(prefix="/studies/{study_id:study}", tags=["results"], dependencies=[Depends(strict_query)])


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
    y: Annotated[
        list[str], Query(description="result; may be repeated", examples=[["shaft.speed.mean"]], min_length=1)
    ],
    form: Annotated[str | None, format_query(DRAWN_FORMATS)] = None,
) -> Response:
    """Main effects of every axis on results, and shares of their variance (Sobol indices) or elementary effects."""
    chosen = choose_format(work.request, form, DRAWN_FORMATS)

    def make(record: StudyRecord) -> Response | Drawing:
        store = work.context.store
        names = list(dict.fromkeys(y))
        fetch = partial(store.rows_for_cases, study_id)
        found = sensitivity(store.study(study_id), store.spec(study_id), names, fetch)
        if chosen == "json":
            data = {"study": study_id, "results": [item.to_json() for item in found]}
            return json_response({**data, **warned(work.context.unaffected.of(store, record))})
        if chosen == "csv":
            return table(indices_csv(found), "csv", f"{study_id}-sensitivity")
        return picture(draw_sensitivity, chosen, found, record.name or record.model)

    return await conditional(work, study_id, chosen, make)


def indices_csv(found: list[Sensitivity]) -> bytes:
    """A row for each result and axis: the indices with the half widths of their intervals; then one for each pair."""
    indices = [field.name for field in fields(Indices)]
    header = ["result", "paths", *indices, "other_paths", "second_order", "second_order_error"]
    header += ["method", "cases", "notes"]
    rows = []
    for item in found:
        about = [item.method, item.cases, "; ".join(item.notes)]
        names = [" ".join(effect.paths) for effect in item.effects]
        for name, effect in zip(names, item.effects, strict=True):
            own = [getattr(effect.indices, index) for index in indices]
            rows.append([item.info.name, name, *own, None, None, None, *about])
        for pair in item.pairs:
            first, second, nothing = names[pair.first], names[pair.second], [None] * len(indices)
            rows.append([item.info.name, first, *nothing, second, pair.index, pair.error, *about])
    return exports.table_csv(header, zip(*rows, strict=True) if rows else [[] for _ in header])
