"""Conditions that exclude cases: combinations of parameter ranges that are not run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag.service.reading.limits import one_of
from sprag.service.reading.together import split_list
from sprag.service.spec.fields import read_number, read_object
from sprag.service.spec.lists import read_list_text, refuse_blanks, refuse_mixed
from sprag.service.spec.report import Report, join
from sprag.worker.limits import MAX_AXIS_VALUES
from sprag.worker.study import SAME_VALUE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag.service.spec.machine.machine import Machine

FIELDS: Final = ("above", "below", "at_least", "at_most", "is")
#: path -> [(field, value)]: all of them must hold for a case to be excluded
Condition = dict[str, list[tuple[str, float]]]


def read_exclude(report: Report, data: object, machine: Machine) -> list[Condition]:
    """Read the conditions; a case is excluded when all parts of any one condition hold. Faults are recorded."""
    if not isinstance(data, list):
        report.fault(
            "/exclude",
            "wrong-type",
            "must be a list of conditions",
            data,
            allowed="a list of objects, each by its paths",
        )
        return []
    found = []
    for index, item in enumerate(data):
        pointer = join("/exclude", index)
        if not isinstance(item, Mapping) or not item:
            report.fault(
                pointer,
                "wrong-type",
                "must say what is excluded",
                item,
                allowed='such as {"shaft.load": {"above": "0.5 N*m"}}',
            )
            continue
        parts = {
            str(path): _parts(report, join(pointer, path), str(path), part, machine) for path, part in item.items()
        }
        found.append(parts)
    return found


def _parts(report: Report, pointer: str, path: str, data: object, machine: Machine) -> list[tuple[str, float]]:
    parameter = machine.parameters.get(path)
    if parameter is None:
        report.fault(pointer, "invalid-path", machine.why_not(path), path, allowed="the path of a number in `base`")
        return []
    found = read_object(report, pointer, data, FIELDS)
    if found is None:
        return []
    if not found:
        report.fault(pointer, "required", "has no condition", data, allowed=one_of(FIELDS))
    if refuse_mixed(report, _quantities(pointer, found), parameter.unit):
        return []
    listed = found.get("is")
    if isinstance(listed, list) and refuse_blanks(report, _quantities(pointer, {"is": listed})):
        return []
    parts: list[tuple[str, float]] = []
    for name in FIELDS:
        if name not in found:
            continue
        given = found[name]
        where = join(pointer, name)
        if name == "is" and isinstance(given, str) and len(split_list(given)) > 1:
            items = read_list_text(report, where, given, parameter.unit, path) or []
            values = [read_number(report, where, item, parameter) for item in items]
        elif isinstance(given, list):
            if name != "is" or not 1 <= len(given) <= MAX_AXIS_VALUES:
                report.fault(
                    join(pointer, name), "wrong-type", "must be a quantity", given,
                    allowed="one quantity" if name != "is" else "1 value or more",
                )  # fmt: skip
                continue
            values = [read_number(report, join(pointer, name, i), item, parameter) for i, item in enumerate(given)]
        else:
            values = [read_number(report, join(pointer, name), given, parameter)]
        parts += [(name, value) for value in values if value is not None]
    return parts


def _quantities(pointer: str, found: Mapping[str, Any]) -> Iterator[tuple[str, object]]:
    """Every value of a condition with its JSON Pointer."""
    for name, given in found.items():
        if isinstance(given, list):
            yield from ((join(pointer, name, index), item) for index, item in enumerate(given))
        else:
            yield join(pointer, name), given


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
