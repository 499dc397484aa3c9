"""The part of the spec's JSON Schema about what varies: axes, samples, points, groups, exclusions."""

from __future__ import annotations

from typing import Any, Final

from sprag.service.spec.axes.design import COMBINE
from sprag.service.spec.axes.exclude import FIELDS as EXCLUDE_FIELDS
from sprag.service.spec.axes.sample import LARGEST_SEED, METHODS, SCALES
from sprag.worker.limits import MAX_AXES, MAX_AXIS_VALUES, MAX_TIED_PATHS

Schema = dict[str, Any]

COMBINE_HELP: Final = (
    "grid: every combination of the axes (the first varies slowest); zip: the axes side by side; union: one after the "
    "other, what does not vary being as in the base, each case once"
)
_QUANTITY: Final[Schema] = {"type": ["number", "string"]}


def axis_schema() -> Schema:
    """Schema of one axis."""
    end = {"type": ["number", "string"]}

    def three(third: Schema, description: str) -> Schema:
        return {
            "type": "array",
            "prefixItems": [end, end, third],
            "minItems": 3,
            "maxItems": 3,
            "description": description,
        }

    count = {"type": "integer", "minimum": 1, "maximum": MAX_AXIS_VALUES}
    ways: Schema = {
        "values": {
            "type": "array",
            "minItems": 1,
            "maxItems": MAX_AXIS_VALUES,
            "items": end,
            "description": "the values themselves",
        },
        "linspace": three(count, "[from, to, count], evenly divided, both ends included"),
        "geomspace": three(count, "[from, to, count], each value the same multiple of the previous one"),
        "range": three(end, "[from, to, step], including the end when a whole number of steps reaches it"),
    }
    return {
        **object_schema(
            {
                "path": _path_schema(),
                **ways,
            },
            required=("path",),
        ),
        "oneOf": [{"required": [name]} for name in ways],
    }


def sample_schema() -> Schema:
    """Schema of points drawn over ranges."""
    scale = {"enum": list(SCALES), "default": "linear", "description": "log: even in the logarithm"}
    ranges = object_schema(
        {"path": _path_schema(), "from": _QUANTITY, "to": _QUANTITY, "scale": scale}, required=("path", "from", "to")
    )
    return object_schema(
        {
            "sample": {
                "enum": list(METHODS),
                "description": "latin_hypercube and sobol fill the ranges evenly; saltelli is the design for Sobol "
                "indices, of count * (ranges + 2) cases",
            },
            "count": {
                "type": "integer",
                "minimum": 1,
                "maximum": MAX_AXIS_VALUES,
                "description": "points; sobol and saltelli take a power of 2",
            },
            "seed": {"type": "integer", "minimum": 0, "maximum": LARGEST_SEED, "default": 0},
            "ranges": {"type": "array", "minItems": 1, "maxItems": MAX_AXES, "items": ranges},
        },
        required=("sample", "count", "ranges"),
        description="points drawn over ranges of parameters",
    )


def points_schema() -> Schema:
    """Schema of cases given one by one."""
    text = {
        "type": "string",
        "description": "the text of a CSV file: a header of paths, each with its unit in brackets where it is not SI, "
        "then a line for each case",
        "examples": ["excitation.frequency [Hz],shaft.load [N*mm]\n25,100\n26,150\n"],
    }
    return object_schema({"points": text}, required=("points",), description="cases given one by one")


def group_schema() -> Schema:
    """Schema of axes that are combined with each other before the rest."""
    inner = {"anyOf": [axis_schema(), sample_schema(), points_schema()]}
    axes = {"type": "array", "minItems": 1, "maxItems": MAX_AXES, "items": inner}
    combine = {"enum": list(COMBINE), "default": "grid", "description": COMBINE_HELP}
    return object_schema({"combine": combine, "axes": axes}, required=("axes",), description="a group of axes")


def exclude_schema() -> Schema:
    """Schema of the conditions that exclude cases."""
    limits: Schema = {name: _QUANTITY for name in EXCLUDE_FIELDS if name != "is"}
    limits["is"] = {"anyOf": [_QUANTITY, {"type": "array", "minItems": 1, "items": _QUANTITY}]}
    part = {**object_schema(limits), "minProperties": 1}
    return {
        "type": "array",
        "default": [],
        "items": {"type": "object", "minProperties": 1, "additionalProperties": part},
        "description": "conditions by path; a case is left out when all parts of any one of them hold",
        "examples": [[{"shaft.load": {"above": "0.5 N*m"}, "excitation.frequency": {"below": "20 Hz"}}]],
    }


def extension_schema() -> Schema:
    """Schema of what is added to a study."""
    anything = {"anyOf": [axis_schema(), sample_schema(), points_schema(), group_schema()]}
    every = {"type": "array", "minItems": 1, "maxItems": MAX_AXES}
    return object_schema(
        {
            "axes": {
                **every,
                "items": axis_schema(),
                "description": "further values of axes of a grid; a parameter that did not vary becomes an axis of "
                "the base's value and these",
            },
            "cases": {
                **every,
                "items": anything,
                "description": "further cases, which come after those of the study; what they do not vary is as in "
                "the base",
            },
            "name": {"type": "string", "description": "name of the new study; by default that of the old one"},
        },
        description="what is added to a study: either axes or cases",
    )


def _path_schema() -> Schema:
    path = {"type": "string", "examples": ["excitation.frequency", "pendulums.0.spring_rate", "clutch.coefficients.1"]}
    paths = {"type": "array", "items": path, "minItems": 1, "maxItems": MAX_TIED_PATHS, "uniqueItems": True}
    return {"anyOf": [path, paths], "description": "what varies; several paths take the same values"}


def object_schema(properties: Schema, required: tuple[str, ...] | list[str] = (), description: str = "") -> Schema:
    """Schema of an object of these fields and no others."""
    schema: Schema = {"type": "object", "properties": properties, "additionalProperties": False}
    if required:
        schema["required"] = list(required)
    if description:
        schema["description"] = description
    return schema
