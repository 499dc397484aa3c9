"""Searches: the same rounds for the same rows, known fronts and optima, bounds, catalogues, failures, the end."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sprag_study.worker.planning.goals import GoalPlan, GoalPlanner, Limit, Variable, front
from sprag_study.worker.planning.goals.hypervolume import hypervolume
from sprag_study.worker.planning.goals.record import Record
from sprag_study.worker.planning.goals.scores import Scores
from sprag_study.worker.planning.rounds import Rows
from tests.worker.planning.searching import joined, plan_of, rows_of, searched

Floats = NDArray[np.float64]
MIXED = (Variable(("a",), -1.0, 2.0), Variable(("b",), 1.0, 7.0, (1.0, 2.0, 4.0, 7.0)), Variable(("c",), 3.0, 4.0))


def _two(points: Floats) -> dict[str, Floats]:
    """Both goals are best between two points; a limit cuts a corner off."""
    x = points[:, 0]
    rest = ((points[:, 1:] - 0.5) ** 2).sum(axis=1)
    return {"f": (x - 0.25) ** 2 + rest, "g": (x - 0.75) ** 2 + rest, "c": points[:, 0] + points[:, 1]}


def _one(points: Floats) -> dict[str, Floats]:
    return {"f": ((points - 0.3) ** 2).sum(axis=1), "c": points.sum(axis=1)}


def _plans() -> dict[str, GoalPlan]:
    limit = (Limit("c", "at_most", 1.2),)
    equal = (Limit("c", "is", 1.0, 0.05),)
    return {
        "two goals": plan_of(3, ["f", "g"], subject_to=limit),
        "two goals, catalogue, polish": plan_of(
            MIXED, ["f", "g"], subject_to=(Limit("c", "is", 5.0, 1.0),), polish=True
        ),
        "one goal": plan_of(3, ["f"], subject_to=equal, polish=True),
        "one goal, catalogue": plan_of(MIXED, ["f"]),
        "limits only": plan_of(3, [], subject_to=equal),
        "operating points": plan_of(2, ["f", "g"], at=({"x2": 0.4}, {"x2": 0.7})),
    }


def _needle(points: Floats) -> dict[str, Floats]:
    """Best at one design, whose surroundings do not tell of it."""
    there = (points == NEEDLE).all(axis=1)
    away = ((points - 0.5) ** 2).sum(axis=1)
    return {"f": np.where(there, -1.0, away), "g": np.where(there, -1.0, 1.0 - away)}


#: Values that their coordinates do not give back: 1 + 6 x ((v - 1) / 6).
NEEDLE = np.array([1.1, 0.9, 4.0])
KNOWN = (Variable(("a",), 1.0, 7.0), Variable(("b",), -0.3, 1.7), Variable(("c",), 1.0, 7.0, (1.0, 2.0, 4.0, 7.0)))


@pytest.mark.parametrize("goals", [["f"], ["f", "g"], []])
def test_known_designs_are_in_the_first_generation_and_never_lost(goals: list[str]) -> None:
    limit = () if goals else (Limit("f", "at_most", 0.0),)
    start = ((6.7, 1.7, 1.0), tuple(NEEDLE.tolist()))
    plan = plan_of(KNOWN, goals, subject_to=limit, start=start)
    planner, rounds = searched(plan, _needle)
    assert rounds[0].points[:2].tolist() == [list(one) for one in start]
    assert len(rounds[0].points) == plan.population
    assert planner.best()[0][0].tolist() == NEEDLE.tolist()
    assert not (searched(plan_of(KNOWN, goals, subject_to=limit), _needle)[0].best()[0] == NEEDLE).all(axis=1).any()
    again = GoalPlanner(plan)
    for rows in rounds:
        assert again.ask().points.tobytes() == rows.points.tobytes()
        again.tell(rows)


def test_a_catalogue_smaller_than_its_known_designs_is_searched_whole() -> None:
    values = Variable(("a",), 1.0, 3.0, (1.0, 2.0, 3.0))
    planner, rounds = searched(plan_of((values,), ["f"], start=((3.0,), (3.0,), (1.0,))), _one)
    assert sorted(joined(rounds).points[:, 0].tolist()) == [1.0, 2.0, 3.0]
    assert planner.best()[0][0].tolist() == [1.0]


@pytest.mark.parametrize("name", _plans())
def test_a_planner_told_the_same_rounds_asks_for_the_same_points(name: str) -> None:
    plan = _plans()[name]
    function = _two if len(plan.best) != 1 else _one
    planner, rounds = searched(plan, function)
    assert len(rounds) > plan.generations // 2
    again = GoalPlanner(GoalPlan.from_json(plan.to_json()))
    for rows in rounds:
        assert again.ask().points.tobytes() == rows.points.tobytes()
        assert again.ask().points.tobytes() == rows.points.tobytes(), "asking changes nothing"
        again.tell(rows)
    assert len(again.ask().points) == 0
    assert again.ask().summary == planner.ask().summary


@pytest.mark.parametrize("name", _plans())
def test_no_design_comes_twice_and_bounds_and_catalogues_are_kept(name: str) -> None:
    plan = _plans()[name]
    planner, rounds = searched(plan, _two if len(plan.best) != 1 else _one)
    points = joined(rounds).points
    assert len(np.unique(points, axis=0)) == len(points) <= planner.most_cases
    assert len(rounds) <= planner.most_rounds
    for column, variable in zip(points.T, plan.vary, strict=False):
        assert column.min() >= variable.low
        assert column.max() <= variable.high
        if variable.values:
            assert set(column) == set(variable.values), "each value is tried, and no other"


def test_a_catalogue_bounds_cases_and_rounds() -> None:
    plan = plan_of((Variable(("a",), 1.0, 4.0, (1.0, 2.0, 4.0)), Variable(("b",), 0.2, 0.2, (0.2,))), ["f", "g"])
    planner, rounds = searched(plan, _two)
    assert (planner.most_cases, planner.most_rounds) == (3, 3)
    assert sum(len(rows.points) for rows in rounds) == 3


def test_another_seed_asks_for_other_points() -> None:
    first, second = (GoalPlanner(plan_of(3, ["f", "g"], seed=seed)).ask().points for seed in (1, 2))
    assert not np.array_equal(first, second)


def test_the_points_of_a_seed_stay_what_they_are() -> None:
    """A changed search must not go on with a study that an older one began."""
    for name, expected in {"two goals": PINNED_TWO, "one goal": PINNED_ONE}.items():
        planner = GoalPlanner(_plans()[name])
        for _ in range(3):
            points = planner.ask().points
            planner.tell(rows_of(points, _two if name == "two goals" else _one))
        assert planner.ask().points[0].tolist() == expected


@pytest.mark.parametrize("name", _plans())
def test_any_designs_of_the_plan_can_be_told(name: str) -> None:
    """Cases that failed are run again and differ, so that the rounds after them are those of another planner."""
    plan = _plans()[name]
    function = _two if len(plan.best) != 1 else _one
    _, rounds = searched(plan, function, ok=lambda points: points[:, 0] > 0.3)
    replays = [GoalPlanner(plan), GoalPlanner(plan)]
    for planner in replays:
        for rows in rounds:
            planner.tell(rows_of(rows.points, function))
        cases = sum(len(rows.points) for rows in rounds)
        while len(points := planner.ask().points):
            planner.tell(rows_of(points, function))
            cases += len(points)
        assert cases <= planner.most_cases
    assert replays[0].ask().summary == replays[1].ask().summary
    assert replays[0].ask().summary["failed"] == 0
    assert np.array_equal(replays[0].best()[0], replays[1].best()[0])


def test_rows_that_are_not_of_the_plan_are_refused() -> None:
    planner = GoalPlanner(plan_of(MIXED, ["f", "g"], at=({"x3": 1.0}, {"x3": 2.0})))
    points = planner.ask().points
    for column, value, message in ((0, 2.5, "a: 2.5 is not a value"), (1, 3.0, "b: 3.0"), (3, 1.5, "operating points")):
        wrong = points.copy()
        wrong[:2, column] = value
        with pytest.raises(ValueError, match=message):
            planner.tell(rows_of(wrong, _two))


def _zdt1(points: Floats) -> dict[str, Floats]:
    g = 1.0 + 9.0 * points[:, 1:].mean(axis=1)
    return {"f": points[:, 0], "g": g * (1.0 - np.sqrt(points[:, 0] / g))}


def test_two_goals_reach_the_front_of_zdt1() -> None:
    planner, rounds = searched(plan_of(6, ["f", "g"], population=40, generations=60), _zdt1)
    _, scores = planner.best()
    assert hypervolume(scores.goals, np.array([1.1, 1.1])) > 0.98 * (1.21 - 1.0 / 3.0)
    assert sum(len(rows.points) for rows in rounds) == 2400
    summary = planner.ask().summary
    assert summary["phase"] == "ended"
    # Of all designs of the search, not only of the last survivors.
    reference, every = np.array(summary["reference"]), joined(rounds)
    goals = np.stack([every.values["f"], every.values["g"]], axis=1)
    assert summary["hypervolume"] == pytest.approx(hypervolume(goals, reference), rel=1e-12)
    assert summary["hypervolume"] >= hypervolume(scores.goals, reference)
    assert summary["best"] == scores.goals.min(axis=0).tolist()
    assert (summary["feasible"], summary["infeasible"], summary["failed"]) == (2400, 0, 0)


def test_the_hypervolume_counts_from_the_generation_of_which_half_is_within_the_limits() -> None:
    """Two early designs in a corner, whose worst goals are (6, 0.1), and a front that lies elsewhere."""
    plan = plan_of(2, ["f", "g"], population=20)
    record = Record(plan)

    def scores(goals: list[tuple[float, float]]) -> Scores:
        filled = np.array(goals + [(np.nan, np.nan)] * (20 - len(goals)))
        return Scores(filled, np.where(np.isnan(filled[:, 0]), 1.0, 0.0), filled, np.zeros(len(filled)))

    early = scores([(5.0, 0.1), (6.0, 0.05)])
    record.generation(early, early, 1)
    assert record.summary("search")["hypervolume"] is None
    late = scores([(k, 10.0 - k) for k in range(10)])
    record.generation(late, late, 2)
    summary = record.summary("search")
    assert summary["reference"] == [9.0, 10.0]
    # The early ones still dominate the strips to their right.
    assert summary["hypervolume"] == pytest.approx(sum(range(5)) + 9.9 + 3 * 9.95)
    best = scores([(k, 9.0 - k) for k in range(10)])
    record.generation(best, best, 3)
    better = record.summary("search")["hypervolume"]
    assert better > summary["hypervolume"]
    record.generation(late, late, 4)  # survivors that dominate less
    assert record.summary("search")["hypervolume"] == better


def test_one_goal_is_found_with_a_limit_that_is_active() -> None:
    """Least distance from 0.9 on the unit cube with a sum of at most 0.9: at 0.3 each."""
    plan = plan_of(3, ["f"], subject_to=(Limit("c", "at_most", 0.9),), generations=60)

    def function(points: Floats) -> dict[str, Floats]:
        return {"f": ((points - 0.9) ** 2).sum(axis=1), "c": points.sum(axis=1)}

    _, rounds = searched(plan, function)
    found = front(plan, joined(rounds))
    assert found.variables[found.rank == 0][0] == pytest.approx([0.3] * 3, abs=5e-3)


def test_one_goal_is_found_on_a_bound_and_in_a_catalogue() -> None:
    variables = (*MIXED[:2], Variable(("c",), 3.0, 4.0), Variable(("d",), 0.0, 9.0, tuple(range(10))))

    def function(points: Floats) -> dict[str, Floats]:
        a, b, c, d = points.T
        return {"f": (a - 0.5) ** 2 + (b - 4.0) ** 2 + c + (d - 6.0) ** 2 + 0.2 * (a - 0.5) * (d - 6.0)}

    plan = plan_of(variables, ["f"], generations=50)
    _, rounds = searched(plan, function)
    found = front(plan, joined(rounds))
    assert found.variables[found.rank == 0][0] == pytest.approx([0.5, 4.0, 3.0, 6.0], abs=2e-3)


def test_designs_within_limits_alone() -> None:
    plan = plan_of(4, [], subject_to=(Limit("c", "is", 1.0, 0.01), Limit("f", "at_most", 0.3)), generations=20)
    planner, rounds = searched(plan, _one)
    designs, scores = planner.best()
    assert scores.feasible.all()
    assert np.ptp(designs, axis=0).min() > 0.05, "they are spread"
    assert front(plan, joined(rounds)).feasible.sum() > 20


def test_a_small_catalogue_ends_when_all_is_known() -> None:
    variables = (Variable(("a",), 0.0, 3.0, (0.0, 1.0, 2.0, 3.0)), Variable(("b",), 0.0, 2.0, (0.0, 1.0, 2.0)))
    for goals in (["f"], ["f", "g"]):
        planner, rounds = searched(plan_of(variables, goals, generations=200), _two)
        assert len(joined(rounds).points) == 12
        assert planner.ask().summary["phase"] == "ended"


@pytest.mark.parametrize("goals", [["f"], ["f", "g"]])
def test_failed_designs_are_counted_and_survived(goals: list[str]) -> None:
    plan = plan_of(3, goals)

    def holds(points: Floats) -> NDArray[np.bool_]:
        return points[:, 2] > 0.4

    planner, rounds = searched(plan, _two, ok=holds)
    rows = joined(rounds)
    failed = int(np.count_nonzero(~holds(rows.points)))
    assert failed > 0
    assert planner.ask().summary["failed"] == failed
    assert planner.best()[1].feasible.all()
    found = front(plan, rows)
    assert (found.rank[found.failed] == found.rank.max()).all()


@pytest.mark.parametrize("goals", [[], ["f"], ["f", "g"]])
def test_a_search_where_everything_fails_goes_on_to_its_end(goals: list[str]) -> None:
    plan = plan_of(3, goals, subject_to=(Limit("c", "is", 1.0, 0.1),), polish=True)
    planner, rounds = searched(plan, _two, ok=lambda points: np.zeros(len(points), dtype=np.bool_))
    assert len(rounds) == plan.generations
    summary: dict[str, Any] = planner.ask().summary
    assert summary["failed"] == len(joined(rounds).points)
    assert summary["best"] == [None] * len(goals)


def test_tied_parameters_share_a_column() -> None:
    planner = GoalPlanner(plan_of([Variable(("x", "y"), 0.0, 1.0)], ["f"]))
    assert planner.paths == (("x", "y"),)
    assert planner.ask().points.shape[1] == 1


def test_rows_do_not_depend_on_their_memory() -> None:
    """Told by a slice of a larger table, in columns, the next round is the same."""
    plan = _plans()["two goals"]
    one, other = GoalPlanner(plan), GoalPlanner(plan)
    rows = rows_of(one.ask().points, _two)
    one.tell(rows)
    wide = {name: np.stack([values, values], axis=1)[:, 0] for name, values in rows.values.items()}
    other.tell(Rows(np.asfortranarray(rows.points), rows.ok, wide))
    assert one.ask().points.tobytes() == other.ask().points.tobytes()


PINNED_TWO = [0.22433624642604644, 0.30892859390871863, 0.5321716894339258]
PINNED_ONE = [0.01017706183371999, 0.6868009670133053, 0.13981460783806227]
