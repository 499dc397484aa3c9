"""What a design is worth: its goals, and by how much it violates its limits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker.planning.goals.plan import taken
from sprag_study.worker.planning.goals.robust import Table

if TYPE_CHECKING:
    from sprag_study.worker.planning.goals.plan import GoalPlan, Limit
    from sprag_study.worker.planning.rounds import Rows

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

#: Violation of a limit whose result is missing in a case that did not fail, as that of a category.
_MISSING = 1.0


@dataclass(frozen=True, slots=True)
class Scores:
    """Judged designs.

    Attributes
    ----------
    goals : array, shape (designs, goals)
        All to be minimised: a goal that is to be large has its sign changed. NaN where missing.
    violation : array, shape (designs,)
        0 where every limit holds; inf where a case has failed or, with every limit held, a goal is missing.
    outputs : array, shape (designs, outputs)
        What they were judged by, as of ``outputs_of``.
    equalities : array, shape (designs,)
        The part of the violation that is of equalities of real numbers.
    """

    goals: Floats
    violation: Floats
    outputs: Floats
    equalities: Floats

    @property
    def feasible(self) -> Flags:
        """Which designs are within every limit, shape (designs,)."""
        flags: Flags = self.violation == 0.0
        return flags

    @property
    def failed(self) -> Flags:
        """Which designs cannot be judged, shape (designs,)."""
        return np.isinf(self.violation)

    def __getitem__(self, which: NDArray[np.int64] | Flags | slice) -> Scores:
        violation, equalities = (np.asarray(one[which]) for one in (self.violation, self.equalities))
        return Scores(self.goals[which], violation, self.outputs[which], equalities)

    def __len__(self) -> int:
        return len(self.violation)


def joined(first: Scores, second: Scores) -> Scores:
    """The designs of both, in that order."""
    return Scores(
        np.concatenate([first.goals, second.goals]),
        np.concatenate([first.violation, second.violation]),
        np.concatenate([first.outputs, second.outputs]),
        np.concatenate([first.equalities, second.equalities]),
    )


def outputs_of(plan: GoalPlan, rows: Rows) -> Floats:
    """What designs are judged by, shape (designs, outputs).

    The columns are what each limit is about at each operating point (the limit itself at those that do not count, as of
    `Limit.judged`), with half widths counted against it, the goals taken over the operating points, where a finish
    needs them (``goals_at``) the goal at each of these that counts, and 1 where a case has failed or had not settled
    (of drawn drives: all of them), otherwise 0. Values that are missing or not finite are NaN.
    """
    table = Table(plan, rows)
    goals = [taken(goal, table.values(goal), plan.over) for goal in plan.best]
    columns = [limit.judged(table.values(limit, limit)) for limit in plan.subject_to]
    columns += [one[:, None] for one in goals]
    columns += [table.values(goal)[:, points] for goal in plan.best if (points := _apart(plan))]
    return np.hstack([*columns, table.failed.astype(np.float64)[:, None]])


def _apart(plan: GoalPlan) -> list[int]:
    """The operating points whose goals outputs have, too: a worst one has no derivatives where two meet."""
    if not plan.finish or len(plan.best) != 1 or (plan.best[0].over or plan.over) != "worst":
        return []
    points = list(plan.best[0].at or range(len(plan.at)))
    return points if len(points) > 1 else []


def goals_at(plan: GoalPlan, outputs: Floats) -> Floats:
    """The values of which the largest is the goal, to be minimised; of one goal, shape (designs, values)."""
    first = len(plan.at) * len(plan.subject_to)
    columns = outputs[:, first + 1 : -1] if _apart(plan) else outputs[:, first:-1]
    return np.asarray(columns * signs(plan))


def signs(plan: GoalPlan) -> Floats:
    """1 for each goal that is to be small, -1 for each that is to be large, shape (goals,)."""
    return np.array([-1.0 if goal.max else 1.0 for goal in plan.best], dtype=np.float64)


def judge(plan: GoalPlan, outputs: Floats, *, equality: float | None = None) -> Scores:
    """Scores of designs with those outputs.

    Parameters
    ----------
    plan : GoalPlan
    outputs : array
        As of ``outputs_of``.
    equality : float, optional
        Bands of equalities of real numbers, relative to their values, instead of those of the plan.
    """
    points = len(plan.at)
    first = points * len(plan.subject_to)
    goals = outputs[:, first : first + len(plan.best)] * signs(plan) + 0.0
    violation, equalities = np.zeros(len(outputs)), np.zeros(len(outputs))
    for i, limit in enumerate(plan.subject_to):
        within = limit.within if equality is None or not limit.polished else equality * limit.scale
        excess = _violation(limit, within, outputs[:, points * i : points * (i + 1)])
        violation += excess
        equalities += excess if limit.polished else 0.0
    missing = np.isnan(goals).any(axis=1) & (violation == 0.0)
    violation[missing | (outputs[:, -1] != 0.0)] = np.inf
    return Scores(goals, violation, outputs, equalities)


def _violation(limit: Limit, within: float, values: Floats) -> Floats:
    """Violation of one limit at its worst operating point, shape (designs,)."""
    if limit.kind == "is" and not limit.polished:
        excess = (values != limit.value).astype(np.float64)
    elif limit.kind == "is":
        excess = (np.abs(values - limit.value) - within) / limit.scale
    elif limit.kind == "at_most":
        excess = (values - limit.value) / limit.scale
    else:
        excess = (limit.value - values) / limit.scale
    worst: Floats = np.where(np.isnan(values), _MISSING, np.maximum(excess, 0.0)).max(axis=1)
    return worst


def misses(plan: GoalPlan, outputs: Floats) -> Floats:
    """How far designs are off their equalities of real numbers, relative, at worst; NaN where one is missing.

    Shape (designs,); 0 without such equalities.
    """
    points = len(plan.at)
    miss = np.zeros(len(outputs))
    for i, limit in enumerate(plan.subject_to):
        if limit.polished:
            values = outputs[:, points * i : points * (i + 1)]
            miss = np.maximum(miss, (np.abs(values - limit.value) / limit.scale).max(axis=1))
    return miss
