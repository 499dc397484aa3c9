"""Transients over HTTP, on their page and through the client."""

from __future__ import annotations

import csv
import io
import tomllib
from pathlib import Path
from typing import Any

import pytest
from pydantic import TypeAdapter

from sprag_study.engine.machine_shaft.transient_course import Course
from sprag_study.engine.machine_shaft.transients import transient
from sprag_study.service.answers.transients import Transient
from sprag_study.service.client import Client
from sprag_study.worker.models.common import case_machine
from sprag_study.worker.models.machine_shaft import spec_of
from tests.service.conftest import API, PortalTransport, Service
from tests.service.spec_sample import changed

EXAMPLES = Path(__file__).parents[4] / "examples"


def submitted(service: Service, example: str) -> str:
    return service.submit(tomllib.loads((EXAMPLES / example).read_text(encoding="utf-8")))


def asked(service: Service, study_id: str, query: str, case: int = 9) -> Any:
    return service.http.get(f"{API}/studies/{study_id}/cases/{case}/transient?{query}")


def test_a_transient_is_the_same_everywhere(service: Service, portal: Any) -> None:
    slotter = submitted(service, "slotter.toml")
    response = asked(service, slotter, "kind=load-step&load=1.5&angle=90 deg&points=11")
    assert response.status_code == 200, response.text
    body = response.json()
    TypeAdapter(Transient).validate_python(body)
    assert (body["kind"], body["load"], body["within"], body["torque"]) == ("load-step", 1.5, 0.01, None)
    study = service.store.studies.study(slotter)
    course = Course("load-step", 1.5, body["angle"])
    own = transient(spec_of(study.structure), case_machine(study, 9), course, 11)
    assert (body["outcome"], body["cause"]) == (own.outcome, own.cause)
    assert {name for name, value in body["results"].items() if value is None} == set()
    assert body["results"] == own.results
    assert body["values"]["omega"] == own.motion.values[:, own.motion.names.index("omega")].tolist()
    rows = list(csv.DictReader(io.StringIO(asked(service, slotter, "kind=coasting&points=7&format=csv").text)))
    assert (len(rows), float(rows[-1]["omega"])) == (7, 0.0)
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        assert client.study(slotter).transient(9, "load-step", load=1.5, angle="90 deg", points=11) == body
    assert service.get(f"/studies/{slotter}/cases/9")["links"]["transient"].endswith("/cases/9/transient")
    assert asked(service, slotter, "kind=run-up&within=0.05&format=svg").content.startswith(b"<?xml")


def test_the_page_has_a_form_results_and_a_figure(service: Service) -> None:
    slotter = submitted(service, "slotter.toml")
    own = f"/studies/{slotter}/cases/9"
    assert f"{own}?show=transient" in service.http.get(own).text
    page = service.http.get(f"{own}?show=transient").text
    assert "Factor on the load" in page
    assert "Driving torque of a run-up" not in page, "a motor gives it"
    assert "Stopped. The shaft stops after" in page
    refused = service.http.get(f"{own}?show=transient&kind=load-step")
    assert refused.status_code == 422
    assert "a load step needs the factor on the load after it" in refused.text


@pytest.mark.parametrize(
    ("example", "query", "where", "said"),
    [
        ("slotter.toml", "kind=sprint", "kind", "run-up, load-step, coasting"),
        ("slotter.toml", "kind=load-step", "load", "0 to 1e+06"),
        ("slotter.toml", "kind=coasting&load=-1", "load", "0 to 1e+06"),
        ("slotter.toml", "kind=coasting&angle=400 deg", "angle", "0 to 6.28319 rad"),
        ("slotter.toml", "kind=coasting&angle=4 kg", "angle", "a value in rad"),
        ("slotter.toml", "kind=run-up&within=0", "within", "1e-09 to 0.9"),
        ("slotter.toml", "kind=run-up&torque=5", "torque", "none"),
        ("slotter.toml", "kind=run-up&revolutions=0", "revolutions", "above 0 to 100000"),
        ("press.toml", "kind=run-up", "torque", "a torque in N*m above 0"),
        ("press.toml", "kind=coasting&torque=5", "torque", "none"),
    ],
)
def test_wrong_parameters_are_named(service: Service, example: str, query: str, where: str, said: str) -> None:
    refused = asked(service, submitted(service, example), query)
    assert refused.status_code == 422
    (fault,) = refused.json()["errors"]
    assert (fault["parameter"], fault["allowed"]) == (where, said)


def test_a_vibration_drive_has_none(service: Service) -> None:
    drive = service.submit(changed({}))
    assert asked(service, drive, "kind=coasting", 0).status_code == 404
    assert "transient" not in service.get(f"/studies/{drive}/cases/0")["links"]
    assert "transient" not in service.http.get(f"/studies/{drive}/cases/0").text


def test_a_press_is_run_up_by_a_torque(service: Service) -> None:
    """Case 45 of the press turns at 180 rpm: the torque does not depend on the speed, and the cycle is met exactly."""
    press = submitted(service, "press.toml")
    body = asked(service, press, "kind=run-up&torque=2 kN*m&points=3", 45).json()
    assert (body["outcome"], body["within"], body["torque"]) == ("reached", 0.0, 2000.0)
    assert body["results"]["motor.torque.max"] == pytest.approx(2000.0)
    assert body["results"]["after.omega.mean"] == pytest.approx(6.0 * 3.141592653589793)
