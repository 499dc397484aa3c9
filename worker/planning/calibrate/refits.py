"""The bootstrap: the fit is repeated on many sets of data as they might have been measured, all in lock step.

Each refit starts from the best set of parameters that was ever run, which costs nothing, and goes on by steps whose
derivatives are corrected by Broyden's rule (C. G. Broyden 1965): one set of cases a step. Sets that were run for one
refit serve the others.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker.planning.calibrate.batches import total
from sprag_study.worker.planning.calibrate.fit import damped_steps, quadratic
from sprag_study.worker.planning.calibrate.losses import slopes

if TYPE_CHECKING:
    from collections.abc import Generator

    from sprag_study.worker.planning.calibrate.data import Data
    from sprag_study.worker.planning.calibrate.fit import Lanes
    from sprag_study.worker.planning.calibrate.plan import Loss
    from sprag_study.worker.planning.goals.draws import Draws

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Predicted reductions of the cost (in squares of standard deviations) at which a refit ends: before a trial, and
#: after one that was no better. A thousandth of an interval's width squared.
_CONVERGED, _HARDLY = 2e-3, 2e-2
_PATIENCE = 4
#: Steps to the centre of residuals.
_CENTRED = 30
_DAMPING = 1e-3


@dataclass(frozen=True)
class Refits:
    """Refits at their ends, the order that of the drawn sets.

    Attributes
    ----------
    places : float64 array, shape (refits, parameters)
    modelled : float64 array, shape (refits, measured)
    converged : bool array, shape (refits,)
    """

    places: Floats
    modelled: Floats
    converged: NDArray[np.bool_]


def drawn(
    data: Data, modelled: Floats, leverage: Floats, count: int, scales: dict[int, int], columns: Ints, draws: Draws
) -> Floats:
    """Sets of data as they might have been measured, shape (count, measured).

    Where the standard deviations are given (no ``scales``) and the loss is linear: the ``modelled`` values with normal
    noise. Otherwise residuals of the fit, drawn with replacement, each divided by the root of 1 less its ``leverage``.
    Where the standard deviation of a result, one of the ``columns`` (measured,), is only known from so many degrees of
    freedom (``scales``), each set has its own, by a distribution of chi-square. Priors always
    have normal noise.
    """
    used = data.weights > 0.0
    scale = np.where(used, 1.0 / np.where(used, data.weights, 1.0), 0.0)
    if not scales and data.loss == "linear":
        return modelled + draws.normals(count, len(modelled)) * scale
    noise, rows = np.zeros((count, len(modelled))), np.flatnonzero(used[: len(columns)])
    residuals = data.residuals(modelled)[rows] / np.sqrt(np.maximum(1.0 - leverage[rows], 0.05))
    residuals = residuals - _centre(data.loss, residuals)
    noise[:, rows] = residuals[draws.integers(len(residuals), count, len(residuals))]
    for column, freedom in scales.items():
        normals = draws.normals(count, freedom)
        noise[:, np.flatnonzero(columns == column)] *= np.sqrt(freedom / total(normals * normals))[:, None]
    if data.priors:
        noise[:, len(columns) :] = draws.normals(count, data.priors)
    return modelled + noise * scale


def _centre(loss: Loss, residuals: Floats) -> float:
    """The constant that fits the residuals best by their loss; their mean would follow outliers."""
    centre = float(np.median(residuals))
    for _ in range(_CENTRED):
        weights = slopes(loss, residuals - centre)[0]
        centre = float(total((weights * residuals)[None, :])[0] / total(weights[None, :])[0])
    return centre


def refit(
    data: Data, values: Floats, sets: tuple[Floats, Floats], around: Lanes, trials: int
) -> Generator[Floats, Floats, Refits]:
    """Refit to each row of ``values``.

    Parameters
    ----------
    data : Data
    values : array, shape (refits, measured)
    sets : (array, shape (sets, parameters), array, shape (sets, measured))
        Every set of parameters that was run, and its modelled values.
    around : Lanes
        The fits; derivatives are first taken from the nearest.
    trials : int
        Trials of each refit at most.
    """
    count = len(values)
    best, costs = data.least(sets[1], values)
    places, modelled = sets[0][best], sets[1][best]
    derivatives = around.derivatives[_nearest(places, around.places)]
    damping, failed = np.full(count, _DAMPING), np.zeros(count, dtype=np.int64)
    active = np.ones(count, dtype=np.bool_)
    for _ in range(trials):
        at = np.flatnonzero(active)
        own = replace(data, values=values[at])
        gradient, curvature = quadratic(own, modelled[at], derivatives[at])
        steps, predicted = damped_steps(gradient, curvature, damping[at], places[at])
        ended = (predicted <= _CONVERGED) | ((failed[at] > 0) & (predicted <= _HARDLY)) | (failed[at] >= _PATIENCE)
        active[at[ended]] = False
        at, steps = at[~ended], steps[~ended]
        if not len(at):
            break
        tried = np.clip(places[at] + steps, 0.0, 1.0)
        found = yield tried
        moved = tried - places[at]
        wrong = np.nan_to_num(found - modelled[at] - total(np.swapaxes(derivatives[at] * moved[:, None, :], 1, 2)))
        square = np.maximum(total(moved * moved), 1e-300)
        derivatives[at] += wrong[:, :, None] * (moved / square[:, None])[:, None, :]
        cost = replace(data, values=values[at]).costs(found)
        better = cost < costs[at]
        failed[at] = np.where(better, 0, failed[at] + 1)
        damping[at] = np.where(better, np.maximum(damping[at] * 0.1, 1e-9), np.maximum(damping[at], 1e-3) * 10.0)
        good = at[better]
        places[good], modelled[good], costs[good] = tried[better], found[better], cost[better]
        other, least = data.least(found, values)
        shared = least < costs - _CONVERGED
        places[shared], modelled[shared], costs[shared] = tried[other[shared]], found[other[shared]], least[shared]
        failed[shared] = 0
        active |= shared
    return Refits(places, modelled, ~active)


def _nearest(places: Floats, among: Floats) -> Ints:
    apart = places[:, None, :] - among[None, :, :]
    squares = total((apart * apart).reshape(-1, places.shape[1])).reshape(len(places), -1)
    return np.asarray(squares.argmin(axis=1))
