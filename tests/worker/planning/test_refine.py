"""Refined curves: known functions with kinks, jumps, scatter and failures; no engine."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sprag_study.worker.planning.curves import Why
from sprag_study.worker.planning.refine import CurveRefiner, describe
from sprag_study.worker.planning.refine_plan import AdaptiveAxis, FixedAxis, RefinePlan
from sprag_study.worker.planning.rounds import Rows
from tests.worker.planning.refining import (
    LEAF,
    PLAN,
    SETTLED,
    Floats,
    curve_of,
    errors_outside,
    irregular_zone,
    joined,
    noise,
    refined,
    rows_of,
)


def test_a_smooth_curve_is_right_to_the_error_from_few_points() -> None:
    def function(points: Floats) -> dict[str, Floats]:
        return {"a": 3.0 + np.tanh(12.0 * (points[:, -1] - 0.9))}

    curve = curve_of(PLAN, function)
    worst = errors_outside(curve, "a", function).max()
    assert curve.passed
    assert not curve.jumps
    assert curve.error is not None
    assert worst <= curve.error <= PLAN.error
    assert len(curve.x) < 110
    assert curve.joined["a"].all()


@pytest.mark.parametrize("height", [0.0, 5.0])
def test_a_straight_line_takes_no_more_than_the_guard_against_narrow_features(height: float) -> None:
    curve = curve_of(PLAN, lambda points: {"a": 1.0 + height * points[:, -1]})
    assert len(curve.x) == 65
    assert curve.errors["a"] == pytest.approx(0.0, abs=1e-12)


def test_rounding_errors_of_a_constant_are_not_refined() -> None:
    curve = curve_of(PLAN, lambda points: {"a": 1e6 + 1e-4 * np.sin(1e5 * points[:, -1])})
    assert len(curve.x) == 65
    assert not curve.jumps


def test_points_are_those_of_nested_grids_to_the_bit() -> None:
    axis = AdaptiveAxis(("shaft.load",), 0.1, 0.7)
    rounds, _ = refined(replace(PLAN, adaptive=(axis,)), lambda points: {"a": np.sqrt(points[:, -1] - 0.1)})
    grids = [set(np.linspace(0.1, 0.7, 16 * 2**level + 1).tolist()) for level in range(5)]
    for grid, rows in zip(grids, rounds, strict=False):
        assert set(rows.points[:, 0].tolist()) <= grid


def test_a_jump_is_halved_to_the_finest_interval_and_not_joined() -> None:
    at = 0.7013

    def function(points: Floats) -> dict[str, Floats]:
        x = points[:, -1]
        return {"a": np.sin(x) + np.where(x < at, 0.0, 0.4), "b": x**2}

    plan = replace(PLAN, results=("a", "b"))
    curve = curve_of(plan, function)
    (jump,) = curve.jumps
    assert jump.low <= at <= jump.high
    assert jump.high - jump.low == pytest.approx(1.6 / 256)
    assert (jump.why, jump.results) == (Why.STEEP, ("a",))
    assert curve.x[:-1][~curve.joined["a"]].tolist() == [jump.low]
    assert curve.joined["b"].all()
    for name in plan.results:
        assert errors_outside(curve, name, function).max() <= plan.error


def test_what_lies_between_two_jumps_is_told_where_no_test_reaches_it() -> None:
    near, far = 0.8 - 1.5 * 1.6 / 256, 0.8 + 1.5 * 1.6 / 256

    def function(points: Floats) -> dict[str, Floats]:
        x = points[:, -1]
        return {"a": x + np.where((x > near) & (x < far), 0.6, 0.0)}

    curve = curve_of(PLAN, function)
    (jump,) = curve.jumps
    assert (jump.low, jump.high) == pytest.approx((0.8 - 2 * 1.6 / 256, 0.8 + 2 * 1.6 / 256))


def test_a_steep_end_of_a_smooth_curve_is_no_jump() -> None:
    curve = curve_of(PLAN, lambda points: {"a": 1.0 / (0.05 + points[:, -1])})
    assert not curve.jumps
    assert errors_outside(curve, "a", lambda points: {"a": 1.0 / (0.05 + points[:, -1])}).max() <= PLAN.error


def test_a_kink_is_refined_without_being_a_jump() -> None:
    def function(points: Floats) -> dict[str, Floats]:
        return {"a": np.maximum(points[:, -1] - 0.91, 0.0) - 0.3 * points[:, -1]}

    curve = curve_of(PLAN, function)
    assert not curve.jumps
    assert errors_outside(curve, "a", function).max() <= PLAN.error


@pytest.mark.parametrize("seed", range(20))
def test_all_jumps_of_random_curves_are_told(seed: int) -> None:
    rng = np.random.default_rng(seed)
    places = np.sort(rng.uniform(0.05, 1.55, 4))
    # Features narrower than the guard's 1/64 may be missed.
    places = places[np.diff(places, prepend=0.0) > 1.6 / 64]
    steps, waves, phases = rng.uniform(-1, 1, len(places)), rng.uniform(-1, 1, 3), rng.uniform(0, 6, 3)

    def function(points: Floats) -> dict[str, Floats]:
        x = points[:, -1]
        smooth = sum(wave * np.sin((2.0 + 2.0 * k) * x + phases[k]) for k, wave in enumerate(waves))
        return {"a": smooth + (steps * (x[:, None] > places)).sum(axis=1)}

    curve = curve_of(PLAN, function)
    true = function(np.linspace(0.0, 1.6, 1025)[:, None])["a"]
    for place, step in zip(places, steps, strict=True):
        if abs(step) > 0.05 * (true.max() - true.min()):
            assert any(jump.low <= place <= jump.high for jump in curve.jumps), place
    assert np.quantile(errors_outside(curve, "a", function), 0.99) <= PLAN.error
    assert sum(jump.high - jump.low for jump in curve.jumps) <= 3 * len(places) * 1.6 / 256


def test_a_jagged_curve_of_a_given_time_is_not_drawn_where_it_agrees_by_chance() -> None:
    def function(points: Floats) -> dict[str, Floats]:
        x = points[:, -1]
        by_chance = (x > 0.599) & (x < 0.651) & (np.abs(x * 40.0 - np.rint(x * 40.0)) < 1e-9)
        return {"a": x + np.where((x > 0.4) & (x < 1.0) & ~by_chance, 0.3 * noise(x), 0.0)}

    curve = curve_of(PLAN, function)
    inner = curve.x[(curve.x > 0.45) & (curve.x < 0.95)]
    assert np.diff(inner) == pytest.approx(LEAF)


def test_scatter_takes_all_points_of_the_finest_grid_and_no_more() -> None:
    rounds, step = refined(PLAN, lambda points: {"a": noise(points[:, -1])})
    assert sum(len(rows.points) for rows in rounds) == 257
    assert sum(jump["high"] - jump["low"] for jump in step.summary["curves"][0]["jumps"]) > 0.95 * 1.6


def test_failed_cases_and_missing_results_are_counted_and_not_joined() -> None:
    def function(points: Floats) -> dict[str, Floats]:
        x = points[:, -1]
        return {"a": x**2, "b": np.where(x > 1.3, np.nan, x), "ok": x > 0.333}

    curve = curve_of(replace(PLAN, results=("a", "b")), function)
    failed, missing = curve.jumps
    assert (failed.why, failed.low, failed.results) == (Why.FAILED, 0.0, ("a", "b"))
    assert failed.high == pytest.approx(0.333, abs=1.6 / 256)
    assert (missing.why, missing.high, missing.results) == (Why.NO_VALUE, 1.6, ("b",))
    assert missing.low == pytest.approx(1.3, abs=1.6 / 256)
    assert curve.to_json()["failed"] == (curve.x <= 0.333).sum()
    assert np.isnan(curve.values["a"][~curve.ok]).all()
    assert curve.error is not None
    assert curve.error <= PLAN.error


def test_a_study_of_failures_ends() -> None:
    rounds, step = refined(PLAN, lambda points: {"a": points[:, -1], "ok": np.zeros(len(points))})
    assert step.summary["failed"] == sum(len(rows.points) for rows in rounds) == 65
    assert step.summary["error"] is None
    (curve,) = step.summary["curves"]
    assert curve["jumps"] == [{"low": 0.0, "high": 1.6, "why": "failed", "results": ["a"]}]
    assert curve["errors"] == {"a": None}


MANY = replace(
    SETTLED, fixed=(FixedAxis(("x", "y"), (1.0, 2.0)), FixedAxis(("frequency",), (20.0, 25.0, 30.0))), finest=64
)


def of_many(points: Floats) -> dict[str, Floats]:
    """Curves whose kink depends on the fixed axes, some with irregular motion."""
    x = points[:, -1]
    values = irregular_zone(points)
    return values | {"mean": np.abs(x - 0.03 * points[:, 1]) * points[:, 0]}


def test_all_curves_advance_together_and_columns_have_the_order_of_the_axes() -> None:
    rounds, step = refined(MANY, of_many)
    assert MANY.paths == (("x", "y"), ("frequency",), ("shaft.load",))
    assert len(rounds[0].points) == 6 * 17
    # The ends of every curve come first, then the middles.
    assert set(rounds[0].points[:12, 2].tolist()) == {0.0, 1.6}
    assert set(rounds[0].points[12:18, 2].tolist()) == {0.8}
    fixed = [curve["fixed"] for curve in step.summary["curves"]]
    assert fixed[:2] == [{"x": 1.0, "y": 1.0, "frequency": 20.0}, {"x": 1.0, "y": 1.0, "frequency": 25.0}]
    assert step.summary["passed"]
    assert step.summary["error"] <= MANY.error
    assert step.summary["rounds"] == len(rounds)


def test_the_same_rows_give_the_same_points_after_a_restart() -> None:
    rounds, last = refined(MANY, of_many)
    for told in range(len(rounds) + 1):
        planner = CurveRefiner(RefinePlan.from_json(MANY.to_json()))
        for rows in rounds[:told]:
            planner.tell(rows)
        expected = rounds[told].points if told < len(rounds) else last.points
        step = planner.ask()
        assert step.points.tobytes() == expected.tobytes()
        assert planner.ask().summary == step.summary


def test_curves_are_described_from_rows_in_any_order() -> None:
    rounds, step = refined(MANY, of_many)
    rows = joined(rounds)
    mixed = np.random.default_rng(1).permutation(len(rows.points))
    values = {name: own[mixed] for name, own in rows.values.items()}
    curves = describe(MANY, Rows(rows.points[mixed], rows.ok[mixed], values))
    assert [curve.to_json() for curve in curves] == step.summary["curves"]


def test_the_most_valuable_cases_come_first_and_a_bound_of_cases_holds() -> None:
    def function(points: Floats) -> dict[str, Floats]:
        x = points[:, -1]
        return {"a": 0.2 * np.sin(6.0 * x) + np.where(x > 1.31, 1.0, 0.0)}

    rounds, step = refined(replace(PLAN, most=40), function)
    assert sum(len(rows.points) for rows in rounds) == 40
    assert not step.summary["passed"]
    second = rounds[1].points[:, 0]
    assert abs(second[0] - 1.31) <= 0.1
    # What is not resolved at the end is told, however wide.
    assert any(jump["low"] <= 1.31 <= jump["high"] for jump in step.summary["curves"][0]["jumps"])


def test_the_error_of_a_curve_without_any_line_is_not_known() -> None:
    _, step = refined(replace(PLAN, start=3, most=3), lambda points: {"a": np.sin(3.0 * points[:, -1])})
    (curve,) = step.summary["curves"]
    assert (curve["errors"], curve["passed"], step.summary["error"]) == ({"a": None}, False, None)
    assert [(jump["low"], jump["high"]) for jump in curve["jumps"]] == [(0.0, 1.6)]


def test_before_the_first_rows_nothing_is_known() -> None:
    summary = CurveRefiner(MANY).ask().summary
    assert (summary["error"], summary["cases"], summary["passed"]) == (None, 0, False)


def test_rows_of_other_points_are_refused() -> None:
    with pytest.raises(ValueError, match=r"shaft\.load: 0\.31 is not a point"):
        describe(PLAN, rows_of(PLAN, np.array([[0.31]]), lambda points: {"a": points[:, -1]}))
    with pytest.raises(ValueError, match=r"frequency: 21\.0 is not a value"):
        describe(MANY, rows_of(MANY, np.array([[1.0, 21.0, 0.0]]), of_many))
