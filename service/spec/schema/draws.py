"""The part of the spec's JSON Schema about tolerances and distributions."""

from __future__ import annotations

from sprag.service.spec.described import schemas
from sprag.service.spec.draws.described import (
    COEFFICIENT,
    CORRELATIONS,
    DISTRIBUTION,
    DRAWS,
    MEASURED,
    PLUS_MINUS,
    SHARED,
    TOLERANCES,
)
from sprag.service.spec.schema.quantity import QUANTITY, Schema, object_schema, values_schema


def distribution_schema() -> dict[str, Schema]:
    """Schemas of the fields of a distribution, by name."""
    plus_minus = {**QUANTITY, "description": f"{PLUS_MINUS.help}: {PLUS_MINUS.limits}", "examples": ["5 %", "0.2 mm"]}
    return {"plus_minus": plus_minus, "distribution": DISTRIBUTION.schema(), "values": values_schema(MEASURED)}


def correlations_schema() -> Schema:
    """Schema of a list of correlations."""
    path = {"type": "string", "examples": ["pendulums.*.mass"]}
    between = {"type": "array", "items": path, "minItems": 2, "maxItems": 2, "description": "the two paths"}
    fields = {"between": between, "coefficient": COEFFICIENT.schema()}
    return {**CORRELATIONS.schema(object_schema(fields, required=tuple(fields))), "default": []}


def tolerances_schema() -> dict[str, Schema]:
    """Schemas of the fields of a spec about tolerances, by name."""
    path = {"type": "string", "examples": ["pendulums.*.backlash", "shaft.load"]}
    paths = {
        "anyOf": [path, {"type": "array", "items": path, "minItems": 1}],
        "description": "what differs from drive to drive; `*` stands for every pendulum or step",
    }
    fields: dict[str, Schema] = {"path": paths, **distribution_schema(), "shared": SHARED.schema()}
    return {
        "tolerances": TOLERANCES.schema(object_schema(fields, required=("path",))),
        **schemas(DRAWS),
        "correlations": correlations_schema(),
    }
