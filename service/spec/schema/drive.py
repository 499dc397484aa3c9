"""Base and run of a vibration drive as JSON Schemas, made from the engine's catalogue."""

from __future__ import annotations

from dataclasses import replace

from sprag.service.spec.described import ANY_RUN, DURATION, FIT, SETTLED_RUN, listed_schema, schemas
from sprag.service.spec.machine.clutch import ACCURACY, COEFFICIENTS, ROWS
from sprag.service.spec.machine.drive import PENDULUMS, START
from sprag.service.spec.run import SETTLED_FIELDS, TIMED_FIELDS
from sprag.service.spec.schema.quantity import (
    QUANTITY,
    Schema,
    object_schema,
    quantities,
    quantity_schema,
    required_of,
)
from sprag.worker import models
from sprag.worker.models import CLUTCH_WINDUP_LIMIT, Parameter
from sprag.worker.models.parameters import placed


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
            schema = listed_schema(PENDULUMS, schema)
        properties[section] = schema
        if any(entry.default is None for entry in entries):
            required.append(section)
    properties["clutch"] = clutch_schema()
    properties[START] = start_schema()
    return object_schema(properties, required=required, description="the machine that every case begins from")


def start_schema() -> Schema:
    """Schema of a start from the end of a case of a study of the same service."""
    fields: Schema = {
        "study": {"type": "string", "description": "id of the study"},
        "case": {"type": "integer", "minimum": 0, "description": "number of the case"},
        "start": {"type": "integer", "minimum": 0, "description": "of a case with many starts: which of them"},
    }
    what = "begin in the state in which a case of another study ends; the service replaces it by initial values"
    return object_schema(fields, required=("study", "case"), description=what)


def clutch_schema() -> Schema:
    """Schema of a clutch: a law, or measured data with the accuracy of its fit."""
    law = {"coefficients": listed_schema(COEFFICIENTS, QUANTITY), "windup_limit": quantity_schema(CLUTCH_WINDUP_LIMIT)}
    return {
        "description": "torque of the freewheel clutch over its windup",
        "oneOf": [
            object_schema(law, required=("coefficients",)),
            measured_schema(),
        ],
    }


def measured_schema(others: Schema | None = None, description: str = "") -> Schema:
    """Schema of measured data with the accuracy of their fit; ``others`` are fields beside them."""
    row = {"type": "array", "minItems": 2, "maxItems": 2, "items": QUANTITY, "description": "angle and torque"}
    data = {"data": listed_schema(ROWS, row), "accuracy": quantity_schema(ACCURACY)}
    return object_schema({**data, **schemas(FIT), **(others or {})}, required=data, description=description)


def run_schema() -> Schema:
    """Schema of `run`."""
    window = {
        "type": "array",
        "minItems": 2,
        "maxItems": 2,
        "items": replace(DURATION, help="a time of the run").schema(),
        "description": "part of the run that is evaluated, [start, end]; by default the last third",
    }
    schema = object_schema(
        {**schemas(SETTLED_RUN), "duration": DURATION.schema(), "window": window, **schemas(ANY_RUN)},
        description="how long each case runs, what is evaluated, how accurately",
    )
    # A run lasts until it is settled or for a given time.
    timed, until = ({"anyOf": [{"required": [name]} for name in names]} for names in (TIMED_FIELDS, SETTLED_FIELDS))
    return {**schema, "not": {"allOf": [timed, until]}}


def _section(entries: list[Parameter], *, with_clutch: bool) -> Schema:
    numbers = {entry.path.split(".")[-1]: placed(entry, entry.path) for entry in entries}
    properties = quantities(numbers)
    if with_clutch:
        properties["clutch"] = clutch_schema()
    return object_schema(properties, required=required_of(numbers))
