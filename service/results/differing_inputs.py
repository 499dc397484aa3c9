"""The inputs in which several studies differ, as people read them."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from sprag.service.answers.differing import differing
from sprag.service.languages import gettext as _
from sprag.service.results.phrases import plural
from sprag.service.results.wording import number, unit_text
from sprag.service.spec.catalogue import shown_values, unit_of
from sprag.service.spec.units import QuantityError, parse_quantity
from sprag.worker.models.parameters import parameter_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from sprag.service.results.reading import Reading
    from sprag.worker.study import Axis, Study

#: Characters of an input in the table.
_LONGEST: Final = 120
#: Of an axis with more values, the first ones and the last are listed.
_MOST_VALUES: Final = 12
_DIGITS: Final = 8


@dataclass(frozen=True, slots=True)
class DifferingInput:
    """An input in which studies differ: its path in the spec, what it is called, and the value of each study."""

    path: str
    caption: str
    values: list[str]


def differing_inputs(
    specs: Sequence[Mapping[str, Any]], studies: Sequence[Study], reading: Reading
) -> list[DifferingInput]:
    """Parameters of the machine and values of axes as they are read, other inputs as they were written."""
    rows = _axes(studies, reading)
    for pointer, values in differing(specs).items():
        if pointer.split("/")[1] == "axes":
            continue
        path = pointer[1:].replace("/", ".").replace("~1", "/").replace("~0", "~")
        row = _parameter(path, values, studies, reading)
        rows += [] if row is None else [row]
    return rows


def _axes(studies: Sequence[Study], reading: Reading) -> list[DifferingInput]:
    """What varies, where it does not have the same values in all studies."""
    rows = []
    for paths in dict.fromkeys(axis.paths for study in studies for axis in study.axes):
        found = [next((axis for axis in study.axes if axis.paths == paths), None) for study in studies]
        if len({None if axis is None else axis.array.tobytes() for axis in found}) > 1:
            pairs = zip(studies, found, strict=True)
            shown = ["–" if axis is None else _values(study, axis, reading) for study, axis in pairs]
            name = " = ".join(paths)
            rows.append(DifferingInput(name, _("{name}, varied", name=reading.caption(name)), shown))
    return rows


def _values(study: Study, axis: Axis, reading: Reading) -> str:
    unit, values = unit_of(study, axis.paths[0]), shown_values(study, axis)
    shown = [number(reading.value(value, unit), _DIGITS) for value in values.tolist()]
    if len(shown) > _MOST_VALUES:
        shown = [*shown[: _MOST_VALUES - 2], "…", shown[-1]]
    text = f"{'; '.join(shown)} {unit_text(reading.unit(unit))}".strip()
    if values.size <= _MOST_VALUES:
        return text
    return f"{text} ({reading.say(plural('{count} value', '{count} values', values.size))})"


def _parameter(path: str, values: Sequence[Any], studies: Sequence[Study], reading: Reading) -> DifferingInput | None:
    """None where the values differ only in how they were written."""
    first, _dot, name = path.partition(".")
    entry = (
        next((found for study in studies if (found := parameter_of(study, name))), None) if first == "base" else None
    )
    numbers = [None if value is None or entry is None else _in_si(value, entry.unit) for value in values]
    if entry is None or all(number is None for number in numbers):
        return DifferingInput(path, path, [_written(value) for value in values])
    if None not in numbers and len(set(numbers)) == 1:
        return None
    shown = [
        _written(value) if number is None else reading.quantity(number, entry.unit, _DIGITS)
        for value, number in zip(values, numbers, strict=True)
    ]
    return DifferingInput(path, reading.caption(name), shown)


def _in_si(value: object, unit: str) -> float | None:
    """A quantity of a spec; None for anything else."""
    try:
        return parse_quantity(value, unit)
    except QuantityError:
        return None


def _written(value: object) -> str:
    """A value of a spec as text, long lists shortened."""
    if value is None:
        return "–"
    text = value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]} …"
