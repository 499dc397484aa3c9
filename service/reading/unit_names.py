"""Names of units: what each means, which prefixes and plurals it has, and what could be misread.

pint converts, but would also read "Grad" as giga-radian, "Pas" as several pascals and "Mm" as a million metres: a name
counts only where `resolved` knows it.
"""

from __future__ import annotations

import difflib
from fractions import Fraction
from functools import lru_cache
from typing import Final

from sprag_study.sentences import Sentence
from sprag_study.service.languages import N_

#: Twice pi to 50 digits, so that its rounding never affects a double.
TWO_PI: Final = "6.2831853071795864769252867665590057683943387987502"

_PHYSICAL: Final = (
    "percent = 0.01 = %",
    *("nano- = 1e-9 = n-", "micro- = 1e-6 = µ- = u-", "milli- = 1e-3 = m-", "centi- = 1e-2 = c-", "deci- = 1e-1 = d-"),
    *("kilo- = 1e3 = k-", "mega- = 1e6 = M-", "giga- = 1e9 = G-"),
    *("meter = [length] = m = metre", "gram = [mass] = g", "second = [time] = s = sec", "radian = [angle] = rad"),
    *(
        "inch = 0.0254 * meter = in",
        "foot = 0.3048 * meter = ft",
        "tonne = 1e6 * gram = t",
        "pound = 453.59237 * gram = lb",
        "ounce = 28.349523125 * gram = oz",
    ),
    *("minute = 60 * second = min", "hour = 3600 * second = h = hr"),
    f"turn = {TWO_PI} * radian = _ = revolution = rev = cycle = r = U = Umdr",  # nameplates: r/min, U/min
    *(
        "degree = turn / 360 = deg = °",
        "arcminute = degree / 60 = arcmin",
        "arcsecond = degree / 3600 = arcsec",
        "gon = turn / 400",
    ),
    *("revolution_per_minute = turn / minute = rpm = RPM = Upm", "revolution_per_second = turn / second = rps = cps"),
    *("hertz = 1 / second = Hz = Hertz", "newton = 1000 * gram * meter / second**2 = N", "joule = newton * meter = J"),
    *("pascal = newton / meter**2 = Pa", "bar = 1e5 * pascal", "atmosphere = 101325 * pascal = atm"),
    *("watt = joule / second = W", "kilogram_force = 9.80665 * newton = kgf = kp"),
    *("pound_force = 4.4482216152605 * newton = lbf", "ounce_force = pound_force / 16 = ozf"),
    "pound_force_per_square_inch = pound_force / inch**2 = psi",
    *(
        "horsepower = 550 * foot * pound_force / second = hp",
        "metric_horsepower = 75 * kilogram_force * meter / second = PS",
    ),
    *("watt_second = watt * second = Ws", "watt_hour = 3600 * watt_second = Wh"),
    "standard_gravity = 9.80665 * meter / second**2 = g_0 = g0",
    # Torques are often written without the multiplication sign.
    *("newton_meter = newton * meter = Nm", "newton_centimeter = newton_meter / 100 = Ncm"),
    *("newton_millimeter = newton_meter / 1000 = Nmm", "newton_meter_second = newton_meter * second = Nms"),
    *(
        "newton_centimeter_second = newton_centimeter * second = Ncms",
        "newton_millimeter_second = newton_millimeter * second = Nmms",
    ),
)

#: Units of money. No rate changes one into another.
CURRENCIES: Final = {
    "EUR": "euro", "UAH": "hryvnia", "USD": "us_dollar", "GBP": "pound_sterling", "CHF": "swiss_franc", "PLN": "zloty",
    "CZK": "czech_koruna",
}  # fmt: skip

DEFINITIONS: Final = (
    *_PHYSICAL,
    *(f"{name} = [{name}] = {symbol}" for symbol, name in CURRENCIES.items()),
)

#: Prefixes that a symbol has. Others, such as those of Mm, Grad and mt, are more often something else.
_PREFIXED: Final = {
    **dict.fromkeys(("N", "J", "W", "Pa", "Hz", "rps", "Nm"), "nuµmcdkMG"),
    **dict.fromkeys(("m", "s", "rad"), "nuµmcdk"),
    **dict.fromkeys(("Nms", "Wh", "Ws"), "uµmkM"),
    **dict.fromkeys(("Ncm", "Nmm", "Ncms", "Nmms"), "mk"),
    "g": "nuµmcdkM", "sec": "nuµm", "bar": "uµmk", "t": "kM", "deg": "m", "g0": "m", "rpm": "k", "psi": "k", "lbf": "k",
}  # fmt: skip
#: Words that have prefixes written out, and symbols that have a plural; words of at least four letters have one too.
_WORDS: Final = (
    "meter",
    "metre",
    "gram",
    "second",
    "radian",
    "newton",
    "joule",
    "watt",
    "pascal",
    "hertz",
    "tonne",
    "bar",
)
_WITH_PLURAL: Final = ("lb", "lbf", "oz", "ozf", "hr", "sec", "min", "deg", "rad", "rev", "bar", "kg")
_WORD_LENGTH: Final = 4
_IRREGULAR_PLURALS: Final = {"inches": "inch", "feet": "foot"}
_QUESTIONS: Final = {
    **dict.fromkeys(("grad", "Grad", "GRAD"), N_("has the unit '{unit}', which could be degrees or gons: deg or gon?")),
    "кгсм": N_("has the unit '{unit}', which could be kg*cm or kgf*m: кг*см or кгс*м?"),
}


@lru_cache(maxsize=1)
def _defined() -> tuple[frozenset[str], dict[str, Fraction]]:
    """Names and symbols of units, and prefixes, in letters and written out, with their factors."""
    names, prefixes = set[str](), dict[str, Fraction]()
    for line in DEFINITIONS:
        name, definition, *aliases = (part.strip() for part in line.split("="))
        if name.endswith("-"):
            prefixes |= {own.removesuffix("-"): Fraction(definition) for own in (name, *aliases)}
        else:
            names |= {name, *(alias for alias in aliases if alias != "_")}
    return frozenset(names), prefixes


def resolved(name: str) -> tuple[Fraction, str] | None:
    """The factor of the prefix of a name and its unit without prefix and plural; None for a name of no unit.

    The case of letters counts.
    """
    names, prefixes = _defined()
    name = _IRREGULAR_PLURALS.get(name, name)
    if name in names:
        return Fraction(1), name
    unit = name[1:]
    if name[:1] in _PREFIXED.get(unit, ""):
        return prefixes[name[0]], unit
    for prefix, factor in prefixes.items():
        if len(prefix) > 1 and name.startswith(prefix) and name.removeprefix(prefix) in _WORDS:
            return factor, name.removeprefix(prefix)
    one = name.removesuffix("s")
    if one == name or one.endswith("s") or not (one.islower() or one in _WITH_PLURAL):
        return None
    found = resolved(one)
    word = found is not None and len(one) >= _WORD_LENGTH and (one in names or found[1] in _WORDS)
    return found if word or one in _WITH_PLURAL else None


def refusal(name: str) -> Sentence:
    """Why a name is that of no unit, with the nearest one."""
    if name in _QUESTIONS:
        return Sentence(_QUESTIONS[name], unit=name)
    known = {own.lower(): own for own in (*sorted(_defined()[0], reverse=True), "kN", "km", "cm", "mm", "kg")}
    near = difflib.get_close_matches(name.lower(), known, n=1, cutoff=0.5)
    if not near:
        return Sentence("has an unknown unit '{unit}'", unit=name)
    return Sentence("has an unknown unit '{unit}' (did you mean '{near}'?)", unit=name, near=known[near[0]])
