"""The clutch fit: recovery of known laws, the report of the normal matrix, and every refusal."""

import csv
import math
import pickle
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sprag_study.engine.vibration_drive.clutch import (
    HIGHEST_DEGREE,
    ClutchError,
    ClutchFit,
    ClutchFitError,
    fit_clutch,
    torque,
)
from sprag_study.engine.vibration_drive.singular_values import singular_values

EXAMPLE = Path(__file__).parents[3] / "examples" / "clutch_measured.csv"


def codes(fit: ClutchFit) -> list[str]:
    """The codes of a fit's warnings."""
    return [warning.code for warning in fit.warnings]


def rows(law, angles):
    return np.column_stack((angles, np.polynomial.polynomial.polyval(np.asarray(angles, dtype=float), law)))


def noisy_rows():
    u = np.linspace(0.0, 0.06, 31)
    return np.column_stack((u, 200 * u + 20000 * u**3 + 0.1 * np.sin(37.0 * np.arange(31.0))))


def gram(windups, powers):
    """The matrix of (7) in exact rational arithmetic."""
    exact = [Fraction(float(u)) for u in windups]
    return [[sum((u ** (i + k) for u in exact), Fraction(0)) for k in powers] for i in powers]


def exact_inverse(matrix):
    n = len(matrix)
    work = [list(row) + [Fraction(int(i == j)) for j in range(n)] for i, row in enumerate(matrix)]
    for i in range(n):
        pivot = next(r for r in range(i, n) if work[r][i])
        work[i], work[pivot] = work[pivot], work[i]
        work[i] = [value / work[i][i] for value in work[i]]
        for r in range(n):
            if r != i:
                work[r] = [a - work[r][i] * b for a, b in zip(work[r], work[i], strict=True)]
    return [row[n:] for row in work]


@settings(deadline=None)
@given(
    law=st.lists(st.floats(0.0, 1e3) | st.just(0.0), min_size=1, max_size=6),
    top=st.floats(1.0, 1e3),
    end=st.floats(1e-3, 2.0),
    count=st.integers(9, 40),
    through_origin=st.booleans(),
)
def test_a_polynomial_law_is_recovered(law, top, end, count, through_origin):
    scaled = np.array(
        [0.0 if through_origin else law[0], *law[1:], top]
    )  # torques of each term at the end of the range
    u = np.linspace(0.0, end, count)
    measured = np.polynomial.polynomial.polyval(u / end, scaled)
    fit = fit_clutch(np.column_stack((u, measured)), 1e-9 * measured.max(), through_origin=through_origin)
    assert fit.degree <= scaled.size - 1
    assert fit.windup_limit == end
    assert len(fit.coefficients) == fit.degree + 1
    between = np.linspace(0.0, end, 3 * count + 1)
    expected = np.polynomial.polynomial.polyval(between / end, scaled)
    np.testing.assert_allclose(torque(fit.coefficients, end, between), expected, rtol=0.0, atol=3e-8 * measured.max())


def test_terms_that_are_absent_come_back_as_exact_zeros():
    u = np.linspace(0.0, 0.06, 25)
    fit = fit_clutch(rows([0.0, 200.0, 0.0, 20000.0], u), 1e-9, through_origin=False)
    assert fit.coefficients == pytest.approx((0.0, 200.0, 0.0, 20000.0), rel=1e-12, abs=0.0)
    assert fit_clutch(rows([0, 0, 0, 2e4], u), 1e-9, through_origin=False).coefficients[:3] == (0.0, 0.0, 0.0)


def test_the_lowest_degree_that_reaches_the_accuracy_is_taken():
    data = noisy_rows()
    fits = {accuracy: fit_clutch(data, accuracy) for accuracy in (5.0, 0.3, 0.15)}
    assert [fits[accuracy].degree for accuracy in (5.0, 0.3, 0.15)] == [1, 2, 3]
    for accuracy, fit in fits.items():
        assert [report.degree for report in fit.degrees_tried] == list(range(1, fit.degree + 1))
        assert all(report.max_residual > accuracy for report in fit.degrees_tried[:-1])
        assert fit.max_residual <= accuracy
        assert fit.accuracy == accuracy


def test_the_full_polynomial_agrees_with_numpys_least_squares():
    data = noisy_rows() + np.array([0.0, 0.5])
    fit = fit_clutch(data, 0.15, through_origin=False)
    assert fit.coefficients[0] == pytest.approx(0.5, abs=0.1)
    known = np.polynomial.Polynomial.fit(data[:, 0], data[:, 1], fit.degree).convert().coef
    np.testing.assert_allclose(fit.coefficients, known, rtol=1e-9)


def test_through_the_origin_agrees_with_numpys_least_squares():
    data = noisy_rows()
    fit = fit_clutch(data, 0.15)
    powers = np.arange(1, fit.degree + 1)
    known = np.linalg.lstsq((data[:, :1] / 0.06) ** powers, data[:, 1], rcond=None)[0] / 0.06**powers
    assert fit.coefficients[0] == 0.0
    np.testing.assert_allclose(fit.coefficients[1:], known, rtol=1e-9)


def test_residuals_are_measured_minus_fitted_row_by_row():
    data = noisy_rows()[::-1]
    fit = fit_clutch(data, 0.15)
    residuals = data[:, 1] - torque(fit.coefficients, fit.windup_limit, data[:, 0])
    np.testing.assert_array_equal(fit.residuals, residuals)
    assert fit.max_residual == np.abs(residuals).max()
    assert fit.rms == pytest.approx(math.sqrt(np.mean(residuals**2)), rel=1e-14)
    assert fit.rms == pytest.approx(fit.degrees_tried[-1].rms, rel=1e-9)


@pytest.mark.parametrize("through_origin", [True, False])
def test_eigenvalues_are_those_of_the_normal_matrix(through_origin):
    u = np.linspace(0.1, 2.0, 20)
    fit = fit_clutch(rows([0.5, 1.0, 1.0, 1.0], u), 0.6, through_origin=through_origin)
    powers = np.arange(1 if through_origin else 0, fit.degree + 1)
    normal = np.array([[np.sum(u ** (i + k)) for k in powers] for i in powers])
    np.testing.assert_allclose(fit.eigenvalues, np.linalg.eigvalsh(normal)[::-1], rtol=1e-9)
    assert fit.condition_number == pytest.approx(np.linalg.cond(normal), rel=1e-9)
    assert fit.rank == powers.size


@pytest.mark.parametrize("degree", [3, 7, HIGHEST_DEGREE])
def test_eigenvalues_of_badly_scaled_angles_keep_their_accuracy(degree):
    u = np.linspace(0.0, 2e-3, 40)
    scaled = np.zeros(degree + 1)
    scaled[1] = scaled[degree] = 1.0
    fit = fit_clutch(rows(scaled / 2e-3 ** np.arange(degree + 1), u), 1e-11, max_degree=degree)
    assert fit.degree == degree
    matrix = gram(u, range(1, degree + 1))
    inverse = exact_inverse(matrix)
    # The largest eigenvalue is nearly the trace, the smallest nearly 1/(trace of the inverse): both are exact here.
    assert sum(fit.eigenvalues) == pytest.approx(float(sum(matrix[i][i] for i in range(degree))), rel=1e-12)
    exact = float(sum(inverse[i][i] for i in range(degree)))
    assert sum(1.0 / value for value in fit.eigenvalues) == pytest.approx(exact, rel=1e-6 if degree > 7 else 1e-9)
    assert fit.condition_number == pytest.approx(fit.eigenvalues[0] / fit.eigenvalues[-1], rel=1e-12)


def test_singular_values_of_a_graded_matrix():
    rotation = np.linalg.qr(np.vander(np.linspace(0.0, 1.0, 5), 5))[0]
    sizes = np.array([1e6, 1.0, 1e-9, 1e-20, 1e-30])
    np.testing.assert_allclose(singular_values(rotation * sizes[::-1]), sizes, rtol=1e-13)
    assert singular_values(np.zeros((3, 2))).tolist() == [0.0, 0.0]


def test_milliradian_angles_and_degree_seven_stay_accurate():
    u = np.linspace(0.0, 1e-3, 30)
    law = [0.0, 2e3, 0.0, 0.0, 0.0, 0.0, 0.0, 3e21]
    fit = fit_clutch(rows(law, u), 1e-9)
    assert fit.degree == 7
    assert fit.coefficients == pytest.approx(law, rel=1e-9, abs=0.0)
    assert fit.max_residual < 1e-13
    assert fit.rank == 7


def test_a_constant_torque_needs_degree_zero_only():
    fit = fit_clutch([[0.0, 2.0], [0.1, 2.0], [0.2, 2.0]], 1e-9, through_origin=False)
    assert (fit.degree, fit.coefficients) == (0, pytest.approx((2.0,)))
    assert "law-jumps" in codes(fit)


def test_angles_with_the_backlash_give_the_law_of_the_windup():
    u = np.linspace(0.0, 0.06, 13)
    plain = fit_clutch(rows([0, 200, 0, 2e4], u), 1e-6)
    shifted = np.vstack(([[0.0, 0.0], [0.003, 1e-7]], rows([0, 200, 0, 2e4], u) + np.array([0.005, 0.0])))
    fit = fit_clutch(shifted, 1e-6, angles_include_backlash=True, backlash=0.005)
    assert fit.rows_in_backlash == (0, 1)
    assert fit.coefficients == pytest.approx(plain.coefficients, rel=1e-9, abs=0.0)
    assert fit.windup_limit == pytest.approx(0.06, rel=1e-12)
    assert len(fit.residuals) == 15
    assert fit.residuals[1] == 1e-7
    (inside,) = (warning for warning in fit.warnings if warning.code == "rows-in-backlash")
    assert inside.startswith("2 of 15 ")


def test_the_backlash_is_not_used_on_angles_that_leave_it_out():
    u = np.linspace(0.0, 0.06, 13)
    with_backlash = fit_clutch(rows([0, 200], u), 1e-6, backlash=0.005)
    assert with_backlash == fit_clutch(rows([0, 200], u), 1e-6)


def test_an_angle_equal_to_the_backlash_but_for_rounding_is_zero_windup():
    angles = np.array([0.1 + 0.2, 0.5, 0.7])  # 0.1 + 0.2 is a little more than 0.3
    fit = fit_clutch(np.column_stack((angles, [0.0, 0.2, 0.4])), 1e-6, angles_include_backlash=True, backlash=0.3)
    assert fit.coefficients == pytest.approx((0.0, 1.0))
    assert fit.rows_in_backlash == ()


def test_as_many_unknowns_as_windups_is_said():
    fit = fit_clutch([[0.0, 0.0], [0.1, 1.0], [0.2, 4.0]], 1e-6)
    assert fit.degree == 2
    assert "too-few-rows" in codes(fit)


def test_a_falling_law_is_accepted_with_warnings():
    u = np.linspace(0.0, 1.5, 12)
    fit = fit_clutch(rows([0.0, 2.0, -1.0], u), 1e-6)
    assert not fit.monotone
    assert not fit.negative
    assert codes(fit) == ["law-falls", "law-ends-falling"]
    assert "u = 2.25 rad" in fit.warnings[1]


def test_the_measured_example_is_fitted():
    with EXAMPLE.open(newline="") as file:
        header, *lines = csv.reader(line for line in file if not line.startswith("#"))
    assert header == ["angle_deg", "torque_Nmm"]
    data = np.array(lines, dtype=float) * [math.pi / 180, 1e-3]
    fit = fit_clutch(data, 0.05)
    assert fit.degree == 3
    assert fit.max_residual <= 0.05
    assert fit.monotone
    assert fit.warnings == ()
    assert fit.windup_limit == pytest.approx(math.radians(3.0))
    expected = 200 * data[:, 0] + 20000 * data[:, 0] ** 3
    np.testing.assert_allclose(torque(fit.coefficients, fit.windup_limit, data[:, 0]), expected, atol=0.05)


def test_an_unreached_accuracy_tells_every_degrees_residual():
    with pytest.raises(ClutchFitError) as caught:
        fit_clutch(noisy_rows(), 1e-3, max_degree=5)
    error = caught.value
    assert [report.degree for report in error.degrees] == [1, 2, 3, 4, 5]
    assert (error.name, error.value) == ("accuracy", 1e-3)
    for report in error.degrees:
        assert f"{report.max_residual:.4g} N*m at degree {report.degree}" in error.message
    assert "raise max_degree (up to 11)" in error.message
    copy = pickle.loads(pickle.dumps(error))
    assert (str(copy), copy.degrees, copy.name) == (str(error), error.degrees, "accuracy")


def test_an_unreached_accuracy_for_want_of_rows_says_so():
    data = [[0.0, 0.0], [0.1, 1.0], [0.1, 1.5], [0.2, 2.0], [0.3, 3.0]]
    with pytest.raises(ClutchFitError, match=r"more unknowns than the data has different windups \(3\)") as caught:
        fit_clutch(data, 0.1)
    assert len(caught.value.degrees) == 3
    assert "farthest off at the row with windup" in caught.value.message


def test_a_higher_degree_is_not_advised_where_the_rows_do_not_allow_one():
    data = [[0.1, 1.0], [0.1, 1.5], [0.2, 2.0], [0.3, 3.0]]
    with pytest.raises(ClutchFitError, match="measure more") as caught:
        fit_clutch(data, 0.1, max_degree=3)
    assert "raise max_degree" not in caught.value.message


def test_the_summary_of_a_refusal_leaves_out_the_degrees():
    with pytest.raises(ClutchFitError) as caught:
        fit_clutch(noisy_rows(), 1e-3, max_degree=5)
    assert "at degree 2" not in caught.value.summary
    assert "raise max_degree" in caught.value.summary


def test_one_windup_is_said_in_the_singular():
    with pytest.raises(ClutchFitError, match="has 1 different positive windup, the largest"):
        fit_clutch([[0.1, 1.0], [0.1, 1.1]], 1e-3)


def test_a_law_whose_terms_cancel_is_told():
    degrees = np.arange(0.25, 3.1, 0.25)
    data = np.column_stack((np.radians(degrees), 3.5 * degrees + 0.1 * degrees**3))
    assert fit_clutch(data, 0.05).warnings == ()
    off = fit_clutch(data, 0.05, angles_include_backlash=True, backlash=math.radians(0.1))
    assert "terms-cancel" in codes(off)


def test_torque_at_zero_windup_is_named_when_it_is_in_the_way():
    u = np.linspace(0.0, 1.0, 20)
    with pytest.raises(ClutchFitError, match="fit without through_origin"):
        fit_clutch(rows([3.0, 1.0], u), 0.1, max_degree=2)
    assert fit_clutch(rows([3.0, 1.0], u), 0.1, through_origin=False).coefficients == pytest.approx((3.0, 1.0))


def test_a_degree_its_angles_do_not_determine_is_not_taken():
    u = 1.0 + 1e-15 * np.arange(6)
    with pytest.raises(ClutchFitError) as caught:
        fit_clutch(np.column_stack((u, [1.0, 2.0, 1.0, 2.0, 1.0, 2.0])), 1e-3, max_degree=3)
    ranks = {report.degree: report.rank for report in caught.value.degrees}
    assert ranks[1] == 1
    assert ranks[2] < 2
    assert ranks[3] < 3


@pytest.mark.parametrize(
    ("data", "options", "place"),
    [
        (rows([0.0, -1.0, 1.0], np.linspace(0.0, 2.0, 9)), {}, "from 0 rad to 1 rad"),
        (rows([0.0, 1.0, -1.0], np.linspace(0.0, 2.0, 9)), {}, "from 1 rad to 2 rad"),
        (rows([-1.0, 1.0], np.linspace(0.0, 2.0, 9)), {"through_origin": False}, "fit through the origin"),
        (rows([0.0, -1.0], np.linspace(0.0, 2.0, 9)), {}, "signs of the torques"),
        # negative only between its two rows at 0.9 and 1.1, where (u - 0.99)(u - 1.01) dips below zero
        (rows([0.0, 0.9999, -2.0, 1.0], [0.2, 0.5, 0.9, 1.1, 1.5, 1.8]), {}, "from 0.99 rad to 1.01 rad"),
    ],
)
def test_a_law_that_is_negative_in_its_range_is_refused(data, options, place):
    with pytest.raises(ClutchFitError) as caught:
        fit_clutch(data, 1e-6, **options)
    assert place in caught.value.message
    assert caught.value.degrees


GOOD = [[0.0, 0.0], [0.1, 1.0], [0.2, 2.0]]


@pytest.mark.parametrize(
    ("data", "options", "name", "allowed"),
    [
        (GOOD, {"accuracy": 0.0}, "accuracy", "> 0 N*m"),
        (GOOD, {"accuracy": -1.0}, "accuracy", "> 0 N*m"),
        (GOOD, {"accuracy": math.nan}, "accuracy", "> 0 N*m"),
        (GOOD, {"accuracy": "0.1"}, "accuracy", "> 0 N*m"),
        (GOOD, {"accuracy": 10**400}, "accuracy", "> 0 N*m"),
        (GOOD, {"max_degree": 0}, "max_degree", "1 .. 11"),
        (GOOD, {"max_degree": 12}, "max_degree", "1 .. 11"),
        (GOOD, {"max_degree": 2.5}, "max_degree", "1 .. 11"),
        (GOOD, {"max_degree": True}, "max_degree", "1 .. 11"),
        (GOOD, {"through_origin": 1}, "through_origin", "true, false"),
        (GOOD, {"angles_include_backlash": "yes"}, "angles_include_backlash", "true, false"),
        (GOOD, {"backlash": -0.1}, "backlash", ">= 0 rad"),
        (GOOD, {"backlash": math.inf}, "backlash", ">= 0 rad"),
        ([], {}, "data", "rows of two numbers"),
        ([1.0, 2.0], {}, "data", "rows of two numbers"),
        ([[1.0, 2.0, 3.0]] * 3, {}, "data", "rows of two numbers"),
        ([[0.0, 0.0], [0.1]], {}, "data", "rows of two numbers"),
        ([["0", "1"], ["2", "3"]], {}, "data", "rows of two numbers"),
        ([[0.0, None], [0.1, 1.0]], {}, "data", "rows of two numbers"),
        ([[0.0, 0.0], [-0.1, 1.0]], {}, "data.1.0", "0 .. 1000 rad"),
        ([[0.0, 0.0], [0.1, 1.0], [math.nan, 1.0]], {}, "data.2.0", "0 .. 1000 rad"),
        ([[0.0, 0.0], [0.1, math.inf]], {}, "data.1.1", "N*m"),
        ([[0.1, 1.0], [0.1, 1.1], [0.1, 0.9]], {}, "data", "at least 2 different positive windups"),
        ([[0.0, 0.0], [0.1, 1.0]], {}, "data", "at least 2 different positive windups"),
        ([[0.1, 1.0], [0.1, 1.0]], {"through_origin": False}, "data", "at least 2 different windups"),
        ([[0.0, 0.0], [1e-12, 1.0], [2e-12, 2.0]], {}, "data", "at least 2 different positive windups"),
        (GOOD, {"angles_include_backlash": True, "backlash": 0.15}, "data.1.1", "within the backlash"),
        ([[0.1, 0.0], [0.2, 0.0]], {"angles_include_backlash": True, "backlash": 0.5}, "data", "at least 2 different"),
        ([[0.1, 0.0], [0.2, 0.0], [0.3, 0.0]], {}, "data", None),
    ],
)
def test_wrong_input_is_refused_by_name_value_and_range(data, options, name, allowed):
    arguments = {"accuracy": 0.1, **options}
    with pytest.raises(ClutchFitError) as caught:
        fit_clutch(data, arguments.pop("accuracy"), **arguments)
    error = caught.value
    assert error.name == name
    assert str(error).startswith(f"{name}: ")
    assert error.degrees == ()
    if allowed is not None:
        assert allowed in error.allowed
        assert "got" in str(error)


def test_a_fit_too_steep_for_a_coefficient_is_refused():
    u = np.linspace(0.0, 2e-9, 20)
    with pytest.raises(ClutchFitError) as caught:
        fit_clutch(rows([0.0, 1e9, 0.0, 0.0, 0.0, 1e44], u), 1e-6)
    assert isinstance(caught.value, ClutchError)
    assert caught.value.name == "data"
    assert caught.value.degrees
