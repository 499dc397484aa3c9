"""Distributions of a parameter around its nominal value, as quantile functions of numbers between 0 and 1.

The formulas are those of Johnson, Kotz and Balakrishnan, Continuous Univariate Distributions, 2nd edition, 1994 and
1995; docs/tolerances.md lists them. A distribution that reaches beyond the range of its parameter is conditioned on
that range: the part inside keeps its shape and is scaled up to probability 1. Nothing is moved to the bounds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, Literal

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    Floats = NDArray[np.float64]

Kind = Literal["normal", "truncated_normal", "lognormal", "uniform", "triangular", "values"]

#: ``plus_minus`` of a normal distribution, in standard deviations.
SIGMAS: Final = 3.0
#: Numbers between 0 and 1 stay this far from both: the quantile of a normal distribution is infinite there.
_INSIDE: Final = 2.0**-53
#: Least standard deviation, so that nothing is divided by 0.
_LEAST: Final = 1e-300


@dataclass(frozen=True)
class Distribution:
    """A distribution and the range that it is conditioned on.

    Attributes
    ----------
    kind : str
        "normal" and "truncated_normal" have the standard deviation ``half / 3``, the latter only ``centre - half`` to
        ``centre + half``; the logarithm of "lognormal" is normal with the mean ``log(centre)`` and the standard
        deviation ``log(1 + half / centre) / 3``; "uniform" and "triangular" reach from ``centre - half`` to ``centre +
        half``; "values" is any of the ``values``, each equally probable.
    centre, half : float
        ``half`` is positive; ``centre`` is positive for "lognormal".
    values : tuple of float
    low, high : float
        Range of the values.
    """

    kind: Kind
    centre: float = 0.0
    half: float = 1.0
    values: tuple[float, ...] = ()
    low: float = -math.inf
    high: float = math.inf

    @property
    def outside(self) -> float:
        """The probability that the range cuts off, 0 to 1. A "truncated_normal" without its tails is whole."""
        if self.kind == "values":
            return 0.0
        ends = np.array(self._bounds())
        whole = np.array(replace(self, low=-math.inf, high=math.inf)._bounds())
        (below, above), (first, last) = (self._reached(one).tolist() for one in (ends, whole))
        return float(min(max(1.0 - (above - below) / (last - first), 0.0), 1.0))

    def quantile(self, unit: Floats) -> Floats:
        """Values at numbers between 0 and 1: of independent uniform numbers, independent draws; any shape."""
        inside = np.clip(unit, _INSIDE, 1.0 - _INSIDE)
        if self.kind == "values":
            ascending = np.sort(np.array(self.values, dtype=np.float64))
            return ascending[np.minimum((inside * ascending.size).astype(np.int64), ascending.size - 1)]
        low, high = self._bounds()
        below, above = self._reached(np.array([low, high]))
        # The clip only undoes rounding: no probability lies outside.
        return np.clip(self._inverse(below + inside * (above - below)), low, high)

    def _bounds(self) -> tuple[float, float]:
        """The range of the values with the ends of the distribution itself."""
        if self.kind in {"normal", "lognormal"}:
            return self.low, self.high
        return max(self.low, self.centre - self.half), min(self.high, self.centre + self.half)

    def _reached(self, values: Floats) -> Floats:
        """The distribution function, that of the normal one for the truncated one."""
        from scipy.special import ndtr

        # Bounds may be infinite, or very far away.
        with np.errstate(divide="ignore", over="ignore"):
            if self.kind in {"normal", "truncated_normal"}:
                return np.asarray(ndtr((values - self.centre) / self._sigma))
            if self.kind == "lognormal":
                logarithm = np.log(np.maximum(values, 0.0))
                return np.asarray(ndtr((logarithm - math.log(self.centre)) / self._sigma))
            place = np.clip((values - self.centre) / self.half, -1.0, 1.0)
        if self.kind == "uniform":
            return (1.0 + place) / 2.0
        return np.where(place < 0.0, (1.0 + place) ** 2 / 2.0, 1.0 - (1.0 - place) ** 2 / 2.0)

    def _inverse(self, share: Floats) -> Floats:
        from scipy.special import ndtri

        if self.kind in {"normal", "truncated_normal"}:
            return np.asarray(self.centre + self._sigma * ndtri(share))
        if self.kind == "lognormal":
            return np.asarray(self.centre * np.exp(self._sigma * ndtri(share)))
        if self.kind == "uniform":
            return self.centre + self.half * (2.0 * share - 1.0)
        lower = np.sqrt(2.0 * np.minimum(share, 0.5)) - 1.0
        upper = 1.0 - np.sqrt(2.0 * np.minimum(1.0 - share, 0.5))
        return self.centre + self.half * np.where(share < 0.5, lower, upper)

    @property
    def _sigma(self) -> float:
        relative = math.log1p(self.half / self.centre) if self.kind == "lognormal" else self.half
        return max(relative / SIGMAS, _LEAST)
