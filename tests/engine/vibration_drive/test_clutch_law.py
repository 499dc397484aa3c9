"""A given clutch law: what is refused and warned of, and its torque, stiffness and stored energy."""

import math
import pickle
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sprag_study.engine.vibration_drive.clutch import ClutchLawError, check_law, stiffness, stored_energy, torque
from sprag_study.engine.vibration_drive.clutch_law import find_dip

LAW = (0.5, 200.0, 0.0, 20000.0)


def test_a_sound_law_passes_without_a_word():
    law = check_law([0, 200, 0, 20000])
    assert law.coefficients == (0.0, 200.0, 0.0, 20000.0)
    assert law.windup_limit == math.inf
    assert law.monotone
    assert law.warnings == ()
    assert check_law(np.array([0.0, 200.0]), 0.06).windup_limit == 0.06


@pytest.mark.parametrize(
    ("coefficients", "limit", "message"),
    [
        ((-1.0, 200.0), math.inf, "c_1 = -1 N*m is negative"),
        ((-1e-20, 200.0), 0.06, "c_1 = -1e-20 N*m is negative"),
        ((0.0, -1.0, 1.0), math.inf, "the first coefficient that is not zero must be positive"),
        ((0.0, 200.0, -1000.0), math.inf, "at most 0.2 rad, give that as windup_limit"),
        ((0.0, 200.0, -1000.0), 0.21, "lower windup_limit to at most 0.2 rad"),
        ((0.0, 1.0, -2.01, 1.0), math.inf, "from 0.904875 rad to 1.10512 rad"),
        ((0.0, 1.0, 0, 0, 0, 0, 0, 0, 0, 0, 0, -1e-30), math.inf, "at every windup above 1000 rad"),
        # the small root of -u + u^2 beside a root bound of 1e37
        ((0.0, -1.0, 1.0, 0, 0, 0, 0, 0, 0, 0, 1e-300), math.inf, "from 0 rad to 1 rad"),
        ((0.0, 0.0, 0.0), math.inf, "every coefficient is zero"),
    ],
)
def test_a_law_that_would_pull_the_shaft_back_is_refused_with_advice(coefficients, limit, message):
    with pytest.raises(ClutchLawError) as caught:
        check_law(coefficients, limit)
    assert message in caught.value.message
    assert caught.value.name == "coefficients"
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


@pytest.mark.parametrize(
    ("coefficients", "limit"),
    [
        ((0.0, 200.0, -1000.0), 0.2),  # falls to zero just at the end of its range
        ((0.0, 1.0, -2.0, 1.0), math.inf),  # u (u - 1)^2 touches zero
        ((0.0, 0.09, -0.6, 1.0), math.inf),  # u (u - 0.3)^2 in coefficients that are not exact
        ((0.0, 1.0, 0, 0, 0, 0, 0, 0, 0, 0, 0, -1e-30), 1e3),
        ((3.0,), math.inf),
    ],
)
def test_a_law_that_only_touches_zero_is_accepted(coefficients, limit):
    assert check_law(coefficients, limit).coefficients == tuple(map(float, coefficients))


@pytest.mark.parametrize(
    ("coefficients", "limit", "name", "allowed"),
    [
        ([], math.inf, "coefficients", "1 to 12 numbers"),
        ([0.0] * 13, math.inf, "coefficients", "1 to 12 numbers"),
        ("0 200", math.inf, "coefficients", "1 to 12 numbers"),
        (200.0, math.inf, "coefficients", "1 to 12 numbers"),
        ([0.0, math.nan], math.inf, "coefficients.1", "N*m/rad^1"),
        ([0.0, 1.0, math.inf], math.inf, "coefficients.2", "N*m/rad^2"),
        ([0.0, 1e31], math.inf, "coefficients.1", "-1e+30 .. 1e+30"),
        ([0.0, "200"], math.inf, "coefficients.1", "N*m/rad^1"),
        ([0.0, True], math.inf, "coefficients.1", "N*m/rad^1"),
        ([0.0, 10**400], math.inf, "coefficients.1", "N*m/rad^1"),
        ([0.0, 200.0], 0.0, "windup_limit", "> 0 rad"),
        ([0.0, 200.0], -0.1, "windup_limit", "> 0 rad"),
        ([0.0, 200.0], math.nan, "windup_limit", "> 0 rad"),
        ([0.0, 200.0], 1e4, "windup_limit", "<= 1000 rad"),
        ([0.0, 200.0], None, "windup_limit", "or infinite"),
    ],
)
def test_wrong_numbers_are_refused_by_name_value_and_range(coefficients, limit, name, allowed):
    with pytest.raises(ClutchLawError) as caught:
        check_law(coefficients, limit)
    assert caught.value.name == name
    assert allowed in caught.value.allowed
    assert str(caught.value).startswith(f"{name}: ")


def test_what_is_allowed_but_notable_is_said():
    locking = check_law([2.0, 100.0])
    assert [warning.code for warning in locking.warnings] == ["law-jumps"]
    falling = check_law([0.0, 200.0, -1000.0], 0.15)
    assert not falling.monotone
    assert [warning.code for warning in falling.warnings] == ["law-falls", "law-ends-falling"]
    assert "from 0.1 rad to 0.15 rad" in falling.warnings[0]
    assert "u = 0.225 rad" in falling.warnings[1]
    wavy = check_law([0.0, 1.0, -2.0, 1.1], 1.0)
    assert not wavy.monotone
    assert [warning.code for warning in wavy.warnings] == [
        "law-falls"
    ]  # it rises again before the end, so nothing falls to zero beyond


@given(
    roots=st.lists(st.floats(0.01, 10.0), min_size=1, max_size=3, unique=True),
    pair=st.tuples(st.floats(-5.0, 5.0), st.floats(0.05, 5.0)),
    limit=st.floats(0.005, 20.0) | st.just(math.inf),
)
def test_a_dip_is_found_from_the_roots_the_law_was_made_of(roots, pair, limit):
    ordered = sorted(roots)
    assume(all(b - a > 1e-2 for a, b in pairwise(ordered)))
    assume(all(abs(root - limit) > 1e-2 for root in ordered))
    real, imaginary = pair
    law = np.polynomial.polynomial.polyfromroots([*ordered, complex(real, imaginary), complex(real, -imaginary)]).real
    if law[0] < 0.0:
        law = -law
    dip = find_dip(law, limit)
    if ordered[0] > limit:  # positive at zero and no change of sign within the range
        assert dip is None
    else:
        assert dip is not None
        assert np.polynomial.polynomial.polyval(dip.at, law) < 0.0
        assert dip.value == pytest.approx(np.polynomial.polynomial.polyval(dip.at, law), rel=1e-6, abs=1e-9)
        assert any(dip.start == pytest.approx(root, rel=1e-6) for root in ordered)


def test_torque_is_the_polynomial_then_a_straight_line_with_no_jump_in_value_or_slope():
    limit = 0.05
    at_end = 0.5 + 200 * limit + 20000 * limit**3
    slope = 200 + 3 * 20000 * limit**2
    u = np.array([[-0.01, 0.0, 0.02], [limit, 0.06, 1.0]])
    expected = [[0.0, 0.5, 0.5 + 4.0 + 0.16], [at_end, at_end + 0.01 * slope, at_end + 0.95 * slope]]
    np.testing.assert_allclose(torque(LAW, limit, u), expected, rtol=1e-14)
    np.testing.assert_allclose(stiffness(LAW, limit, u), [[0, 200, 224], [slope] * 3], rtol=1e-14)


def test_an_infinite_range_goes_on_along_the_polynomial():
    u = np.array([0.0, 0.1, 1.0])
    np.testing.assert_allclose(torque(LAW, math.inf, u), 0.5 + 200 * u + 20000 * u**3, rtol=1e-14)
    np.testing.assert_allclose(stored_energy(LAW, math.inf, u), 0.5 * u + 100 * u**2 + 5000 * u**4, rtol=1e-14)
    assert torque(LAW, math.inf, 0.1).shape == ()


@given(
    coefficients=st.lists(st.floats(0.0, 10.0), min_size=1, max_size=6),
    limit=st.floats(0.1, 2.0) | st.just(math.inf),
    first=st.floats(-0.5, 3.0),
    width=st.floats(0.0, 2.0),
)
def test_stored_energy_is_the_integral_of_the_torque(coefficients, limit, first, width):
    ends = sorted({first, first + width, *(x for x in (0.0, limit) if first < x < first + width)})
    nodes, weights = np.polynomial.legendre.leggauss(6)  # exact to degree 11 on each smooth piece
    work = 0.0
    for a, b in pairwise(ends):
        work += 0.5 * (b - a) * float(weights @ torque(coefficients, limit, 0.5 * (a + b) + 0.5 * (b - a) * nodes))
    change = stored_energy(coefficients, limit, first + width) - stored_energy(coefficients, limit, first)
    assert float(change) == pytest.approx(work, rel=1e-10, abs=1e-9)
