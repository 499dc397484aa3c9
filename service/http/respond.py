"""Writing of answers: JSON without NaN, entity tags, formats by query or by Accept."""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any, TypeVar
from urllib.parse import urlencode

from starlette.concurrency import iterate_in_threadpool
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse
from werkzeug.datastructures import MIMEAccept
from werkzeug.http import parse_accept_header, parse_etags

from sprag import service
from sprag.service.faults import choice_of, shown
from sprag.service.http.problems import ApiError
from sprag.service.json_text import to_bytes
from sprag.worker.models import source_hash

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


def streamed(pieces: Iterable[bytes], media_type: str, filename: str) -> StreamingResponse:
    """A file sent piece by piece; the pieces are made in a thread, so that the service stays responsive.

    The first piece is made here, so that earlier errors still become problem documents.
    """
    headers = {"Content-Disposition": f'attachment; filename="{filename}"', "Vary": "Accept"}
    rest = iter(pieces)
    whole = itertools.chain([next(rest, b"")], rest)
    return StreamingResponse(iterate_in_threadpool(whole), media_type=media_type, headers=headers)


def choose_format(request: Request, wanted: str | None, media_types: Mapping[Form, str]) -> Form:
    """The format of the answer: ``wanted`` (the query's ``format``), else the one preferred by Accept, else the first.

    A type that Accept names precedes one that it only allows (``image/*``, ``*/*``). Raises ApiError when the query
    names an unknown format, and when Accept allows none.
    """
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
