"""Reading of requests: bodies through the spec's strict reader; unknown query parameters are refused."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated

from fastapi import Depends, Header, Request
from fastapi.dependencies.models import Dependant
from werkzeug.http import parse_etags

from sprag_study.service.faults import ParameterFault, shown
from sprag_study.service.http.problems import ApiError
from sprag_study.service.reading.texts import did_you_mean
from sprag_study.service.spec.report import SpecError
from sprag_study.service.spec.text import Body, Format

_FORMATS: dict[str, Format] = {"application/json": "json", "application/toml": "toml"}


async def _body(request: Request) -> Body:
    """The body of ``request``, JSON or TOML by its content type; ApiError 415 for any other."""
    declared = request.headers.get("content-type", "")
    media_type, _, parameters = declared.partition(";")
    form = _FORMATS.get(media_type.strip().lower())
    charset = parameters.partition("charset=")[2].partition(";")[0].strip(' "').lower()
    if form is None or charset not in ("", "utf-8", "utf8"):
        allowed = " or ".join(_FORMATS)
        item = ParameterFault(
            "Content-Type",
            "invalid-choice",
            "is not a supported content type",
            value=shown(declared),
            allowed=f"{allowed}, in UTF-8",
        )
        raise ApiError(
            "unsupported-media-type",
            f"The body must be {allowed}, in UTF-8.",
            (item,),
            headers={"Accept": ", ".join(_FORMATS)},
        )
    return Body(await request.body(), form)


#: The raw body of a request, within the size limit of the guard.
Received = Annotated[Body, Depends(_body)]

#: Header by which a change or deletion is meant for what the client has read, and for nothing else.
IfMatch = Annotated[
    str | None,
    Header(
        alias="If-Match",
        max_length=1000,
        description="`etag` of what was read, or the header ETag of its answer: where it was changed since, nothing is "
        "done; `*`: whatever it is by now",
        examples=["*"],
    ),
]


def editions(if_match: str | None) -> frozenset[str] | None:
    """The editions that the header If-Match names; None where any will do.

    A tag of an answer about the whole object continues after the edition with a point. Compressed answers have the weak
    form of their tag, which counts as well.
    """
    tags = None if if_match is None else parse_etags(if_match)
    if tags is None or tags.star_tag:
        return None
    return frozenset((tag or "").partition(".")[0] for tag in tags.as_set(include_weak=True))


@contextmanager
def as_body_problems() -> Iterator[None]:
    """Convert the faults of a body that is not a spec to an ApiError."""
    try:
        yield
    except SpecError as error:
        raise ApiError("invalid-body", str(error), error.faults) from error


async def strict_query(request: Request) -> None:
    """Refuse unknown query parameters, so that misspelled ones are noticed, and repeated ones that may occur only once.

    A header that the operation reads, such as an Idempotency-Key, is refused when it occurs twice.
    """
    dependant = request.scope["route"].dependant
    known = _query_parameters(dependant)
    faults = []
    for name in (field.alias for field in dependant.header_params):
        values = request.headers.getlist(name)
        if len(values) > 1:
            faults.append(
                ParameterFault(name, "repeated", "given more than once", value=shown(values[1]), allowed="one value")
            )
    for name in request.query_params:
        values = request.query_params.getlist(name)
        if name not in known:
            allowed = ", ".join(known) or "no query parameter"
            message = f"unknown query parameter{did_you_mean(name, known)}"
            faults.append(
                ParameterFault(shown(name), "unknown-field", message, value=shown(values[0]), allowed=allowed)
            )
        elif len(values) > 1 and not known[name]:
            faults.append(
                ParameterFault(name, "repeated", "given more than once", value=shown(values[1]), allowed="one value")
            )
    if faults:
        detail = "; ".join(f"{item.where}: {item.message}" for item in faults)
        raise ApiError("invalid-parameter", detail, tuple(faults))


def _query_parameters(dependant: Dependant) -> dict[str, bool]:
    """Names of the query parameters of an operation, and whether each may be repeated."""
    known = {field.alias: "list" in str(field.field_info.annotation) for field in dependant.query_params}
    for inner in dependant.dependencies:
        known |= _query_parameters(inner)
    return known
