"""Branches over HTTP, on their page and through the client."""

from __future__ import annotations

import csv
import io
from typing import Any

import pytest
from pydantic import TypeAdapter

from sprag_study.service.answers.results import Branch
from sprag_study.service.client import Client
from tests.service.conftest import API, PortalTransport, Service
from tests.service.spec_sample import changed

LOADS = [0.215, 0.225, 0.23]


@pytest.fixture
def settled(service: Service) -> str:
    """25 Hz, 2 mm: the motion of order 1 at 0.225 N*m is unstable below 0.22299."""
    return service.submit(changed({"/run": {"until": "settled"}, "/axes": [{"path": "shaft.load", "values": LOADS}]}))


def asked(service: Service, study_id: str, query: str, case: int = 2) -> Any:
    return service.http.get(f"{API}/studies/{study_id}/cases/{case}/branch?{query}")


def test_a_branch_is_the_same_everywhere(service: Service, settled: str, portal: Any) -> None:
    response = asked(service, settled, "along=shaft.load")
    assert response.status_code == 200, response.text
    body = response.json()
    TypeAdapter(Branch).validate_python(body)
    assert (body["along"], body["low"], body["high"], body["value"]) == (["shaft.load"], 0.215, 0.23, 0.23)
    (doubling,) = body["specials"]
    assert (body["order"], doubling["kind"]) == (1, "doubling")
    assert doubling["parameter"] == pytest.approx(0.2229896, abs=1e-6)
    assert doubling["multipliers"][0] == pytest.approx([-1.0, 0.0], abs=1e-7)
    assert body["stable"] == [value > doubling["parameter"] for value in body["parameter"]]
    assert service.get(f"/studies/{settled}/cases/2")["links"]["branch"].endswith("/cases/2/branch")
    rows = list(csv.DictReader(io.StringIO(asked(service, settled, "along=shaft.load&format=csv").text)))
    assert [float(row["shaft.load"]) for row in rows] == body["parameter"]
    assert [row["stable"] == "true" for row in rows] == body["stable"]
    assert [row["special"] for row in rows if row["special"]] == ["doubling"]
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        assert client.study(settled).branch(2, "shaft.load", 0.215, "0.23 N*m") == body
    assert asked(service, settled, "along=shaft.load&format=svg").content.startswith(b"<?xml")


def test_the_page_has_a_form_and_the_figure(service: Service, settled: str) -> None:
    own = f"/studies/{settled}/cases/2"
    assert f'href="{own}?show=branch#branch"' in service.http.get(own).text
    service.fill(settled)
    page = service.http.get(f"{own}?show=branch").text
    assert '<option value="shaft.load" selected>Load torque</option>' in page
    assert "doubling at 0.2229" in page
    for case in range(3):
        assert f'data-case="{case}"' in page or f"/cases/{case}" in page, "the cases of the study are in the figure"
    refused = service.http.get(f"{own}?show=branch&along=shaft.lode")
    assert refused.status_code == 422
    assert "is not a numeric parameter of the study" in refused.text


@pytest.mark.parametrize(
    ("query", "parameter", "code"),
    [
        ("along=shaft.lode", "along", "unknown-name"),
        ("along=", "along", "required"),
        ("along=shaft.inertia", "from", "required"),
        ("along=shaft.inertia,shaft.load", "along", "conflict"),
        ("along=shaft.load&from=0.225&to=0.228", "from", "invalid-range"),
        ("along=shaft.load&from=-1", "from", "out-of-range"),
        ("along=shaft.load&to=2 mm", "to", "wrong-unit"),
        ("along=shaft.load&y=speed", "y", "invalid-choice"),
        ("along=shaft.initial_speed", "along", "conflict"),
    ],
)
def test_what_cannot_be_followed_is_refused(
    service: Service, settled: str, query: str, parameter: str, code: str
) -> None:
    (error,) = asked(service, settled, query).json()["errors"]
    assert (error["parameter"], error["code"]) == (parameter, code)


def test_a_case_of_a_sweep_has_the_motion_of_the_sweep(service: Service) -> None:
    axis = {"path": "shaft.load", "values": [0.225, 0.23], "sweep": "both"}
    study_id = service.submit(changed({"/run": {"until": "settled"}, "/axes": [axis]}))
    body = asked(service, study_id, "along=shaft.load", case=1).json()
    assert (body["order"], body["value"], body["specials"]) == (1, 0.225, [])
    section = service.get(f"/studies/{study_id}/cases/1/section")
    assert (section["order"], len(section["strobes"]["shaft.speed"][0])) == ([1], 1)
    service.fill(study_id)


def test_a_case_without_an_orbit_has_a_note(service: Service) -> None:
    still = {"path": ["excitation.amplitude_x", "excitation.amplitude_y"], "values": [0.0]}
    study_id = service.submit(changed({"/run": {"until": "settled"}, "/axes": [still]}))
    body = asked(service, study_id, "along=shaft.load&from=0.1&to=0.3", case=0).json()
    assert (body["order"], body["parameter"]) == (None, [])
    assert body["note"].startswith("the case has no periodic motion of a turning shaft")
