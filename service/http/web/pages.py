"""General pages: the documentation of the API, kinds of problems; and static files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from fastapi import Request
from starlette.responses import Response
from starlette.staticfiles import StaticFiles

from sprag.sentences import Sentence
from sprag.service.http.problems import PROBLEM_TYPES, ApiError
from sprag.service.http.respond import entity_tag, json_response, not_modified
from sprag.service.http.routers import page_router
from sprag.service.http.threads import in_thread
from sprag.service.http.web import apidoc
from sprag.service.http.web.apidoc import with_token_needed
from sprag.service.http.web.manual import PAGES, manual_page, titles
from sprag.service.http.web.plotly_script import plotly_script
from sprag.service.http.web.templates import page

if TYPE_CHECKING:
    from starlette.types import Receive, Scope, Send

router = page_router()

#: The script that draws the pictures.
PLOTLY: Final = "plotly.min.js"
#: Files change only with the program.
_KEPT: Final = "max-age=3600"


@router.get("/docs")
async def docs(request: Request) -> Response:
    """The interface, operation by operation."""
    return page("docs.html", groups=apidoc.groups(request.app.openapi()), problems=PROBLEM_TYPES.values())


@router.get("/docs/{name}")
async def manual(name: str) -> Response:
    """A page of the guide or the theory."""
    if name not in PAGES:
        raise ApiError("not-found", Sentence("Unknown page; known pages: {pages}.", pages=", ".join(PAGES)))
    return await in_thread(lambda: page("manual.html", page=manual_page(name), titles=titles()))


@router.get("/openapi.json")
async def openapi(request: Request) -> Response:
    """The interface for programs (OpenAPI 3.1)."""
    document = request.app.openapi()
    return json_response(with_token_needed(document) if request.app.state.access.needed else document)


@router.get("/problems/{slug}")
async def problem(slug: str) -> Response:
    """Explanation of a kind of problem."""
    if slug not in PROBLEM_TYPES:
        raise ApiError("not-found", Sentence("Unknown kind of problem."))
    return page("problem.html", problem=PROBLEM_TYPES[slug])


class _Files(StaticFiles):
    """Style sheet, icon and scripts of all pages."""

    def get_path(self, scope: Scope) -> str:
        """The name in the URL."""
        return str(scope["path_params"]["name"])

    def file_response(self, *args: Any, **options: Any) -> Response:
        """The file; it changes only with the program."""
        response = super().file_response(*args, **options)
        response.headers["Cache-Control"] = _KEPT
        return response


_FILES: Final = _Files(packages=[("sprag.service.http.web", "static")])


class _FileAnswer(Response):
    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        await _FILES(scope, receive, send)


@router.get("/static/{name}")
async def static(request: Request, name: str) -> Response:
    """Style sheet, icon and scripts of all pages."""
    return await in_thread(_plotly, request) if name == PLOTLY else _FileAnswer()


def _plotly(request: Request) -> Response:
    script = plotly_script()
    packed = "gzip" in request.headers.get("accept-encoding", "")
    tag = entity_tag(PLOTLY, packed, len(script.plain))
    headers = {"Cache-Control": _KEPT, "ETag": tag, "Vary": "Accept-Encoding"}
    if (known := not_modified(request, tag)) is not None:
        known.headers.update(headers)
        return known
    if packed:
        headers["Content-Encoding"] = "gzip"
    return Response(script.packed if packed else script.plain, media_type="text/javascript", headers=headers)
