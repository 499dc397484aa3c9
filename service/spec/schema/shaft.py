"""Base of a machine shaft as a JSON Schema, made from the engine's catalogue and the descriptions of its parts."""

from __future__ import annotations

from typing import Any, Final

from sprag.service.spec.described import listed_schema, schemas
from sprag.service.spec.machine.shaft import MEAN_SPEED_IS
from sprag.service.spec.machine.shaft_drive import BALANCE, BALANCE_SIDE, FLYWHEEL, MOTOR, STAGE, STAGES
from sprag.service.spec.machine.shaft_parts import (
    FORMS,
    INDICATOR_OVER,
    INTERPOLATION,
    MECHANISM_CHOICES,
    MECHANISMS,
    OPERATION_CHOICES,
    PARTS,
    PHI_C,
    RECORDED_AT,
    ROWS,
    STEPS,
    numbers_under,
)
from sprag.service.spec.schema.quantity import QUANTITY, Schema, object_schema, one_of, quantities, required_of
from sprag.worker.models import machine_shaft

_CYCLE: Final[Schema] = {
    "type": ["integer", "string"],
    "default": "1 revolution",
    "description": f"revolutions of a cycle, 1 to {max(machine_shaft.REVOLUTIONS)}",
}
_CONSTANTS: Final[Schema] = {
    "type": "object",
    "maxProperties": machine_shaft.MAX_CONSTANTS,
    "additionalProperties": {"type": "number"},
    "description": "numbers that formulas use by their names",
}


_PART: Final = "a mechanism with its operation; their angle is that of the shaft plus the crank angle"


def shaft_schema() -> Schema:
    """Schema of `base` for machine shafts."""
    choices = {field.name: field.schema() for field in (MEAN_SPEED_IS, BALANCE, BALANCE_SIDE, PHI_C)}
    mechanism = {"mechanism": _mechanism(), "operation": _operation()}
    part = object_schema({**quantities(numbers_under("parts.N.")), **mechanism}, description=_PART)
    parts = {"drive": _drive(), **mechanism, "parts": listed_schema(PARTS, part)}
    return object_schema(
        {"cycle": _CYCLE, **quantities(numbers_under("")), **choices, "constants": _CONSTANTS, **parts},
        required=("drive",),
        description="the machine that every case begins from",
    )


def _diagram(table: str, formula: str) -> Schema:
    """Fields of a course that is given as a table or as a formula."""
    row = {"type": "array", "minItems": 2, "maxItems": 2, "items": QUANTITY}
    return {
        "table": {**listed_schema(ROWS, row), "description": f"rows of {table}"},
        "csv": {"type": "string", "description": f"{table} as the text of a CSV file, headings with units in brackets"},
        "interpolation": INTERPOLATION.schema(),
        "formula": {"type": "string", "minLength": 1, "description": formula},
    }


def _rows(table: str) -> Schema:
    """Fields of a course that is given as a table."""
    return {name: field for name, field in _diagram(table, "").items() if name != "formula"}


def _drive() -> Schema:
    fields = _diagram("angle (rad) and torque (N*m)", "torque in N*m as a formula of phi (rad)")
    diagram = object_schema(fields, description="either a table or a formula")
    numbers = quantities(numbers_under("drive."))
    torque = numbers["torque"]
    motor = object_schema(
        {
            "kind": MOTOR.schema(),
            **quantities(numbers_under("drive.motor.")),
            **_rows("speed (rad/s) and torque (N*m)"),
        },
        required=("kind",),
        description="a motor whose torque depends on its speed",
    )
    stage = numbers_under("drive.stages.K.")
    stages = listed_schema(STAGES, object_schema({"kind": STAGE.schema(), **quantities(stage)}, required=("kind",)))
    wheel = numbers_under("drive.flywheel.")
    flywheel = object_schema(
        {"kind": FLYWHEEL.schema(), **quantities(wheel)},
        required=("kind", *required_of(wheel)),
        description="a flywheel on the main shaft, given by its dimensions",
    )
    torque = {**torque, "anyOf": [*torque["anyOf"], diagram]}
    schema = object_schema(
        {**numbers, "torque": torque, "motor": motor, "stages": stages, "flywheel": flywheel},
        description="what turns the shaft",
    )
    return {**schema, "anyOf": [{"required": [name]} for name in ("inertia", "stages", "flywheel")]}


def _mechanism() -> Schema:
    kinds: dict[str, Any] = {}
    for kind, choices in MECHANISM_CHOICES.items():
        numbers = numbers_under(f"mechanism.{kind}.")
        required = [*(name for name, field in choices.items() if field.default is None), *required_of(numbers)]
        kinds[kind] = object_schema({**schemas(choices), **quantities(numbers)}, required)
    table = "angle (rad) and reduced inertia (kg*m^2)"
    schema = object_schema(
        {**_diagram(table, "reduced inertia in kg*m^2 as a formula of phi (rad)"), **kinds},
        description="what the shaft drives: a table, a formula, or dimensions and masses",
    )
    return one_of(schema, MECHANISMS)


def _operation() -> Schema:
    step, gas = numbers_under("operation.steps.K."), numbers_under("operation.gas.")
    indicator = numbers_under("operation.indicator.")
    recorded = {RECORDED_AT.path: RECORDED_AT}
    table = "angle (rad), fraction of the stroke or time (s), and force (N) or torque (N*m)"
    pressure = "angle (rad), fraction of the stroke, to and fro in every revolution, or time (s), and pressure (Pa)"
    schema = object_schema(
        {
            **schemas(OPERATION_CHOICES),
            **quantities(numbers_under("operation.") | recorded),
            "steps": listed_schema(STEPS, object_schema(quantities(step), required_of(step))),
            **_diagram(
                table, "force or torque as a formula of phi (rad), t (s), x (fraction of the stroke) and omega (rad/s)"
            ),
            "indicator": one_of(
                object_schema(
                    {
                        "over": INDICATOR_OVER.schema(),
                        **quantities(indicator | recorded),
                        **_rows(pressure),
                    },
                    required_of(indicator),
                    "the pressure on the piston as measured",
                ),
                ("table", "csv"),
            ),
            "gas": object_schema(
                quantities(gas), required_of(gas), "a gas drawn in and compressed by the working part"
            ),
        },
        description="what resists",
    )
    return one_of(schema, FORMS)
