"""Base and run of a vibration drive as JSON Schemas, made from the engine's catalogue."""

from __future__ import annotations

from sprag.service.spec.fields import placed
from sprag.service.spec.run import RESETS, SETTLED_DEFAULTS, SETTLED_FIELDS, TIMED_FIELDS
from sprag.service.spec.schema.axes import Schema, object_schema
from sprag.service.spec.schema.quantity import quantity_schema
from sprag.worker import models
from sprag.worker.limits import (
    MAX_CLUTCH_ROWS,
    MAX_ORBIT_PERIODS,
    MAX_SETTLED,
    MAX_SETTLED_PERIODS,
    MAX_TOLERANCE,
    MIN_SETTLED,
    MIN_SETTLED_PERIODS,
    MIN_TOLERANCE,
)
from sprag.worker.models import CLUTCH_WINDUP_LIMIT, MAX_COEFFICIENTS, MAX_PENDULUMS, SETTLED, Parameter


def drive_schema() -> Schema:
    """Schema of `base` for vibration drives."""
    catalogue = [
        entry for entry in models.parameter_catalogue(models.VIBRATION_DRIVE) if not entry.path.startswith("clutch.")
    ]
    properties: Schema = {}
    required: list[str] = []
    for section in dict.fromkeys(entry.path.split(".")[0] for entry in catalogue):
        entries = [entry for entry in catalogue if entry.path.split(".")[0] == section]
        if entries[0].path == section:
            properties[section] = quantity_schema(entries[0])
            continue
        schema = _section(entries, with_clutch=section == "pendulums")
        if section == "pendulums":
            schema = {"type": "array", "minItems": 1, "maxItems": MAX_PENDULUMS, "items": schema}
        properties[section] = schema
        if any(entry.default is None for entry in entries):
            required.append(section)
    properties["clutch"] = clutch_schema()
    return object_schema(properties, required=required, description="the machine that every case begins from")


def clutch_schema() -> Schema:
    """Schema of a clutch: a law, or measured data with the accuracy of its fit."""
    pair = {"type": "array", "minItems": 2, "maxItems": 2, "description": "angle (rad) and torque (N*m)"}
    law = {
        "coefficients": {
            "type": "array",
            "minItems": 1,
            "maxItems": MAX_COEFFICIENTS,
            "items": {"type": ["number", "string"]},
            "description": "c_1 .. c_p of the torque over the windup, c_1 first: N*m, N*m/rad, N*m/rad^2, ..",
        },
        "windup_limit": quantity_schema(CLUTCH_WINDUP_LIMIT),
    }
    measured = {
        "data": {
            "type": "array",
            "minItems": 2,
            "maxItems": MAX_CLUTCH_ROWS,
            "items": {**pair, "items": {"type": ["number", "string"]}},
            "description": "measured rows [angle, torque]",
        },
        "accuracy": quantity_schema(
            Parameter("accuracy", "", "N*m", 0.0, 1e9, True, None, "largest residual of the fit that is accepted")
        ),
        "max_degree": {
            "type": "integer",
            "minimum": 1,
            "maximum": MAX_COEFFICIENTS - 1,
            "default": 7,
            "description": "highest degree of the polynomial that is tried",
        },
        "through_origin": {"type": "boolean", "default": True, "description": "no torque at zero windup (c_1 = 0)"},
        "angles_include_backlash": {
            "type": "boolean",
            "default": False,
            "description": "the angles count from the first contact, so that the backlash is taken off them",
        },
    }
    return {
        "description": "torque of the freewheel clutch over its windup",
        "oneOf": [
            object_schema(law, required=("coefficients",)),
            object_schema(measured, required=("data", "accuracy")),
        ],
    }


def run_schema() -> Schema:
    """Schema of `run`."""
    time = {"type": ["number", "string"], "examples": ["60 periods", "2 s", 2.0], "minimum": 0}
    schema = object_schema(
        {
            "until": {
                "const": SETTLED,
                "description": "run each case until its motion is settled; the default where there is neither "
                "`duration` nor `window`",
            },
            "at_most": {
                "type": "string",
                "default": f"{SETTLED_DEFAULTS['at_most']} periods",
                "examples": ["1000 periods"],
                "description": "excitation periods after which the search for the settled motion ends: "
                f"{MIN_SETTLED_PERIODS} to {MAX_SETTLED_PERIODS:,}",
            },
            "settled": {
                "type": "number",
                "minimum": MIN_SETTLED,
                "maximum": MAX_SETTLED,
                "default": SETTLED_DEFAULTS["settled"],
                "description": "scaled distance from its orbit below which a run counts as settled",
            },
            "max_period": {
                "type": "integer",
                "minimum": 1,
                "maximum": MAX_ORBIT_PERIODS,
                "default": SETTLED_DEFAULTS["max_period"],
                "description": "largest number of excitation periods after which a motion may repeat itself",
            },
            "duration": {
                **time,
                "description": "end of the run, which then lasts for a given time: a number is seconds, a text says "
                "periods or a unit of time; 60 periods where there is a window alone",
            },
            "window": {
                "type": "array",
                "minItems": 2,
                "maxItems": 2,
                "items": time,
                "description": "part of the run that is evaluated, [start, end]; by default the last third",
            },
            "tolerance": {
                "type": "number",
                "minimum": MIN_TOLERANCE,
                "maximum": MAX_TOLERANCE,
                "default": SETTLED_DEFAULTS["tolerance"],
                "description": "local relative error of the integration",
            },
            "reset": {
                "enum": list(RESETS),
                "default": SETTLED_DEFAULTS["reset"],
                "description": "whether an upward crossing while torque is transmitted restarts the windup (literal)",
            },
        },
        description="how long each case runs, what is evaluated, how accurately",
    )
    # A run lasts until it is settled or for a given time.
    timed, until = ({"anyOf": [{"required": [name]} for name in names]} for names in (TIMED_FIELDS, SETTLED_FIELDS))
    return {**schema, "not": {"allOf": [timed, until]}}


def _section(entries: list[Parameter], *, with_clutch: bool) -> Schema:
    names = {entry.path.split(".")[-1]: placed(entry, entry.path) for entry in entries}
    properties = {name: quantity_schema(entry) for name, entry in names.items()}
    if with_clutch:
        properties["clutch"] = clutch_schema()
    return object_schema(properties, required=[name for name, entry in names.items() if entry.default is None])
