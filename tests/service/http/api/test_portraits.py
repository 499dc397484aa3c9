"""The strobes of a case and its orbit over HTTP, through the client and on the page of the case."""

from __future__ import annotations

import csv
import io
from typing import Any

import pytest
from pydantic import TypeAdapter

from sprag_study.service.answers.results import Portrait
from sprag_study.service.client import Client
from tests.service.conftest import API, PortalTransport, Service
from tests.service.spec_sample import changed


@pytest.fixture
def settled(service: Service) -> str:
    """A study of one settled case of period 2: 25 Hz, 2 mm, 0.2 N*m."""
    return service.submit(changed({"/run": {"until": "settled"}, "/axes": [{"path": "shaft.load", "values": [0.2]}]}))


def asked(service: Service, study_id: str, query: str = "", case: int = 0) -> Any:
    return service.http.get(f"{API}/studies/{study_id}/cases/{case}/strobes{query}")


def test_strobes_and_orbit_as_json_and_csv(service: Service, settled: str) -> None:
    response = asked(service, settled)
    assert response.status_code == 200, response.text
    body = response.json()
    TypeAdapter(Portrait).validate_python(body)
    assert (body["regime"], body["order"], body["ending"]) == ("periodic", 2, "ok")
    turn = body["orbit"]["times"]
    assert (turn[0], turn[-1]) == pytest.approx((0.0, 2 / 25.0))
    links = service.get(f"/studies/{settled}/cases/0")["links"]
    assert service.http.get(links["strobes"]).json() == body
    for table in ("strobes", "orbit"):
        response = asked(service, settled, f"?format=csv&table={table}")
        assert response.headers["content-disposition"].endswith(f'-case-0-{table}.csv"')
        rows = list(csv.DictReader(io.StringIO(response.text)))
        assert [float(row["shaft.speed"]) for row in rows] == body[table]["values"]["shaft.speed"]
        assert [row["pendulums.0.state"] for row in rows] == body[table]["states"]["pendulums.0"]


def test_a_run_of_a_given_time_has_strobes_only(service: Service, spec: dict[str, Any], portal: Any) -> None:
    spec["run"] = {"duration": "12 periods"}
    study_id = service.submit(spec)
    body = asked(service, study_id, case=4).json()
    assert (body["regime"], body["order"], body["orbit"]) == (None, None, None)
    assert body["strobes"]["times"] == pytest.approx([k / 25.5 for k in range(1, 13)])
    assert asked(service, study_id, "?format=svg", case=4).status_code == 200
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        assert client.study(study_id).strobes(4) == body


@pytest.mark.parametrize(("form", "start"), [("svg", b"<?xml"), ("png", b"\x89PNG"), ("pdf", b"%PDF")])
def test_pictures(service: Service, settled: str, form: str, start: bytes) -> None:
    response = asked(service, settled, f"?format={form}")
    assert response.status_code == 200, response.text
    assert response.content.startswith(start)


def test_what_there_is_none_of_is_refused(service: Service, settled: str) -> None:
    (error,) = asked(service, settled, "?table=points").json()["errors"]
    assert (error["parameter"], error["value"], error["allowed"]) == ("table", "points", "strobes, orbit")
    press = service.submit(service.get("/presets/press")["spec"])
    assert asked(service, press).status_code == 404
    assert service.http.get(f"/studies/{press}/cases/0?show=strobes").status_code == 404
    assert "strobes" not in service.get(f"/studies/{press}/cases/0")["links"]
    assert "strobes" not in service.http.get(f"/studies/{press}/cases/0").text
