"""Formulas of parameters: quantities in them, units by dimension, positions of faults."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sprag_study.service.spec.formulas import FormulaError, read_formula
from sprag_study.worker.models.formulas import evaluate

UNITS = {
    "mass": "kg", "arm": "m", "speed": "rad/s", "frequency": "Hz", "angle": "rad", "load": "N*m", "ratio": "1",
    "part.0.damping": "N*m*s/rad",
}  # fmt: skip
VALUES = {"mass": 2.0, "arm": 0.3, "speed": 5.0, "frequency": 4.0, "angle": 0.5, "load": 1.5, "ratio": 0.25}
VALUES |= {"part.0.damping": 0.02}


def value(text: str, unit: str) -> float:
    formula = read_formula(text, {**UNITS, "x": unit}, unit)
    return float(evaluate({"x": formula.text}, {**VALUES, "x": 0.0}, {}, 1)["x"][0])


@pytest.mark.parametrize(
    ("text", "unit", "expected"),
    [
        ("2 mm", "m", 0.002),
        ("3 * 2 mm", "m", 0.006),
        ("mass / 5 N/mm", "s^2", 2.0 / 5000.0),
        ("mass / (5 N/mm)", "s^2", 2.0 / 5000.0),
        ("1 N m + 2 Nm + 3 N·m", "N*m", 6.0),
        ("5 kg * m", "kg*m", 5.0),
        ("5 kg*arm", "kg*m", 1.5),
        ("arm^2 * 1 kg", "kg*m^2", 0.09),
        ("arm**2 * 1e3 g", "kg*m^2", 0.09),
        ("2 mm²", "m^2", 2e-6),
        ("4 s^-1 * arm", "m/s", 1.2),
        ("part.0.damping * speed", "N*m", 0.1),
        ("0.5 * mass * arm^2 * speed^2", "N*m", 0.5 * 2.0 * 0.09 * 25.0),
        ("frequency * 1 rev", "rad/s", 8.0 * math.pi),
        ("speed / 1 rev", "Hz", 5.0 / (2.0 * math.pi)),
        ("1500 rpm / 1 rev", "Hz", 25.0),
        ("4*pi^2*frequency^2*arm", "m/s^2", 4.0 * math.pi**2 * 16.0 * 0.3),
        ("sqrt(load / mass)", "m/s", math.sqrt(0.75)),
        ("(arm^2)^(1/2)", "m", 0.3),
        ("mass * sin(30 deg) + mass * cos(2 * angle)", "kg", 2.0 * 0.5 + 2.0 * math.cos(1.0)),
        ("30*deg", "rad", math.pi / 6.0),
        ("atan2(arm, 1 m)", "rad", math.atan2(0.3, 1.0)),
        ("if(mass > 1 kg, arm, 2*arm)", "m", 0.3),
        ("max(0, arm - 1 m)", "m", 0.0),
        ("min(arm, 10 cm)", "m", 0.1),
        ("abs(-arm)", "m", 0.3),
        ("mass * exp(ratio) * ratio^ratio", "kg", 2.0 * math.exp(0.25) * 0.25**0.25),
        ("0", "kg", 0.0),
        ("arm + 0 * mass", "m", 0.3),
        ("arm + 0 m * ratio", "m", 0.3),
        ("mod(arm, 20 cm)", "m", 0.1),
        ("2 kg * 50 mm^2", "kg*m^2", 2.0 * 50e-6),
        ("2 kg * 50 mm^2.0", "kg*m^2", 2.0 * 50e-6),
        ("2 kg * 50 mm^(2)", "kg*m^2", 2.0 * 50e-6),
        ("2 kg * 50 mm ** ( +2. )", "kg*m^2", 2.0 * 50e-6),
        ("2 kg * (50 mm)^2.0", "kg*m^2", 2.0 * 2500e-6),
        ("50 kg*mm^2.0", "kg*m^2", 50e-6),
        ("4 mm^2.0 / 4 mm", "m", 1e-3),
        ("4 mm^(-1) * arm", "1", 1200.0),
        ("(4 mm)^0.5 * (4 mm)^0.5", "m", 4e-3),
        ("1 rev * frequency * 1 ms", "rad", 8e-3 * math.pi),
        ("frequency * 1 ms * 360 deg", "rad", 8e-3 * math.pi),
        ("2*pi*frequency * 1 ms + angle", "rad", 8e-3 * math.pi + 0.5),
        ("1500 rpm * 1 ms", "rad", 0.05 * math.pi),
        ("frequency * 1 ms", "1", 4e-3),
        ("sin(2*pi*frequency * 1 ms)", "1", math.sin(8e-3 * math.pi)),
        ("1 / frequency", "s", 0.25),
        ("angle / speed", "s", 0.1),
        ("angle / (1 rev * frequency)", "s", 0.0625 / math.pi),
        ("speed / frequency", "rad", 1.25),
        ("load * speed / frequency", "N*m", 1.875),
    ],
)
def test_the_value_is_that_of_the_formula_by_hand(text: str, unit: str, expected: float) -> None:
    assert value(text, unit) == pytest.approx(expected, rel=1e-14, abs=1e-300)


@pytest.mark.parametrize(
    ("text", "unit", "message"),
    [
        ("mass + arm", "kg", "adds kg and m"),
        ("arm + 0 kg", "m", "adds m and kg"),
        ("mass - 1", "kg", "subtracts kg and a plain number"),
        ("mass * arm", "kg", r"gives kg\*m, expected kg"),
        ("frequency", "rad/s", "one revolution"),
        ("speed", "Hz", "one revolution"),
        ("speed + frequency", "rad/s", "one revolution"),
        ("sin(arm)", "1", "sin takes a plain number"),
        ("arm^mass", "m", "exponent"),
        ("arm^ratio", "m", "to a power that is not a plain number"),
        ("if(ratio, arm, mass)", "m", "compares m and kg"),
        ("mass < arm", "1", "compares kg and m"),
        ("max(arm, 1)", "m", "compares m and a plain number"),
        ("sqrt(mass)", "kg", r"kg\^1/2"),
        ("1 / frequency", "Hz", "gives s"),
        ("2 parsec", "m", "unknown unit"),
        ("1e999 m", "m", "too large"),
        ("4 mm ^ 0.5", "m", r"write '\(4 mm\)\^"),
        ("2 kg * 50 mm^2.5", "kg*m^2", "no whole number"),
        ("50 mm^ratio", "m", "no whole number"),
        ("50 mm^(1+1) * mass", "kg*m^2", "no whole number"),
        ("4 mm^2^0.5", "m", "no whole number"),
        ("4 mm²^2", "m^4", "no whole number"),
        ("ratio^2 deg", "rad", "put the power in brackets"),
        ("frequency * 1 ms", "rad", "one revolution is 2 pi rad"),
        ("25 Hz * 1 ms", "rad", "one revolution is 2 pi rad"),
        ("1500 min^-1 * 1 ms", "rad", "one revolution is 2 pi rad"),
        ("0.025 kHz * 1 ms", "rad", "one revolution is 2 pi rad"),
        ("25 Гц * 1 мс", "rad", "one revolution is 2 pi rad"),
        ("angle + frequency * 1 ms", "rad", "adds rad and a number of periods"),
        ("frequency * 1 ms + pi / 4", "rad", "one revolution is 2 pi rad"),
        ("sin(frequency * 1 ms)", "1", "sin takes an angle"),
        ("frequency / speed", "1", "one revolution is 2 pi rad"),
        ("speed / frequency", "1", "one revolution is 2 pi rad"),
        ("frequency / speed", "rad", "one revolution is 2 pi rad"),
        ("angle / frequency", "s", "one revolution is 2 pi rad"),
        ("angle / 1 s", "Hz", "one revolution is 2 pi rad"),
        ("if(frequency * 1 ms > angle, 1, 2)", "1", "compares"),
    ],
)
def test_units_that_do_not_go_together_are_refused(text: str, unit: str, message: str) -> None:
    with pytest.raises(FormulaError, match=message):
        read_formula(text, UNITS, unit)


def test_a_parameter_is_no_unit() -> None:
    assert read_formula("5 kg * m", {"m": "kg"}, "kg^2").uses == {"m"}


@pytest.mark.parametrize(
    ("text", "character"),
    [("2 mm + ", 8), ("2 mm + $", 8), ("1234 mm * 5 kg ) * 2", 16), ("mass arm", 6), ("sin 2", 5)],
)
def test_the_position_of_a_fault_is_that_in_the_text_as_given(text: str, character: int) -> None:
    with pytest.raises(FormulaError, match=rf"\(at character {character}\)"):
        read_formula(text, UNITS, "m")


def test_a_column_has_the_bits_of_its_single_cases() -> None:
    formula = read_formula("mass * arm^2 * exp(sin(angle)) * ratio^1.5 + 0.1 kg*m^2", UNITS, "kg*m^2").text
    draw = np.random.default_rng(1)
    columns = {name: draw.uniform(0.1, 2.0, 1001) for name in ("mass", "arm", "angle", "ratio")}
    base = {**VALUES, "x": 0.0}
    together = evaluate({"x": formula}, base, columns, 1001)["x"]
    for case in range(0, 1001, 37):
        one = {name: column[case : case + 1] for name, column in columns.items()}
        assert evaluate({"x": formula}, base, one, 1)["x"][0] == together[case]
        at = {name: float(column[case]) for name, column in columns.items()}
        assert evaluate({"x": formula}, base | at, {}, 3)["x"].tolist() == [together[case]] * 3
