"""Points drawn over ranges and from distributions of parameters: Latin hypercube, Sobol sequence, independent points,
and designs for sensitivities; seeded.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from sprag.sentences import Sentence
from sprag.service.spec.axes.axes import read_paths
from sprag.service.spec.axes.blocks import Block
from sprag.service.spec.axes.drawn import SampleDistribution, is_distribution, read_distribution
from sprag.service.spec.described import Described, Listed, choice, named
from sprag.service.spec.draws.correlations import read_correlations
from sprag.service.spec.draws.unit import cases_of, correlated, unit_sample
from sprag.service.spec.fields import read_number, read_object
from sprag.service.spec.lists import refuse_mixed
from sprag.service.spec.report import Report, join
from sprag.worker.limits import MAX_AXES, MAX_AXIS_VALUES
from sprag.worker.planning.goals.draws import exponential, logarithm

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag.service.spec.machine.machine import Machine

_METHOD_HELP: Final = (
    "latin_hypercube and sobol fill the ranges evenly, random points are independent; saltelli is the design for Sobol "
    "indices, of count * (ranges + 2) cases; morris are count trajectories of ranges + 1 cases, for elementary effects"
)
_SECOND_HELP: Final = "of a saltelli sample: indices of pairs too, by count * (2 * ranges + 2) cases"
SAMPLE: Final = named(
    choice("sample", _METHOD_HELP, "latin_hypercube", "sobol", "random", "saltelli", "morris"),
    Described("count", "", "points; sobol and saltelli take a power of 2", "whole", 1, MAX_AXIS_VALUES),
    Described("seed", "", "seed of the random numbers", "whole", 0, 2**32 - 1, 0),
    Described("second_order", "", _SECOND_HELP, "flag", default=False),
)
MOST_TRAJECTORIES: Final = 1000
RANGES: Final = Listed("ranges", 1, MAX_AXES)
SCALE: Final = choice("scale", "log: even in the logarithm", "linear", "log", default="linear")


@dataclass(frozen=True)
class SampleRange:
    """Tied paths and the range (SI) they are drawn from; on a log scale the logarithm is uniform."""

    paths: tuple[str, ...]
    low: float
    high: float
    scale: Literal["linear", "log"]

    def place(self, unit: NDArray[np.float64]) -> NDArray[np.float64]:
        """Map numbers between 0 and 1 to values of the range."""
        if self.scale == "log":
            values = self.low * exponential(unit * logarithm(np.array(self.high / self.low)))
        else:
            values = self.low + (self.high - self.low) * unit
        return np.asarray(np.clip(values, min(self.low, self.high), max(self.low, self.high)), dtype=np.float64)


Part = SampleRange | SampleDistribution


def read_sample(report: Report, pointer: str, data: Mapping[str, Any], machine: Machine) -> Block | None:
    """Read the block of a sample; None, with the faults recorded, when it is invalid."""
    before = report.found
    found = read_object(report, pointer, data, (*SAMPLE, "ranges", "correlations")) or {}
    method, count, seed, second_order = (field.read(report, pointer, found) for field in SAMPLE.values())
    items = RANGES.read(report, join(pointer, "ranges"), found.get("ranges"))
    if items is None:
        return None
    ranges = [_read_part(report, join(pointer, "ranges", index), item, machine) for index, item in enumerate(items)]
    if count is not None and method in {"sobol", "saltelli"} and count & (count - 1):
        report.fault(
            join(pointer, "count"),
            "out-of-range",
            Sentence("a {method} sample fills its ranges evenly only with a power of two", method=method),
            count,
            allowed="a power of 2",
        )
    if second_order and method != "saltelli":
        report.fault(
            join(pointer, "second_order"),
            "conflict",
            Sentence("is given for a {method} sample", method=method or ""),
            allowed="saltelli samples",
        )
    elif second_order and len(items) < 3:
        report.fault(join(pointer, "ranges"), "out-of-range", "two parameters interact by what total exceeds first "
                     "order by; indices of pairs are for more", len(items), allowed="at least 3 ranges")  # fmt: skip
    if method == "morris":
        _check_trajectories(report, pointer, count, items)
    if report.found > before or method is None or count is None or seed is None:
        return None
    known = tuple(item for item in ranges if item is not None)
    matrix = _read_correlations(report, pointer, found, method, known)
    if report.found > before:
        return None
    cases = cases_of(method, count, len(known), second_order=second_order)
    make = partial(draw, method, count, seed, known, matrix, second_order=second_order)
    return Block(pointer, tuple(path for item in known for path in item.paths), cases, make)


def _check_trajectories(report: Report, pointer: str, count: int | None, items: list[Any]) -> None:
    """Refuse a single range, which needs no screening, distributions, and trajectories that share points."""
    for index, item in enumerate(items):
        if is_distribution(item):
            report.fault(join(pointer, "ranges", index), "conflict", "a morris sample steps over ranges",
                         allowed="from and to")  # fmt: skip
    if len(items) < 2:
        report.fault(join(pointer, "ranges"), "out-of-range", "a morris sample compares parameters", len(items),
                     allowed="at least 2 ranges")  # fmt: skip
    if count is not None and count > MOST_TRAJECTORIES:
        report.fault(join(pointer, "count"), "out-of-range", "is more than elementary effects need", count,
                     allowed=Sentence("at most {high} trajectories", high=MOST_TRAJECTORIES))  # fmt: skip


def _read_part(report: Report, pointer: str, item: object, machine: Machine) -> Part | None:
    read = read_distribution if is_distribution(item) else _read_range
    return read(report, pointer, item, machine)


def _read_correlations(
    report: Report, pointer: str, found: Mapping[str, Any], method: str, parts: tuple[Part, ...]
) -> NDArray[np.float64] | None:
    """The correlations of a sample; None without."""
    where = join(pointer, "correlations")
    if "correlations" not in found:
        return None
    if method in {"saltelli", "morris"}:
        message = Sentence("a {method} sample needs independent parameters", method=method)
        report.fault(where, "conflict", message, allowed="another sample")
        return None
    columns = {path: index for index, part in enumerate(parts) for path in part.paths}
    return read_correlations(report, found["correlations"], columns, len(parts), where)[0]


def _read_range(report: Report, pointer: str, data: object, machine: Machine) -> SampleRange | None:
    found = read_object(report, pointer, data, ("path", "from", "to", "scale"))
    if found is None:
        return None
    paths = read_paths(report, join(pointer, "path"), found.get("path"), machine)
    scale = SCALE.read(report, pointer, found)
    unit = "" if paths is None else machine.parameters[paths[0]].unit
    given = [(join(pointer, name), found.get(name)) for name in ("from", "to")]
    if paths is None or refuse_mixed(report, given, unit):
        return None
    ends = []
    for name in ("from", "to"):
        for path in paths:
            value = read_number(report, join(pointer, name), found.get(name), machine.parameters[path])
            if value is None:
                return None
        ends.append(value)
    low, high = (float(end) for end in ends if end is not None)
    if low == high:
        report.fault(
            join(pointer, "to"), "invalid-range", "is the same as `from`", high, allowed="another value", unit=unit
        )
        return None
    if scale == "log" and low * high <= 0.0:
        report.fault(pointer, "invalid-range", "a log scale needs two ends of one sign, neither of them 0",
                       [found.get("from"), found.get("to")], unit=unit)  # fmt: skip
        return None
    return None if scale is None else SampleRange(paths, low, high, scale)


def draw(
    method: str,
    count: int,
    seed: int,
    ranges: tuple[Part, ...],
    correlation: NDArray[np.float64] | None = None,
    *,
    second_order: bool = False,
) -> dict[str, NDArray[np.float64]]:
    """Draw the sample; equal arguments give equal samples with one version of scipy, and the study stores them."""
    unit = unit_sample(method, count, seed, len(ranges), second_order=second_order)
    if correlation is not None:
        unit = correlated(unit, correlation)
    found: dict[str, NDArray[np.float64]] = {}
    for index, item in enumerate(ranges):
        found.update(dict.fromkeys(item.paths, item.place(unit[:, index])))
    return found
