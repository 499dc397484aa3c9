"""Tables as instruments and spreadsheets write them, wherever a spec, a form or a command takes a table."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from sprag_study.service.faults import Fault
from sprag_study.service.http.web.form.columns import COLUMNS, take_columns
from sprag_study.service.http.web.form.fields import Choice
from sprag_study.service.spec.components import list_text, read_components
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.measured import MeasuredDataError, parse_measured
from sprag_study.service.spec.report import SpecError
from sprag_study.service.spec.stored import accepted
from tests.service.spec.machine.test_shaft import changed
from tests.service.spec_sample import changed as drive_changed
from tests.service.spec_sample import parsed
from tests.service.spec_sample import problems as drive_problems

POINTS = "shaft.load [N*mm];excitation.frequency [rpm]\n"


def loads(text: str) -> list[float]:
    """The loads of points, in N*m."""
    study = parsed({"/axes": [{"points": text}], "/exclude": []}).study
    return [float(load) for load in study.columns(range(study.cases))["shaft.load"]]


def rows_of(table: Any, **others: Any) -> tuple[list[list[float]], list[str]]:
    """The rows of a torque over the angle, a CSV text or a list, in rad and N*m, and the codes of the warnings."""
    form = "csv" if isinstance(table, str) else "table"
    operation = {"quantity": "torque", "interpolation": "linear", form: table, **others}
    spec = parse_spec(changed({"/base/operation": operation, "/base/drive/inertia": 1e6, "/axes": []}))
    assert spec.study.structure is not None
    return spec.study.structure["operation"]["table"]["rows"], [warning.code for warning in spec.warnings]  # type: ignore[attr-defined]


def refusal(table: Any) -> Fault:
    with pytest.raises(SpecError) as caught:
        rows_of(table)
    return caught.value.faults[0]


@pytest.mark.parametrize(
    "rows",
    [
        "20.000;1500,5\n25.000;1500,5\n",  # a decimal comma: points before three digits separate thousands
        "20.000;1500\n25.000;0,250\n",
        "20.000,0;1500\n25.000;1600\n",
        "20.000;1.500.000\n25.000;1600\n",
        "20,000;1500.5\n25,000;1500.5\n",  # and a decimal point shows it of commas
        "20,000.0;1500\n25,000;1600\n",
        "2e4;1500,5\n25.000;1600\n",
    ],
)
@pytest.mark.parametrize("sign", [";", "\t"])
def test_thousands_are_settled_by_the_other_numbers_of_a_table(rows: str, sign: str) -> None:
    assert loads((POINTS + rows).replace(";", sign)) == [20.0, 25.0]


def test_quoted_cells_are_settled_too() -> None:
    assert loads('"shaft.load [N*mm]","excitation.frequency [rpm]"\n"20.000","1500,5"\n"25.000","1600"\n') == [20, 25]


@pytest.mark.parametrize("sign", [";", "\t"])
@pytest.mark.parametrize("rows", ["20.000;1500\n25.000;1600\n", "20.000;0.25\n25.000;1600,5\n"])
def test_what_nothing_settles_is_asked(rows: str, sign: str) -> None:
    fault = drive_problems({"/axes": [{"points": (POINTS + rows).replace(";", sign)}]})["/axes/0/points"]
    assert (fault.code, fault.value) == ("ambiguous-point", "20.000")
    assert "20 or 20000" in fault.message


def test_where_commas_separate_columns_points_are_decimal_with_a_warning() -> None:
    text = POINTS.replace(";", ",") + "20.000,1500\n25.000,1600\n"
    given = parsed({"/axes": [{"points": text}], "/exclude": []})
    assert given.study.columns(range(2))["shaft.load"].tolist() == pytest.approx([0.020, 0.025])
    assert [warning.code for warning in given.warnings] == ["ambiguous-point"]  # type: ignore[attr-defined]
    assert loads(text.replace("1600", "1600.5")) == pytest.approx([0.020, 0.025])


def test_decimals_beside_decimal_commas_stay_decimal_where_they_are_certain() -> None:
    assert loads(POINTS + "0.250;1500,5\n12.5;1600\n") == pytest.approx([0.00025, 0.0125])


def test_a_table_of_texts_in_a_list_is_settled() -> None:
    assert rows_of([["0 deg", "1.000 N*m"], ["90 deg", "0,5 N*m"], ["300 deg", "2.500 N*m"]])[0] == [
        [0.0, 1000.0],
        [pytest.approx(0.5 * math.pi), 0.5],
        [pytest.approx(math.radians(300.0)), 2500.0],
    ]
    rows, codes = rows_of([["0 deg", "1.000 N*m"], ["300 deg", "2.500 N*m"]])
    assert [row[1] for row in rows] == [1.0, 2.5]
    assert "ambiguous-point" in codes
    fault = refusal([["0 deg", "1.000 N*m"], ["30.5 deg", "0,5 N*m"], ["300 deg", "2.500 N*m"]])
    assert (fault.where, fault.code) == ("/base/operation/table/0/1", "ambiguous-point")


def test_clutch_data_are_settled_like_any_table() -> None:
    text = "angle [mrad];torque [N*mm]\n10;2.500\n20,5;5.250\n"
    assert parse_measured(text).rows.tolist() == [[0.010, 2.5], [0.0205, 5.25]]
    for sign in (";", "\t", " "):
        with pytest.raises(MeasuredDataError) as caught:
            parse_measured(text.replace("20,5", "20").replace(";", sign))
        assert [fault.code for fault in caught.value.faults] == ["ambiguous-point"]
    data = [["10 mrad", "2.500 N*mm"], ["20,5 mrad", "5.250 N*mm"], ["30 mrad", "8.000 N*mm"]]
    clutch = {"/base/clutch": {"data": data, "accuracy": 1, "max_degree": 1}, "/axes": []}
    assert parsed(clutch).fits["/base/clutch"].coefficients[1] == pytest.approx(
        float(np.dot([0.01, 0.0205, 0.03], [2.5, 5.25, 8.0]) / np.dot([0.01, 0.0205, 0.03], [0.01, 0.0205, 0.03]))
    )


def test_components_are_settled_with_their_lists() -> None:
    text = "kind;name;spring_rate [N/m];damping;coefficients\nspring;S 1.250;9.000;0,5;\nclutch;C;;;0; 200 20.000\n"
    text = text.replace("0; 200 20.000", '"0; 200; 20.000"')
    spring, clutch = read_components({"csv": text})
    assert (spring.name, spring.fields["spring_rate"]) == ("S 1.250", "9000 N/m")
    assert list_text(clutch.fields["coefficients"]) == ["0", "200", "20000"]


def test_pasted_columns_are_settled() -> None:
    choices = (("", (Choice("shaft.load", "load", "N*m"), Choice("shaft.inertia", "inertia", "kg*m^2"))),)
    values = {COLUMNS: "shaft.load [N*mm]\tshaft.inertia\n20.000\t0,5\n25.000\t1\n"}
    assert take_columns(values, choices) == {}
    assert (values["/axes/0/values"], values["/axes/1/values"]) == ("20000 N*mm; 25000 N*mm", "0.5; 1")
    values = {COLUMNS: "shaft.load\tshaft.inertia\nN*mm\tkg*m^2\n20.000\t5\n25.000\t1\n"}
    assert "20 or 20000" in take_columns(values, choices)[COLUMNS][0]


def test_a_list_of_texts_is_settled() -> None:
    values = {"/axes": [{"path": "shaft.load", "values": ["20.000 N*mm", "120,5 N*mm"]}], "/exclude": []}
    assert parsed(values).study.columns(range(2))["shaft.load"].tolist() == pytest.approx([20.0, 0.1205])
    values["/axes"][0]["values"] = ["20.000 N*mm", "120.5 N*mm"]
    assert parsed(values).study.columns(range(2))["shaft.load"].tolist() == pytest.approx([0.020, 0.1205])


@pytest.mark.parametrize("rows", ["20.000;1500\n25.000;1600\n", "20.000;0.25\n25.000;1600,5\n30.000;2,5\n"])
def test_what_was_accepted_before_keeps_its_meaning(rows: str) -> None:
    points = POINTS.replace("shaft.load [N*mm]", "gravity [mm/s^2]") + rows
    spec = drive_changed({"/axes": [{"points": points}], "/exclude": []})
    with pytest.raises(SpecError):
        parse_spec(spec)
    study = parse_spec(accepted(spec)).study
    assert study.columns(range(study.cases))["gravity"].tolist() == pytest.approx([0.020, 0.025, 0.030][: study.cases])
    table = [["0 deg", "1.000 N*m"], ["30.5 deg", "0,5 N*m"], ["300 deg", "2.500 N*m"]]
    operation = {"quantity": "torque", "table": table}
    machine = accepted(changed({"/base/operation": operation, "/base/drive/inertia": 1e6, "/axes": []}))
    structure = parse_spec(machine).study.structure
    assert structure is not None
    assert [row[1] for row in structure["operation"]["table"]["rows"]] == [1.0, 0.5, 2.5]


ROWS = [[0.0, 100.0], [pytest.approx(0.5 * math.pi), 300.0], [pytest.approx(math.radians(355.5)), 100.0]]


@pytest.mark.parametrize(
    "text",
    [
        '"angle [deg]","torque [kN*m]"\n"0","0,1"\n"90","0,3"\n"355,5","0,1"\n',
        '"angle [deg]", "torque [kN*m]"\n"0", "0,1"\n"90", "0,3"\n"355,5", "0,1"\n',
        "angle [deg], torque [kN*m]\n0, 0,1\n90, 0,3\n355,5, 0,1\n",
        "angle [deg], torque [kN*m]\n0, 0.1\n90, 0.3\n355.5, 0.1\n",
        "sep=;\nangle [deg];torque [kN*m]\n0;0,1\n90;0,3\n355,5;0,1\n",
        '\ufeff"sep=,"\r\nangle [deg],torque [kN*m]\r\n0,0.1\r\n90,0.3\r\n355.5,0.1\r\n',
        "angle;torque\ndeg;kN*m\n0;0,1\n90;0,3\n355,5;0,1\n",
        "angle\ttorque\n[°]\t[kN*m]\n0\t0,1\n90\t0,3\n355,5\t0,1\n",
        "Crank angle [deg];Torque at the shaft [kN*m]\n0;0,1\n90;0,3\n355,5;0,1\n",
        "angle_deg;torque_kNm\n0;0,1\n90;0,3\n355,5;0,1\n",
        "angle / deg;torque / kNm\n0;0,1\n90;0,3\n355,5;0,1\n",
        "angle [deg];torque [kN*m];\n0;0,1;\n90;0,3;\n355,5;0,1;\n",
    ],
)
def test_a_table_is_read_as_instruments_and_spreadsheets_write_it(text: str) -> None:
    assert rows_of(text)[0] == ROWS


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("angle [deg];torque [kN*m];p [bar]\n0;0,1;1\n90;0,3;1\n", "out-of-range"),  # a further column
        ("angle;torque\nvolts;amperes\n0;0,1\n90;0,3\n", "wrong-type"),
        ("angle [deg],torque [kN*m]\n0,0,1\n90,0,3\n", "unequal-lengths"),
        ("angle [deg], a, b [kN*m]\n0, 0,1\n90, 0,3\n", "out-of-range"),
    ],
)
def test_other_tables_are_refused_with_the_cause(text: str, code: str) -> None:
    assert refusal(text).code == code


def test_a_recording_may_begin_before_the_angle_0() -> None:
    text = "t [s];torque [N*m]\n-0,25;1,5\n0;5\n0,7;9\n"
    rows, _ = rows_of(text, over="time", recorded_at="60 rpm")
    assert rows == [[pytest.approx(2.0 * math.pi * time), value] for time, value in ((-0.25, 1.5), (0, 5), (0.7, 9))]


@pytest.mark.parametrize(
    "text",
    [
        '"angle_deg","torque_Nm"\n"0,25","0,878"\n"0,5","1,79"\n"1,5","6,2"\n',
        "sep=;\nangle [deg];torque [Nm]\n0,25;0,878\n0,5;1,79\n1,5;6,2\n",
        "angle;torque\ndeg;Nm\n0,25;0,878\n0,5;1,79\n1,5;6,2\n",
        "angle_deg, torque_Nm\n0,25, 0,878\n0,5, 1,79\n1,5, 6,2\n",
    ],
)
def test_clutch_data_are_read_likewise(text: str) -> None:
    expected = [[math.radians(angle), torque] for angle, torque in ((0.25, 0.878), (0.5, 1.79), (1.5, 6.2))]
    np.testing.assert_allclose(parse_measured(text).rows, expected, rtol=1e-15)


@pytest.mark.parametrize(
    ("angles", "warned"),
    [
        ((0, 180, 180), True),
        ((0, 90, 180), True),
        (range(300), True),
        ((0, 120, 240), False),
        (range(0, 360, 5), False),
        (range(350), False),
        ((-90, 0, 90, 180), False),
        ((0, 180, 180, 360), False),
    ],
)
def test_a_table_that_ends_long_before_its_cycle_is_warned_of(angles: Any, warned: bool) -> None:
    table = [[f"{angle} deg", 10] for angle in angles]
    assert ("table-ends-early" in rows_of(table)[1]) == warned


def test_cells_of_a_shaft_table_may_have_units_of_their_own() -> None:
    """The unit of a cell holds before that of its heading, as in tables of cases."""
    own, _ = rows_of("angle [deg];torque [N*m]\n0;0\n90 deg;2 kN*m\n0.5 rev;2000\n300;0\n")
    plain, _ = rows_of("angle [deg];torque [N*m]\n0;0\n90;2000\n180;2000\n300;0\n")
    assert own == plain


@pytest.mark.parametrize(
    "above", ["# exported 2026-11-03\n", "# one; two\n\n  # three, four\n", "\ufeff#\n", "# a\nsep=;\n"]
)
def test_comments_above_a_table_are_left_out(above: str) -> None:
    table = "angle [deg];torque [N*m]\n0;1\n90;3,5\n300;1\n"
    assert rows_of(above + table) == rows_of(table)
    points = POINTS + "100;1500\n200;1500\n"
    assert loads(above + points) == loads(points)
    with pytest.raises(SpecError, match=f"line {above.count(chr(10)) + 3}") as refused:
        rows_of(above + table.replace("90;3,5", "90;bad"))
    assert len(refused.value.faults) == 1


def test_headings_behind_the_sign_of_a_comment_are_headings() -> None:
    table = "angle [deg];torque [N*m]\n0;1\n90;3,5\n300;1\n"
    assert rows_of("# measured\n#" + table) == rows_of(table)
    assert rows_of("# " + table) == rows_of(table)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("shaft.load\n1 200\n1\N{NARROW NO-BREAK SPACE}500", [1200.0, 1500.0]),
        ("shaft.load\n2.5·10⁻³\n10^-2", [0.0025, 0.01]),
        ("pendulums.0.initial_angle\n\N{MINUS SIGN}0.1\n0.1", [-0.1, 0.1]),
    ],
)
def test_numbers_of_a_column_without_a_unit_are_as_pages_print_them(text: str, expected: list[float]) -> None:
    study = parse_spec(drive_changed({"/axes": [{"points": text}]})).study
    (column,) = study.columns(range(study.cases)).values()
    assert column.tolist() == expected
