"""A part of a sample that is drawn from a distribution instead of a range."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from sprag_study.service.reading.catalogue import range_sentence
from sprag_study.service.spec.axes.axes import PATHS, read_paths
from sprag_study.service.spec.described import Record
from sprag_study.service.spec.draws.described import DISTRIBUTION, FIELDS, both_of, read_measured, read_plus_minus
from sprag_study.service.spec.draws.distributions import Distribution
from sprag_study.service.spec.lists import refuse_mixed
from sprag_study.service.spec.schema.quantity import QUANTITY

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.service.spec.node import Node
    from sprag_study.worker.models import Parameter

#: A part of a sample with a distribution.
DRAWN: Final = Record(
    {
        "path": PATHS,
        "nominal": {**QUANTITY, "description": "the value in the middle; by default that of `base`"},
        **FIELDS,
    },
    required=("path",),
    some=("plus_minus", "values"),
)
#: Fields that a range does not have.
_MARKS: Final = frozenset(DRAWN.fields) - {"path"}


@dataclass(frozen=True)
class SampleDistribution:
    """Tied paths and the distribution (SI) of their value."""

    paths: tuple[str, ...]
    distribution: Distribution

    def place(self, unit: NDArray[Any]) -> NDArray[Any]:
        """Map numbers between 0 and 1 to values."""
        return self.distribution.quantile(unit)


def is_distribution(item: object) -> bool:
    """Whether an item of `ranges` is drawn from a distribution."""
    return isinstance(item, Mapping) and not _MARKS.isdisjoint(item)


def read_distribution(item: Node) -> SampleDistribution | None:
    """Read an item of `ranges` with a distribution; None, with the faults recorded, when it is invalid."""
    if not DRAWN.read(item):
        return None
    paths = read_paths(item["path"])
    if paths is None:
        return None
    parameters = [item.machine.parameters[path] for path in paths]
    unit = parameters[0].unit
    if "values" in item:
        item.refuse_each(("nominal", "plus_minus", "distribution"), "cannot be combined with `values`")
        values = read_measured(item["values"], parameters)
        return None if values is None else SampleDistribution(paths, Distribution("values", values=tuple(values)))
    if refuse_mixed([item["nominal"], *both_of(item["plus_minus"])], unit):
        return None
    kind = DISTRIBUTION.read(item)
    nominal = _read_nominal(item["nominal"], parameters)
    read = None if kind is None else read_plus_minus(item, parameters[0], kind)
    if kind is None or nominal is None or read is None:
        return None
    scale = nominal if read.share else 1.0
    middle, half = read.middle * scale, read.half * abs(scale)
    if half == 0.0:
        item["plus_minus"].refuse("out-of-range", "needs a nominal value other than 0", allowed="a quantity", unit=unit)
        return None
    if kind == "lognormal" and nominal <= 0.0:
        item["distribution"].refuse(
            "out-of-range", "needs a nominal value above 0", allowed="another distribution", unit=unit
        )
        return None
    low = max(math.nextafter(one.low, math.inf) if one.low_open else one.low for one in parameters)
    high = min(one.high for one in parameters)
    return SampleDistribution(paths, Distribution(kind, nominal + middle, half, low=low, high=high))


def _read_nominal(node: Node, parameters: list[Parameter]) -> float | None:
    """The value in the middle, by default that of the base; None, with a fault recorded, where there is none."""
    if node.given:
        return node.number_in(parameters)
    values = {node.machine.values.get(parameter.path) for parameter in parameters}
    if len(values) == 1 and None not in values:
        return values.pop()
    node.refuse(
        "required", "is required: the tied parameters differ in `base`" if len(values) > 1 else "is required",
        allowed=range_sentence(parameters[0]), unit=parameters[0].unit,
    )  # fmt: skip
    return None
