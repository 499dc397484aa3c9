"""Display of numbers, units and names."""

from __future__ import annotations

import math
import re
from typing import Final

from markupsafe import Markup

from sprag_study.service.languages import ENGLISH, N_, current, decimal, gettext, grouped, ngettext, pgettext
from sprag_study.worker import models
from sprag_study.worker.models.vocabulary import words

__all__ = ["counted", "duration", "number", "percent", "symbol", "typed_text", "unit_text", "words"]

_RAISED: Final = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
#: A name of a unit; words of a sentence around it have none in the catalogues.
_UNIT: Final = re.compile(r"[A-Za-z]+\d?")
#: English words that name units too. In a sentence they are units after a number and before no other word than these.
_WORDS: Final = frozenset({"in"})
_AFTER_NUMBER: Final = re.compile(r"\d\s?\Z")
_BEFORE_WORD: Final = re.compile(r"\s+(?!(?:to|and|or|or less|or more)\b)[^\W\d_]")
#: A number of a text, and its unit.
_QUANTITY: Final = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?)(\s?)([A-Za-z][A-Za-z\d*/^-]*)?")
#: Significant digits of numbers on pages; files and the API have all digits.
_DIGITS: Final = 5
_GREEK: Final = {
    "alpha": "α", "beta": "β", "chi": "χ", "delta": "δ", "eta": "η", "kappa": "κ", "lambda": "λ", "nu": "ν",
    "omega": "ω", "phi": "φ", "psi": "ψ", "rho": "ρ", "w": "ω",
}  # fmt: skip


#: What `counted` counts.
NOUNS: Final = ("case", "design", "drive", "generation", "result", "round", "run", "strobe")


def number(value: float | str | None, digits: int = _DIGITS) -> str:
    """A number for display: few digits, thousands separated from 10 000 on, superscript powers of ten; a dash for none.

    The name of a category is unchanged.
    """
    if isinstance(value, str):
        return value
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "–"
    if isinstance(value, int):
        return grouped(value).replace("-", "−")
    text = f"{value:.{digits}g}"
    mantissa, _, exponent = text.partition("e")
    if not exponent:
        return _separated(text)
    if 1e3 <= abs(float(text)) < 1e7:
        return _separated(f"{float(text):.0f}")
    return f"{_separated(mantissa)}·10{str(int(exponent)).translate(_RAISED)}"


def _separated(text: str) -> str:
    """A number written by Python with the signs of print."""
    whole, mark, rest = text.lstrip("-").partition(".")
    return ("−" if text.startswith("-") else "") + decimal(grouped(int(whole)) + mark + rest)


def unit_text(unit: str | None) -> str:
    """``kg*m^2`` as ``kg·m²``; nothing for a number without a unit."""
    if unit in (None, "1"):
        return ""
    named = str(unit)
    if current() != ENGLISH:
        named = _UNIT.sub(_unit_name, pgettext("unit", named))
    raised = re.sub(r"\^(-?\d+)", lambda found: found[1].translate(_RAISED), named)
    return raised.replace("*", "·")


def _unit_name(found: re.Match[str]) -> str:
    """A unit of a text in the reader's language; an English word that also names a unit only where it is one."""
    text, name = found.string, found[0]
    if name in _WORDS and " " in text and not _AFTER_NUMBER.search(text, 0, found.start()):
        return name
    if name in _WORDS and _BEFORE_WORD.match(text, found.end()):
        return name
    return pgettext("unit", name)


def typed_text(text: str) -> str:
    """A quantity, or several, as somebody types them: ``0.3 deg`` as ``0,3 град``; words around them stay."""
    if current() == ENGLISH:
        return text
    return _QUANTITY.sub(_typed, text)


def _typed(found: re.Match[str]) -> str:
    """A quantity of a text."""
    number_, blank, unit = found[1], found[2], found[3] or ""
    word = unit in _WORDS and _BEFORE_WORD.match(found.string, found.end())
    return f"{decimal(number_)}{blank}{unit if word else unit_text(unit)}"


def symbol(text: str) -> Markup:
    """A symbol of the model with its index, as in print."""
    base, _, index = text.partition("_")
    if not index and (found := re.fullmatch(r"([A-Za-z]+)(\d+)", text)):
        base, index = found[1], found[2]
    base, index = models.printed_symbol(text) or (_GREEK.get(base, base), index)
    return Markup("<i>{}</i>{}").format(base, Markup("<sub>{}</sub>").format(index) if index else "")


def counted(value: int, noun: str) -> str:
    """How many there are: "1 drive", "1 000 drives"; ``noun`` is one of `NOUNS`, whose plural has an s."""
    one, many = f"{{n}} {noun}", f"{{n}} {noun}s"
    return ngettext(one, many, value, n=grouped(value))


def percent(share: float) -> str:
    """A share for display."""
    return decimal(f"{100.0 * share:.2g} %")


def duration(seconds: float) -> str:
    """A rough duration in a suitable unit, two digits: ``40 s``, ``3 min``, ``2.5 h``."""
    if seconds < 1.0:
        return gettext("less than 1 s")
    for limit, divisor, unit in ((100.0, 1.0, N_("s")), (6000.0, 60.0, N_("min")), (172800.0, 3600.0, N_("h"))):
        if seconds < limit:
            rounded = float(f"{seconds / divisor:.2g}")
            return f"{decimal(f'{rounded:g}')} {gettext(unit)}"
    days = float(f"{seconds / 86400.0:.2g}")
    return ngettext("{n} day", "{n} days", days, n=decimal(f"{days:g}"))
