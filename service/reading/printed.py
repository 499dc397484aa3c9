"""Numbers as pages, reports and catalogues print them, which can be typed back: "20 000", "2,5·10⁻³", "1*10^3"."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

_BLANKS: Final = " \u00a0\u2007\u2009\u202f"
#: Digits in groups of three between blanks, not followed by another digit.
_GROUPED: Final = re.compile(rf"(\s*[+\-\u2212]?[1-9][0-9]{{0,2}}(?:[{_BLANKS}][0-9]{{3}})+)(?![0-9])")
_BETWEEN: Final = re.compile(rf"(?<=[0-9])[{_BLANKS}]")
#: A number and a power of ten; the number may be missing.
_POWER: Final = re.compile(
    r"(\s*)([+\-\u2212]?)(?:([0-9.,]+)\s*[*·⋅×\u2219xх]\s*)?10"
    r"(?:(?:\^|\*\*)\s*\(?([+\-\u2212]?[0-9]{1,4})\)?|([⁺⁻]?[⁰¹²³⁴⁵⁶⁷⁸⁹]{1,4}))(?![0-9⁰¹²³⁴⁵⁶⁷⁸⁹])"
)
_LOWERED: Final = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁺\u2212", "0123456789-+-")
#: Groups of three digits between blanks, and nothing else.
_ONLY_GROUPS: Final = re.compile(rf"\s*[+\-\u2212]?[1-9][0-9]{{0,2}}(?:[{_BLANKS}][0-9]{{3}})+\s*")
#: Groups of three digits between blanks of the keyboard, each of which could be a value.
_VALUES: Final = re.compile(r"\s*[+\-\u2212]?[1-9][0-9]{0,2}(?: [1-9][0-9]{2})+(?![0-9])(?! 0)")


def keyboard(text: str) -> str:
    """``text`` with the number at its beginning as a keyboard has it; anything else in it stays as it is.

    "20 000 N" becomes "20000 N", and "2,5·10⁻³ kg" becomes "2,5e-3 kg".
    """
    groups = _GROUPED.match(text)
    if groups is not None:
        text = _BETWEEN.sub("", groups[1]) + text[groups.end() :]
    power = _POWER.match(text)
    if power is None:
        return text
    exponent = (power[4] or power[5]).translate(_LOWERED)
    return f"{power[1]}{power[2]}{power[3] or 1}e{exponent}{text[power.end() :]}"


def could_be_values(items: Sequence[str]) -> int | None:
    """The place of the first item of a list that could be several values between blanks, such as ``100 200 N*mm``.

    A value does not begin with a zero, as the groups of ``20 000`` do, and pages print narrower blanks: one number with
    either proves for the whole list that its blanks separate thousands.
    """
    place = next((place for place, item in enumerate(items) if _VALUES.match(item)), None)
    return None if place is None or any(_GROUPED.match(item) and not _VALUES.match(item) for item in items) else place


def could_be_several(text: str) -> bool:
    """Whether a list whose numbers only blanks separate, such as ``25 400``, could also be one number."""
    return _ONLY_GROUPS.fullmatch(text) is not None
