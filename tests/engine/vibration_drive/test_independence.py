"""A case's result depends on the case alone; its error on the tolerance alone."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from sprag_study.engine.run import Run
from sprag_study.engine.vibration_drive import kernel as kernels
from tests.engine.vibration_drive.drive import Columns, Results, batch_of, drive, periods

CASES = 64
RUN = periods(12.0, 8.0, 12.0, tolerance=1e-9)


def study(pendulums: int) -> list[Columns]:
    """Machines of very different lengths of calculation."""
    draw = np.random.default_rng(7)
    return [
        drive(
            pendulums,
            excitation__frequency=draw.uniform(10.0, 40.0),
            excitation__amplitude_x=draw.uniform(5e-4, 4e-3),
            shaft__load=draw.uniform(0.0, 0.8),
            pendulums__0__spring_rate=draw.uniform(5e3, 5e4),
        )
        for _ in range(CASES)
    ]


def values(cases: list[Columns], run: Run = RUN) -> NDArray[np.float64]:
    return Results(batch_of(cases), run, len(cases)).values


@pytest.fixture(scope="module", params=[1, 2])
def whole(request: pytest.FixtureRequest) -> tuple[list[Columns], NDArray[np.float64]]:
    """A study and its results in one batch."""
    cases = study(request.param)
    return cases, values(cases)


Whole = tuple[list[Columns], NDArray[np.float64]]


@pytest.mark.parametrize("size", [1, 7])
def test_any_batch_size_gives_the_same_bits(whole: Whole, size: int) -> None:
    cases, expected = whole
    parts = [values(cases[first : first + size]) for first in range(0, CASES, size)]
    np.testing.assert_array_equal(np.vstack(parts), expected)


def test_any_order_gives_the_same_bits(whole: Whole) -> None:
    cases, expected = whole
    order = np.random.default_rng(3).permutation(CASES)
    np.testing.assert_array_equal(values([cases[k] for k in order]), expected[order])


def test_scalars_and_arrays_give_the_same_bits(whole: Whole) -> None:
    cases, expected = whole
    np.testing.assert_array_equal(Results(cases[5], RUN, 1).values[0], expected[5])


def test_neighbours_that_end_badly_change_nothing(whole: Whole) -> None:
    cases, expected = whole
    angles = np.where(np.arange(CASES) % 3 > 0, np.nan, 0.0)
    found = Results(batch_of(cases) | {"pendulums.0.initial_angle": angles}, RUN, CASES)
    np.testing.assert_array_equal(found.values[::3], expected[::3])
    assert {str(found.endings[k]) for k in range(CASES) if k % 3} == {"diverged"}


def test_lane_count_does_not_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    cases = study(1)
    expected = values(cases)
    other = 8 if kernels.lane_count() == 40 else 40
    monkeypatch.setattr(kernels, "lane_count", lambda: other)
    np.testing.assert_array_equal(values(cases), expected)


def test_no_cases_give_no_rows() -> None:
    assert Results(drive(2), RUN, 0).values.shape == (0, len(Results(drive(2), RUN, 1).names))


@pytest.mark.parametrize("quantity", ["shaft.speed.mean", "torque.max", "pendulums.0.angle.max", "power.input.mean"])
def test_error_falls_with_the_tolerance(quantity: str, monkeypatch: pytest.MonkeyPatch) -> None:
    # One kernel of fixed order serves every tolerance, so that only the step size differs.
    order = kernels.order_for(1e-9)
    monkeypatch.setattr(kernels, "order_for", lambda tolerance: order)
    cases = study(1)[:24]
    exponents = np.arange(4, 12)

    def found(tolerance: float) -> NDArray[np.float64]:
        return Results(batch_of(cases), periods(12.0, 8.0, 12.0, tolerance=tolerance), len(cases))[quantity]

    exact = found(1e-13)
    turning = exact > 0.0
    errors = [np.median(np.abs(found(10.0**-k)[turning] / exact[turning] - 1.0)) for k in exponents]
    slope, _ = np.polyfit(-exponents, [math.log10(max(error, 1e-15)) for error in errors], 1)
    assert 0.7 < slope < 1.5
    assert errors[0] < 1e-3
    assert errors[9 - 4] < 1e-9
