"""Searches without an engine: a plan and a function of points are run to the end."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker.planning.goals import Goal, GoalPlan, GoalPlanner, Variable
from sprag_study.worker.planning.rounds import Rows

Floats = NDArray[np.float64]
Function = Callable[[Floats], dict[str, Floats]]


def plan_of(variables: int | Sequence[Variable], goals: Sequence[str], **fields: Any) -> GoalPlan:
    """A plan over the unit cube, or those variables, that minimises those results; small unless told otherwise."""
    if isinstance(variables, int):
        variables = [Variable((f"x{i}",), 0.0, 1.0) for i in range(variables)]
    fields = {"population": 20, "generations": 10, "polish": False} | fields
    return GoalPlan(tuple(variables), tuple(Goal(name, max=False) for name in goals), **fields)


def rows_of(points: Floats, function: Function, ok: Callable[[Floats], NDArray[np.bool_]] | None = None) -> Rows:
    """The rows of points, some of which may fail."""
    good = np.ones(len(points), dtype=np.bool_) if ok is None else ok(points)
    return Rows(points, good, {name: np.where(good, values, np.nan) for name, values in function(points).items()})


def searched(plan: GoalPlan, function: Function, **kind: Any) -> tuple[GoalPlanner, list[Rows]]:
    """The planner at its end, and every round."""
    planner, rounds = GoalPlanner(plan), []
    while len(points := planner.ask().points):
        rounds.append(rows_of(points, function, **kind))
        planner.tell(rounds[-1])
    return planner, rounds


def joined(rounds: Sequence[Rows]) -> Rows:
    """All rounds as one."""
    values = {name: np.concatenate([rows.values[name] for rows in rounds]) for name in rounds[0].values}
    points, ok = np.concatenate([rows.points for rows in rounds]), np.concatenate([rows.ok for rows in rounds])
    return Rows(points, ok, values)
