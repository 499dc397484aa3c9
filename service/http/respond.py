"""How an answer is written: JSON without NaN, entity tags, formats by query or by Accept."""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from starlette.concurrency import iterate_in_threadpool
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse

from sprag.service.faults import parameter_error, shown
from sprag.service.http.problems import ApiError
from sprag.service.json_text import to_bytes

JSON = "application/json"


def json_response(data: Any, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    """``data`` as a JSON answer; NaN in it is a fault of the program."""
    return Response(to_bytes(data), status_code=status, media_type=JSON, headers=dict(headers or {}))


def entity_tag(*parts: object) -> str:
    """A strong entity tag of what decides an answer."""
    return '"' + hashlib.sha256("\n".join(map(str, parts)).encode("utf-8", "backslashreplace")).hexdigest()[:32] + '"'


def not_modified(request: Request, tag: str) -> Response | None:
    """The answer 304 when the client has the version of ``tag`` already (If-None-Match), else None."""
    held = [item.strip() for value in request.headers.getlist("if-none-match") for item in value.split(",")]
    if "*" in held or any(item.removeprefix("W/") == tag for item in held):
        return Response(status_code=304, headers={"ETag": tag, "Vary": "Accept"})
    return None


def tagged(response: Response, tag: str) -> Response:
    """``response`` with its entity tag."""
    response.headers["ETag"] = tag
    response.headers["Vary"] = "Accept"
    return response


def streamed(pieces: Iterable[bytes], media_type: str, filename: str) -> StreamingResponse:
    """A file sent piece by piece; the pieces are made in a thread, so that the service goes on answering.

    The first is made here, so that what goes wrong before it still becomes a problem document.
    """
    headers = {"Content-Disposition": f'attachment; filename="{filename}"', "Vary": "Accept"}
    rest = iter(pieces)
    whole = itertools.chain([next(rest, b"")], rest)
    return StreamingResponse(iterate_in_threadpool(whole), media_type=media_type, headers=headers)


def choose_format(request: Request, wanted: str | None, media_types: Mapping[str, str]) -> str:
    """The format of the answer: ``wanted`` (the query's ``format``), else the one Accept likes best, else the first.

    A type that Accept names goes before one that it only allows (``image/*``, ``*/*``). Raises ApiError when the query
    names a format that there is not, and when Accept allows none.
    """
    formats: Sequence[str] = tuple(media_types)
    if wanted is not None:
        if wanted not in media_types:
            raise parameter_error("format", "there is no such format", wanted, ", ".join(formats))
        return wanted
    by_type = {media.partition(";")[0]: name for name, media in reversed(list(media_types.items()))}
    accept = ",".join(request.headers.getlist("accept"))
    liked = _liked(accept)
    named = {by_type[media]: quality for media, quality in liked.items() if media in by_type}
    best = max(named, key=lambda name: named[name], default=None)
    if best is not None and named[best] > 0:
        return best
    ranges = {media for media, quality in liked.items() if quality > 0}
    for name, media in media_types.items():
        if name not in named and ranges & {"*/*", media.partition("/")[0] + "/*"}:
            return name
    if liked:
        detail = f"Accept is {shown(accept)}; the answer can be {', '.join(by_type)}."
        raise ApiError("not-acceptable", detail)
    return formats[0]


def _liked(accept: str) -> dict[str, float]:
    """Media types and ranges of an Accept header with their quality; what cannot be read is left out."""
    found: dict[str, float] = {}
    for item in accept.split(","):
        media, *parameters = (part.strip().lower() for part in item.split(";"))
        quality = _quality(parameters)
        if "/" in media and quality is not None:
            found.setdefault(media, quality)
    return found


def _quality(parameters: Iterable[str]) -> float | None:
    for parameter in parameters:
        name, _, value = parameter.partition("=")
        if name.strip() == "q":
            try:
                return float(value)
            except ValueError:
                return None
    return 1.0
