"""Measured base motions reduced to harmonics (docs/theory.md, "Measured base motion")."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sprag_study.engine.vibration_drive.measured_base import Floats, reduce_motion, resolved_order

_TURN = 2.0 * math.pi


def angles(rows: int, unequal: float, seed: int) -> Floats:
    """Ascending angles over one turn, each moved by up to ``unequal`` of the gap between them."""
    draw = np.random.default_rng(seed)
    moved: Floats = (np.arange(rows) + draw.uniform(-unequal, unequal, rows)) * (_TURN / rows)
    return moved


@pytest.mark.parametrize(
    ("rows", "unequal", "closed"), [(64, 0.0, False), (64, 0.0, True), (65, 0.3, False), (90, 0.45, True)]
)
def test_a_series_gives_its_coefficients(rows: int, unequal: float, closed: bool) -> None:
    angle = angles(rows, unequal, rows)
    if closed:
        angle = np.append(angle, angle[0] + _TURN)
    draw = np.random.default_rng(7)
    orders = np.sort(draw.choice(np.arange(1, resolved_order(angle) + 1), 9, replace=False))
    cosines, sines = draw.normal(size=(2, 9, 2))
    turned = np.outer(angle, orders)
    reduction = reduce_motion(angle, 0.3 + np.cos(turned) @ cosines + np.sin(turned) @ sines, 1e-9)
    # Unequal gaps may let an order be added that the series lacks; its factors are 0.
    places = np.searchsorted(reduction.orders, orders)
    np.testing.assert_array_equal(reduction.orders[places], orders)
    np.testing.assert_allclose(reduction.cosines[places], cosines, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(reduction.sines[places], sines, rtol=0.0, atol=1e-12)
    further = np.setdiff1d(np.arange(len(reduction.orders)), places)
    assert unequal or not further.size
    assert np.all(reduction.cosines[further] == 0.0)
    assert np.max(reduction.largest) < 1e-12


def test_a_sawtooth_has_its_fourier_series() -> None:
    rows, steps = 721, np.arange(721)
    angle = steps * (_TURN / 720)
    wave = np.where(steps % 720 == 0, 0.0, 1.0 - steps / 360)
    reduction = reduce_motion(angle, np.column_stack([np.zeros(rows), 2e-3 * wave]), 0.01)
    np.testing.assert_array_equal(reduction.orders, np.arange(1, 17))
    # Of n rows the sum (2/n) sum_j y_j sin(m angle_j) is (2/n) cot(pi m/n), and 2/(pi m) of the wave itself.
    m = reduction.orders
    np.testing.assert_allclose(reduction.sines[:, 1], 2e-3 * (2.0 / 720) / np.tan(math.pi * m / 720), rtol=1e-12)
    np.testing.assert_allclose(reduction.sines[:, 1], 2e-3 * 2.0 / (math.pi * m), rtol=2e-3)
    np.testing.assert_allclose(reduction.cosines, 0.0, atol=1e-17)
    assert not reduction.sines[:, 0].any()
    # What is left follows from Parseval's theorem.
    left = np.mean(np.square(wave[:-1])) - np.sum(np.square((2.0 / 720) / np.tan(math.pi * m / 720))) / 2.0
    assert reduction.rms[1] == pytest.approx(2e-3 * math.sqrt(left), rel=1e-9)
    assert reduction.amplitude == pytest.approx(2e-3, rel=3e-3)
    assert reduction.largest[1] / reduction.amplitude == pytest.approx(0.91, abs=0.01)


def test_few_orders_do_for_a_coarse_reduction() -> None:
    angle = angles(120, 0.0, 1)
    motion = np.column_stack([np.cos(angle) + 0.02 * np.cos(5.0 * angle), 0.005 * np.sin(9.0 * angle)])
    assert [reduce_motion(angle, motion, share).orders.tolist() for share in (0.1, 0.01, 1e-3)] == [
        [1],
        [1, 5],
        [1, 5, 9],
    ]


def test_rows_resolve_orders_below_half_their_number() -> None:
    assert [resolved_order(angles(rows, 0.0, 0)) for rows in (8, 9, 64, 128, 129, 5000)] == [3, 4, 31, 63, 64, 64]
    assert resolved_order(np.delete(angles(64, 0.0, 0), 10)) == 15
    wide = np.array([0.0, 0.1, 0.2, 0.3])
    with pytest.raises(ValueError, match="half a period"):
        reduce_motion(wide, np.column_stack([wide, wide]), 0.01)
