"""Routers of the API, of its health checks and of the pages, each with all that its routes have in common.

A router that is included into another one has its routes analysed twice, which was a fifth of the start of the service:
so each is made whole, and the application takes its routes as they are.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from fastapi import APIRouter, Depends

from sprag_study.service.http.reading import page_choice
from sprag_study.service.http.requests import strict_query
from sprag_study.service.http.roles import require_role
from sprag_study.service.http.threads import ThreadedRoute
from sprag_study.service.http.views import API_PREFIX

if TYPE_CHECKING:
    from fastapi.routing import APIRoute


def api_router(tag: str | None = None, path: str = "", *, prefix: str = API_PREFIX) -> APIRouter:
    """A router below ``prefix`` and ``path`` whose operations have the tag and take no unknown parameter."""
    return APIRouter(
        prefix=prefix + path,
        tags=[tag] if tag else None,
        dependencies=[Depends(require_role), Depends(strict_query)],
        route_class=ThreadedRoute,
        generate_unique_id_function=_operation_id,
    )


def page_router() -> APIRouter:
    """A router of pages: they have the reader's units and names, and are not in the OpenAPI document."""
    return APIRouter(
        include_in_schema=False,
        dependencies=[Depends(require_role), Depends(page_choice)],
        route_class=ThreadedRoute,
    )


def _operation_id(route: APIRoute) -> str:
    return route.name
