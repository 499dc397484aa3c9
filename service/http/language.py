"""The language of a request for a page: that of its address, of the browser's cookie, or the first that it accepts.

The interface for programs answers in English, unless a route of its own takes a language.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final
from urllib.parse import parse_qs

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import HTTPConnection
from werkzeug.datastructures import LanguageAccept
from werkzeug.http import parse_accept_header

from sprag_study.service import languages

if TYPE_CHECKING:
    from starlette.responses import Response
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

COOKIE: Final = "sprag_language"
#: Parameter of addresses that chooses a language.
PARAMETER: Final = "language"
_ENGLISH_ONLY: Final = ("/api/", "/static/")
_YEAR: Final = 365 * 24 * 3600


class InLanguage:
    """ASGI application around another one, whose pages are in the reader's language; ``Vary`` says what decides it."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or scope["path"].startswith(_ENGLISH_ONLY):
            await self._app(scope, receive, send)
            return

        async def varying(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                headers.add_vary_header("Accept-Language")
                headers.add_vary_header("Cookie")
            await send(message)

        with languages.language(_wanted(scope)):
            await self._app(scope, receive, varying)


def _wanted(scope: Scope) -> str:
    headers = Headers(scope=scope)
    query = parse_qs(scope.get("query_string", b"").decode("latin-1")).get(PARAMETER, [""])[-1]
    for code in (query, HTTPConnection(scope).cookies.get(COOKIE, "")):
        if code in languages.available():
            return code
    return _accepted(headers.get("accept-language", ""))


@lru_cache(maxsize=256)
def _accepted(header: str) -> str:
    """The first available language of a header Accept-Language; English where it has none."""
    accepted = parse_accept_header(header, LanguageAccept)
    return accepted.best_match(languages.available()) or languages.ENGLISH


def language_pairs() -> list[tuple[str, str]]:
    """The language of the page that is made as a parameter of the addresses of its files; nothing for English."""
    return [] if languages.current() == languages.ENGLISH else [(PARAMETER, languages.current())]


def keep_language(response: Response, code: str) -> None:
    """Keep the language in the browser."""
    response.set_cookie(COOKIE, code, max_age=_YEAR, httponly=True, samesite="lax")
