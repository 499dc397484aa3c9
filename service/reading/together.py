"""Quantities that somebody types together: the values of a list, the ends and the step of a range.

A unit at the end holds for the bare numbers before it: ``0; 50; 100 N*mm`` are three torques in N*mm (`with_last_unit`,
for one text and for fields that stand beside each other). Items of a spec are read one by one, and a bare number is in
the SI unit: beside quantities in units of another scale it is never guessed but asked about (`question`).
"""

from __future__ import annotations

import re
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Final

from sprag_study.sentences import Sentence, Typed, joined
from sprag_study.service.faults import Code
from sprag_study.service.reading.cyrillic import latin
from sprag_study.service.reading.units import PERCENT, PERIOD_NAMES, QuantityError, measure, parse_exact, split_typed

#: Code of a bare number that could be in several units.
AMBIGUOUS_UNIT: Final[Code] = "ambiguous-unit"
_LISTED: Final = 3
#: Between values of a list in one text, tabs those of pasted cells: a comma counts only before a blank, otherwise it is
#: decimal.
_BETWEEN: Final = re.compile(r"[;\n\t]|,\s")


@dataclass(frozen=True, slots=True)
class Question:
    """What is asked about a bare number: ``place`` is that of the number among the values."""

    place: int
    message: str
    allowed: str


def with_last_unit(texts: Sequence[str]) -> list[str]:
    """The texts, the bare numbers among them with the unit of the last one.

    Where other units stand before it, or the unit is not at the end, they stay as they are: the reader of the spec
    asks.
    """
    units = [typed_unit(text) for text in texts]
    last = next((unit for text, unit in zip(reversed(texts), reversed(units), strict=True) if text.strip()), None)
    if not last or _kind(last) is None or len({_kind(unit) for unit in set(units) if unit}) > 1:
        return list(texts)
    return [f"{text.strip()} {last}" if unit == "" else text for text, unit in zip(texts, units, strict=True)]


def split_list(text: str) -> list[str]:
    """The values of a list that is typed as one text, as they are written."""
    return [item.strip() for item in _BETWEEN.split(text) if item.strip()]


def with_unit_of_range(first: str, last: str, step: str) -> tuple[str, str, str]:
    """The ends and the step of a range with the unit of its end, or of the step where only that has one."""
    if typed_unit(step) == "":
        first, step, last = with_last_unit([first, step, last])
    else:
        first, last, step = with_last_unit([first, last, step])
    return first, last, step


def with_unit_of_end(first: str | None, last: str | None) -> tuple[str | None, str | None]:
    """Two ends of a range, None where one is not given."""
    if first is None or last is None:
        return first, last
    low, high = with_last_unit([first, last])
    return low, high


def question(values: Sequence[object], unit: str) -> Question | None:
    """What is asked about the first bare number that stands beside quantities in units of another scale.

    ``values`` are numbers, and texts with or without a unit; ``unit`` is the SI unit of bare numbers. Zero is the same
    in every unit.
    """
    return next(iter(questions(values, [unit] * len(values))), None)


def questions(values: Sequence[object], units: Sequence[str]) -> list[Question]:
    """As `question`, about every such number of values that have SI units of their own: coefficients of a series."""
    if not any(isinstance(value, str) for value in values):
        return []
    typed = [typed_unit(value) if isinstance(value, str) else None for value in values]
    # Each once, however many values there are: whether a name is a unit takes long where it is none.
    pairs = dict.fromkeys((name, unit) for name, unit in zip(typed, units, strict=True) if name)
    others = [pair for pair in pairs if _differs(*pair)]
    asked = []
    for place, (value, own) in enumerate(zip(values, typed, strict=True)):
        number = _bare(value, own) if others else None
        if number is not None:
            every = [Typed(units[place]), *(_carried(*other, units[place]) for other in others)]
            names = list(dict.fromkeys(every))[:_LISTED]
            *first, last = (Sentence("in {unit}", unit=name) for name in names)
            message = Sentence(
                "has no unit beside values that have one: {number} {units} or {unit}?",
                number=number, units=joined(", ", first), unit=last,
            )  # fmt: skip
            asked.append(Question(place, message, joined(", ", (joined(" ", (number, name)) for name in names))))
    return asked


def _carried(name: str, unit: str, wanted: str) -> Typed | Sentence:
    """The unit of another coefficient that goes with a typed one: "N*mm/rad^2" (of N*m/rad^2) for N*m is "N*mm"."""
    if unit == wanted:
        return Typed(name)
    per, wanted_per = (text[len(text.partition("/")[0]) :] for text in (unit, wanted))
    if name.endswith(per):
        return Typed(name.removesuffix(per) + wanted_per)
    return Sentence("another unit, as {unit}", unit=Typed(name))


def _bare(value: object, unit: str | None) -> str | None:
    """A number other than 0 without a unit, as it was written; None for anything else."""
    if isinstance(value, str):
        return value.strip() if unit == "" and split_typed(value)[0] else None
    return repr(value) if isinstance(value, int | float) and not isinstance(value, bool) and value else None


def typed_unit(text: object) -> str | None:
    """The unit of a text as it was typed, "" of a bare number; None for what is no quantity."""
    try:
        return split_typed(str(text))[1]
    except QuantityError:
        return None


def _kind(unit: str) -> Hashable:
    """Equal for units that mean the same, as "N*mm" and "Nmm"; None for what is no unit, as "%"."""
    if latin(unit) in PERIOD_NAMES:
        return "periods"
    if unit in PERCENT:  # a share of each value, or a number of its own
        return None
    try:
        factor, powers = measure(unit)
    except QuantityError:
        return None
    return factor, frozenset(powers.items())


def _differs(name: str, unit: str) -> bool:
    """Whether a unit of the quantity is another one than its SI unit; False for a unit of another quantity.

    A number without a unit beside per cent is none of these: 0.4 beside 40 %.
    """
    if unit == "1":
        return False
    if latin(name) in PERIOD_NAMES and unit in {"s", "rad"}:
        return True
    try:
        return parse_exact(f"1 {name}", unit) != Fraction(1)
    except QuantityError:
        return False
