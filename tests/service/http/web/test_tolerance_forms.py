"""Tolerances in the form of a new study."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from sprag.service.http.web.form.page import reshape
from sprag.service.http.web.form.spec import field_of, spec_of, values_of
from sprag.service.spec.document import parse_spec
from sprag.service.spec.report import SpecError

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
        {"path": "pendulums.0.damping", "values": [0.01]},
        {"path": "clutch.windup_limit", "plus_minus": "5 %"},
    ):
        with pytest.raises(ValueError, match="no field"):
            values_of({**spec, "tolerances": [item]})
    with pytest.raises(ValueError, match="no fields"):
        values_of({**spec, "correlations": []})


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
    reshape(values, "add-pendulum")
    assert values[BACKLASH.replace("/0/", "/1/")] == "60 %"
    reshape(values, "drop-pendulum")
    assert BACKLASH.replace("/0/", "/1/") not in values


def test_the_page_has_the_fields_when_they_are_asked_for(service: Service) -> None:
    study_id = service.submit(json.loads(EXAMPLE.read_text()))
    page = service.http.get(f"/new?clone={study_id}").text
    assert f'name="{BACKLASH}" value="60 %"' in page
    assert 'name="/drives" value="256"' in page
    values = values_of(service.store.spec(study_id)) | {"batch": ""}
    page = service.http.post("/new", data={**values, "do": "check"}).text
    assert f'<input type="hidden" name="{BACKLASH}" value="60 %">' in page
    assert f'id="{BACKLASH}"' not in page
