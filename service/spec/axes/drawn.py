"""A part of a sample that is drawn from a distribution instead of a range."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from sprag.service.reading.catalogue import range_sentence
from sprag.service.spec.axes.axes import read_paths
from sprag.service.spec.draws.described import DISTRIBUTION, read_measured, read_plus_minus
from sprag.service.spec.draws.distributions import Distribution
from sprag.service.spec.fields import read_number, read_object
from sprag.service.spec.lists import refuse_mixed
from sprag.service.spec.report import Report, join

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag.service.spec.machine.machine import Machine
    from sprag.worker.models import Parameter

FIELDS: Final = ("path", "nominal", "plus_minus", "distribution", "values")
#: Fields that a range does not have.
_MARKS: Final = frozenset(FIELDS) - {"path"}


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


def read_distribution(report: Report, pointer: str, data: object, machine: Machine) -> SampleDistribution | None:
    """Read an item of `ranges` with a distribution; None, with the faults recorded, when it is invalid."""
    found = read_object(report, pointer, data, FIELDS)
    if found is None:
        return None
    paths = read_paths(report, join(pointer, "path"), found.get("path"), machine)
    if paths is None:
        return None
    parameters = [machine.parameters[path] for path in paths]
    if "values" in found:
        for field in ("nominal", "plus_minus", "distribution"):
            if field in found:
                report.fault(join(pointer, field), "conflict", "cannot be combined with `values`", found[field])
        values = read_measured(report, join(pointer, "values"), found["values"], parameters)
        return None if values is None else SampleDistribution(paths, Distribution("values", values=tuple(values)))
    together = [(join(pointer, name), found.get(name)) for name in ("nominal", "plus_minus")]
    if refuse_mixed(report, together, parameters[0].unit):
        return None
    kind = DISTRIBUTION.read(report, pointer, found)
    nominal = _read_nominal(report, pointer, found, parameters, machine)
    read = read_plus_minus(report, pointer, found, parameters[0])
    if kind is None or nominal is None or read is None:
        return None
    share, half = read
    half = half * abs(nominal) if share else half
    if half == 0.0 or (kind == "lognormal" and nominal <= 0.0):
        report.fault(
            join(pointer, "plus_minus" if half == 0.0 else "distribution"), "out-of-range",
            "needs a nominal value other than 0" if half == 0.0 else "needs a nominal value above 0",
            found.get("plus_minus" if half == 0.0 else "distribution"),
            allowed="a quantity" if half == 0.0 else "another distribution", unit=parameters[0].unit,
        )  # fmt: skip
        return None
    low = max(math.nextafter(one.low, math.inf) if one.low_open else one.low for one in parameters)
    high = min(one.high for one in parameters)
    return SampleDistribution(paths, Distribution(kind, nominal, half, low=low, high=high))


def _read_nominal(
    report: Report, pointer: str, found: Mapping[str, Any], parameters: list[Parameter], machine: Machine
) -> float | None:
    """The value in the middle, by default that of the base; None, with a fault recorded, where there is none."""
    where = join(pointer, "nominal")
    if "nominal" in found:
        read = [read_number(report, where, found["nominal"], parameter) for parameter in parameters]
        return None if None in read else read[0]
    values = {machine.values.get(parameter.path) for parameter in parameters}
    if len(values) == 1 and None not in values:
        return values.pop()
    report.fault(
        where,
        "required",
        "is required: the tied parameters differ in `base`" if len(values) > 1 else "is required",
        allowed=range_sentence(parameters[0]),
        unit=parameters[0].unit,
    )
    return None
