"""The log of requests: each gets an id, and its outcome is a line of the log."""

from __future__ import annotations

import re
import secrets
import time
from collections.abc import Callable
from typing import Final, Protocol

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from sprag_study.service.logs import CALLER, REQUEST_ID, REQUESTS, STUDY_ID, note_caller

REQUEST_HEADER: Final = "X-Request-ID"
_GIVEN_ID: Final = re.compile(r"[A-Za-z0-9_-]{1,64}")
#: The pattern of a request that matches no route.
NO_ROUTE: Final = "(none)"
_API: Final = "/api/v1"


class Observer(Protocol):
    """What counts requests."""

    def begun(self) -> None:
        """A request that will be answered."""

    def answered(self, method: str, route: str, status: int, seconds: float) -> None:
        """The answer; ``route`` is the pattern of the URL."""


class RequestLog:
    """Outermost ASGI application: gives each request an id and reports its outcome to the log and to ``observer``.

    The id is taken from the header X-Request-ID where a proxy sent one, and is returned in the same header.
    ``address_of`` gives the address of the client, which a trusted proxy may forward.
    """

    def __init__(self, app: ASGIApp, observer: Observer, address_of: Callable[[Scope], str]) -> None:
        self._app = app
        self._address_of = address_of
        self._observer = observer

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        given = Headers(scope=scope).get(REQUEST_HEADER, "")
        request_id = given if _GIVEN_ID.fullmatch(given) else secrets.token_hex(8)
        began, status = time.perf_counter(), 0
        # The framework records the route in a copy of the scope, so it is recorded in a shared object.
        seen: dict[str, str] = {}
        scope["sprag.seen"] = seen

        async def noted(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                headers = MutableHeaders(scope=message)
                headers[REQUEST_HEADER] = request_id
                seen["made"] = headers.get("location", "")
            await send(message)

        token, caller = REQUEST_ID.set(request_id), CALLER.set({})
        note_caller(address=self._address_of(scope))
        self._observer.begun()
        try:
            await self._app(scope, receive, noted)
        finally:
            seconds = time.perf_counter() - began
            route = seen.get("route", NO_ROUTE)
            self._observer.answered(scope["method"], route, status, seconds)
            REQUESTS.info(
                "%s %s %d in %.1f ms", scope["method"], _plain(scope["path"]), status, 1e3 * seconds,
                extra={
                    "fields": {
                        "method": scope["method"],
                        "path": _plain(scope["path"]),
                        "status": status,
                        "milliseconds": round(1e3 * seconds, 3),
                        # The id of a new study appears only in the location of the answer.
                        "studies": STUDY_ID.findall(seen.get("made", "")),
                    }
                },
            )  # fmt: skip
            REQUEST_ID.reset(token)
            CALLER.reset(caller)


class Noted:
    """ASGI application directly around the routes: records the matching route for `RequestLog`."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        try:
            await self._app(scope, receive, send)
        finally:
            if scope["type"] == "http":
                scope.get("sprag.seen", {})["route"] = pattern_of(scope)


def pattern_of(scope: Scope) -> str:
    """The pattern of the matching route, which contains no ids."""
    pattern = str(getattr(scope.get("route"), "path_format", NO_ROUTE))
    # The path of an API route lacks the common prefix.
    inside = scope["path"].startswith(_API) and pattern.startswith("/") and not pattern.startswith(_API)
    return _API + pattern if inside else pattern


def _plain(path: str) -> str:
    """A path in ASCII, with escapes of other characters."""
    return path if path.isprintable() and path.isascii() else ascii(path)[1:-1]
