"""The planner of refined maps: halves rectangular cells until the surface over them is accurate to within the error.

As on curves (`refined_curves`), all maps of a study advance together, and the rows of all rounds say everything.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag_study.worker.planning.cells import Cells, Tree, misses, stencils, surface, tree
from sprag_study.worker.planning.refiner import Described, Refiner
from sprag_study.worker.planning.samples import Samples

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.worker.planning.refine_plan import RefinePlan
    from sprag_study.worker.planning.refiner import Places
    from sprag_study.worker.planning.rounds import Rows

    Bools = NDArray[np.bool_]
    Floats = NDArray[np.float64]
    Ints = NDArray[np.int64]

#: A cell of the finest width that rises by more than this many errors, and whose parent did not pass, holds a jump.
_RISES: Final = 2.0


@dataclass(frozen=True)
class Map(Described):
    """A refined map.

    Attributes
    ----------
    fixed : dict of str to float
        Values of the fixed axes by path.
    x, y : float64 arrays, shape (points,)
        The adaptive parameters, SI.
    ok, values, errors, passed
        As of `Described`, with ``ranges``, ``shares`` and ``asked``; `at` interpolates.
    cells : float64 array, shape (cells, 4)
        Low x, low y, high x and high y of the cells between the points, SI.
    jumps : dict of str to bool array, each shape (cells,)
        Whether the cell is not interpolated: it holds a jump of the result, or results are missing or scatter.
    """

    fixed: dict[str, float]
    x: Floats
    y: Floats
    ok: Bools
    values: dict[str, Floats]
    errors: dict[str, float | None]
    ranges: dict[str, float]
    shares: dict[str, float]
    asked: float
    passed: bool
    cells: Floats
    jumps: dict[str, Bools]
    _own: Cells
    _samples: Samples

    @cached_property
    def _stencils(self) -> Floats:
        """Values at three times three places of each cell, shape (cells, 3, 3, results); the first axis is x."""
        return stencils(self._samples, self._own)

    @cached_property
    def _owners(self) -> Ints:
        """Cell that holds each square of the finest grid, shape (finest, finest); -1 where there is none."""
        finest = self._samples.plan.finest
        owners = np.full((finest, finest), -1, dtype=np.int64)
        for number, (left, lower, right, upper) in enumerate(self._own.bounds().tolist()):
            owners[left:right, lower:upper] = number
        return owners

    def at(self, name: str, x: Floats, y: Floats) -> Floats:
        """The interpolated result at places (SI, of one shape); NaN in jumps and where there are no cells yet."""
        finest = len(self._owners)
        steps = [
            np.clip((own - axis.low) / (axis.high - axis.low) * finest, 0.0, finest)
            for own, axis in zip((x, y), self._samples.plan.adaptive, strict=True)
        ]
        i, j = (np.minimum(step.astype(np.int64), finest - 1) for step in steps)
        owner = self._owners[i, j]
        cell, k = np.maximum(owner, 0), list(self.values).index(name)
        if not len(self.cells):
            return np.full(np.shape(x), np.nan)
        low, high = self.cells[cell, :2], self.cells[cell, 2:]
        parts = [np.clip((own - low[..., n]) / (high - low)[..., n], 0.0, 1.0) for n, own in enumerate((x, y))]
        values = surface(self._stencils[..., k], cell, parts[0], parts[1])
        return np.where((owner < 0) | self.jumps[name][cell], np.nan, values)

    @property
    def jumps_share(self) -> dict[str, float]:
        """Share of the map's area that is not interpolated, by result."""
        size = np.prod(self.cells[:, 2:] - self.cells[:, :2], axis=1)
        whole = float(np.prod([axis.high - axis.low for axis in self._samples.plan.adaptive]))
        return {name: float(size[jumps].sum()) / whole for name, jumps in self.jumps.items()}

    def to_json(self) -> dict[str, Any]:
        return {
            "fixed": self.fixed,
            "points": len(self.x),
            "failed": int((~self.ok).sum()),
            "errors": self.errors,
            "jumps_share": self.jumps_share,
            "passed": self.passed,
        }


class MapRefiner(Refiner):
    """Planner of maps: two adaptive axes."""

    dimensions = 2
    # One for each axis, and one for what a growing range changes in the order of the halvings.
    rounds_per_halving = 3
    noun = "maps"

    def __init__(self, plan: RefinePlan) -> None:
        super().__init__(plan)
        #: The cells of the rows so far; computed once.
        self._own: Tree | None = None

    def changed(self) -> None:
        self._own = None

    def further(self) -> Places:
        """The midpoints of the edges of every cell that is not resolved."""
        own = self._tree()
        cells = own.leaves[~own.resolved]
        places, worth = [], []
        for axis, size in enumerate((cells.width, cells.height)):
            for place in cells.middles(axis):
                new = (size > 1) & ~self.samples.known[place]
                places.append(np.stack(place)[:, new])
                worth.append(np.minimum(cells.worst, 1.0)[new])
        at, value = np.hstack(places), np.concatenate(worth)
        best = np.lexsort((*at[::-1], -value))
        _, first = np.unique(at[:, best], axis=1, return_index=True)
        combinations, x, y = at[:, best][:, np.sort(first)]
        return combinations, [x, y]

    def described(self) -> list[Map]:
        return _maps(self.samples, self._tree())

    def _tree(self) -> Tree:
        if self._own is None:
            self._own = tree(self.samples, self.samples.scales())
        return self._own


def describe_maps(plan: RefinePlan, rows: Rows) -> list[Map]:
    """The refined maps from all rows of a study, in any order; the last fixed axis varies fastest.

    ValueError for a row that is not a point of the plan.
    """
    samples = Samples(plan)
    samples.add(rows)
    return _maps(samples, tree(samples, samples.scales()))


def _maps(samples: Samples, own: Tree) -> list[Map]:
    errors, jumps = _judged(samples, own)
    maps, measures = [], list(zip(*samples.measures(), strict=True))
    for index in range(len(samples.known)):
        here = own.leaves.map == index
        judged = own.leaves[here], errors[here], jumps[here], bool(own.resolved[here].all())
        maps.append(_map(samples, index, *judged, *measures[index]))
    return maps


def _judged(samples: Samples, own: Tree) -> tuple[Floats, Bools]:
    """Estimated errors and jumps of all leaves, both of shape (cells, results)."""
    error, cells = samples.plan.error, own.leaves
    scales = samples.scales()[cells.map]
    corners = np.stack([samples.values[place] for place in cells.corners()])
    widths = np.max([samples.widths[place] for place in cells.corners()], axis=0)
    errors, jumps = np.zeros_like(scales), np.zeros(scales.shape, dtype=bool)
    for axis, size in enumerate((cells.width, cells.height)):
        pairs = ((0, 1), (2, 3)) if axis == 0 else ((0, 2), (1, 3))
        rise = np.max([np.abs(corners[end] - corners[start]) for start, end in pairs], axis=0) / scales
        own_difference = cells.difference[:, axis]
        # Of the finest width there are no midpoints: what the ancestor missed may lie in the other half.
        halved = (size == 1)[:, None]
        estimate = np.where(halved, np.fmin(own_difference, rise) / _RISES, own_difference)
        errors = np.fmax(errors, estimate)
        # While a cell is open, only what rises may be a jump.
        jumps |= (estimate > error) & (own.resolved[:, None] | (rise > error))
    within, _ = misses(samples, samples.scales(), cells)
    errors, jumps = np.fmax(errors, within), jumps | (within > error)
    missing = ~np.isfinite(corners).all(axis=0)
    return errors, jumps | missing | (widths > error * scales)


def _map(
    samples: Samples,
    index: int,
    cells: Cells,
    errors: Floats,
    jumps: Bools,
    resolved: bool,
    ranges: Floats,
    shares: Floats,
) -> Map:
    plan = samples.plan
    # As of curves: relative to the ranges.
    errors = errors * (shares / plan.error)
    places = np.nonzero(samples.known[index])
    values = samples.values[index][places]
    x, y = (axis.at(own, plan.finest) for axis, own in zip(plan.adaptive, places, strict=True))
    present = np.isfinite(values).any(axis=0)
    bounds = cells.bounds()
    # Cells do not overlap.
    whole = int((cells.width * cells.height).sum()) == plan.finest**2
    edges = [plan.adaptive[n % 2].at(bounds[:, n], plan.finest) for n in range(4)]
    return Map(
        fixed=plan.fixed_values(index),
        x=x,
        y=y,
        ok=samples.ok[index][places],
        values={name: values[:, k] for k, name in enumerate(plan.results)},
        errors={
            name: _largest_of(errors[~jumps[:, k], k]) if present[k] and len(cells) else None
            for k, name in enumerate(plan.results)
        },
        ranges=dict(zip(plan.results, ranges.tolist(), strict=True)),
        shares=dict(zip(plan.results, shares.tolist(), strict=True)),
        asked=plan.error,
        passed=resolved and whole,
        cells=np.stack(edges, axis=1),
        jumps={name: jumps[:, k] for k, name in enumerate(plan.results)},
        _own=cells,
        _samples=samples,
    )


def _largest_of(errors: Floats) -> float | None:
    highest = float(errors.max(initial=0.0))
    return highest if np.isfinite(highest) else None
