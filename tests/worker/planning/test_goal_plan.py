"""Plans of searches: their JSON, their columns, and what is refused."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from sprag_study.worker.planning.goals import GoalPlan, GoalPlanner

PLAN: dict[str, Any] = {
    "kind": "goal",
    "vary": [
        {"paths": ["excitation.amplitude_x", "excitation.amplitude_y"], "low": 0.001, "high": 0.003},
        {"paths": ["pendulums.0.arm"], "values": [0.02, 0.03]},
    ],
    "best": [{"result": "efficiency", "max": True}, {"result": "shaft.irregularity", "max": False}],
    "subject_to": [
        {"result": "shaft.speed.mean", "is": 8.0, "within": 0.16},
        {"result": "torque.max", "at_most": 5.0},
        {"result": "efficiency", "at_least": 0.1},
        {"result": "regime.order", "is": 1.0},
    ],
    "at": [{"shaft.load": 0.2, "gravity": 9.8}, {"gravity": 9.8, "shaft.load": 0.3}],
    "over": "mean",
    "population": 8,
    "generations": 3,
    "seed": 5,
    "polish": True,
}


@pytest.mark.parametrize("more", [{}, {"start": [[0.0015, 0.03], [0.003, 0.02]]}])
def test_a_plan_comes_back_from_its_json(more: dict[str, Any]) -> None:
    plan = GoalPlan.from_json(json.loads(json.dumps(PLAN | more)))
    assert plan.to_json() == PLAN | more
    assert GoalPlan.from_json(plan.to_json()) == plan


def test_what_is_not_given_has_a_default() -> None:
    plan = GoalPlan.from_json({name: PLAN[name] for name in ("vary", "best", "population", "generations", "seed")})
    assert (plan.subject_to, plan.at, plan.over, plan.polish) == ((), ({},), "worst", True)
    assert GoalPlan.from_json(plan.to_json()) == plan


def test_columns_are_the_variables_then_the_operating_points() -> None:
    planner = GoalPlanner(GoalPlan.from_json(PLAN))
    assert planner.paths == (
        ("excitation.amplitude_x", "excitation.amplitude_y"), ("pendulums.0.arm",), ("shaft.load",), ("gravity",),
    )  # fmt: skip
    assert planner.results == ("efficiency", "shaft.irregularity", "shaft.speed.mean", "torque.max", "regime.order")
    points = planner.ask().points
    assert points.shape == (16, 4)
    assert np.array_equal(points[::2, :2], points[1::2, :2]), "the cases of a design stand together"
    assert points[:, 2].tolist() == [0.2, 0.3] * 8
    assert set(points[:, 3]) == {9.8}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"vary": []}, "goal.vary"),
        ({"vary": [{"paths": ["a"], "low": 2.0, "high": 2.0}]}, "goal.vary.0.high is 2.0"),
        ({"vary": [{"paths": ["a"], "values": [1.0, float("inf")]}]}, "goal.vary.0.values"),
        ({"vary": [{"paths": [], "low": 0.0, "high": 1.0}]}, "goal.vary.0.paths"),
        ({"vary": [{"paths": ["shaft.load"], "low": 0.0, "high": 1.0}]}, "goal.vary is"),
        ({"best": [], "subject_to": []}, "goal.best is"),
        ({"subject_to": [{"result": "a", "is": 1.0, "within": -1.0}]}, "goal.subject_to.0.within is -1.0"),
        ({"subject_to": [{"result": "a", "at_most": float("nan")}]}, "goal.subject_to.0.at_most is nan"),
        ({"subject_to": [{"result": "a"}]}, "goal.subject_to.0"),
        ({"at": [{"a": 1.0}, {"b": 1.0}]}, "goal.at.1"),
        ({"over": "least"}, "goal.over is least"),
        ({"population": 3}, "goal.population is 3"),
        ({"generations": 0}, "goal.generations is 0"),
        ({"seed": -1}, "goal.seed is -1"),
        ({"population": 10_000, "generations": 1_000}, "goal.population is 10000"),
    ],
)
def test_what_is_out_of_range_is_refused_by_name(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        GoalPlan.from_json(PLAN | change)


def test_what_is_missing_is_named() -> None:
    with pytest.raises(ValueError, match="population"):
        GoalPlan.from_json({name: value for name, value in PLAN.items() if name != "population"})
