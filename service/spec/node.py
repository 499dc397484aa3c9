"""A value of a spec with its JSON Pointer: reading it records every fault in the report of the spec."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Final, TypeVar

from sprag_study.sentences import Amount, Sentence, plural
from sprag_study.service.faults import ClauseError
from sprag_study.service.reading.catalogue import range_sentence
from sprag_study.service.reading.limits import one_of, quoted, span
from sprag_study.service.reading.numbers import parse_number
from sprag_study.service.reading.texts import did_you_mean
from sprag_study.service.reading.units import (
    PERIOD_NAMES,
    QuantityError,
    example,
    parse_exact,
    split_quantity,
    to_float,
)
from sprag_study.service.spec.report import Report, join
from sprag_study.service.spec.shares import share_of

if TYPE_CHECKING:
    from sprag_study.service.faults import Code
    from sprag_study.service.spec.machine.machine import Machine
    from sprag_study.worker.models import Parameter

R = TypeVar("R")

_ITSELF: Final = object()


def exact(value: object, parameter: Parameter) -> Fraction:
    """Convert ``value`` to an exact SI number; QuantityError when it is not one or out of ``parameter``'s range."""
    number = parse_exact(value, parameter.unit)
    if not parameter.accepts(to_float(number)):
        raise QuantityError("out-of-range", "is out of range")
    return number


class Node:
    """A value and its place. Readers return None, with a fault recorded, for a value that is not what they read.

    Attributes
    ----------
    report : collects the faults
    pointer : the JSON Pointer
    value : plain data; None where nothing is given
    given : whether something is given, which can be null
    """

    __slots__ = ("_before", "given", "pointer", "report", "value")

    def __init__(self, report: Report, pointer: str = "", value: Any = None, *, given: bool = True) -> None:
        self.report, self.pointer, self.value, self.given = report, pointer, value, given
        self._before = report.found

    @property
    def sound(self) -> bool:
        """Whether no fault, of any part of the spec, was recorded since this value was reached."""
        return self.report.found == self._before

    @property
    def machine(self) -> Machine:
        """The machine of the spec; ValueError before it is read."""
        if self.report.machine is None:
            raise ValueError("the machine is not read yet")
        return self.report.machine

    def __getitem__(self, key: str | int) -> Node:
        """The field or the item ``key``, whether it is given or not."""
        if isinstance(self.value, Mapping):
            value, given = self.value.get(key), key in self.value
        else:
            given = isinstance(self.value, list) and isinstance(key, int) and key < len(self.value)
            value = self.value[key] if given else None
        return Node(self.report, join(self.pointer, key), value, given=given)

    def __contains__(self, name: str) -> bool:
        return isinstance(self.value, Mapping) and name in self.value

    def below(self, path: str) -> Node:
        """The value at a path of fields and numbers of items with dots between them."""
        node = self
        for key in path.split("."):
            node = node[int(key) if isinstance(node.value, list) and key.isdecimal() and len(key) < 9 else key]
        return node

    def parts(self) -> list[Node]:
        """The items of a list, the fields of an object; nothing of any other value."""
        if isinstance(self.value, list):
            return [Node(self.report, f"{self.pointer}/{index}", item) for index, item in enumerate(self.value)]
        return [self[name] for name in self.value] if isinstance(self.value, Mapping) else []

    def otherwise(self, default: object) -> Node:
        """The same place with ``default``, where nothing is given."""
        return self if self.given else self.holding(default)

    def holding(self, value: object) -> Node:
        """The same place with another value."""
        return Node(self.report, self.pointer, value)

    def refuse(
        self, code: Code, message: str, value: object = _ITSELF, *, allowed: str | None = None, unit: str | None = None
    ) -> None:
        """Record a fault of this value, as `Report.fault`; ``value`` is what it shows instead of it."""
        shown = self.value if value is _ITSELF else value
        self.report.fault(self.pointer, code, message, shown, allowed=allowed, unit=unit)

    def refuse_each(self, names: Iterable[str], message: str, code: Code = "conflict") -> None:
        """Record a fault of each of the fields ``names`` that is given."""
        for name in names:
            if name in self:
                self[name].refuse(code, message)

    def mistake(self, message: str, *, allowed: str | None = None) -> None:
        """Record that something else is given, or, where nothing is, that it is required."""
        missing = self.value is None
        self.refuse("required" if missing else "wrong-type", "is required" if missing else message, allowed=allowed)

    def parsed(self, parse: Callable[[Any], R], *, allowed: str | None = None, unit: str | None = None) -> R | None:
        """What ``parse`` makes of the value; None, and a fault recorded, where it raises `ClauseError`."""
        try:
            return parse(self.value)
        except ClauseError as error:
            self._refuse_unread(error, allowed, unit)
            return None

    def exact(self, parameter: Parameter) -> Fraction | None:
        """The exact SI number of a quantity in ``parameter``'s range."""
        if self.report.full:
            return None
        try:
            return exact(self.value, parameter)
        except QuantityError as error:
            self._refuse_unread(error, range_sentence(parameter), parameter.unit)
            return None

    def _refuse_unread(self, error: ClauseError, allowed: str | None, unit: str | None) -> None:
        """Record why a value cannot be read, or, where nothing is given, that it is required."""
        if not self.given:
            self.refuse("required", "is required", allowed=allowed, unit=unit)
        else:
            self.refuse(error.code, error.message, allowed=allowed, unit=unit)

    def number(self, parameter: Parameter) -> float | None:
        """The double nearest to `exact`."""
        number = self.exact(parameter)
        return None if number is None else to_float(number)

    def number_in(self, parameters: Sequence[Parameter]) -> float | None:
        """As `number`, in the range of every one of ``parameters``, which have one unit."""
        numbers = [self.number(parameter) for parameter in parameters]
        return None if None in numbers else numbers[0]

    def number_or_default(self, parameter: Parameter) -> float | None:
        """As `number`; where nothing is given, the default of the parameter, or a fault where it has none."""
        if self.given:
            return self.number(parameter)
        if parameter.default is not None:
            return parameter.default
        needed = {"help": Sentence(parameter.help), "example": example(parameter.unit)}
        message = Sentence("is required ({help}, for example {example})", **needed)
        self.refuse("required", message, allowed=range_sentence(parameter), unit=parameter.unit)
        return None

    def whole(self, low: int, high: int) -> int | None:
        """An integer from ``low`` to ``high``."""
        if isinstance(self.value, bool) or not isinstance(self.value, int):
            self.refuse("wrong-type", "must be a whole number", allowed=span(low, high))
        elif not low <= self.value <= high:
            self.refuse("out-of-range", "is out of range", allowed=span(low, high))
        else:
            return self.value
        return None

    def plain(self, low: float, high: float) -> float | None:
        """A number without a unit from ``low`` to ``high``."""
        allowed = Sentence("{low} to {high}, a plain number", low=Amount(low, digits=6), high=Amount(high, digits=6))
        value = self.value
        if isinstance(value, str) and not value.isascii():  # as pages print it: 1·10⁻⁹
            value = parse_number(value)
        if isinstance(value, bool) or not isinstance(value, int | float):
            self.refuse("wrong-type", "must be a plain number", allowed=allowed)
        elif not low <= value <= high:
            self.refuse("out-of-range", "is out of range", allowed=allowed)
        else:
            return float(value)
        return None

    def periods(self, low: int, high: int) -> int | None:
        """A text with a whole number of excitation periods."""
        allowed = Sentence('{low} to {high} whole excitation periods, as in "1000 periods"', low=low, high=high)
        split = self.parsed(split_quantity, allowed=allowed) if isinstance(self.value, str) else (None, "")
        if split is None:
            return None
        number, unit = split
        if number is None or unit not in PERIOD_NAMES:
            self.refuse("wrong-type", "must be a number of excitation periods", allowed=allowed)
        elif number.denominator != 1 or not low <= number <= high:
            self.refuse("out-of-range", "is out of range", allowed=allowed)
        else:
            return int(number)
        return None

    def flag(self) -> bool | None:
        """True or false."""
        if isinstance(self.value, bool):
            return self.value
        self.refuse("wrong-type", "must be true or false", allowed="true or false")
        return None

    def share(self, low: float, high: float) -> float | None:
        """A share between ``low`` and ``high``, a plain number or a text such as "1 %"."""
        ends = {"low": Amount(100 * low, digits=6), "high": Amount(100 * high, digits=6)}
        allowed = Sentence('{low} % to {high} %, as in "1 %" or 0.01', **ends)
        share = share_of(self.value)
        if share is None:
            self.refuse("not-a-number", "must be a share", allowed=allowed)
        elif not low <= share <= high:
            self.refuse("out-of-range", "is out of range", allowed=allowed)
        else:
            return share
        return None

    def choice(self, choices: Sequence[str]) -> str | None:
        """One of ``choices``."""
        if isinstance(self.value, str) and self.value in choices:
            return self.value
        if self.value is None and not self.given:
            self.refuse("required", "is required", allowed=quoted(choices))
        else:
            hint = did_you_mean(self.value, choices) if isinstance(self.value, str) else Sentence("")
            self.refuse("invalid-choice", Sentence("is not a valid choice{hint}", hint=hint), allowed=quoted(choices))
        return None

    def one_of(self, names: Sequence[str]) -> str | None:
        """Which one of the fields ``names`` of an object is given; a fault unless it is exactly one."""
        given = [name for name in names if name in self]
        if len(given) == 1:
            return given[0]
        listed = ", ".join(names)
        message = Sentence("needs exactly one of {names}; none is given", names=listed)
        if given:
            message = plural(
                "needs exactly one of {names}; {count} is given: {given}",
                "needs exactly one of {names}; {count} are given: {given}",
                len(given), names=listed, given=", ".join(given),
            )  # fmt: skip
        self.refuse("exactly-one", message, None, allowed=one_of(names))
        return None

    def has(self, known: Sequence[str], *, null: bool = True) -> bool:
        """Whether it is an object; its fields that are not ``known`` are faults. ``null`` stands for a missing one."""
        if isinstance(self.value, Mapping):
            self.report.unknown_fields(self.pointer, self.value, known)
            return True
        allowed = Sentence("an object with the fields {names}", names=", ".join(known))
        if self.given and not null and self.value is None:
            self.refuse("wrong-type", "must be an object", allowed=allowed)
        else:
            self.mistake("must be an object", allowed=allowed)
        return False
