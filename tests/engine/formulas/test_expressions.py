"""Formulas: right values and derivatives, positions in errors, and nothing that hostile text could reach."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sprag_study.engine.formulas.expressions import (
    MAX_DEPTH,
    MAX_LENGTH,
    MAX_NODES,
    RESERVED,
    Expression,
    ExpressionError,
)
from sprag_study.engine.machine_shaft.operations import formula_breaks

PHI = np.linspace(0.1, 6.2, 64)


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("2 + 3*4", 14.0), ("-2^2", -4.0), ("2^-1", 0.5), ("2^3^2", 512.0), ("2**3", 8.0), ("(1+2)*3", 9.0),
        ("8/4/2", 1.0), ("10-3-2", 5.0), ("--3", 3.0), ("+-3", -3.0), ("1.5e2", 150.0), (".5", 0.5), ("5.", 5.0),
        ("pi", math.pi), ("90*deg", math.pi / 2), ("max(1, 5, 3)", 5.0), ("min(4, 2)", 2.0), ("if(2 > 1, 3, 4)", 3.0),
        ("if(1 >= 2, 3, 4)", 4.0), ("mod(7, 3)", 1.0), ("mod(-1, 3)", 2.0), ("atan2(1, -1)", 0.75 * math.pi),
        ("abs(-2)+sign(-3)+step(0)+floor(2.7)", 4.0), ("(1 < 2) + (2 <= 2)", 2.0), ("log(exp(2))", 2.0),
        ("2 - -1", 3.0),
    ],
)  # fmt: skip
def test_values(text: str, wanted: float) -> None:
    assert float(Expression(text)(phi=0.0)) == pytest.approx(wanted, rel=1e-15)


@pytest.mark.parametrize(
    "text",
    [
        "sin(phi)*cos(2*phi) + tan(phi/5)", "sqrt(phi) - log(phi)/phi", "exp(-phi)*phi^2", "phi^(phi/4)", "2^phi",
        "asin(phi/7) + acos(phi/8)*atan(phi)", "sinh(phi/3)/cosh(phi) + tanh(phi)", "atan2(sin(phi), 2 + cos(phi))",
        "max(sin(phi), cos(phi), 0.1)", "if(phi < 2.003, phi, phi^3)", "mod(phi^2, 1.017)", "abs(sin(phi) - 0.3)",
        "k*sin(k*phi)", "-phi/(1 + phi^2)", "floor(phi)*phi + step(phi - 3.001)*phi + sign(phi - 2.002)*phi",
    ],
)  # fmt: skip
def test_derivatives(text: str) -> None:
    formula = Expression(text, ("phi", "k"))

    def value(phi: np.ndarray) -> np.ndarray:
        return np.asarray(formula.evaluate({"phi": (phi, np.ones(1)), "k": (1.7, 0.0)})[0])

    step = 1e-6
    slope = np.broadcast_to(formula.evaluate({"phi": (PHI, np.ones(1)), "k": (1.7, 0.0)})[1], PHI.shape)
    numeric = (value(PHI + step) - value(PHI - step)) / (2.0 * step)
    smooth = np.abs(numeric) < 1e4
    assert slope[smooth] == pytest.approx(numeric[smooth], rel=2e-7, abs=2e-7)
    assert smooth.sum() > 60


def test_values_are_those_of_arrays_of_any_shape() -> None:
    phi = PHI.reshape(4, 16)
    assert Expression("k + 0*phi", ("phi", "k"))(phi=phi, k=np.arange(4.0)[:, None]).shape == (4, 16)
    assert Expression("3")(phi=phi).shape == (4, 16)


@pytest.mark.parametrize(
    ("text", "position"),
    [
        ("", 0), ("   ", 3), ("2 +", 3), ("2 3", 2), ("sin", 3), ("sin(", 4), ("sin()", 4), ("sin(1, 2)", 0),
        ("foo", 0),
        ("1 + foo(2)", 4), ("(1", 2), ("1)", 1), ("2 $ 3", 2), ("phi.real", 0), ("1e999", 0), ("max(1)", 0),
        ("phi; phi", 3), ("phi = 2", 4), ("'a'", 0), ("a" * 60, 0), ("__import__('os')", 11), ("phi[0]", 3),
        ("lambda: 0", 6), ("1 < 2 < 3", 6), ("0x10", 1), ("1_000", 1), ("\u0663", 0), ("phi\x00", 3), ("if(1, 2)", 0),
        ("1 +\n* 2", 4), ("@", 0), ("{}", 0), ("pi(2)", 2), ("^2", 0),
    ],
)  # fmt: skip
def test_errors_tell_where(text: str, position: int) -> None:
    with pytest.raises(ExpressionError) as error:
        Expression(text)
    assert error.value.position == position
    assert f"at character {position + 1}" in str(error.value)


def test_size_and_depth_are_limited() -> None:
    for text in (
        "1" * (MAX_LENGTH + 1),
        "+".join(["phi"] * (MAX_NODES + 1))[:MAX_LENGTH].rstrip("+"),
        "(" * (MAX_DEPTH + 1) + "1" + ")" * (MAX_DEPTH + 1),
        "^".join(["1"] * (MAX_DEPTH + 2)),
        "sin(" * (MAX_DEPTH + 1) + "1" + ")" * (MAX_DEPTH + 1),
    ):
        with pytest.raises(ExpressionError):
            Expression(text)
    assert float(Expression("-" * 1500 + "1")(phi=0.0)) == 1.0


def test_bombs_give_infinity_and_not_a_hang() -> None:
    assert math.isinf(float(Expression("9^9^9^9^9")(phi=0.0)))
    assert math.isnan(float(Expression("0/0")(phi=0.0)))
    assert math.isnan(float(Expression("sqrt(-1)")(phi=0.0)))


def _refused_at(text: str) -> int | None:
    try:
        Expression(text)
    except ExpressionError as error:
        return error.position
    return None


@given(st.text(max_size=60))
@settings(max_examples=300, deadline=None)
def test_any_text_is_a_formula_or_an_error(text: str) -> None:
    position = _refused_at(text)
    if position is None:
        Expression(text)(phi=PHI)
    else:
        assert 0 <= position <= len(text)


@given(st.text(alphabet="phi0123456789+-*/^(),.<>= \tsincoexpmaxif", max_size=40))
@settings(max_examples=300, deadline=None)
def test_any_text_of_the_right_letters_is_a_formula_or_an_error(text: str) -> None:
    position = _refused_at(text)
    if position is None:
        assert Expression(text)(phi=PHI).shape == PHI.shape
    else:
        assert 0 <= position <= len(text)


def test_names_that_mean_something_are_reserved() -> None:
    assert {"sin", "if", "pi", "deg"} <= RESERVED


def test_switches_grow_with_the_arguments_and_not_with_their_square() -> None:
    inner = [f"min({','.join(f'phi-{8 * k + j}' for j in range(8))})" for k in range(8)]
    assert Expression(f"max({','.join(inner)})").switch_count == 8 * 7 + 7


def test_the_kinks_of_many_arguments_are_those_of_their_extreme() -> None:
    expression = Expression("max(sin(phi), cos(phi), 0.8, sin(phi)-1)")
    found = formula_breaks(expression, lambda phi: {"phi": (phi, 0.0)}, 1)
    shown = np.sort(np.concatenate([breaks[0] for breaks in found]))
    # 0.8 lies above the crossing of sine and cosine, so that only its own crossings with either remain.
    kinks = [math.acos(0.8), math.asin(0.8), math.pi - math.asin(0.8), 2.0 * math.pi - math.acos(0.8)]
    for kink in kinks:
        assert np.abs(shown - kink).min() < 1e-12


@pytest.mark.parametrize(
    "text",
    [
        "min(phi, phi)",
        "max(min(phi, phi), min(phi,phi))",
        "max(" + ",".join(["min(" + ",".join(["phi"] * 16) + ")"] * 16) + ")",
    ],
)
def test_equal_arguments_are_no_switch(text: str) -> None:
    formula = Expression(text)
    assert formula.switch_count == 0
    np.testing.assert_array_equal(formula(phi=PHI), PHI)
