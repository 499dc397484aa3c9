"""Display of numbers, units and names."""

from __future__ import annotations

import math
import re
from typing import Final

from markupsafe import Markup

from sprag.worker import models

#: Narrow no-break space, the thousands separator of ISO 80000.
_THIN: Final = "\N{NARROW NO-BREAK SPACE}"
_RAISED: Final = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
#: Significant digits of numbers on pages; files and the API have all digits.
_DIGITS: Final = 5
_GREEK: Final = {
    "alpha": "α", "beta": "β", "chi": "χ", "delta": "δ", "eta": "η", "lambda": "λ", "nu": "ν", "phi": "φ", "rho": "ρ",
    "w": "ω",
}  # fmt: skip


def number(value: float | str | None, digits: int = _DIGITS) -> str:
    """A number for display: few digits, separated thousands, superscript powers of ten; a dash for none.

    The name of a category is unchanged.
    """
    if isinstance(value, str):
        return value
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "–"
    if isinstance(value, int):
        return f"{value:,}".replace(",", _THIN)
    text = f"{value:.{digits}g}".replace("-", "−", 1 if value < 0 else 0)
    mantissa, _, exponent = text.partition("e")
    rounded = float(f"{value:.{digits}g}")
    if 1e3 <= abs(rounded) < 1e7 and (exponent or ("." not in text and abs(value) >= 1e4)):
        return _grouped(rounded)
    if not exponent:
        return text
    return f"{mantissa}·10{str(int(exponent)).translate(_RAISED)}"


def _grouped(value: float) -> str:
    return f"{value:,.0f}".replace(",", _THIN).replace("-", "−")


def unit_text(unit: str | None) -> str:
    """``kg*m^2`` as ``kg·m²``; nothing for a number without a unit."""
    if unit in (None, "1"):
        return ""
    raised = re.sub(r"\^(-?\d+)", lambda found: found[1].translate(_RAISED), str(unit))
    return raised.replace("*", "·")


def symbol(text: str) -> Markup:
    """A symbol of the model with its index, as in print."""
    base, _, index = text.partition("_")
    if not index and (found := re.fullmatch(r"([A-Za-z]+)(\d+)", text)):
        base, index = found[1], found[2]
    base, index = models.printed_symbol(text) or (_GREEK.get(base, base), index)
    return Markup("<i>{}</i>{}").format(base, Markup("<sub>{}</sub>").format(index) if index else "")


def words(name: str) -> str:
    """``shaft.speed.mean`` as ``Shaft speed mean``."""
    text = name.replace(".", " ").replace("_", " ").strip()
    text = re.sub(r"^pendulums (\d+)", r"pendulum \1", text)
    return text[:1].upper() + text[1:] if text[:1].isascii() else text


def counted(value: int, noun: str) -> str:
    """How many there are: "1 drive", "1,000 drives"; the plural has an s."""
    return f"{value:,} {noun}{'' if value == 1 else 's'}"


def percent(share: float) -> str:
    """A share for display."""
    return f"{100.0 * share:.2g} %"
