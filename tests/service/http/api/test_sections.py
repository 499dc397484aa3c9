"""Bifurcation diagrams and Poincare sections over HTTP, on their page and through the client."""

from __future__ import annotations

import csv
import io
import math
from typing import Any

import pytest
from pydantic import TypeAdapter

from sprag_study.service.answers.sections import Sections
from sprag_study.service.client import Client
from tests.service.conftest import API, PortalTransport, Service
from tests.service.spec_sample import changed

LOADS = [0.1, 0.2, 0.3]


@pytest.fixture
def settled(service: Service) -> str:
    """25 Hz, 2 mm: a motion of order 2 at 0.2 N*m, of order 1 at 0.3 N*m."""
    return service.submit(changed({"/run": {"until": "settled"}, "/axes": [{"path": "shaft.load", "values": LOADS}]}))


def asked(service: Service, study_id: str, part: str) -> Any:
    return service.http.get(f"{API}/studies/{study_id}/cases/1/{part}")


def test_a_diagram_has_the_strobes_of_each_motion(service: Service, settled: str, portal: Any) -> None:
    query = "along=shaft.load&from=0.2&to=0.3&points=3&strobes=8"
    response = asked(service, settled, f"diagram?{query}")
    assert response.status_code == 200, response.text
    body = response.json()
    TypeAdapter(Sections).validate_python(body)
    assert (body["parameter"], body["order"]) == (pytest.approx([0.2, 0.25, 0.3]), [2, 1, 1])
    assert [len(strobes) for strobes in body["strobes"]["shaft.speed"]] == [2, 1, 1]
    # A motion that was found with strobes elsewhere in the period has them at the end of the period all the same.
    strobes = service.get(f"/studies/{settled}/cases/1/strobes")["strobes"]["values"]["shaft.speed"]
    assert sorted(body["strobes"]["shaft.speed"][0]) == pytest.approx(sorted(strobes[-2:]), rel=1e-6)
    rows = list(csv.DictReader(io.StringIO(asked(service, settled, f"diagram?{query}&format=csv").text)))
    assert [row["order"] for row in rows] == ["2", "2", "1", "1"]
    assert asked(service, settled, f"diagram?{query}&format=svg&y=pendulums.0.angle").content.startswith(b"<?xml")
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        study = client.study(settled)
        assert study.diagram(1, "shaft.load", 0.2, "0.3 N*m", points=3, strobes=8) == body


def test_a_section_is_taken_at_its_phase(service: Service, settled: str, portal: Any) -> None:
    body = asked(service, settled, "section?phase=90 deg&strobes=8").json()
    assert (body["along"], body["order"], body["phase"]) == ([], [2], pytest.approx(math.pi / 2.0))
    (angles,) = body["strobes"]["pendulums.0.angle"]
    orbit = service.get(f"/studies/{settled}/cases/1/strobes")["orbit"]
    quarters = [k for k, time in enumerate(orbit["times"][:-1]) if (time * 25.0) % 1.0 == pytest.approx(0.25, abs=1e-9)]
    exact = [orbit["values"]["pendulums.0.angle"][k] for k in quarters]
    assert sorted(angles) == pytest.approx(sorted(exact), abs=1e-8)
    assert asked(service, settled, "section?format=png").content.startswith(b"\x89PNG")
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        assert client.study(settled).section(1, "90 deg", strobes=8) == body


@pytest.mark.parametrize(
    ("part", "parameter", "code"),
    [
        ("section?phase=400 deg", "phase", "out-of-range"),
        ("section?phase=1 mm", "phase", "wrong-unit"),
        ("diagram?along=shaft.load&y=speed", "y", "invalid-choice"),
        ("diagram?along=shaft.inertia", "from", "required"),
        ("diagram?along=pendulums.0.initial_clutch&from=0&to=2", "along", "unknown-name"),
    ],
)
def test_what_cannot_be_drawn_is_refused(service: Service, settled: str, part: str, parameter: str, code: str) -> None:
    (error,) = asked(service, settled, part).json()["errors"]
    assert (error["parameter"], error["code"]) == (parameter, code)
    page = service.http.get(f"/studies/{settled}/cases/1?show=diagram&phase=400 deg")
    assert page.status_code == 422
