"""Tolerances as drawings have them: both deviations from a nominal value, as ``+0.05/-0 mm``, and values with one."""

from __future__ import annotations

import re
from typing import Final

from sprag_study.service.reading.together import typed_unit, with_last_unit

_SIGN: Final = "[-+\u2212\u2013]"
_ZERO: Final = r"0(?:[.,]0*)?(?![.,\d])"
#: Two deviations with a slash between; a rising and a falling one also with a blank.
_TWO: Final = (
    rf"(?:{_SIGN}\s*[.,\d][^±]*?|{_ZERO}[^±]*?)\s*/\s*(?:{_SIGN}\s*[.,\d]|{_ZERO})[^±]*"
    rf"|\+\s*[.,\d][^±]*?\s(?:[-\u2212\u2013]\s*[.,\d]|{_ZERO})[^±]*"
)
_PAIR: Final = re.compile(_TWO)
_BETWEEN: Final = re.compile(rf"\s*/\s*(?={_SIGN}|{_ZERO})|\s+(?=[-\u2212\u2013]\s*[.,\d]|{_ZERO})")
_VALUE: Final = re.compile(rf"([^±]*?\d[^±]*?)\s+({_TWO})")


def deviations(text: str) -> tuple[str, str] | None:
    """The two deviations of ``+0.05/-0 mm``, in their order and each with its unit; None for any other text.

    A unit of one of them is that of both.
    """
    if _PAIR.fullmatch(text.strip()) is None:
        return None
    first, second = (
        re.sub(rf"({_SIGN})\s+", r"\1", part, count=1) for part in _BETWEEN.split(text.strip(), maxsplit=1)
    )
    units = typed_unit(first), typed_unit(second)
    if units[0] == "" and units[1]:
        first = f"{first} {units[1]}"
    elif units[1] == "" and units[0]:
        second = f"{second} {units[0]}"
    return first, second


def with_tolerance(text: str) -> tuple[str, str] | None:
    """The value and the tolerance of ``9 N/mm ± 10 %`` or ``30 +0.05/-0 mm``; None for any other text.

    A unit at the end is that of a bare value before it.
    """
    if "±" in text:
        value, tolerance = (part.strip() for part in with_last_unit(text.split("±", 1)))
    elif found := _VALUE.fullmatch(text.strip()):
        value, tolerance = found[1], found[2]
        pair = deviations(tolerance) or ("", "")
        value = with_last_unit([value, pair[1]])[0]
        unit = typed_unit(value)
        tolerance = f"{tolerance} {unit}" if unit and typed_unit(pair[1]) == "" else tolerance
    else:
        return None
    return (value, tolerance) if value and tolerance else None
