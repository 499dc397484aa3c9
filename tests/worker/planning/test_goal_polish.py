"""The polish: equalities are met to 1e-6 by few designs, at little cost to the goals, within the other limits."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from sprag_study.worker.planning.goals import Goal, GoalPlan, GoalPlanner, Limit, Variable, front
from sprag_study.worker.planning.goals.polish import Polish
from sprag_study.worker.planning.goals.scores import misses, outputs_of, signs
from sprag_study.worker.planning.goals.space import Space
from tests.worker.planning.searching import Function, joined, plan_of, rows_of, searched

Floats = NDArray[np.float64]


def _curved(points: Floats) -> dict[str, Floats]:
    """A speed that bends, and two goals that draw to different places."""
    a, b, c = points[:, 0], points[:, 1], points[:, 2]
    return {
        "speed": 8.0 + 3.0 * np.sin(2.0 * (a - 0.5)) + 2.0 * (b - 0.5) ** 2 - 1.5 * np.exp(c) + 1.5 * np.exp(0.5),
        "f": (a - 0.2) ** 2 + (b - 0.4) ** 2 + c,
        "g": (a - 0.8) ** 2 + (b - 0.6) ** 2 + (1.0 - c),
        "torque": 4.0 + a + b,
    }


SPEED = Limit("speed", "is", 8.0, 0.16)


def _polished(plan: GoalPlan, function: Function = _curved) -> tuple[GoalPlanner, int]:
    """The planner at its end, and how many designs the polish took."""
    planner, rounds = searched(plan, function)
    found = front(plan, joined(rounds), equality=1e-6)
    summary, best = planner.ask().summary["polish"], planner.ask().summary["best"]
    # The best values are those of designs that are exact, not of the band around the equality.
    assert best == (found.goals[found.feasible].min(axis=0) * signs(plan)).tolist()
    assert summary["met"] == int(found.feasible.sum()) > 0
    assert found.miss[found.feasible].max() <= 1e-6
    assert summary["designs"] == sum(len(rows.points) for rows in rounds[plan.generations :]) // len(plan.at)
    return planner, summary["designs"]


def test_designs_of_the_front_are_moved_onto_an_equality() -> None:
    plan = plan_of(3, ["f", "g"], subject_to=(SPEED,), generations=20, polish=True)
    planner, rounds = searched(plan, _curved)
    rows = joined(rounds)
    wide, exact = front(plan, rows), front(plan, rows, equality=1e-6)
    assert exact.feasible.sum() >= 18, "nearly all of the 20 designs"
    # Each has a design of the search beside it that is hardly better.
    searched_goals = wide.goals[: plan.population * plan.generations]
    for goals in exact.goals[exact.feasible]:
        assert np.abs(searched_goals - goals).max(axis=1).min() < 0.05
    assert planner.ask().summary["polish"]["met"] == exact.feasible.sum()
    # What serves the derivatives only counts as no design: 2 for each of 3 ranges around each of 20.
    summary = planner.ask().summary
    counted = sum(summary[name] for name in ("feasible", "infeasible", "failed"))
    assert counted == len(rows.points) - 2 * 3 * 20
    assert len(rounds) <= planner.most_rounds
    assert len(rows.points) <= planner.most_cases


def test_goals_are_held_where_a_direction_allows_it() -> None:
    """The speed needs a + b = 1; the goal depends on a only: b moves."""
    plan = GoalPlan(
        (Variable(("a",), 0.0, 1.0), Variable(("b",), 0.0, 1.0)), (Goal("f", max=True), Goal("g", max=False)),
        (Limit("speed", "is", 1.0, 0.1),), population=20, generations=4,
    )  # fmt: skip

    def function(points: Floats) -> dict[str, Floats]:
        a, b = points.T
        return {"speed": a + b + 0.3 * (b - 0.5) ** 2, "f": a, "g": a**2}

    space, start = Space(plan), np.array([[0.6, 0.35]])

    def outputs(places: Floats) -> Floats:
        return outputs_of(plan, rows_of(space.designs(places), function))

    polish = Polish(plan, space, start, outputs(start))
    while not polish.done:
        last = polish.propose()
        polish.take(outputs(last))
    (a, b), miss = last[0], misses(plan, outputs(last))[0]
    assert miss <= 1e-6
    assert abs(a - 0.6) < 0.05 * abs(b - 0.35)


def test_one_goal_is_polished_at_its_optimum() -> None:
    plan = plan_of(3, ["f"], subject_to=(SPEED,), generations=40, polish=True)
    _, rounds = searched(plan, _curved)
    rows = joined(rounds)
    wide, exact = front(plan, rows), front(plan, rows, equality=1e-6)
    assert exact.goals[exact.rank == 0][0, 0] < wide.goals[wide.rank == 0][0, 0] + 0.05


def test_inequalities_stay_met() -> None:
    limits = (SPEED, Limit("torque", "at_most", 5.0))
    plan = plan_of(3, ["f", "g"], subject_to=limits, generations=20, polish=True)
    _polished(plan)


def test_catalogue_values_stay_and_one_range_is_enough() -> None:
    values = tuple(np.linspace(0.0, 1.0, 6).tolist())
    variables = [Variable(("a",), 0.0, 1.0, values), Variable(("b",), 0.0, 1.0, values), Variable(("c",), 0.0, 1.0)]
    plan = plan_of(variables, ["f", "g"], subject_to=(SPEED,), generations=20, polish=True)
    _polished(plan)
    every = [Variable((name,), 0.0, 1.0, values) for name in "abc"]
    planner, rounds = searched(plan_of(every, ["f", "g"], subject_to=(SPEED,), polish=True), _curved)
    assert planner.ask().summary["polish"] is None, "nothing can be moved"
    assert len(rounds) <= planner.most_rounds == 10


def test_an_equality_at_each_of_two_operating_points() -> None:
    def function(points: Floats) -> dict[str, Floats]:
        load = points[:, 3]
        return {name: values + (load * (points[:, 0] - 0.4) if name == "speed" else 0.0)
                for name, values in _curved(points).items()}  # fmt: skip

    plan = plan_of(
        3, ["f"], subject_to=(Limit("speed", "is", 8.0, 0.3),), at=({"load": 1.0}, {"load": 3.0}),
        generations=30, polish=True,
    )  # fmt: skip
    _polished(plan, function)


def test_what_is_met_already_takes_nothing() -> None:
    """A speed of 8 everywhere needs no round of the polish."""
    plan = plan_of(2, ["f", "g"], subject_to=(SPEED,), polish=True)

    def function(points: Floats) -> dict[str, Floats]:
        return {"speed": np.full(len(points), 8.0), "f": points[:, 0], "g": points[:, 1]}

    planner, rounds = searched(plan, function)
    assert len(rounds) == plan.generations
    assert planner.ask().summary["polish"] is None


def test_a_jump_beside_the_design_does_not_keep_the_polish_from_its_end() -> None:
    def function(points: Floats) -> dict[str, Floats]:
        values = _curved(points)
        return {**values, "speed": values["speed"] + np.where(points[:, 1] > 0.5, 0.4, 0.0)}

    plan = plan_of(3, ["f", "g"], subject_to=(SPEED,), generations=15, polish=True)
    planner, rounds = searched(plan, function, ok=lambda points: points[:, 2] < 0.7)
    assert len(rounds) <= planner.most_rounds
    assert planner.ask().summary["polish"]["met"] > 0


@pytest.mark.parametrize("polish", [False, True])
def test_the_bound_of_cases_counts_the_polish(polish: bool) -> None:
    planner = GoalPlanner(plan_of(3, ["f", "g"], subject_to=(SPEED,), polish=polish))
    assert planner.most_cases == 200 + (20 * (2 * 3 + 10) if polish else 0)
    assert planner.most_rounds == 10 + (11 if polish else 0)
