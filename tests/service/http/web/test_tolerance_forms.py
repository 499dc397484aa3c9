"""Tolerances in the form of a new study."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from sprag_study.service.http.web.form.parts import reshape
from sprag_study.service.http.web.form.spec import spec_of, values_of
from sprag_study.service.presets import preset_text
from sprag_study.service.spec.document import load_spec, parse_spec
from sprag_study.service.spec.report import SpecError
from tests.service.http.web.fields import field_of

if TYPE_CHECKING:
    from tests.service.conftest import Service

EXAMPLE = Path(__file__).resolve().parents[4] / "examples" / "tolerances.json"
BACKLASH = "/tolerances/pendulums/0/backlash/plus_minus"
INERTIA = "/tolerances/shaft/inertia/plus_minus"


def test_tolerances_stand_beside_their_parameters() -> None:
    spec = json.loads(EXAMPLE.read_text())
    values = values_of(spec)
    assert values[BACKLASH] == "60 %"
    assert values["/tolerances/pendulums/0/spring_rate/distribution"] == "uniform"
    assert values["/tolerances/excitation/amplitude_x/with"] == "excitation.amplitude_y"
    made, faults = spec_of(values)
    assert faults == {}
    # The same drives: the order of the tolerances is kept.
    assert parse_spec(made).study == parse_spec(spec).study
    assert "tolerances" not in spec_of({**values, "batch": ""})[0]
    for item in (
        {"path": "clutch.windup_limit", "plus_minus": "5 %"},
        {"path": "clutch.coefficients.1", "values": [190, 210]},
    ):
        with pytest.raises(ValueError, match="no field"):
            values_of({**spec, "tolerances": [item]})
    pair = {"between": ["shaft.inertia", "pendulums.0.mass"], "coefficient": 0.5}
    with pytest.raises(ValueError, match="no fields"):
        values_of({**spec, "correlations": [pair] * 21})


def test_measured_values_are_a_list_in_the_field() -> None:
    spec = json.loads(EXAMPLE.read_text())
    measured = {"path": "pendulums.0.damping", "values": ["10 N*mm*s/rad", "12 N*mm*s/rad", "0.011 N*m*s/rad"]}
    spec["tolerances"] = [*spec["tolerances"], measured]
    values = values_of(spec)
    damping = "/tolerances/pendulums/0/damping"
    assert values[f"{damping}/plus_minus"] == "10 N*mm*s/rad; 12 N*mm*s/rad; 0.011 N*m*s/rad"
    assert values[f"{damping}/distribution"] == "values"
    assert parse_spec(spec_of(values)[0]).study == parse_spec(spec).study
    # One column of a spreadsheet, with decimal commas; the fault of one value is at the field.
    values |= {f"{damping}/plus_minus": "0,01\n0,012\n0,011"}
    assert spec_of(values)[0]["tolerances"][-1]["values"] == [0.01, 0.012, 0.011]
    values |= {f"{damping}/plus_minus": "0.01; -1; 0.02"}
    with pytest.raises(SpecError) as caught:
        parse_spec(spec_of(values)[0])
    assert {field_of(str(fault.where), values) for fault in caught.value.faults} == {f"{damping}/plus_minus"}


def test_correlations_are_rows() -> None:
    spec = json.loads(EXAMPLE.read_text()) | {
        "draws": "random",
        "correlations": [
            {"between": ["excitation.amplitude_x", "pendulums.0.backlash"], "coefficient": -0.5},
            {"between": ["pendulums.*.spring_rate", "pendulums.0.backlash"], "coefficient": 0.25},
        ],
    }
    values = values_of(spec)
    assert (values["correlations"], values["/draws"]) == ("2", "random")
    assert parse_spec(spec_of(values)[0]).study == parse_spec(spec).study
    reshape(values, "add-correlations")  # an empty row is not part of the spec
    assert parse_spec(spec_of(values)[0]).study == parse_spec(spec).study
    reshape(values, "drop-correlations 0")
    assert spec_of(values)[0]["correlations"] == spec["correlations"][1:]
    for changes, field in (
        ({"/correlations/0/coefficient": "2"}, "/correlations/0/coefficient"),
        ({"/correlations/0/coefficient": ""}, "/correlations/0/coefficient"),
        ({"/correlations/0/between/1": "pendulums.0.mass"}, "/correlations/0/between/0"),
    ):
        wrong = {**values, **changes}
        with pytest.raises(SpecError) as caught:
            parse_spec(spec_of(wrong)[0])
        assert {field_of(str(fault.where), wrong) for fault in caught.value.faults} == {field}
    assert "correlations" not in spec_of({**values, "batch": ""})[0]


def test_faults_of_tolerances_stand_beside_them() -> None:
    values = values_of(json.loads(EXAMPLE.read_text())) | {INERTIA: "0 %", "/drives": "0"}
    with pytest.raises(SpecError) as caught:
        parse_spec(spec_of(values)[0])
    assert {field_of(str(fault.where), values) for fault in caught.value.faults} == {INERTIA, "/drives"}
    empty = {name: text for name, text in values.items() if not name.endswith("/plus_minus")} | {"/drives": "8"}
    with pytest.raises(SpecError) as caught:
        parse_spec(spec_of(empty)[0])
    assert {field_of(str(fault.where), empty) for fault in caught.value.faults} == {"batch"}


def test_a_further_pendulum_has_the_tolerances_of_the_one_before() -> None:
    values = values_of(json.loads(EXAMPLE.read_text()))
    reshape(values, "add-pendulums")
    assert values[BACKLASH.replace("/0/", "/1/")] == "60 %"
    reshape(values, "drop-pendulums 1")
    assert BACKLASH.replace("/0/", "/1/") not in values


def test_the_page_has_the_fields_when_they_are_asked_for(service: Service) -> None:
    study_id = service.submit(json.loads(EXAMPLE.read_text()))
    page = service.http.get(f"/new?clone={study_id}").text
    assert f'name="{BACKLASH}" value="60 %"' in page
    assert 'name="/drives" value="256"' in page
    values = values_of(service.store.studies.spec(study_id)) | {"batch": ""}
    asked = {**values, "batch": "on", "correlations": "1", "/correlations/0/coefficient": "0,6"}
    page = service.http.post("/new", data={**asked, "do": "check"}).text
    assert 'name="/correlations/0/coefficient" value="0,6"' in page
    assert '<select id="/correlations/0/between/1"' in page
    page = service.http.post("/new", data={**values, "do": "check"}).text
    assert f'<input type="hidden" name="{BACKLASH}" value="60 %">' in page
    assert f'id="{BACKLASH}"' not in page


@pytest.mark.parametrize("path", ["operation.steps.*.value", "drive.missing"])
def test_a_tolerance_without_a_field_makes_the_spec_a_text(path: str) -> None:
    press = load_spec(preset_text("press")[1], "toml")
    spec = {
        **press,
        "tolerances": [{"path": "drive.inertia", "plus_minus": "5 %"}, {"path": path, "plus_minus": "10 %"}],
    }
    with pytest.raises(ValueError, match=re.escape(path)):
        values_of(spec)
