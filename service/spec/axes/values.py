"""The values of an axis: a list, linear or geometric spacing, or steps. They are counted before they are expanded."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag_study.sentences import Sentence, Typed
from sprag_study.service.languages import N_
from sprag_study.service.reading.limits import values_to
from sprag_study.service.reading.ranges import TypedRange, typed_range
from sprag_study.service.reading.units import parse_exact, to_float
from sprag_study.service.spec.lists import read_list, read_list_text, read_together
from sprag_study.service.spec.node import Node
from sprag_study.worker.limits import MAX_AXIS_VALUES
from sprag_study.worker.models import Parameter
from sprag_study.worker.models.parameters import in_range

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
#: Parts into which a form splits "20 to 35 Hz, 4 values".
_RANGE_PARTS: Final = 2


@dataclass(frozen=True)
class Plan:
    """Values of an axis that are counted but not yet expanded.

    Attributes
    ----------
    node : Node
        The field that gives them; the values of a list lie below it, by index.
    count : int
        Number of values; may be huge.
    expand : callable
        Returns them in SI units and in order: float64 array, shape (count,).
    listed : bool
        Whether the user listed every value.
    """

    node: Node
    count: int
    expand: Callable[[], Values]
    listed: bool = False


def plan_values(node: Node, parameter: Parameter) -> Plan | None:
    """The plan of a plain list of quantities, or of one text with all of them."""
    data = node.value
    if not isinstance(data, list | str) or not data or not str(data).strip():
        empty = isinstance(data, list | str)
        node.refuse("empty" if empty else "wrong-type", "has no values" if empty else "must be a list of values",
                    allowed=values_to(MAX_AXIS_VALUES))  # fmt: skip
        return None
    if (text := _whole_text(data)) and (written := typed_range(text)) is not None:
        return _written_range(node, parameter, written)
    plain = _plain_numbers(data) if isinstance(data, list) else None
    if plain is not None and in_range(plain, parameter).all():
        return Plan(node, plain.size, lambda: plain, listed=True)
    read = read_list_text if isinstance(data, str) else _read_items
    items = read(node, parameter.unit, parameter.path)
    if items is None:
        return None
    numbers = [item.number(parameter) for item in items]
    known = [number for number in numbers if number is not None]
    if len(known) < len(numbers):
        return None
    return Plan(node, len(known), lambda: np.array(known), listed=True)


def _whole_text(data: list[Any] | str) -> str:
    """What was typed as one text, also where a form has split it at a comma; "" for a list of values."""
    if isinstance(data, str):
        return data
    return ", ".join(data) if len(data) <= _RANGE_PARTS and all(isinstance(item, str) for item in data) else ""


def _written_range(node: Node, parameter: Parameter, written: TypedRange) -> Plan | None:
    """The plan of a range that was typed as one text; None, and a question recorded, where it says too little."""
    if not written.step and written.count is None:
        ends = {"first": Typed(written.first), "last": Typed(written.last)}
        if written.spacing == "refined":
            node.refuse("invalid-text", N_("is refined between two ends, which are no values"),
                        allowed=Sentence('"adaptive": ["{first}", "{last}"]', **ends))  # fmt: skip
            return None
        node.refuse(
            "invalid-text",
            N_("is a range: in which steps, or how many values?"),
            allowed=Sentence("{first} to {last}, 5 values; or with a step behind it", **ends),
        )
        return None
    third = written.step if written.count is None else written.count
    own = node.holding([written.first, written.last, third])
    if written.count is None:
        return plan_range(own, parameter)
    return (plan_geomspace if written.spacing == "geometric" else plan_linspace)(own, parameter)


def _read_items(node: Node, unit: str, about: str) -> Sequence[Node] | None:
    return read_list(node.parts(), unit, about)


def _plain_numbers(data: list[Any]) -> Values | None:
    """The numbers of a list, each the nearest double; None where the list has other items."""
    if not set(map(type, data)) <= {int, float}:
        return None
    try:
        return np.array(data, dtype=np.float64)
    except OverflowError:
        return None


def plan_linspace(node: Node, parameter: Parameter) -> Plan | None:
    """The plan of ``[from, to, count]``, evenly spaced, both ends included."""
    division = _division(node, parameter)
    if division is None:
        return None
    start, stop, count = division
    step = (stop - start) / max(count - 1, 1)
    return Plan(node, count, lambda: _steps(start, step, count))


def plan_geomspace(node: Node, parameter: Parameter) -> Plan | None:
    """The plan of ``[from, to, count]``, geometrically spaced, both ends included."""
    division = _division(node, parameter)
    if division is None:
        return None
    start, stop, count = division
    if start * stop <= 0:
        node.refuse("invalid-range", "a geometric range needs two ends of one sign, neither of them 0")
        return None
    return Plan(node, count, lambda: _multiples(to_float(start), to_float(stop), count))


def plan_range(node: Node, parameter: Parameter) -> Plan | None:
    """The plan of ``[from, to, step]``; ``to`` is included when a whole number of steps reaches it."""
    three = _three(node, _STEPPED)
    if three is None or read_together(three, parameter.unit, parameter.path) is None:
        return None
    by = three[2]
    start, stop = three[0].exact(parameter), three[1].exact(parameter)
    step = by.parsed(lambda value: parse_exact(value, parameter.unit), unit=parameter.unit)
    if start is None or stop is None or step is None:
        return None
    if step == 0 or (stop - start) * step < 0:
        by.refuse(
            "invalid-range", "the step is 0" if step == 0 else "the step leads away from the end", unit=parameter.unit,
            allowed="a step greater than 0" if stop >= start else "a step less than 0, since the range goes down",
        )  # fmt: skip
        return None
    whole = math.floor((stop - start) / step + _STEP_ROUNDING)
    return Plan(node, whole + 1, lambda: _stepped(start, stop, step, whole))


PLANS: Final[dict[str, Callable[[Node, Parameter], Plan | None]]] = {
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


def _three(node: Node, allowed: str) -> Sequence[Node] | None:
    if isinstance(node.value, list) and len(node.value) == 3:
        return node.parts()
    node.refuse("wrong-type", "must be a list of three values", allowed=allowed)
    return None


def _division(node: Node, parameter: Parameter) -> tuple[Fraction, Fraction, int] | None:
    three = _three(node, _DIVIDED)
    if three is None or read_together(three[:2], parameter.unit, parameter.path) is None:
        return None
    start, stop, count = three[0].exact(parameter), three[1].exact(parameter), three[2].whole(1, MAX_AXIS_VALUES)
    if start is None or stop is None or count is None:
        return None
    if count == 1 and start != stop:
        three[2].refuse("invalid-range", "one value cannot be both ends of a range", allowed="2 or more, or equal ends")
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
