"""Intervals of what fresh drives show, beside distributions whose mean and deviation are known."""

from __future__ import annotations

import numpy as np
import pytest

from sprag_study.service.results.fresh import interval
from sprag_study.worker.planning.goals import Goal, GoalPlan, Variable
from sprag_study.worker.planning.goals.robust import Table
from sprag_study.worker.planning.rounds import Rows

DRIVES, SEEDS = 400, 300


@pytest.mark.parametrize(
    ("goal", "true"),
    [
        (Goal("f", True, statistic="mean"), 1.0),
        (Goal("f", True, statistic="deviation"), 1.0),
        (Goal("f", True, statistic="mean", deviations=-3.0), -2.0),
        (Goal("f", True, statistic="mean", deviations=2.0), 3.0),
    ],
)
def test_the_intervals_hold_for_drives_with_an_exponential_result(goal: Goal, true: float) -> None:
    """Of a skewed distribution with mean and deviation 1: 95 % of the intervals contain what the goal is about."""
    # Operating points stand for samples here.
    points = tuple({"load": float(seed)} for seed in range(SEEDS))
    plan = GoalPlan((Variable(("x",), 0.0, 1.0),), (goal,), at=points, drives=DRIVES)
    values = np.random.default_rng(5).exponential(size=SEEDS * (DRIVES + 1))
    rows = Rows(np.zeros((len(values), 3)), np.ones(len(values), dtype=np.bool_), {"f": values})
    found = interval(goal, Table(plan, rows), DRIVES)
    assert ((found.low < found.values) & (found.values < found.high)).all()
    assert 0.91 <= ((found.low <= true) & (true <= found.high)).mean() <= 0.98


def test_a_drive_without_a_result_leaves_a_mean_and_its_interval_open() -> None:
    goal = Goal("f", True, statistic="mean")
    plan = GoalPlan((Variable(("x",), 0.0, 1.0),), (goal,), drives=3)
    rows = Rows(np.zeros((4, 2)), np.array([True, True, False, True]), {"f": np.ones(4)})
    found = interval(goal, Table(plan, rows), 3)
    assert np.isnan([found.values[0], found.low[0], found.high[0]]).all()
