"""Answers compressed by gzip for clients that take them: text, JSON, drawings; not files that are compressed."""

from __future__ import annotations

import zlib
from typing import Final

from starlette.datastructures import Headers, MutableHeaders
from starlette.middleware.gzip import DEFAULT_EXCLUDED_CONTENT_TYPES, GZipResponder
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from werkzeug.datastructures import Accept
from werkzeug.http import parse_accept_header

from sprag_study.service import formats
from sprag_study.service.http.threads import Threads, in_thread

#: Shorter answers are not worth it.
_LEAST_BYTES: Final = 1000
#: A fourth of the time of the highest level, for files a few percent longer.
_LEVEL: Final = 4
_EXCLUDED: Final = (
    *DEFAULT_EXCLUDED_CONTENT_TYPES,
    "application/pdf",
    *(formats.MEDIA_TYPES[form] for form in ("parquet", "arrow", "xlsx", "netcdf")),
)


class Compression:
    """ASGI application around another one, whose answers it compresses."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def weakened(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                if "accept-encoding" not in headers.get("vary", "").lower():
                    # HEAD, parts of files and short answers are not compressed, but the same address may be.
                    headers.add_vary_header("Accept-Encoding")
                tag = headers.get("etag", "")
                if headers.get("content-encoding") == "gzip" and tag.startswith('"'):
                    # Other bytes than those of the plain answer must not have its strong tag: ranges rely on it.
                    headers["etag"] = f"W/{tag}"
            await send(message)

        app: ASGIApp = self._app
        if scope["type"] == "http" and _takes_gzip(Headers(scope=scope)):
            app = _Packed(app, _LEAST_BYTES, _LEVEL, exclude_content_types=_EXCLUDED)
        await app(scope, receive, weakened)


class _Packed(GZipResponder):
    """Compresses what is long in few threads; those of the framework, 40, would leave the others no processor."""

    async def apply_compression(self, body: bytes, *, more_body: bool) -> bytes:
        """As `GZipResponder.apply_compression`; pieces of files wait for each other, and answers do not for them."""
        if len(body) < self.thread_minimum_size:
            return await super().apply_compression(body, more_body=more_body)
        return await in_thread(self._pack, body, more_body, threads=Threads.PIECES if more_body else Threads.ANSWERS)

    def _pack(self, body: bytes, more_body: bool) -> bytes:
        end = zlib.Z_SYNC_FLUSH if more_body else zlib.Z_FINISH
        return self.compressor.compress(body) + self.compressor.flush(end)


def _takes_gzip(headers: Headers) -> bool:
    """Whether a client takes gzip, and likes plain answers no better (RFC 9110, section 12.5.3)."""
    accepted = parse_accept_header(", ".join(headers.getlist("accept-encoding")), Accept)
    return 0.0 < accepted.quality("gzip") >= accepted.quality("identity")
