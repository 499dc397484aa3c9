"""Old addresses of pages, and where their content went; links in mails and bookmarks stay good."""

from __future__ import annotations

from typing import Final

from fastapi import Request
from starlette.responses import RedirectResponse, Response

from sprag_study.service.http.context import CaseNumber, StudyId
from sprag_study.service.http.routers import page_router

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
    "/tokens": "/me",
}
#: Parts of the address of a study, and the page that answers what they ask; "" for the sheet.
OF_STUDY: Final = {
    "answers": "",
    "designs": "rows",
    "report": "document",
    "reports": "document",
}
#: Pages that a case had, all on its own now.
OF_CASE: Final = ("motion", "strobes", "trajectory")


def _to(address: str, request: Request) -> Response:
    query = request.url.query
    return RedirectResponse(address + (f"?{query}" if query else ""), 308)


async def _moved(request: Request) -> Response:
    return _to(MOVED[request.url.path], request)


for _old in MOVED:
    router.get(_old)(_moved)


def _of_study(old: str, new: str) -> None:
    @router.get(f"/studies/{{study_id:study}}/{old}")
    async def moved(request: Request, study_id: StudyId) -> Response:
        """An address of a study that has no page of its own."""
        return _to(f"/studies/{study_id}/{new}".rstrip("/"), request)


for _old, _new in OF_STUDY.items():
    _of_study(_old, _new)


def _of_case(old: str) -> None:
    @router.get(f"/studies/{{study_id:study}}/cases/{{case:case}}/{old}")
    async def moved(request: Request, study_id: StudyId, case: CaseNumber) -> Response:
        """A view that a case had as a page of its own."""
        return _to(f"/studies/{study_id}/cases/{case}", request)


for _old in OF_CASE:
    _of_case(_old)


@router.get("/schedules/{schedule_id:schedule}")
async def moved_schedule(schedule_id: str) -> Response:
    """A schedule, which mails link to."""
    return RedirectResponse(f"/nights/{schedule_id}", 308)


@router.get("/docs/{name}")
async def moved_manual(name: str) -> Response:
    """A page of the manual, also by the name of its file."""
    return RedirectResponse(f"/help/{name.removesuffix('.md')}", 308)
