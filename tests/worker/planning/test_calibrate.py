"""Calibrations of closed forms: values, intervals, losses, failures, directions, the next point, rounds."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import optimize, stats

from sprag_study.worker.planning import planner_of
from sprag_study.worker.planning.calibrate import CalibratePlan, CalibratePlanner, Sensor
from sprag_study.worker.planning.calibrate.answer import Answer, answer
from sprag_study.worker.planning.rounds import Rows
from tests.worker.planning.calibrating import Form, calibrated, plan_of, rows_of

Floats = NDArray[np.float64]
X = np.linspace(0.2, 3.0, 15)
TRUE = np.array([2.0, 0.8])
WIDE = [(0.1, 10.0), (0.05, 5.0)]


def _rise(parameters: Floats, at: Floats) -> dict[str, Floats]:
    return {"y": parameters[:, 0] * (1.0 - np.exp(-parameters[:, 1] * at[:, 0]))}


def _line(parameters: Floats, at: Floats) -> dict[str, Floats]:
    return {"y": parameters[:, 0] + parameters[:, 1] * at[:, 0]}


def _values(form: Form, true: Floats, x: Floats) -> Floats:
    return form(np.tile(true, (len(x), 1)), x[:, None])["y"]


def _measured(form: Form = _rise, noise: float = 0.03, seed: int = 1) -> Floats:
    exact = _values(form, TRUE, X)
    return exact + noise * np.random.default_rng(seed).normal(size=len(X))


def _answer(plan: CalibratePlan, form: Form) -> Answer:
    planner = calibrated(plan, form)[0]
    found = answer(planner.plan, planner.space, planner.state)
    assert found is not None
    assert found.complete
    return found


@pytest.mark.parametrize("known", [True, False])
def test_values_intervals_and_correlations_of_a_line_are_those_of_regression(known: bool) -> None:
    y, sigma = _measured(_line), np.full(len(X), 0.03)
    plan = plan_of([(-5.0, 5.0), (-5.0, 5.0)], X, {"y": y}, sigma if known else None, refits=1000)
    found = _answer(plan, _line)
    design = np.stack([np.ones_like(X), X], axis=1)
    exact, squares = np.linalg.lstsq(design, y)[:2]
    freedom = len(X) - 2
    scale = 0.03 if known else np.sqrt(squares[0] / freedom)
    covariance = scale**2 * np.linalg.inv(design.T @ design)
    half = (1.96 if known else stats.t.ppf(0.975, freedom)) * np.sqrt(np.diag(covariance))
    assert found.values == pytest.approx(exact, rel=1e-9)
    assert found.intervals is not None
    assert found.correlations is not None
    # The residuals of 15 points have lighter tails than a normal distribution.
    assert found.intervals == pytest.approx(np.stack([exact - half, exact + half], axis=1), abs=0.25 * half.min())
    correlation = covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1])
    assert found.correlations[0, 1] == pytest.approx(correlation, abs=0.03)
    assert found.chi_square == pytest.approx(squares[0] / scale**2)
    assert found.residuals == pytest.approx((y - found.modelled) / scale)
    assert found.leverages.sum() == pytest.approx(2.0)
    assert not found.directions
    assert found.curve is not None
    assert found.others is not None
    assert found.curve[:, 0] == pytest.approx(exact[0] + exact[1] * found.others[:, 0])


def test_each_result_has_the_degrees_of_freedom_of_its_own_scatter() -> None:
    x = np.linspace(0.0, 5.0, 6)

    def form(parameters: Floats, at: Floats) -> dict[str, Floats]:
        a, b, c, d = parameters.T
        return {"y": a + b * at[:, 0], "z": c + d * at[:, 0]}

    noise = np.random.default_rng(3).normal(size=(2, 6))
    plan = plan_of([(-5.0, 5.0)] * 4, x, {"y": 1.0 + x + 0.1 * noise[0], "z": 2.0 - x + 0.3 * noise[1]}, refits=1000)
    assert plan.scales == {0: 4, 1: 4}
    found = _answer(plan, form)
    assert found.intervals is not None
    design = np.stack([np.ones_like(x), x], axis=1)
    for column, values in enumerate(plan.values.reshape(2, 6)):
        squares = np.linalg.lstsq(design, values)[1][0]
        deviation = np.sqrt(np.diag(squares / 4 * np.linalg.inv(design.T @ design)))
        half = np.ptp(found.intervals[2 * column : 2 * column + 2], axis=1) / 2.0
        assert half == pytest.approx(stats.t.ppf(0.975, 4) * deviation, rel=0.1)


def test_the_next_point_is_where_the_line_is_known_least() -> None:
    found = _answer(plan_of([(-5.0, 5.0), (-5.0, 5.0)], X, {"y": _measured(_line)}), _line)
    assert found.next is not None
    assert found.others is not None
    assert found.next.condition[0] == found.others.min() or found.next.condition[0] == found.others.max()
    assert not found.next.again
    assert max(found.next.narrower) > 0.1


@pytest.mark.parametrize("loss", ["soft_l1", "huber", "cauchy"])
def test_outliers_hardly_move_a_fit_with_another_loss(loss: Any) -> None:
    y = _measured(noise=0.01)
    y[[3, 11]] += [0.9, -0.7]
    linear, other = (_answer(plan_of(WIDE, X, {"y": y}, refits=50, loss=one), _rise) for one in ("linear", loss))
    off = [np.abs(found.values / TRUE - 1.0).max() for found in (linear, other)]
    assert off[1] < 0.04 < off[0]
    assert set(np.argsort(-np.abs(other.residuals))[:2].tolist()) == {3, 11}


@pytest.mark.parametrize("loss", ["soft_l1", "cauchy"])
def test_intervals_stay_around_the_values_where_outliers_are_on_one_side(loss: Any) -> None:
    y = _measured(noise=0.01)
    y[[4, 12]] -= [0.5, 0.9]
    planner = calibrated(plan_of(WIDE, X, {"y": y}, np.full(len(X), 0.01), refits=100, loss=loss), _rise)[0]
    found = answer(planner.plan, planner.space, planner.state)
    assert found is not None
    assert planner.summary()["chi_square"] == pytest.approx(found.chi_square), "not the sum of the loss"
    assert found.intervals is not None
    low, high = found.intervals.T
    for value in (found.values, TRUE):
        assert np.all((low < value) & (value < high))
    assert np.all(np.abs(0.5 * (low + high) - found.values) < 0.35 * (high - low))


def test_failed_cases_and_jumps_do_not_break_a_fit() -> None:
    def form(parameters: Floats, at: Floats) -> dict[str, Floats]:
        y = _rise(parameters, at)["y"]
        y = np.where(parameters[:, 1] > 1.5, 0.0, y)  # another regime
        y = np.where((parameters[:, 0] > 4.0) | (at[:, 0] == X[4]), np.nan, y)
        return {"y": y}

    found = _answer(plan_of(WIDE, X, {"y": _measured()}, np.full(len(X), 0.03), refits=50), form)
    assert found.failed.nonzero()[0].tolist() == [4]
    assert found.freedom == len(X) - 3
    assert found.values == pytest.approx(TRUE, rel=0.1)
    assert found.intervals is not None
    assert np.isfinite(found.intervals).all()
    assert np.isnan(found.residuals[4])


def test_what_only_acts_as_a_product_cannot_be_separated() -> None:
    def form(parameters: Floats, at: Floats) -> dict[str, Floats]:
        return {"y": parameters[:, 0] * parameters[:, 1] * at[:, 0] + parameters[:, 2]}

    y = 1.6 * X + 0.5 + 0.01 * np.random.default_rng(1).normal(size=len(X))
    found = _answer(plan_of([(1.0, 9.0), (0.2, 1.8), (0.0, 1.0)], X, {"y": y}, refits=100), form)
    (direction,) = found.directions
    assert direction.undetermined
    assert set(direction.parameters) == {0, 1}
    changes = dict(zip(direction.parameters, direction.changes, strict=True))
    assert changes[0] * changes[1] < 0.0
    changed = [found.values[place] + changes[place] for place in (0, 1)]
    assert changed[0] * changed[1] == pytest.approx(1.6, rel=0.03), "what is reported hardly changes the points"
    assert found.values[0] * found.values[1] == pytest.approx(1.6, rel=0.01)
    assert found.intervals is not None
    assert np.ptp(found.intervals[2]) < 0.05
    assert found.intervals[:2].tolist() == [[1.0, 9.0], [0.2, 1.8]], "the whole ranges"


def test_units_of_several_results_do_not_matter() -> None:
    def form(parameters: Floats, at: Floats) -> dict[str, Floats]:
        y = _rise(parameters, at)["y"]
        return {"y": y, "z": 1e6 * (y - parameters[:, 1])}

    y = _measured()
    z = 1e6 * (_measured(noise=0.1, seed=2) - TRUE[1])
    found = _answer(plan_of(WIDE, X, {"y": y, "z": z}, refits=50), form)
    assert found.values == pytest.approx(TRUE, rel=0.1)
    assert found.freedom == 28
    scales = found.sigma.reshape(2, -1)[:, 0]
    assert scales[0] == pytest.approx(0.03, rel=0.5)
    assert scales[1] == pytest.approx(1e5, rel=0.5)


def test_a_planner_told_the_same_rounds_asks_for_the_same_points() -> None:
    plan = plan_of(WIDE, X, {"y": _measured()}, refits=50)
    planner, rounds = calibrated(plan, _rise)
    assert 5 < len(rounds) <= planner.most_rounds
    points = np.concatenate([rows.points for rows in rounds])
    assert len(points) <= planner.most_cases
    assert len(np.unique(points, axis=0)) == len(points), "no case comes twice"
    for column, (low, high) in zip(points.T, WIDE, strict=False):
        assert low <= column.min() <= column.max() <= high
    again = planner_of(plan.to_json())
    assert isinstance(again, CalibratePlanner)
    for rows in rounds:
        assert again.ask().points.tobytes() == rows.points.tobytes()
        again.tell(rows)
    assert again.ask().summary == planner.ask().summary
    assert planner.ask().summary["complete"]
    other = CalibratePlanner(plan_of(WIDE, X, {"y": _measured()}, refits=50, seed=2)).ask().points
    assert not np.array_equal(other, rounds[0].points)


def test_cases_that_are_run_again_and_differ_do_not_break_a_calibration() -> None:
    plan = plan_of(WIDE, X, {"y": _measured()}, refits=50)
    planner, rounds = calibrated(plan, _rise)
    again = CalibratePlanner(plan)
    for number, rows in enumerate(rounds[:4]):
        ok = rows.ok.copy()
        ok[: len(ok) // 3] &= number != 1
        again.tell(Rows(rows.points, ok, rows.values))
    while len(points := again.ask().points):
        again.tell(rows_of(plan, points, _rise))
    found, expected = answer(again.plan, again.space, again.state), answer(planner.plan, planner.space, planner.state)
    assert found is not None
    assert expected is not None
    assert found.values == pytest.approx(expected.values, rel=1e-6)


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"loss": "square"}, "loss"),
        ({"refits": 5000}, "refits"),
        ({"conditions": ((1.0,), (1.0,))}, "conditions"),
        ({"measured": ()}, "measured"),
        ({"unknown": ()}, "unknown"),
        ({"paths_at": ("a",)}, "unknown"),
    ],
)
def test_a_plan_names_what_is_wrong(change: dict[str, Any], named: str) -> None:
    plan = plan_of(WIDE, X, {"y": _measured()})
    fields = {name: getattr(plan, name) for name in ("unknown", "paths_at", "conditions", "measured")}
    with pytest.raises(ValueError, match=f"calibrate.{named}"):
        CalibratePlan(**(fields | change))
    assert CalibratePlan.from_json(plan.to_json()) == plan


@pytest.mark.parametrize("known", [True, False])
def test_a_prior_of_a_line_gives_the_posterior_of_linear_regression(known: bool) -> None:
    y, sigma = _measured(_line), np.full(len(X), 0.3)
    plan = plan_of([(-5.0, 5.0), (-5.0, 5.0)], X, {"y": y}, sigma if known else None, refits=1000)
    mean, deviation = 0.9, 0.02
    plan = replace(plan, unknown=(plan.unknown[0], replace(plan.unknown[1], prior=(mean, deviation))))
    assert CalibratePlan.from_json(plan.to_json()) == plan
    found = _answer(plan, _line)
    design = np.stack([np.ones_like(X), X], axis=1) / found.sigma[:, None]
    precision = design.T @ design + np.diag([0.0, 1.0 / deviation**2])
    exact = np.linalg.solve(precision, design.T @ (y / found.sigma) + np.array([0.0, mean / deviation**2]))
    spread = np.sqrt(np.diag(np.linalg.inv(precision)))
    assert found.values == pytest.approx(exact, rel=1e-9)
    # Of a scatter that follows from the residuals the deviations are those of Student's t with 14 degrees of freedom.
    assert found.deviations == pytest.approx(spread * (1.0 if known else np.sqrt(14.0 / 12.0)), rel=0.08)
    squares = np.sum(((y - found.modelled) / found.sigma) ** 2) + ((exact[1] - mean) / deviation) ** 2
    assert (found.freedom, found.chi_square) == (len(X) - 1, pytest.approx(squares))
    assert len(found.residuals) == len(found.leverages) == len(X)
    if not known:
        rest = (y - found.modelled) ** 2
        assert found.sigma[0] == pytest.approx(np.sqrt(rest.sum() / (len(X) - 1)), rel=2e-3)


def test_a_prior_counts_by_its_square_beside_any_loss() -> None:
    y = _measured(_line)
    y[3] += 2.0
    sigma, prior = 0.03, (0.9, 0.01)
    plan = plan_of([(-5.0, 5.0), (-5.0, 5.0)], X, {"y": y}, np.full(len(X), sigma), loss="cauchy", refits=0)
    plan = replace(plan, unknown=(plan.unknown[0], replace(plan.unknown[1], prior=prior)))

    def cost(place: Floats) -> float:
        residuals = (y - place[0] - place[1] * X) / sigma
        return float(np.sum(np.log1p(residuals**2)) + ((place[1] - prior[0]) / prior[1]) ** 2)

    best = optimize.minimize(cost, TRUE, method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-12})
    assert _answer(plan, _line).values == pytest.approx(best.x, rel=1e-6)


def test_priors_determine_what_the_measurement_cannot_separate() -> None:
    """Each keeps what is known of it, as far as the product allows."""

    def product(parameters: Floats, at: Floats) -> dict[str, Floats]:
        return {"y": parameters[:, 0] * parameters[:, 1] * at[:, 0]}

    x = np.array([1.0, 2.0, 3.0])
    plan = plan_of([(1.0, 3.0), (0.5, 1.5)], x, {"y": 1.6 * x}, np.full(3, 0.02), refits=200)
    plan = replace(plan, unknown=tuple(
        replace(one, prior=prior) for one, prior in zip(plan.unknown, [(2.0, 0.1), (0.9, 0.2)], strict=True)
    ))  # fmt: skip
    found = _answer(plan, product)
    assert not found.directions
    assert found.freedom == 3
    assert found.values.prod() == pytest.approx(1.6, abs=0.02)
    assert found.values[0] == pytest.approx(2.0, abs=0.1)
    assert found.deviations is not None
    assert found.deviations[0] == pytest.approx(0.1, rel=0.2)


def test_an_offset_and_a_gain_are_fitted_beside_the_parameters_at_no_cost() -> None:
    """Against the least squares of scipy with the same unknowns."""

    def form(parameters: Floats, at: Floats) -> dict[str, Floats]:
        y = _rise(parameters, at)["y"]
        return {"y": y, "z": np.exp(-parameters[:, 1] * at[:, 0])}

    rng = np.random.default_rng(5)
    exact = form(np.tile(TRUE, (len(X), 1)), X[:, None])
    y, z = 1.1 * exact["y"] + 0.02 * rng.normal(size=15), 0.9 * exact["z"] + 0.3 + 0.02 * rng.normal(size=15)
    sensors = (Sensor("z", (0.2, 20.0), (-5.0, 5.0)), Sensor("y", gain=(1.1, 1.1)))
    plan = plan_of(WIDE, X, {"y": y, "z": z}, np.full(15, 0.02), refits=100, sensors=sensors)
    assert [one.paths[0] for one in plan.fitted] == ["a", "b", "z.gain", "z.offset"]
    assert CalibratePlan.from_json(plan.to_json()) == plan
    planner, rounds = calibrated(plan, form)
    found = answer(planner.plan, planner.space, planner.state)
    assert found is not None

    def residuals(p: Floats) -> Floats:
        own = form(np.tile(p[:2], (len(X), 1)), X[:, None])
        return np.concatenate([1.1 * own["y"] - y, p[2] * own["z"] + p[3] - z]) / 0.02

    expected = optimize.least_squares(residuals, [2.0, 1.0, 1.0, 0.0], xtol=1e-14, ftol=1e-14)
    assert found.values == pytest.approx(expected.x, rel=1e-6)
    assert (found.chi_square, found.freedom) == pytest.approx((2.0 * expected.cost, 26))
    assert found.leverages.sum() == pytest.approx(4.0)
    deviations = np.sqrt(np.diag(np.linalg.inv(expected.jac.T @ expected.jac)))
    assert found.deviations == pytest.approx(deviations, rel=0.35)
    assert found.modelled[:15] == pytest.approx(1.1 * form(expected.x[None, :2], X[:, None])["y"], rel=1e-6)
    assert all(rows.points.shape[1] == 3 for rows in rounds), "cases vary the parameters and the condition alone"
    points = np.concatenate([rows.points for rows in rounds])
    assert len(np.unique(points, axis=0)) == len(points) <= plan.most_cases
    alone = plan_of(WIDE, X, {"y": y / 1.1, "z": (z - 0.3) / 0.9}, np.full(15, 0.02), refits=100)
    assert plan.most_cases == alone.most_cases


def test_what_an_offset_imitates_cannot_be_separated_from_it() -> None:
    plan = plan_of([(-5.0, 5.0)] * 2, X, {"y": _measured(_line)}, refits=30, sensors=(Sensor("y", (1, 1), (-1, 1)),))
    (direction,) = _answer(plan, _line).directions
    assert direction.undetermined
    assert set(direction.parameters) == {0, 2}


@pytest.mark.parametrize(
    ("sensors", "named"),
    [
        ((Sensor("z"),), "sensors.0"),
        ((Sensor("y", (0.0, 1.0)),), "sensors.0.gain"),
        ((Sensor("y", (1.0, 1.0), (1.0, -1.0)),), "sensors.0.offset"),
        ((Sensor("y"), Sensor("y")), "sensors"),
    ],
)
def test_a_plan_names_what_is_wrong_with_a_sensor(sensors: tuple[Sensor, ...], named: str) -> None:
    with pytest.raises(ValueError, match=rf"calibrate.{named} "):
        plan_of(WIDE, X, {"y": _measured()}, sensors=sensors)


@pytest.mark.parametrize("seed", [1, 3])
def test_a_fit_that_explains_its_values_badly_begins_again(seed: int) -> None:
    """The first scan of each of these misses the valley, which is a hundredth of the range wide."""

    def wave(parameters: Floats, at: Floats) -> dict[str, Floats]:
        return {"y": np.sin(parameters[:, 0] * at[:, 0]) * np.exp(-parameters[:, 1] * at[:, 0])}

    x, true = X**1.37, np.array([166.0, 0.8])
    y = _values(wave, true, x) + 0.02 * np.random.default_rng(seed).normal(size=len(x))
    found = _answer(plan_of([(0.0, 200.0), (0.0, 5.0)], x, {"y": y}, np.full(len(x), 0.02), refits=2, seed=seed), wave)
    assert found.values == pytest.approx(true, rel=0.1)
    assert found.chi_square < 30.0


def test_a_fit_that_stays_bad_leaves_room_for_the_intervals() -> None:
    """No set of parameters explains these values, and the cases for beginning again are bounded."""
    y = _measured() + 0.5 * np.sin(40.0 * X)
    plan = plan_of(WIDE, X, {"y": y}, np.full(len(X), 1e-3), refits=200)
    planner, rounds = calibrated(plan, _rise)
    found = answer(planner.plan, planner.space, planner.state)
    assert found is not None
    assert found.complete
    assert found.intervals is not None
    assert sum(len(rows.points) for rows in rounds) <= plan.most_cases
