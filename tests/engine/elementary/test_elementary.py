"""Elementary functions against those of the C library in extended precision, and in their special cases."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from numpy.typing import NDArray

from sprag_study.engine import elementary

Floats = NDArray[np.float64]

RNG = np.random.default_rng(5)
WIDE = 10.0 ** RNG.uniform(-300.0, 300.0, 500)
ANGLES = np.concatenate(
    [
        RNG.uniform(-4.0, 4.0, 2000),
        RNG.uniform(-9e5, 9e5, 500),
        np.arange(-99, 100) * 0.25 * math.pi,
        1e-9 * WIDE[WIDE < 1.0][:99],
    ]
)
FRACTIONS = np.concatenate([RNG.uniform(-1.0, 1.0, 2000), 1.0 - 10.0 ** RNG.uniform(-16.0, -1.0, 99), [-1.0, 0.0, 1.0]])
POWERS = np.concatenate([RNG.uniform(-700.0, 700.0, 1000), RNG.uniform(-2.0, 2.0, 1000)])


def ulps(computed: Floats, exact: NDArray[np.longdouble]) -> float:
    """The largest distance in units in the last place."""
    return float(np.max(np.abs(computed - exact) / np.spacing(np.abs(exact.astype(np.float64)))))


@pytest.mark.skipif(np.finfo(np.longdouble).nmant < 60, reason="needs numbers of more digits than double")
@pytest.mark.parametrize(
    ("name", "values", "most"),
    [
        ("sin", ANGLES, 3.0),
        ("cos", ANGLES, 3.0),
        ("tan", ANGLES, 4.0),
        ("arcsin", FRACTIONS, 3.0),
        ("arccos", FRACTIONS, 3.0),
        ("arctan", np.concatenate([POWERS, -WIDE]), 1.0),
        ("exp", POWERS, 1.0),
        ("log", WIDE, 1.0),
        ("log", np.abs(FRACTIONS[:2000]) + 0.5, 1.0),
        ("sinh", POWERS, 4.0),
        ("cosh", POWERS, 4.0),
        ("tanh", POWERS, 4.0),
    ],
)
def test_accurate_to_a_few_ulps(name: str, values: Floats, most: float) -> None:
    assert ulps(getattr(elementary, name)(values), getattr(np, name)(values.astype(np.longdouble))) < most


@pytest.mark.skipif(np.finfo(np.longdouble).nmant < 60, reason="needs numbers of more digits than double")
def test_functions_of_two_variables_are_accurate() -> None:
    y, x = RNG.normal(size=(2, 5000)) * 10.0 ** RNG.integers(-9, 9, (2, 5000))
    assert ulps(elementary.arctan2(y, x), np.arctan2(y.astype(np.longdouble), x.astype(np.longdouble))) < 2.0
    for base in (10.0 ** RNG.uniform(-3.0, 3.0, 5000), 1.0 + RNG.uniform(-1e-6, 1e-6, 5000), WIDE):
        exponent = RNG.uniform(-690.0, 690.0, len(base)) / np.log(base)
        exact = base.astype(np.longdouble) ** exponent.astype(np.longdouble)
        assert ulps(elementary.power(base, exponent), exact) < 1.0


def test_angles_of_any_size() -> None:
    """Against the remainder by pi to 1000 binary digits, from a series other than the one that is tested."""
    ones = 1 << 1100

    def arctangent_of_one_by(x: int) -> int:
        return sum((-1) ** k * (ones // ((2 * k + 1) * x ** (2 * k + 1))) for k in range(560))

    turn = Fraction(8 * (arctangent_of_one_by(2) + arctangent_of_one_by(3)), ones)
    for angle in (1e7, -3e9, 1e22, 2.0**1023, 5e15):
        left = float(Fraction(angle) % turn)
        assert float(elementary.sin(angle)) == pytest.approx(math.sin(left), abs=6e-16)
        assert float(elementary.cos(angle)) == pytest.approx(math.cos(left), abs=6e-16)
    mixed = elementary.sin(np.array([[1e22, 1.0], [math.inf, -1e22]]))
    assert mixed.shape == (2, 2)
    assert np.isnan(mixed[1, 0])
    assert mixed[0, 1] == elementary.sin(1.0)
    assert mixed[0, 0] == -mixed[1, 1] == elementary.sin(1e22)


SPECIAL = np.array([0.0, -0.0, 1.0, -1.0, 2.0, -2.0, 0.25, -3.0, 1e300, -1e300, 5e-324, math.inf, -math.inf, math.nan])


@pytest.mark.parametrize("name", ["arctan", "exp", "log", "sinh", "cosh", "tanh", "arcsin", "arccos"])
def test_special_values_are_those_of_c(name: str) -> None:
    with np.errstate(all="ignore"):
        np.testing.assert_allclose(getattr(elementary, name)(SPECIAL), getattr(np, name)(SPECIAL), rtol=1e-15)


@pytest.mark.parametrize("name", ["power", "arctan2"])
def test_special_pairs_are_those_of_c(name: str) -> None:
    x, y = np.meshgrid(SPECIAL, SPECIAL)
    with np.errstate(all="ignore"):
        computed, known = getattr(elementary, name)(x, y), getattr(np, name)(x, y)
    # Two infinities have no angle here.
    meant = ~(np.isinf(x) & np.isinf(y)) if name == "arctan2" else np.full(x.shape, fill_value=True)
    np.testing.assert_allclose(computed[meant], known[meant], rtol=1e-15)
    there = meant & ~np.isnan(known)
    assert np.array_equal(np.signbit(computed[there]), np.signbit(known[there]))


@pytest.mark.parametrize("exponent", [2.0, 1.0, 0.5, -0.5, -1.0, 3])
def test_simple_powers(exponent: float) -> None:
    values = np.array([0.0, 0.3, 7.0, 1e200, math.inf])
    with np.errstate(all="ignore"):
        np.testing.assert_allclose(elementary.power(values, exponent), values**exponent, rtol=3e-16)


def test_arguments_broadcast_and_are_left_as_they_are() -> None:
    given = np.linspace(0.1, 0.9, 6).reshape(2, 3)
    kept = given.copy()
    given.flags.writeable = False
    assert np.array_equal(elementary.sin(given.T), elementary.sin(kept).T)
    assert elementary.power(given, np.array([[2.5], [3.5]])).shape == (2, 3)
    assert elementary.arctan2(1.0, given[0]).shape == (3,)
    assert float(elementary.cos(0)) == 1.0
    assert np.array_equal(given, kept)
