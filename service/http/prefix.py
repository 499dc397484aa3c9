"""A service behind a proxy at a path of its own, such as ``https://tools.example/sprag/``.

Inside the service addresses have no prefix. It is taken off requests as they come in, and added where addresses leave
the service: to links in JSON (`here`), to attributes of pages (`web.templates`), to headers of answers (`Prefixed`).
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from starlette.datastructures import MutableHeaders

from sprag_study.service.http.current import current, knowing

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

#: Targets of a Link header, and the path of a cookie.
_TARGET: Final = re.compile(r"(?<=<)/(?!/)[^>]*(?=>)")
_COOKIE_PATH: Final = re.compile(r"(?<=; path=)/(?=;|$)", re.IGNORECASE)


def here(address: str) -> str:
    """An address of this service as clients see it.

    Addresses of other services, relative ones, and those that have the prefix already stay as they are.
    """
    prefix = current().prefix
    if not prefix or not address.startswith("/") or address.startswith("//"):
        return address
    return address if f"{address}/".startswith((f"{prefix}/", f"{prefix}?")) else prefix + address


class Prefixed:
    """ASGI application around the service that takes ``prefix`` off requests, and adds it to headers of answers.

    A request without the prefix is answered, too: the proxy may have taken it off, and health checks need none.
    """

    def __init__(self, app: ASGIApp, prefix: str) -> None:
        self._app = app
        self._prefix = prefix

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or not self._prefix:
            await self._app(scope, receive, send)
            return
        path: str = scope["path"]
        if f"{path}/".startswith(f"{self._prefix}/"):
            scope = {**scope, "path": path.removeprefix(self._prefix) or "/"}
            raw = scope.get("raw_path")
            if raw is not None:
                scope["raw_path"] = raw.removeprefix(self._prefix.encode("ascii")) or b"/"

        async def prefixed(message: Message) -> None:
            if message["type"] == "http.response.start":
                self._complete(MutableHeaders(scope=message))
            await send(message)

        with knowing(prefix=self._prefix):
            await self._app(scope, receive, prefixed)

    def _complete(self, headers: MutableHeaders) -> None:
        """Add the prefix to the addresses in the headers."""
        if location := headers.get("location"):
            headers["location"] = here(location)
        if link := headers.get("link"):
            headers["link"] = _TARGET.sub(lambda target: here(target[0]), link)
        if cookies := headers.getlist("set-cookie"):
            del headers["set-cookie"]
            for cookie in cookies:  # of this service only, not of others on the same host
                headers.append("set-cookie", _COOKIE_PATH.sub(self._prefix, cookie))
