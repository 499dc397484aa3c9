"""Pages: what this is, the studies, one study with its main curve, the interface's documentation, problems."""

from __future__ import annotations

import json
import re
from functools import lru_cache, partial
from importlib.resources import files
from typing import Any, Final
from urllib.parse import urlencode

from fastapi import APIRouter, Request
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape
from starlette.responses import Response

from service import plots
from service.api import views
from service.api.context import Ctx, StudyId
from service.api.curves import picture_response
from service.api.respond import entity_tag, json_response, not_modified, tagged
from service.curves import draw, select
from service.errors import PROBLEM_TYPES, ApiError
from service.main_curve import caption, drawn_numbers, main_query, query_pairs
from service.web import apidoc
from worker import kernels

router = APIRouter(include_in_schema=False)

_LISTED: Final = 100
#: Seconds after which the page of a study that is not at its end asks for itself again.
_REFRESH: Final = 2
_STATIC: Final = {"sprag.css": "text/css", "sprag.svg": "image/svg+xml"}


@lru_cache(maxsize=1)
def _templates() -> Environment:
    environment = Environment(
        loader=PackageLoader("service.web"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["number"] = _number
    environment.filters["spec"] = _spec
    environment.filters["marked"] = _marked
    environment.filters["moment"] = lambda text: text[:19].replace("T", " ") + " UTC" if text else "–"
    return environment


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:,}" if isinstance(value, int) else f"{value:.6g}"


def _spec(spec: dict[str, Any]) -> str:
    """A spec as it was given: keys in their order, every character itself; escaped with the rest of the page."""
    return json.dumps(spec, ensure_ascii=False, indent=2)


def _marked(text: str) -> Markup:
    """A sentence of the documentation; what stands between backticks is code."""
    return Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", str(escape(text))))  # noqa: S704 - escaped just before


def _page(name: str, **values: Any) -> Response:
    return Response(_templates().get_template(name).render(**values), media_type="text/html")


@router.get("/")
def index(context: Ctx) -> Response:
    """What this is, and the latest studies."""
    page = context.store.list_studies(page_size=_LISTED)
    return _page("index.html", studies=[views.summary(record) for record in page.studies], more=page.next_token)


@router.get("/studies/{study_id:study}")
def study_page(context: Ctx, study_id: StudyId) -> Response:
    """One study: how far it is and its main curve."""
    record, study = context.store.get_study(study_id), context.store.study(study_id)
    shown = views.detail(record, context.store.progress(study_id), study, context.store.spec(study_id))
    query = main_query(study, kernels.study_results(study))
    address = views.study_address(study_id)
    curves = None if query is None else f"{address}/curves?{urlencode(query_pairs(query))}"
    first = context.store.case_row(study_id, 0) if query is None else None
    return _page(
        "study.html",
        study=shown,
        refresh=None if record.state.terminal else _REFRESH,
        curves=curves,
        caption=None if query is None else caption(study, query),
        numbers=0 if query is None else drawn_numbers(study, query),
        most_numbers=plots.MAX_PICTURE_POINTS,
        picture=f"/studies/{study_id}/curve.svg?revision={record.revision}",
        only_row=None if first is None else first.results.items(),
        units={info.name: info.unit for info in kernels.study_results(study)},
        endings=kernels.ENDING_SENTENCES,
    )


@router.get("/studies/{study_id:study}/curve.svg")
def study_curve(context: Ctx, request: Request, study_id: StudyId) -> Response:
    """The main curve of a study as a picture for its page."""
    record, study = context.store.get_study(study_id), context.store.study(study_id)
    infos = kernels.study_results(study)
    query = main_query(study, infos)
    if query is None:
        raise ApiError("not-found", "Nothing varies in this study, so it has no curve.")
    tag = entity_tag(record.id, record.revision, "curve.svg")
    if unchanged := not_modified(request, tag):
        return unchanged
    curves = draw(select(study, infos, query), partial(context.store.rows_for_cases, study_id))
    return tagged(picture_response(plots.draw_curves(curves, "", "svg"), "svg"), tag)


@router.get("/docs")
async def docs(request: Request) -> Response:
    """The interface, operation by operation."""
    return _page("docs.html", groups=apidoc.groups(request.app.openapi()), problems=PROBLEM_TYPES.values())


@router.get("/openapi.json")
async def openapi(request: Request) -> Response:
    """The interface for programs (OpenAPI 3.1)."""
    return json_response(request.app.openapi())


@router.get("/problems/{slug}")
async def problem(slug: str) -> Response:
    """What a kind of problem means."""
    if slug not in PROBLEM_TYPES:
        raise ApiError("not-found", "There is no such kind of problem.")
    return _page("problem.html", problem=PROBLEM_TYPES[slug])


@router.get("/static/{name}")
async def static(name: str) -> Response:
    """The style sheet and the sign of all pages."""
    if name not in _STATIC:
        raise ApiError("not-found", "There is no such file.")
    content = files("service.web").joinpath("static", name).read_bytes()
    return Response(content, media_type=_STATIC[name], headers={"Cache-Control": "max-age=3600"})
