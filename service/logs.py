"""Logs: one line per event, as plain text for people or as JSON for machines, with the ids of request and studies."""

from __future__ import annotations

import json
import logging
import re
import secrets
import sys
import time
from collections.abc import Callable
from contextvars import ContextVar
from datetime import UTC, datetime
from typing import Final, Literal

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

LogFormat = Literal["text", "json"]
#: Called with method, pattern of the address, status and seconds of every request that was answered.
Observer = Callable[[str, str, int, float], None]

#: The id of the request that is being answered; "" outside of any.
REQUEST_ID: ContextVar[str] = ContextVar("request_id", default="")
REQUEST_HEADER: Final = "X-Request-ID"
_REQUESTS = logging.getLogger("sprag.requests")
_GIVEN_ID: Final = re.compile(r"[A-Za-z0-9_-]{1,64}")
_STUDY_ID: Final = re.compile(r"\bst_[0-9a-f]{16}\b")
#: The address of a request that no route takes.
NO_ROUTE: Final = "(none)"
_API: Final = "/api/v1"


def configure(form: LogFormat, *, requests: bool) -> None:
    """Send the log of this process to standard error in that form, with a line for every request where that is asked.

    What the program says begins at level INFO, what libraries say at WARNING.
    """
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(JsonFormatter() if form == "json" else TextFormatter())
    logging.basicConfig(level=logging.WARNING, handlers=[handler])
    logging.getLogger("sprag").setLevel(logging.INFO)
    _REQUESTS.setLevel(logging.INFO if requests else logging.WARNING)


def _time(record: logging.LogRecord) -> str:
    return datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds")


class TextFormatter(logging.Formatter):
    """A record as a line for people: time (UTC), level, message; what it was caused by on the lines below."""

    def __init__(self) -> None:
        super().__init__("%(asctime)s %(levelname)s %(message)s")

    def formatTime(self, record: logging.LogRecord, datefmt: str | None = None) -> str:  # noqa: N802, ARG002
        """Time of the record as ISO 8601 has it."""
        return _time(record)


class JsonFormatter(logging.Formatter):
    """A record as one JSON object on one line: time, level, logger, message, and where known request and studies."""

    def format(self, record: logging.LogRecord) -> str:
        """The line; fields given as ``extra={"fields": {...}}`` stand in it too."""
        message = record.getMessage()
        line: dict[str, object] = {
            "time": _time(record),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": message,
        }
        fields = getattr(record, "fields", None)
        if isinstance(fields, dict):
            line |= fields
        if request := REQUEST_ID.get():
            line["request"] = request
        noted = line.pop("studies", [])
        found = [*_STUDY_ID.findall(f"{message} {line.get('path', '')}"), *(noted if isinstance(noted, list) else [])]
        if found:
            line["studies"] = list(dict.fromkeys(found))
        if record.exc_info:
            line["exception"] = self.formatException(record.exc_info)
        return json.dumps(line, ensure_ascii=True, default=str)


class RequestLog:
    """ASGI application around everything: gives each request an id, tells how it went to the log and to ``observe``.

    The id is that of the header X-Request-ID where a proxy gave one, and stands in the same header of the answer.
    """

    def __init__(self, app: ASGIApp, observe: Observer) -> None:
        self._app = app
        self._observe = observe

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        given = Headers(scope=scope).get(REQUEST_HEADER, "")
        request_id = given if _GIVEN_ID.fullmatch(given) else secrets.token_hex(8)
        began, status = time.perf_counter(), 0
        # The framework notes the route in a copy of the scope, so it is noted where both can see it.
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

        token = REQUEST_ID.set(request_id)
        try:
            await self._app(scope, receive, noted)
        finally:
            seconds = time.perf_counter() - began
            route = seen.get("route", NO_ROUTE)
            self._observe(scope["method"], route, status, seconds)
            _REQUESTS.info(
                "%s %s %d in %.1f ms", scope["method"], _plain(scope["path"]), status, 1e3 * seconds,
                extra={
                    "fields": {
                        "method": scope["method"],
                        "path": _plain(scope["path"]),
                        "status": status,
                        "milliseconds": round(1e3 * seconds, 3),
                        # A study that was submitted stands in no address but that of the answer.
                        "studies": _STUDY_ID.findall(seen.get("made", "")),
                    }
                },
            )  # fmt: skip
            REQUEST_ID.reset(token)


class Noted:
    """ASGI application right around the routes: notes which of them took the request, for `RequestLog`."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        try:
            await self._app(scope, receive, send)
        finally:
            if scope["type"] == "http":
                scope.get("sprag.seen", {})["route"] = pattern_of(scope)


def pattern_of(scope: Scope) -> str:
    """The pattern of the route that took the request, so that ids in addresses make no new one."""
    pattern = str(getattr(scope.get("route"), "path_format", NO_ROUTE))
    # A route of the interface knows its address without the prefix that all of them have.
    inside = scope["path"].startswith(_API) and pattern.startswith("/") and not pattern.startswith(_API)
    return _API + pattern if inside else pattern


def _plain(path: str) -> str:
    """A path without characters that would break a line of the log or steer a terminal."""
    return path if path.isprintable() and path.isascii() else ascii(path)[1:-1]
