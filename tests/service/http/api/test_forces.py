"""The forces of a case over HTTP, through the client and on its page."""

from __future__ import annotations

import csv
import io
from dataclasses import replace
from typing import Any

import pytest

from sprag_study.service.answers.forces import Forces
from sprag_study.service.client import Client
from sprag_study.service.views.case_questions import ForcesQuestion
from sprag_study.service.views.case_view import see
from sprag_study.service.views.forces import ForcesView
from sprag_study.worker import models
from tests.service.conftest import API, PortalTransport, Service
from tests.service.shapes import fits

BEARING = "shaft_mass=500 g&load_rating=12 kN&bearing=roller&share=50 %&points=20"


@pytest.fixture
def one_case(service: Service, spec: dict[str, Any]) -> str:
    """A study whose cases are quick to run."""
    spec["run"] = {"duration": "12 periods", "window": ["6 periods", "12 periods"]}
    return service.submit(spec)


def asked(service: Service, study_id: str, query: str = "", case: int = 4) -> Any:
    return service.http.get(f"{API}/studies/{study_id}/cases/{case}/forces?{query}")


def test_results_and_forces_over_time_as_json(service: Service, one_case: str) -> None:
    response = asked(service, one_case, BEARING)
    assert response.status_code == 200, response.text
    body = response.json()
    fits(Forces, body)
    assert (body["case"], body["regime"], body["ending"]) == (4, None, "ok")
    assert (body["start"], body["end"]) == pytest.approx((6 / 25.5, 12 / 25.5))
    assert (body["shaft_mass"], body["load_rating"], body["share"]) == (0.5, 12000.0, 0.5)
    assert body["exponent"] == pytest.approx(10 / 3)
    assert body["results"].keys() == body["units"].keys() == body["meanings"].keys()
    assert body["results"]["bearing.load.max"] == pytest.approx(0.5 * body["results"]["table.force.max"])
    assert body["results"]["bearing.rating_life.revolutions"] > 1e9
    assert len(body["times"]) == len(body["values"]["table.force_x"]) == 20
    assert body["variables"]["table.force_x"] == {"unit": "N"}
    links = service.get(f"/studies/{one_case}/cases/4")["links"]
    assert service.http.get(f"{links['forces']}?{BEARING}").json() == body


def test_each_table_as_csv_and_a_picture(service: Service, one_case: str) -> None:
    body = asked(service, one_case, BEARING).json()
    results = asked(service, one_case, f"{BEARING}&format=csv")
    assert results.headers["content-disposition"].endswith('-case-4-forces.csv"')
    rows = list(csv.DictReader(io.StringIO(results.text)))
    assert [row["result"] for row in rows] == list(body["results"])
    assert {row["result"]: float(row["value"]) for row in rows if row["value"]} == body["results"]
    times = asked(service, one_case, f"{BEARING}&format=csv&table=forces")
    rows = list(csv.DictReader(io.StringIO(times.text)))
    assert [float(row["table.force_y"]) for row in rows] == body["values"]["table.force_y"]
    assert "<svg" in asked(service, one_case, "format=svg").text


def test_of_a_settled_study_one_turn(service: Service, spec: dict[str, Any]) -> None:
    spec["run"] = {"until": "settled"}
    body = asked(service, service.submit(spec)).json()
    fits(Forces, body)
    assert body["regime"] in models.REGIME_SENTENCES
    assert body["start"] == 0.0
    assert body["load_rating"] is None
    assert body["results"]["bearing.rating_life.time"] is None


@pytest.mark.parametrize(
    ("query", "parameter", "allowed"),
    [
        ("share=1.5", "share", "above 0 to 1"),
        ("load_rating=12 kg", "load_rating", "a value in N"),
        ("shaft_mass=-1", "shaft_mass", "0 to 1e+06 kg"),
        ("bearing=needle", "bearing", "ball, roller"),
        ("table=springs", "table", "results, forces"),
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


def test_a_machine_without_a_table_has_no_forces(service: Service) -> None:
    study_id = service.submit(service.get("/presets/press")["spec"])
    assert asked(service, study_id, case=0).status_code == 404
    assert "forces" not in service.get(f"/studies/{study_id}/cases/0")["links"]
    assert service.http.get(f"/studies/{study_id}/cases/0?show=forces").status_code == 404


def test_the_client_gives_the_same(service: Service, one_case: str, portal: Any) -> None:
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        assert client.study(one_case).forces(4, share=0.5) == asked(service, one_case, "share=0.5").json()


def test_the_page_of_a_case_shows_them(service: Service, one_case: str) -> None:
    own = f"/studies/{one_case}/cases/4"
    assert f"{own}?show=forces" in service.http.get(own).text
    text = service.http.get(f"{own}?show=forces&load_rating=12+kN").text
    assert "The basic rating life of the bearing is" in text
    for title in ("Forces on the table", "Power of the vibration", "Springs", "Bearing of the shaft"):
        assert title in text
    assert "csv, forces over time" in text
    assert "residual" not in text.partition('id="forces"')[2]
    text = service.http.get(f"{own}?show=forces&load_rating=12+kN", headers={"Accept-Language": "uk"}).text
    assert "Номінальний ресурс підшипника: " in text


def test_a_motion_without_an_orbit_is_said_to_have_none(service: Service, one_case: str) -> None:
    study, view = service.store.studies.study(one_case), ForcesView()
    answer = see(study, 4, view, view.choose(study, 4, ForcesQuestion()), None)
    irregular = replace(answer, result=replace(answer.result, regime="irregular"))
    assert view.shown(irregular).sentences[0] == models.REGIME_SENTENCES["irregular"]
    assert view.shown(irregular).sentences[1:] == view.shown(answer).sentences
