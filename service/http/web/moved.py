"""Old addresses of pages, and where their content went; links in mails and bookmarks stay good."""

from __future__ import annotations

from typing import Final

from fastapi import Request
from starlette.responses import RedirectResponse, Response

from sprag.service.http.routers import page_router

router = page_router()

#: New address by the old one; the query stays as it is.
MOVED: Final = {
    "/units": "/me",
    "/users": "/me/users",
    "/audit": "/me/audit",
    "/workers": "/me/workers",
    "/components": "/parts",
    "/night": "/nights",
    "/schedules": "/nights",
    "/schedules/new": "/nights/new",
    "/docs": "/help/interface",
}


async def _moved(request: Request) -> Response:
    query = request.url.query
    return RedirectResponse(MOVED[request.url.path] + (f"?{query}" if query else ""), 308)


for _old in MOVED:
    router.get(_old)(_moved)


@router.get("/schedules/{schedule_id:schedule}")
async def moved_schedule(schedule_id: str) -> Response:
    """A schedule, which mails link to."""
    return RedirectResponse(f"/nights/{schedule_id}", 308)


@router.get("/docs/{name}")
async def moved_manual(name: str) -> Response:
    """A page of the manual."""
    return RedirectResponse(f"/help/{name}", 308)
