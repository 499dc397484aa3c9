"""Fresh drives of the best designs: an unbiased yield beside closed forms, which designs have them, and rounds."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from sprag_study.worker.planning.goals import Goal, GoalPlan, GoalPlanner, Limit, Variable, front
from sprag_study.worker.planning.goals.fresh import most_fresh
from sprag_study.worker.planning.goals.robust import Table
from sprag_study.worker.planning.rounds import Rows
from tests.worker.planning.searching import joined, rows_of

Floats = NDArray[np.float64]
DESIGNS, DRIVES, FRESH = 40, 32, 400


def searched(plan: GoalPlan, function: Any) -> tuple[GoalPlanner, list[Rows], list[str]]:
    """The planner at its end, every round, and the phase in which each was asked for."""
    planner, rounds, phases = GoalPlanner(plan), [], []
    while len((step := planner.ask()).points):
        phases.append(step.summary["phase"])
        rounds.append(rows_of(step.points, function))
        planner.tell(rounds[-1])
    return planner, rounds, phases


def yields(seed: int) -> tuple[float, float]:
    """The yield that a search has chosen of designs that are all equally good, and the one with fresh drives."""
    choices = tuple(float(number) for number in range(DESIGNS))
    goal = Goal("", max=True, conditions=(Limit("f", "at_most", 1.0),))
    plan = GoalPlan(
        (Variable(("x",), 0.0, choices[-1], choices),), (goal,), population=DESIGNS, generations=1, drives=DRIVES,
        fresh=FRESH, start=tuple((number,) for number in choices),
    )  # fmt: skip
    # Design k reads normal number k of a drive, so that the designs are independent and of one yield.
    draws = np.random.default_rng(seed).normal(size=(1 + DRIVES + FRESH, DESIGNS))
    _, rounds, phases = searched(
        plan, lambda points: {"f": draws[points[:, 1].astype(np.int64), points[:, 0].astype(np.int64)]}
    )
    assert phases == ["search", "fresh"]
    best = front(plan, rounds[0])
    place = int(np.lexsort((-best.goals[:, 0], best.rank))[0])
    assert (rounds[1].points[:, 0] == best.variables[place, 0]).all()
    np.testing.assert_array_equal(rounds[1].points[:, 1], 1 + DRIVES + np.arange(FRESH))
    return float(best.goals[place, 0]), float((rounds[1].values["f"] <= 1.0).mean())


def test_the_yield_of_the_search_is_too_high_by_the_closed_form_and_that_of_fresh_drives_is_not() -> None:
    """The largest of 40 binomial yields has the mean of their order statistic; a fresh yield that of a single one."""
    true = float(stats.norm.cdf(1.0))
    below = stats.binom.cdf(np.arange(DRIVES), DRIVES, true) ** DESIGNS
    largest = float((1.0 - below).sum() / DRIVES)
    chosen, fresh = np.array([yields(seed) for seed in range(60)]).T
    assert largest > true + 0.1
    assert abs(chosen.mean() - largest) < 4.0 * chosen.std() / np.sqrt(60.0)
    assert abs(fresh.mean() - true) < 4.0 * np.sqrt(true * (1.0 - true) / FRESH / 60.0)


def _tradeoff(points: Floats) -> dict[str, Floats]:
    drive = 0.1 * np.sin(points[:, -1])
    return {"f": points[:, 0] + drive, "g": 1.0 - points[:, 0] + points[:, 1] ** 2 + drive}


@pytest.mark.parametrize("names", [(), ("f",), ("f", "g")])
def test_the_best_design_of_each_goal_has_fresh_drives_at_every_operating_point(names: tuple[str, ...]) -> None:
    variables = tuple(Variable((path,), -1.0, 1.0) for path in ("x", "y"))
    plan = GoalPlan(
        variables, tuple(Goal(name, False, 0.5) for name in names), (Limit("f", "at_least", -0.5, quantile=0.1),),
        at=({"load": 1.0}, {"load": 2.0}), population=8, generations=3, drives=3, fresh=5,
    )  # fmt: skip
    planner, rounds, phases = searched(plan, _tradeoff)
    ranked = front(plan, joined(rounds[:-1]))
    best = {int(np.where(ranked.rank == 0, goal, np.inf).argmin()) for goal in ranked.goals.T} or {
        int(ranked.rank.argmin())
    }
    expected = ranked.variables[sorted(best)]
    assert len(expected) == len(names or "-") == most_fresh(plan)
    np.testing.assert_array_equal(rounds[-1].points[::10, :2], expected)
    np.testing.assert_array_equal(rounds[-1].points[:10, 2], np.repeat([1.0, 2.0], 5))
    np.testing.assert_array_equal(rounds[-1].points[:10, 3], np.tile(np.arange(4.0, 9.0), 2))
    assert phases == ["search"] * 3 + ["fresh"]
    assert len(joined(rounds).points) == planner.most_cases
    assert planner.most_rounds == 4


def test_the_rounds_before_are_those_without_fresh_drives_and_another_planner_asks_for_the_same() -> None:
    plan = GoalPlan(
        (Variable(("x",), -1.0, 1.0), Variable(("y",), -1.0, 1.0)), (Goal("g", False, 0.5),),
        (Limit("f", "is", 0.25, 0.1),), population=8, generations=4, drives=3, fresh=5, finish=True,
    )  # fmt: skip
    planner, rounds, phases = searched(plan, _tradeoff)
    _, without, _ = searched(replace(plan, fresh=0), _tradeoff)
    assert [rows.points.tobytes() for rows in rounds[:-1]] == [rows.points.tobytes() for rows in without]
    assert "polish" in phases
    assert GoalPlan.from_json(plan.to_json()) == plan
    again = GoalPlanner(plan)
    for rows in rounds:
        assert again.ask().points.tobytes() == rows.points.tobytes()
        again.tell(rows)
    # A case that is run again and makes another design the best: that one has fresh drives, too, and nothing else.
    first = rounds[0]
    better = {name: values.copy() for name, values in first.values.items()}
    better["f"][:4], better["g"][:4] = 0.25, -9.0
    again = GoalPlanner(plan)
    for rows in (Rows(first.points, first.ok, better), *rounds[1:]):
        again.tell(rows)
    step = again.ask()
    assert step.summary["phase"] == "fresh"
    np.testing.assert_array_equal(step.points[:, :2], np.repeat(first.points[:1, :2], 5, axis=0))
    again.tell(rows_of(step.points, _tradeoff))
    assert not len(again.ask().points)
    assert not len(planner.ask().points)


def test_a_design_without_usable_drives_has_none() -> None:
    goal = Goal("f", False, 0.5)
    plan = GoalPlan((Variable(("x",), 0.0, 1.0),), (goal,), population=4, generations=1, drives=2, fresh=3)
    planner = GoalPlanner(plan)
    points = planner.ask().points
    rows = Rows(points, np.zeros(len(points), dtype=np.bool_), {"f": np.zeros(len(points))})
    assert Table(plan, rows).failed.all()
    planner.tell(rows)
    assert not len(planner.ask().points)
    with pytest.raises(ValueError, match="fresh"):
        replace(plan, best=(Goal("f", max=False),), drives=0)
