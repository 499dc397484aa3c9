"""Settings of views that are amounts: a number in SI, or a quantity with a unit, in a range."""

from __future__ import annotations

from contextlib import suppress
from typing import NamedTuple

from sprag_study.sentences import Amount, Sentence, Typed
from sprag_study.service.faults import parameter_error
from sprag_study.service.reading.numbers import in_language
from sprag_study.service.reading.units import PERIOD_NAMES, QuantityError, split_quantity, to_float, typed_value


class Range(NamedTuple):
    """SI unit, smallest and largest value of a setting; ``above``: whether it must be greater than the smallest."""

    unit: str
    low: float
    high: float
    above: bool = False


def amount_of(name: str, text: str, allowed: Range) -> float:
    """The amount (SI) that somebody has typed for the setting ``name``; FaultError about it."""
    unit, low, high, above = allowed
    shown = Sentence("a number") if unit == "1" else Sentence("a value in {unit}", unit=Typed(unit))
    try:
        text = in_language(text)
        value = typed_value(text, unit)
    except QuantityError as error:
        raise parameter_error(name, error.code, error.message, text, shown) from error
    if not (low < value if above else low <= value) or not value <= high:
        ends = {"low": Amount(low, digits=6), "high": Amount(high, unit, 6)}
        span = Sentence("above {low} to {high}", **ends) if above else Sentence("{low} to {high}", **ends)
        raise parameter_error(name, "out-of-range", "is outside its range", text, span)
    return value


def time_of(name: str, text: str, allowed: Range, period: float) -> float:
    """Like `amount_of`, of a time in s that may be given in periods, of that many seconds, too."""
    with suppress(QuantityError):
        number, unit = split_quantity(in_language(text))
        if unit in PERIOD_NAMES:
            return amount_of(name, repr(to_float(number) * period), allowed)
    return amount_of(name, text, allowed)
