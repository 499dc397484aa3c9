"""Writing of answers: JSON without NaN, entity tags, formats by query or by Accept."""

from __future__ import annotations

import hashlib
from collections.abc import AsyncGenerator, AsyncIterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, TypeVar
from urllib.parse import urlencode

from starlette.requests import Request
from starlette.responses import Response, StreamingResponse
from starlette.types import Receive, Scope, Send
from werkzeug.datastructures import MIMEAccept
from werkzeug.http import parse_accept_header, parse_etags

from sprag_study import service
from sprag_study.service.faults import choice_of, parameter_error, shown
from sprag_study.service.http.problems import ApiError
from sprag_study.service.json_text import to_bytes
from sprag_study.worker.models import source_hash

JSON = "application/json"

Form = TypeVar("Form", bound=str)


def json_response(data: Any, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    """``data`` as a JSON answer; NaN in it is a bug."""
    return Response(to_bytes(data), status_code=status, media_type=JSON, headers=dict(headers or {}))


def page_response(request: Request, data: Mapping[str, Any]) -> Response:
    """A page of a list as a JSON answer, whose header Link has the address of the next page."""
    token = data["next_page_token"]
    if token is None:
        return json_response(data)
    query = [(name, value) for name, value in request.query_params.multi_items() if name != "page_token"]
    address = f"{request.url.path}?{urlencode([*query, ('page_token', token)])}"
    return json_response(data, headers={"Link": f'<{address}>; rel="next"'})


@cache
def program_hash() -> str:
    """A hash of the service's sources: after an upgrade no client keeps answers that another version wrote."""
    return source_hash(Path(service.__file__).parent)


def entity_tag(*parts: object) -> str:
    """A strong entity tag derived from everything that determines an answer: ``parts`` and the program."""
    text = "\n".join(map(str, (program_hash(), *parts)))
    return '"' + hashlib.sha256(text.encode("utf-8", "backslashreplace")).hexdigest()[:32] + '"'


def edition_tag(edition: str, *parts: object) -> str:
    """The tag of an answer about the whole object of an ``edition`` that people edit (`requests.editions`)."""
    return f'"{edition}.{entity_tag(*parts)[1:]}'


def not_modified(request: Request, tag: str) -> Response | None:
    """The answer 304 when the client already has the version of ``tag`` (If-None-Match), otherwise None."""
    known = ",".join(request.headers.getlist("if-none-match"))
    if parse_etags(known).contains_weak(tag.strip('"')):
        # A compressed answer has the weak form of the tag (`compression`), and so has what stands for it.
        return Response(status_code=304, headers={"ETag": f"W/{tag}" if f"W/{tag}" in known else tag, "Vary": "Accept"})
    return None


def tagged(response: Response, tag: str) -> Response:
    """``response`` with its entity tag."""
    response.headers["ETag"] = tag
    response.headers["Vary"] = "Accept"
    return response


async def streamed(pieces: AsyncGenerator[bytes], media_type: str, filename: str) -> Response:
    """A file sent piece by piece, as they come; ``pieces`` is closed when its client leaves.

    The first piece is waited for here, so that earlier errors still become problem documents. A later error breaks the
    connection, so that no client takes a part for the whole.
    """
    first = await anext(pieces, b"")
    headers = {"Content-Disposition": f'attachment; filename="{filename}"', "Vary": "Accept"}
    return _Streamed(first, pieces, media_type, headers)


class _Streamed(StreamingResponse):
    """The answer, which closes its pieces however it ends."""

    def __init__(self, first: bytes, rest: AsyncGenerator[bytes], media_type: str, headers: dict[str, str]) -> None:
        async def pieces() -> AsyncIterator[bytes]:
            yield first
            async for piece in rest:
                yield piece

        super().__init__(pieces(), media_type=media_type, headers=headers)
        self._rest = rest

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send it; to who asks for the head only, nothing of it."""
        try:
            if scope.get("sprag.head"):
                await send({"type": "http.response.start", "status": self.status_code, "headers": self.raw_headers})
                await send({"type": "http.response.body", "body": b""})
            else:
                await super().__call__(scope, receive, send)
        finally:
            await self._rest.aclose()


def choose_format(request: Request, wanted: str | None, media_types: Mapping[Form, str]) -> Form:
    """The format of the answer: ``wanted`` (the query's ``format``), else the one preferred by Accept, else the first.

    A type that Accept names precedes one that it only allows (``image/*``, ``*/*``). Raises ApiError when the query
    names an unknown format, or has decimal commas for another one than CSV, and when Accept allows none.
    """
    form = _preferred(request, wanted, media_types)
    decimal = request.query_params.get("decimal", "point")
    if decimal != "point" and form != "csv":
        raise parameter_error("decimal", "not-used", "only CSV has it", decimal, "in csv")
    return form


def _preferred(request: Request, wanted: str | None, media_types: Mapping[Form, str]) -> Form:
    if wanted is not None:
        return choice_of("format", wanted, media_types)
    header = ",".join(request.headers.getlist("accept"))
    accept = parse_accept_header(header, MIMEAccept)
    by_type = {media.partition(";")[0]: name for name, media in reversed(list(media_types.items()))}
    if not any("/" in media for media, _ in accept):
        return next(iter(media_types))
    named = {media.lower() for media, quality in accept if quality > 0}
    best = max(reversed(by_type), key=lambda media: (media in named, accept.quality(media)))
    if accept.quality(best) > 0:
        return by_type[best]
    detail = f"Accept is {shown(header)}; the answer can be {', '.join(by_type)}."
    raise ApiError("not-acceptable", detail)
