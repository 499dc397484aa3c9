"""Names of units: nothing that somebody writes is read as another unit than is meant."""

from __future__ import annotations

import itertools
import re
from fractions import Fraction
from typing import Final

import pytest

from sprag_study.service.reading.unit_names import DEFINITIONS, resolved
from sprag_study.service.reading.units import QuantityError, measure, parse_quantity

#: What a mechanical engineer means by a symbol, as factor and powers of kg, m, s and rad: written down here once more.
_TURN: Final = "6.2831853071795864769252867665590057683943387987502"
_LBF, _FOOT, _INCH = Fraction("4.4482216152605"), Fraction("0.3048"), Fraction("0.0254")
_KGF: Final = Fraction("9.80665")
MEANING: Final[dict[str, tuple[Fraction | int | str, str]]] = {
    "m": (1, "m"), "g": ("0.001", "kg"), "s": (1, "s"), "sec": (1, "s"), "rad": (1, "rad"), "in": (_INCH, "m"),
    "ft": (_FOOT, "m"), "t": (1000, "kg"), "lb": ("0.45359237", "kg"), "oz": (Fraction("0.45359237") / 16, "kg"),
    "min": (60, "s"), "h": (3600, "s"), "hr": (3600, "s"), "rev": (_TURN, "rad"), "r": (_TURN, "rad"),
    "U": (_TURN, "rad"), "Umdr": (_TURN, "rad"), "Upm": (Fraction(_TURN) / 60, "rad/s"), "cps": (_TURN, "rad/s"),
    "Hertz": (1, "1/s"), "deg": (Fraction(_TURN) / 360, "rad"), "°": (Fraction(_TURN) / 360, "rad"),
    "arcmin": (Fraction(_TURN) / 21600, "rad"), "arcsec": (Fraction(_TURN) / 1296000, "rad"),
    "gon": (Fraction(_TURN) / 400, "rad"), "rpm": (Fraction(_TURN) / 60, "rad/s"),
    "RPM": (Fraction(_TURN) / 60, "rad/s"), "rps": (_TURN, "rad/s"), "Hz": (1, "1/s"), "N": (1, "kg*m/s^2"),
    "J": (1, "kg*m^2/s^2"), "W": (1, "kg*m^2/s^3"), "Pa": (1, "kg/m/s^2"), "bar": (100000, "kg/m/s^2"),
    "atm": (101325, "kg/m/s^2"), "psi": (_LBF / _INCH**2, "kg/m/s^2"), "kgf": (_KGF, "kg*m/s^2"),
    "kp": (_KGF, "kg*m/s^2"), "lbf": (_LBF, "kg*m/s^2"), "ozf": (_LBF / 16, "kg*m/s^2"),
    "hp": (550 * _FOOT * _LBF, "kg*m^2/s^3"), "PS": (75 * _KGF, "kg*m^2/s^3"), "Ws": (1, "kg*m^2/s^2"),
    "Wh": (3600, "kg*m^2/s^2"), "g0": (_KGF, "m/s^2"), "Nm": (1, "kg*m^2/s^2"), "Ncm": ("0.01", "kg*m^2/s^2"),
    "Nmm": ("0.001", "kg*m^2/s^2"), "Nms": (1, "kg*m^2/s"), "Ncms": ("0.01", "kg*m^2/s"),
    "Nmms": ("0.001", "kg*m^2/s"), "%": ("0.01", "1"), "EUR": (1, "euro"), "UAH": (1, "hryvnia"),
    "USD": (1, "us_dollar"), "GBP": (1, "pound_sterling"), "CHF": (1, "swiss_franc"),
    "PLN": (1, "zloty"), "CZK": (1, "czech_koruna"),
}  # fmt: skip
PREFIX: Final = {"n": "1e-9", "u": "1e-6", "µ": "1e-6", "m": "1e-3", "c": "1e-2", "d": "0.1", "k": "1e3", "M": "1e6",
                 "G": "1e9"}  # fmt: skip
PLURAL: Final = {"lb", "lbf", "oz", "ozf", "hr", "sec", "min", "deg", "rad", "rev", "bar", "arcmin", "arcsec"}
#: With a prefix or a plural these would be something else, or nobody means them.
NEVER: Final = (
    "Grad", "grad", "GRAD", "Mrad", "Mm", "Gm", "MM", "mt", "ct", "dt", "mh", "kh", "mr", "kr", "dr", "mU", "kU", "Pas",
    "Ns", "Js", "gs", "hs", "ts", "rs", "ins", "mft", "Kg", "KG", "KN", "Hs", "H", "S", "M", "K", "hz", "HZ", "n", "k",
    "mpa", "MPA", "NM", "nM", "ps", "Ps", "HP", "Hp", "ATM", "OZ", "PSI", "MIN", "Min", "DEG", "Deg", "RAD", "BAR",
)  # fmt: skip


def is_name(name: str) -> bool:
    return resolved(name) is not None


def _symbols() -> set[str]:
    """Every symbol of the definitions: names without a lower-case word of their own."""
    found = {"bar", "gon"}
    for line in DEFINITIONS:
        name, _definition, *aliases = (part.strip() for part in line.split("="))
        if not name.endswith("-"):
            found |= {alias for alias in aliases if alias not in {"_", "metre", "revolution", "cycle", "g_0"}}
    return found


def _si(factor: Fraction | int | str, unit: str) -> tuple[Fraction, dict[str, int]]:
    powers: dict[str, int] = {}
    for sign, name, power in re.findall(r"(^|[*/])([a-z0-9_]+)(?:\^(\d))?", unit):
        if name != "1":
            powers[name] = (-1 if sign == "/" else 1) * int(power or 1)
    names = {"kg": "gram", "m": "meter", "s": "second", "rad": "radian"}
    return Fraction(factor), {names.get(name, name): power for name, power in powers.items()}


def test_every_symbol_has_its_meaning_here() -> None:
    assert _symbols() == set(MEANING)
    for name, meaning in MEANING.items():
        assert measure(name) == _si(*meaning), name


def test_every_name_with_a_prefix_or_a_plural_means_what_its_parts_mean() -> None:
    """All combinations of prefix, symbol and plural that are accepted, against the table above."""
    accepted = 0
    for prefix, name, plural in itertools.product(("", *PREFIX), MEANING, ("", "s")):
        text = prefix + name + plural
        if not is_name(text):
            with pytest.raises(QuantityError):
                measure(text)
            continue
        accepted += 1
        if text in MEANING:
            continue
        # Another reading of the same letters, such as milli-inch for a minute, must not exist.
        readings = {
            (p, own)
            for p, own, s in itertools.product(("", *PREFIX), MEANING, ("", "s"))
            if p + own + s == text
            and is_name(p + own)
            and (not p or p + own not in MEANING)
            and (not s or own in PLURAL or p + own == "kg")
        }
        assert len(readings) == 1, text
        ((read, symbol),) = readings
        factor, unit = MEANING[symbol]
        assert measure(text) == _si(Fraction(factor) * Fraction(PREFIX.get(read, "1")), unit), text
    assert accepted > 150


@pytest.mark.parametrize("name", NEVER)
def test_what_could_be_misread_is_refused(name: str) -> None:
    assert not is_name(name)
    with pytest.raises(QuantityError):
        measure(name)


def test_accepted_names_that_differ_in_case_only_are_prefixes() -> None:
    """mPa and MPa are both right; any other pair would be a trap."""
    names = [text for prefix in ("", *PREFIX) for name in MEANING if is_name(text := prefix + name)]
    twins = [(a, b) for a, b in itertools.combinations(sorted(names), 2) if a != b and a.lower() == b.lower()]
    allowed = {("RPM", "rpm"), ("NM", "Nm"), ("Nm", "nm"), ("Nms", "nms"), ("PS", "ps")}
    for first, second in twins:
        prefixed = {first[0], second[0]} == {"m", "M"} and first[1:] == second[1:]
        assert prefixed or (first, second) in allowed, (first, second)
    # Newton metres and nanometres are told apart by the field.
    with pytest.raises(QuantityError):
        parse_quantity("5 nm", "N*m")
    with pytest.raises(QuantityError):
        parse_quantity("5 Nm", "m")


def test_grad_is_asked_about() -> None:
    for text in ("5 Grad", "5 grad"):
        with pytest.raises(QuantityError, match="deg or gon"):
            parse_quantity(text, "rad")


def test_times_as_rates_stay_refused() -> None:
    """min^-1 on a nameplate counts revolutions; 1/s is also how people write rad/s."""
    for text in ("5 1/s", "5 s-1", "5 Hz", "5 kHz"):
        with pytest.raises(QuantityError):
            parse_quantity(text, "rad/s")


_LB: Final = 4.4482216152605


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        *(("1500 " + text, "Hz", 25.0) for text in ("/min", "1/min", "Umdr/min", "Upm", "об./мин", "об./хв.", "min⁻¹")),
        ("1500/min", "Hz", 25.0),
        ("60 /min", "rad/s", 2.0 * 3.141592653589793),
        *(("25 " + text, "Hz", 25.0) for text in ("/s", "гц", "герц", "Герц", "Hertz", "cps", "1/с", "Гц.")),
        *(("2 " + text, "kg*m^2", 2.0) for text in ("kg.m2", "kg.m^2", "kg.m²", "кг.м2", "кг.м²", "N.m.s²")),
        ("3 гсм2", "kg*m^2", 3e-7),
        ("1.5 N.mm", "N*m", 0.0015),
        ("2 N.m.s/rad", "N*m*s/rad", 2.0),
        *(
            ("3 " + text, "N*m", 3.0 * 0.0254 * _LB)
            for text in ("in-lb", "in-lbf", "lb-in", "lbf-in", "in-lbs", "in–lb")
        ),
        *(("3 " + text, "N*m", 3.0 * 0.0254 * _LB / 16.0) for text in ("oz-in", "ozf-in", "in-oz", "in-ozf")),
        *(("3 " + text, "N*m", 3.0 * 0.3048 * _LB) for text in ("ft-lb", "ft-lbf", "lb-ft", "lbf-ft")),
        ("3 inches", "m", 3.0 * 0.0254),
        ("2 feet", "m", 2.0 * 0.3048),
        ("3 in-lb/rad", "N*m/rad", 3.0 * 0.0254 * _LB),
        ("3 in-lb-s^2", "kg*m^2", 3.0 * 0.0254 * _LB),
        ("3 lb-in^2", "kg*m^2", 3.0 * 0.45359237 * 0.0254**2),
        ("3 lb-ft²", "kg*m^2", 3.0 * 0.45359237 * 0.3048**2),
        ("3 oz-in2", "kg*m^2", 3.0 * 0.45359237 / 16.0 * 0.0254**2),
    ],
)
def test_spellings_of_nameplates_and_data_sheets(text: str, unit: str, value: float) -> None:
    assert parse_quantity(text, unit) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "unit", "why"),
    [
        ("3 кгсм2", "kg*m^2", "could be kg*cm or kgf*m: кг*см or кгс*м"),
        ("3 lbf-in2", "kg*m^2", "cannot be read"),
        ("3 in-lb2", "kg*m^2", "cannot be read"),
        ("3 in-lb", "kg", "not a unit of this field"),
        ("3 /", "Hz", "cannot be read"),
        ("3 //s", "Hz", "cannot be read"),
        ("3 mm^2.0", "m^2", "cannot be read"),
        ("3 kg..m2", "kg*m^2", "cannot be read"),
        ("3 .kg", "kg", "one decimal point"),
        ("3 kg-m2", "kg*m^2", "cannot be read"),
        ("25 /s", "rad/s", "not a unit of this field"),
    ],
)
def test_what_could_be_two_things_or_none_is_refused(text: str, unit: str, why: str) -> None:
    with pytest.raises(QuantityError, match=re.escape(why)):
        parse_quantity(text, unit)
