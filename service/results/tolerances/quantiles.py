"""Quantiles and proportions of a sample of drives with 95 % intervals.

The interval of a quantile lies between two order statistics, whose ranks follow from the binomial distribution whatever
that of the result is (Hahn and Meeker, Statistical Intervals, 1991, section 5.2); that of a proportion is Wilson's
(Journal of the American Statistical Association 22 (1927) 209). Both are for independent draws. Draws that fill the
space more evenly (Sobol, Latin hypercube) miss by less, so that the intervals hold at least as often.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.worker.arrays import Floats, Ints

#: Least probability with which an interval contains the true value.
CONFIDENCE: Final = 0.95


@dataclass(frozen=True, slots=True)
class Quantiles:
    """Quantiles of results at places, each array of shape (quantiles, places); NaN where they are not known.

    An end of an interval is NaN where the drives are too few for it: the 5 % quantile has a lower one from about 70.

    Attributes
    ----------
    values, low, high : the quantiles and the ends of their intervals
    drives : int64 array, shape (places,)
        Drives with the result, over which the quantiles are taken.
    """

    values: Floats
    low: Floats
    high: Floats
    drives: Ints


def quantiles(results: Floats, probabilities: tuple[float, ...]) -> Quantiles:
    """Quantiles of ``results``, shape (places, drives), over the drives that have the result (are not NaN).

    The estimate is median-unbiased (Hyndman and Fan, The American Statistician 50 (1996) 361, definition 8).
    """
    ordered = np.sort(results, axis=1)  # NaN is sorted to the end
    drives = np.isfinite(results).sum(axis=1)
    shape = (len(probabilities), len(results))
    values, low, high = (np.full(shape, np.nan) for _ in range(3))
    for count in np.unique(drives[drives > 0]).tolist():
        rows = np.flatnonzero(drives == count)
        values[:, rows] = np.quantile(ordered[rows, :count], probabilities, axis=1, method="median_unbiased")
        for index, probability in enumerate(probabilities):
            first, last = ranks(count, probability)
            if first >= 1:
                low[index, rows] = ordered[rows, first - 1]
            if last <= count:
                high[index, rows] = ordered[rows, last - 1]
    return Quantiles(values, low, high, drives.astype(np.int64))


@lru_cache(maxsize=4096)
def ranks(count: int, probability: float) -> tuple[int, int]:
    """Ranks (from 1) of the order statistics between which the quantile lies with at least `CONFIDENCE`.

    0 and ``count`` + 1 stand for no end. Of the pairs near equal tails, that with the least probability is taken.
    """
    from scipy.stats import binom

    tail = (1.0 - CONFIDENCE) / 2.0
    first, last = int(binom.ppf(tail, count, probability)), int(binom.ppf(1.0 - tail, count, probability)) + 1
    pairs = [(first + i, last - j) for i in range(3) for j in range(3) if first + i < last - j]
    # The quantile is at least the order statistic of rank r if no fewer than r drives are below it.
    held = {pair: float(binom.cdf(pair[1] - 1, count, probability) - binom.cdf(pair[0] - 1, count, probability))
            for pair in pairs}  # fmt: skip
    enough = [pair for pair in pairs if held[pair] >= CONFIDENCE]
    return min(enough, key=lambda pair: held[pair], default=(first, last))


@dataclass(frozen=True, slots=True)
class Proportion:
    """A share of drives with Wilson's interval; arrays of one shape, NaN where there is no drive.

    Attributes
    ----------
    reached, drives : how many drives are counted, of how many
    """

    reached: Ints
    drives: Ints
    value: Floats
    low: Floats
    high: Floats


def proportion(reached: NDArray[np.integer], drives: NDArray[np.integer]) -> Proportion:
    """The share ``reached`` / ``drives`` with its interval, elementwise."""
    from scipy.stats import norm

    z = float(norm.ppf(0.5 + CONFIDENCE / 2.0))
    with np.errstate(invalid="ignore", divide="ignore"):
        n = np.where(drives > 0, drives, np.nan).astype(np.float64)
        share = reached / n
        middle = (share + z * z / (2.0 * n)) / (1.0 + z * z / n)
        half = z * np.sqrt(share * (1.0 - share) / n + z * z / (4.0 * n * n)) / (1.0 + z * z / n)
    low = np.where(reached == 0, 0.0 * n, middle - half)
    high = np.where(reached == drives, 1.0 + 0.0 * n, middle + half)
    return Proportion(
        np.asarray(reached, dtype=np.int64), np.asarray(drives, dtype=np.int64), np.asarray(share), low, high
    )
