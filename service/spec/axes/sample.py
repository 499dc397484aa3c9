"""Points drawn over ranges and from distributions of parameters: Latin hypercube, Sobol sequence, independent points,
and designs for sensitivities; seeded.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from sprag_study.sentences import Sentence
from sprag_study.service.languages import N_
from sprag_study.service.spec.axes.axes import PATHS, read_paths
from sprag_study.service.spec.axes.blocks import Block
from sprag_study.service.spec.axes.drawn import DRAWN, SampleDistribution, is_distribution, read_distribution
from sprag_study.service.spec.described import Described, Listed, Record, Variants, choice, named
from sprag_study.service.spec.draws.correlations import CORRELATIONS, read_correlations
from sprag_study.service.spec.draws.unit import cases_of, correlated, unit_sample
from sprag_study.service.spec.lists import refuse_mixed
from sprag_study.service.spec.schema.quantity import QUANTITY
from sprag_study.worker.limits import MAX_AXES, MAX_AXIS_VALUES
from sprag_study.worker.planning.goals.draws import exponential, logarithm

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from sprag_study.service.spec.node import Node

_METHOD_HELP: Final = (
    "latin_hypercube and sobol fill the ranges evenly, random points are independent; saltelli is the design for Sobol "
    "indices, of count * (ranges + 2) cases; morris are count trajectories of ranges + 1 cases, for elementary effects"
)
_METHODS: Final = {
    "latin_hypercube": N_("Latin hypercube"),
    "sobol": N_("Sobol sequence"),
    "random": N_("independent points"),
    "saltelli": N_("Saltelli, for Sobol indices"),
    "morris": N_("Morris, for elementary effects"),
}
_SECOND_HELP: Final = "of a saltelli sample: indices of pairs too, by count * (2 * ranges + 2) cases"
MOST_TRAJECTORIES: Final = 1000
SCALE: Final = choice("scale", "log: even in the logarithm", "linear", "log", default="linear")
_RANGE: Final = Record(
    {"path": PATHS, "from": QUANTITY, "to": QUANTITY, "scale": SCALE}, required=("path", "from", "to")
)
_RANGES: Final = Listed("ranges", 1, MAX_AXES, item=Variants((_RANGE, DRAWN)))
SAMPLE: Final = Record(
    {
        **named(
            choice("sample", _METHOD_HELP, *_METHODS, label=N_("Kind of sample"), called=_METHODS),
            Described("count", "", "points; sobol and saltelli take a power of 2", "whole", 1, MAX_AXIS_VALUES),
            Described("seed", "", "seed of the random numbers", "whole", 0, 2**32 - 1, 0),
            Described("second_order", "", _SECOND_HELP, "flag", default=False),
        ),
        "ranges": _RANGES,
        "correlations": CORRELATIONS,
    },
    "points drawn over ranges and from distributions of parameters",
    required=("sample", "count", "ranges"),
)


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


def read_sample(item: Node) -> Block | None:
    """Read the block of a sample; None, with the faults recorded, when it is invalid."""
    before = item.report.found
    SAMPLE.read(item)
    method, count, seed, second_order = SAMPLE.values(item).values()
    parts = SAMPLE.items(item, "ranges")
    if not parts:
        return None
    read = [read_distribution(part) if is_distribution(part.value) else _read_range(part) for part in parts]
    if count is not None and method in {"sobol", "saltelli"} and count & (count - 1):
        message = Sentence("a {method} sample fills its ranges evenly only with a power of two", method=method)
        item["count"].refuse("out-of-range", message, allowed="a power of 2")
    if second_order and method != "saltelli":
        item["second_order"].refuse("conflict", Sentence("is given for a {method} sample", method=method or ""),
                                    None, allowed="saltelli samples")  # fmt: skip
    elif second_order and len(parts) < 3:
        item["ranges"].refuse(
            "out-of-range", "two parameters interact by what total exceeds first order by; indices of pairs are for "
            "more", len(parts), allowed="at least 3 ranges",
        )  # fmt: skip
    if method == "morris":
        _check_trajectories(item, count, parts)
    # A sample counts its own faults: the axes before it may have some too.
    if item.report.found > before or method is None or count is None or seed is None:
        return None
    known = tuple(part for part in read if part is not None)
    correlations = item["correlations"]
    matrix = _read_correlations(correlations, method, known)
    if not correlations.sound:
        return None
    cases = cases_of(method, count, len(known), second_order=second_order)
    make = partial(draw, method, count, seed, known, matrix, second_order=second_order)
    return Block(item.pointer, tuple(path for part in known for path in part.paths), cases, make)


def _check_trajectories(item: Node, count: int | None, parts: Sequence[Node]) -> None:
    """Refuse a single range, which needs no screening, distributions, and trajectories that share points."""
    for part in parts:
        if is_distribution(part.value):
            part.refuse("conflict", "a morris sample steps over ranges", None, allowed="from and to")
    if len(parts) < 2:
        item["ranges"].refuse("out-of-range", "a morris sample compares parameters", len(parts),
                              allowed="at least 2 ranges")  # fmt: skip
    if count is not None and count > MOST_TRAJECTORIES:
        item["count"].refuse("out-of-range", "is more than elementary effects need",
                             allowed=Sentence("at most {high} trajectories", high=MOST_TRAJECTORIES))  # fmt: skip


def _read_correlations(node: Node, method: str, parts: tuple[Part, ...]) -> NDArray[np.float64] | None:
    """The correlations of a sample; None without."""
    if not node.given:
        return None
    if method in {"saltelli", "morris"}:
        message = Sentence("a {method} sample needs independent parameters", method=method)
        node.refuse("conflict", message, None, allowed="another sample")
        return None
    columns = {path: index for index, part in enumerate(parts) for path in part.paths}
    return read_correlations(node, columns, len(parts))[0]


def _read_range(item: Node) -> SampleRange | None:
    if not _RANGE.read(item):
        return None
    paths, scale = read_paths(item["path"]), SCALE.read(item)
    parameters = [item.machine.parameters[path] for path in paths or ()]
    unit = parameters[0].unit if parameters else ""
    ends = [item["from"], item["to"]]
    if paths is None or refuse_mixed(ends, unit):
        return None
    low, high = (end.number_in(parameters) for end in ends)
    if low is None or high is None:
        return None
    if low == high:
        ends[1].refuse("invalid-range", "is the same as `from`", allowed="another value", unit=unit)
        return None
    if scale == "log" and low * high <= 0.0:
        item.refuse("invalid-range", "a log scale needs two ends of one sign, neither of them 0",
                    [end.value for end in ends], unit=unit)  # fmt: skip
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
