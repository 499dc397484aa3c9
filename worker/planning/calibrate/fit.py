"""Least squares of several starts in lock step: each iteration of all of them is one round.

The step d of a start solves (A + mu D) d = -g with the bounds of the ranges kept, where g and A are gradient and
Gauss-Newton curvature of the cost and D is the diagonal of A (K. Levenberg 1944; D. Marquardt 1963). Derivatives are
central differences that are run with the trial. Their distances follow the length of the steps, so that a rough surface
is first seen from afar, unless the second differences are as large as the first.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker.planning.calibrate.batches import bounded_steps, normal, total
from sprag_study.worker.planning.calibrate.plan import MOST_ITERATIONS

if TYPE_CHECKING:
    from collections.abc import Generator

    from sprag_study.worker.planning.calibrate.data import Data

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

#: Distances of central differences, in widths of the ranges: at least, at first and at most, and as a share of the
#: last step, so that a rough surface is first seen from afar.
_NEAREST, APART, _SHARE = 1e-5, 0.01, 0.3
#: By how much the distance shrinks where a trial was no better.
_NEARER = 0.1
#: Ratio of second to first differences above which the distance does not shrink.
_NOISY = 0.3
#: The longest step, in widths of the ranges; damping at first and at least.
_LONGEST, _DAMPING, _LEAST_DAMPING = 0.3, 1e-3, 1e-12
#: Predicted reduction of the cost, relative, at which a start has converged; the same after a trial that was no better,
#: and after two of them, as results of settled motions have errors of 1e-8.
_CONVERGED, _ROUNDING, _NOISE = 1e-15, 1e-13, 1e-7
#: Trials in a row that are no better after which a start ends.
_PATIENCE = 6
#: After `_TRY` iterations, starts whose cost is that many times the least end.
_TRY, _HOPELESS = 12, 4.0
#: A start that is this close to a better one, in widths of the ranges, ends.
_SAME = 1e-3


@dataclass
class Lanes:
    """Starts on their way to the least cost.

    Attributes
    ----------
    places : float64 array, shape (starts, parameters)
        Coordinates in 0 .. 1.
    modelled : float64 array, shape (starts, measured)
        NaN where a case has failed.
    derivatives : float64 array, shape (starts, measured, parameters)
        Of the modelled values, by the coordinates.
    costs : float64 array, shape (starts,)
    apart : float64 array, shape (starts, parameters)
        Distances of the differences.
    """

    places: Floats
    modelled: Floats
    derivatives: Floats
    costs: Floats
    apart: Floats


def quadratic(data: Data, modelled: Floats, derivatives: Floats) -> tuple[Floats, Floats]:
    """Gradient (sets, p) and curvature (sets, p, p) of the cost."""
    residuals = data.residuals(modelled)
    first, curved = data.slopes(residuals)
    gradient = total(derivatives * (first * residuals * data.weights)[:, :, None])
    return gradient, normal(derivatives, curved * data.weights * data.weights)


def damped_steps(gradient: Floats, curvature: Floats, damping: Floats, places: Floats) -> tuple[Floats, Floats]:
    """Steps within the bounds and not too long, and by how much each is predicted to lower the cost."""
    diagonal = np.diagonal(curvature, axis1=1, axis2=2)
    least = 1e-12 * np.maximum(diagonal.max(axis=1, keepdims=True), 1e-300)
    hold = np.eye(places.shape[1]) * (damping[:, None] * np.maximum(diagonal, least))[:, None, :]
    steps = bounded_steps(curvature + hold, gradient, places)
    longest = np.abs(steps).max(axis=1, keepdims=True)
    steps = steps * np.where(longest > _LONGEST, _LONGEST / np.maximum(longest, _LONGEST), 1.0)
    bent = total(np.swapaxes(curvature * steps[:, None, :], 1, 2))
    return steps, -total(steps * (gradient + 0.5 * bent))


def around(places: Floats, apart: Floats) -> Floats:
    """Places of central differences, shape (sets x 2 p, p): below and above in each coordinate, within the bounds."""
    count, p = places.shape
    result = np.repeat(places[:, None, :], 2 * p, axis=1)
    for j in range(p):
        result[:, 2 * j, j] = np.maximum(places[:, j] - apart[:, j], 0.0)
        result[:, 2 * j + 1, j] = np.minimum(places[:, j] + apart[:, j], 1.0)
    return result.reshape(count * 2 * p, p)


def differences(data: Data, places: Floats, modelled: Floats, apart: Floats, beside: Floats) -> tuple[Floats, Floats]:
    """Derivatives, shape (sets, measured, p), from the values ``beside`` the places; least distances of the next.

    Where one side has failed, or a value jumps, the other side counts.
    """
    count, p = places.shape
    sides = beside.reshape(count, p, 2, modelled.shape[1])
    derivatives, distances = np.zeros((count, modelled.shape[1], p)), apart.copy()
    for j in range(p):
        low = places[:, j] - np.maximum(places[:, j] - apart[:, j], 0.0)
        high = np.minimum(places[:, j] + apart[:, j], 1.0) - places[:, j]
        below, above = modelled - sides[:, j, 0], sides[:, j, 1] - modelled
        both = (below + above) / (low + high)[:, None]
        with np.errstate(divide="ignore", invalid="ignore"):
            back, ahead = below / low[:, None], above / high[:, None]
        back, ahead = np.where(np.isfinite(back), back, np.nan), np.where(np.isfinite(ahead), ahead, np.nan)
        nearer = np.where(np.isnan(ahead) | (np.abs(back) < np.abs(ahead)), back, ahead)
        alone = np.isnan(back) | np.isnan(ahead)
        change = np.fmax(np.abs(below), np.abs(above)) * data.weights
        jump = ~alone & (np.abs(back - ahead) > 0.5 * np.fmax(np.abs(back), np.abs(ahead))) & (change > 1.0)
        derivatives[:, :, j] = np.nan_to_num(np.where(alone | jump, nearer, both))
        distances[:, j] = _distances(data, apart[:, j], below, above, alone | jump)
    return derivatives, distances


def _distances(data: Data, apart: Floats, below: Floats, above: Floats, out: Flags) -> Floats:
    first = np.where(out, 0.0, (above + below) * data.weights)
    second = np.where(out, 0.0, (above - below) * data.weights)
    ratio = np.sqrt(total(second * second)) / np.maximum(np.sqrt(total(first * first)), 1e-300)
    return np.where(ratio > _NOISY, apart, _NEAREST)


def fit(data: Data, places: Floats, modelled: Floats, sets: int) -> Generator[Floats, Floats, Lanes]:
    """Lower the cost from each of ``places``, whose modelled values are given, by at most so many sets of cases."""
    starts = _Starts(data, places, modelled)
    for iteration in range(MOST_ITERATIONS):
        if iteration >= _TRY:
            starts.drop_hopeless()
        asked = starts.propose()
        sets -= len(asked)
        if not len(asked) or sets < 0:
            break
        starts.take((yield asked))
    return starts.lanes


class _Starts:
    """The starts, each either with a trial and differences around it, or with new differences where it is."""

    def __init__(self, data: Data, places: Floats, modelled: Floats) -> None:
        count, p = places.shape
        self._data = data
        self.lanes = Lanes(
            places.copy(),
            modelled.copy(),
            np.zeros((*modelled.shape, p)),
            data.costs(modelled),
            np.full((count, p), APART),
        )
        self._damping = np.full(count, _DAMPING)
        self._failed = np.zeros(count, dtype=np.int64)
        self._active, self._anew = np.ones(count, dtype=np.bool_), np.ones(count, dtype=np.bool_)
        self._floor = np.full((count, p), _NEAREST)
        self._trying = self._looking = np.empty(0, dtype=np.int64)
        self._trials = self._apart = np.empty((0, p))
        self._predicted = np.empty(0)

    def drop_hopeless(self) -> None:
        """End starts whose cost is far above the least."""
        self._active &= self.lanes.costs <= _HOPELESS * self.lanes.costs.min()

    def propose(self) -> Floats:
        """Places of the next iteration, shape (sets, p); none where all have ended."""
        lanes = self.lanes
        at = np.flatnonzero(self._active & ~self._anew)
        gradient, curvature = quadratic(self._data, lanes.modelled[at], lanes.derivatives[at])
        steps, predicted = damped_steps(gradient, curvature, self._damping[at], lanes.places[at])
        small = (predicted <= _CONVERGED * lanes.costs[at]) | (lanes.costs[at] <= _exact(self._data))
        self._active[at[small]] = False
        self._trying, steps, self._predicted = at[~small], steps[~small], predicted[~small]
        self._looking = np.flatnonzero(self._active & self._anew)
        self._trials = np.clip(lanes.places[self._trying] + steps, 0.0, 1.0)
        self._apart = np.clip(_SHARE * np.abs(steps), self._floor[self._trying], APART)
        beside = around(self._trials, self._apart)
        return np.concatenate([self._trials, beside, around(lanes.places[self._looking], lanes.apart[self._looking])])

    def take(self, modelled: Floats) -> None:
        """Go on by the modelled values of the places proposed last."""
        tried, p = len(self._trying), self.lanes.places.shape[1]
        self._look(modelled[tried * (1 + 2 * p) :])
        self._judge(modelled[:tried], modelled[tried : tried * (1 + 2 * p)])
        self._active &= ~_followers(self.lanes)

    def _look(self, beside: Floats) -> None:
        lanes, at = self.lanes, self._looking
        self._anew[at] = False
        lanes.derivatives[at], self._floor[at] = differences(
            self._data, lanes.places[at], lanes.modelled[at], lanes.apart[at], beside
        )

    def _judge(self, own: Floats, beside: Floats) -> None:
        lanes, at, predicted = self.lanes, self._trying, self._predicted
        costs = self._data.costs(own)
        better = costs < lanes.costs[at]
        ratio = (lanes.costs[at] - costs) / np.maximum(predicted, 1e-300)
        derivatives, floor = differences(self._data, self._trials, own, self._apart, beside)
        good, bad = at[better], at[~better]
        lanes.places[good], lanes.modelled[good], lanes.costs[good] = self._trials[better], own[better], costs[better]
        lanes.derivatives[good], lanes.apart[good] = derivatives[better], self._apart[better]
        self._floor[good] = floor[better]
        self._failed[good] = 0
        self._failed[bad] += 1
        nearer = np.maximum(_NEARER * lanes.apart[bad], self._floor[bad])
        self._anew[bad] = (nearer < lanes.apart[bad]).any(axis=1)
        lanes.apart[bad] = nearer
        hopeless = (predicted <= _ROUNDING * lanes.costs[at]) | (self._failed[at] >= _PATIENCE)
        hopeless |= (predicted <= _NOISE * lanes.costs[at]) & (self._failed[at] > 1)
        self._active[at[~better & hopeless]] = False
        damping = self._damping[at]
        eased = np.maximum(damping * np.where(ratio > 0.5, 0.1, 1.0), _LEAST_DAMPING)
        raised = np.maximum(damping, _LEAST_DAMPING * 1e6) * 10.0
        self._damping[at] = np.where(better, np.where(ratio < 0.1, damping * 4.0, eased), raised)


def _followers(lanes: Lanes) -> Flags:
    """Which starts have come to where a better one is."""
    apart = np.abs(lanes.places[:, None, :] - lanes.places[None, :, :]).max(axis=2)
    ahead = lanes.costs[None, :] < lanes.costs[:, None]
    return np.asarray(((apart < _SAME) & ahead).any(axis=1))


def _exact(data: Data) -> float:
    """Cost of residuals that are rounding only."""
    size = data.values * data.weights
    return 1e-28 * float(total((size * size)[None, :])[0])
