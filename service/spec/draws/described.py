"""The fields by which a spec describes a distribution: shared by tolerances and samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from sprag_study.sentences import Amount, Sentence
from sprag_study.service.languages import N_
from sprag_study.service.reading.deviations import deviations
from sprag_study.service.reading.together import split_list
from sprag_study.service.reading.units import parse_quantity
from sprag_study.service.spec.described import Field, Listed, choice
from sprag_study.service.spec.draws.distributions import SIGMAS
from sprag_study.service.spec.lists import read_list, read_list_text
from sprag_study.service.spec.node import Node
from sprag_study.service.spec.schema.quantity import QUANTITY
from sprag_study.service.spec.shares import in_percent

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.worker.models import Parameter

DISTRIBUTION: Final = choice(
    "distribution",
    f"normal: plus_minus is {SIGMAS:g} standard deviations; truncated_normal: the same without what lies beyond "
    "plus_minus; lognormal: the logarithm is normal and the nominal value the median; uniform and triangular: from "
    "-plus_minus to +plus_minus. Two deviations are the limits instead, with the mean in the middle",
    "normal", "truncated_normal", "lognormal", "uniform", "triangular", default="normal",
)  # fmt: skip
PLUS_MINUS: Final = N_(
    'a share of the nominal value, as in "5 %", or a quantity, as in "0.2 mm"; two as on drawings, as in "+0.05/-0 mm"'
)
_MEASURED: Final = Listed(
    "values", 1, 100_000, "measured values, each of which is drawn equally often", item=QUANTITY, text=True
)
FIELDS: Final[dict[str, Field]] = {
    "plus_minus": {
        **QUANTITY,
        "description": f"how far the value lies from the nominal one: {PLUS_MINUS}",
        "examples": ["5 %", "0.2 mm", "+0.05/-0 mm"],
    },
    "distribution": DISTRIBUTION,
    "values": _MEASURED,
}

#: Range of a share that `plus_minus` may be.
_LEAST: Final = 1e-9
_MOST: Final = 10.0
#: Largest number that it may be of a parameter without bounds.
_LARGEST: Final = 1e100


@dataclass(frozen=True)
class Deviations:
    """How far the values of a parameter lie from the nominal one: from ``low`` to ``high``.

    Attributes
    ----------
    share : bool
        Whether both are shares of the nominal value; otherwise they are quantities (SI).
    low, high : float
        ``low < high``.
    written : object
        As the spec has it.
    """

    share: bool
    low: float
    high: float
    written: object

    @property
    def middle(self) -> float:
        """How far the middle of the distribution lies from the nominal value: 0 where one number was given."""
        return (self.low + self.high) / 2.0

    @property
    def half(self) -> float:
        """Half of the distance between both, positive."""
        return (self.high - self.low) / 2.0


def read_plus_minus(item: Node, parameter: Parameter, kind: str) -> Deviations | None:
    """`plus_minus` of an item whose distribution is of a ``kind``; None, and a fault recorded, if it is invalid."""
    node = item["plus_minus"]
    if not node.given:
        node.refuse("required", "is required, or `values`", allowed=PLUS_MINUS)
        return None
    if isinstance(node.value, str) and node.value.strip().startswith("±"):  # as pages print it
        node = node.holding(node.value.strip()[1:].lstrip())
    nodes = both_of(node)
    numbers = _numbers(nodes, parameter)
    if numbers is None:
        return None
    share, values = numbers
    low, high = sorted(values) if len(values) == 2 else (-values[0], values[0])
    found = Deviations(share, low, high, node.value)
    most = _MOST if share else min(parameter.high - parameter.low, _LARGEST)
    if not (_LEAST if share else 0.0) <= found.half or not low < high or max(-low, high) > most:
        _refuse_range(node, parameter, most, share=share, two=len(nodes) == 2)
        return None
    if kind == "lognormal" and found.middle:
        allowed = N_("another distribution")
        item["distribution"].refuse("conflict", "a lognormal distribution has no two deviations", allowed=allowed)
        return None
    return found


def both_of(node: Node) -> list[Node]:
    """The two deviations of `plus_minus`, or the one that it has."""
    pair = deviations(node.value) if isinstance(node.value, str) else None
    return [node] if pair is None else [node.holding(text) for text in pair]


def _numbers(nodes: Sequence[Node], parameter: Parameter) -> tuple[bool, list[float]] | None:
    """Whether these are shares, and their numbers (of quantities in SI); None, and a fault recorded, if invalid."""
    shares = [share for node in nodes if (share := in_percent(node.value)) is not None]
    if len(shares) == len(nodes):
        return True, shares
    if shares:
        nodes[0].refuse("wrong-unit", "has a share and a quantity", allowed=N_("two shares, or two quantities"))
        return None

    def parse(value: object) -> float:
        return parse_quantity(value, parameter.unit)

    numbers = []
    for node in nodes:
        number = node.parsed(parse, allowed=PLUS_MINUS, unit=parameter.unit)
        if number is None:
            return None
        numbers.append(number)
    return False, numbers


def _refuse_range(node: Node, parameter: Parameter, most: float, *, share: bool, two: bool) -> None:
    """Record that `plus_minus` is out of range."""
    high = Amount(100 * most, "%", digits=6) if share else Amount(most, digits=6)
    if two:
        allowed = Sentence("two different deviations of at most {high}", high=high)
    elif share:
        low, high = (Amount(100 * end, digits=6) for end in (_LEAST, most))
        allowed = Sentence("{low} % to {high} %", low=low, high=high)
    else:
        allowed = Sentence("above 0, at most {high}", high=high)
    node.refuse("out-of-range", "is out of range", allowed=allowed, unit=None if share else parameter.unit)


def read_measured(node: Node, parameters: Sequence[Parameter]) -> list[float] | None:
    """Measured values (SI), a list or one text with all of them, in the range of every one of ``parameters``.

    None, and faults recorded, where they are invalid.
    """
    unit, about = parameters[0].unit, parameters[0].path
    text = isinstance(node.value, str)
    listed = _MEASURED.read(node.holding(split_list(node.value)) if text else node)
    if listed is None:
        return None
    items = read_list_text(node, unit, about) if text else read_list(listed, unit, about)
    if items is None:
        return None
    read = [[item.number(parameter) for parameter in parameters] for item in items]
    values = [numbers[0] for numbers in read if None not in numbers]
    return [value for value in values if value is not None] if len(values) == len(items) else None
