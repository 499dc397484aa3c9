"""The end of a search for one goal: sequential quadratic programming moves its best design to the optimum beside it.

Draws approach a limit that binds, or the least of several operating points, only as closely as there are many of them;
derivatives see where it lies. In turn, a round has central differences of the goal and of each limit around the best
design, and a round has trials: the steps of a quadratic program in trust regions of several widths. Where none of them
is better, a further round has the same steps with what the limits were really there (second-order corrections). The
program is of R. Fletcher's kind, with limits that may be missed at a price; its curvature comes from second differences
and then by M. J. D. Powell's damped BFGS rule (J. Nocedal, S. J. Wright, "Numerical Optimization", 2nd ed., Springer
2006, sections 18.3, 18.5 and procedure 18.2).

A trial takes the place of the best design only where it is within every limit and better, so the best is never worse
than it was. Catalogue values do not change.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker.planning.goals.linear import weighted_sum
from sprag_study.worker.planning.goals.polish import MET
from sprag_study.worker.planning.goals.quadratic import least_step
from sprag_study.worker.planning.goals.scores import goals_at, judge

if TYPE_CHECKING:
    from sprag_study.worker.planning.goals.plan import GoalPlan
    from sprag_study.worker.planning.goals.space import Space

Floats = NDArray[np.float64]

#: Most turns of differences and trials, and the trials of a round.
MOST_TURNS, _TRIALS = 8, 5
#: First and largest trust region, in widths of the ranges, and the factor between those of a round.
_FIRST, _WIDEST, _BETWEEN = 0.03, 0.2, 0.25
#: Half the distance of central differences: share of the trust region, least and largest.
_APART, _CLOSEST, _FARTHEST = 0.1, 1e-5, 1e-3
#: Where steps aim within limits, relative, and the share of the goal that a turn must gain for another one.
_WITHIN, _GAIN = 1e-7, 1e-7
#: Least trust region that is tried.
_LEAST = 1e-6
#: Least curvature of a range, in slopes of the goal.
_FLAT = 1e-6


def finish_designs(plan: GoalPlan) -> int:
    """Designs that the end of a search asks for at most; 0 for a plan that has none."""
    ranges = sum(not one.values for one in plan.vary)
    yields = any(item.conditions for item in plan.items)  # shares of drives have no derivatives
    if not plan.finish or len(plan.best) != 1 or yields or not ranges:
        return 0
    return MOST_TURNS * (2 * ranges + 2 * _TRIALS)


def finish_rounds(plan: GoalPlan) -> int:
    """Rounds of the end of a search at most."""
    return 3 * MOST_TURNS if finish_designs(plan) else 0


class Finish:
    """The best design on its way to the optimum, and its next trials.

    Parameters
    ----------
    place : array, shape (dimensions,)
        Coordinates of the best design.
    outputs : array, shape (outputs,)
        As of ``scores.outputs_of``.
    exact : bool
        Whether equalities stay met to 1e-6, instead of within their bands.
    """

    def __init__(self, plan: GoalPlan, space: Space, place: Floats, outputs: Floats, *, exact: bool) -> None:
        self._plan, self._exact = plan, exact
        self._free = np.flatnonzero(space.counts == 0)
        self._place, self._outputs = place, outputs
        self._limits = _Limits(plan, exact=exact)
        self._radius, self._turn = _FIRST, 0
        self._stage: Literal["differences", "trials", "corrections"] = "differences"
        self._slopes = self._hessian = np.empty((0, len(self._free)))
        #: The place of the derivatives before, these, and the multipliers of the step from there.
        self._before: tuple[Floats, Floats, Floats] | None = None
        self._trials = self._multipliers = np.empty((0, len(place)))
        #: Place, outputs and multipliers of the best trial of this turn that is better than the design.
        self._better: tuple[Floats, Floats, Floats] | None = None
        #: How far the limits bend along each trial, relative.
        self._bent = np.empty((0, 0))
        self.done = not finish_designs(plan) or not math.isfinite(self._ranked(outputs[None])[0][0])

    @property
    def differentiates(self) -> bool:
        """Whether the designs of this round serve the derivatives only."""
        return self._stage == "differences"

    def propose(self) -> Floats:
        """Coordinates of the next designs, shape (designs, dimensions)."""
        self._trials = self._apart() if self.differentiates else self._stepped()
        return self._trials

    def take(self, outputs: Floats) -> None:
        """Go on by the outputs of the designs proposed last."""
        if self.differentiates:
            self._differentiate(outputs)
            self._stage, self._bent = "trials", np.zeros((_TRIALS, self._slopes.shape[0]))
            return
        self._compare(outputs)
        if self._stage == "trials":
            self._bent, self._stage = self._bends(outputs), "corrections"
            return
        self._turn, self._stage = self._turn + 1, "differences"
        if self._better is None:
            self._radius *= _BETWEEN**_TRIALS
        else:
            self._move(*self._better)
        self._better = None
        self.done |= self._turn >= MOST_TURNS or self._radius < _LEAST

    def _compare(self, outputs: Floats) -> None:
        """Keep the best of the trials where it is better than the design that stands and than those before."""
        known = self._outputs if self._better is None else self._better[1]
        violation, goals = self._ranked(np.concatenate([known[None], outputs]))
        best = int(np.lexsort((goals, violation))[0]) - 1
        if best >= 0:
            self._better = self._trials[best], outputs[best], self._multipliers[best]

    def _move(self, place: Floats, outputs: Floats, multipliers: Floats) -> None:
        """Let a better design take the place of the best one."""
        self._before = self._place, self._slopes, multipliers
        (violation, _), (before, after) = self._ranked(np.stack([self._outputs, outputs]))
        self.done = violation == 0.0 and before - after < _GAIN * abs(before)
        self._radius = min(float(np.abs(place - self._place).max()) / _BETWEEN, _WIDEST)
        self._place, self._outputs = place, outputs

    def _ranked(self, outputs: Floats) -> tuple[Floats, Floats]:
        """By what designs are compared: violations, then goals."""
        scores = judge(self._plan, outputs, equality=MET if self._exact else None)
        return scores.violation, scores.goals[:, 0]

    def _values(self, outputs: Floats) -> Floats:
        """What the program has rows for: the goal at each operating point that counts, then the limits' excesses."""
        return np.hstack([goals_at(self._plan, outputs), self._limits.excesses(outputs)])

    def _apart(self) -> Floats:
        """The places of central differences: below and above in each range, clipped to the bounds."""
        apart = min(max(_APART * self._radius, _CLOSEST), _FARTHEST)
        places = np.repeat(self._place[None], 2 * len(self._free), axis=0)
        for row, i in enumerate(self._free):
            places[2 * row, i] = max(self._place[i] - apart, 0.0)
            places[2 * row + 1, i] = min(self._place[i] + apart, 1.0)
        return places

    def _differentiate(self, outputs: Floats) -> None:
        """Take derivatives from central differences, one-sided where the other side failed, and the curvature."""
        failed = outputs[:, -1] != 0.0
        values = self._values(np.concatenate([self._outputs[None], outputs]))
        slopes, bends = np.zeros((values.shape[1], len(self._free))), np.zeros((values.shape[1], len(self._free)))
        for row, i in enumerate(self._free):
            low = 0.0 if failed[2 * row] else self._place[i] - self._trials[2 * row, i]
            high = 0.0 if failed[2 * row + 1] else self._trials[2 * row + 1, i] - self._place[i]
            below, above = values[0] - values[1 + 2 * row], values[2 + 2 * row] - values[0]
            if low > 0.0 and high > 0.0:
                slopes[:, row] = (below + above) / (low + high)
                bends[:, row] = 2.0 * (above / high - below / low) / (low + high)
            elif low > 0.0 or high > 0.0:
                slopes[:, row] = below / low if low > 0.0 else above / high
        self._slopes, bends = (np.where(np.isfinite(one), one, 0.0) for one in (slopes, bends))
        self._bend(bends[: self._goals])

    def _bend(self, bends: Floats) -> None:
        """The curvature: of the goal at first, then by the damped BFGS rule with the multipliers of the last step."""
        if self._before is None:
            mean = weighted_sum(np.ones(len(bends)), bends) / len(bends)
            least = _FLAT * max(self._scale, 1e-300)
            self._hessian = np.diag(np.maximum(mean, least))
            return
        place, slopes, multipliers = self._before
        step = (self._place - place)[self._free]
        change = weighted_sum(multipliers, self._slopes - slopes)
        bent = weighted_sum(step, self._hessian)
        curve, along = math.fsum((step * bent).tolist()), math.fsum((step * change).tolist())
        if curve <= 0.0:
            return
        share = 1.0 if along >= 0.2 * curve else 0.8 * curve / (curve - along)
        change = share * change + (1.0 - share) * bent
        along = math.fsum((step * change).tolist())
        self._hessian = self._hessian - bent[:, None] * bent / curve + change[:, None] * change / along

    @property
    def _goals(self) -> int:
        """Rows of the goal."""
        return int(goals_at(self._plan, self._outputs[None]).shape[1])

    @property
    def _scale(self) -> float:
        """The steepest slope of the goal."""
        return float(np.abs(self._slopes[: self._goals]).max())

    def _bends(self, outputs: Floats) -> Floats:
        """By how much limits at the trials differ from what the slopes say, shape (trials, rows); 0 for goals."""
        steps = (self._trials - self._place)[:, self._free]
        expected = np.array([weighted_sum(step, self._slopes.T) for step in steps])
        bends = self._values(outputs) - self._values(self._outputs[None]) - expected
        bends[:, : self._goals] = 0.0
        return np.where(np.isfinite(bends), bends, 0.0)

    def _stepped(self) -> Floats:
        """The trials: steps of the program in smaller and smaller trust regions."""
        count, scale = self._goals, max(self._scale, 1e-300)
        values = self._values(self._outputs[None])[0]
        here = self._place[self._free]
        places = np.repeat(self._place[None], _TRIALS, axis=0)
        self._multipliers = np.zeros((_TRIALS, len(values)))
        for trial in range(_TRIALS):
            radius = self._radius * _BETWEEN**trial
            if trial and not self._bent.any() and float(np.abs(places[trial - 1] - self._place).max()) <= radius:
                places[trial], self._multipliers[trial] = places[trial - 1], self._multipliers[trial - 1]
                continue  # the wider region does not hold the step
            goals, excess = values[:count], (values + self._bent[trial])[count:]
            lines, slopes = self._slopes[:count] / scale, self._slopes[count:]
            reach = excess + weighted_sum(np.full(len(here), radius), np.abs(slopes).T)
            near = np.isfinite(excess) & (reach > -2.0 * _WITHIN)
            box = np.array([np.maximum(-radius, -here), np.minimum(radius, 1.0 - here)])
            try:
                solution = least_step(
                    self._hessian / scale,
                    ((goals - goals.max()) / scale, lines),
                    (excess[near] + _WITHIN, slopes[near]),
                    box,
                )
            except ValueError:
                continue
            places[trial, self._free] = np.clip(here + solution[: len(here)], 0.0, 1.0)
            self._multipliers[trial, :count] = solution[len(here) : len(here) + count]
            self._multipliers[trial, count:][near] = scale * solution[len(here) + count :]
        return places


class _Limits:
    """The limits of real numbers and counts as rows that are at most 0, relative to their values."""

    def __init__(self, plan: GoalPlan, *, exact: bool) -> None:
        points = len(plan.at)
        rows: list[tuple[int, float, float, float]] = []
        for i, limit in enumerate(plan.subject_to):
            columns = [points * i + place for place in limit.counted(points)]
            if limit.polished:
                within = (MET if exact else limit.within / limit.scale) - _WITHIN
                rows += [
                    (column, limit.value, sign / limit.scale, within) for column in columns for sign in (1.0, -1.0)
                ]
            elif limit.kind != "is":
                sign = -1.0 if limit.kind == "at_least" else 1.0
                rows += [(column, limit.value, sign / limit.scale, 0.0) for column in columns]
        table = np.array(rows, dtype=np.float64).reshape(-1, 4)
        self._columns = table[:, 0].astype(np.int64)
        self._bounds, self._signs, self._within = table[:, 1], table[:, 2], table[:, 3]

    def excesses(self, outputs: Floats) -> Floats:
        """By how much each row is exceeded, shape (designs, rows)."""
        return np.asarray((outputs[:, self._columns] - self._bounds) * self._signs - self._within)
