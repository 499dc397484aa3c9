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
#: Called with method, pattern of the URL, status and seconds of every answered request.
Observer = Callable[[str, str, int, float], None]

#: The id of the current request; "" outside a request.
REQUEST_ID: ContextVar[str] = ContextVar("request_id", default="")
REQUEST_HEADER: Final = "X-Request-ID"
_REQUESTS = logging.getLogger("sprag.requests")
_GIVEN_ID: Final = re.compile(r"[A-Za-z0-9_-]{1,64}")
_STUDY_ID: Final = re.compile(r"\bst_[0-9a-f]{16}\b")
#: The pattern of a request that matches no route.
NO_ROUTE: Final = "(none)"
_API: Final = "/api/v1"


def configure(form: LogFormat, *, requests: bool) -> None:
    """Send the log of this process to standard error in that form, with a line for every request if ``requests``.

    The program logs from level INFO, libraries from WARNING.
    """
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(JsonFormatter() if form == "json" else TextFormatter())
    logging.basicConfig(level=logging.WARNING, handlers=[handler])
    logging.getLogger("sprag").setLevel(logging.INFO)
    _REQUESTS.setLevel(logging.INFO if requests else logging.WARNING)


def _time(record: logging.LogRecord) -> str:
    return datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds")


class TextFormatter(logging.Formatter):
    """A record as plain text: time (UTC), level, message; a traceback follows on further lines."""

    def __init__(self) -> None:
        super().__init__("%(asctime)s %(levelname)s %(message)s")

    def formatTime(self, record: logging.LogRecord, datefmt: str | None = None) -> str:  # noqa: N802, ARG002
        """Time of the record in ISO 8601."""
        return _time(record)


class JsonFormatter(logging.Formatter):
    """A record as one JSON object on one line: time, level, logger, message, and where known request and studies."""

    def format(self, record: logging.LogRecord) -> str:
        """The line, including fields given as ``extra={"fields": {...}}``."""
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
    """Outermost ASGI application: gives each request an id and reports its outcome to the log and to ``observe``.

    The id is taken from the header X-Request-ID where a proxy sent one, and is returned in the same header.
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
                        # The id of a new study appears only in the location of the answer.
                        "studies": _STUDY_ID.findall(seen.get("made", "")),
                    }
                },
            )  # fmt: skip
            REQUEST_ID.reset(token)


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
    """A path without characters that would break a log line or control a terminal."""
    return path if path.isprintable() and path.isascii() else ascii(path)[1:-1]
