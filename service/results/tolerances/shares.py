"""Shares of the variance over drives by tolerance, from the sample of drives itself.

The share of a tolerance is the first-order Sobol index, Var(E[y | x]) / Var(y). The conditional mean is fitted by a
straight line and cosines of the rank of x (COSI: Plischke, Environmental Modelling & Software 35 (2012) 10), or taken
for each value of an x that has a few only, and the share is corrected for the degrees of freedom as an adjusted
coefficient of determination is. The interval follows from the influence function of that index (Da Veiga and Gamboa,
Journal of Nonparametric Statistics 25 (2013) 573). For several columns of y the share is that of the sum of their
variances (Lamboni et al., Reliability Engineering & System Safety 96 (2011) 450).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from sprag_study.worker.arrays import Floats

#: Fewest drives from which shares are estimated.
LEAST_DRIVES: Final = 64
#: Cosines with which a conditional mean is fitted.
HARMONICS: Final = 6
#: Most different values of a tolerance that count as groups.
_GROUPS: Final = 12
#: Variances below this part of the square of the mean are rounding errors.
_ROUNDING: Final = 1e-26


@dataclass(frozen=True, slots=True)
class Share:
    """A share of the variance, and the half width of its 95 % interval."""

    value: float
    error: float


def shares(draws: Floats, y: Floats) -> list[Share] | None:
    """The share of each tolerance.

    Parameters
    ----------
    draws : array, shape (drives, tolerances)
        Independent of each other.
    y : array, shape (drives, columns)
        What is explained, finite.

    Returns
    -------
    list of Share, one for each tolerance; None where there are too few drives, or where ``y`` does not vary
    """
    count = len(y)
    if count < LEAST_DRIVES:
        return None
    centred = y - y.mean(axis=0)
    variance = float((centred**2).mean(axis=0).sum())
    if variance <= _ROUNDING * float((y**2).mean(axis=0).sum()):
        return None
    return [_share(column, centred, variance) for column in draws.T]


def _share(x: Floats, y: Floats, variance: float) -> Share:
    basis = _basis(x)
    count, functions = basis.shape
    if not functions:
        return Share(0.0, 0.0)
    coefficients, *_ = np.linalg.lstsq(basis, y, rcond=None)
    fitted = basis @ coefficients
    explained = float((fitted**2).mean(axis=0).sum()) / variance
    value = 1.0 - (1.0 - explained) * (count - 1.0) / (count - 1.0 - functions)
    influence = (2.0 * y * fitted - fitted**2 - explained * y**2).sum(axis=1) / variance
    # Where nothing depends on x the influence vanishes; the fit of noise remains.
    noise = math.sqrt(2.0 * functions) / count * (1.0 - min(max(value, 0.0), 1.0))
    return Share(value, 1.96 * math.hypot(float(influence.std()) / math.sqrt(count), noise))


def _basis(x: Floats) -> Floats:
    """Functions of x with mean 0 over the drives, shape (drives, functions)."""
    different, group = np.unique(x, return_inverse=True)
    count = len(x)
    if different.size <= min(_GROUPS, count // 8):
        functions = (group.reshape(-1)[:, None] == np.arange(different.size - 1)).astype(np.float64)
        return np.asarray(functions - functions.mean(axis=0))
    rank = np.empty(count)
    rank[np.argsort(x, kind="stable")] = (np.arange(count) + 0.5) / count
    cosines = np.cos(math.pi * np.arange(1, HARMONICS + 1) * rank[:, None])
    # Tails of a normal distribution need many cosines; the results of small deviations are nearly linear.
    return np.column_stack([(x - x.mean()) / x.std(), cosines])
