"""Tables: no overshoot, closed on themselves, jumps where two rows share an angle."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sprag_study.engine.machine_shaft.problems import TableError
from sprag_study.engine.machine_shaft.tables import Table, over_stroke, periodic

TURN = 2.0 * math.pi


@given(st.lists(st.floats(-100.0, 100.0), min_size=3, max_size=20), st.sampled_from(["smooth", "linear"]))
@settings(max_examples=60, deadline=None)
def test_no_overshoot_and_periodic(values: list[float], interpolation: str) -> None:
    angles = np.linspace(0.0, TURN, len(values), endpoint=False)
    rows = tuple((float(a), v) for a, v in zip(angles, values, strict=True))
    curve = periodic(Table(rows, interpolation), TURN)  # type: ignore[arg-type]
    closed = [*values, values[0]]
    for k, left in enumerate(angles):
        inside = curve(np.linspace(left, left + TURN / len(values), 33)[:-1])
        low, high = sorted((closed[k], closed[k + 1]))
        assert inside.min() >= low - 1e-10
        assert inside.max() <= high + 1e-10
    x = np.linspace(-3.0, 9.0, 50)
    assert curve(x + TURN) == pytest.approx(curve(x), abs=1e-9)


def test_smooth_across_the_end_of_the_cycle() -> None:
    angles = np.linspace(0.3, TURN + 0.3, 73)[:-1]
    curve = periodic(Table(tuple((a, math.sin(a)) for a in angles)), TURN)
    x = np.linspace(0.0, TURN, 500)
    assert curve(x) == pytest.approx(np.sin(x), abs=1e-3)
    knots = angles[:-1]
    assert curve.slope(knots - 1e-9) == pytest.approx(curve.slope(knots + 1e-9), abs=1e-6)
    step = 1e-6
    assert curve.slope(x) == pytest.approx((curve(x + step) - curve(x - step)) / (2 * step), abs=1e-4)


def test_jumps() -> None:
    rows = ((0.0, 1.0), (1.0, 1.0), (1.0, 3.0), (2.0, 2.0), (2.0, 0.0), (4.0, 1.0), (TURN, 1.0))
    for interpolation in ("smooth", "linear"):
        curve = periodic(Table(rows, interpolation), TURN)  # type: ignore[arg-type]
        got = curve(np.array([0.5, 1.0 - 1e-12, 1.0 + 1e-12, 2.0 - 1e-12, 2.0 + 1e-12, 5.0, TURN + 0.5]))
        assert got == pytest.approx([1.0, 1.0, 3.0, 2.0, 0.0, 1.0, 1.0], abs=1e-10)


@pytest.mark.parametrize(
    ("rows", "found"),
    [
        (((0.0, 1.0),), "1"), (((0.0, 1.0), (TURN, 1.1)), "1.1"), (((0.0, 1.0), (7.0, 1.0)), "401.07 deg"),
        (((1.0, 1.0), (0.5, 1.0)), "0.5"), (((0.0, math.nan), (1.0, 1.0)), "a number that is not finite"),
        (((0.0, 1.0), (0.0, 2.0), (0.0, 3.0)), "0"),
    ],
)  # fmt: skip
def test_errors(rows: tuple[tuple[float, float], ...], found: str) -> None:
    with pytest.raises(TableError) as error:
        periodic(Table(rows), TURN)
    assert error.value.found == found


def test_over_the_stroke() -> None:
    curve = over_stroke(Table(((0.0, 0.0), (0.5, 2.0), (0.5, 5.0), (1.0, 6.0)), "linear"))
    assert curve(np.array([-1.0, 0.25, 0.75, 1.0, 2.0])) == pytest.approx([0.0, 1.0, 5.5, 6.0, 6.0])
    with pytest.raises(TableError) as error:
        over_stroke(Table(((0.1, 0.0), (1.0, 2.0))))
    assert error.value.found == "from 0.1 to 1"
