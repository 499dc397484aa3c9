"""What the clutches of a case have to bear, over HTTP, on the page and through the client."""

from __future__ import annotations

import csv
import io
from dataclasses import replace
from typing import Any

import pytest

from sprag_study.service.answers import results
from sprag_study.service.client import Client
from sprag_study.service.views.case_questions import DutyQuestion
from sprag_study.service.views.case_view import see
from sprag_study.service.views.duty import DutyView
from sprag_study.worker import models
from tests.service.conftest import API, PortalTransport, Service
from tests.service.shapes import fits


@pytest.fixture
def one_case(service: Service, spec: dict[str, Any]) -> str:
    """A study whose cases are quick to run."""
    spec["run"] = {"duration": "12 periods", "window": ["6 periods", "12 periods"]}
    return service.submit(spec)


def asked(service: Service, study_id: str, query: str = "", case: int = 4) -> Any:
    return service.http.get(f"{API}/studies/{study_id}/cases/{case}/duty{query}")


def test_both_tables_as_json(service: Service, one_case: str) -> None:
    response = asked(service, one_case, "?exponent=5")
    assert response.status_code == 200, response.text
    body = response.json()
    fits(results.DutyTables, body)
    assert (body["case"], body["regime"], body["exponent"], body["ending"]) == (4, None, 5.0, "ok")
    result = models.run_chunk(service.store.studies.study(one_case), 4, 1)
    names = [info.name for info in models.study_results(service.store.studies.study(one_case))]
    row = dict(zip(names, result.values[0], strict=True))
    (clutch,) = body["clutches"]
    assert clutch["torque_max"] == pytest.approx(row["torque.max"], rel=1e-12)
    per_hour = row["clutches.engagements_per_period"] * 25.5 * 3600.0
    assert clutch["engagements_per_hour"] == pytest.approx(per_hour)
    assert 0.0 < clutch["torque_equivalent"] <= clutch["torque_max"]
    assert sum(cycle["per_hour"] for cycle in body["cycles"]) == pytest.approx(clutch["cycles_per_hour"])
    links = service.get(f"/studies/{one_case}/cases/4")["links"]
    plain = service.http.get(links["duty"]).json()
    assert plain["exponent"] is plain["clutches"][0]["torque_equivalent"] is None
    assert plain["cycles"] == body["cycles"]


@pytest.mark.parametrize("table", ["clutches", "cycles"])
def test_each_table_as_csv(service: Service, one_case: str, table: str) -> None:
    response = asked(service, one_case, f"?format=csv&table={table}")
    assert response.headers["content-disposition"].endswith(f'-case-4-duty-{table}.csv"')
    rows = list(csv.DictReader(io.StringIO(response.text)))
    expected = asked(service, one_case).json()[table]
    assert [list(row) for row in rows] == [list(row) for row in expected]
    assert [float(row["clutch"]) for row in rows] == [row["clutch"] for row in expected]


def test_of_a_settled_study_one_turn(service: Service, spec: dict[str, Any]) -> None:
    spec["run"] = {"until": "settled"}
    body = asked(service, service.submit(spec)).json()
    fits(results.DutyTables, body)
    assert body["regime"] in models.REGIME_SENTENCES
    assert all(cycle["count"] == round(cycle["count"]) for cycle in body["cycles"])


@pytest.mark.parametrize("exponent", ["0", "-1", "101", "steep", "3 mm"])
def test_an_exponent_that_is_none_is_refused(service: Service, one_case: str, exponent: str) -> None:
    response = asked(service, one_case, f"?exponent={exponent}")
    assert response.status_code == 422
    (error,) = response.json()["errors"]
    assert (error["parameter"], error["value"]) == ("exponent", exponent)


def test_a_machine_without_clutches_has_no_duty(service: Service) -> None:
    study_id = service.submit(service.get("/presets/press")["spec"])
    assert asked(service, study_id, case=0).status_code == 404
    assert "duty" not in service.get(f"/studies/{study_id}/cases/0")["links"]
    assert service.http.get(f"/studies/{study_id}/cases/0?show=duty").status_code == 404


def test_the_client_gives_the_same(service: Service, one_case: str, portal: Any) -> None:
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        duty = client.study(one_case).duty(4, exponent=3)
        assert duty.data == asked(service, one_case, "?exponent=3").json()
        assert repr(duty) == "Duty(case 4: 1 clutches)"
        assert duty.to_pandas()["torque_max"].tolist() == [duty.data["clutches"][0]["torque_max"]]
        assert duty.to_pandas().attrs["units"]["torque_rate_max"] == "N*m/s"
        assert len(duty.cycles()) == len(duty.data["cycles"])


def test_the_page_of_a_case_shows_the_tables(service: Service, one_case: str) -> None:
    own = f"/studies/{one_case}/cases/4"
    assert f"{own}?show=duty" in service.http.get(own).text
    page = service.http.get(f"{own}?show=duty&exponent=5")
    assert page.status_code == 200, page.text
    shown = page.text.partition('id="duty"')[2]
    assert "rainflow method" in shown
    assert "Equivalent torque (N·" in shown
    assert 'name="exponent"' in shown
    for table in ("clutches", "cycles"):
        assert f"csv, {table}" in shown
    assert service.http.get(f"{own}?show=duty&exponent=steep").status_code == 422
    plain = service.http.get(f"{own}?show=duty").text.partition('id="duty"')[2]
    assert "rainflow method" in plain
    assert "quivalent torque" not in plain.replace("for the equivalent torque", "")


def test_a_motion_without_an_orbit_is_said_to_have_none(service: Service, one_case: str) -> None:
    study, view = service.store.studies.study(one_case), DutyView()
    answer = see(study, 4, view, view.choose(study, 4, DutyQuestion()), None)
    irregular = replace(answer, result=replace(answer.result, regime="irregular"))
    assert view.shown(irregular).sentences[0] == models.REGIME_SENTENCES["irregular"]
    assert view.shown(irregular).sentences[1:] == view.shown(answer).sentences
