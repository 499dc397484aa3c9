"""Branches of oscillators with known folds and doublings, through the code that follows the drive's."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, root

from sprag_study.engine.continuation.follow import Range, follow
from sprag_study.engine.continuation.problem import Branch, End, Kind
from tests.engine.continuation.problems import Duffing, Halved, Impact

Floats = NDArray[np.float64]


def stability(made: Branch) -> list[bool]:
    """Whether the points are stable, without repetitions and without the special points themselves."""
    special = {one.index for one in made.specials}
    flags = [point.stable for k, point in enumerate(made.points) if k not in special]
    return [flag for k, flag in enumerate(flags) if not k or flag != flags[k - 1]]


@pytest.fixture(scope="module")
def duffing() -> Branch:
    return follow(Duffing(0.1, 1.0, 0.3), [-0.1, 0.0], 2.0, Range(1.25, 2.0, first=0.1, most=0.15))


def test_a_branch_goes_around_its_folds(duffing: Branch) -> None:
    assert duffing.ends == (End.RANGE, End.RANGE)
    assert (duffing.points[0].parameter, duffing.points[-1].parameter) == (1.25, 2.0)
    assert [special.kind for special in duffing.specials] == [Kind.FOLD, Kind.FOLD]
    assert stability(duffing) == [True, False, True]
    for special in duffing.specials:
        assert special.multipliers[0] == pytest.approx(1.0, abs=1e-6)
    # The divergence is constant, and so is the product of the multipliers.
    for point in duffing.points:
        product = point.multipliers[0] * point.multipliers[1]
        assert product == pytest.approx(math.exp(-0.1 * 2.0 * math.pi / point.parameter), rel=1e-6)


def test_a_branch_ends_at_its_range_to_the_last_bit() -> None:
    low, parameter, high = 1.8, 1.85, 1.87
    assert low / (high - low) * (high - low) != low
    made = follow(Duffing(0.1, 1.0, 0.3), [-0.1, 0.0], parameter, Range(low, high))
    assert (made.points[0].parameter, made.points[-1].parameter) == (low, high)
    assert made.points[made.start].parameter == parameter


def test_folds_of_the_duffing_oscillator_are_those_of_dop853(duffing: Branch) -> None:
    oscillator = Duffing(0.1, 1.0, 0.3)

    def rates(phase: float, y: Floats, frequency: float) -> Floats:
        """The state and the derivatives of it by the state at the start."""
        x, v = y[:2]
        stretch = np.array([[0.0, 1.0], [-1.0 - 3.0 * x * x, -0.1]]) / frequency
        return np.concatenate([oscillator.rate(phase, x, v, frequency), (stretch @ y[2:].reshape(2, 2)).reshape(-1)])

    def bordered(z: Floats) -> Floats:
        """A fixed point whose derivative has the eigenvalue 1."""
        start = np.concatenate([z[:2], np.eye(2).reshape(-1)])
        found = solve_ivp(rates, (0.0, 2.0 * math.pi), start, "DOP853", args=(z[2],), rtol=1e-13, atol=1e-14)
        end = found.y[:, -1]
        return np.array([*(end[:2] - z[:2]), np.linalg.det(end[2:].reshape(2, 2) - np.eye(2))])

    for special in duffing.specials:
        point = duffing.points[special.index]
        exact = root(bordered, [*point.state, special.parameter + 1e-4], tol=1e-11)
        assert special.parameter == pytest.approx(exact.x[2], abs=1e-7)


def test_one_impact_orbits_have_their_closed_form() -> None:
    oscillator = Impact(2.5, 0.8)
    phase, speed, _ = oscillator.orbits(-0.5)[1]
    made = follow(oscillator, [phase + 1e-3, speed], -0.5, Range(-1.6, 0.15, most=0.1))
    kinds = {special.kind: special for special in made.specials}
    assert kinds[Kind.FOLD].parameter == pytest.approx(-oscillator.fold, abs=1e-9)
    doubling = brentq(lambda stop: oscillator.orbits(stop)[1][2] + 1.0 + 0.8**2, 0.0, 0.1, xtol=1e-13)
    assert kinds[Kind.DOUBLING].parameter == pytest.approx(doubling, abs=1e-8)
    assert len(made.specials) == 2
    assert stability(made) == [False, True, False]
    for point in made.points:
        both = oscillator.orbits(point.parameter) or oscillator.orbits(-oscillator.fold * (1.0 - 1e-15))
        apart = [max(abs(point.state[0] - phase), abs(point.state[1] - speed)) for phase, speed, _ in both]
        assert min(apart) < 1e-6
        trace = both[apart.index(min(apart))][2]
        assert sum(point.multipliers).real == pytest.approx(trace, abs=1e-5)
    # Both orbits of one stop, before and after the fold.
    middle = [point for point in made.points if -1.3 < point.parameter < -0.6]
    assert {point.stable for point in middle} == {True, False}


@pytest.mark.parametrize("parameter", [0.5, 0.6, 0.75])
def test_a_branch_ends_where_its_period_is_halved(parameter: float) -> None:
    made = follow(Halved(), [math.sqrt(parameter)], parameter, Range(-1.0, 1.5))
    assert made.ends == (End.HALVED, End.RANGE)
    (doubling,) = made.specials
    assert (doubling.kind, doubling.parameter) == (Kind.DOUBLING, pytest.approx(0.0, abs=1e-9))


def test_a_range_without_the_parameter_is_refused() -> None:
    with pytest.raises(ValueError, match=r"the parameter 3 must be within 1 \.\. 2"):
        follow(Duffing(0.1, 1.0, 0.3), [0.0, 0.0], 3.0, Range(1.0, 2.0))
