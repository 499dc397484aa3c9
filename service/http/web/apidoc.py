"""The OpenAPI document in a form that a page can show: groups of operations with parameters, bodies and answers."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter of an operation: ``place`` is query, path or header; ``kind`` describes its values."""

    name: str
    place: str
    required: bool
    kind: str
    help: str
    example: str


@dataclass(frozen=True, slots=True)
class Answer:
    """An answer: its status, meaning and content types."""

    status: str
    meaning: str
    media: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Operation:
    """One operation; ``example`` is a body that it takes, or ""."""

    identifier: str
    method: str
    path: str
    help: str
    parameters: tuple[Parameter, ...]
    example: str
    answers: tuple[Answer, ...]


@dataclass(frozen=True, slots=True)
class Group:
    """Operations of one kind of resource."""

    name: str
    help: str
    operations: tuple[Operation, ...]


def groups(document: dict[str, Any]) -> list[Group]:
    """The operations of an OpenAPI document by their tags, in the document's order."""
    found = []
    for tag in document["tags"]:
        operations = tuple(
            _operation(path, method, operation)
            for path, methods in document["paths"].items()
            for method, operation in methods.items()
            if tag["name"] in operation.get("tags", ())
        )
        found.append(Group(tag["name"], tag["description"], operations))
    return found


def _operation(path: str, method: str, operation: dict[str, Any]) -> Operation:
    return Operation(
        operation["operationId"],
        method.upper(),
        path,
        operation.get("description", ""),
        tuple(_parameter(parameter) for parameter in operation.get("parameters", ())),
        _body_example(operation),
        tuple(
            Answer(status, response["description"], tuple(response.get("content", ())))
            for status, response in sorted(operation["responses"].items())
        ),
    )


def _parameter(parameter: dict[str, Any]) -> Parameter:
    schema = parameter["schema"]
    examples = schema.get("examples") or [parameter.get("example", "")]
    example = examples[0]
    return Parameter(
        parameter["name"],
        parameter["in"],
        parameter.get("required", False),
        _kind(schema),
        parameter.get("description", ""),
        ", ".join(map(str, example)) if isinstance(example, list) else str(example),
    )


def _kind(schema: dict[str, Any]) -> str:
    options = [option for option in schema.get("anyOf", [schema]) if option.get("type") != "null"]
    option = options[0]
    if option.get("type") == "array":
        return f"list of {_kind(option['items'])}"
    if "$ref" in option:
        return str(option["$ref"]).rsplit("/", 1)[-1]
    bounds = [f"{sign} {option[name]}" for name, sign in (("minimum", "≥"), ("maximum", "≤")) if name in option]
    default = [f"default {schema['default']}"] if schema.get("default") is not None else []
    return ", ".join([str(option.get("type", "value")), *bounds, *default])


def _body_example(operation: dict[str, Any]) -> str:
    content = operation.get("requestBody", {}).get("content", {}).get("application/json", {})
    for example in content.get("examples", {}).values():
        return json.dumps(example["value"], indent=1, ensure_ascii=False)
    return ""


def with_token_needed(document: dict[str, Any]) -> dict[str, Any]:
    """The document of a service that requires a token for all operations except the open ones."""
    needed: list[dict[str, list[str]]] = [{"bearer": []}]
    paths = {
        path: {
            method: {**operation, "security": needed} if operation.get("security") else operation
            for method, operation in operations.items()
        }
        for path, operations in document["paths"].items()
    }
    return {**document, "paths": paths}
