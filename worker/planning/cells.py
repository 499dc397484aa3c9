"""Maps on nested dyadic grids: rectangular cells, halved along their worse axis until they are resolved.

A cell is tested at the midpoints of its four edges. Its *difference* along an axis is the larger of what the midpoints
of its two edges along that axis miss the straight lines by. The tree of cells follows from the known points alone:
it is built anew from the cells of the first round, generation by generation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.worker.planning.samples import Samples

    Bools = NDArray[np.bool_]
    Floats = NDArray[np.float64]
    Ints = NDArray[np.int64]

#: Factor by which the difference of a smooth result shrinks under halving.
_SHRINKS: Final = 4.0
#: Cells longer than this part of an axis pass at half the error: a coarse grid can agree by chance.
_DIVIDED: Final = 16


@dataclass(frozen=True)
class Cells:
    """Rectangles of maps between known corners, in steps of the finest grid.

    Attributes
    ----------
    map, low_x, low_y, width, height : int64 arrays, shape (cells,)
    difference : float64 array, shape (cells, 2, results)
        Along each axis, relative to the scale; of the cell, or of the ancestor that was halved last along the axis
        where the cell's own midpoints are not known; infinite where values are missing.
    worst : float64 array, shape (cells,)
        The largest difference of the parent that more points would make smaller; infinite in the first generation.
    """

    map: Ints
    low_x: Ints
    low_y: Ints
    width: Ints
    height: Ints
    difference: Floats
    worst: Floats

    def __getitem__(self, chosen: Bools | Ints) -> Cells:
        return Cells(*(getattr(self, name)[chosen] for name in self.__dataclass_fields__))

    def __len__(self) -> int:
        return len(self.map)

    def bounds(self) -> Ints:
        """Low x, low y, high x and high y of each, shape (cells, 4)."""
        return np.stack([self.low_x, self.low_y, self.low_x + self.width, self.low_y + self.height], axis=1)

    def corners(self) -> tuple[tuple[Ints, Ints, Ints], ...]:
        """Places of the corners: low, low; high, low; low, high; high, high."""
        x, y = (self.low_x, self.low_x + self.width), (self.low_y, self.low_y + self.height)
        return tuple((self.map, x[i], y[j]) for j in (0, 1) for i in (0, 1))

    def middles(self, axis: int) -> tuple[tuple[Ints, Ints, Ints], tuple[Ints, Ints, Ints]]:
        """Places of the midpoints of the two edges along an axis."""
        if axis == 0:
            x = self.low_x + self.width // 2
            return (self.map, x, self.low_y), (self.map, x, self.low_y + self.height)
        y = self.low_y + self.height // 2
        return (self.map, self.low_x, y), (self.map, self.low_x + self.width, y)


@dataclass(frozen=True)
class Tree:
    """The leaves of all maps.

    ``leaves`` are all cells without children; ``resolved`` (cells,) those that passed or are of the finest size, the
    others have midpoints that are not known.
    """

    leaves: Cells
    resolved: Bools


def tree(samples: Samples, scales: Floats) -> Tree:
    """The tree of cells of all maps; ``scales`` has shape (maps, results)."""
    error = samples.plan.error
    cells = _first(samples)
    leaves: list[Cells] = []
    states: list[Bools] = []
    while len(cells) or not leaves:
        tested = _tested(samples, cells)
        own, worst = _differences(samples, scales, cells)
        cells = replace(cells, difference=own)
        largest = worst.max(axis=1)
        wide = np.maximum(cells.width, cells.height) > samples.plan.finest // _DIVIDED
        passed = tested & (largest <= np.where(wide, 0.5 * error, error))
        passed &= (largest <= error / _SHRINKS) | (cells.worst <= error * _SHRINKS)
        passed &= (misses(samples, scales, cells)[1] <= error) | (np.maximum(cells.width, cells.height) == 1)
        split = tested & ~passed
        leaves.append(cells[~split])
        states.append(tested[~split])
        cells = _halved(cells[split], worst[split], largest[split])
    return Tree(_together(leaves), np.concatenate(states))


def _first(samples: Samples) -> Cells:
    """The cells between the points of the first round whose corners are known."""
    plan = samples.plan
    step = plan.finest // (plan.start - 1)
    at = np.indices((plan.combinations, plan.start - 1, plan.start - 1)).reshape(3, -1).astype(np.int64)
    count = at.shape[1]
    size = np.full(count, step, dtype=np.int64)
    unknown = np.full((count, 2, len(plan.results)), np.inf)
    cells = Cells(at[0], at[1] * step, at[2] * step, size, size, unknown, np.full(count, np.inf))
    known = np.logical_and.reduce([samples.known[place] for place in cells.corners()])
    return cells[known]


def _tested(samples: Samples, cells: Cells) -> Bools:
    """Whether every midpoint that a cell can have is known."""
    known = [
        (size == 1) | samples.known[place]
        for axis, size in enumerate((cells.width, cells.height))
        for place in cells.middles(axis)
    ]
    return np.asarray(np.logical_and.reduce(known))


def _differences(samples: Samples, scales: Floats, cells: Cells) -> tuple[Floats, Floats]:
    """Differences, shape (cells, 2, results), and the largest that points make smaller, shape (cells, 2).

    The second is 0 along an axis of the finest width.
    """
    found, worst = cells.difference.copy(), np.zeros((len(cells), 2))
    low_low, high_low, low_high, high_high = cells.corners()
    ends = ((low_low, high_low), (low_high, high_high)), ((low_low, low_high), (high_low, high_high))
    for axis, size in enumerate((cells.width, cells.height)):
        here = size > 1
        places = cells.middles(axis)
        both = [_difference(samples, scales, *pair, middle) for pair, middle in zip(ends[axis], places, strict=True)]
        found[here, axis] = np.maximum(both[0][0], both[1][0])[here]
        worst[here, axis] = np.maximum(both[0][1], both[1][1])[here]
    return found, worst


def _difference(
    samples: Samples,
    scales: Floats,
    start: tuple[Ints, Ints, Ints],
    end: tuple[Ints, Ints, Ints],
    middle: tuple[Ints, Ints, Ints],
) -> tuple[Floats, Floats]:
    """The difference of edges, shape (cells, results), and its largest that more points make smaller, (cells,)."""
    left, centre, right = samples.values[start], samples.values[middle], samples.values[end]
    raw = np.abs(centre - 0.5 * (left + right)) / scales[start[0]]
    width = np.maximum.reduce([samples.widths[place] for place in (start, middle, end)])
    irregular = np.logical_and.reduce([samples.irregular[place] for place in (start, middle, end)])
    # As on curves: a mean stops within two half widths, an extreme of irregular motion at once.
    scatter = np.where(samples.has_width, raw * scales[start[0]] <= 2.0 * width, irregular[:, None])
    less = np.where(scatter, np.minimum(raw, samples.plan.error), raw)
    nowhere = ~np.isfinite(left) & ~np.isfinite(centre) & ~np.isfinite(right)
    less = np.where(nowhere, 0.0, np.where(np.isfinite(less), less, np.inf))
    return np.where(np.isfinite(raw), raw, np.inf), less.max(axis=1)


def misses(samples: Samples, scales: Floats, cells: Cells) -> tuple[Floats, Floats]:
    """How far included points are from the surface over each cell: (cells, results), and the largest that more points
    make smaller, (cells,); as of `Samples.misses`, 0 without such points.
    """
    plan = samples.plan
    raw, worst = np.zeros((len(cells), len(plan.results))), np.zeros(len(cells))
    if not plan.included_points:
        return raw, worst
    at = np.nonzero(samples.known)
    named = [np.isin(own, axis.included(plan.finest)) for own, axis in zip(at[1:], plan.adaptive, strict=True)]
    at = tuple(own[np.logical_or.reduce(named)] for own in at)
    steps = [
        (axis.at(own, plan.finest) - axis.low) / (axis.high - axis.low) * plan.finest
        for own, axis in zip(at[1:], plan.adaptive, strict=True)
    ]
    left, lower, right, upper = cells.bounds().T[:, :, None]
    inside = (cells.map[:, None] == at[0]) & (left <= steps[0]) & (steps[0] <= right)
    cell, point = np.nonzero(inside & (lower <= steps[1]) & (steps[1] <= upper))
    if not cell.size:
        return raw, worst
    place = tuple(own[point] for own in at)
    parts = (
        (steps[0][point] - cells.low_x[cell]) / cells.width[cell],
        (steps[1][point] - cells.low_y[cell]) / cells.height[cell],
    )
    expected = surface(stencils(samples, cells), cell, parts[0][:, None], parts[1][:, None])
    beside = np.maximum.reduce([samples.widths[corner] for corner in cells.corners()])[cell]
    own, less = samples.misses(place, expected, scales[place[0]], beside)
    np.maximum.at(raw, cell, own)
    np.maximum.at(worst, cell, less.max(axis=1))
    return raw, worst


def _halved(cells: Cells, worst: Floats, largest: Floats) -> Cells:
    """Both halves of cells, along the axis of the larger difference; of equal ones, along the longer side."""
    equal = worst[:, 0] == worst[:, 1]
    along_y = np.where(equal, cells.width < cells.height, worst[:, 0] < worst[:, 1])
    width, height = np.where(along_y, cells.width, cells.width // 2), np.where(along_y, cells.height // 2, cells.height)
    x, y = cells.low_x + np.where(along_y, 0, width), cells.low_y + np.where(along_y, height, 0)
    first = Cells(cells.map, cells.low_x, cells.low_y, width, height, cells.difference, largest)
    return _together([first, replace(first, low_x=x, low_y=y)])


def _together(parts: list[Cells]) -> Cells:
    return Cells(*(np.concatenate([getattr(part, name) for part in parts]) for name in Cells.__dataclass_fields__))


def stencils(samples: Samples, cells: Cells) -> Floats:
    """Values of cells at three times three places, shape (cells, 3, 3, results).

    A midpoint that is not known lies on the straight line. The centre is that of the surface that the edges span
    (Coons): exact for sums of a function of x and one of y and of their product's bilinear part.
    """
    found = np.empty((len(cells), 3, 3, samples.values.shape[-1]))
    for place, (i, j) in zip(cells.corners(), ((0, 0), (2, 0), (0, 2), (2, 2)), strict=True):
        found[:, i, j] = samples.values[place]
    for axis, size in enumerate((cells.width, cells.height)):
        for place, end in zip(cells.middles(axis), (0, 2), strict=True):
            start, stop = ((0, end), (2, end)) if axis == 0 else ((end, 0), (end, 2))
            middle = (1, end) if axis == 0 else (end, 1)
            line = 0.5 * (found[:, *start] + found[:, *stop])
            known = (size > 1) & samples.known[place]
            found[:, *middle] = np.where(known[:, None], samples.values[place], line)
    edges = found[:, 0, 1] + found[:, 2, 1] + found[:, 1, 0] + found[:, 1, 2]
    corners = found[:, 0, 0] + found[:, 2, 0] + found[:, 0, 2] + found[:, 2, 2]
    found[:, 1, 1] = 0.5 * edges - 0.25 * corners
    return found


def surface(values: Floats, cell: Ints, x: Floats, y: Floats) -> Floats:
    """The surface over cells at places from 0 to 1 along each, of `stencils`, with or without the axis of results.

    ``x`` and ``y`` have a last axis of length 1 where the stencils have an axis of results.
    """
    places = [own.reshape(cell.shape) for own in (x, y)]
    left, lower = (np.minimum((2.0 * own).astype(np.int64), 1) for own in places)
    u, v = 2.0 * x - left.reshape(x.shape), 2.0 * y - lower.reshape(y.shape)
    below = (1.0 - u) * values[cell, left, lower] + u * values[cell, left + 1, lower]
    above = (1.0 - u) * values[cell, left, lower + 1] + u * values[cell, left + 1, lower + 1]
    return np.asarray((1.0 - v) * below + v * above)
