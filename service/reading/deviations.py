"""Tolerances as drawings have them: both deviations from a nominal value, as ``+0.05/-0 mm``, and values with one."""

from __future__ import annotations

import re
from typing import Final

from sprag_study.service.reading.ranges import could_be_several
from sprag_study.service.reading.together import typed_unit, with_last_unit
from sprag_study.worker.limits import MAX_QUANTITY_LENGTH

_SIGN: Final = "[-+\u2212\u2013]"
_ZERO: Final = r"0(?:[.,]0*)?(?![.,\d])"
_BEGINNING: Final = re.compile(f"{_SIGN}|{_ZERO}")
#: Between two deviations: a slash, or a blank before one that falls.
_BETWEEN: Final = re.compile(rf"\s*/\s*(?={_SIGN}|{_ZERO})|\s+(?=[-\u2212\u2013]|{_ZERO})")
_RISING: Final = re.compile(rf"\+|{_ZERO}")
#: Between a value and its tolerance.
_BEFORE: Final = re.compile(r"\s*(?:±|\+/?[-\u2212])\s*|\s+")


def deviations(text: str) -> tuple[str, str] | None:
    """The two deviations of ``+0.05/-0 mm``, in their order and each with its unit; None for any other text.

    A unit of one of them is that of both.
    """
    text = text.strip()
    if len(text) > MAX_QUANTITY_LENGTH or not _BEGINNING.match(text):
        return None
    for gap in _BETWEEN.finditer(text):
        first, second = (re.sub(rf"^({_SIGN})\s+", r"\1", part) for part in (text[: gap.start()], text[gap.end() :]))
        units = _unit(first), _unit(second)
        if None in units or not ("/" in gap[0] or _RISING.match(first)):
            continue
        if units[0] == "" and units[1]:
            first = f"{first} {units[1]}"
        elif units[1] == "" and units[0]:
            second = f"{second} {units[0]}"
        return first, second
    return None


def with_tolerance(text: str) -> tuple[str, str] | None:
    """The value and the tolerance of ``9 N/mm ± 10 %``, ``9 N/mm +- 10 %`` or ``30 +0.05/-0 mm``; None for other texts.

    A unit at the end is that of a bare value before it.
    """
    text = text.strip()
    for gap in _BEFORE.finditer(text) if len(text) <= MAX_QUANTITY_LENGTH else ():
        value, tolerance = text[: gap.start()], text[gap.end() :]
        pair = deviations(tolerance)
        if _unit(value) is None or not tolerance or not (pair or gap[0].strip()):
            continue
        if pair is None:
            value, tolerance = with_last_unit([value, tolerance])
        else:
            value = with_last_unit([value, pair[1]])[0]
            unit = _unit(value)
            tolerance = f"{tolerance} {unit}" if unit and _unit(pair[1]) == "" else tolerance
        return value, tolerance.strip()
    return None


def _unit(text: str) -> str | None:
    """The unit of one quantity; None for what is none, and for several."""
    return None if could_be_several(text) else typed_unit(text)
