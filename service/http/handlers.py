"""Conversion of exceptions to problem documents."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable
from typing import Any, cast

from fastapi import FastAPI
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response
from starlette.routing import Route

from sprag_study.sentences import Sentence
from sprag_study.service.faults import FaultError, shown
from sprag_study.service.http.problems import ApiError, as_api_error, problem_response
from sprag_study.service.http.web.problem_page import problem_page, wants_page
from sprag_study.service.storage.errors import StoreError
from sprag_study.service.views.queries import parameter_fault
from sprag_study.worker.states import TransitionError

_log = logging.getLogger("sprag.service")


def _answer(request: Request, error: ApiError) -> Response:
    """The error as a page for a browser, as a problem document for everybody else."""
    return problem_page(request, error) or problem_response(error)


def _known(request: Request, error: Exception) -> Response:
    found = as_api_error(error)
    assert found is not None
    if found.type.status >= 500:
        _log.warning("%s %s: %s", request.method, request.url.path, found.detail)
    return _answer(request, found)


def _unknown(request: Request, error: Exception) -> Response:
    _log.error("%s %s failed", request.method, request.url.path, exc_info=error)
    # The framework passes the exception on to the server, which then closes the connection; the client must know.
    detail = Sentence("The service failed to answer; the fault is in its log.")
    return _answer(request, ApiError("internal", detail, headers={"Connection": "close"}))


def _http(request: Request, error: Exception) -> Response:
    raised = cast("HTTPException", error)
    only_sent_to = raised.status_code == 405 and request.method == "GET" and wants_page(request)
    if raised.status_code == 404 or only_sent_to:  # what forms are sent to is no page
        return _answer(
            request, ApiError("not-found", Sentence("There is nothing at {address}.", address=shown(request.url.path)))
        )
    if raised.status_code == 405:
        methods = ", ".join(sorted(_methods_at(request.app, request.url.path)))
        if request.method == "OPTIONS":
            return Response(status_code=204, headers={"Allow": methods})
        detail = Sentence("{method} is not possible here; possible: {methods}.", method=request.method, methods=methods)
        return _answer(request, ApiError("method-not-allowed", detail, headers={"Allow": methods}))
    if raised.status_code < 500:
        return _answer(request, ApiError("bad-request", str(raised.detail)))
    return _unknown(request, error)


def _left(request: Request, _: Exception) -> Response:
    """An answer for the log and the metrics only; the client has disconnected."""
    return _answer(request, ApiError("bad-request", "The connection ended before the request was complete."))


def _methods_at(app: FastAPI, path: str) -> set[str]:
    """Every method that any route accepts at ``path``; the framework itself names those of one route only."""
    found: set[str] = set()
    for route in app.routes:
        if isinstance(route, Route) and route.path_regex.match(path):
            found |= route.methods or set()
    return found | {"OPTIONS"} | ({"HEAD"} if "GET" in found else set())


def _invalid(request: Request, error: Exception) -> Response:
    raised = cast("RequestValidationError", error)
    items = tuple(parameter_fault(fault) for fault in raised.errors())
    detail = "; ".join(f"{item.where}: {item.message}" for item in items)
    return _answer(request, ApiError("invalid-parameter", detail, items))


def install(app: FastAPI) -> None:
    """Install the error handlers of ``app``."""
    handled: Iterable[tuple[type[Exception], Callable[[Request, Exception], Response]]] = (
        *((kind, _known) for kind in (FaultError, TransitionError, StoreError)),
        (ClientDisconnect, _left),
        (HTTPException, _http),
        (RequestValidationError, _invalid),
        (Exception, _unknown),
    )
    for kind, handler in handled:
        app.add_exception_handler(kind, _asynchronous(handler))


def _asynchronous(handler: Callable[[Request, Exception], Response]) -> Any:
    # Plain functions would run in a thread; these only build a small document.
    async def handle(request: Request, error: Exception) -> Response:
        return handler(request, error)

    return handle
