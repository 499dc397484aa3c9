"""Ranges that somebody types as one text: ``20 to 35 Hz step 5``, ``0..0,4 Нм через 0,1``, ``20–35 Hz, 4 values``."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

from sprag_study.service.reading.together import with_unit_of_range
from sprag_study.service.reading.units import QuantityError, split_typed

#: Between the ends: dots, a dash, or a word; a hyphen counts between digits only, where it is no sign of an exponent.
_BETWEEN: Final = r"(?:\s*(?:\.{2,3}|…)\s*|\s+(?:to|up to|до)\s+|\s*[–—]\s*|\s+-\s+|(?<=[0-9])-(?=[0-9]))"
_STEP: Final = r"(?:in steps of|steps?(?: of)?|by|з кроком|кроком|крок|через)"
_VALUES: Final = r"(?:values|points|значень|значення|точок|точки)"
_RANGE: Final = re.compile(
    rf"\s*(?:(?:from|від|з)\s+)?(?P<first>\S.*?){_BETWEEN}(?P<last>\S.*?)"
    rf"(?:\s*[,;]?\s*{_STEP}\s*(?P<step>\S.*?)|\s*[,;]\s*(?P<count>[0-9]{{1,7}})\s*{_VALUES})?\s*"
)
#: A number within what should be a unit, as in "0.2 0.3" behind a first number; "1/min" is a unit.
_NUMBER_WITHIN: Final = re.compile(r"(?:^|[\s/|&±:])(?!1\s*/)[0-9]")
_LONGEST: Final = 200


@dataclass(frozen=True, slots=True)
class TypedRange:
    """The ends of a range as they were typed, with their unit, and its step or how many values it has, if given."""

    first: str
    last: str
    step: str
    count: int | None


def typed_range(text: str) -> TypedRange | None:
    """The range that a text is; None for anything else, such as a single quantity."""
    found = _RANGE.fullmatch(text) if len(text) <= _LONGEST else None
    if found is None or not all(_is_quantity(found[name]) for name in ("first", "last", "step") if found[name]):
        return None
    first, last, step = with_unit_of_range(found["first"], found["last"], found["step"] or "")
    return TypedRange(first, last, step, int(found["count"]) if found["count"] else None)


def _is_quantity(text: str) -> bool:
    try:
        return not _NUMBER_WITHIN.search(split_typed(text)[1])
    except QuantityError:
        return False


def could_be_several(text: str) -> bool:
    """Whether a text has several numbers with nothing between them that separates values: ``0.1 0.2 N*m``."""
    try:
        return _NUMBER_WITHIN.search(split_typed(text)[1]) is not None
    except QuantityError:
        return False
