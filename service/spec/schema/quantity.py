"""Parts of JSON Schemas that every model has: objects, and quantities with their units."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any, Final

from sprag_study.service.reading.units import examples
from sprag_study.worker.limits import MAX_QUANTITY_LENGTH
from sprag_study.worker.models import Parameter

Schema = dict[str, Any]

#: A number in SI or a text with its unit, where the parameter is not known yet.
QUANTITY: Final[Schema] = {"type": ["number", "string"]}
_TEXT: Final[Schema] = {"type": "string", "minLength": 1, "maxLength": MAX_QUANTITY_LENGTH}


def object_schema(properties: Schema, required: Iterable[str] = (), description: str = "") -> Schema:
    """Schema of an object of these fields and no others."""
    schema: Schema = {"type": "object", "properties": properties, "additionalProperties": False}
    if required := list(required):
        schema["required"] = required
    if description:
        schema["description"] = description
    return schema


def one_of(schema: Schema, names: Iterable[str]) -> Schema:
    """``schema`` of an object that has exactly one of the fields ``names``."""
    return {**schema, "oneOf": [{"required": [name]} for name in names]}


def required_of(parameters: Mapping[str, Parameter]) -> list[str]:
    """The names of those that have no default."""
    return [name for name, parameter in parameters.items() if parameter.default is None]


def without_numbers(schema: Schema) -> Schema:
    """The schema of an object any number of which may be missing, and null in a list, because it is derived."""
    found = {name: _without(part) for name, part in schema.items()}
    fields = schema.get("properties", {})
    if "required" in schema:
        found["required"] = [name for name in schema["required"] if "x-unit" not in fields.get(name, {})]
    for kind in ("oneOf", "anyOf"):
        ways = schema.get(kind, [])
        if any("x-unit" in fields.get(name, {}) for way in ways for name in way.get("required", ())):
            del found[kind]
    if schema.get("items") == QUANTITY:
        found["items"] = {"type": [*QUANTITY["type"], "null"]}
    return found


def _without(part: Any) -> Any:
    if isinstance(part, Mapping):
        return without_numbers(dict(part))
    return [_without(item) for item in part] if isinstance(part, list) else part


def plain_schema(catalogue: tuple[Parameter, ...], prefix: str = "") -> Schema:
    """Schema of the object of all parameters below ``prefix``, nested as their paths are."""
    below = [entry for entry in catalogue if entry.path.startswith(prefix)]
    properties: Schema = {}
    required: list[str] = []
    for name in dict.fromkeys(entry.path.removeprefix(prefix).split(".")[0] for entry in below):
        entries = [entry for entry in below if f"{entry.path}.".startswith(f"{prefix}{name}.")]
        single = entries[0].path == f"{prefix}{name}"
        properties[name] = quantity_schema(entries[0]) if single else plain_schema(catalogue, f"{prefix}{name}.")
        if any(entry.default is None for entry in entries):
            required.append(name)
    return object_schema(properties, required=required)


def quantity_schema(parameter: Parameter) -> Schema:
    """Schema of one quantity: a number in the parameter's SI unit and range, or a text with its unit."""
    schema: Schema = {
        "anyOf": [{"type": "number", **_bounds(parameter)}, _TEXT],
        "description": _meaning(parameter),
        "examples": list(examples(parameter.unit)),
        "x-unit": parameter.unit,
        "x-range": parameter.range_text(),
    }
    if parameter.default is not None and math.isfinite(parameter.default):
        schema["default"] = parameter.default
    return schema


def _meaning(parameter: Parameter) -> str:
    """What a parameter is, with its symbol and its unit where it has them."""
    symbol = f" ({parameter.symbol})" if parameter.symbol else ""
    return f"{parameter.help}{symbol}" + ("" if parameter.unit == "1" else f", {parameter.unit}")


def _bounds(parameter: Parameter) -> Schema:
    bounds: Schema = {}
    if math.isfinite(parameter.low):
        bounds["exclusiveMinimum" if parameter.low_open else "minimum"] = parameter.low
    if math.isfinite(parameter.high):
        bounds["maximum"] = parameter.high
    return bounds
