"""The fields by which a spec describes a distribution: shared by tolerances and samples."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from sprag_study.sentences import Amount, Sentence
from sprag_study.service.languages import N_
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
    "-plus_minus to +plus_minus",
    "normal", "truncated_normal", "lognormal", "uniform", "triangular", default="normal",
)  # fmt: skip
PLUS_MINUS: Final = N_('a share of the nominal value, as in "5 %", or a quantity, as in "0.2 mm"')
_MEASURED: Final = Listed(
    "values", 1, 100_000, "measured values, each of which is drawn equally often", item=QUANTITY, text=True
)
FIELDS: Final[dict[str, Field]] = {
    "plus_minus": {
        **QUANTITY,
        "description": f"how far the value lies from the nominal one: {PLUS_MINUS}",
        "examples": ["5 %", "0.2 mm"],
    },
    "distribution": DISTRIBUTION,
    "values": _MEASURED,
}

#: Range of a share that `plus_minus` may be.
_LEAST: Final = 1e-9
_MOST: Final = 10.0
#: Largest number that it may be of a parameter without bounds.
_LARGEST: Final = 1e100


def read_plus_minus(node: Node, parameter: Parameter) -> tuple[bool, float] | None:
    """Whether `plus_minus` is a share, and its number (of a quantity in SI); None, and a fault recorded, if invalid."""
    if not node.given:
        node.refuse("required", "is required, or `values`", allowed=PLUS_MINUS)
        return None
    share = in_percent(node.value)
    if share is not None:
        if not _LEAST <= share <= _MOST:
            ends = {"low": Amount(100 * _LEAST, digits=6), "high": Amount(100 * _MOST, digits=6)}
            node.refuse("out-of-range", "is out of range", allowed=Sentence("{low} % to {high} %", **ends))
            return None
        return True, share
    number = node.parsed(lambda value: parse_quantity(value, parameter.unit), allowed=PLUS_MINUS, unit=parameter.unit)
    if number is None:
        return None
    most = min(parameter.high - parameter.low, _LARGEST)
    if not 0.0 < number <= most:
        allowed = Sentence("above 0, at most {high}", high=Amount(most, digits=6))
        node.refuse("out-of-range", "is out of range", allowed=allowed, unit=parameter.unit)
        return None
    return False, number


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
