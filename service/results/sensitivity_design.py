"""Which method of variance decomposition the cases of a study allow: sample, complete grid, or none."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

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
    """Ranks of each column from -1 to 1, equal for equal values, shape (cases, axes)."""
    from scipy.stats import rankdata

    return np.asarray(2.0 * (rankdata(columns, axis=0) - 1.0) / max(len(columns) - 1, 1) - 1.0)
