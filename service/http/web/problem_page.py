"""Errors as pages, for browsers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag_study.service.http.web.templates import page

if TYPE_CHECKING:
    from starlette.requests import Request
    from starlette.responses import Response

    from sprag_study.service.http.problems import ApiError

_API = "/api/"


def wants_page(request: Request) -> bool:
    """Whether the request is a browser's request for a page."""
    return not request.url.path.startswith(_API) and "text/html" in request.headers.get("accept", "")


def problem_page(request: Request, error: ApiError) -> Response | None:
    """The page for ``error``; None for programs, which get the problem document."""
    if not wants_page(request):
        return None
    response = page(
        "error.html", status=error.type.status, problem=error.type, detail=error.detail, faults=error.faults
    )
    response.headers.update({"Cache-Control": "no-store", **error.headers})
    return response
