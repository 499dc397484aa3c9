"""Enclosures of formulas: what polynomials leave out of a formula is never more than the enclosure says."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from numpy.polynomial import chebyshev

from sprag_study.engine.formulas.expressions import Expression
from sprag_study.engine.machine_shaft.enclosures import Program
from sprag_study.engine.machine_shaft.intervals import ORDERS

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


_SERIES_OF = {
    # Taylor coefficients at a number.
    "phi*phi*phi": lambda x: [x**3, 3 * x**2, 3 * x, 1],
    "1/phi": lambda x: [(-1) ** k / x ** (k + 1) for k in range(4)],
    "(phi + 0.1)*(phi - 0.3)": lambda x: [
        (x + Fraction(0.1)) * (x - Fraction(0.3)), 2 * x + Fraction(0.1) - Fraction(0.3), 1, 0,
    ],
    "phi^7/3": lambda x: [Fraction(c, 3) * x ** (7 - k) for k, c in enumerate((1, 7, 21, 35))],
}  # fmt: skip


@pytest.mark.parametrize("text", _SERIES_OF)
def test_rounding_is_directed_outward(text: str) -> None:
    """Exact fractions of the first four coefficients, times powers of the half width, lie within the entries."""
    for place in np.random.default_rng(1).uniform(0.6, 6.0, 200):
        low, high = Program(Expression(text), []).entries(place, place)
        assert Fraction(low[0]) <= _SERIES_OF[text](Fraction(place))[0] <= Fraction(high[0])
        assert high[0] - low[0] <= 60.0 * np.spacing(abs(high[0]))
        start, end = place - 0.5, place + 0.5
        low, high = Program(Expression(text), []).entries(start, end)
        half = (Fraction(end) - Fraction(start)) / 2
        for x in (Fraction(start), Fraction(place), Fraction(end)):
            for k, value in enumerate(_SERIES_OF[text](x)):
                assert Fraction(low[k]) <= value * half**k <= Fraction(high[k])


@pytest.mark.parametrize(
    ("text", "exact"),
    [
        ("sin(phi)", Decimal("0.8414709848078965066525023216302989996226")),
        ("cos(phi)", Decimal("0.5403023058681397174009366074429766037323")),
        ("tan(phi)", Decimal("1.557407724654902230506974807458360173087")),
        ("exp(phi)", Decimal("2.718281828459045235360287471352662497757")),
        ("sinh(phi)", Decimal("1.175201193643801456882381850595600815156")),
        ("cosh(phi)", Decimal("1.543080634815243778477905620757061682602")),
        ("tanh(phi)", Decimal("0.7615941559557648881194582826047935904128")),
        ("4*atan(phi)", Decimal("3.141592653589793238462643383279502884197")),
        ("2*asin(phi)", Decimal("3.141592653589793238462643383279502884197")),
        ("acos(-phi)", Decimal("3.141592653589793238462643383279502884197")),
        ("log(phi + 1)", Decimal("0.6931471805599453094172321214581765680755")),
        ("sqrt(phi + 1)", Decimal("1.414213562373095048801688724209698078570")),
        ("(phi + 1)^0.5", Decimal("1.414213562373095048801688724209698078570")),
        ("phi/3", Decimal("0.3333333333333333333333333333333333333333")),
        ("0.1*phi + 0.2", Decimal("0.3000000000000000166533453693773481063545")),
        ("atan2(phi, -phi)*4/3", Decimal("3.141592653589793238462643383279502884197")),
    ],
)
def test_a_function_of_one_is_enclosed(text: str, exact: Decimal) -> None:
    low, high = Program(Expression(text), []).entries(1.0, 1.0)
    assert Decimal(low[0]) <= exact <= Decimal(high[0])
    assert Decimal(low[0]) < Decimal(high[0])
    assert high[0] - low[0] < 1e-14


def test_crests_are_not_missed_at_large_angles() -> None:
    for k in (0, 7, 10**6, 10**12):
        crest = 2.0 * np.pi * k
        assert Program(Expression("cos(phi)"), []).entries(crest - 1e-3, crest + 1e-3)[1][0] == 1.0
        assert Program(Expression("cos(phi)"), []).entries(crest, crest + 1e-3)[1][0] == 1.0


def test_whole_numbers_are_not_rounded() -> None:
    for text, value in (("floor(6/2)", 3.0), ("mod(3*4, 4)", 0.0), ("step(2*3 - 6)", 1.0), ("floor(phi*2)", 2.0)):
        low, high = Program(Expression(text), []).entries(1.0, 1.0)
        assert (low[0], high[0]) == (value, value)
