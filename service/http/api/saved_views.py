"""Saved views: addresses of pages under a name, and the figures of a study's report."""

from __future__ import annotations

from typing import Annotated, Any, Final

from fastapi import Path, Query
from starlette.responses import Response

from sprag_study.service.answers import filled
from sprag_study.service.answers import saved_views as m
from sprag_study.service.http.api.document import BODY_PROBLEMS, DELETES, body, problems
from sprag_study.service.http.context import ID_PATTERN, Ctx
from sprag_study.service.http.requests import IfMatch, Received, editions
from sprag_study.service.http.respond import json_response
from sprag_study.service.http.routers import api_router
from sprag_study.service.http.threads import in_thread
from sprag_study.service.http.work import Attended
from sprag_study.service.jobs.saved_views import change_view as change
from sprag_study.service.jobs.saved_views import save_view as save
from sprag_study.service.spec.saved_views import read_view, read_view_change
from sprag_study.service.storage.saved_views import SavedView

router = api_router("studies")

_PROBLEMS: Final = (*BODY_PROBLEMS, "invalid-selection", "not-owner")
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
    openapi_extra=body({"a list of studies": EXAMPLE}, "SavedView"),
)
async def save_view(context: Ctx, work: Attended, received: Received) -> Response:
    """Save the address of a page under a name; a view of the same study, page and name is replaced.

    With `in_report`, the curves or the map are a figure of the study's report, after those that are there.
    """
    view = await work.read(read_view, received)
    return json_response(entry(await in_thread(save, context.store, view)))


@router.patch(
    "/views/{view_id}",
    response_model=m.SavedViewEntry,
    responses=problems(*_PROBLEMS, "view-not-found", "precondition-failed"),
    openapi_extra=body({"first figure of the report": {"place": 1}}, "SavedViewChange"),
)
async def change_view(
    context: Ctx,
    work: Attended,
    view_id: ViewId,
    received: Received,
    if_match: IfMatch = None,
) -> Response:
    """Change the name or the choices of a view, and whether and where it is in the report of its study."""
    page = (await in_thread(context.store.views.get, view_id)).view.page
    wanted = await work.read(read_view_change, received, page)
    return json_response(entry(await in_thread(change, context.store, view_id, wanted, editions(if_match))))


@router.delete(
    "/views/{view_id}",
    **DELETES,
    responses=problems("view-not-found", "invalid-parameter", "not-owner", "precondition-failed"),
)
def delete_view(context: Ctx, view_id: ViewId, if_match: IfMatch = None) -> Response:
    """Delete a saved view."""
    context.store.views.remove(view_id, editions(if_match))
    return Response(status_code=204)
