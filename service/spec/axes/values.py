"""The values of an axis: a list, linear or geometric spacing, or steps. They are counted before they are expanded."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag.sentences import Sentence
from sprag.service.languages import N_
from sprag.service.reading.limits import values_to
from sprag.service.reading.units import QuantityError, parse_exact, to_float
from sprag.service.spec.fields import read_exact, read_number, read_whole
from sprag.service.spec.lists import read_list, read_list_text, read_together
from sprag.service.spec.report import Report, join
from sprag.worker.limits import MAX_AXIS_VALUES
from sprag.worker.models import Parameter
from sprag.worker.models.parameters import in_range

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Values = NDArray[np.float64]

#: How far a step range may exceed its end, in steps, to allow for the rounding of computed ends.
_STEP_ROUNDING: Final = Fraction(1, 10**9)
#: What ranges are written as.
_DIVIDED: Final = N_('a list of both ends and the count, such as ["2 mm", "5 mm", 4]')
_STEPPED: Final = N_('a list of both ends and the step, such as ["2 mm", "5 mm", "0.5 mm"]')
#: Integers up to this are exact as doubles.
_EXACT: Final = 2**53


@dataclass(frozen=True)
class Plan:
    """Values of an axis that are counted but not yet expanded.

    Attributes
    ----------
    pointer : str
        JSON Pointer of the field that gives them; the values of a list lie below it, by index.
    count : int
        Number of values; may be huge.
    expand : callable
        Returns them in SI units and in order: float64 array, shape (count,).
    listed : bool
        Whether the user listed every value.
    """

    pointer: str
    count: int
    expand: Callable[[], Values]
    listed: bool = False


def plan_values(report: Report, pointer: str, data: object, parameter: Parameter) -> Plan | None:
    """The plan of a plain list of quantities, or of one text with all of them."""
    if not isinstance(data, list | str) or not data or not str(data).strip():
        empty = isinstance(data, list | str)
        report.fault(
            pointer,
            "empty" if empty else "wrong-type",
            "has no values" if empty else "must be a list of values",
            data,
            allowed=values_to(MAX_AXIS_VALUES),
        )
        return None
    plain = _plain_numbers(data) if isinstance(data, list) else None
    if plain is not None and in_range(plain, parameter).all():
        return Plan(pointer, plain.size, lambda: plain, listed=True)
    if isinstance(data, str):
        items = read_list_text(report, pointer, data, parameter.unit, parameter.path)
    else:
        items = read_list(report, _placed(pointer, data), parameter.unit, parameter.path)
    if items is None:
        return None
    places = [pointer if isinstance(data, str) else join(pointer, index) for index in range(len(items))]
    numbers = [read_number(report, place, value, parameter) for place, value in zip(places, items, strict=True)]
    known = [number for number in numbers if number is not None]
    if len(known) < len(numbers):
        return None
    return Plan(pointer, len(known), lambda: np.array(known), listed=True)


def _plain_numbers(data: list[Any]) -> Values | None:
    """The numbers of a list, each the nearest double; None where the list has other items."""
    if not set(map(type, data)) <= {int, float}:
        return None
    try:
        return np.array(data, dtype=np.float64)
    except OverflowError:
        return None


def _placed(pointer: str, items: Sequence[Any]) -> list[tuple[str, object]]:
    """The items of a list, each with its JSON Pointer."""
    return [(join(pointer, index), item) for index, item in enumerate(items)]


def _together(report: Report, pointer: str, items: Sequence[Any], parameter: Parameter) -> list[Any] | None:
    """The ends and the step of a range, with decimal points; None, and faults recorded, where one is unclear."""
    return read_together(report, _placed(pointer, items), parameter.unit, parameter.path)


def plan_linspace(report: Report, pointer: str, data: object, parameter: Parameter) -> Plan | None:
    """The plan of ``[from, to, count]``, evenly spaced, both ends included."""
    division = _division(report, pointer, data, parameter)
    if division is None:
        return None
    start, stop, count = division
    step = (stop - start) / max(count - 1, 1)
    return Plan(pointer, count, lambda: _steps(start, step, count))


def plan_geomspace(report: Report, pointer: str, data: object, parameter: Parameter) -> Plan | None:
    """The plan of ``[from, to, count]``, geometrically spaced, both ends included."""
    division = _division(report, pointer, data, parameter)
    if division is None:
        return None
    start, stop, count = division
    if start * stop <= 0:
        report.fault(pointer, "invalid-range", "a geometric range needs two ends of one sign, neither of them 0", data)
        return None
    return Plan(pointer, count, lambda: _multiples(to_float(start), to_float(stop), count))


def plan_range(report: Report, pointer: str, data: object, parameter: Parameter) -> Plan | None:
    """The plan of ``[from, to, step]``; ``to`` is included when a whole number of steps reaches it."""
    three = _three(report, pointer, data, _STEPPED)
    items = None if three is None else _together(report, pointer, three, parameter)
    if items is None:
        return None
    start = read_exact(report, join(pointer, 0), items[0], parameter)
    stop = read_exact(report, join(pointer, 1), items[1], parameter)
    try:
        step = parse_exact(items[2], parameter.unit)
    except QuantityError as error:
        report.fault(join(pointer, 2), error.code, error.message, items[2], unit=parameter.unit)
        return None
    if start is None or stop is None:
        return None
    if step == 0 or (stop - start) * step < 0:
        report.fault(
            join(pointer, 2),
            "invalid-range",
            "the step is 0" if step == 0 else "the step leads away from the end",
            items[2],
            allowed="a step greater than 0" if stop >= start else "a step less than 0, since the range goes down",
            unit=parameter.unit,
        )
        return None
    whole = math.floor((stop - start) / step + _STEP_ROUNDING)
    return Plan(pointer, whole + 1, lambda: _stepped(start, stop, step, whole))


PLANS: Final[dict[str, Callable[[Report, str, object, Parameter], Plan | None]]] = {
    "values": plan_values,
    "linspace": plan_linspace,
    "geomspace": plan_geomspace,
    "range": plan_range,
}


def any_count(number: int) -> int | Sentence:
    """A count of any size for a message."""
    if number < 10**15:
        return number
    return Sentence("about {number}", number=f"10^{round(number.bit_length() * math.log10(2))}")


def count_text(number: int) -> str:
    """A count of any size as the value of a fault."""
    counted = any_count(number)
    return f"{counted:,}" if isinstance(counted, int) else str(counted)


def _three(report: Report, pointer: str, data: object, allowed: str) -> Sequence[Any] | None:
    if isinstance(data, list) and len(data) == 3:
        return data
    report.fault(pointer, "wrong-type", "must be a list of three values", data, allowed=allowed)
    return None


def _division(
    report: Report, pointer: str, data: object, parameter: Parameter
) -> tuple[Fraction, Fraction, int] | None:
    three = _three(report, pointer, data, _DIVIDED)
    ends = None if three is None else _together(report, pointer, three[:2], parameter)
    if three is None or ends is None:
        return None
    start = read_exact(report, join(pointer, 0), ends[0], parameter)
    stop = read_exact(report, join(pointer, 1), ends[1], parameter)
    count = read_whole(report, join(pointer, 2), three[2], 1, MAX_AXIS_VALUES)
    if start is None or stop is None or count is None:
        return None
    if count == 1 and start != stop:
        report.fault(
            join(pointer, 2),
            "invalid-range",
            "one value cannot be both ends of a range",
            count,
            allowed="2 or more, or equal ends",
        )
        return None
    return start, stop, count


def _steps(start: Fraction, step: Fraction, count: int) -> Values:
    """start + i*step, each correctly rounded: integers over a common denominator, divided once."""
    common = math.lcm(start.denominator, step.denominator)
    first = start.numerator * (common // start.denominator)
    by = step.numerator * (common // step.denominator)
    if max(abs(first), abs(first + (count - 1) * by), abs(by), common) <= _EXACT:
        # The quotient of two integers that are exact as doubles is correctly rounded.
        return (first + by * np.arange(count)) / np.float64(common)
    return np.array([(first + index * by) / common for index in range(count)])


def _stepped(start: Fraction, stop: Fraction, step: Fraction, whole: int) -> Values:
    values = _steps(start, step, whole + 1)
    if abs(start + whole * step - stop) <= abs(step) * _STEP_ROUNDING:
        values[-1] = to_float(stop)
    return values


def _multiples(start: float, stop: float, count: int) -> Values:
    if count == 1:
        return np.array([start])
    sign = math.copysign(1.0, start)
    low, high = math.log10(abs(start)), math.log10(abs(stop))
    inner = [sign * 10.0 ** (low + (high - low) * index / (count - 1)) for index in range(1, count - 1)]
    return np.array([start, *inner, stop])
