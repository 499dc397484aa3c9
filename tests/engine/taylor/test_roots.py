"""First root and largest value of a polynomial on [0, 1], against numpy and by construction."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from sprag_study.engine.taylor.roots import NO_ROOT, work_stack
from tests.engine.taylor.polynomials import first_root, largest

Floats = NDArray[np.float64]

#: Fixed examples, so that a failure can be repeated.
PROFILE = settings(max_examples=300, derandomize=True, deadline=None, database=None)


def first(*coefficients: float) -> float:
    """First root of a polynomial by its coefficients, constant first."""
    return first_root(np.array(coefficients, dtype=np.float64), len(coefficients) - 1, work_stack())


def peak(coefficients: Floats, known: float = -np.inf) -> float:
    return largest(np.asarray(coefficients, dtype=np.float64), len(coefficients) - 1, known, work_stack())


def from_roots(*roots: float, scale: float = 1.0) -> Floats:
    """Coefficients, constant first, of a polynomial that is positive at 0 and has these roots."""
    monic = np.polynomial.polynomial.polyfromroots(roots)
    return scale * monic * np.sign(monic[0])


@pytest.mark.parametrize("root", [1e-12, 1e-3, 0.25, 1 / 3, 0.5, 0.999999, 1.0])
def test_simple_root(root: float) -> None:
    assert first(root, -1.0) == pytest.approx(root, rel=4e-16)


@pytest.mark.parametrize("coefficients", [(1.0,), (1.0, -0.999), (2.0, -1.0, -0.5), (1.0, -4.0, 4.0 + 1e-9)])
def test_no_root(coefficients: tuple[float, ...]) -> None:
    assert first(*coefficients) == NO_ROOT


def test_nothing_but_zeros_has_no_root() -> None:
    assert first(0.0, 0.0, 0.0) == NO_ROOT


@pytest.mark.parametrize("gap", [1e-2, 1e-4, 1e-6])
@pytest.mark.parametrize("place", [0.1, 0.5, 0.77, 0.99])
def test_a_pair_of_roots_is_not_missed(place: float, gap: float) -> None:
    assert first(*from_roots(place, place + gap, 3.0, -2.0)) == pytest.approx(place, abs=1e-9)


def test_a_near_miss_is_no_root() -> None:
    square = from_roots(0.4, 0.4)
    square[0] += 1e-10
    assert first(*square) == NO_ROOT


def test_three_roots_give_the_first() -> None:
    assert first(*from_roots(0.2, 0.21, 0.8)) == pytest.approx(0.2, abs=1e-13)


def test_root_at_the_start_that_was_dealt_with() -> None:
    # g = x (x - 0.5) (x - 0.7): positive after 0, next root 0.5.
    assert first(0.0, 0.35, -1.2, 1.0) == pytest.approx(0.5, abs=1e-15)
    assert first(0.0, 0.0, 0.35, -1.2, 1.0) == pytest.approx(0.5, abs=1e-15)


def test_violated_from_the_start() -> None:
    assert first(-1e-300, 1.0) == 0.0
    assert first(0.0, -1.0, 5.0) == 0.0


@pytest.mark.parametrize("scale", [1e-250, 1e-9, 1e9, 1e250])
def test_scale_does_not_matter(scale: float) -> None:
    assert first(*from_roots(0.3, 0.6, 2.0, scale=scale)) == pytest.approx(0.3, abs=1e-14)


def test_fast_oscillation() -> None:
    # Chebyshev's polynomial T_14 on [0, 1] starts at 1 and swings between -1 and 1.
    g = np.polynomial.chebyshev.Chebyshev.basis(14, domain=[0.0, 1.0]).convert(kind=np.polynomial.Polynomial).coef
    expected = 0.5 - 0.5 * np.cos(0.5 * np.pi / 14)
    assert first(*g) == pytest.approx(expected, abs=1e-12)
    # Its coefficients reach 1e9, which costs as many digits.
    assert peak(g) == pytest.approx(1.0, abs=1e-6)


ROOTS = st.lists(st.floats(-2.0, 3.0).filter(lambda r: abs(r) > 1e-3), min_size=1, max_size=7)


@PROFILE
@given(ROOTS)
def test_random_roots(roots: list[float]) -> None:
    g = from_roots(*roots)
    found = first(*g)
    inside = sorted(r for r in roots if 0.0 < r <= 1.0)
    if found == NO_ROOT:
        # Only roots of even multiplicity (to rounding), or one on the very edge, leave no change of sign.
        samples = np.polynomial.polynomial.polyval(np.linspace(0.0, 1.0, 2001), g)
        assert samples.min() > -1e-12 * np.abs(g).sum()
    else:
        assert inside or min(abs(r - 1.0) for r in roots) < 1e-6
        values = np.polynomial.polynomial.polyval(np.linspace(0.0, found * (1.0 - 1e-9), 1001), g)
        assert values.min() > -1e-12 * np.abs(g).sum()
        assert abs(np.polynomial.polynomial.polyval(found, g)) <= 1e-12 * np.abs(g).sum()


# Multiples of 1/1000: numpy's roots suffer from tiny leading coefficients.
COEFFICIENTS = st.lists(st.integers(-5000, 5000).map(lambda k: k / 1000), min_size=2, max_size=15)


@PROFILE
@given(COEFFICIENTS)
def test_first_root_against_numpy(tail: list[float]) -> None:
    g = np.array([1.0, *tail])
    found = first(*g)
    roots = np.roots(np.trim_zeros(g[::-1], "f"))
    real = np.sort(roots[np.abs(roots.imag) < 1e-7].real)
    crossing = real[(real > 0.0) & (real <= 1.0)]
    if crossing.size == 0:
        assert found == NO_ROOT or found > 1.0 - 1e-6
    elif found != NO_ROOT:
        assert np.abs(real - found).min() < 1e-5
        assert found >= crossing[0] - 1e-5
    else:
        samples = np.polynomial.polynomial.polyval(np.linspace(0.0, 1.0, 2001), g)
        assert samples.min() > -1e-9


@PROFILE
@given(COEFFICIENTS, st.floats(-10.0, 10.0))
def test_largest_value_is_exact(coefficients: list[float], known: float) -> None:
    g = np.array(coefficients)
    slope = np.polynomial.polynomial.polyder(g)
    roots = np.roots(np.trim_zeros(slope[::-1], "f")) if np.any(slope) else np.array([])
    places = [0.0, 1.0, *np.clip(roots.real[np.abs(roots.imag) < 1e-4], 0.0, 1.0)]
    places += list(np.linspace(0.0, 1.0, 101))
    expected = max(known, *np.polynomial.polynomial.polyval(np.array(places), g))
    assert peak(g, known) == pytest.approx(expected, abs=1e-11 * (np.abs(g).sum() + abs(known)) + 1e-300)


def test_maximum_that_rises_and_falls_twice_between_rising_ends() -> None:
    # The slope is positive at both ends; two peaks lie between, the first one higher.
    slope = -from_roots(0.2, 0.35, 0.6, 0.62)
    g = np.polynomial.polynomial.polyint(np.abs(slope[0]) / slope[0] * slope)
    values = np.polynomial.polynomial.polyval(np.array([0.0, 0.2, 0.35, 0.6, 0.62, 1.0]), g)
    assert peak(g) == pytest.approx(values.max(), abs=1e-16)
    shifted = g - np.array([0.0, values[-1] + 1e-3, *[0.0] * (len(g) - 2)])
    places = np.linspace(0.0, 1.0, 200001)
    assert peak(shifted) == pytest.approx(np.polynomial.polynomial.polyval(places, shifted).max(), abs=1e-10)
