"""Goals about the drives of a design: quantiles, yields, drives that fail, and a search with a known optimum."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from sprag_study.worker.planning.goals import Goal, GoalPlan, GoalPlanner, Limit, Variable, front
from sprag_study.worker.planning.goals.robust import Table
from sprag_study.worker.planning.goals.scores import judge, outputs_of
from sprag_study.worker.planning.rounds import Rows
from sprag_study.worker.spread import DRIVE
from tests.worker.planning.searching import joined, searched

Floats = NDArray[np.float64]
RNG = np.random.default_rng(7)
DRIVES = 40
#: Factor of each drive, the nominal one first.
FACTORS = np.array([1.0, *RNG.normal(1.0, 0.1, DRIVES)])


def plan_of(best: tuple[Goal, ...], limits: tuple[Limit, ...] = (), drives: int = DRIVES, points: int = 1) -> GoalPlan:
    at = tuple({"load": float(k)} for k in range(points)) if points > 1 else ({},)
    variables = (Variable(("x",), 0.0, 2.0),)
    return GoalPlan(variables, best, limits, at=at, population=12, generations=20, polish=False, drives=drives)


def rows_of(values: Floats, ok: NDArray[np.bool_], drives: int, points: int) -> Rows:
    """Rows of designs whose result "f" is given, shape (designs, points, drives + 1)."""
    count = values.size
    return Rows(np.zeros((count, 3)), ok.reshape(-1), {"f": np.where(ok, values, np.nan).reshape(-1)})


@pytest.mark.parametrize("quantile", [0.0, 0.05, 0.25, 0.5, 0.95, 1.0])
@pytest.mark.parametrize("upwards", [True, False])
def test_a_quantile_is_an_order_statistic_in_which_failed_drives_are_the_worst(quantile: float, upwards: bool) -> None:
    drives, points = 20, 2
    values = RNG.normal(size=(5, points, drives + 1))
    ok = RNG.random(values.shape) > 0.1
    ok[:, :, 0] = True
    goal = Goal("f", upwards, quantile)
    found = Table(plan_of((goal,), drives=drives, points=points), rows_of(values, ok, drives, points)).values(goal)
    worst = -np.inf if upwards else np.inf
    filled = np.where(ok, values, worst)[:, :, 1:]
    expected = np.quantile(filled, quantile, axis=2, method="inverted_cdf")
    np.testing.assert_array_equal(found, np.where(np.isfinite(expected), expected, np.nan))


def test_the_yield_is_the_share_of_drives_that_hold_at_every_point() -> None:
    drives, points = 10, 3
    values = RNG.normal(size=(4, points, drives + 1))
    ok = RNG.random(values.shape) > 0.1
    conditions = (Limit("f", "at_least", -1.0), Limit("f", "at_most", 1.0))
    goal = Goal("", True, conditions=conditions)
    plan = plan_of((goal,), drives=drives, points=points)
    found = Table(plan, rows_of(values, ok, drives, points)).values(goal)
    held = (ok & (values >= -1.0) & (values <= 1.0)).all(axis=1)[:, 1:]
    np.testing.assert_array_equal(found, np.repeat(held.mean(axis=1)[:, None], points, axis=1))
    assert plan.results == ("f",)


def test_a_goal_without_a_quantile_is_that_of_the_nominal_drive() -> None:
    values = RNG.normal(size=(4, 1, 6))
    ok = np.ones(values.shape, dtype=np.bool_)
    plan = plan_of((Goal("f", max=True), Goal("f", True, 0.5)), drives=5)
    outputs = outputs_of(plan, rows_of(values, ok, 5, 1))
    np.testing.assert_array_equal(outputs[:, 0], values[:, 0, 0])
    np.testing.assert_array_equal(outputs[:, 1], np.median(values[:, 0, 1:], axis=1))


def test_designs_fail_with_their_nominal_drive_or_with_all_drawn_ones() -> None:
    values = np.ones((3, 1, 6))
    ok = np.ones(values.shape, dtype=np.bool_)
    ok[0, 0, 0] = False  # the nominal drive
    ok[1, 0, 1:] = False  # all others
    ok[2, 0, 3] = False  # one of them
    rows = rows_of(values, ok, 5, 1)
    both = plan_of((Goal("f", max=True), Goal("f", True, 0.5)), drives=5)
    assert judge(both, outputs_of(both, rows)).failed.tolist() == [True, True, False]
    drawn = plan_of((Goal("f", True, 0.5),), drives=5)
    assert judge(drawn, outputs_of(drawn, rows)).failed.tolist() == [False, True, False]


def _speed(points: Floats) -> dict[str, Floats]:
    """A cost that falls with x, and a speed that does too, by the factor of the drive."""
    factors = FACTORS[points[:, 1].astype(np.int64)]
    return {"cost": 3.0 - points[:, 0], "speed": 2.0 - factors * points[:, 0]}


def _limits() -> dict[str, tuple[Limit, float]]:
    # The speed is at least 1 where x <= 1 / factor: of 40 drives, 38 must reach it.
    place = np.sort(FACTORS[1:])[37]
    quantile = Limit("speed", "at_least", 1.0, quantile=2.5 / 40)
    share = Limit("", "at_least", 0.95, conditions=(Limit("speed", "at_least", 1.0),))
    nominal = Limit("speed", "at_least", 1.0)
    return {"quantile": (quantile, 1.0 / place), "yield": (share, 1.0 / place), "nominal": (nominal, 1.0)}


@pytest.mark.parametrize("kind", ["quantile", "yield", "nominal"])
def test_a_search_finds_the_largest_value_that_its_drives_allow(kind: str) -> None:
    limit, optimum = _limits()[kind]
    plan = plan_of((Goal("cost", max=False, quantile=None if kind == "nominal" else 0.5),), (limit,))
    planner, rounds = searched(plan, _speed)
    assert planner.paths == (("x",), (DRIVE,))
    found = front(plan, joined(rounds))
    best = found.variables[found.rank == 0][0, 0]
    assert optimum * (1.0 - 5e-3) <= best <= optimum
    # All drives of a design stand next to each other, and `cases` are the nominal ones.
    points = joined(rounds).points
    np.testing.assert_array_equal(points[:, 1], np.tile(np.arange(DRIVES + 1.0), len(points) // (DRIVES + 1)))
    np.testing.assert_array_equal(found.cases[:, 0], np.arange(0, len(points), DRIVES + 1))
    assert len(points) <= planner.most_cases == 12 * 20 * (DRIVES + 1)


def test_a_planner_told_the_same_rounds_asks_for_the_same_points() -> None:
    plan = plan_of((Goal("cost", max=False),), (_limits()["yield"][0], _limits()["quantile"][0]))
    again = GoalPlan.from_json(plan.to_json())
    assert again == plan
    planner = GoalPlanner(again)
    _, rounds = searched(plan, _speed)
    for rows in rounds:
        assert planner.ask().points.tobytes() == rows.points.tobytes()
        planner.tell(rows)


def test_the_polish_keeps_a_quantile_within_its_limit() -> None:
    quantile, _ = _limits()["quantile"]
    limits = (quantile, Limit("cost", "is", 2.5, 0.2))
    plan = GoalPlan(
        (Variable(("x",), 0.0, 2.0),), (Goal("speed", max=True),), limits, population=10, generations=3, drives=DRIVES
    )
    _, rounds = searched(plan, _speed)
    found = front(plan, joined(rounds), equality=1e-6)
    assert found.feasible.any()
    np.testing.assert_allclose(found.variables[found.feasible], 0.5, rtol=1e-5)


def test_mean_and_deviation_are_those_of_numpy_and_missing_where_a_drive_is() -> None:
    drives, points = 12, 2
    values = RNG.normal(5.0, size=(4, points, drives + 1))
    ok = np.ones(values.shape, dtype=np.bool_)
    ok[1, 1, 3] = ok[2, 0, 0] = False
    sums = {("mean", 0.0): (1.0, 0.0), ("deviation", 0.0): (0.0, 1.0), ("mean", -3.0): (1.0, -3.0)}
    goals = tuple(Goal("f", True, statistic=name, deviations=k) for name, k in sums)  # type: ignore[arg-type]
    plan = plan_of(goals, drives=drives, points=points)
    table = Table(plan, rows_of(values, ok, drives, points))
    drawn = np.where(ok, values, np.nan)[:, :, 1:]
    for goal, (mean, deviation) in zip(goals, sums.values(), strict=True):
        expected = mean * drawn.mean(axis=2) + deviation * drawn.std(axis=2, ddof=1)
        np.testing.assert_allclose(table.values(goal), expected, rtol=1e-13)
    assert [goal.name for goal in goals] == [
        "f (mean of the drives)", "f (deviation of the drives)", "f (mean of the drives - 3 sigma)"
    ]  # fmt: skip
    # A mean of irregular motion counts with the mean of its half widths against a limit, as single ones do.
    limit = Limit("f", "at_least", 4.0, statistic="mean", deviations=-1.0)
    wide = rows_of(values, ok, drives, points)
    widths = np.full(values.size, 0.25)
    table = Table(plan, Rows(wide.points, wide.ok, {**wide.values, "f.half_width": widths}))
    np.testing.assert_allclose(
        table.values(limit, limit), drawn.mean(axis=2) - drawn.std(axis=2, ddof=1) - 0.25, rtol=1e-13
    )


def test_the_least_design_whose_mean_less_three_deviations_keeps_a_limit() -> None:
    """The speed of a drive is x times its factor, so that x is 1 / (mean - 3 deviations of the factors) exactly."""
    limit = Limit("speed", "at_least", 1.0, statistic="mean", deviations=-3.0)
    plan = GoalPlan(
        (Variable(("x",), 0.0, 4.0),), (Goal("x", max=False, statistic="mean"),), (limit,), population=8, generations=4,
        drives=DRIVES, finish=True,
    )  # fmt: skip
    _, rounds = searched(plan, lambda at: {"x": at[:, 0], "speed": at[:, 0] * FACTORS[at[:, 1].astype(np.int64)]})
    found = front(plan, joined(rounds))
    factors = FACTORS[1:]
    best = found.variables[found.rank == 0][0, 0]
    assert best == pytest.approx(1.0 / (factors.mean() - 3.0 * factors.std(ddof=1)), rel=2e-6)


def test_the_dual_response_of_a_mean_on_its_target_and_the_least_deviation() -> None:
    """With y + n sqrt((x - 0.4)^2 + 0.01) of a noise n the deviation is least at 0.4, whatever y the mean needs."""
    noise = np.array([0.0, *RNG.normal(size=DRIVES)])

    def response(at: Floats) -> dict[str, Floats]:
        return {"f": at[:, 1] + noise[at[:, 2].astype(np.int64)] * np.sqrt((at[:, 0] - 0.4) ** 2 + 0.01)}

    goal, limit = Goal("f", max=False, statistic="deviation"), Limit("f", "is", 2.0, 0.02, statistic="mean")
    plan = GoalPlan(
        (Variable(("x",), 0.0, 1.0), Variable(("y",), 0.0, 4.0)), (goal,), (limit,), population=10, generations=12,
        drives=DRIVES, finish=True,
    )  # fmt: skip
    assert GoalPlan.from_json(plan.to_json()) == plan
    _, rounds = searched(plan, response)
    found = front(plan, joined(rounds), equality=1e-6)
    x, y = found.variables[found.rank == 0][0]
    assert found.feasible.any()
    assert x == pytest.approx(0.4, abs=2e-3)
    assert y + 0.1 * noise[1:].mean() == pytest.approx(2.0, abs=1e-3)
    assert found.goals[found.rank == 0][0, 0] == pytest.approx(0.1 * noise[1:].std(ddof=1), rel=1e-3)


@pytest.mark.parametrize(
    ("best", "drives", "name"),
    [
        (Goal("f", True, statistic="mean"), 1, "statistic"),
        (Goal("f", True, statistic="mean"), 0, "best.0"),
        (Goal("f", True, statistic="deviation", deviations=1.0), 5, "deviations"),
        (Goal("f", True, 0.5, statistic="mean"), 5, "statistic"),
        (Goal("f", True, 0.5), 0, "best.0"),
        (Goal("f", True, 1.5), 5, "quantile"),
        (Goal("", max=True), 5, "best.0"),
        (Goal("f", max=True), -1, "drives"),
    ],
)
def test_plans_that_make_no_sense_are_refused(best: Goal, drives: int, name: str) -> None:
    with pytest.raises(ValueError, match=name):
        plan_of((best,), drives=drives)
    with pytest.raises(ValueError, match="is"):
        plan_of((), (Limit("f", "is", 1.0, quantile=0.5),))


def test_plans_without_drives_have_no_trace_of_them() -> None:
    data = plan_of((Goal("f", max=True),), drives=0).to_json()
    assert "drives" not in data
    assert data["best"] == [{"result": "f", "max": True}]
