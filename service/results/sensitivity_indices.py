"""Which variance decomposition the cases of a study allow, and its indices: Sobol indices, elementary effects."""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag_study.sentences import Name
from sprag_study.service.reading.reader import Phrase

if TYPE_CHECKING:
    from sprag_study.worker.arrays import Bools, Floats

#: Least share of cases with a unique value on an axis whose values were drawn.
_LEAST_DISTINCT: Final = 0.95
#: Largest rank correlation of two columns of a sample: absolute, and in standard deviations of the correlation of
#: independent columns, 1 / sqrt(cases - 1).
_MOST_CORRELATED: Final = 0.45
_CHANCE: Final = 4.5
#: Rank correlation from which two axes count as varied together.
_TOGETHER: Final = 0.99
#: A grid with a larger share of missing points is not called a grid.
_LEAST_GRID: Final = 0.1


def scattered(column: Floats) -> bool:
    """Whether nearly every case has a unique value in ``column``, shape (cases,)."""
    return bool(np.unique(column).size >= _LEAST_DISTINCT * column.size)


def is_sample(columns: Floats) -> bool:
    """Whether ``columns``, shape (cases, axes), look like points drawn at random, independently for each axis.

    Nearly all values of an axis must differ, and no axis may correlate with another, neither in its value nor in its
    distance from the middle. The actual cases decide, not their design: failed cases can bias a sample.
    """
    cases, axes = columns.shape
    if not all(scattered(columns[:, axis]) for axis in range(axes)):
        return False
    if axes < 2:
        return True
    if cases < 3:
        return False
    ranks = _ranks(columns)
    features = np.concatenate([ranks, np.abs(ranks)], axis=1)
    correlations = np.abs(np.corrcoef(features, rowvar=False))
    own = np.arange(2 * axes) % axes
    apart = own[:, None] != own[None, :]
    return bool(correlations[apart].max() <= min(_MOST_CORRELATED, _CHANCE / math.sqrt(cases - 1)))


def is_factorial(columns: Floats) -> bool:
    """Whether ``columns``, shape (cases, axes), contain every combination of their values exactly once."""
    found = math.prod(np.unique(column).size for column in columns.T)
    return found == len(columns) == len(np.unique(columns, axis=0))


def factorial_table(columns: Floats, y: Floats) -> Floats:
    """``y`` of the cases of `is_factorial` columns as an array with one dimension per axis, values ascending."""
    shape = tuple(np.unique(column).size for column in columns.T)
    return y[np.lexsort(columns.T[::-1])].reshape(shape)


def going_together(columns: Floats) -> tuple[int, int] | None:
    """Two axes whose orders determine each other, such as those of a zip; None when there are none."""
    if len(columns) < 2 or columns.shape[1] < 2:
        return None
    with np.errstate(invalid="ignore", divide="ignore"):  # an axis of one value
        shared = np.abs(np.corrcoef(_ranks(columns), rowvar=False))
    pairs = np.argwhere(np.triu(shared, 1) >= _TOGETHER).tolist()
    return (pairs[0][0], pairs[0][1]) if pairs else None


def why_no_shares(columns: Floats, known: Bools, names: list[str]) -> str:
    """The sentence about cases that are neither a sample nor a complete grid; ``known`` marks those with the result.

    ``columns`` has shape (cases, axes), over all cases; ``names`` are those of the axes.
    """
    tied = going_together(columns)
    if tied is not None:
        first, second = (names[at] for at in tied)
        return Phrase(
            "{first} and {second} were varied together: the cases cannot separate their effects",
            first=Name(first),
            second=Name(second),
        )
    points, cases = math.prod(np.unique(column).size for column in columns.T), int(known.sum())
    if all(scattered(column) for column in columns[known].T):
        return Phrase(
            "the cases are neither a complete grid nor a sample: their axes are not independent of each other; main "
            "effects are means over the available cases"
        )
    if cases < points and cases >= _LEAST_GRID * points:
        return Phrase(
            "the cases are neither a complete grid nor a sample: {count} of {total} are missing; main effects are "
            "means over the available cases",
            count=points - cases,
            total=points,
        )
    return Phrase("the cases are neither a complete grid nor a sample; main effects are means over the available cases")


def _ranks(columns: Floats) -> Floats:
    """Ranks of each column from -1 to 1, equal for equal values, shape (cases, axes); NaN for a column with a NaN.

    `scipy.stats.rankdata` gives the same, and takes a second to be imported.
    """
    ranks = np.empty(columns.shape)
    for axis, column in enumerate(columns.T):
        _, place, count = np.unique(column, return_inverse=True, return_counts=True)
        ranks[:, axis] = (np.cumsum(count) - (count - 1) / 2.0)[place]
        if np.isnan(column).any():
            ranks[:, axis] = np.nan
    return 2.0 * (ranks - 1.0) / max(len(columns) - 1, 1) - 1.0


#: Fewest cases from which indices are estimated.
LEAST_CASES: Final = 65
#: Fewest trajectories from which elementary effects are reported: their interval is a bootstrap of them.
LEAST_TRAJECTORIES: Final = 4
_SEED: Final = 1


@dataclass(frozen=True, slots=True)
class Indices:
    """The indices of one axis, None where the method does not give them; errors are half widths of 95 % intervals.

    ``mu``, ``mu_star`` and ``sigma`` are mean, mean of the absolute values and standard deviation of the elementary
    effects, in the unit of the result for the whole range of the axis.
    """

    first_order: float | None = None
    first_order_error: float | None = None
    total: float | None = None
    total_error: float | None = None
    mu: float | None = None
    mu_star: float | None = None
    mu_star_error: float | None = None
    sigma: float | None = None


@dataclass(frozen=True, slots=True)
class Pair:
    """The second-order index of two axes, by position: the share of the variance by their interaction alone."""

    first: int
    second: int
    index: float | None
    error: float | None


IndicesAndPairs = tuple[list[Indices], list[Pair]]


def nothing(axes: int) -> IndicesAndPairs:
    """No indices at all."""
    return [Indices()] * axes, []


def grid_indices(table: Floats, positions: list[int]) -> IndicesAndPairs:
    """Exact shares of the variance over the points of a full grid, all with equal weight."""
    variance = float(table.var())
    if not variance > 0.0:
        return nothing(len(positions))
    every = tuple(range(table.ndim))

    def explained(*axes: int) -> float:
        others = tuple(axis for axis in every if axis not in axes)
        return (float(table.mean(axis=others).var()) if others else variance) / variance

    first = {axis: explained(axis) for axis in positions}
    found = [Indices(first[axis], None, float(table.var(axis=axis).mean()) / variance) for axis in positions]
    pairs = [
        Pair(i, j, explained(a, b) - first[a] - first[b], None)
        for (i, a), (j, b) in itertools.combinations(enumerate(positions), 2)
    ]
    return found, pairs


def saltelli_indices(y: Floats, base: int, dimensions: int, notes: list[str], *, second_order: bool) -> IndicesAndPairs:
    """SALib's estimates; a point with any missing case is left out with all its cases."""
    from SALib.analyze import sobol

    cases = 2 * dimensions + 2 if second_order else dimensions + 2
    blocks = y.reshape(base, cases)
    whole = _whole(blocks, notes)
    if whole.sum() * cases < LEAST_CASES:
        notes.append(Phrase("too few cases for indices"))
        return nothing(dimensions)
    with _quiet():
        found = sobol.analyze(
            _problem(dimensions), blocks[whole].reshape(-1), calc_second_order=second_order, seed=_SEED
        )
    names = {"first_order": "S1", "first_order_error": "S1_conf", "total": "ST", "total_error": "ST_conf"}
    indices = [Indices(**{name: _finite(found[key][i]) for name, key in names.items()}) for i in range(dimensions)]
    pairs = [
        Pair(i, j, _finite(found["S2"][i, j]), _finite(found["S2_conf"][i, j]))
        for i, j in (itertools.combinations(range(dimensions), 2) if second_order else ())
    ]
    return indices, pairs


def morris_indices(x: Floats, y: Floats, levels: int, notes: list[str]) -> IndicesAndPairs:
    """SALib's elementary effects; a trajectory with any missing case is left out. ``x`` has the shape (cases, axes)."""
    from SALib.analyze import morris

    dimensions = x.shape[1]
    blocks = y.reshape(-1, dimensions + 1)
    whole = _whole(blocks, notes, trajectories=True)
    if whole.sum() < LEAST_TRAJECTORIES:
        notes.append(
            Phrase(
                "too few trajectories: {count}, and {least} are needed",
                count=int(whole.sum()),
                least=LEAST_TRAJECTORIES,
            )
        )
        return nothing(dimensions)
    places = x.reshape(*blocks.shape, dimensions)[whole].reshape(-1, dimensions)
    with _quiet():
        found = morris.analyze(
            _problem(dimensions), places, blocks[whole].reshape(-1), num_levels=levels, num_resamples=1000, seed=_SEED
        )
    names = {"mu": "mu", "mu_star": "mu_star", "mu_star_error": "mu_star_conf", "sigma": "sigma"}
    return [Indices(**{name: _finite(found[key][i]) for name, key in names.items()}) for i in range(dimensions)], []


def sample_indices(x: Floats, y: Floats, notes: list[str]) -> IndicesAndPairs:
    """First-order indices from a sample (`is_sample`), by SALib's random balance design."""
    from SALib.analyze import rbd_fast

    notes.append(Phrase("total indices need a full grid or a sample by the method saltelli"))
    with _quiet():
        found = rbd_fast.analyze(_problem(x.shape[1]), x, y, M=max(2, min(10, (len(y) - 1) // 10)), seed=_SEED)
    return [Indices(_finite(found["S1"][i]), _finite(found["S1_conf"][i])) for i in range(x.shape[1])], []


def _whole(blocks: Floats, notes: list[str], *, trajectories: bool = False) -> Bools:
    """Which rows of ``blocks`` have no missing number; others are noted."""
    whole = np.isfinite(blocks).all(axis=1)
    if not whole.all():
        counts = {"count": int((~whole).sum()), "total": len(blocks)}
        notes.append(
            Phrase("{count} of {total} trajectories are left out with all their cases", **counts)
            if trajectories
            else Phrase("{count} of {total} points of the design are left out with all their cases", **counts)
        )
    return np.asarray(whole)


def _problem(dimensions: int) -> dict[str, Any]:
    names = [str(index) for index in range(dimensions)]
    return {"num_vars": dimensions, "names": names, "bounds": [[0.0, 1.0]] * dimensions}


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence SALib's division by a zero variance; such indices are meaningless and become None."""
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        yield


def _finite(value: Any) -> float | None:
    return float(value) if value is not np.ma.masked and math.isfinite(value) else None
