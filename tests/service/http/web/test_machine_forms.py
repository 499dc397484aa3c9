"""The machine of every model goes through the form unchanged, and old names of fields are still read."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sprag.service.http.views import preset_of
from sprag.service.http.web.form.check import check_form
from sprag.service.http.web.form.machine import Entry, entries
from sprag.service.http.web.form.machine_spec import base_of, values_of_base
from sprag.service.http.web.form.page import empty
from sprag.service.http.web.form.spec import spec_of, values_of
from sprag.service.http.web.form.undo import history_of
from sprag.service.presets import preset_names
from sprag.service.spec.document import parse_spec
from sprag.worker import models
from sprag.worker.chunking import Chunking
from tests.acceptance.processes import EXAMPLES

if TYPE_CHECKING:
    from tests.service.conftest import Service

#: Texts of fields by how they are read; of all others a number.
TEXTS = {
    "list": "0; 200; = 2 N*m/rad; 20000", "measured": "angle_rad\ttorque_Nm\n0.0\t0.0\n0.01\t2.0",
    "steps": "0 deg; 10 deg; 1 kN\n20 deg; 30 deg; 2", "constants": "k = 40\nm = 2", "text": "2 + sin(phi)",
    "table": "angle [deg],force [kN]\n0,0\n180,20", "tick": "on",
}  # fmt: skip
COUNTS = {"pendulums": (1, 3), "stages": (0, 2), "parts": (0, 2)}


def texts(entry: Entry) -> st.SearchStrategy[str]:
    """What a field can have."""
    if entry.field.choices:
        return st.sampled_from([value for value, _label in entry.field.choices])
    kind = getattr(entry.item, "kind", "")
    some = st.just(TEXTS[kind]) if kind in TEXTS else st.sampled_from(["0.5", "2 mm", "= 2 * gravity", "-3e-5"])
    # A constant torque is chosen by being given.
    return some if entry.field.required or entry.name.endswith("/torque") else st.just("") | some


@st.composite
def filled(draw: st.DrawFn) -> dict[str, str]:
    """The values of a form with any choices, in which any fields are filled in."""
    values = empty(draw(st.sampled_from(models.model_names())))
    values |= {name: str(draw(st.integers(*ends))) for name, ends in COUNTS.items()}
    seen: set[str] = set()
    while fresh := [entry for entry in entries(values) if entry.name not in seen]:
        for entry in fresh:
            seen.add(entry.name)
            text = draw(texts(entry))
            values = {name: own for name, own in values.items() if name != entry.name}
            values |= {entry.name: text} if text else {}
    return values


@given(filled())
def test_a_machine_goes_there_and_back(values: dict[str, str]) -> None:
    base = base_of(values, {})
    again = {"model": values["model"]}
    values_of_base(base, again)
    assert base_of(again, {}) == base
    shown = {entry.name for entry in entries(values)}
    assert {name: text for name, text in again.items() if name in shown and values.get(name)} == {
        name: text for name, text in values.items() if name in shown and text
    }


@pytest.mark.parametrize("name", preset_names())
def test_a_preset_goes_there_and_back(name: str) -> None:
    spec = preset_of(name)["spec"]
    values = values_of(spec)
    again, faults = spec_of(values)
    assert faults == {}
    assert parse_spec(again).study == parse_spec(spec).study
    assert spec_of(values_of(again))[0] == again


def test_a_machine_with_more_than_the_form_shows_is_a_text() -> None:
    press: dict[str, Any] = json.loads(json.dumps(preset_of("press")["spec"]))
    values_of(press)
    press["base"]["balance"] = "refuse"  # which a torque that balances the operation cannot
    with pytest.raises(ValueError, match="no fields"):
        values_of(press)


@pytest.mark.parametrize("way", ["formula", "csv"])
def test_a_driving_torque_without_its_course_is_refused(way: str) -> None:
    values = values_of(preset_of("press")["spec"]) | {"/base/drive": way}
    assert "exactly one of" in check_form(values, Chunking()).faults["/base/drive"][0]


def test_fields_of_older_drafts_are_read(service: Service) -> None:
    old = {"model": "machine-shaft", "drive_is": "kloss", "/base/drive/motor/breakdown_slip": "0.2"}
    page = service.http.post("/new", data={**old, "do": "check"}).text
    assert '<option value="kloss" selected>' in page
    assert 'name="/base/drive/motor/breakdown_slip" value="0.2"' in page
    assert history_of({"history": '[{"drive_is": "found", "clutches": null}]'}) == [
        {"/base/drive": "found", "/base/clutches": None}
    ]


def test_measured_rows_are_taken_over_as_they_were_typed() -> None:
    spec = json.loads((EXAMPLES / "measured_clutch.json").read_text(encoding="utf-8"))
    values = values_of(spec)
    text = values["/base/pendulums/0/clutch/data"]
    assert text.splitlines()[:2] == ["angle [deg]\ttorque [N*mm]", "0.25\t878"]
    assert parse_spec(spec_of(values)[0]).study == parse_spec(spec).study
    spec["base"]["pendulums"][0]["clutch"]["data"][0][0] = 0.004
    text = values_of(spec)["/base/pendulums/0/clutch/data"]
    assert text.splitlines()[:2] == ["angle_rad\ttorque [N*mm]", "0.004\t878"]
