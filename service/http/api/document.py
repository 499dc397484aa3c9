"""OpenAPI documentation of bodies, problems and security, uniform for all operations."""

from __future__ import annotations

from collections.abc import Iterable
from http import HTTPStatus
from typing import Any, Final, cast

from fastapi import FastAPI, Header, Query
from fastapi.openapi.utils import get_openapi
from starlette.responses import Response
from typing_extensions import is_typeddict

from sprag_study.service.answers import catalogue, people, results, saved_views, schedules, studies
from sprag_study.service.faults import Fault, Kind, ParameterFault
from sprag_study.service.http.api.answer_examples import add_answers
from sprag_study.service.http.api.links import add_links
from sprag_study.service.http.api.plain_schema import plain_schema
from sprag_study.service.http.asked import one_of
from sprag_study.service.http.problems import PROBLEM_MEDIA_TYPE, PROBLEM_TYPES, Problem, ProblemType, problem_json
from sprag_study.service.http.views import API_PREFIX
from sprag_study.service.http.work import CHECK_PROBLEMS

_METRICS: Final = "/metrics"
_SCHEMAS: Final = "#/components/schemas/"
#: Problems that any operation of the API may answer with.
_EVERYWHERE: Final = ("unauthorized", "too-many-attempts", "wrong-host", "internal", "unavailable")
#: Problems of operations that run one case of a study again.
CASE_PROBLEMS: Final = (
    "invalid-parameter", "study-not-found", "case-not-found", "not-found", "not-acceptable", "not-computed",
    "timed-out", "too-many-requests", "unavailable",
)  # fmt: skip
#: Problems of operations that read a body which is no spec.
BODY_PROBLEMS: Final = (
    "invalid-parameter", "invalid-body", "body-too-large", "unsupported-media-type", *CHECK_PROBLEMS,
)  # fmt: skip
_UNSAFE: Final = ("cross-site", "read-only", "too-slow")

_TEXT: Final = {"type": "string"}
_RETRY: Final = {
    "Retry-After": {
        "description": "seconds after which another attempt is worthwhile",
        "required": True,
        "schema": {"type": "integer", "minimum": 0},
    }
}
_TAG: Final = {"ETag": {"description": "entity tag of the version", "required": True, "schema": _TEXT}}

Responses = dict[int | str, dict[str, Any]]

for _module in (catalogue, people, results, saved_views, schedules, studies):
    for _shape in filter(is_typeddict, vars(_module).values()):
        _shape.__pydantic_config__ = {"extra": "forbid"}  # an answer has exactly these fields


def problems(*slugs: str) -> Responses:
    """Documentation of the problems an operation may answer with, by status, each with an example."""
    by_status: dict[int, list[ProblemType]] = {}
    for slug in slugs:
        kind = PROBLEM_TYPES[cast("Kind", slug)]
        by_status.setdefault(kind.status, []).append(kind)
    return {status: _problem_response(status, kinds) for status, kinds in sorted(by_status.items())}


def _problem_response(status: int, kinds: Iterable[ProblemType]) -> dict[str, Any]:
    examples = {
        kind.slug: {"summary": kind.title, "value": problem_json(kind, kind.help, _EXAMPLE_ERRORS.get(kind.slug, ()))}
        for kind in kinds
    }
    content = {"schema": {"$ref": _SCHEMAS + "Problem"}, "examples": examples}
    answer = {"description": HTTPStatus(status).phrase, "content": {PROBLEM_MEDIA_TYPE: content}}
    return {**answer, "headers": _RETRY} if status in (429, 503) else answer


_EXAMPLE_ERRORS: Final = {
    "invalid-spec": (
        Fault(
            "/base/pendulums/0/inertia",
            "out-of-range",
            "is out of range",
            value=-0.001,
            allowed="> 0 kg*m^2",
            unit="kg*m^2",
        ),
    ),
    "invalid-body": (Fault("/accuracy", "required", "is missing", allowed="> 0 N*m", unit="N*m"),),
    "invalid-parameter": (
        ParameterFault("page_size", "out-of-range", "must be at most 1000", value=5000, allowed="1 .. 1000"),
    ),
    "invalid-selection": (
        ParameterFault(
            "at",
            "unknown-value",
            "the axis has no such value",
            value="shaft.load=0.7",
            allowed="0.02, 0.1, 0.3",
            unit="N*m",
        ),
    ),
}


def key_header(example: str, once: str) -> Any:
    """The idempotency key header; ``once`` describes its effect."""
    return Header(
        alias="Idempotency-Key",
        min_length=1,
        max_length=200,
        pattern=r"^[!-~]+$",
        description=once,
        examples=[example],
    )


def body(examples: dict[str, Any], schema: str, toml: str | None = None) -> dict[str, Any]:
    """``openapi_extra`` for an operation that reads its own body.

    ``examples`` are whole JSON bodies by name, ``schema`` is the name of theirs among the components of the document.
    """
    named = {name: {"summary": name, "value": value} for name, value in examples.items()}
    content: dict[str, Any] = {"application/json": {"schema": {"$ref": _SCHEMAS + schema}, "examples": named}}
    if toml is not None:
        content["application/toml"] = {"schema": {"type": "string"}, "examples": {"TOML": {"value": toml}}}
    return {"requestBody": {"required": True, "content": content}}


#: What the operations that delete something have in common.
DELETES: Final[dict[str, Any]] = {"status_code": 204, "response_class": Response}


def files(description: str, media_types: Iterable[str]) -> Responses:
    """Documentation of an answer 200 that is a file in one of several formats."""
    return {200: {"description": description, "content": {media.partition(";")[0]: {} for media in media_types}}}


def not_modified() -> Responses:
    """Documentation of the answer to a conditional request."""
    return {304: {"description": "The version named by If-None-Match is current.", "headers": _TAG}}


CONTENT_RANGE: Final = {
    "Content-Range": {"description": "first and last byte, and size of the file", "required": True, "schema": _TEXT}
}


def located(status: int) -> Responses:
    """Documentation of the answer with the location of the new resource."""
    return {status: {"headers": {"Location": {"description": "its address", "required": True, "schema": _TEXT}}}}


def next_page() -> Responses:
    """Documentation of the header of a page that is not the last one."""
    link = {"description": 'address of the next page, with `rel="next"`; none on the last', "schema": _TEXT}
    return {200: {"headers": {"Link": link}}}


def format_query(names: Iterable[str], example: str = "json") -> Any:
    """The query parameter that chooses one of several formats of the answer."""
    known = list(map(str, names))
    description = f"format of the answer, else that of `Accept`: {', '.join(known)}"
    return Query(alias="format", description=description, examples=[example], json_schema_extra=one_of(known))


def build_openapi(app: FastAPI, extra_schemas: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """The OpenAPI 3.1 document of ``app`` at the path ``prefix``; ``extra_schemas`` are components of its bodies."""
    document = get_openapi(
        title=app.title,
        version=app.version,
        openapi_version="3.1.0",
        summary=app.summary,
        description=app.description,
        routes=app.routes,
        tags=app.openapi_tags,
        servers=[{"url": prefix or "/", "description": "this service"}],
        contact={"name": "whoever runs this service"},
    )
    schemas = document.setdefault("components", {}).setdefault("schemas", {})
    problem = Problem.model_json_schema(ref_template=_SCHEMAS + "{model}")
    schemas.update(problem.pop("$defs"))
    schemas["Problem"] = problem
    schemas.update({name: plain_schema(schema) for name, schema in extra_schemas.items()})
    document["components"]["securitySchemes"] = {
        "bearer": {"type": "http", "scheme": "bearer", "description": "needed when the service has a token"}
    }
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            guarded = path.startswith(API_PREFIX) or path == _METRICS
            operation["security"] = [{"bearer": []}, {}] if guarded else []
            if path.startswith(API_PREFIX):
                unsafe = method in ("post", "patch", "delete")
                everywhere = problems(*_EVERYWHERE, *((*_UNSAFE, *_of_owner(path, operation)) if unsafe else ()))
                for status, response in everywhere.items():
                    _merge(operation["responses"], str(status), response)
    add_links(document)
    add_answers(document)
    return document


def _of_owner(path: str, operation: dict[str, Any]) -> tuple[str, ...]:
    """Problems of an operation that submits a study, or changes what belongs to somebody."""
    busy = operation["responses"].get(429, operation["responses"].get("429", {})).get("content", {})
    if "queue-full" in busy.get(PROBLEM_MEDIA_TYPE, {}).get("examples", {}):
        return ("quota-exceeded",)
    return ("not-owner",) if "{" in path else ()


def _merge(responses: dict[str, Any], status: str, response: dict[str, Any]) -> None:
    if status not in responses:
        responses[status] = response
        return
    examples = responses[status]["content"][PROBLEM_MEDIA_TYPE]["examples"]
    examples.update(response["content"][PROBLEM_MEDIA_TYPE]["examples"])
