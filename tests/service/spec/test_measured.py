"""Measured clutch data as test benches write them."""

import math

import numpy as np
import pytest

from sprag_study.service.spec.measured import MeasuredDataError, parse_measured


def rows(text: str) -> list[list[float]]:
    return parse_measured(text).rows.tolist()


def problems(text: str) -> list[tuple[str | None, str]]:
    """Place and code of everything wrong with the data."""
    with pytest.raises(MeasuredDataError) as caught:
        parse_measured(text)
    return [(fault.where, fault.code) for fault in caught.value.faults]


@pytest.mark.parametrize(
    "text",
    [
        "0.01,2.5\n0.02,5.25\n",
        "angle,torque\n0.01,2.5\n0.02,5.25\n",
        "# a bench\n\nangle_rad , torque_Nm\n0.01 , 2.5\n\n0.02 , 5.25",
        "angle [mrad]; torque [N*mm]\n10;2500\n20;5250\n",
        "angle (mrad)\ttorque (Nmm)\n10\t2500\n20\t5250\n",
        "winkel_mrad;moment_Ncm\n10,0;250,0\n20,0;525,0\n",
        '"angle_rad","torque_Nm"\n0.01,2.5\n0.02,5.25\n',
        '"0.01","2.5"\n"0.02","5.25"\n',
        "angle mrad,torque Nmm\n10,2500\n20,5250\n",
        "0,01\t2,5\n0,02\t5,25\n",
        "0.01,\t2.5\n0.02,\t5.25\n",
        "rad,Nm\n0.01,2.5\n0.02,5.25\n",
        "0.01 2.5\r\n0.02 5.25\r\n",
        "angle [rad]  torque [N*m]\n0.01 2.5\n0.02 5.25\n",
        "angle [mrad];torque [N*mm]\n10;2 500\n20;5\N{NARROW NO-BREAK SPACE}250\n",
        "angle_rad;torque_Nm\n1·10⁻²;2,5\n2·10^-2;5,25\n",
    ],
)
def test_the_same_rows_from_every_way_of_writing_them(text: str) -> None:
    np.testing.assert_allclose(rows(text), [[0.01, 2.5], [0.02, 5.25]], rtol=1e-15)


def test_degrees_become_radians() -> None:
    assert rows("angle_deg,torque_Nm\n180,1\n")[0][0] == pytest.approx(math.pi, rel=1e-15)


def test_rows_know_their_lines() -> None:
    measured = parse_measured("# bench\nangle,torque\n0.01,2\n\n0.02,4\n")
    assert measured.lines == (3, 5)


@pytest.mark.parametrize("header", ["a,b", "x,y", "torque,angle", "phi,hysteresis"])
def test_a_header_that_is_not_understood_is_refused(header: str) -> None:
    assert {("line 1", "wrong-unit")} == set(problems(f"{header}\n0.01,2.5\n"))


@pytest.mark.parametrize(
    ("header", "assumed"), [("", ["rad", "N*m"]), ("Angle,torque_Nm\n", ["rad"]), ("angle_rad,torque_Nm\n", [])]
)
def test_units_that_are_assumed_are_told(header: str, assumed: list[str]) -> None:
    warnings = parse_measured(f"{header}0.01,2.5\n0.02,5.25\n").warnings
    assert [warning.code for warning in warnings] == ["assumed-units"] * bool(assumed)
    assert all(f" in {unit}" in warnings[0] for unit in assumed)


def test_angles_that_are_rather_degrees_are_told() -> None:
    assert parse_measured("1,2\n3,4\n").warnings[1].code == "implausible-value"
    assert parse_measured("angle_rad,torque_Nm\n1,2\n3,4\n").warnings == ()


def test_every_wrong_row_is_told_with_its_line() -> None:
    text = "angle,torque\n0.01,2\n0.02,two\n0.03\n0.04,inf\n1_0,3\n"
    assert problems(text) == [
        ("line 3", "not-a-number"),
        ("line 4", "unequal-lengths"),
        ("line 5", "not-finite"),
        ("line 6", "not-a-number"),
    ]


@pytest.mark.parametrize("text", ["", "\n\n", "# nothing\n"])
def test_no_data(text: str) -> None:
    assert problems(text) == [("line 1", "empty")]


def test_a_header_alone_has_no_rows() -> None:
    assert problems("angle,torque\n") == [("data", "empty")]


def test_a_unit_of_another_kind_is_refused_by_column() -> None:
    assert problems("angle_mm,torque_kg\n1,2\n") == [("line 1", "wrong-unit"), ("line 1", "wrong-unit")]


def test_a_file_of_another_kind_gives_a_bounded_number_of_problems() -> None:
    assert len(problems("1\n" * 1000)) <= 20


def test_numbers_have_the_minus_sign_of_a_typesetter() -> None:
    assert rows("angle_rad;torque_Nm\n\N{MINUS SIGN}0,01;\N{MINUS SIGN}2,5\n0,02;5,25\n") == [
        [-0.01, -2.5],
        [0.02, 5.25],
    ]


def test_the_same_text_is_read_once() -> None:
    first = parse_measured("angle_deg,torque_Nmm\n1,2\n")
    assert parse_measured("angle_deg,torque_Nmm\n1,2\n") is first
    with pytest.raises(ValueError, match="read-only"):
        first.rows[0, 0] = 1.0
