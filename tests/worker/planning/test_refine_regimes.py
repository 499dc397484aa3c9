"""Refined curves of settled motions: regimes, orders, irregular zones and settling times; no engine."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sprag_study.worker.models.vibration_drive.settled import IRREGULAR
from sprag_study.worker.planning.curves import Why
from tests.worker.planning.refining import (
    LEAF,
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
    zone = next(jump for jump in curve.jumps if jump.why is Why.IRREGULAR)
    assert zone.results == ("max",)
    assert zone.low == pytest.approx(0.5, abs=1.6 / 64)
    assert zone.high == pytest.approx(0.9, abs=1.6 / 64)
    inner = curve.x[(curve.x > 0.55) & (curve.x < 0.85)]
    assert len(inner) < 0.3 / (1.6 / 256) / 2
    assert curve.joined["mean"].all()
    assert not curve.joined["max"][(curve.x[:-1] >= zone.low) & (curve.x[:-1] < zone.high)].any()


def test_a_mean_that_is_not_known_to_the_error_is_told() -> None:
    curve = curve_of(replace(SETTLED, error=0.002), irregular_zone)
    assert any(set(jump.results) == {"mean", "max"} for jump in curve.jumps if jump.why is Why.IRREGULAR)


def test_a_zone_of_irregular_motion_is_told_where_a_result_scatters_in_a_part_of_it() -> None:
    def function(points: Floats) -> dict[str, Floats]:
        x = points[:, -1]
        own = irregular_zone(points)
        return own | {"max": 2.0 - x + np.where((x > 0.65) & (x < 0.75), 0.15 * noise(x), 0.0)}

    curve = curve_of(SETTLED, function)
    (zone,) = curve.jumps
    assert (zone.why, zone.results) == (Why.IRREGULAR, ("max",))
    assert (zone.low, zone.high) == pytest.approx((0.5, 0.9), abs=1.6 / 128)


def test_irregular_motion_is_reported_however_smooth_it_is() -> None:
    def function(points: Floats) -> dict[str, Floats]:
        x = points[:, -1]
        own = settled(x, x, x**2)
        return own | {"regime": np.full(len(x), IRREGULAR), "mean.half_width": np.full(len(x), 0.02)}

    wide = curve_of(SETTLED, function)
    assert [(jump.low, jump.high, jump.results) for jump in wide.jumps] == [(0.0, 1.6, ("mean", "max"))]
    # Of a mean the half width says how far it scatters, of an extreme nothing does.
    narrow = curve_of(replace(SETTLED, error=0.05), function)
    assert [(jump.low, jump.high, jump.results) for jump in narrow.jumps] == [(0.0, 1.6, ("max",))]


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
