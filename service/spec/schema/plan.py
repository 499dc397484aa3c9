"""The part of the spec's JSON Schema about studies that choose their own cases: refinement, goals, calibration."""

from __future__ import annotations

from typing import Final

from sprag.service.spec.described import Listed
from sprag.service.spec.plan.calibrate import CSV_HELP, OTHER, UNKNOWN
from sprag.service.spec.plan.goal import AT, BEST, MAX, SEARCH, SUBJECT_TO, VARY, WITHIN
from sprag.service.spec.plan.refine import ERROR, FINEST, MOST, RESULTS, START
from sprag.service.spec.plan.robust import QUANTILE, YIELD
from sprag.service.spec.schema.quantity import QUANTITY, Schema, object_schema, values_schema

_RESULT: Final[Schema] = {"type": "string", "examples": ["shaft.speed.mean", "efficiency", "torque.max"]}


def adaptive_schema(path: Schema) -> Schema:
    """Schema of an adaptive axis; ``path`` is that of its path."""
    ends: Schema = {
        "type": "array",
        "prefixItems": [QUANTITY, QUANTITY],
        "minItems": 2,
        "maxItems": 2,
        "description": "[from, to]: the values between them are chosen by `refine`",
    }
    return object_schema({"path": path, "adaptive": ends}, required=("path", "adaptive"))


def refine_schema() -> Schema:
    """Schema of `refine`."""
    return object_schema(
        {
            "results": RESULTS.schema(_RESULT),
            "error": ERROR.schema(),
            "start": START.schema(),
            "finest": {**FINEST.schema(), "type": ["integer", "string"]},
            "most": MOST.schema(),
        },
        required=("results",),
        description="curves (one adaptive axis) or maps (two), refined until they are accurate to the given error",
    )


def goal_schema(path: Schema) -> Schema:
    """Schema of `goal`; ``path`` is that of the path of what varies."""
    variable = object_schema(
        {
            "path": path,
            "from": QUANTITY,
            "to": QUANTITY,
            "values": values_schema(Listed("values", 1, 10_000, "the values to choose from")),
        },
        required=("path",),
    )
    limits: dict[str, Schema] = {
        "result": _RESULT,
        "is": {**QUANTITY, "description": "value that the result must have"},
        "within": WITHIN.schema(),
        "at_least": QUANTITY,
        "at_most": QUANTITY,
    }
    quantile = {"type": ["number", "string"], "description": f"{QUANTILE.help}: {QUANTILE.limits}"}
    conditions = YIELD.schema(object_schema(limits, required=("result",)))
    share = {"type": ["number", "string"], "description": 'a share, as in "90 %"'}
    # Generators of clients write invalid code for a constant that is true.
    largest = {"type": "boolean", "description": "true: a yield is to be as large as possible"}
    best = {
        "anyOf": [
            object_schema({"result": _RESULT, "max": MAX.schema(), "quantile": quantile}, required=("result",)),
            object_schema({"yield": conditions, "max": largest}, required=("yield",)),
        ]
    }
    constraint = {
        "anyOf": [
            object_schema({**limits, "quantile": quantile}, required=("result",)),
            object_schema({"yield": conditions, "at_least": share}, required=("yield", "at_least")),
        ]
    }
    point = {"type": "object", "minProperties": 1, "additionalProperties": QUANTITY}
    return object_schema(
        {
            "vary": VARY.schema(variable),
            "best": BEST.schema(best),
            "subject_to": SUBJECT_TO.schema(constraint),
            "at": AT.schema(point),
            **{name: field.schema() for name, field in SEARCH.items()},
        },
        required=("vary",),
        description="what a design should reach, and what may vary for it",
    )


def calibrate_schema(path: Schema) -> Schema:
    """Schema of `calibrate`; ``path`` is that of the path of what is unknown."""
    fields: Schema = {"path": path, "from": QUANTITY, "to": QUANTITY}
    unknown = object_schema(fields, required=tuple(fields))
    measured = object_schema({"csv": {"type": "string", "description": CSV_HELP}}, required=("csv",))
    return object_schema(
        {
            "unknown": UNKNOWN.schema(unknown),
            "measured": measured,
            **{name: field.schema() for name, field in OTHER.items()},
        },
        required=("unknown", "measured"),
        description="measured points, and the parameters that they are to determine",
    )
