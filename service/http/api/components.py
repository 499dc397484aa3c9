"""The office's own springs, clutches and motors."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

from fastapi import Path, Query, Request
from starlette.responses import Response

from sprag_study.service.answers import components as m
from sprag_study.service.answers import filled
from sprag_study.service.exports.components import COMPONENT_FORMATS, components_csv
from sprag_study.service.http.api.document import BODY_PROBLEMS, DELETES, body, files, format_query, problems
from sprag_study.service.http.context import ID_PATTERN, Ctx
from sprag_study.service.http.decimals import DECIMAL
from sprag_study.service.http.requests import IfMatch, Received, editions
from sprag_study.service.http.respond import choose_format, json_response
from sprag_study.service.http.routers import api_router
from sprag_study.service.http.threads import in_thread
from sprag_study.service.http.work import Attended
from sprag_study.service.spec.components import read_components
from sprag_study.service.storage.components import ComponentRecord

router = api_router("components")

EXAMPLE: Final[dict[str, Any]] = {
    "components": [
        {"kind": "spring", "name": "F-120", "note": "store 3", "fields": {"spring_rate": "9 N/mm"}},
        {"kind": "clutch", "name": "FW 20", "fields": {"coefficients": "0; 200; 0; 20000", "backlash": "0.3 deg"}},
    ]
}


def entry(record: ComponentRecord) -> m.ComponentEntry:
    """A component as JSON data."""
    one = record.component
    return filled(m.ComponentEntry, record, kind=one.kind, name=one.name, note=one.note, fields=dict(one.fields))


@router.get(
    "/components",
    dependencies=[DECIMAL],
    response_model=m.ComponentList,
    responses={
        **files("The components as JSON or as a CSV file.", COMPONENT_FORMATS.values()),
        **problems("invalid-parameter", "not-acceptable"),
    },
)
def list_components(
    context: Ctx,
    request: Request,
    kind: Annotated[Literal["spring", "clutch", "motor"] | None, Query(description="only this kind")] = None,
    form: Annotated[str | None, format_query(COMPONENT_FORMATS)] = None,
) -> Response:
    """The office's own springs, clutches and motors, by kind and name; also as CSV."""
    found = context.store.components.all(kind)
    if choose_format(request, form, COMPONENT_FORMATS) == "csv":
        return Response(
            components_csv(record.component for record in found),
            media_type=COMPONENT_FORMATS["csv"],
            headers={"Content-Disposition": 'attachment; filename="components.csv"'},
        )
    return json_response({"components": list(map(entry, found))})


@router.post(
    "/components",
    response_model=m.ComponentList,
    responses=problems(*BODY_PROBLEMS, "not-owner", "wrong-state"),
    openapi_extra=body({"a spring and a clutch": EXAMPLE}, "Components"),
)
async def put_components(context: Ctx, work: Attended, received: Received) -> Response:
    """Add components, all or none; those of the same kind and name are replaced. CSV is sent as `{"csv": text}`."""
    records = await in_thread(context.store.components.put, await work.read(read_components, received))
    return json_response({"components": list(map(entry, records))})


@router.delete(
    "/components/{component_id}",
    **DELETES,
    responses=problems("component-not-found", "invalid-parameter", "not-owner", "precondition-failed"),
)
def delete_component(
    context: Ctx,
    component_id: Annotated[
        str, Path(description="id of the component", pattern=ID_PATTERN, examples=["cp_0123456789abcdef"])
    ],
    if_match: IfMatch = None,
) -> Response:
    """Remove a component; studies that took it keep its values."""
    context.store.components.remove(component_id, editions(if_match))
    return Response(status_code=204)
