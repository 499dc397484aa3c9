"""Values that a refined axis includes whatever the planner decides."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sprag_study.worker.errors import WrongPlanError
from sprag_study.worker.planning.refine import describe, describe_maps, refiner
from sprag_study.worker.planning.refine_plan import AdaptiveAxis, RefinePlan
from tests.worker.planning.refining import LOAD, PLAN, SETTLED, Floats, curve_of, irregular_zone, joined, refined

#: Of which 0.3, 0.6 and 1.05 are on the grid: in the first round, in the last and in a middle one.
VALUES = (0.1234, 0.3, 0.50001, 0.60625, 0.7777, 1.05)
INCLUDING = replace(PLAN, adaptive=(replace(LOAD, include=VALUES),))
SIDE = AdaptiveAxis(("side",), 0.0, 2.0)
MAP = replace(PLAN, adaptive=(LOAD, SIDE), start=9, finest=64, error=0.02)


def smooth(points: Floats) -> dict[str, Floats]:
    """A jump at 0.777 of a bent curve."""
    x = points[:, -1]
    return {"a": np.sin(3.0 * x) + np.where(x < 0.777, 0.0, 1.0)}


def hills(points: Floats) -> dict[str, Floats]:
    """A narrow plateau around (0.711, 1.012) of a smooth surface."""
    x, y = points[:, -2:].T
    return {"a": np.sin(2.0 * x) * y + 0.5 * (np.hypot(x - 0.711, y - 1.012) < 0.008)}


def test_included_values_are_points_of_the_curve_and_cost_at_most_one_case_each() -> None:
    usual, curve = curve_of(PLAN, smooth), curve_of(INCLUDING, smooth)
    assert np.abs(curve.x[:, None] - VALUES).min(axis=0).max() < 1e-12
    assert set(usual.x.tolist()) <= set(curve.x.tolist())
    assert len(usual.x) + 3 <= len(curve.x) <= len(usual.x) + len(VALUES)
    assert curve.values["a"].tolist() == smooth(curve.x[:, None])["a"].tolist()
    assert [(jump.low, jump.high) for jump in curve.jumps] == [(jump.low, jump.high) for jump in usual.jumps]
    (jump,) = curve.jumps
    inside = (curve.x[:-1] >= jump.low) & (curve.x[1:] <= jump.high)
    assert inside.sum() == 2  # before and behind the included value
    assert (curve.joined["a"] == ~inside).all()
    assert curve.passed


@pytest.mark.parametrize("most", [None, 6, 10, 40])
def test_included_values_come_first(most: int | None) -> None:
    rounds, _ = refined(replace(INCLUDING, most=most), smooth)
    first = np.sort(rounds[0].points[: len(VALUES), 0])
    assert np.abs(first - VALUES).max() < 1e-12
    points = np.concatenate([rows.points[:, 0] for rows in rounds])
    assert len(np.unique(points)) == len(points) <= (most or 300)
    (curve,) = describe(replace(INCLUDING, most=most), joined(rounds))
    assert (np.diff(curve.x) > 0.0).all()


def test_the_order_of_the_rows_does_not_matter() -> None:
    rows = joined(refined(INCLUDING, smooth)[0])
    order = np.random.default_rng(5).permutation(len(rows.points))
    turned = replace(
        rows,
        points=rows.points[order],
        ok=rows.ok[order],
        values={name: own[order] for name, own in rows.values.items()},
    )
    (one,), (other,) = describe(INCLUDING, rows), describe(INCLUDING, turned)
    assert one.to_json() == other.to_json()
    assert one.x.tolist() == other.x.tolist()


def test_an_included_value_shows_what_the_grid_misses() -> None:
    def island(points: Floats) -> dict[str, Floats]:
        x = points[:, -1]
        return {"a": np.cos(x) + np.where(np.abs(x - 0.5031) < 0.001, 1.0, 0.0)}

    assert not curve_of(PLAN, island).jumps
    curve = curve_of(replace(PLAN, adaptive=(replace(LOAD, include=(0.5031,)),)), island)
    (jump,) = curve.jumps
    assert (jump.low, jump.high) == (0.5, 0.50625)


def test_included_values_do_not_refine_what_scatters() -> None:
    usual = curve_of(SETTLED, irregular_zone)
    curve = curve_of(replace(SETTLED, adaptive=(replace(LOAD, include=(0.7001, 0.8002)),)), irregular_zone)
    assert len(curve.x) == len(usual.x) + 2


def test_a_map_runs_included_values_with_those_of_the_first_round() -> None:
    usual = refined(MAP, hills)[0]
    plan = replace(MAP, adaptive=(replace(LOAD, include=(0.711,)), replace(SIDE, include=(1.012,))))
    rounds = refined(plan, hills)[0]
    assert len(rounds[0].points) == 10 * 10
    points = joined(rounds).points
    assert len(np.unique(points, axis=0)) == len(points)
    (before,), (drawn,) = describe_maps(MAP, joined(usual)), describe_maps(plan, joined(rounds))
    assert before.jumps_share["a"] == 0.0 < drawn.jumps_share["a"] < 0.002  # the plateau
    named = (points[:, 0] == 0.711) & (points[:, 1] != 1.012)
    close = np.abs(drawn.at("a", points[named, 0], points[named, 1]) - hills(points[named])["a"])
    assert np.nanmax(close) < 0.02 * drawn.ranges["a"]
    assert drawn.passed


def test_a_plan_with_included_values_is_the_same_from_its_text() -> None:
    assert RefinePlan.from_json(INCLUDING.to_json()) == INCLUDING
    assert "include" not in PLAN.to_json()["adaptive"][0]
    assert refiner(INCLUDING).most_cases == refiner(PLAN).most_cases + 3


@pytest.mark.parametrize(
    "change",
    [
        {"include": (1.7,)},
        {"include": (float("nan"),)},
        {"include": (0.2, 0.1)},
        {"include": (0.2, 0.2)},
        {"include": tuple(np.linspace(0.1, 0.2, 17).tolist())},
    ],
)
def test_wrong_included_values_are_refused(change: dict[str, Any]) -> None:
    with pytest.raises(WrongPlanError, match=r"include shaft\.load"):
        replace(PLAN, adaptive=(replace(LOAD, **change),))


def test_a_bound_below_the_included_values_is_refused() -> None:
    with pytest.raises(WrongPlanError, match="at least 6"):
        replace(INCLUDING, most=5)
