"""What the residuals of a fit say: whether it misses the points by more than chance, and what would explain that."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, Literal

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker.planning.calibrate.candidates import along, groups

if TYPE_CHECKING:
    from sprag_study.worker.planning.calibrate.plan import CalibratePlan

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Probability below which a test is taken as no chance.
CHANCE: Final = 0.05
#: Sum of the squares of residuals, in standard deviations, below which they are rounding.
_ROUNDING: Final = 1e-6
#: Values of a result that an offset needs.
_LEAST_VALUES: Final = 3
#: Part of an offset that the parameters leave, squared, below which they imitate it.
_IMITATED: Final = 1e-6


@dataclass(frozen=True)
class FitTest:
    """A test for lack of fit of one result.

    Attributes
    ----------
    column : int
        Position of the result.
    test : {"pure error", "runs"}
    statistic : float
        F, the mean square of the lack of fit by that of the pure error; or the number of runs.
    freedom : tuple of float
        Degrees of freedom of lack of fit and pure error; or how many residuals are positive and negative.
    p : float
        Probability of as large an F, or as few runs, where the model is right, times the number of tests (Bonferroni).
    """

    column: int
    test: Literal["pure error", "runs"]
    statistic: float
    freedom: tuple[float, float]
    p: float


@dataclass(frozen=True)
class FarValue:
    """The measured value that is farthest off what the others say.

    Attributes
    ----------
    place : int
        Position among the measured values.
    deleted : float
        Externally studentised residual: by the scatter without this value.
    cook : float
        Cook's distance: how far the value moves the fit.
    p : float
        Probability of as large a residual anywhere, where all values scatter alike (Bonferroni).
    """

    place: int
    deleted: float
    cook: float
    p: float


@dataclass(frozen=True)
class Offset:
    """What an offset of a result, as a further unknown, would do to a fit, linearised.

    Attributes
    ----------
    column : int
        Position of the result.
    value, deviation : float
        The offset and its standard deviation, SI.
    p : float
        Probability of as large an offset where there is none, times the number of results (Bonferroni).
    share : float
        Part of the sum of the squares of the residuals that it takes, 0 to 1.
    rest : float
        Probability of the residuals that it leaves, where the model is right; 1 where no test is possible.
    """

    column: int
    value: float
    deviation: float
    p: float
    share: float
    rest: float


def lack_of_fit(plan: CalibratePlan, residuals: Floats, sigma: Floats, leverages: Floats) -> FitTest | None:
    """The test of the result that fits worst; None where no result has points enough.

    Where conditions are repeated, and the loss is linear, the scatter of the repeats is the measure (N. R. Draper,
    H. Smith, Applied Regression Analysis, 3rd ed. 1998, 2.1). Otherwise the runs of the signs of the residuals count,
    in the order of the conditions (A. Wald, J. Wolfowitz 1940): a model that lacks something leaves few long ones.

    Parameters
    ----------
    plan : CalibratePlan
    residuals, sigma, leverages : float64 arrays, shape (measured,)
        Residuals in standard deviations, NaN where a case has failed; the standard deviations, SI.
    """
    tests = []
    for column in range(len(plan.measured)):
        rows = np.flatnonzero((plan.places[1] == column) & np.isfinite(residuals))
        if not len(rows) or float(np.sum(residuals[rows] ** 2)) < _ROUNDING:
            continue
        test = _pure_error(plan, column, rows, (residuals[rows], sigma[rows], leverages[rows]))
        test = test or _runs(column, residuals[_in_order(plan, rows)])
        tests += [test] if test else []
    if not tests:
        return None
    worst = min(tests, key=lambda one: one.p)
    return replace(worst, p=min(1.0, worst.p * len(tests)))


def _pure_error(plan: CalibratePlan, column: int, rows: Ints, of_rows: tuple[Floats, Floats, Floats]) -> FitTest | None:
    """The F test of one result; the parameters take as many degrees of freedom from it as its leverages add up to."""
    from scipy.special import fdtrc  # takes as long to load as all of the service's own code

    residuals, sigma, leverages = of_rows
    values, which = plan.values[rows], np.unique(plan.places[0][rows], return_inverse=True)[1]
    weights = 1.0 / sigma**2
    means = np.bincount(which, weights * values) / np.bincount(which, weights)
    squares, every = float(np.sum(weights * (values - means[which]) ** 2)), float(np.sum(residuals**2))
    levels = int(which.max()) + 1
    lack, pure = levels - float(leverages.sum()), float(len(rows) - levels)
    if plan.loss != "linear" or pure < 1.0 or lack < 0.5 or squares < _ROUNDING * every:
        return None
    ratio = max(every - squares, 0.0) / lack / (squares / pure)
    return FitTest(column, "pure error", ratio, (lack, pure), float(fdtrc(lack, pure, ratio)))


def _in_order(plan: CalibratePlan, rows: Ints) -> Ints:
    """Measured values of one result, curve after curve, ascending along each."""
    conditions, x = plan.places[0][rows], along(plan)
    if x is None:
        return rows
    order: Ints = rows[np.lexsort((plan.at[conditions, x], groups(plan)[1][conditions]))]
    return order


def _runs(column: int, residuals: Floats) -> FitTest | None:
    """The runs test; where nearly all residuals have one sign, both signs have equal chances at each value."""
    positive = residuals[residuals != 0.0] > 0.0
    plus, minus = int(positive.sum()), int((~positive).sum())
    runs = 1 + int(np.count_nonzero(positive[1:] != positive[:-1]))
    if min(plus, minus) and fewer_runs(2, plus, minus) <= CHANCE:
        p = fewer_runs(runs, plus, minus)
    elif 0.5 ** (plus + minus - 1) <= CHANCE:
        p = sum(math.comb(plus + minus - 1, changes) for changes in range(runs)) / 2 ** (plus + minus - 1)
    else:
        return None
    return FitTest(column, "runs", float(runs), (float(plus), float(minus)), p)


def fewer_runs(runs: int, plus: int, minus: int) -> float:
    """The probability of at most so many runs where ``plus`` and ``minus`` signs follow each other in any order."""
    ways, comb = 0, math.comb
    for count in range(2, runs + 1):
        half = count // 2
        if count % 2:
            ways += comb(plus - 1, half) * comb(minus - 1, half - 1) + comb(plus - 1, half - 1) * comb(minus - 1, half)
        else:
            ways += 2 * comb(plus - 1, half - 1) * comb(minus - 1, half - 1)
    return ways / comb(plus + minus, plus)


def far_value(plan: CalibratePlan, residuals: Floats, leverages: Floats) -> FarValue | None:
    """The value with the largest deleted residual, by the t test of an outlier (S. Weisberg 1985, 5.3).

    Each result has a scatter of its own, from its residuals. None with another loss than the linear one, for which
    outliers count less already, and where no value is left to compare with.

    Parameters
    ----------
    plan : CalibratePlan
    residuals, leverages : float64 arrays, shape (measured,)
    """
    from scipy.special import stdtr

    if plan.loss != "linear":
        return None
    worst, tests = FarValue(-1, 0.0, 0.0, 2.0), 0
    for column in range(len(plan.measured)):
        rows = np.flatnonzero((plan.places[1] == column) & np.isfinite(residuals) & (leverages < 1.0 - 1e-9))
        own, leverage = residuals[rows], leverages[rows]
        squares, freedom = float(np.sum(own**2)), len(rows) - float(leverage.sum())
        if freedom < 2.0 or squares < _ROUNDING:
            continue
        tests += len(rows)
        standard = own / np.sqrt(squares / freedom * (1.0 - leverage))
        deleted = standard * np.sqrt((freedom - 1.0) / np.maximum(freedom - standard**2, 1e-12))
        at = int(np.abs(deleted).argmax())
        p = 2.0 * float(stdtr(freedom - 1.0, -abs(deleted[at])))
        if p < worst.p:
            cook = standard[at] ** 2 * leverage[at] / (1.0 - leverage[at]) / len(plan.fitted)
            worst = FarValue(int(rows[at]), float(deleted[at]), float(cook), p)
    return None if worst.place < 0 else replace(worst, p=min(1.0, worst.p * tests))


def offsets(
    plan: CalibratePlan, residuals: Floats, sigma: Floats, leverages: Floats, derivatives: Floats
) -> list[Offset]:
    """What an offset of each result would do, as a variable that is added to a linear regression.

    The residuals fall by their part along the offset, from which the parameters have taken what they can imitate.
    None with another loss than the linear one.

    Parameters
    ----------
    plan : CalibratePlan
    residuals, sigma, leverages : float64 arrays, shape (values,)
        Of the measured values, then of priors.
    derivatives : float64 array, shape (values, parameters)
        Of the modelled values, by the parameters.
    """
    from scipy.special import chdtrc, fdtrc

    known = np.isfinite(residuals)
    rest, freedom = np.where(known, residuals, 0.0), plan.freedom - int((~known).sum())
    if plan.loss != "linear" or freedom < 2 or float(rest @ rest) < _ROUNDING:
        return []
    weights = np.where(known, 1.0 / np.where(known, sigma, 1.0), 0.0)
    basis = np.linalg.svd(derivatives * weights[:, None], full_matrices=False)
    vectors = basis[0][:, basis[1] > 1e-10 * max(float(basis[1].max(initial=0.0)), 1e-300)]
    rest = rest - vectors @ (vectors.T @ rest)  # with an offset, parameters at the ends of their ranges may leave them
    squares = float(rest @ rest)
    results: list[Offset] = []
    for column in range(len(plan.measured)):
        rows, shift = np.flatnonzero(plan.places[1] == column), np.zeros_like(weights)
        shift[rows] = weights[rows]
        apart = shift - vectors @ (vectors.T @ shift)
        size = float(apart @ apart)
        if np.count_nonzero(shift) < _LEAST_VALUES or size < _IMITATED * float(shift @ shift):
            continue
        value = float(apart @ rest) / size
        left, fall = rest - value * apart, value * value * size
        scatter = 1.0 if plan.known_sigma else max((squares - fall) / (freedom - 1), 1e-300)
        p = float(chdtrc(1, fall) if plan.known_sigma else fdtrc(1, freedom - 1, fall / scatter))
        if plan.known_sigma:
            after = float(chdtrc(freedom - 1, max(squares - fall, 0.0)))
        else:
            left, leverage = np.where(known, left, np.nan), np.minimum(leverages + apart**2 / size, 1.0)
            test = lack_of_fit(plan, left[: plan.count], sigma[: plan.count], leverage[: plan.count])
            after = 1.0 if test is None else test.p
        p, share = min(1.0, p * len(plan.measured)), float(fall / squares)
        results.append(Offset(column, value, math.sqrt(scatter / size), p, share, after))
    return results
