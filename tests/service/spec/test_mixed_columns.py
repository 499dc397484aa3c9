"""Columns of tables without a unit in the heading: bare numbers beside quantities of another scale are asked about."""

from __future__ import annotations

from typing import Any

import pytest

from sprag_study.service.faults import FaultError
from sprag_study.service.http.web.form.columns import COLUMNS, take_columns
from sprag_study.service.http.web.form.fields import Choice
from sprag_study.service.http.web.form.spec import spec_of
from sprag_study.service.languages import language
from sprag_study.service.spec.components import read_components
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.stored import accepted
from tests.service.spec.kinds.test_calibrate import read
from tests.service.spec.machine.test_shaft import changed as shaft_changed
from tests.service.spec_sample import changed, parsed, problems

LOAD = "shaft.load"
MIXED = "shaft.load;excitation.frequency [Hz]\n100;20\n150;25\n200 N*mm;25\n"


def points(text: str) -> dict[str, Any]:
    """The change of the sample spec to these points."""
    return {"/axes": [{"points": text}], "/exclude": []}


def loads(spec: dict[str, Any]) -> list[float]:
    """The loads of the cases of a spec, in N*m."""
    study = parse_spec(spec).study
    return [float(load) for load in study.columns(range(study.cases))[LOAD]]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (MIXED.replace("200 N*mm", "200"), [100.0, 150.0, 200.0]),
        (MIXED.replace("shaft.load", "shaft.load [N*mm]"), [0.1, 0.15, 0.2]),
        (MIXED.replace("N*mm", "N*m"), [100.0, 150.0, 200.0]),
        (MIXED.replace("100;", "0;").replace("150;", "0,15 N*m;"), [0.0, 0.15, 0.2]),
    ],
)
def test_a_column_of_one_meaning_is_read(text: str, expected: list[float]) -> None:
    assert loads(changed(points(text))) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("text", "words"),
    [(MIXED, "line 2, column shaft.load"), (MIXED.replace("100;", "0;"), "line 3, column shaft.load")],
)
def test_a_mixed_column_of_points_is_asked_about(text: str, words: str) -> None:
    ((where, fault),) = problems(points(text)).items()
    assert (where, fault.code, fault.value, fault.unit) == ("/axes/0/points", "ambiguous-unit", LOAD, "N*m")
    assert words in fault.message
    assert "in N*m or in N*mm?" in fault.message
    assert "shaft.load [N*m]" in str(fault.allowed)


def test_points_that_were_accepted_before_keep_their_meaning() -> None:
    made = accepted(changed(points(MIXED)))
    assert made["axes"][0]["points"] == MIXED.replace("shaft.load", "shaft.load [N*m]")
    assert loads(made) == pytest.approx([100.0, 150.0, 0.2])
    plain = changed(points(MIXED.replace("N*mm", "N*m")))
    assert accepted(plain) == plain


def test_a_mixed_column_of_components_is_asked_about() -> None:
    with pytest.raises(FaultError) as caught:
        read_components({"csv": "kind;name;spring_rate\nspring;A;9\nspring;B;8 N/mm\n"})
    (fault,) = caught.value.faults
    assert (fault.where, fault.code, fault.value) == ("/csv", "ambiguous-unit", "spring_rate")


@pytest.mark.parametrize(
    ("text", "heading"),
    [
        ("shaft.load;shaft.speed.mean [rad/s]\n50;40\n100;30\n200 N*mm;20\n", LOAD),
        ("shaft.load [N*m];shaft.speed.mean\n0,1;300\n0,2;200\n0,3;100 rpm\n", "shaft.speed.mean"),
        ("shaft.load [N*m];shaft.speed.mean;sigma\n0,1;3;1\n0,2;2;1\n0,3;1;3 rpm\n", "sigma"),
    ],
)
def test_a_mixed_column_of_measured_points_is_asked_about(text: str, heading: str) -> None:
    with pytest.raises(FaultError) as caught:
        read(text)
    (fault,) = caught.value.faults
    assert (fault.where, fault.code, fault.value) == ("/calibrate/measured/csv", "ambiguous-unit", heading)


def test_a_mixed_column_of_a_shaft_table_is_asked_about() -> None:
    operation = {"quantity": "torque", "interpolation": "linear", "csv": "angle;torque\n0;5\n90 deg;5\n360 deg;5\n"}
    assert parse_spec(shaft_changed({"/base/operation": operation}))
    operation["csv"] = operation["csv"].replace("\n0;", "\n1;")
    with pytest.raises(FaultError) as caught:
        parse_spec(shaft_changed({"/base/operation": operation}))
    (fault,) = caught.value.faults
    assert (fault.where, fault.code, fault.value) == ("/base/operation/csv", "ambiguous-unit", "angle")


def test_pasted_cells_keep_the_unit_of_their_heading() -> None:
    choices = [("", [Choice(LOAD, "Load", "N*m"), Choice("excitation.frequency", "Frequency", "Hz")])]
    pasted = "shaft.load [N*mm]\tFrequency [Hz]\n1,125\t20\n2,250\t25\n3,5 N*m\t30\n"
    for text in (pasted, pasted.replace("3,5 N*m", "3,375")):
        values = {COLUMNS: text}
        assert take_columns(values, choices) == {}
        with language("uk"):
            spec, _ = spec_of({**values, "/base/shaft/load": "0"})
        study = parse_spec(changed({"/axes": spec["axes"], "/combine": "zip"})).study
        last = 3.5 if "N*m\t30" in text else 0.003375
        assert study.columns(range(study.cases))[LOAD].tolist() == pytest.approx([0.001125, 0.00225, last])


def test_a_case_table_without_mixed_units_stays_as_it_is() -> None:
    spec = changed(points("excitation.frequency;shaft.load\n20;0.1\n25;0.2\n"))
    assert accepted(spec) == spec
    assert parsed(points("excitation.frequency;shaft.load\n20;1e-1\n25;2E-1\n")).study.cases == 2
