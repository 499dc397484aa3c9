"""Conversion of quantities with units to exact SI numbers: "157 rad/s", "2 mm", "0.01 N*m*s/rad".

A strict grammar reads the number and the unit; pint converts the unit, with a small registry of its own in which angle
is a dimension like length or mass. (In pint's default registry the radian is dimensionless, so "1500 rpm" converted to
Hz is off by the factor 2 pi.) One revolution is one period: angular speeds are divided by 2 pi where a frequency is
expected, and only there.

A number may have a decimal comma (`numbers`), and a unit its Cyrillic name (`cyrillic`): "0,3 град" is "0.3 deg".

Numbers are kept as fractions, so "1.1 mm" is the double nearest to 0.0011 and "1500 rpm" is exactly 25 Hz.
"""

from __future__ import annotations

import math
import re
import sys
from collections import Counter
from decimal import Decimal, localcontext
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

from sprag_study.sentences import Amount, Named, Sentence, Typed, joined, plural
from sprag_study.service.faults import ClauseError, Code
from sprag_study.service.languages import N_
from sprag_study.service.reading.cyrillic import latin
from sprag_study.service.reading.numbers import is_ambiguous, with_point
from sprag_study.service.reading.printed import keyboard
from sprag_study.service.reading.unit_names import DEFINITIONS, TWO_PI, refusal, resolved
from sprag_study.worker.limits import MAX_QUANTITY_LENGTH

if TYPE_CHECKING:
    import pint

#: Words for the excitation period in times of a run.
PERIOD_NAMES: Final = frozenset({"period", "periods", "cycle", "cycles"})

_EXAMPLES: Final = {
    "Hz": ("25 Hz", "1500 rpm", "157 rad/s"),
    "m": ("2 mm",),
    "rad": ("0.3 deg", "0.005 rad"),
    "rad/s": ("10 rad/s", "95 rpm"),
    "kg": ("0.5 kg",),
    "kg*m^2": ("1e-3 kg*m^2",),
    "N/m": ("9000 N/m",),
    "N*m": ("0.1 N*m",),
    "N*m*s/rad": ("0.01 N*m*s/rad",),
    "m/s^2": ("9.81 m/s^2",),
    "s": ("2 s",),
    "N": ("20 kN",),
    "Pa": ("6 bar", "0.6 MPa"),
    "m^2": ("50 cm^2",),
    "1": ("0.05",),
}

#: Libraries that pint loads where they are installed.
_HELD_BY_PINT: Final = ("dask", "uncertainties", "xarray")
#: How people write per cent.
PERCENT: Final = frozenset({"%", "percent", "per cent"})
_PER_MINUTE: Final = Fraction(1, 60)
_QUANTITY: Final = re.compile(r"([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,4})?)\s*(.*)", re.DOTALL)
#: Fractions of two whole numbers, as of inches: "3/4 in"; also ratios and irregularities, "17/53" and "1/80".
_FRACTION: Final = re.compile(r"([+-]?[0-9]{1,5})/([1-9][0-9]{0,4})(?![0-9.,/])\s*(.*)", re.DOTALL)
_LETTERS: Final = "%A-Za-zµ°А-Яа-яЁёІіЇїЄєҐґ"
_TOKEN: Final = re.compile(
    rf"\s*(?:(?P<name>[{_LETTERS}][{_LETTERS}_0]*)|(?:\*\*|\^)\s*(?P<power>[+-]?[0-9]{{1,2}})(?![0-9])"
    r"|(?P<operator>[*/()])|(?P<one>1)(?![0-9]))"
)
_SUPERSCRIPT: Final = re.compile("[⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+")
#: A power without its sign, as in "mm2" and "min-1"; no name of a unit has another digit than 0.
_DIGIT: Final = re.compile(rf"([{_LETTERS}])(-?[1-9])(?![0-9.])")
#: Points: between units they multiply, as in "kg.m2", and behind an abbreviation they mean nothing, as in "об./мин".
_POINT: Final = re.compile(rf"(?<=[{_LETTERS}])\.(?=([{_LETTERS}])|[\s/*)]|$)")
#: Torques with a hyphen, as in "in-lb" and "ozf-in", also times seconds: their pounds and ounces are forces.
_TORQUE: Final = re.compile(r"(?<![A-Za-z])(?:(in|ft)-(lb|oz)f?s?|(lb|oz)f?-(in|ft))(?![A-Za-z]|\^?-?[0-9])(-(?=s))?")
#: Moments of inertia with a hyphen, as in "lb-in2".
_POUNDS: Final = re.compile(r"(?<![A-Za-z])(lb|oz)-(in|ft)(?=\^?2(?![0-9.]))")
#: Moments of inertia without the multiplication sign, as in "kgm2".
_INERTIA: Final = re.compile(r"(?<![A-Za-z])(k?g)(m|cm|mm)\^?2(?![0-9.])")
_LONGEST_UNIT: Final = 40
#: Digits that tell every double from its neighbours in another unit too, and zeros before a number with a power of ten.
_MOST_DIGITS: Final = 19
_PLAIN: Final = 4
_SUPERSCRIPTS: Final = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_SIGNS: Final = str.maketrans("\u2212\u2013·⋅×\u2219μ\u00a0\u202f\u2009", "--****µ   ")


_ACCELERATION: Final = "m/s^2"


class QuantityError(ClauseError):
    """A value that is not a quantity of the expected unit."""

    def __init__(self, code: Code, message: str) -> None:
        # Within another sentence it is translated too.
        super().__init__(code, message if isinstance(message, Sentence) else Sentence(message))


class AmbiguousCommaError(QuantityError):
    """A number such as 1,234, whose comma could be decimal or separate thousands."""

    def __init__(self) -> None:
        super().__init__(
            "ambiguous-comma",
            N_("has a comma that could be decimal or separate thousands: write a decimal point, or no comma"),
        )


def examples(unit: str) -> tuple[str, ...]:
    """Quantities in ``unit``, as a spec may have them."""
    return _EXAMPLES.get(unit, (f"200 {unit}",))


def example(unit: str) -> Sentence:
    """Quoted examples of a quantity in ``unit``: ``"25 Hz", "1500 rpm" or "157 rad/s"``."""
    if unit == "1":
        return joined("", (Typed(text) for text in examples(unit)))
    *others, last = (joined("", ('"', _amount(text), '"')) for text in examples(unit))
    return Sentence("{first} or {last}", first=joined(", ", others), last=last) if others else last


def _amount(text: str) -> Amount | Typed:
    """An example as an amount, where that is written the same."""
    number, unit = text.split(" ")
    amount = Amount(float(number), unit)
    return amount if str(amount) == text else Typed(text)


def parse_quantity(value: object, unit: str) -> float:
    """Convert ``value`` to an SI number.

    Parameters
    ----------
    value : int, float or str
        A plain number is in ``unit``; a string has its own unit.
    unit : str
        Expected SI unit, for instance "Hz", "N*m*s/rad", "N*m/rad^3".

    Returns
    -------
    float
        Finite, correctly rounded.

    Raises
    ------
    QuantityError
        If it is not a number, not finite, or has no unit, an unknown unit or one of another dimension.
    """
    return to_float(parse_exact(value, unit))


def parse_exact(value: object, unit: str) -> Fraction:
    """As `parse_quantity`, but exact: the decimal number as written, times the exact factor of its unit."""
    if isinstance(unit, Named):
        return Fraction(_named_number(value, unit.names))
    if isinstance(value, str) and unit == "1":
        number, text = split_quantity(value)
        if text in PERCENT:
            return number / 100
        if not text and "/" in value:
            return number
        raise QuantityError(
            "wrong-type",
            N_('must be a number without quotation marks, a share such as "5 %" or a fraction such as "1/80"'),
        )
    if isinstance(value, str):
        number, text = split_quantity(value)
        if not text:
            raise QuantityError(
                "missing-unit",
                Sentence(
                    "a text needs its unit, for example {example}; a plain number is taken in {unit}",
                    example=example(unit), unit=Typed(unit),
                ),
            )  # fmt: skip
        return number * _factor(text, unit)
    return exact_number(value, unit)


def _named_number(value: object, names: tuple[str, ...]) -> int:
    """The number that stands for a name; QuantityError where it is none of them."""
    if isinstance(value, str) and value.strip() in names:
        return names.index(value.strip())
    raise QuantityError("invalid-choice", Sentence("is none of the components {names}", names=", ".join(names)))


def exact_number(value: object, unit: str) -> Fraction:
    """A plain JSON number as the decimal that was written; QuantityError for anything else, including a bool."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        if unit == "1":
            raise QuantityError("wrong-type", "must be a plain number")
        raise QuantityError(
            "wrong-type",
            Sentence(
                "must be a number in {unit} or a text with its unit, for example {example}",
                unit=Typed(unit), example=example(unit),
            ),
        )  # fmt: skip
    if isinstance(value, int):
        if value.bit_length() > 1024:
            raise QuantityError("out-of-range", "is too large for a number")
        return Fraction(value)
    if not math.isfinite(value):
        raise QuantityError("not-finite", "must be a finite number")
    return Fraction(repr(value))


def typed_value(text: str, unit: str) -> float:
    """The value (SI) of a text that is in ``unit`` where it has no unit of its own; QuantityError."""
    if isinstance(unit, Named):
        return parse_quantity(text, unit)
    number, own = split_quantity(text)
    return parse_quantity(text, unit) if own else to_float(number)


def exact_quantity(value: float, si: str, unit: str) -> str:
    """The shortest text in ``unit`` that is read as the same number: ``19.483405177994265 N/mm``.

    Parameters
    ----------
    value : number in SI
    si, unit : units of it in SI and in the text; where no text in the latter gives the number, it is in SI

    Raises
    ------
    QuantityError
        If ``unit`` is not one of the quantity.
    """
    near = Fraction(value) / parse_exact(f"1 {unit}", si)
    for digits in range(1, _MOST_DIGITS + 1):
        text = f"{_rounded(near, digits)} {unit}"
        if parse_quantity(text, si) == value:
            return text
    return f"{value!r} {si}"


def _rounded(number: Fraction, digits: int) -> str:
    """A number rounded to so many significant digits, without zeros behind them."""
    with localcontext() as context:
        context.prec = digits
        decimal = Decimal(number.numerator) / Decimal(number.denominator)
    exponent = decimal.adjusted()
    return format(decimal, "f" if -_PLAIN < exponent < _MOST_DIGITS else "e").replace("e+", "e") if decimal else "0"


def has_unit(text: str) -> bool:
    """Whether a text is a number with a unit."""
    try:
        return bool(split_quantity(text)[1])
    except QuantityError:
        return False


def split_quantity(text: str) -> tuple[Fraction, str]:
    """Split "2 mm" into number and unit; the unit, with its Latin names, may be empty.

    Raises
    ------
    QuantityError
        When it does not begin with a number, or with one whose comma could be decimal or separate thousands.
    """
    number, unit = split_typed(text)
    return number, latin(unit)


def split_typed(text: str) -> tuple[Fraction, str]:
    """As `split_quantity`, the unit in the letters in which it was typed."""
    if len(text) > MAX_QUANTITY_LENGTH:
        raise QuantityError(
            "too-long",
            plural("is longer than {count} character", "is longer than {count} characters", MAX_QUANTITY_LENGTH),
        )
    text = keyboard(text.strip()).translate(_SIGNS).strip()
    _refuse_ambiguous(text)
    if (part := _FRACTION.fullmatch(text)) is not None:
        return Fraction(int(part[1]), int(part[2])), part[3].strip()
    match = _QUANTITY.fullmatch(with_point(text))
    if match is None:
        raise QuantityError("not-a-number", "must begin with a number (no thousands separators) followed by its unit")
    number = Fraction(match[1])
    to_float(number)
    if match[2].startswith((",", ".")):
        raise QuantityError("not-a-number", "must have one decimal point or comma and no thousands separators")
    return number, match[2].strip()


def _refuse_ambiguous(text: str) -> None:
    if is_ambiguous(text):
        raise AmbiguousCommaError


def to_float(number: Fraction) -> float:
    """The double nearest to ``number``; QuantityError when it is outside the range of doubles."""
    try:
        value = number.numerator / number.denominator
    except OverflowError:
        raise QuantityError("out-of-range", "is too large for a number") from None
    if value == 0.0 and number:
        raise QuantityError("out-of-range", "is too small for a number but not 0")
    return value


def plain_signs(text: str) -> str:
    """``text`` with the signs of a typesetter (·, ×, −) replaced by those of a keyboard, character by character."""
    return text.translate(_SIGNS)


def measure(text: str) -> tuple[Fraction, dict[str, int]]:
    """Factor of a unit such as "N/mm" to SI, and its powers of gram, meter, second and radian.

    Raises
    ------
    QuantityError
        When it cannot be read or is unknown.
    """
    factor, powers = _measure(latin(text))
    return factor / Fraction(1000) ** powers.get("gram", 0), powers


def is_unit(name: str) -> bool:
    """Whether a single name, such as "mm", is that of a unit."""
    try:
        _named(latin(name))
    except QuantityError:
        return False
    return True


def is_known_unit(text: str) -> bool:
    """Whether a text, such as "mm/s", is a unit of any quantity; an empty one is none."""
    try:
        return bool(measure(text)) if text else False
    except QuantityError:
        return False


def load() -> None:
    """Load pint now; otherwise the first quantity with a unit loads it. For processes that do nothing else with pint.

    It looks for libraries whose values it can hold, and loads those that are installed, which takes as long as pint.
    """
    absent = [name for name in _HELD_BY_PINT if name not in sys.modules]
    modules: dict[str, Any] = sys.modules
    modules.update(dict.fromkeys(absent))  # their import fails
    try:
        _registry()
    finally:
        for name in absent:
            del modules[name]


@lru_cache(maxsize=1)
def _registry() -> pint.UnitRegistry[Fraction]:
    import pint

    registry: pint.UnitRegistry[Fraction] = pint.UnitRegistry(None, non_int_type=Fraction, cache_folder=None)
    for line in DEFINITIONS:
        registry.define(line)
    return registry


@lru_cache(maxsize=1024)
def _factor(text: str, unit: str) -> Fraction:
    """Factor from ``text`` to ``unit``; QuantityError when their dimensions differ."""
    expected = Sentence("expected {unit}, for example {example}", unit=Typed(unit), example=example(unit))
    try:
        factor, dimensions = _measure(text)
    except QuantityError as error:
        raise QuantityError(error.code, joined("; ", (error.message, expected))) from None
    wanted_factor, wanted = _wanted(unit)
    angle = dimensions.pop("radian", 0)
    if {**dimensions, "radian": 0} == {**wanted, "radian": 0}:
        if angle == wanted.get("radian", 0):
            return factor / wanted_factor
        if unit == "Hz" and angle == 1:
            return factor / wanted_factor / Fraction(TWO_PI)
        if unit == "rad/s" and angle == 0 and factor == _PER_MINUTE:
            return factor / wanted_factor * Fraction(TWO_PI)  # min^-1 of nameplates are revolutions
        if unit == "N*m*s/rad" and angle == 0:
            return factor / wanted_factor  # N*m*s, the usual notation in textbooks
    raise wrong_unit(text, unit)


def wrong_unit(text: str, unit: str, other: str = "") -> QuantityError:
    """The error about a known unit that is not one of the SI ``unit``, nor of an ``other`` that would do too."""
    expected = Sentence("expected {unit}, for example {example}", unit=Typed(unit), example=example(unit))
    if other:
        expected = Sentence(
            "{expected}, or {other}, for example {example}",
            expected=expected, other=Typed(other), example=example(other),
        )  # fmt: skip
    if _ACCELERATION in (unit, other) and _measure(text)[1] == {"gram": 1}:
        expected = Sentence("{expected}; g is the gram, and the acceleration of free fall g_0", expected=expected)
    message = Sentence("is in '{unit}', which is not a unit of this field; {expected}", unit=text, expected=expected)
    return QuantityError("wrong-unit", message)


def _measure(text: str) -> tuple[Fraction, dict[str, int]]:
    """Factor of a unit like "N*m*s/rad" to the registry's root units (g, m, s, rad), and their powers.

    Products, quotients, brackets and integer powers are evaluated here; pint only looks up names, so no text can make
    it compute anything.
    """
    if len(text) > _LONGEST_UNIT:
        message = plural(
            "has a unit longer than {count} character", "has a unit longer than {count} characters", _LONGEST_UNIT
        )
        raise QuantityError("wrong-unit", message)
    tokens: list[str] = []
    position = 0
    spelled = _SUPERSCRIPT.sub(lambda found: "^" + found[0].translate(_SUPERSCRIPTS), text)
    spelled = _POINT.sub(lambda found: "*" if found[1] else "", spelled.replace("\N{SUBSCRIPT ZERO}", "0"))
    spelled = _POUNDS.sub(r"\1*\2", _TORQUE.sub(_torque, spelled))
    spelled = _DIGIT.sub(r"\1^\2", _INERTIA.sub(r"\1*\2^2", spelled))
    if spelled.lstrip().startswith("/"):
        spelled = f"1{spelled.lstrip()}"  # as in "1500 /min"
    while position < len(spelled):
        match = _TOKEN.match(spelled, position)
        if match is None:
            raise _unreadable(text)
        tokens.append(f"^{match['power']}" if match["power"] else match[0].strip())
        position = match.end()
    tokens.reverse()
    factor, powers = _product(tokens, text)
    if tokens:
        raise _unreadable(text)
    return factor, {name: power for name, power in powers.items() if power}


def _unreadable(text: str) -> QuantityError:
    return QuantityError("wrong-unit", Sentence("has a unit that cannot be read: '{unit}'", unit=text))


def _torque(found: re.Match[str]) -> str:
    """A product of a force and a length, and a sign before the seconds behind it."""
    return f"({found[2] or found[3]}f*{found[1] or found[4]})" + ("*" if found[5] else "")


@lru_cache(maxsize=64)
def _wanted(unit: str) -> tuple[Fraction, dict[str, int]]:
    return _measure(unit)


def _product(tokens: list[str], text: str) -> tuple[Fraction, Counter[str]]:
    """Evaluate the product at the end of ``tokens`` (reversed), up to a closing bracket; consumes its tokens."""
    factor, powers, sign = Fraction(1), Counter[str](), 1
    while True:
        part, part_powers = _operand(tokens, text)
        factor *= part**sign
        for name, power in part_powers.items():
            powers[name] += sign * power
        if not tokens or tokens[-1] == ")":
            return factor, powers
        # Two adjacent units are multiplied, with the precedence of an explicit sign.
        sign = -1 if tokens[-1] == "/" else 1
        if tokens[-1] in {"*", "/"}:
            tokens.pop()


def _operand(tokens: list[str], text: str) -> tuple[Fraction, Counter[str]]:
    first = tokens.pop() if tokens else ")"
    if first == "(":
        inner = _product(tokens, text)
        if tokens and tokens.pop() == ")":
            return inner
    elif first == "1":
        return Fraction(1), Counter()
    elif first[0] not in "*/^)":
        power = int(tokens.pop()[1:]) if tokens and tokens[-1][0] == "^" else 1
        factor, root = _named(first)
        return factor**power, Counter({name: power * of_one for name, of_one in root})
    raise _unreadable(text)


@lru_cache(maxsize=1024)
def _named(name: str) -> tuple[Fraction, tuple[tuple[str, int], ...]]:
    """Factor and powers of the root units for the name of one unit, from pint."""
    known = resolved(name)
    if known is None:
        raise QuantityError("wrong-unit", refusal(name))
    prefix, unit = known
    factor, root = _registry().get_root_units(unit)
    return prefix * Fraction(str(factor)), tuple((str(unit), int(str(power))) for unit, power in root._units.items())
