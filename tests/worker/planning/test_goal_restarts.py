"""Searches for one goal that start anew with more designs, end by themselves, and are made longer."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from sprag_study.worker.planning.goals import GoalPlan, GoalPlanner, Limit, Variable
from tests.worker.planning.searching import Function, joined, plan_of, searched

Floats = NDArray[np.float64]


def _schwefel(points: Floats) -> dict[str, Floats]:
    """Schwefel's function 2.26: least, 0, at 420.9687, far from the next best of its many minima."""
    count = points.shape[1]
    return {"f": 418.9828872724339 * count - (points * np.sin(np.sqrt(np.abs(points)))).sum(axis=1)}


def _sphere(points: Floats) -> dict[str, Floats]:
    return {"f": 1.0 + ((points - 0.3) ** 2).sum(axis=1)}


def _plan(**fields: object) -> GoalPlan:
    vary = [Variable((f"x{i}",), -500.0, 500.0) for i in range(4)]
    return plan_of(vary, ["f"], **{"growing": True, "finish": True} | fields)


def _least(plan: GoalPlan, function: Function) -> float:
    return float(joined(searched(plan, function)[1]).values["f"].min())


def test_schwefel_s_function_is_left_by_restarts_with_more_designs() -> None:
    """Of eleven seeds four reach the least value without them, within 2000 designs, and eight with them."""
    reached = {
        growing: sum(
            _least(_plan(generations=100, seed=seed, growing=growing), _schwefel) < 1e-6 for seed in range(1, 6)
        )
        for growing in (False, True)
    }
    assert reached[True] > reached[False]


def test_generations_double_where_the_search_starts_anew() -> None:
    plan = plan_of(3, ["f"], generations=150, growing=True, finish=True)
    planner, rounds = searched(plan, _sphere)
    ends = np.cumsum([len(rows.points) for rows in rounds])
    sizes = [len(rows.points) for rows, end in zip(rounds, ends, strict=True) if end <= 20 * 150]
    assert sum(sizes) == 20 * 150 < ends[-1] <= planner.most_cases
    assert sorted(set(sizes[:-1])) == [20, 40, 80]
    assert sizes[:-1] == sorted(sizes[:-1])
    summary = planner.ask().summary
    assert summary["generation"] == 150, "those of two and four times as many designs count twice and four times"


@pytest.mark.parametrize("growing", [False, True])
def test_a_longer_search_has_every_design_of_a_shorter_one(growing: bool) -> None:
    plans = (_plan(generations=count, growing=growing, finish=False) for count in (70, 110))
    short, long = ({row.tobytes() for row in joined(searched(plan, _schwefel)[1]).points} for plan in plans)
    assert len(short) == 1400
    assert short < long


def test_a_search_ends_by_itself_where_starting_anew_gains_nothing() -> None:
    plan = plan_of(3, ["f"], generations=500, growing=True, least_gain=1e-3, finish=True)
    planner, rounds = searched(plan, _sphere)
    summary = planner.ask().summary
    assert summary["phase"] == "ended"
    assert summary["generation"] < 150
    assert len(joined(rounds).points) < planner.most_cases / 3
    assert summary["best"] == [pytest.approx(1.0, abs=1e-9)]
    again = GoalPlanner(GoalPlan.from_json(plan.to_json()))
    for rows in rounds:
        assert again.ask().points.tobytes() == rows.points.tobytes()
        again.tell(rows)
    assert again.ask().summary == summary


def test_a_search_that_has_no_design_within_its_limits_does_not_end_by_itself() -> None:
    plan = plan_of(2, ["f"], generations=60, growing=True, least_gain=0.5, subject_to=(Limit("f", "at_most", 0.5),))
    planner, _ = searched(plan, _sphere)
    assert planner.ask().summary["generation"] == 60


def test_plans_of_before_have_generations_of_one_size_to_their_last() -> None:
    plan = GoalPlan.from_json(plan_of(3, ["f"], generations=120).to_json())
    _, rounds = searched(plan, _sphere)
    assert [len(rows.points) for rows in rounds] == [20] * 120
