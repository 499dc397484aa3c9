"""Samples, tables of points and exclusions in the form: what goes in comes out, faults stand beside their fields."""

from __future__ import annotations

import json
from typing import Any

import pytest

from sprag_study.service.http.web.form.check import check_form
from sprag_study.service.http.web.form.page import empty
from sprag_study.service.http.web.form.parts import reshape
from sprag_study.service.http.web.form.spec import spec_of, values_of
from sprag_study.service.spec.document import parse_spec
from sprag_study.worker.chunking import Chunking
from tests.service.conftest import Service
from tests.service.http.web.fields import field_of
from tests.service.spec_sample import changed

SAMPLE: dict[str, Any] = {
    "sample": "sobol",
    "count": 8,
    "seed": 3,
    "ranges": [
        {"path": "shaft.load", "from": "10 N*mm", "to": "300 N*mm", "scale": "log"},
        {"path": ["excitation.amplitude_x", "excitation.amplitude_y"], "from": "1 mm", "to": "3 mm"},
    ],
}
POINTS = {"points": "excitation.frequency [rpm],gravity\n1500,9.81\n1800,0\n"}
EXCLUDE: list[dict[str, Any]] = [
    {"shaft.load": {"above": "0.2 N*m", "at_most": 0.25}},
    {"shaft.load": {"below": 0.05}, "excitation.amplitude_x": {"is": ["1 mm", "2 mm"]}},
]


def drawn(**changes: Any) -> dict[str, Any]:
    """The example with a sample, points and exclusions."""
    spec: dict[str, Any] = json.loads(json.dumps(changed({})))
    return {**spec, "axes": [SAMPLE, POINTS], "exclude": EXCLUDE, **changes}


def checked(values: dict[str, str]) -> dict[str, list[str]]:
    """The faults of a form, by field."""
    return check_form(values, Chunking(1000, 1, 60.0)).faults


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"axes": [SAMPLE], "exclude": EXCLUDE[:1]},
        {"axes": [{"path": "gravity", "values": [0, 9.81]}, SAMPLE], "exclude": []},
        {"axes": [{**SAMPLE, "sample": "saltelli", "second_order": True,
                   "ranges": [*SAMPLE["ranges"], {"path": "gravity", "from": 1, "to": 9.81}]}], "exclude": []},
        {"axes": [POINTS], "combine": "zip", "exclude": []},
    ],
)  # fmt: skip
def test_a_cloned_study_is_the_same_study(changes: dict[str, Any]) -> None:
    spec = drawn(**changes)
    values = values_of(json.loads(json.dumps(spec)))
    again, faults = spec_of(values)
    assert faults == {}
    assert checked(values) == {}
    assert again["axes"] == spec["axes"]
    assert again.get("exclude", []) == spec["exclude"]
    assert parse_spec(again).study.physics_hash("1") == parse_spec(spec).study.physics_hash("1")


@pytest.mark.parametrize(
    "changes",
    [
        {"axes": [SAMPLE, {"path": "gravity", "values": [0, 9.81]}]},  # its cases would have other numbers
        {"axes": [SAMPLE, SAMPLE]},
        {"axes": [{**SAMPLE, "correlations": []}]},
        {"exclude": [{"shaft.load": {"above": 1, "below": 2}, "gravity": {"is": 0}}]},
    ],
)
def test_what_the_form_cannot_show_is_a_text(changes: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="form"):
        values_of(drawn(**changes))


def test_a_second_limit_of_a_kind_is_not_dropped() -> None:
    row = {f"{name}{part}": text for name in ("/exclude/0/", "/exclude/0/and/")
           for part, text in (("path", "shaft.load"), ("kind", "above"), ("value", "1"))}  # fmt: skip
    (text,) = spec_of(values_of(drawn()) | row)[1]["/exclude/0/and/value"]
    assert "already has a limit of this kind" in text


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("/sample/count", "7"),
        ("/sample/count", ""),
        ("/sample/seed", "-1"),
        ("/sample/ranges/0/from", "10 N"),
        ("/sample/ranges/0/to", ""),
        ("/sample/ranges/1/path", "colour"),
        ("/points", "excitation.frequency [kg]\n1\n"),
        ("/points", "colour\n1\n"),
        ("/exclude/0/value", "0.2 kg"),
        ("/exclude/0/and/value", "many"),
        ("/exclude/1/path", ""),
        ("/exclude/1/and/value", "1 mm; 2 N"),
    ],
)
def test_faults_stand_beside_their_fields(name: str, text: str) -> None:
    values = values_of(drawn()) | {name: text}
    assert name in checked(values), checked(values)


def test_faults_count_axes_and_rows_that_are_filled_in() -> None:
    values = values_of(drawn(axes=[{"path": "gravity", "values": [0, 9.81]}, SAMPLE, POINTS]))
    assert field_of("/axes/1/ranges/1/to", values) == "/sample/ranges/1/to"
    assert field_of("/axes/2/points", values) == "/points"
    values |= {"/sample/ranges/0/path": "", "/sample/ranges/0/tied": "", "/sample/ranges/0/from": "",
               "/sample/ranges/0/to": ""}  # fmt: skip
    assert field_of("/axes/1/ranges/0/from", values) == "/sample/ranges/1/from"
    assert field_of("/axes/0/values/1", values) == "/axes/0/values"
    assert field_of("/exclude", values) == "/exclude"


def test_rows_come_and_go() -> None:
    values = empty("vibration-drive")
    for part in ("ranges", "ranges", "exclude"):
        reshape(values, f"add-{part}")
    assert (values["ranges"], values["exclude"]) == ("2", "1")
    values["/sample/ranges/1/path"] = "gravity"
    reshape(values, "drop-ranges 0")
    assert (values["ranges"], values["/sample/ranges/0/path"]) == ("1", "gravity")


def test_the_page_submits_what_commands_submit(service: Service) -> None:
    values = values_of(drawn()) | {"key": "1"}
    page = service.http.post("/new", data={**values, "do": "check"}).text
    assert 'name="/sample/ranges/1/tied"' in page
    assert 'data-into="/points"' in page
    assert 'name="/exclude/1/and/value" value="1 mm; 2 mm"' in page
    answer = service.http.post("/new", data={**values, "do": "submit"}, follow_redirects=False)
    assert answer.status_code == 303
    by_form = service.store.studies.study(answer.headers["location"].rpartition("/")[2])
    by_program = service.store.studies.study(service.submit(drawn()))
    assert by_form.physics_hash("1") == by_program.physics_hash("1")
    assert by_form.cases == by_program.cases < 8 * 2  # some are left out
