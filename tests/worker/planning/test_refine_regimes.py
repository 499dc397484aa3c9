"""Refined curves of settled motions: regimes, orders, irregular zones and settling times; no engine."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sprag_study.worker.models.vibration_drive.settled import IRREGULAR
from sprag_study.worker.planning.curves import Why
from tests.worker.planning.refining import (
    LEAF,
    LOAD,
    PLAN,
    SETTLED,
    Floats,
    curve_of,
    errors_outside,
    irregular_zone,
    noise,
    settled,
)


def test_a_change_of_regime_is_told_only_where_a_result_jumps() -> None:
    def function(points: Floats) -> dict[str, Floats]:
        x = points[:, -1]
        high = x + np.where(x > 1.21, 0.5, 0.0)
        return settled(x, x**2, high, **{"regime.order": np.where(x > 0.41, 2.0, 1.0) + 2.0 * (x > 1.21)})

    curve = curve_of(SETTLED, function)
    (jump,) = curve.jumps
    assert jump.low <= 1.21 <= jump.high
    assert (jump.why, jump.results) == (Why.ORDER, ("max",))
    # The change at 0.41 was looked at as closely.
    assert np.diff(curve.x)[np.searchsorted(curve.x, 0.41) - 1] == pytest.approx(1.6 / 256)


def ramp(x: Floats, at: float, step: float) -> Floats:
    """A step, and from there 25 finest intervals that rise by 3 % of the range each."""
    slope = 0.03 / LEAF * np.clip(x - at, 0.0, 25.0 * LEAF)
    return np.asarray(slope + np.where(x > at, step, 0.0) - 0.2 * (x > 1.5))


def test_a_change_of_order_with_a_step_is_told_where_a_steep_part_follows() -> None:
    at = 0.8 + 0.5 * LEAF

    def function(points: Floats) -> dict[str, Floats]:
        x = points[:, -1]
        return settled(x, ramp(x, at, 0.02), x, **{"regime.order": np.where(x > at, 2.0, 1.0)})

    curve = curve_of(SETTLED, function)
    assert any(jump.low <= at <= jump.high and "mean" in jump.results for jump in curve.jumps)


def test_the_steep_foot_of_a_jump_is_told_with_it() -> None:
    at = 0.8 + 0.5 * LEAF
    curve = curve_of(PLAN, lambda points: {"a": ramp(points[:, -1], at, 0.3)})
    jump = next(jump for jump in curve.jumps if jump.low <= at <= jump.high)
    assert (jump.low, jump.high) == pytest.approx((0.8, 0.8 + 2.0 * LEAF))


def test_a_jump_of_a_few_errors_is_told() -> None:
    curve = curve_of(PLAN, lambda points: {"a": np.sin(points[:, -1]) + np.where(points[:, -1] > 0.8013, 0.035, 0.0)})
    assert any(jump.low <= 0.8013 <= jump.high for jump in curve.jumps)


def test_irregular_motion_is_told_as_a_zone_and_not_refined_to_the_finest() -> None:
    curve = curve_of(SETTLED, irregular_zone)
    assert not any(jump.why is Why.IRREGULAR for jump in curve.jumps)
    (zone,) = curve.stretches
    assert [*zone.half_widths] == ["max"]
    assert zone.low == pytest.approx(0.5, abs=1.6 / 64)
    assert zone.high == pytest.approx(0.9, abs=1.6 / 64)
    inner = curve.x[(curve.x > 0.55) & (curve.x < 0.85)]
    assert len(inner) < 0.3 / (1.6 / 256) / 2
    assert curve.joined["mean"].all()
    assert not curve.scattered["mean"].any()
    within = (curve.x[:-1] >= zone.low) & (curve.x[:-1] < zone.high)
    assert (curve.scattered["max"] == within).all()
    assert curve.joined["max"][within].all()
    # Beside it there is the jump from periodic motion.
    assert {jump.high for jump in curve.jumps if jump.high <= 0.6} == {zone.low}
    assert {jump.low for jump in curve.jumps if jump.low >= 0.8} == {zone.high}
    assert np.isfinite(curve.half_widths["max"]).sum() == within.sum() + 1
    assert zone.half_widths["max"] == np.nanmax(curve.half_widths["max"])
    assert curve_of(SETTLED, irregular_zone).to_json()["irregular"] == [zone.to_json()]


def logistic(points: Floats) -> dict[str, Floats]:
    """The logistic map at rates from 3.5 to 3.98: chaos, broken by windows of periodic motion."""
    rate = 3.5 + 0.3 * points[:, -1]
    orbit = np.empty((1536, len(rate)))
    orbit[0] = 0.4
    for step in range(1, len(orbit)):
        orbit[step] = rate * orbit[step - 1] * (1.0 - orbit[step - 1])
    orbit = orbit[512:]
    same = np.abs(orbit[1:65] - orbit[0]) < 1e-6
    periodic = same.any(axis=0)
    error = orbit.reshape(32, 32, -1).mean(axis=1).std(axis=0, ddof=1) / np.sqrt(32.0)
    more = {
        "regime": np.where(periodic, 1.0, IRREGULAR),
        "regime.order": np.where(periodic, 1.0 + same.argmax(axis=0), np.nan),
        "mean.half_width": np.where(periodic, np.nan, 2.04 * error),
    }
    return settled(points[:, -1], orbit.mean(axis=0), orbit.max(axis=0), **more)


@pytest.mark.parametrize("name", ["mean", "max"])
def test_results_lie_within_the_band_around_the_lines_of_irregular_motion(name: str) -> None:
    curve = curve_of(replace(SETTLED, error=0.005), logistic)
    draws = np.random.default_rng(2)
    parts = np.flatnonzero(curve.scattered[name])
    steps = np.diff(curve.x)
    assert steps[parts].sum() > 0.6 * 1.6
    part = draws.choice(parts, size=1000, p=steps[parts] / steps[parts].sum())
    x = curve.x[part] + draws.uniform(size=1000) * steps[part]
    rows = logistic(x[:, None])
    assert 0.02 < (rows["regime"] != IRREGULAR).mean() < 0.2  # in windows
    band = np.interp(x, curve.x, np.nan_to_num(curve.half_widths[name]))
    inside = np.abs(rows[name] - np.interp(x, curve.x, curve.values[name])) <= band
    assert 0.9 <= inside.mean() <= 0.99


def test_a_stretch_ends_at_a_case_without_a_result() -> None:
    def function(points: Floats) -> dict[str, Floats]:
        x = points[:, -1]
        own = logistic(points)
        return own | {"mean": np.where(np.abs(x - 0.9001) < 1e-9, np.nan, own["mean"])}

    plan = replace(SETTLED, error=0.005, adaptive=(replace(LOAD, include=(0.9001,)),))
    curve = curve_of(plan, function)
    place = np.searchsorted(curve.x, 0.9001 - 1e-9)
    assert not curve.joined["mean"][place - 1 : place + 1].any()
    assert not curve.scattered["mean"][place - 1 : place + 1].any()
    assert any(jump.low < 0.9001 < jump.high for jump in curve.jumps)
    assert all(np.isfinite([*zone.half_widths.values()]).all() for zone in curve.stretches)


def test_the_half_width_of_a_stretch_is_that_of_two_means_and_of_their_scatter() -> None:
    def function(points: Floats) -> dict[str, Floats]:
        x = points[:, -1]
        own = settled(x, x, np.where(np.abs(x - 0.8) < 1e-9, 0.5, 0.0))
        return own | {"regime": np.full(len(x), IRREGULAR), "mean.half_width": np.full(len(x), 0.02)}

    curve = curve_of(SETTLED, function)
    np.testing.assert_allclose(curve.half_widths["mean"], np.sqrt(2.0) * 0.02)
    place = np.searchsorted(curve.x, 0.8)
    spike = np.zeros(len(curve.x))
    spike[place - 6 : place + 7] = 0.5
    spike[[place - 7, place + 7]] = 0.25  # near points that are half as far off
    np.testing.assert_allclose(curve.half_widths["max"], spike)


def test_a_mean_that_is_not_known_to_the_error_is_told() -> None:
    curve = curve_of(replace(SETTLED, error=0.002), irregular_zone)
    assert any([*zone.half_widths] == ["mean", "max"] for zone in curve.stretches)


def test_a_zone_of_irregular_motion_is_told_where_a_result_scatters_in_a_part_of_it() -> None:
    def function(points: Floats) -> dict[str, Floats]:
        x = points[:, -1]
        own = irregular_zone(points)
        return own | {"max": 2.0 - x + np.where((x > 0.65) & (x < 0.75), 0.15 * noise(x), 0.0)}

    curve = curve_of(SETTLED, function)
    assert not curve.jumps
    (zone,) = curve.stretches
    assert [*zone.half_widths] == ["max"]
    assert (zone.low, zone.high) == pytest.approx((0.5, 0.9), abs=1.6 / 128)


def test_irregular_motion_is_reported_however_smooth_it_is() -> None:
    def function(points: Floats) -> dict[str, Floats]:
        x = points[:, -1]
        own = settled(x, x, x**2)
        return own | {"regime": np.full(len(x), IRREGULAR), "mean.half_width": np.full(len(x), 0.02)}

    wide = curve_of(SETTLED, function)
    assert [(zone.low, zone.high, [*zone.half_widths]) for zone in wide.stretches] == [(0.0, 1.6, ["mean", "max"])]
    # Of a mean the half width says how far it scatters, of an extreme nothing does.
    narrow = curve_of(replace(SETTLED, error=0.05), function)
    assert [(zone.low, zone.high, [*zone.half_widths]) for zone in narrow.stretches] == [(0.0, 1.6, ["max"])]
    assert not wide.jumps


def settling(x: Floats, periods: Floats, multiplier: Floats) -> dict[str, Floats]:
    """A straight curve of periodic motion that takes ``periods`` to settle."""
    return settled(x, x, 2.0 - x, **{"regime.settled_after": periods, "regime.multiplier": multiplier})


def test_where_settling_times_scatter_another_motion_may_lie_between_the_points() -> None:
    def function(points: Floats) -> dict[str, Floats]:
        x = points[:, -1]
        scatters = np.where((x > 0.7) & (x < 0.9), 1.0 + 0.3 * noise(x), 1.0)
        own = settling(x, 60.0 * scatters, np.full(len(x), 0.7))
        # An island narrower than the finest interval, which no point meets.
        return own | {"mean": np.where(np.abs(x - 0.8 - 0.5 * LEAF) < 0.25 * LEAF, 0.0, own["mean"])}

    curve = curve_of(SETTLED, function)
    assert curve.passed
    assert {(jump.why, jump.results) for jump in curve.jumps} == {(Why.SENSITIVE, ("mean", "max"))}
    assert any(jump.low <= 0.8 and jump.high >= 0.8 + LEAF for jump in curve.jumps)
    assert all(jump.low > 0.7 - 4 * LEAF and jump.high < 0.9 + 4 * LEAF for jump in curve.jumps)
    assert not errors_outside(curve, "mean", function).max() > 0.01


def test_a_settling_time_that_grows_near_a_bifurcation_is_no_scatter() -> None:
    def function(points: Floats) -> dict[str, Floats]:
        x = points[:, -1]
        rate = 1e-3 + np.abs(x - 0.8013)
        return settling(x, 20.0 / rate, np.exp(-rate))

    curve = curve_of(SETTLED, function)
    assert not curve.jumps
    assert len(curve.x) == 65


def test_a_motion_that_is_about_to_be_lost_is_reported_one_interval_further() -> None:
    def jump_of(multiplier: float) -> tuple[float, float]:
        def function(points: Floats) -> dict[str, Floats]:
            x = points[:, -1]
            rate = -np.log(np.where(x < 0.8013, multiplier, 0.5))
            own = settling(x, 20.0 / rate, np.exp(-rate))
            return own | {"mean": x - np.where(x > 0.8013, 1.0, 0.0)}

        (jump,) = curve_of(SETTLED, function).jumps
        return jump.low, jump.high

    assert jump_of(0.9) == pytest.approx((0.8, 0.8 + LEAF))
    assert jump_of(0.97) == pytest.approx((0.8 - 4.0 * LEAF, 0.8 + LEAF))
