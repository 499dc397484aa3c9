"""Tables of machine shafts as the text of CSV files, and indicator diagrams in specs."""

from __future__ import annotations

import math
from typing import Any

import jsonschema
import pytest

from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.machine.registry import part_of
from sprag_study.service.spec.report import SpecError
from sprag_study.service.spec.schema.document import spec_schema
from sprag_study.worker import models
from tests.service.spec.machine.test_shaft import changed, problems

TORQUE = "angle [deg];torque [kN*m]\n0;0,1\n90;0,3\n360;0,1\n"
INDICATOR: dict[str, Any] = {
    "over": "stroke", "piston_area": "60 cm^2", "interpolation": "linear",
    "csv": "x,p [bar]\n0,20\n1,2\n1,1\n0,6\n",
}  # fmt: skip


def test_a_csv_text_is_a_table() -> None:
    operation = {"quantity": "torque", "csv": TORQUE, "interpolation": "linear"}
    spec = changed({"/base/operation": operation, "/base/mechanism": {"csv": "phi,I\n0,2\n3,4\n"}, "/axes": []})
    structure = parse_spec(spec).study.structure
    assert structure is not None
    assert structure["operation"]["form"] == "table"
    rows = structure["operation"]["table"]["rows"]
    assert [row[1] for row in rows] == [100.0, 300.0, 100.0]
    assert [row[0] for row in rows] == pytest.approx([0.0, 0.5 * math.pi, 2.0 * math.pi], rel=1e-15)
    assert structure["mechanism"] == {
        "kind": "table", "formula": None, "table": {"rows": [[0.0, 2.0], [3.0, 4.0]], "interpolation": "smooth"},
    }  # fmt: skip
    jsonschema.Draft202012Validator(spec_schema()).validate(spec)
    torque = {"csv": "angle [deg],M [N*m]\n0,60\n180,70\n"}
    drive = parse_spec(changed({"/base/drive/torque": torque, "/base/balance": "scale", "/axes": []})).study.structure
    assert drive is not None
    assert drive["drive"]["table"]["rows"][1] == [math.pi, 70.0]


def test_an_indicator_diagram() -> None:
    spec = changed({"/base/operation": {"indicator": INDICATOR}, "/base/mean_speed": "600 rpm", "/axes": []})
    study = parse_spec(spec).study
    assert study.structure is not None
    assert study.structure["operation"]["table"]["rows"] == [[0.0, 2e6], [1.0, 2e5], [1.0, 1e5], [0.0, 6e5]]
    assert study.base["operation.indicator.piston_area"] == 6e-3
    assert study.base["operation.indicator.back_pressure"] == 101325.0
    jsonschema.Draft202012Validator(spec_schema()).validate(spec)
    chosen = {choice.path: choice.text for choice in part_of("machine-shaft").choices(study, spec)}
    assert (chosen["operation"], chosen["operation.over"]) == ("indicator", "stroke")


@pytest.mark.parametrize(
    ("operation", "pointer", "text"),
    [
        ({"quantity": "torque", "csv": "angle [deg],torque\n0,1\n90,x\n"}, "csv", "line 3, column value"),
        (
            {"quantity": "torque", "csv": "angle [kg],torque\n0,1\n90,2\n"},
            "csv",
            "the heading of column angle is in 'kg'",
        ),
        ({"quantity": "torque", "csv": "angle\n0\n1\n"}, "csv", "must have 2 columns"),
        ({"quantity": "torque", "csv": "0,10\n3.14,2\n6.28,1\n"}, "csv", "must begin with headings"),
        ({"quantity": "torque", "csv": "0;10,5\n3,14;2\n6,28;1\n"}, "csv", "must begin with headings"),
        ({"quantity": "torque", "csv": [[0, 1]]}, "csv", "must be the text of a CSV file"),
        ({"quantity": "torque", "csv": TORQUE, "table": [[0, 1], [1, 2]]}, "", "exactly one"),
        ({"indicator": INDICATOR, "quantity": "force"}, "quantity", "does not belong to an indicator diagram"),
        ({"indicator": {**INDICATOR, "csv": ...}}, "indicator", "needs exactly one of table, csv"),
        ({"indicator": {**INDICATOR, "piston_area": ...}}, "indicator/piston_area", "is required"),
        ({"indicator": {**INDICATOR, "csv": "x,p\n0,1\n1,2\n"}}, "indicator/csv", "has 1 stroke,"),
        ({"indicator": {**INDICATOR, "csv": "x,p\n0,1\n1.5,2\n"}}, "indicator/csv", "line 3, column fraction"),
    ],
)
def test_wrong_tables(operation: dict[str, Any], pointer: str, text: str) -> None:
    if "indicator" in operation:
        own = {name: value for name, value in operation["indicator"].items() if value is not ...}
        operation = operation | {"indicator": own}
    found = problems({"/base/operation": operation, "/base/mean_speed": "600 rpm", "/axes": []})
    assert text in found[f"/base/operation/{pointer}".rstrip("/")].message


def test_a_fraction_in_percent_and_texts_without_rows() -> None:
    def found(**fields: Any) -> Any:
        operation = {"indicator": INDICATOR | fields}
        return {"/base/operation": operation, "/base/mean_speed": "600 rpm", "/axes": []}

    csv = "x [%],p [bar]\n0,20\n30,8\n100,2\n100,1\n0,6\n"
    structure = parse_spec(changed(found(csv=csv))).study.structure
    assert structure is not None
    assert structure["operation"]["table"]["rows"][1] == [0.3, 8e5]
    for wrong, sentence in (
        ("", "is empty"),
        ("x,p [bar]\n", "has no lines under its headings"),
        ("x,p [bar]\n0,20\n1,-2\n0,6\n", "line 3, column pressure: is out of range"),
        ("x [mm],p [bar]\n0,20\n1,2\n0,6\n", "the heading of column fraction has a unit, but its numbers have none"),
    ):
        assert problems(found(csv=wrong))["/base/operation/indicator/csv"].message == sentence
    (fault,) = problems(found(csv="a,p [bar]\n0,1\n180,2\n", over="angle")).values()
    assert fault.message.endswith("angles without a unit are in rad.")
    (fault,) = problems(found(csv="a,p [bar]\n0,1\n720,2\n", over="angle")).values()
    assert fault.message.endswith("without a unit in the heading it is in rad")


def test_what_is_given_but_not_used_is_warned_of() -> None:
    spec = changed({"/base/operation": {"quantity": "torque", "sense": "fixed", "value": "3 N*m"}, "/axes": []})
    wheel = {"kind": "rim", "diameter": "1 m", "mass": "50 kg", "poisson_ratio": 0.3}
    spec["base"]["drive"] = {"flywheel": wheel}
    warnings = parse_spec(spec).warnings
    assert [str(warning).partition(":")[0] for warning in warnings] == [
        "/base/drive/flywheel/poisson_ratio", "/base/operation/sense",
    ]  # fmt: skip
    wheel["kind"] = "disc"
    assert len(parse_spec(spec).warnings) == 1
    part = {name: spec["base"].pop(name) for name in ("mechanism", "operation")}
    del part["operation"]["sense"]
    spec["base"]["parts"] = [part, {"crank_angle": "90 deg"}]
    (warning,) = parse_spec(spec).warnings
    assert warning == "/base/parts/1: has neither a mechanism nor an operation, so it does nothing"
    assert warning.code == "nothing-acts"


def test_flywheel_and_motor_are_among_the_main_results() -> None:
    plain = parse_spec(changed({"/axes": []})).study
    assert not [name for name in models.presentation_of(plain).main if name.startswith(("flywheel", "motor"))]
    wheel = {"kind": "rim", "diameter": "1 m", "mass": "50 kg"}
    made = parse_spec(
        changed({"/base/drive": {"flywheel": wheel, "stages": [{"kind": "gear", "ratio": 3}]}, "/axes": []})
    )
    main = models.presentation_of(made.study).main
    assert {"flywheel.margin", "motor.power.mean", "irregularity"} <= set(main)


def test_a_motor_from_a_table() -> None:
    motor = {"kind": "table", "csv": "speed [rpm],torque [N*m]\n0,60\n140,50\n150,0\n"}
    load = {"quantity": "torque", "value": "20 N*m"}
    changes = {
        "/base/drive": {"inertia": 30, "motor": motor},
        "/base/balance": "motor",
        "/base/operation": load,
        "/axes": [],
    }
    spec = changed(changes)
    del spec["base"]["mean_speed"]
    structure = parse_spec(spec).study.structure
    assert structure is not None
    assert structure["drive"]["motor"] == "table"
    assert [row[1] for row in structure["drive"]["table"]["rows"]] == [60.0, 50.0, 0.0]
    assert structure["drive"]["table"]["rows"][2][0] == pytest.approx(5.0 * math.pi, rel=1e-15)
    jsonschema.Draft202012Validator(spec_schema()).validate(spec)
    own = spec["base"]["drive"]["motor"]
    for wrong, place, sentence in (
        ({"csv": "speed [rpm],torque [N*m]\n0,60\n140,50\n"}, "/csv", "The characteristic of a motor ends"),
        ({}, "", "needs exactly one of table, csv"),
    ):
        del own["csv"]
        own |= wrong
        with pytest.raises(SpecError) as caught:
            parse_spec(spec)
        faults = {fault.where: fault.message for fault in caught.value.faults}
        assert faults["/base/drive/motor" + place].startswith(sentence)


def test_a_diagram_recorded_over_time_is_one_over_the_angle() -> None:
    """0.125 s at 120 rpm is a quarter of a turn."""
    recorded = {"quantity": "torque", "over": "time", "recorded_at": "120 rpm"}
    timed = changed(
        {"/base/operation": recorded | {"csv": "time [ms],torque [N*m]\n0,0\n125,90\n500,0\n"}, "/axes": []}
    )
    rows = [["0 deg", 0], ["90 deg", 90], ["360 deg", 0]]
    angular = changed({"/base/operation": {"quantity": "torque", "table": rows}, "/axes": []})
    own, other = (parse_spec(spec).study.structure for spec in (timed, angular))
    assert own is not None
    assert other is not None
    assert own["operation"]["over"] == "angle"
    for row, wanted in zip(own["operation"]["table"]["rows"], other["operation"]["table"]["rows"], strict=True):
        assert row == pytest.approx(wanted, rel=1e-15)
    jsonschema.Draft202012Validator(spec_schema()).validate(timed)
    pressure = {"over": "time", "recorded_at": "300 rpm", "piston_area": "60 cm^2", "table": [[0, 1e5], ["0.1 s", 5e5]]}
    indicated = parse_spec(changed({"/base/operation": {"indicator": pressure}, "/axes": []})).study.structure
    assert indicated is not None
    assert indicated["operation"]["table"]["rows"] == [[0.0, 1e5], [pytest.approx(math.pi), 5e5]]


@pytest.mark.parametrize(
    ("operation", "field", "code"),
    [
        ({"over": "time", "table": [[0, 1], [0.1, 2]]}, "recorded_at", "required"),
        ({"over": "time", "recorded_at": 0, "table": [[0, 1], [0.1, 2]]}, "recorded_at", "out-of-range"),
        ({"over": "time", "recorded_at": "2 m", "table": [[0, 1], [0.1, 2]]}, "recorded_at", "wrong-unit"),
        ({"over": "time", "recorded_at": 9, "value": 3}, "over", "conflict"),
        ({"over": "time", "recorded_at": 9, "formula": "t"}, "over", "conflict"),
        ({"recorded_at": 9, "value": 3}, "recorded_at", "not-used"),
        ({"over": "time", "recorded_at": "100 rpm", "table": [[0, 1], ["0.9 s", 1]]}, "table", "invalid-table"),
    ],
)
def test_what_is_wrong_about_a_diagram_over_time(operation: dict[str, Any], field: str, code: str) -> None:
    found = problems({"/base/operation": {"quantity": "torque"} | operation, "/axes": []})
    assert {where: fault.code for where, fault in found.items()} == {f"/base/operation/{field}": code}


@pytest.mark.parametrize(
    ("drive", "found", "allowed"),
    [
        ({"csv": "speed [rpm],torque [N*m]\n0,60\n"}, "1", "2 to 5000 rows"),
        ({"csv": "speed,torque\n0,60\n9,40\n"}, "40 N*m", "at most 0 N*m and less than 60 N*m in the last row"),
        ({"table": [[0, 60], [9, 40], [9, 0]]}, "9 rad/s", "more than 9 rad/s in row 3"),
        ({"table": [[9, 60], [5, 40], [9, 0]]}, "5", "at least 9 in row 2"),
    ],
)
def test_a_wrong_table_says_what_it_has_and_what_is_allowed(drive: dict[str, Any], found: str, allowed: str) -> None:
    spec = changed({"/base/drive": {"inertia": 30, "motor": {"kind": "table"} | drive}, "/base/balance": "motor",
                    "/axes": []})  # fmt: skip
    del spec["base"]["mean_speed"]
    with pytest.raises(SpecError) as caught:
        parse_spec(spec)
    (fault,) = caught.value.faults
    assert (fault.code, fault.value, fault.allowed) == ("invalid-table", found, allowed)
