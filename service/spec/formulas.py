"""Formulas of derived parameters: quantities with units are converted to SI, and units are checked by dimension.

A number takes all units that follow it, so ``1 / 5 N/mm`` is one over 5 N/mm, and an exponent behind a unit belongs to
the unit. Angles are checked as in practice, where the radian is often left out, with one exception: a frequency (Hz) is
never taken for an angular speed (rad/s), nor what follows from one for what follows from the other, such as Hz times s
for an angle. A factor pi is taken as the conversion by hand.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Final

from sprag_study.sentences import Part, Sentence, Typed, joined, plural
from sprag_study.service.faults import ClauseError
from sprag_study.service.languages import N_
from sprag_study.service.reading.cyrillic import latin
from sprag_study.service.reading.quantities import KINDS
from sprag_study.service.reading.unit_names import CURRENCIES
from sprag_study.service.reading.units import PERCENT, QuantityError, is_unit, measure, plain_signs, to_float
from sprag_study.worker.models.formulas import MAX_LENGTH, RESERVED, Expression, ExpressionError, Node

#: Powers of gram, meter, second and radian, of hertz ("cycle") and of the number pi; None for the number 0, which has
#: any unit.
Powers = dict[str, Fraction] | None

_PIECE: Final = re.compile(
    r"(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,4})?)"
    r"|(?P<name>[A-Za-z_][A-Za-z_0-9]*(?:\.[A-Za-z_0-9]+)*)"
)
#: An exponent of a unit: a whole number, which may have a decimal point or brackets.
_POWER: Final = re.compile(
    r"\s*(?:\*\*|\^)\s*(?:([+-]?[0-9]{1,2})(?:\.0*)?(?![0-9.])|\(\s*([+-]?[0-9]{1,2})(?:\.0*)?\s*\))"
)
_OTHER_POWER: Final = re.compile(r"\s*(?:\*\*|\^)")
_UNIT: Final = re.compile(
    r"\s*(?P<name>[A-Za-zµ°А-Яа-яЁё][A-Za-zµ°А-Яа-яЁё_0]*)(?![A-Za-zА-Яа-яЁё_0-9.(])"
    rf"(?:{_POWER.pattern}|[⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+)?"
)
_BETWEEN_UNITS: Final = re.compile(r"\s*[*/](?!\*)|(?=\s)")
_PLAIN: Final[dict[str, Fraction]] = {}
_ANGLE: Final = {"radian": Fraction(1)}
_PI: Final = {"pi": Fraction(1)}
#: What has no dimension of its own.
_BESIDE: Final = frozenset({"radian", "cycle", "pi"})
_PER_MINUTE: Final = Fraction(1, 60)
_SECOND_BELOW: Final = {"second": Fraction(-1)}
_HERTZ: Final = re.compile(r"(?<![A-Za-z])([num\u00b5cdkMG]?)(?:Hz|hertz)(?![A-Za-z])")
#: Functions of an angle.
_OF_ANGLE: Final = frozenset({"sin", "cos", "tan"})
#: Functions of a plain number (or an angle) with a plain number or an angle.
_TO_PLAIN: Final = frozenset({"sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "log", "floor"})
_TO_ANGLE: Final = frozenset({"asin", "acos", "atan"})
_COMPARISONS: Final = frozenset({"<", "<=", ">", ">="})
_HZ_HINT: Final = N_("one revolution is 2 pi rad: write '1 rev * frequency', or 'speed / 1 rev'")
#: What joins two quantities whose units do not go together.
_JOINS: Final = {"+": N_("adds {one} and {other}{hint}"), "-": N_("subtracts {one} and {other}{hint}")}
_COMPARES: Final = N_("'{function}' compares {one} and {other}{hint}")


class FormulaError(ClauseError):
    """A formula that cannot be used."""


class UnknownNameError(FormulaError):
    """A formula that uses ``name``, which is not a parameter."""

    def __init__(self, name: str) -> None:
        super().__init__("invalid-path", Sentence("uses '{name}'", name=name[:60]))
        self.name = name


@dataclass(frozen=True, slots=True)
class Formula:
    """A formula as stored in a study.

    Attributes
    ----------
    text : str
        The formula in SI numbers.
    uses : frozenset of str
        The parameters in it.
    angular : bool
        Whether it gives a frequency by the root of something like a stiffness over a mass, and no factor pi: that is an
        angular frequency.
    """

    text: str
    uses: frozenset[str]
    angular: bool = False


def read_formula(text: str, units: dict[str, str], unit: str) -> Formula:
    """Read the formula of a parameter.

    Parameters
    ----------
    text : as the user wrote it
    units : path -> SI unit, of every parameter that it may use
    unit : SI unit that its value must have

    Raises
    ------
    FormulaError
        When it cannot be read, uses something else, or its value is of another dimension.
    """
    formula, found, rooted = _read(text, units)
    wanted = _powers(unit)
    _require(found, unit)
    unmarked = found is not None and not any(found.get(name) for name in _BESIDE)
    return replace(formula, angular=rooted and unmarked and _cycles(wanted) == 1)


def read_quantity(text: str, units: dict[str, str], unit: str | None = None) -> tuple[Formula, str]:
    """Read the formula of a quantity, whose unit follows from it.

    Parameters
    ----------
    text, units : as of `read_formula`; the names of results and of other quantities are among those of ``units``, too
    unit : a unit of the dimension that its value must have, which also tells quantities of one dimension apart, such
        as an energy from a torque; by default any dimension will do

    Returns
    -------
    Formula
    str
        SI unit of its value; "1" for a plain number, "%" where ``unit`` says so.

    Raises
    ------
    FormulaError
        As `read_formula`; where ``unit`` is none; and where the unit of the value has powers that are not whole.
    """
    formula, powers, _ = _read(text, units)
    if unit is None:
        return formula, _si_unit(powers, [units[name] for name in sorted(formula.uses)])
    typed = unit.strip()
    if typed in PERCENT:
        _require(powers, "1")
        return formula, "%"
    try:
        _require(powers, typed)
    except QuantityError as error:
        raise FormulaError(error.code, Sentence("unit '{unit}' {error}", unit=typed, error=error.message)) from None
    kind = next((str(kind.unit) for kind in KINDS if typed in (kind.unit, *kind.others)), None)
    factor, wanted = _measured(typed)
    return formula, kind or (latin(plain_signs(typed)) if factor == 1 else _si_unit(wanted, []))


def _si_unit(powers: Powers, used: Sequence[str]) -> str:
    """The SI unit of these powers as quantities are shown in it.

    Of several names of a dimension it is the one among the units ``used`` in the formula; without such it is that of an
    energy where a power or an energy is used, otherwise that of a torque.
    """
    there = _without_angle(powers or {})
    angle = (powers or {}).get("radian", Fraction())
    if not there:
        return "rad" if angle == 1 and not _cycles(powers or {}) else "1"
    if any(power.denominator > 1 for power in (*there.values(), angle)):
        message = Sentence("gives {unit}, expected a unit of whole powers", unit=_text(there | {"radian": angle}))
        raise FormulaError("wrong-unit", message)
    if _per_second(there):
        return "rad/s" if angle == 1 else "Hz" if _cycles(powers or {}) == 1 else "1/s"
    kinds = [str(kind.unit) for kind in KINDS]
    energy = ["J"] if not {"W", "J"}.isdisjoint(used) else []
    simple = [unit for unit in dict.fromkeys(used) if not {"*", "/", "1"}.intersection(unit)]
    quotients = [f"{above}/{below}" for above in dict.fromkeys((*used, *energy)) for below in simple]
    measured = [(name, _powers(name)) for name in (*used, *energy, *kinds, *quotients)]
    alike = [(name, own) for name, own in measured if _without_angle(own) == there]
    exact = [name for name, own in alike if own.get("radian", Fraction()) == angle]
    return next(iter((*exact, *(name for name, _ in alike))), None) or str(_text(there | {"radian": angle}))


def _read(text: str, units: dict[str, str]) -> tuple[Formula, Powers, bool]:
    """A formula, the unit of its value, and whether a root in it is a time or one over it."""
    if len(text) > MAX_LENGTH:
        message = plural(
            "is longer than {count} character", "is longer than {count} characters", MAX_LENGTH, count=str(MAX_LENGTH)
        )
        raise FormulaError("too-long", message)
    scan = _Scan(plain_signs(text), units.keys())
    try:
        expression = Expression(scan.converted, units)
    except ExpressionError as error:
        raise FormulaError("invalid-formula", scan.located(error)) from None
    dimensions = _Dimensions(scan, units)
    found = dimensions.of(expression.root)
    return Formula(scan.converted, expression.used), found, dimensions.rooted


def _require(found: Powers, unit: str) -> None:
    """Raise FormulaError where a value is not of the dimension of ``unit``."""
    wanted = _powers(unit)
    if not _alike(found, wanted):
        parts: dict[str, Part] = {"unit": _text(found), "expected": Typed(unit), "hint": _hint(found, wanted)}
        raise FormulaError("wrong-unit", Sentence("gives {unit}, expected {expected}{hint}", **parts))


class _Scan:
    """A formula with its quantities converted to SI numbers.

    Attributes
    ----------
    converted : the formula in SI numbers
    quantities : position in ``converted`` -> powers of the unit of the number there
    """

    def __init__(self, text: str, known: Collection[str]) -> None:
        self.quantities: dict[int, Powers] = {}
        self._places: list[tuple[int, int]] = [(0, 0)]
        self._known = known
        parts: list[str] = []
        length = position = 0
        while position < len(text):
            match = _PIECE.match(text, position)
            part, end = (text[position], position + 1) if match is None else (match[0], match.end())
            if match is not None and match["number"]:
                last = self._last_unit(text, end)
                if last > end:
                    part, self.quantities[length] = self._converted(match[0], text[end:last], text[last : last + 100])
                    end = last
            elif match is not None:
                self._check_name(match[0])
                if match[0] in {"deg", "pi"}:
                    self.quantities[length] = _ANGLE if match[0] == "deg" else _PI
            parts.append(part)
            length, position = length + len(part), end
            self._places.append((length, position))
        self.converted = "".join(parts)

    def located(self, error: ExpressionError) -> str:
        """The message of a fault in the converted formula, with the position in the original one."""
        if error.position is None:
            return error.message
        here, there = max(place for place in self._places if place[0] <= error.position)
        return error.at(there + error.position - here)

    def _last_unit(self, text: str, position: int) -> int:
        """The end of the units that follow a number; its own end where there are none."""
        unit = _UNIT.match(text, position)
        while unit is not None:
            position = unit.end()
            between = _BETWEEN_UNITS.match(text, position)
            unit = None if between is None else _UNIT.match(text, between.end())
            if unit is not None and (unit["name"] in self._known or not is_unit(unit["name"])):
                unit = None
        return position

    @staticmethod
    def _converted(number: str, unit: str, after: str) -> tuple[str, Powers]:
        if _OTHER_POWER.match(after):
            raise FormulaError(
                "invalid-formula",
                Sentence(
                    "'{quantity}' has an exponent that is no whole number behind its unit, to which it would belong: "
                    "write '({quantity})^ ..' for a power of the quantity",
                    quantity=f"{number}{unit}",
                ),
            )
        try:
            text = _POWER.sub(lambda power: f"^{power[1] or power[2]}", unit.strip())
            factor, powers = _measured(text)
            value = to_float(Fraction(number) * factor)
        except QuantityError as error:
            message = Sentence("'{quantity}' {error}", quantity=f"{number}{unit}", error=error.message)
            raise FormulaError(error.code, message) from None
        return repr(value), powers

    def _check_name(self, name: str) -> None:
        if name not in self._known and name not in RESERVED:
            raise UnknownNameError(name)


class _Dimensions:
    """The units of the parts of a formula."""

    def __init__(self, scan: _Scan, units: dict[str, str]) -> None:
        self._quantities, self._unit_of = scan.quantities, units
        #: Whether a root is a time, or one over it.
        self.rooted = False

    def of(self, node: Node) -> Powers:
        """The unit of the value of a node; FormulaError where units do not go together."""
        kind = node.kind
        if kind == "number":
            return self._quantities.get(node.position, None if node.number == 0.0 else _PLAIN)
        if kind.startswith("name "):
            return _powers(self._unit_of[kind[5:]])
        if kind == "^":
            return self._rooted(self._power(node), _constant(node.parts[1]))
        parts = [self.of(part) for part in node.parts]
        if kind in {"*", "/"}:
            sign = 1 if kind == "*" else -1
            if None in parts:
                return None
            left, right = (part or _PLAIN for part in parts)
            return {name: left.get(name, Fraction()) + sign * right.get(name, Fraction()) for name in {*left, *right}}
        if kind in {"negative", "abs"}:
            return parts[0]
        if kind in {"sign", "step"}:
            return _PLAIN
        if kind == "sqrt":
            unit = None if parts[0] is None else {name: power / 2 for name, power in parts[0].items()}
            return self._rooted(unit, Fraction(1, 2))
        if kind in _TO_PLAIN | _TO_ANGLE:
            self._require_plain(kind, parts[0])
            return _ANGLE if kind in _TO_ANGLE else _PLAIN
        if kind == "if":
            return self._same(kind, parts[1:])
        unit = self._same(kind, parts)
        return _PLAIN if kind in _COMPARISONS else _ANGLE if kind == "atan2" else unit

    def _rooted(self, unit: Powers, exponent: Fraction | None) -> Powers:
        """Note a root that is a time, or one over it."""
        if unit is not None and exponent is not None and exponent.denominator > 1:
            self.rooted |= _without_angle(unit).keys() == {"second"}
        return unit

    def _power(self, node: Node) -> Powers:
        base, exponent = node.parts
        inner = exponent.parts[0] if exponent.kind == "negative" else exponent
        if inner.kind == "number" and self._quantities.get(inner.position) == _ANGLE:
            raise FormulaError(
                "wrong-unit",
                "an exponent has the unit that follows it: put the power in brackets, as in '(x^2) * 1 deg'",
            )
        self._require_plain("^", self.of(exponent))
        unit = self.of(base)
        if unit is None or not any(unit.values()):
            return unit
        number = _constant(exponent)
        if number is None:
            if not _without_angle(unit):
                return _PLAIN
            raise FormulaError(
                "wrong-unit", Sentence("raises {unit} to a power that is not a plain number", unit=_text(unit))
            )
        return {name: power * number for name, power in unit.items()}

    @staticmethod
    def _require_plain(kind: str, unit: Powers) -> None:
        if kind in _OF_ANGLE and unit is not None and not _without_angle(unit) and not _alike(unit, _ANGLE):
            message = Sentence(
                "{function} takes an angle, not {unit}; {hint}",
                function=kind,
                unit=_text(unit),
                hint=Sentence(_HZ_HINT),
            )
            raise FormulaError("wrong-unit", message)
        if not _alike(unit, _PLAIN):
            what = Sentence("the exponent") if kind == "^" else kind
            message = Sentence("{what} takes a plain number or an angle, not {unit}", what=what, unit=_text(unit))
            raise FormulaError("wrong-unit", message)

    @staticmethod
    def _same(kind: str, units: list[Powers]) -> Powers:
        given = [unit for unit in units if unit is not None]
        for unit in given[1:]:
            if not _alike(unit, given[0]):
                parts: dict[str, Part] = {
                    "one": _text(given[0]), "other": _text(unit), "hint": _hint(unit, given[0]), "function": kind
                }  # fmt: skip
                raise FormulaError("wrong-unit", Sentence(_JOINS.get(kind, _COMPARES), **parts))
        return next((unit for unit in given if _cycles(unit)), given[0]) if given else None


def _powers(unit: str) -> dict[str, Fraction]:
    return _measured(unit)[1]


def _measured(unit: str) -> tuple[Fraction, dict[str, Fraction]]:
    """Factor of a unit to SI and its powers, with that of hertz, which is 1/s otherwise."""
    text = latin(unit)
    factor, powers = measure(text)
    found = {name: Fraction(power) for name, power in powers.items()}
    if found == _SECOND_BELOW and factor == _PER_MINUTE:
        found["cycle"] = Fraction(1)  # min^-1 of nameplates are revolutions, as in fields of a speed
    elif _HERTZ.search(text):
        # A revolution per second has the radian that a hertz has not.
        turns = measure(_HERTZ.sub(r"\1rps", text))[1].get("radian", 0) - powers.get("radian", 0)
        found["cycle"] = Fraction(turns)
    return factor, found


def _constant(node: Node) -> Fraction | None:
    """The value of an exponent that consists of numbers; None where it does not."""
    if node.kind == "number":
        return Fraction(repr(node.number))
    parts = [_constant(part) for part in node.parts]
    if node.kind == "negative" and parts[0] is not None:
        return -parts[0]
    if node.kind == "/" and parts[0] is not None and parts[1]:
        return parts[0] / parts[1]
    return None


def _without_angle(unit: dict[str, Fraction]) -> dict[str, Fraction]:
    return {name: power for name, power in unit.items() if power and name not in _BESIDE}


def _alike(one: Powers, other: Powers) -> bool:
    """Whether two units are those of the same quantity; the radian counts only where speed and frequency differ."""
    if one is None or other is None:
        return True
    if _without_angle(one) != _without_angle(other):
        return False
    turned = one.get("radian", Fraction()) - other.get("radian", Fraction())
    if _per_second(one):
        return not turned
    # Of plain numbers, angles and times; in other products both may stand, as in the energy of a period.
    return _without_angle(one).keys() - {"second"} != set() or turned * (_cycles(one) - _cycles(other)) >= 0


def _cycles(unit: dict[str, Fraction]) -> Fraction:
    """The power of hertz, 0 where a factor pi converts it."""
    return Fraction() if unit.get("pi") else unit.get("cycle", Fraction())


def _per_second(unit: dict[str, Fraction]) -> bool:
    return _without_angle(unit) == {"second": Fraction(-1)}


def _hint(one: Powers, other: Powers) -> Sentence:
    if one is None or other is None or _without_angle(one) != _without_angle(other):
        return Sentence("")
    return joined("; ", ("", Sentence(_HZ_HINT)))


def _text(unit: Powers) -> Sentence | Typed:
    """A unit for a message, such as "kg*m^2/s"."""
    names = {"gram": "kg", "meter": "m", "second": "s", "radian": "rad"} | {
        name: symbol for symbol, name in CURRENCIES.items()
    }
    present = [(names[name], (unit or {}).get(name, Fraction())) for name in names]

    def powers(sign: int) -> list[str]:
        found = [(name, sign * power) for name, power in present if sign * power > 0]
        return [name if power == 1 else f"{name}^{power}" for name, power in found]

    above, below = "*".join(powers(1)), "/".join(["", *powers(-1)])
    cycles = _cycles(unit or {})
    if cycles and not _without_angle(unit or {}):
        if cycles == 1 and not above:
            return Sentence("a number of periods (Hz times s)")
        return Sentence("{unit} beside Hz*s", unit=Typed(f"{above or '1'}{below}"))
    return Typed(f"{above or '1'}{below}") if above or below else Sentence("a plain number")
