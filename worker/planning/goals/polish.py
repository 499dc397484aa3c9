"""Equalities met closely: the best designs are moved onto them by damped Gauss-Newton steps.

Every design starts with central differences of its limits and goals (one round); each further round tries one step for
each design, from which the derivatives are corrected by Broyden's rule. With the derivatives J of the equalities and of
the inequalities that the step would violate, their residuals r, and the gradients of the goals, each of length 1, as
the rows of G, the step d solves

    (J'J + mu M) d = -J'r,    M = I + kappa G'G,

where mu is so small that the step meets the equalities wherever they can be met, and among those steps is the shortest
of least change of the goals (K. Levenberg 1944; C. G. Broyden 1965). Steps stay within the bounds of the variables;
one that does not bring the design closer is tried again at a quarter of its length. Catalogue values do not change.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker.planning.goals.linear import norm, solved, weighted_sum
from sprag_study.worker.planning.goals.scores import misses

if TYPE_CHECKING:
    from sprag_study.worker.planning.goals.plan import GoalPlan
    from sprag_study.worker.planning.goals.space import Space

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Relative miss of equalities at which a design is polished, and what steps aim at.
MET, _AIM = 1e-6, 1e-8
#: Designs that are polished, and the rounds after that of the differences.
MOST_STARTS, MOST_TRIALS = 20, 10
#: Half the distance of central differences, and the longest step, in widths of the ranges.
_APART, _LONGEST = 1e-4, 0.1
_DAMPING, _HOLD = 1e-8, 30.0


@dataclass
class _Start:
    """A design on its way to the equalities."""

    place: Floats
    outputs: Floats
    derivatives: Floats = field(default_factory=lambda: np.empty((0, 0)))
    trial: Floats = field(default_factory=lambda: np.empty(0))
    length: float = 1.0
    active: bool = True


def polish_designs(plan: GoalPlan) -> int:
    """Designs that the polish of a plan asks for at most."""
    if not any(limit.polished for limit in plan.subject_to):
        return 0
    ranges = sum(not one.values for one in plan.vary)
    return min(MOST_STARTS, plan.population) * (2 * ranges + MOST_TRIALS) if plan.polish and ranges else 0


class Polish:
    """The designs that are polished, and their next trials.

    Parameters
    ----------
    places : array, shape (designs, dimensions)
        Coordinates of the designs.
    outputs : array, shape (designs, outputs)
        As of ``scores.outputs_of``.
    """

    def __init__(self, plan: GoalPlan, space: Space, places: Floats, outputs: Floats) -> None:
        self._plan = plan
        self._free = np.flatnonzero(space.counts == 0)
        self._starts = [_Start(*one) for one in zip(places, outputs, strict=True)]
        self._residuals = _Residuals(plan)
        for start in self._starts:
            start.active = not self._met(start.outputs) and start.outputs[-1] == 0.0
        self._trials = -1

    @property
    def done(self) -> bool:
        """Whether nothing is left to try."""
        return self._trials >= MOST_TRIALS or not any(start.active for start in self._starts)

    @property
    def differentiates(self) -> bool:
        """Whether the designs of this round serve the derivatives only."""
        return self._trials < 0

    def propose(self) -> Floats:
        """Coordinates of the next designs, shape (designs, dimensions)."""
        active = [start for start in self._starts if start.active]
        if self.differentiates:
            return np.concatenate([self._apart(start.place) for start in active])
        for start in active:
            start.trial = start.place + start.length * self._step(start)
        return np.array([start.trial for start in active])

    def take(self, outputs: Floats) -> None:
        """Go on by the outputs of the designs proposed last."""
        active = [start for start in self._starts if start.active]
        if self.differentiates:
            for start, own in zip(active, outputs.reshape(len(active), -1, outputs.shape[1]), strict=True):
                start.derivatives = self._differences(start, own)
        else:
            for start, one in zip(active, outputs, strict=True):
                self._judge(start, one)
        self._trials += 1

    def _apart(self, place: Floats) -> Floats:
        """The places of central differences: below and above in each range, clipped to the bounds."""
        places = np.repeat(place[None, :], 2 * len(self._free), axis=0)
        for row, i in enumerate(self._free):
            places[2 * row, i] = max(place[i] - _APART, 0.0)
            places[2 * row + 1, i] = min(place[i] + _APART, 1.0)
        return places

    def _differences(self, start: _Start, outputs: Floats) -> Floats:
        """Derivatives of all outputs, shape (outputs, ranges); one-sided where the other side failed."""
        places = self._apart(start.place)
        derivatives = np.zeros((len(start.outputs), len(self._free)))
        for row, i in enumerate(self._free):
            below, above = outputs[2 * row], outputs[2 * row + 1]
            low, high = places[2 * row, i], places[2 * row + 1, i]
            low, below = (start.place[i], start.outputs) if below[-1] else (low, below)
            high, above = (start.place[i], start.outputs) if above[-1] else (high, above)
            if high > low:
                derivatives[:, row] = (above - below) / (high - low)
        return np.where(np.isnan(derivatives), 0.0, derivatives)

    def _met(self, outputs: Floats) -> bool:
        within = bool(misses(self._plan, outputs[None, :])[0] <= _AIM)
        return within and self._merit(outputs) <= _AIM

    def _merit(self, outputs: Floats) -> float:
        """Norm of the misses of equalities and the violations of inequalities, relative; inf where failed."""
        equal, excess = self._residuals.of(outputs)
        merit = norm(np.concatenate([equal, np.maximum(excess, 0.0)]))
        return merit if outputs[-1] == 0.0 and not math.isnan(merit) else math.inf

    def _judge(self, start: _Start, outputs: Floats) -> None:
        merit, before = self._merit(outputs), self._merit(start.outputs)
        if math.isfinite(merit):
            moved = (start.trial - start.place)[self._free]
            predicted = weighted_sum(moved, start.derivatives.T)
            wrong = np.nan_to_num(outputs - start.outputs - predicted)
            square = math.fsum((moved * moved).tolist())
            if square > 0.0:
                start.derivatives = start.derivatives + wrong[:, None] * moved / square
        if merit < before:
            start.place, start.outputs = start.trial, outputs
            start.length = 1.0
            start.active = not self._met(outputs)
        else:
            start.length *= 0.25
            start.active = before > MET or start.length > 0.01

    def _step(self, start: _Start) -> Floats:
        """The step of a design, shape (dimensions,)."""
        equal, excess = self._residuals.of(start.outputs)
        equal_rows, excess_rows = self._residuals.derivatives(start.derivatives)
        first = len(self._plan.at) * len(self._plan.subject_to)
        goals = start.derivatives[first : first + len(self._plan.best)]
        goals = goals / np.array([norm(row) or 1.0 for row in goals]).reshape(-1, 1)
        held = excess > 0.0
        step = np.zeros(len(self._free))
        for _ in range(1 + len(excess)):
            residuals = np.concatenate([equal, excess[held]])
            rows = np.concatenate([equal_rows, excess_rows[held]])
            step = _least(residuals, rows, goals, start.place[self._free])
            beyond = excess + weighted_sum(step, excess_rows.T) > 1e-9
            if not (beyond & ~held).any():
                break
            held |= beyond
        longest = float(np.abs(step).max())
        full = np.zeros(len(start.place))
        full[self._free] = step * min(1.0, _LONGEST / longest) if longest > 0.0 else step
        return full


class _Residuals:
    """Which outputs are residuals of equalities and of inequalities, and their scales."""

    def __init__(self, plan: GoalPlan) -> None:
        points = len(plan.at)
        equal, unequal = [], []
        for i, limit in enumerate(plan.subject_to):
            columns = range(points * i, points * (i + 1))
            sign = (-1.0 if limit.kind == "at_least" else 1.0) / limit.scale
            if limit.polished:
                equal += [(column, limit.value, sign) for column in columns]
            elif limit.kind != "is":
                unequal += [(column, limit.value, sign) for column in columns]
        self._equal, self._unequal = _table(equal), _table(unequal)

    def of(self, outputs: Floats) -> tuple[Floats, Floats]:
        """Relative misses of the equalities and excesses of the inequalities."""
        (a, x, s), (b, y, t) = self._equal, self._unequal
        return (outputs[a] - x) * s, (outputs[b] - y) * t

    def derivatives(self, derivatives: Floats) -> tuple[Floats, Floats]:
        """Their derivatives, shape (residuals, ranges)."""
        (a, _, s), (b, _, t) = self._equal, self._unequal
        return derivatives[a] * s[:, None], derivatives[b] * t[:, None]


def _table(rows: list[tuple[int, float, float]]) -> tuple[Ints, Floats, Floats]:
    columns, values, scales = ([row[k] for row in rows] for k in range(3))
    return np.array(columns, dtype=np.int64), np.array(values, dtype=np.float64), np.array(scales, dtype=np.float64)


def _least(residuals: Floats, rows: Floats, goals: Floats, place: Floats) -> Floats:
    """The step that meets the linearised residuals within the bounds, shape (ranges,)."""
    n = len(place)
    step = np.zeros(n)
    free = np.ones(n, dtype=np.bool_)
    while free.any():
        fixed = weighted_sum(np.where(free, 0.0, step), rows.T)
        j, g = rows[:, free], goals[:, free]
        normal = weighted_sum(np.ones(len(j)), j[:, :, None] * j[:, None, :])
        hold = np.eye(j.shape[1]) + _HOLD * weighted_sum(np.ones(len(g)), g[:, :, None] * g[:, None, :])
        damping = _DAMPING * max(float(np.diag(normal).max()), 1e-12)
        try:
            step[free] = solved(normal + damping * hold, -weighted_sum(residuals + fixed, j))
        except ValueError:
            return np.zeros(n)
        outside = free & ((place + step < 0.0) | (place + step > 1.0))
        if not outside.any():
            break
        step[outside] = np.clip(place + step, 0.0, 1.0)[outside] - place[outside]
        free &= ~outside
    return step
