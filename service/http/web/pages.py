"""Pages about the program itself: the studies, the interface's documentation, kinds of problems; and static files."""

from __future__ import annotations

import gzip
from functools import lru_cache
from importlib.metadata import version
from importlib.resources import files
from typing import Annotated, Final

from fastapi import APIRouter, Query, Request
from starlette.responses import Response

from sprag.service.http import views
from sprag.service.http.context import Ctx
from sprag.service.http.problems import PROBLEM_TYPES, ApiError
from sprag.service.http.respond import entity_tag, json_response, not_modified, tagged
from sprag.service.http.views import preset_of
from sprag.service.http.web import apidoc
from sprag.service.http.web.apidoc import with_token_needed
from sprag.service.http.web.templates import page
from sprag.service.presets import preset_names
from sprag.worker.states import StudyState

router = APIRouter(include_in_schema=False)

_LISTED: Final = 50
_TYPES: Final = {"css": "text/css", "svg": "image/svg+xml", "js": "text/javascript"}
#: The script that draws the pictures, as it lies in the package of that name.
PLOTLY: Final = "plotly.min.js"
_OWN: Final = frozenset(
    {"sprag.css", "sprag.svg", "link.js", "list.js", "plots.js", "study.js", "form.js", "laboratory.js", "case.js"}
)


@router.get("/")
def index(
    context: Ctx,
    after: Annotated[str | None, Query(max_length=200)] = None,
    state: Annotated[StudyState | None, Query()] = None,
) -> Response:
    """The studies, newest first, and the examples to begin with."""
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
    """What a kind of problem means."""
    if slug not in PROBLEM_TYPES:
        raise ApiError("not-found", "There is no such kind of problem.")
    return page("problem.html", problem=PROBLEM_TYPES[slug])


@router.get("/static/{name}")
def static(request: Request, name: str) -> Response:
    """Style sheet, sign and scripts of all pages."""
    if name not in _OWN and name != PLOTLY:
        raise ApiError("not-found", "There is no such file.")
    content, tag = _file(name)
    if unchanged := not_modified(request, tag):
        return unchanged
    headers = {"Cache-Control": "max-age=3600"}
    if name == PLOTLY and "gzip" in request.headers.get("accept-encoding", ""):
        content, headers["Content-Encoding"] = _packed_plotly(), "gzip"
    response = tagged(Response(content, media_type=_TYPES[name.rpartition(".")[2]], headers=headers), tag)
    response.headers["Vary"] = "Accept-Encoding"
    return response


@lru_cache(maxsize=16)
def _file(name: str) -> tuple[bytes, str]:
    """A file and its entity tag; they change with the program only."""
    if name == PLOTLY:
        content = files("plotly").joinpath("package_data", PLOTLY).read_bytes()
        return content, entity_tag(PLOTLY, version("plotly"))
    content = files("sprag.service.http.web").joinpath("static", name).read_bytes()
    return content, entity_tag(name, content.hex())


@lru_cache(maxsize=1)
def _packed_plotly() -> bytes:
    return gzip.compress(_file(PLOTLY)[0], compresslevel=6)
