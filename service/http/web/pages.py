"""General pages: the documentation of the API, kinds of problems; and static files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fastapi import Request
from starlette.responses import RedirectResponse, Response
from starlette.staticfiles import StaticFiles

from sprag_study.sentences import Sentence
from sprag_study.service.http.prefix import here
from sprag_study.service.http.problems import PROBLEM_TYPES, ApiError
from sprag_study.service.http.respond import json_response
from sprag_study.service.http.routers import page_router
from sprag_study.service.http.threads import in_thread
from sprag_study.service.http.web import apidoc
from sprag_study.service.http.web.apidoc import with_token_needed
from sprag_study.service.http.web.manual import PAGES, manual_page, titles
from sprag_study.service.http.web.templates import page
from sprag_study.service.reading.quantities import KINDS

if TYPE_CHECKING:
    from starlette.types import Receive, Scope, Send

router = page_router()

#: Files change only with the program.
_KEPT: Final = "max-age=3600"


@router.get("/help")
async def help_page() -> Response:
    """What there is to read: the manual, the interface for programs, units and names."""
    return await in_thread(lambda: page("help.html", titles=titles(), site=_SITE.is_dir(), kinds=KINDS))


@router.get("/help/interface")
async def interface(request: Request) -> Response:
    """The interface, operation by operation."""
    return page("docs.html", groups=apidoc.groups(request.app.openapi()), problems=PROBLEM_TYPES.values())


@router.get("/docs/site")
async def site_home() -> Response:
    """The way to the first page of the documentation's site, whose links are relative."""
    return RedirectResponse(here("/docs/site/"), 303)


@router.get("/docs/site/{name:path}")
async def site(name: str) -> Response:
    """A file of the documentation's site."""
    if not _SITE.is_dir():
        raise ApiError(
            "not-found", Sentence("This installation has no site of the documentation; `make docs` builds it.")
        )
    return _FileAnswer(_SITE_FILES, name or "index.html")


@router.get("/help/{name}")
async def manual(name: str) -> Response:
    """A page of the guide or the theory."""
    if name not in PAGES:
        raise ApiError("not-found", Sentence("Unknown page; known pages: {pages}.", pages=", ".join(PAGES)))
    return await in_thread(lambda: page("manual.html", page=manual_page(name)))


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


class _FileAnswer(Response):
    """The file of a name."""

    def __init__(self, files: StaticFiles, name: str) -> None:
        super().__init__()
        self._files, self._name = files, name

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send the file, or 404 where there is none."""
        answer = await self._files.get_response(self._name, scope)
        await answer(scope, receive, send)


class _Files(StaticFiles):
    """Style sheet, icon and scripts of all pages."""

    def file_response(self, *args: Any, **options: Any) -> Response:
        """The file; it changes only with the program."""
        response = super().file_response(*args, **options)
        response.headers["Cache-Control"] = _KEPT
        return response


_FILES: Final = _Files(packages=[("sprag_study.service.http.web", "static"), ("sprag_study.service.report", "static")])


class _SiteFiles(StaticFiles):
    """The site that `make docs` builds (docs/site.py), under a policy that allows the style of its search."""

    def file_response(self, *args: Any, **options: Any) -> Response:
        """The file; the hash of the style is a file of the site."""
        response = super().file_response(*args, **options)
        style = Path(str(self.directory), "style-hash.txt").read_text("ascii")
        response.headers["Content-Security-Policy"] = (
            f"default-src 'self'; style-src 'self' {style}; img-src 'self' data:; object-src 'none'; "
            "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
        )
        return response


_SITE: Final = Path(__file__).with_name("site")
_SITE_FILES: Final = _SiteFiles(directory=_SITE, check_dir=False)


@router.get("/static/{name}")
async def static(name: str) -> Response:
    """Style sheet, icon and scripts of all pages."""
    return _FileAnswer(_FILES, name)
