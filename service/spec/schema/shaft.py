"""The base of a machine shaft as a JSON Schema, made from the engine's catalogue."""

from __future__ import annotations

from typing import Any, Final

from sprag.service.spec.machine.shaft import MEAN_SPEEDS
from sprag.service.spec.machine.shaft_parts import (
    BALANCES,
    INTERPOLATIONS,
    MECHANISM_CHOICES,
    MOTORS,
    OPERATION_CHOICES,
)
from sprag.service.spec.schema.axes import Schema, object_schema
from sprag.service.spec.schema.quantity import quantity_schema
from sprag.worker import models
from sprag.worker.models import Parameter, machine_shaft

_TEXT: Final[Schema] = {"type": "string", "minLength": 1}
_NUMBER: Final[Schema] = {"type": ["number", "string"]}


def shaft_schema() -> Schema:
    """Schema of `base` for machine shafts."""
    entries = {entry.path: entry for entry in models.parameter_catalogue(models.MACHINE_SHAFT)}
    properties = {name: quantity_schema(entries[name]) for name in ("mean_speed", "wanted_irregularity", "gravity")}
    return object_schema(
        {
            "cycle": {
                "type": ["integer", "string"],
                "default": "1 revolution",
                "description": f"revolutions of a cycle, 1 to {max(machine_shaft.REVOLUTIONS)}",
            },
            **properties,
            "mean_speed_is": {
                "enum": list(MEAN_SPEEDS),
                "default": MEAN_SPEEDS[0],
                "description": "which mean of the speed mean_speed and the irregularity refer to",
            },
            "balance": {
                "enum": list(BALANCES),
                "description": "how the work over a cycle is made zero; by default constant, refuse where a torque is "
                "given, motor where there is one",
            },
            "phi_c": {
                "type": "integer",
                "minimum": 0,
                "description": "the angle with T = T_mean from which S3 and S4 count; by default the first where T "
                "rises",
            },
            "constants": {
                "type": "object",
                "maxProperties": machine_shaft.MAX_CONSTANTS,
                "additionalProperties": {"type": "number"},
                "description": "numbers that formulas use by their names",
            },
            "drive": _drive(entries),
            "mechanism": _mechanism(entries),
            "operation": _operation(entries),
        },
        required=("drive",),
        description="the machine that every case begins from",
    )


def _numbers(entries: dict[str, Parameter], prefix: str) -> Schema:
    found = {path.removeprefix(prefix): entry for path, entry in entries.items() if path.startswith(prefix)}
    return {name: quantity_schema(entry) for name, entry in found.items() if "." not in name}


def _required(entries: dict[str, Parameter], prefix: str) -> list[str]:
    return [
        path.removeprefix(prefix)
        for path, entry in entries.items()
        if path.startswith(prefix) and entry.default is None and "." not in path.removeprefix(prefix)
    ]


def _table(description: str) -> Schema:
    row = {"type": "array", "minItems": 2, "maxItems": 2, "items": _NUMBER}
    return {
        "type": "array",
        "minItems": 2,
        "maxItems": machine_shaft.MAX_ROWS,
        "items": row,
        "description": description,
    }


_INTERPOLATION: Final[Schema] = {
    "enum": list(INTERPOLATIONS),
    "default": INTERPOLATIONS[0],
    "description": "interpolation between the rows: without overshoot, or by straight lines",
}


def _formula(description: str) -> Schema:
    return {**_TEXT, "description": description}


def _drive(entries: dict[str, Parameter]) -> Schema:
    diagram = object_schema(
        {
            "table": _table("rows of angle (rad) and torque (N*m)"),
            "interpolation": _INTERPOLATION,
            "formula": _formula("torque in N*m as a formula of phi (rad)"),
        },
        description="either a table or a formula",
    )
    numbers = _numbers(entries, "drive.")
    torque = numbers["torque"]
    motor = object_schema(
        {"kind": {"enum": list(MOTORS)}, **_numbers(entries, "drive.motor.")},
        required=("kind",),
        description="a motor whose torque depends on its speed",
    )
    return object_schema(
        {**numbers, "torque": {**torque, "anyOf": [*torque["anyOf"], diagram]}, "motor": motor},
        required=("inertia",),
        description="what turns the shaft",
    )


def _mechanism(entries: dict[str, Parameter]) -> Schema:
    kinds: dict[str, Any] = {}
    for kind, choices in MECHANISM_CHOICES.items():
        prefix = f"mechanism.{kind}."
        own = {
            name: {"enum": list(allowed), **({} if name == "kind" else {"default": allowed[0]})}
            for name, allowed in choices.items()
        }
        required = [*(name for name in choices if name == "kind"), *_required(entries, prefix)]
        kinds[kind] = object_schema({**own, **_numbers(entries, prefix)}, required=required)
    schema = object_schema(
        {
            "table": _table("rows of angle (rad) and reduced inertia (kg*m^2)"),
            "interpolation": _INTERPOLATION,
            "formula": _formula("reduced inertia in kg*m^2 as a formula of phi (rad)"),
            **kinds,
        },
        description="what the shaft drives: a table, a formula, or dimensions and masses",
    )
    return {**schema, "oneOf": [{"required": [name]} for name in ("table", "formula", *kinds)]}


def _operation(entries: dict[str, Parameter]) -> Schema:
    steps = {
        "type": "array",
        "minItems": 1,
        "maxItems": machine_shaft.MAX_STEPS,
        "items": object_schema(_numbers(entries, "operation.steps.K."), required=("from", "to", "value")),
        "description": "constant pieces; zero elsewhere",
    }
    meanings = {
        "quantity": "a force on the working part, or a torque on the shaft",
        "over": "against the shaft's angle, or the fraction of the stroke",
        "during": "strokes in which a diagram over the stroke holds",
        "sense": "a force against the motion, or always against the forward stroke",
    }
    schema = object_schema(
        {
            **{
                name: {"enum": list(allowed), "description": meanings[name]}
                for name, allowed in OPERATION_CHOICES.items()
            },
            **_numbers(entries, "operation."),
            "steps": steps,
            "table": _table("rows of angle (rad) or fraction of the stroke, and force (N) or torque (N*m)"),
            "interpolation": _INTERPOLATION,
            "formula": _formula("force or torque as a formula of phi (rad) and x (fraction of the stroke)"),
            "gas": object_schema(
                _numbers(entries, "operation.gas."),
                required=_required(entries, "operation.gas."),
                description="a gas drawn in and compressed by the working part",
            ),
        },
        description="what resists",
    )
    return {**schema, "oneOf": [{"required": [name]} for name in ("value", "steps", "table", "formula", "gas")]}
