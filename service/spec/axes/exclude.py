"""Conditions that exclude cases: combinations of parameter ranges that are not run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag_study.service.reading.limits import one_of
from sprag_study.service.reading.together import split_list
from sprag_study.service.spec.described import Record
from sprag_study.service.spec.lists import read_list_text, refuse_blanks, refuse_mixed
from sprag_study.service.spec.schema.quantity import QUANTITY
from sprag_study.worker.limits import MAX_AXIS_VALUES
from sprag_study.worker.study import SAME_VALUE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from sprag_study.service.spec.node import Node

LIMITS: Final = Record(
    {
        **dict.fromkeys(("above", "below", "at_least", "at_most"), QUANTITY),
        "is": {"anyOf": [QUANTITY, {"type": "array", "minItems": 1, "items": QUANTITY}]},
    }
)
#: JSON Schema of the conditions.
EXCLUDE: Final[dict[str, Any]] = {
    "type": "array",
    "default": [],
    "items": {
        "type": "object",
        "minProperties": 1,
        "additionalProperties": {**LIMITS.schema(), "minProperties": 1},
    },
    "description": "conditions by path; a case is left out when all parts of any one of them hold",
    "examples": [[{"shaft.load": {"above": "0.5 N*m"}, "excitation.frequency": {"below": "20 Hz"}}]],
}
#: path -> [(field, value)]: all of them must hold for a case to be excluded
Condition = dict[str, list[tuple[str, float]]]


def read_exclude(node: Node) -> list[Condition]:
    """Read the conditions; a case is excluded when all parts of any one condition hold. Faults are recorded."""
    if not isinstance(node.value, list):
        node.refuse("wrong-type", "must be a list of conditions", allowed="a list of objects, each by its paths")
    conditions = []
    for item in node.parts() if isinstance(node.value, list) else ():
        if isinstance(item.value, Mapping) and item.value:
            conditions.append({str(path): _parts(item[path], str(path)) for path in item.value})
        else:
            item.refuse("wrong-type", "must say what is excluded",
                        allowed='such as {"shaft.load": {"above": "0.5 N*m"}}')  # fmt: skip
    return conditions


def _parts(node: Node, path: str) -> list[tuple[str, float]]:
    parameter = node.machine.parameters.get(path)
    if parameter is None:
        node.refuse("invalid-path", node.machine.why_not(path), path, allowed="the path of a number in `base`")
        return []
    if not LIMITS.read(node):
        return []
    if not node.value:
        node.refuse("required", "has no condition", allowed=one_of(tuple(LIMITS.fields)))
    if refuse_mixed([item for limit in node.parts() for item in _quantities(limit)], parameter.unit):
        return []
    if isinstance(node["is"].value, list) and refuse_blanks(node["is"].parts()):
        return []
    parts: list[tuple[str, float]] = []
    for name in LIMITS.fields:
        limit = node[name]
        if not limit.given:
            continue
        if isinstance(limit.value, list) and (name != "is" or not 1 <= len(limit.value) <= MAX_AXIS_VALUES):
            limit.refuse(
                "wrong-type", "must be a quantity", allowed="one quantity" if name != "is" else "1 value or more"
            )
            continue
        items = _quantities(limit)
        if name == "is" and isinstance(limit.value, str) and len(split_list(limit.value)) > 1:
            items = read_list_text(limit, parameter.unit, path) or ()
        values = [item.number(parameter) for item in items]
        parts += [(name, value) for value in values if value is not None]
    return parts


def _quantities(limit: Node) -> Sequence[Node]:
    """Every value of a limit."""
    return limit.parts() if isinstance(limit.value, list) else [limit]


def kept(
    conditions: list[Condition], columns: Mapping[str, NDArray[np.float64]], base: Mapping[str, float], count: int
) -> NDArray[np.bool_]:
    """Mask of the ``count`` cases that no condition excludes."""
    keep = np.ones(count, dtype=np.bool_)
    for condition in conditions:
        held = np.ones(count, dtype=np.bool_)
        for path, parts in condition.items():
            column = columns.get(path)
            # Only limits may be missing from the base; they are infinite then.
            held &= _held(np.full(count, base.get(path, np.inf)) if column is None else column, parts)
        keep &= ~held
    return keep


def _held(column: NDArray[np.float64], parts: list[tuple[str, float]]) -> NDArray[np.bool_]:
    """All limits must hold, and any one of the values under ``is``."""
    held = np.ones(column.shape, dtype=np.bool_)
    equal = [value for name, value in parts if name == "is"]
    if equal:
        held &= np.any([np.isclose(column, value, rtol=SAME_VALUE, atol=0.0) for value in equal], axis=0)
    for name, value in parts:
        if name == "above":
            held &= column > value
        elif name == "below":
            held &= column < value
        elif name == "at_least":
            held &= column >= value
        elif name == "at_most":
            held &= column <= value
    return held
