"""Answers compressed by gzip for clients that take them: text, JSON, drawings; not files that are compressed."""

from __future__ import annotations

from typing import Final

from starlette.datastructures import MutableHeaders
from starlette.middleware.gzip import DEFAULT_EXCLUDED_CONTENT_TYPES, GZipMiddleware
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from sprag.service import formats

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
        self._app = GZipMiddleware(app, _LEAST_BYTES, _LEVEL, exclude_content_types=_EXCLUDED)

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

        await self._app(scope, receive, weakened)
