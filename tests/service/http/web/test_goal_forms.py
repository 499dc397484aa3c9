"""The form of a search: what goes in comes out, faults stand beside their fields, rows come and go."""

from __future__ import annotations

import json
from typing import Any

import pytest

from sprag_study.service.http.web.form.check import check_form
from sprag_study.service.http.web.form.goal import with_own_units, with_shown_units
from sprag_study.service.http.web.form.page import empty
from sprag_study.service.http.web.form.parts import reshape
from sprag_study.service.http.web.form.sent import settle
from sprag_study.service.http.web.form.spec import spec_of, values_of
from sprag_study.service.presets import preset_text
from sprag_study.service.reading.quantities import Units
from sprag_study.service.reading.reader import Reading
from sprag_study.service.spec.document import load_spec, parse_spec
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.models import SHARE
from tests.service.conftest import Service
from tests.service.http.web.controls import Controls
from tests.service.http.web.fields import field_of

GOAL: dict[str, Any] = {
    "vary": [
        {"path": "excitation.frequency", "from": "20 Hz", "to": "35 Hz"},
        {"path": ["excitation.amplitude_x", "excitation.amplitude_y"], "values": ["1 mm", "2 mm", "0.003 m"]},
    ],
    "best": [{"result": "efficiency", "max": True}, {"result": "shaft.irregularity"}],
    "subject_to": [
        {"result": "torque.max", "at_most": "3 N*m"},
        {"result": "shaft.speed.mean", "is": 8, "within": "2 %"},
        {"result": "regime", "is": "periodic"},
    ],
    "at": [{"shaft.load": "0.1 N*m", "gravity": 9.81}, {"shaft.load": 0.3, "gravity": 0}],
    "over": "mean",
    "population": 20,
    "generations": 5,
    "seed": 7,
    "polish": False,
}


def searching(**changes: Any) -> dict[str, Any]:
    """The preset of a search, with another goal."""
    spec: dict[str, Any] = load_spec(preset_text("fastest_drive")[1], "toml")  # type: ignore[assignment]
    return {**json.loads(json.dumps(spec)), "goal": {**GOAL, **changes}}


def robust() -> dict[str, Any]:
    """The same about drives."""
    drives = {"tolerances": [{"path": "shaft.load", "plus_minus": "5 %"}], "drives": 8}
    goal = {
        "best": [{"result": "efficiency", "max": True, "statistic": "mean"}],
        "subject_to": [
            {"result": "shaft.speed.mean", "statistic": "mean", "deviations": -3, "at_least": "6 rad/s"},
            {"result": "torque.max", "quantile": "95 %", "at_most": "3 N*m"},
            {"result": "torque.max", "statistic": "deviation", "at_most": "0.1 N*m"},
        ],
        "fresh_drives": 50,
    }
    return searching(**goal, at=[]) | drives


def test_a_search_is_cloned_with_all_that_it_asks_for() -> None:
    for spec in (searching(), searching(start=[{}]), load_spec(preset_text("fastest_drive")[1], "toml")):
        assert isinstance(spec, dict)
        again, faults = spec_of(values_of(json.loads(json.dumps(spec))))
        assert faults == {}
        assert again["goal"] == spec["goal"]
        assert parse_spec(again).study.plan == parse_spec(spec).study.plan
    spec = robust()
    again, faults = spec_of(values_of(json.loads(json.dumps(spec))))
    assert faults == {}
    assert parse_spec(again).study.plan == parse_spec(spec).study.plan
    named = [{"name": "idle", "shaft.load": "0.1 N*m"}, {"shaft.load": "0.3 N*m"}]
    best, limit = {"result": "efficiency", "max": True, "over": "best"}, {"result": "torque.max", "at_most": "3 N*m"}
    spec = searching(at=named, best=[best], subject_to=[{**limit, "at": "idle"}, {**limit, "over": "mean"}])
    spec["quantities"] = {"cost": "1 + shaft.load / (1 N*m)", "eff": {"formula": "2 * efficiency", "unit": "%"}}
    again, faults = spec_of(values_of(json.loads(json.dumps(spec))))
    assert (faults, again["goal"], again["quantities"]) == ({}, spec["goal"], spec["quantities"])
    assert parse_spec(again).study.plan == parse_spec(spec).study.plan
    with pytest.raises(ValueError, match="by their values"):
        values_of(searching(at=named, best=[{**best, "at": {"shaft.load": "0.1 N*m"}}]))
    with pytest.raises(ValueError, match="form"):
        values_of(searching(more=1))
    with pytest.raises(ValueError, match="no fields for known designs"):
        values_of(searching(start=[{"excitation.frequency": "30 Hz"}]))
    with pytest.raises(ValueError, match="form"):
        values_of(searching(best=[{"result": "efficiency", "weight": 2}]))


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("/goal/vary/0/path", "excitation.frequenc", "excitation.frequency"),
        ("/goal/vary/0/path", "", "required"),
        ("/goal/vary/0/values", "20 mm to 35 Hz", "not a unit of this field"),
        ("/goal/vary/0/values", "? to 35 Hz", "must begin with a number"),
        ("/goal/vary/0/values", "35 Hz to 35 Hz", "begins where it ends"),
        ("/goal/vary/1/values", "1 mm; 2 kg", "not a unit of this field"),
        ("/goal/vary/1/values", "", "has no values"),
        ("/goal/best/0/result", "eficiency", "efficiency"),
        ("/goal/best/1/result", "efficiency", "is a goal already"),
        ("/goal/subject_to/0/value", "3 mm", "N*m"),
        ("/goal/subject_to/0/value", "", "must begin with a number"),
        ("/goal/subject_to/0/result", "", "is required"),
        ("/goal/subject_to/1/within", "-1 %", "not a valid width"),
        ("/goal/subject_to/2/value", "steady", "not a valid choice"),
        ("/goal/at/0/values", "0.1 N*m; 3 mm", "not a unit of this field"),
        ("/goal/at/1/values", "9.81", "as many values as the first parameter, 2; got 1"),
        ("/goal/at/1/values", "", "is required"),
        ("/goal/at/1/path", "", "is required"),
        ("/goal/at/1/path", "shaft.load", "already"),
        ("/goal/population", "2", "out of range"),
        ("/goal/generations", "many", "whole number"),
        ("/goal/seed", "-1", "out of range"),
    ],
)
def test_each_fault_of_a_search_stands_beside_its_field(name: str, text: str, message: str) -> None:
    checked = check_form({**values_of(searching()), name: text}, Chunking())
    assert checked.preview is None
    assert message in " ".join(checked.faults[name]), checked.faults


def test_rows_that_are_not_filled_in_do_not_shift_the_faults() -> None:
    values = {"asks": "goal", "vary": "2", "/goal/vary/1/path": "shaft.load"}
    values |= {"subject_to": "3", "/goal/subject_to/2/value": "3", "at": "2", "/goal/at/1/path": "gravity"}
    assert field_of("/goal/vary/0/path", values) == "/goal/vary/1/path"
    assert field_of("/goal/vary/0", values) == "/goal/vary/1/values"
    assert field_of("/goal/subject_to/0/at_most", values) == "/goal/subject_to/2/value"
    assert field_of("/goal/at/0/gravity", values) == "/goal/at/1/values"
    assert [field_of(pointer, values) for pointer in ("/goal", "/goal/vary", "/goal/seed")] == [
        "/goal", "/goal/vary", "/goal/seed",
    ]  # fmt: skip


def test_a_search_without_rows_says_what_it_needs() -> None:
    values = values_of(searching()) | {"vary": "0", "best": "0", "subject_to": "0", "at": "0"}
    faults = check_form(values, Chunking()).faults
    assert "1 to 64 variables" in faults["/goal/vary"][0]
    faults = check_form(values | {"vary": "1"}, Chunking()).faults
    assert "asks for nothing" in faults["/goal"][0]


def test_rows_are_added_and_removed() -> None:
    values = values_of(searching())
    reshape(values, "drop-subject_to 0")
    reshape(values, "drop-vary 0")
    reshape(values, "drop-best 9")
    reshape(values, "add-at")
    goal = spec_of(values)[0]["goal"]
    assert (goal["subject_to"], goal["vary"]) == (GOAL["subject_to"][1:], GOAL["vary"][1:])
    assert (values["at"], values["best"], goal["at"]) == ("3", "2", GOAL["at"])
    for _ in range(9):
        reshape(values, "add-best")
    assert values["best"] == "8"


def test_the_form_is_filled_in_without_javascript(service: Service) -> None:
    """As its controls are sent, it asks for the same; another question keeps what was entered for the first one."""
    shown = Controls(service.http.get("/new?preset=fastest_drive").text).values
    spec = load_spec(preset_text("fastest_drive")[1], "toml")
    assert isinstance(spec, dict)
    settled = dict(shown)
    settle(settled)
    assert parse_spec(spec_of(settled)[0]).study.plan == parse_spec(spec).study.plan
    along = Controls(service.http.post("/new", data={**shown, "asks": "axes"}).text)
    assert "/axes/0/path" not in along.values
    assert "goal" not in spec_of(along.values)[0]
    more = service.http.post("/new", data={**along.values, "asks": "goal", "do": "add-subject_to"}).text
    again = Controls(more).values
    settle(again)
    assert again["subject_to"] == "3"
    assert parse_spec(spec_of(again)[0]).study.plan == parse_spec(spec).study.plan
    refused = service.http.post("/new", data={**again, "/goal/seed": "-1", "do": "submit"})
    assert refused.status_code == 422
    assert "out of range" in refused.text
    accepted = service.http.post("/new", data={**again, "do": "submit"}, follow_redirects=False)
    assert accepted.status_code == 303
    study = service.store.studies.study(accepted.headers["location"].rsplit("/", 1)[-1])
    assert study.plan == parse_spec(spec).study.plan


def test_an_empty_form_can_become_a_search(service: Service) -> None:
    shown = Controls(service.http.post("/new", data={**empty("vibration-drive"), "asks": "goal"}).text).values
    assert (shown["vary"], shown["best"], shown["/goal/best/0/toward"]) == ("1", "1", "max")
    assert (shown["/goal/population"], shown["/goal/polish"]) == ("100", "on")
    assert shown["axes"] == "0"


def test_limits_are_named_and_taken_in_the_units_of_the_reader(service: Service) -> None:
    limits = [
        {"result": "shaft.speed.mean", "is": 8, "within": "2 %"}, {"result": "efficiency", "at_least": 0.25},
        {"result": "torque.max", "at_most": 3},
    ]  # fmt: skip
    sent = {**empty("vibration-drive"), **values_of(searching(subject_to=limits)), "do": "check"}
    page = service.http.post("/new", data={**sent, "/goal/subject_to/0/value": "493"}).text
    assert ">Mean shaft speed (rpm)</option>" in page
    assert "Shaft speed mean" not in page
    shown = Controls(page).values
    assert shown["/goal/subject_to/0/value"] == "493 rpm"
    # What is not typed on the page, such as a spec, is in SI.
    shown = Controls(service.http.get("/new?preset=fastest_drive").text).values
    assert shown["/goal/subject_to/0/value"] == "3 N*m"
    values = values_of(searching(subject_to=limits))
    reading = Reading("vibration-drive", Units({"rad/s": "rpm", SHARE: "%"}))
    rendered = with_own_units(values, reading)
    assert [rendered[f"/goal/subject_to/{place}/value"] for place in range(3)] == ["8 rad/s", "25 %", "3"]
    with_shown_units(rendered, reading)
    rendered |= {"/goal/subject_to/1/value": "25"}
    with_shown_units(rendered, reading)
    assert parse_spec(spec_of(rendered)[0]).study.plan == parse_spec(searching(subject_to=limits)).study.plan


def test_undo_takes_limits_in_the_units_in_which_they_were_typed(service: Service) -> None:
    limits = [{"result": "shaft.speed.mean", "at_most": 8}]
    field = "/goal/subject_to/0/value"
    sent = {**empty("vibration-drive"), **values_of(searching(subject_to=limits)), "do": "undo", field: "400"}
    for before, now in (("300", "300 rpm"), ("300 rad/s", "300 rad/s"), ("inf", "inf"), ("1e400", "1e400")):
        history = json.dumps([{field: before}])
        answer = service.http.post("/new", data={**sent, "history": history})
        assert answer.status_code == 200
        assert Controls(answer.text).values[field].startswith(now)


def test_a_search_about_drives_has_fields_for_what_of_them_counts(service: Service) -> None:
    fields = Controls(service.http.get(f"/new?clone={service.submit(robust())}").text).values
    assert fields["/goal/best/0/statistic"] == "mean"
    assert fields["/goal/subject_to/0/deviations"] == "-3"
    assert fields["/goal/subject_to/1/quantile"] == "95 %"
    assert fields["/goal/subject_to/2/statistic"] == "deviation"
    assert fields["/goal/fresh_drives"] == "50"
    nominal = Controls(service.http.get(f"/new?clone={service.submit(searching())}").text).values
    assert "/goal/subject_to/0/deviations" not in nominal
    assert nominal["/goal/subject_to/0/value"]
