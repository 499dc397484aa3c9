"""Refined maps: known functions of two parameters with kinks, jumps and failures; no engine."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from sprag_study.worker.models.vibration_drive.settled import IRREGULAR
from sprag_study.worker.planning.refine import MapRefiner, describe_maps, refiner
from sprag_study.worker.planning.refine_plan import AdaptiveAxis, FixedAxis, RefinePlan
from sprag_study.worker.planning.rounds import Rows, Step

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from sprag_study.worker.planning.refine import Map

    Floats = NDArray[np.float64]
    Function = Callable[[Floats, Floats], dict[str, Floats]]

AXES = (AdaptiveAxis(("excitation.frequency",), 20.0, 36.0), AdaptiveAxis(("shaft.load",), 0.0, 1.6))
PLAN = RefinePlan(("a",), error=0.02, start=9, finest=64, adaptive=AXES)


def rows_of(plan: RefinePlan, points: Floats, function: Function) -> Rows:
    """Rows of a function of x and y, both from 0 to 1 over the axes; "ok" is among its values where cases fail."""
    x, y = ((points[:, k - 2] - axis.low) / (axis.high - axis.low) for k, axis in enumerate(plan.adaptive))
    values = function(x, y)
    ok = values.pop("ok", np.ones(len(points))) > 0.0
    return Rows(points, ok, {name: values.get(name, np.full(len(points), np.nan)) for name in plan.needed})


def refined(plan: RefinePlan, function: Function) -> tuple[list[Rows], Step]:
    """The rows of all rounds, and the last step."""
    planner, rounds = refiner(plan), []
    while len((step := planner.ask()).points):
        assert len(np.unique(step.points, axis=0)) == len(step.points)
        rounds.append(rows_of(plan, step.points, function))
        planner.tell(rounds[-1])
    assert len(rounds) <= planner.most_rounds
    assert sum(len(rows.points) for rows in rounds) <= planner.most_cases
    return rounds, step


def joined(rounds: list[Rows], order: NDArray[np.int64] | None = None) -> Rows:
    """The rows of all rounds as those of one, in that order."""
    points, ok = np.vstack([rows.points for rows in rounds]), np.concatenate([rows.ok for rows in rounds])
    chosen = np.arange(len(points)) if order is None else order
    values = {name: np.concatenate([rows.values[name] for rows in rounds])[chosen] for name in rounds[0].values}
    return Rows(points[chosen], ok[chosen], values)


def map_of(plan: RefinePlan, function: Function) -> tuple[Map, Step]:
    """The only map of a plan, and the last step."""
    rounds, step = refined(plan, function)
    (found,) = describe_maps(plan, joined(rounds))
    assert step.summary["maps"] == [found.to_json()]
    return found, step


def places(count: int = 129) -> tuple[Floats, Floats]:
    """A grid of places from 0 to 1 along both axes."""
    x, y = np.meshgrid(np.linspace(0.0, 1.0, count), np.linspace(0.0, 1.0, count), indexing="ij")
    return x, y


def interpolated(found: Map, name: str) -> Floats:
    """The map at `places`."""
    x, y = places()
    return found.at(name, 20.0 + 16.0 * x, 1.6 * y)


def errors_of(found: Map, name: str, function: Function) -> Floats:
    """Errors at the `places` outside the jumps, relative to the range; NaN in the jumps."""
    true = function(*places())[name]
    return np.asarray(np.abs(interpolated(found, name) - true) / (true.max() - true.min()))


def ridge(x: Floats, y: Floats) -> dict[str, Floats]:
    """A smooth ridge, steep across and flat along."""
    return {"a": np.exp(-((6.0 * (x - 0.3 - 0.1 * y)) ** 2)) + 0.2 * y}


def test_a_smooth_map_is_right_to_the_error_from_few_points() -> None:
    found, step = map_of(PLAN, ridge)
    errors = errors_of(found, "a", ridge)
    assert found.passed
    assert not found.jumps["a"].any()
    assert np.nanmax(errors) <= step.summary["error"] <= PLAN.error
    assert len(found.x) < 65 * 65 / 7
    # Halved along the worse axis.
    assert len(set(found.x.tolist())) > 2 * len(set(found.y.tolist()))


def test_known_points_lie_on_the_surface() -> None:
    found, _ = map_of(PLAN, ridge)
    assert found.at("a", found.x, found.y) == pytest.approx(found.values["a"], abs=PLAN.error)


def cliff(x: Floats, y: Floats) -> dict[str, Floats]:
    """A jump along an arc."""
    return {"a": np.sin(2.0 * x) + 0.3 * y + np.where(x**2 + y**2 > 0.6, 0.7, 0.0), "b": x * y}


def test_a_jump_is_told_in_narrow_cells_and_nowhere_else() -> None:
    plan = replace(PLAN, results=("a", "b"))
    found, step = map_of(plan, cliff)
    x, y = places()
    surface = interpolated(found, "a")
    for axis in (0, 1):
        beyond = x**2 + y**2 > 0.6
        over = np.diff(beyond.astype(int), axis=axis) != 0
        missing = np.isnan(surface)
        both = missing[1:] | missing[:-1] if axis == 0 else missing[:, 1:] | missing[:, :-1]
        assert both[over].all()
    assert np.nanquantile(errors_of(found, "a", cliff), 0.99) <= plan.error
    assert found.jumps_share["a"] < 0.05
    assert found.jumps_share["b"] == 0.0
    assert len(found.x) < 65 * 65 / 4
    assert step.summary["passed"]


def test_failed_cases_are_told() -> None:
    def function(x: Floats, y: Floats) -> dict[str, Floats]:
        return {"a": x + y**2, "ok": x + y > 0.4}

    found, step = map_of(PLAN, function)
    x, y = places()
    surface = interpolated(found, "a")
    assert np.isnan(surface[x + y < 0.38]).all()
    assert np.isfinite(surface[x + y > 0.45]).all()
    assert step.summary["failed"] == (~found.ok).sum() > 0
    assert step.summary["error"] <= PLAN.error


def test_a_study_of_failures_ends() -> None:
    found, step = map_of(PLAN, lambda x, y: {"a": x + y, "ok": np.zeros(len(x))})
    assert (step.summary["error"], step.summary["passed"]) == (None, True)
    assert found.jumps_share == {"a": pytest.approx(1.0)}


def test_scatter_takes_no_more_than_the_finest_grid() -> None:
    found, _ = map_of(replace(PLAN, finest=16), lambda x, y: {"a": np.sin(1e6 * x + 2e6 * y)})
    assert 150 < len(found.x) <= 17 * 17
    assert found.jumps_share["a"] > 0.8


def test_extremes_of_irregular_motion_are_told_and_not_refined() -> None:
    plan = replace(PLAN, results=("mean", "max"), regime=True, half_widths=("mean",))

    def function(x: Floats, y: Floats) -> dict[str, Floats]:
        irregular = x > 0.5
        return {
            "mean": x + y, "max": x + np.where(irregular, 0.3 * np.sin(1e6 * x + 2e6 * y), 0.0),
            "mean.half_width": np.where(irregular, 0.01, np.nan),
            "regime": np.where(irregular, IRREGULAR, 1.0), "regime.order": np.where(irregular, np.nan, 1.0),
        }  # fmt: skip

    found, _ = map_of(plan, function)
    assert found.jumps_share["mean"] == 0.0
    assert found.jumps_share["max"] == pytest.approx(0.5, abs=0.1)
    assert (found.x > 30.0).sum() < 65 * 32 / 4


MANY = replace(PLAN, fixed=(FixedAxis(("x", "y"), (1.0, 2.0)),), results=("a", "b"))


def test_the_same_rows_give_the_same_points_after_a_restart_and_in_any_order() -> None:
    rounds, last = refined(MANY, cliff)
    for told in range(len(rounds) + 1):
        planner = refiner(RefinePlan.from_json(MANY.to_json()))
        for rows in rounds[:told]:
            planner.tell(rows)
        expected = rounds[told].points if told < len(rounds) else last.points
        assert planner.ask().points.tobytes() == expected.tobytes()
    every = joined(rounds)
    assert set(every.points[:, 0].tolist()) == {1.0, 2.0}
    mixed = describe_maps(MANY, joined(rounds, np.random.default_rng(1).permutation(len(every.points))))
    assert [one.to_json() for one in mixed] == last.summary["maps"]
    assert [one["fixed"] for one in last.summary["maps"]] == [{"x": 1.0, "y": 1.0}, {"x": 2.0, "y": 2.0}]


def test_a_bound_of_cases_holds_and_what_is_open_is_told() -> None:
    found, step = map_of(replace(PLAN, most=200), lambda x, y: {"a": np.where(x > 0.43, 1.0, 0.0) + 0.1 * y})
    assert len(found.x) == 200
    assert not step.summary["passed"]
    surface, (x, _) = interpolated(found, "a"), places()
    assert np.isnan(surface[np.abs(x - 0.43) < 0.005]).all()


def test_summaries_need_no_tables_for_drawing() -> None:
    rounds, last = refined(MANY, cliff)
    found = describe_maps(MANY, joined(rounds))
    assert [one.to_json() for one in found] == last.summary["maps"]
    assert not {"_owners", "_stencils"} & vars(found[0]).keys()
    assert np.isfinite(found[0].at("a", found[0].x, found[0].y)).any()


@pytest.mark.parametrize("most", [1, 10, 80])
def test_a_first_round_that_is_cut_is_no_map(most: int) -> None:
    found, step = map_of(replace(PLAN, most=most), ridge)
    assert len(found.x) == most
    assert not step.summary["passed"]
    assert np.isnan(interpolated(found, "a")).any()


def test_the_planner_of_maps_takes_two_adaptive_axes() -> None:
    with pytest.raises(ValueError, match="adaptive: 1 axes are not allowed; maps have 2"):
        MapRefiner(replace(PLAN, adaptive=AXES[:1]))
