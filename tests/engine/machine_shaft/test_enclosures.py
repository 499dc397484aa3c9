"""Enclosures of formulas: what polynomials leave out of a formula is never more than the enclosure says."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import chebyshev

from engine.machine_shaft.enclosures import Program
from engine.machine_shaft.expressions import Expression
from engine.machine_shaft.intervals import ORDERS

_PLACES = np.cos(np.linspace(0.0, np.pi, 60))


def _leftover(expression: Expression, low: float, high: float) -> float:
    """What a fitted polynomial of a degree below ORDERS leaves out; within a small factor of the best one's."""
    values = np.asarray(expression(phi=0.5 * (low + high) + 0.5 * (high - low) * _PLACES))
    fitted = chebyshev.chebval(_PLACES, chebyshev.chebfit(_PLACES, values, ORDERS - 1))
    return float(np.abs(values - fitted).max()) - 1e-13 * float(np.abs(values).max())


@pytest.mark.parametrize(
    "text",
    [
        "sin(phi)*cos(2*phi) + tan(phi/5)", "sqrt(phi) - log(phi)/phi", "exp(-phi)*phi^2", "phi^(phi/4)", "2^phi",
        "asin(phi/7) + acos(phi/8)*atan(phi)", "sinh(phi/3)/cosh(phi) + tanh(phi)", "atan2(sin(phi), 2 + cos(phi))",
        "atan2(sin(phi), cos(phi) - 1.5)", "phi^-3", "phi^2.5", "phi^0.5 - (phi - 3)^3", "(phi - 3)^-2",
        "max(sin(phi), cos(phi), 0.1)", "min(sin(phi), 0.2)", "if(phi < 2.003, phi, phi^3)", "mod(phi^2, 1.017)",
        "abs(sin(phi) - 0.3)", "floor(phi)*phi + step(phi - 3.001)*phi + sign(phi - 2.002)*phi", "-phi/(1 + phi^2)",
        "(phi >= 3) - (phi > 2)*phi + (phi <= 4)", "exp(-((phi - 3)/0.05)^2)",
    ],
)  # fmt: skip
@pytest.mark.parametrize("length", [0.5, 0.1, 0.01])
def test_no_formula_is_rougher_than_its_enclosure(text: str, length: float) -> None:
    expression = Expression(text)
    low = np.random.default_rng(3).uniform(0.1, 5.5, 40)
    errors, least = Program(expression, []).over(low, low + length, np.empty((40, 0)), None)
    for start, error, size in zip(low, errors, least, strict=True):
        assert _leftover(expression, start, start + length) <= 5.0 * error
        values = np.abs(expression(phi=np.linspace(start, start + length, 50)))
        assert values.min() >= size * (1.0 - 1e-12) - 1e-14


def test_enclosures_become_tight() -> None:
    program = Program(Expression("10 + h/w*exp(-((phi - a)/w)^2)", ("phi", "h", "w", "a")), ["h", "w", "a"])
    numbers = np.array([[100.0, 1e-3, 3.0]])
    low = np.array([2.0, 3.0, 3.0])
    high = np.array([4.0, 3.0 + 2e-4, 3.0 + 1e-2])
    errors, _ = program.over(low, high, np.repeat(numbers, 3, axis=0), None)
    assert errors[0] > 1e4
    assert errors[1] < 1e-6
    assert errors[2] > 1e2


def test_the_way_is_taken_from_its_values() -> None:
    program = Program(Expression("x^2", ("phi", "x")), [])
    nodes = np.polynomial.legendre.leggauss(ORDERS)[0]
    errors, least = program.over(np.array([1.0]), np.array([1.1]), np.empty((1, 0)), (0.5 + 0.1 * nodes)[None, :])
    assert errors[0] < 1e-12
    assert least[0] == pytest.approx(0.16, rel=1e-9)


def test_an_angle_at_which_there_is_a_pole_is_not_enclosed() -> None:
    errors, _ = Program(Expression("1/(phi - 1)"), []).over(np.array([0.9]), np.array([1.2]), np.empty((1, 0)), None)
    assert np.isinf(errors[0])
