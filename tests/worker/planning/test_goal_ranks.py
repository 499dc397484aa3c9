"""Ranks of designs by their definition, Deb's rules, operating points, hypervolumes and crowding."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from sprag_study.worker.planning.goals import Goal, GoalPlan, Limit, Variable, front
from sprag_study.worker.planning.goals.hypervolume import hypervolume
from sprag_study.worker.planning.goals.ranking import crowding, fronts, ranks, spread, undominated
from sprag_study.worker.planning.goals.scores import Scores
from sprag_study.worker.planning.rounds import Rows
from tests.worker.planning.searching import plan_of

Floats = NDArray[np.float64]


def _dominates(a: Floats, b: Floats) -> bool:
    return bool((a <= b).all() and (a < b).any())


def _by_definition(goals: Floats) -> list[int]:
    """A design is in front k if the designs of the fronts before are all that dominate it."""
    found = [-1] * len(goals)
    rank = 0
    while -1 in found:
        left = [i for i, known in enumerate(found) if known < 0]
        best = [i for i in left if not any(_dominates(goals[j], goals[i]) for j in left)]
        for i in best:
            found[i] = rank
        rank += 1
    return found


@pytest.mark.parametrize("goals", [1, 2, 3, 4])
@pytest.mark.parametrize("coarse", [False, True], ids=["all different", "many equal"])
def test_fronts_are_those_of_the_definition(goals: int, coarse: bool) -> None:
    values = np.random.default_rng(goals).random((60, goals))
    if coarse:
        values = np.round(values * 4.0)
    assert fronts(values).tolist() == _by_definition(values)


def test_without_goals_all_are_in_one_front() -> None:
    assert fronts(np.empty((3, 0))).tolist() == [0, 0, 0]
    assert fronts(np.empty((0, 2))).tolist() == []


def test_designs_within_limits_come_first_then_less_violation_then_failed() -> None:
    goals = np.array([[1.0, 2.0], [2.0, 3.0], [0.0, 0.0], [0.0, 0.0], [np.nan, np.nan], [2.0, 1.0], [0.0, 0.0]])
    violation = np.array([0.0, 0.0, 0.5, 0.1, np.inf, 0.0, 0.5])
    assert ranks(Scores(goals, violation, np.empty((len(goals), 0)), np.zeros(len(goals)))).tolist() == [
        0,
        1,
        3,
        2,
        4,
        0,
        3,
    ]


def _front(plan: GoalPlan, values: dict[str, list[float]], ok: list[bool] | None = None) -> dict[str, list[object]]:
    cases = len(next(iter(values.values())))
    good = np.ones(cases, dtype=np.bool_) if ok is None else np.array(ok)
    columns = len(plan.paths)
    rows = Rows(np.zeros((cases, columns)), good, {name: np.array(one) for name, one in values.items()})
    found = front(plan, rows)
    names = ("goals", "violation", "feasible", "failed", "rank", "miss", "cases")
    return {name: getattr(found, name).tolist() for name in names}


def test_violations_are_relative_and_add_up() -> None:
    limits = (
        Limit("speed", "is", 8.0, 0.16),
        Limit("torque", "at_most", 5.0),
        Limit("power", "at_least", 2.0),
        Limit("order", "is", 1.0),
    )
    plan = plan_of(1, ["f"], subject_to=limits)
    found = _front(
        plan,
        {
            "f": [1.0] * 6,
            "speed": [8.0, 8.15, 8.32, 8.0, 8.0, np.nan],
            "torque": [5.0, 5.0, 6.0, 4.0, 4.0, 4.0],
            "power": [2.0, 2.0, 1.0, 3.0, 3.0, 3.0],
            "order": [1.0, 1.0, 1.0, 2.0, np.nan, 1.0],
        },
    )
    assert found["violation"] == pytest.approx([0.0, 0.0, 0.02 + 0.2 + 0.5, 1.0, 1.0, 1.0], abs=1e-12)
    assert found["feasible"][:2] == [True, True]
    assert found["failed"] == [False] * 6, "a missing value of a limit is a violation, not a failure"
    assert found["miss"] == pytest.approx([0.0, 0.15 / 8.0, 0.04, 0.0, 0.0, np.nan], nan_ok=True)


def test_failed_cases_and_missing_goals_are_ranked_last() -> None:
    plan = plan_of(1, ["f", "g"], subject_to=(Limit("speed", "at_most", 1.0),))
    found = _front(
        plan,
        {"f": [1.0, 0.0, np.nan, np.nan], "g": [1.0, 0.0, 1.0, 1.0], "speed": [1.0, 0.0, 0.0, 9.0]},
        ok=[True, False, True, True],
    )
    assert found["failed"] == [False, True, True, False], "outside the limits, a goal need not have a value"
    assert found["rank"] == [0, 2, 2, 1]


@pytest.mark.parametrize(("over", "expected"), [("worst", [[3.0, 1.0]]), ("mean", [[2.0, 2.0]])])
def test_goals_over_operating_points(over: str, expected: list[list[float]]) -> None:
    at = tuple({"load": load} for load in (0.1, 0.2, 0.3))
    goals = (Goal("loss", max=False), Goal("speed", max=True))
    plan = GoalPlan((Variable(("x",), 0.0, 1.0),), goals, (Limit("speed", "at_least", 2.0),), at, over)  # type: ignore[arg-type]
    found = _front(plan, {"loss": [1.0, 2.0, 3.0], "speed": [3.0, 2.0, 1.0]})
    assert found["goals"] == expected
    assert found["violation"] == [0.5], "a limit must hold at each operating point"
    assert found["cases"] == [[0, 1, 2]]
    assert _front(plan, {"loss": [1.0] * 3, "speed": [3.0] * 3}, [True, False, True])["failed"] == [True]


def test_rows_of_a_part_of_a_design_are_refused() -> None:
    plan = plan_of(1, ["f"], at=({"load": 1.0}, {"load": 2.0}))
    with pytest.raises(ValueError, match="3 rows are not those of whole designs, which have 2 each"):
        _front(plan, {"f": [1.0, 2.0, 3.0]})


def test_hypervolumes_of_boxes() -> None:
    assert hypervolume(np.array([[2.0], [1.0], [9.0]]), np.array([4.0])) == 3.0
    steps = np.array([[0.0, 2.0], [1.0, 1.0], [2.0, 0.0], [1.5, 1.5], [5.0, -1.0]])
    assert hypervolume(steps, np.array([3.0, 3.0])) == 1.0 + 2.0 + 3.0
    corners = np.array([[0.0, 1.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 0.0]])
    assert hypervolume(corners, np.array([2.0, 2.0, 2.0])) == 4.0
    assert hypervolume(corners, np.array([0.0, 0.0, 0.0])) == 0.0
    with pytest.raises(ValueError, match="at most 3"):
        hypervolume(np.zeros((1, 4)), np.ones(4))


def test_hypervolume_of_three_goals_agrees_with_counting() -> None:
    rng = np.random.default_rng(3)
    goals, places = rng.random((12, 3)), rng.random((20_000, 3))
    inside = (goals[:, None, :] <= places[None, :, :]).all(axis=2).any(axis=0)
    assert hypervolume(goals, np.ones(3)) == pytest.approx(inside.mean(), abs=0.012)


@pytest.mark.parametrize("goals", [2, 3])
def test_hypervolume_and_front_of_designs_on_a_grid_are_those_of_its_cells(goals: int) -> None:
    """With many equal goals, taken a few at a time."""
    rng = np.random.default_rng(goals)
    places = np.stack(np.meshgrid(*[np.arange(6) + 0.5] * goals), axis=-1).reshape(-1, goals)
    for _ in range(20):
        designs = rng.integers(0, 7, (15, goals)).astype(float)
        cells = (designs[:, None, :] <= places[None, :, :]).all(axis=2).any(axis=0)
        assert hypervolume(designs, np.full(goals, 6.0)) == cells.sum()
        front = np.empty((0, goals))
        for part in np.split(designs, 5):
            front = undominated(front, part)
        assert {*map(tuple, front)} == {*map(tuple, designs[fronts(designs) == 0])}


def test_crowding_is_the_distance_of_the_neighbours() -> None:
    values = np.array([[0.0, 10.0], [1.0, 6.0], [4.0, 0.0], [2.0, 5.0]])
    assert crowding(values).tolist() == [np.inf, 2.0 / 4.0 + 5.0 / 10.0, np.inf, 3.0 / 4.0 + 6.0 / 10.0]
    assert crowding(np.full((3, 2), np.nan)).tolist() == [0.0] * 3


def test_of_a_cluster_one_design_is_kept() -> None:
    line = np.array([0.0, 0.3, 0.301, 0.302, 0.6, 1.0])
    chosen, distance = spread(np.stack([line, 1.0 - line], axis=1), 4)
    assert [round(value, 1) for value in line[chosen]] == [0.0, 0.3, 0.6, 1.0]
    kept = line[chosen]
    assert distance.tolist() == pytest.approx(crowding(np.stack([kept, 1.0 - kept], axis=1)).tolist())
