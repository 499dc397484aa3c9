"""General pages: the list of studies, the documentation of the API, kinds of problems; and static files."""

from __future__ import annotations

import os
from importlib.resources import files
from typing import TYPE_CHECKING, Annotated, Any, Final

from fastapi import APIRouter, Query, Request
from starlette.middleware.gzip import GZipMiddleware
from starlette.responses import Response
from starlette.staticfiles import StaticFiles

from sprag.service.http import views
from sprag.service.http.context import Ctx
from sprag.service.http.problems import PROBLEM_TYPES, ApiError
from sprag.service.http.respond import json_response
from sprag.service.http.views import preset_of
from sprag.service.http.web import apidoc
from sprag.service.http.web.apidoc import with_token_needed
from sprag.service.http.web.templates import page
from sprag.service.presets import preset_names
from sprag.worker.states import StudyState

if TYPE_CHECKING:
    from starlette.types import Receive, Scope, Send

router = APIRouter(include_in_schema=False)

_LISTED: Final = 50
#: The script that draws the pictures, as it lies in the package of that name.
PLOTLY: Final = "plotly.min.js"


@router.get("/")
def index(
    context: Ctx,
    after: Annotated[str | None, Query(max_length=200)] = None,
    state: Annotated[StudyState | None, Query()] = None,
) -> Response:
    """The studies, newest first, and the examples to start from."""
    found = context.store.list_studies(page_size=_LISTED, page_token=after, state=state)
    return page(
        "index.html",
        studies=[views.summary(record) for record in found.studies],
        more=found.next_token,
        after=after,
        state=state,
        states=list(StudyState),
        presets=[preset_of(name) for name in preset_names()],
    )


@router.get("/docs")
async def docs(request: Request) -> Response:
    """The interface, operation by operation."""
    return page("docs.html", groups=apidoc.groups(request.app.openapi()), problems=PROBLEM_TYPES.values())


@router.get("/openapi.json")
async def openapi(request: Request) -> Response:
    """The interface for programs (OpenAPI 3.1)."""
    document = request.app.openapi()
    return json_response(with_token_needed(document) if request.app.state.access.needed else document)


@router.get("/problems/{slug}")
async def problem(slug: str) -> Response:
    """Explanation of a kind of problem."""
    if slug not in PROBLEM_TYPES:
        raise ApiError("not-found", "Unknown kind of problem.")
    return page("problem.html", problem=PROBLEM_TYPES[slug])


class _Files(StaticFiles):
    """Style sheet, icon and scripts of all pages, and plotly's script from its package."""

    def get_path(self, scope: Scope) -> str:
        """The name in the URL."""
        return str(scope["path_params"]["name"])

    def lookup_path(self, path: str) -> tuple[str, os.stat_result | None]:
        """The file of that name and its status; None where there is none."""
        if path != PLOTLY:
            return super().lookup_path(path)
        file = str(files("plotly") / "package_data" / PLOTLY)
        return file, os.stat(file)

    def file_response(self, *args: Any, **options: Any) -> Response:
        """The file; it changes only with the program."""
        response = super().file_response(*args, **options)
        response.headers["Cache-Control"] = "max-age=3600"
        return response


_FILES: Final = GZipMiddleware(_Files(packages=[("sprag.service.http.web", "static")]), compresslevel=6)


class _FileAnswer(Response):
    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        await _FILES(scope, receive, send)


@router.get("/static/{name}")
async def static(name: str) -> Response:  # noqa: ARG001 - the files take it from the address
    """Style sheet, icon and scripts of all pages."""
    return _FileAnswer()
