"""What a calibration has found: values, intervals, correlations, what cannot be separated, what to measure next."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker.planning.calibrate.course import ENDED, leverages
from sprag_study.worker.planning.calibrate.fit import quadratic
from sprag_study.worker.planning.calibrate.lack_of_fit import Offset, offsets

if TYPE_CHECKING:
    from sprag_study.worker.planning.calibrate.course import State
    from sprag_study.worker.planning.calibrate.plan import CalibratePlan
    from sprag_study.worker.planning.calibrate.space import Space

Floats = NDArray[np.float64]

#: Ends of the intervals, and the ends of ribbons.
ENDS: Final = (0.025, 0.975)
#: Refits without which no interval is given.
LEAST_REFITS: Final = 20
#: Standard deviation along a direction, in widths of the ranges, from which on the direction is not determined: its
#: interval is then as wide as the ranges.
_UNDETERMINED: Final = 0.25
#: Longest change along a direction that is reported, in widths of the ranges: farther off, it is no straight line.
_STRAIGHT: Final = 0.05
#: Condition index and share of variance from which on parameters are collinear (D. A. Belsley, E. Kuh, R. E. Welsch
#: 1980).
_COLLINEAR, _SHARE = 30.0, 0.5
#: Part of the largest change below which a parameter has no part in a direction.
_PART = 0.05
#: How close to an end of its range an interval has to come to touch it, in widths of the range.
_TOUCHES = 0.005


@dataclass(frozen=True)
class Direction:
    """Parameters that change together without a change of the modelled values.

    Attributes
    ----------
    parameters : tuple of int
        Positions of the unknown parameters, the largest change first.
    changes : tuple of float
        Their changes, SI, for one standard deviation along the direction; along one that is not determined, for a
        twentieth of the ranges.
    undetermined : bool
        Whether the data say nothing about it within the ranges; otherwise it is only known badly.
    """

    parameters: tuple[int, ...]
    changes: tuple[float, ...]
    undetermined: bool


@dataclass(frozen=True)
class NextPoint:
    """The condition whose measurement would say most.

    Attributes
    ----------
    condition : tuple of float
    again : bool
        Whether it was measured before.
    spread : tuple of float
        Standard deviation of each modelled result there, SI.
    narrower : tuple of float
        By how much the standard deviation of each parameter would shrink, from 0 to 1.
    """

    condition: tuple[float, ...]
    again: bool
    spread: tuple[float, ...]
    narrower: tuple[float, ...]


@dataclass(frozen=True)
class Answer:
    """A calibration, as far as it has come; arrays of n measured values and p numbers that are fitted.

    Attributes
    ----------
    complete : bool
        Whether fit, refits and curve are all there.
    values : float64 array, shape (p,), SI
    intervals : float64 array, shape (p, 2), or None
        Ends of the 95 % intervals, SI; the whole range of what has a part in an undetermined direction.
    at_bounds : bool array, shape (p, 2), or None
        Whether an interval touches the lower, the upper end of the range.
    deviations : float64 array, shape (p,), or None
        Standard deviations over the refits, SI.
    correlations : float64 array, shape (p, p), or None
    modelled, sigma, residuals, leverages : float64 arrays, shape (n,)
        Modelled values and standard deviations, SI; residuals, measured less modelled, in standard deviations.
    failed : bool array, shape (n,)
        Where the fitted case has no result.
    chi_square : float
        Priors included, as in the degrees of freedom.
    freedom : int
    refits : int
    directions : list of Direction
    next : NextPoint, optional
    others, curve, ribbon : arrays, optional
        Conditions of the fitted curve (others, conditions), the results there (others, results), and their ends
        (others, results, 2).
    ribbon_measured : array, shape (n, 2), optional
        The same at the measured values.
    offsets : list of Offset
        What an offset of each result would do.
    """

    complete: bool
    values: Floats
    intervals: Floats | None
    at_bounds: NDArray[np.bool_] | None
    deviations: Floats | None
    correlations: Floats | None
    modelled: Floats
    sigma: Floats
    residuals: Floats
    leverages: Floats
    failed: NDArray[np.bool_]
    chi_square: float
    freedom: int
    refits: int
    directions: list[Direction]
    next: NextPoint | None
    others: Floats | None
    curve: Floats | None
    ribbon: Floats | None
    ribbon_measured: Floats | None
    offsets: list[Offset] = field(default_factory=list)


def answer(plan: CalibratePlan, space: Space, state: State) -> Answer | None:
    """What the rows show that a planner was given; None before the first fit has ended."""
    best = state.best
    if best is None:
        return None
    data, failed, measured = state.data, np.isnan(best.modelled[0]), slice(plan.count)
    sigma = np.where(data.weights > 0.0, 1.0 / np.where(data.weights > 0.0, data.weights, 1.0), np.nan)
    residuals = np.where(failed, np.nan, -data.residuals(best.modelled)[0])
    places = None if state.refits is None else state.refits.places
    enough = places is not None and len(places) >= LEAST_REFITS
    values = space.values(places) if enough and places is not None else None
    squares = np.where(failed, 0.0, residuals) ** 2
    directions, leverage = _directions(space, state), leverages(data, best)
    loose = sorted({place for one in directions if one.undetermined for place in one.parameters})
    around = _likely(plan, state)
    intervals = None if values is None else _wider(_ends(values), space.values(around))
    at_bounds = None if places is None or values is None else _touching(_wider(_ends(places), around))
    if intervals is not None and at_bounds is not None:
        # Refits stay where they began along a direction that the data do not determine.
        for place in loose:
            intervals[place] = plan.fitted[place].low, plan.fitted[place].high
            at_bounds[place] = True
    return Answer(
        complete=state.phase == ENDED,
        values=space.values(best.places[0]),
        intervals=intervals,
        at_bounds=at_bounds,
        deviations=None if values is None else values.std(axis=0, ddof=1),
        correlations=None if values is None else _correlations(values),
        modelled=best.modelled[0, measured],
        sigma=sigma[measured],
        residuals=residuals[measured],
        leverages=leverage[measured],
        failed=failed[measured],
        chi_square=float(squares.sum()),
        freedom=plan.freedom - int(failed.sum()),
        refits=0 if places is None else len(places),
        directions=directions,
        next=_next(plan, state, values, sigma[measured]),
        others=state.others if state.curve is not None else None,
        curve=state.curve,
        ribbon=_ribbon(state.curves),
        ribbon_measured=None if state.refits is None or not enough else _ends(state.refits.modelled[:, measured]),
        offsets=offsets(plan, residuals, sigma, leverage, best.derivatives[0]),
    )


def _ends(samples: Floats) -> Floats:
    """Ends of the 95 % intervals of the columns of (samples, ...): shape (..., 2)."""
    ends: Floats = np.moveaxis(np.quantile(samples, ENDS, axis=0, method="weibull"), 0, -1)
    return ends


def _likely(plan: CalibratePlan, state: State) -> Floats:
    """Places of all sets that were run and are within a 95 % interval of the likelihood, shape (sets, p).

    Half the change of chi-square that it allows is added to the least cost: 3.84 for one parameter, or the square of
    Student's t where the standard deviations follow from the residuals. None but the fit with another loss.
    """
    from scipy.special import stdtrit  # takes as long to load as all of the service's own code

    best = state.best
    assert best is not None
    if plan.loss != "linear":
        return best.places
    limit = 1.959964 if plan.known_sigma else float(stdtrit(max(plan.freedom, 1), ENDS[1]))
    places, modelled = (np.concatenate(parts) for parts in zip(*state.library, strict=True))
    near = state.data.costs(modelled) <= best.costs[0] + 0.5 * limit**2
    return np.concatenate([best.places, places[near]])


def _wider(ends: Floats, samples: Floats) -> Floats:
    """Ends, shape (p, 2), widened to all ``samples``, shape (samples, p)."""
    low, high = samples.min(axis=0), samples.max(axis=0)
    return np.stack([np.minimum(ends[:, 0], low), np.maximum(ends[:, 1], high)], axis=1)


def _ribbon(curves: Floats | None) -> Floats | None:
    return None if curves is None or len(curves) < LEAST_REFITS else _ends(curves)


def _touching(ends: Floats) -> NDArray[np.bool_]:
    return np.stack([ends[:, 0] < _TOUCHES, ends[:, 1] > 1.0 - _TOUCHES], axis=1)


def _correlations(values: Floats) -> Floats:
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.atleast_2d(np.corrcoef(values, rowvar=False))


def _directions(space: Space, state: State) -> list[Direction]:
    """Directions that the data do not determine, then those of collinear parameters."""
    best = state.best
    assert best is not None
    curvature = quadratic(state.data, best.modelled, best.derivatives)[1][0]
    slopes = space.slopes(best.places[0])
    eigenvalues, vectors = np.linalg.eigh(curvature)
    found: list[Direction] = []
    for eigenvalue, vector in zip(eigenvalues, vectors.T, strict=True):
        deviation = 1.0 / np.sqrt(max(float(eigenvalue), 1e-300))
        if deviation > _UNDETERMINED:
            found.append(_direction(vector, slopes * vector * _STRAIGHT, undetermined=True))
    return found or _collinear(curvature, slopes)


def _collinear(curvature: Floats, slopes: Floats) -> list[Direction]:
    lengths = np.sqrt(np.diagonal(curvature))
    scaled = curvature / np.outer(lengths, lengths)
    eigenvalues, vectors = np.linalg.eigh(scaled)
    parts = vectors**2 / eigenvalues
    shares = parts / parts.sum(axis=1, keepdims=True)
    found: list[Direction] = []
    for k, eigenvalue in enumerate(eigenvalues):
        together = shares[:, k] > _SHARE
        if np.sqrt(eigenvalues[-1] / eigenvalue) > _COLLINEAR and together.sum() > 1:
            change = np.where(together, vectors[:, k] / lengths, 0.0)
            found.append(_direction(change, slopes * change / np.sqrt(eigenvalue), undetermined=False))
    return found


def _direction(weights: Floats, changes: Floats, *, undetermined: bool) -> Direction:
    size = np.abs(weights)
    parts = [int(j) for j in np.argsort(-size, kind="stable") if size[j] >= _PART * size.max()]
    sign = 1.0 if changes[parts[0]] >= 0.0 else -1.0
    return Direction(tuple(parts), tuple(float(sign * changes[j]) for j in parts), undetermined)


def _next(plan: CalibratePlan, state: State, values: Floats | None, sigma: Floats) -> NextPoint | None:
    """The condition at which the refits differ most, in standard deviations of a measurement there."""
    if values is None or state.refits is None or state.curves is None or state.others is None:
        return None
    if not len(state.others):
        return None
    modelled, spread = state.curves, _sigma_at(plan, state.others, sigma)
    usable = np.asarray(np.isfinite(modelled).all(axis=(0, 2)) & np.isfinite(spread).all(axis=1))
    if not usable.any():
        return None
    variance = modelled.var(axis=0, ddof=1)
    gain = np.where(usable, np.log1p(np.where(usable[:, None], variance / spread**2, 0.0)).sum(axis=1), -1.0)
    best = int(gain.argmax())
    own = values[: len(modelled)]
    both = np.cov(np.hstack([own, modelled[:, best]]), rowvar=False)
    p = own.shape[1]
    inner = both[p:, p:] + np.diag(spread[best] ** 2)
    explained = np.diagonal(both[:p, p:] @ np.linalg.solve(inner, both[p:, :p]))
    before = np.maximum(np.diagonal(both)[:p], 1e-300)
    after = np.sqrt(np.clip(1.0 - explained / before, 0.0, 1.0))
    condition = state.others[best]
    return NextPoint(
        tuple(condition.tolist()),
        tuple(condition.tolist()) in plan.conditions,
        tuple(np.sqrt(variance[best]).tolist()),
        tuple((1.0 - after).tolist()),
    )


def _sigma_at(plan: CalibratePlan, others: Floats, sigma: Floats) -> Floats:
    """Standard deviation of a measurement at other conditions, as of the nearest measured one: (others, results)."""
    conditions, columns = plan.places
    width = np.ptp(plan.at, axis=0)
    width = np.where(width > 0.0, width, 1.0)
    result = np.full((len(others), len(plan.measured)), np.nan)
    for column in range(len(plan.measured)):
        rows = np.flatnonzero((columns == column) & np.isfinite(sigma))
        if len(rows):
            apart = (others[:, None, :] - plan.at[conditions[rows]][None, :, :]) / width
            result[:, column] = sigma[rows[(apart**2).sum(axis=2).argmin(axis=1)]]
    return result
