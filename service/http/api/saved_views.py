"""Saved views: addresses of pages under a name, and the figures of a study's report."""

from __future__ import annotations

from typing import Annotated, Any, Final

from fastapi import Depends, Path, Query
from starlette.responses import Response

from sprag_study.service.answers import filled
from sprag_study.service.answers import saved_views as m
from sprag_study.service.http.api.document import body, problems
from sprag_study.service.http.context import ID_PATTERN, Ctx
from sprag_study.service.http.requests import Body, IfMatch, as_body_problems, editions, read_body
from sprag_study.service.http.respond import json_response
from sprag_study.service.http.routers import api_router
from sprag_study.service.http.threads import in_thread
from sprag_study.service.http.work import CHECK_PROBLEMS, Attended
from sprag_study.service.jobs import checks
from sprag_study.service.jobs.saved_views import change_view as change
from sprag_study.service.jobs.saved_views import save_view as save
from sprag_study.service.storage.saved_views import SavedView

router = api_router("studies")

_PROBLEMS: Final = (
    "invalid-parameter", "invalid-body", "body-too-large", "unsupported-media-type", *CHECK_PROBLEMS,
    "invalid-selection", "not-owner",
)  # fmt: skip
EXAMPLE: Final[dict[str, Any]] = {"page": "studies", "name": "Failed last week", "query": "state=failed&sort=ended"}

ViewId = Annotated[str, Path(description="id of the view", pattern=ID_PATTERN, examples=["vw_0123456789abcdef"])]


def entry(saved: SavedView) -> m.SavedViewEntry:
    """A saved view as JSON data."""
    view = saved.view
    return filled(
        m.SavedViewEntry, saved, page=view.page, study=view.study, name=view.name, query=view.query,
        address=view.address,
    )  # fmt: skip


@router.get("/views", response_model=m.SavedViewList, responses=problems("invalid-parameter", "study-not-found"))
def list_views(
    context: Ctx,
    study: Annotated[str | None, Query(description="only the views of this study", pattern=ID_PATTERN)] = None,
) -> Response:
    """Saved views: the figures of the report in order, then the others by name; all, or those of a study."""
    return json_response({"views": list(map(entry, context.store.views.all(study)))})


@router.post(
    "/views",
    response_model=m.SavedViewEntry,
    responses=problems(*_PROBLEMS, "study-not-found", "wrong-state"),
    openapi_extra=body({"a list of studies": EXAMPLE}, {"$ref": "#/components/schemas/SavedView"}),
)
async def save_view(context: Ctx, work: Attended, received: Annotated[Body, Depends(read_body)]) -> Response:
    """Save the address of a page under a name; a view of the same study, page and name is replaced.

    With `in_report`, the curves or the map are a figure of the study's report, after those that are there.
    """
    with as_body_problems():
        view = await work.check(checks.saved_view, received.content, received.format)
        saved = await in_thread(save, context.store, view)
    return json_response(entry(saved))


@router.patch(
    "/views/{view_id}",
    response_model=m.SavedViewEntry,
    responses=problems(*_PROBLEMS, "view-not-found", "precondition-failed"),
    openapi_extra=body({"first figure of the report": {"place": 1}}, {"$ref": "#/components/schemas/SavedViewChange"}),
)
async def change_view(
    context: Ctx,
    work: Attended,
    view_id: ViewId,
    received: Annotated[Body, Depends(read_body)],
    if_match: IfMatch = None,
) -> Response:
    """Change the name or the choices of a view, and whether and where it is in the report of its study."""
    page = (await in_thread(context.store.views.get, view_id)).view.page
    with as_body_problems():
        wanted = await work.check(checks.saved_view_change, received.content, received.format, page)
        saved = await in_thread(change, context.store, view_id, wanted, editions(if_match))
    return json_response(entry(saved))


@router.delete(
    "/views/{view_id}",
    status_code=204,
    response_class=Response,
    responses=problems("view-not-found", "invalid-parameter", "not-owner", "precondition-failed"),
)
def delete_view(context: Ctx, view_id: ViewId, if_match: IfMatch = None) -> Response:
    """Delete a saved view."""
    context.store.views.remove(view_id, editions(if_match))
    return Response(status_code=204)
