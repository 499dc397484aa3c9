"""The start-up of a case over HTTP and on its page."""

from __future__ import annotations

import csv
import io
from typing import Any

import numpy as np
import pytest

from sprag_study.engine.endings import Ending
from sprag_study.engine.outcome import Trajectory
from sprag_study.engine.vibration_drive.start_up import start_up_infos
from sprag_study.service.answers.start_ups import StartUp
from sprag_study.service.presets import preset_text
from sprag_study.service.reading.reader import Reading
from sprag_study.service.spec.document import load_spec, parse_spec
from sprag_study.service.views.case_view import CaseAnswer
from sprag_study.service.views.start_up import StartUpAnswer, StartUpView
from sprag_study.worker.models import ramps
from tests.service.conftest import API, Service
from tests.service.shapes import fits

RAMP = "ramp=10 periods&start_frequency=5&load_ramp=0.2 s&within=5 %&points=20"


@pytest.fixture
def one_case(service: Service, spec: dict[str, Any]) -> str:
    """A study whose cases are quick to run."""
    spec["run"] = {"duration": "12 periods", "window": ["6 periods", "12 periods"]}
    return service.submit(spec)


def asked(service: Service, study_id: str, query: str = "", case: int = 4) -> Any:
    return service.http.get(f"{API}/studies/{study_id}/cases/{case}/startup?{query}")


def test_every_form_has_the_same_numbers(service: Service, one_case: str) -> None:
    response = asked(service, one_case, RAMP)
    assert response.status_code == 200, response.text
    body = response.json()
    fits(StartUp, body)
    assert (body["ramp"], body["load_ramp"]) == (pytest.approx(10 / 25.5), 0.2)
    assert (body["start_frequency"], body["within"]) == (5.0, 0.05)
    assert body["results"].keys() == body["units"].keys() == body["meanings"].keys()
    assert body["results"]["balance.energy"] < 1e-8
    frequency = body["values"]["excitation.frequency"]
    assert (len(body["times"]), frequency[0], frequency[-1]) == (20, 5.0, 25.5)
    assert (body["values"]["load.factor"][0], body["values"]["load.factor"][-1]) == (0.0, 1.0)
    links = service.get(f"/studies/{one_case}/cases/4")["links"]
    assert service.http.get(f"{links['startup']}?{RAMP}").json() == body
    rows = list(csv.DictReader(io.StringIO(asked(service, one_case, f"{RAMP}&format=csv").text)))
    assert [float(row["shaft.speed"]) for row in rows] == body["values"]["shaft.speed"]
    picture = asked(service, one_case, f"{RAMP}&format=svg").text
    for title in ("excitation frequency", "factor on the load", "speed of the shaft", "clutch torque"):
        assert title in picture.lower()
    own = f"/studies/{one_case}/cases/4"
    assert f"{own}?show=startup" in service.http.get(own).text
    page = service.http.get(f"{own}?show=startup&{RAMP}").text
    assert "settled speed" in page


@pytest.mark.parametrize(
    ("query", "parameter", "allowed"),
    [
        ("ramp=-1", "ramp", "0 to 784.314 s"),
        ("ramp=20001 periods", "ramp", "0 to 784.314 s"),
        ("ramp=2 kg", "ramp", "a value in s"),
        ("start_frequency=30 Hz", "start_frequency", "0 to 25.5 Hz"),
        ("load_ramp=1e4", "load_ramp", "0 to 784.314 s"),
        ("within=0", "within", "above 0 to 0.5"),
    ],
)
def test_a_wrong_setting_is_refused_with_what_is_allowed(
    service: Service, one_case: str, query: str, parameter: str, allowed: str
) -> None:
    response = asked(service, one_case, query)
    assert response.status_code == 422
    (error,) = response.json()["errors"]
    assert (error["parameter"], error["allowed"]) == (parameter, allowed)
    assert service.computer.calls == []


def test_a_machine_shaft_has_none(service: Service) -> None:
    study_id = service.submit(service.get("/presets/press")["spec"])
    assert asked(service, study_id, case=0).status_code == 404
    assert "startup" not in service.get(f"/studies/{study_id}/cases/0")["links"]


def test_results_of_several_pendulums_say_of_which() -> None:
    motion = Trajectory(np.empty(0), (), (), np.empty((0, 0)), {}, Ending.OK)
    infos = start_up_infos(2)
    made = ramps.StartUp(True, "periodic", infos, {info.name: 1.0 for info in infos}, motion, Ending.OK)
    study = parse_spec(load_spec(preset_text("two_pendulums")[1], "toml")).study
    answer: StartUpAnswer = CaseAnswer(study, 0, (ramps.Ramps(), 20), made)
    (table,) = StartUpView().shown(answer).tables
    said = [Reading("vibration-drive").say(row[0]) for row in table.rows]
    assert len(set(said)) == len(said)
    assert "Pendulum 2: largest torque of the clutch on the way" in said
