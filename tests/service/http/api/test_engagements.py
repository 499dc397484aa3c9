"""The engagements of a case over HTTP and through the client."""

from __future__ import annotations

import csv
import io
import re
from typing import Any

import pytest

from sprag_study.service.answers import results
from sprag_study.service.client import Client
from sprag_study.worker import models
from tests.service.conftest import API, PortalTransport, Service
from tests.service.shapes import fits


@pytest.fixture
def one_case(service: Service, spec: dict[str, Any]) -> str:
    """A study whose cases are quick to run."""
    spec["run"] = {"duration": "12 periods", "window": ["6 periods", "12 periods"]}
    return service.submit(spec)


def asked(service: Service, study_id: str, query: str = "", case: int = 4) -> Any:
    return service.http.get(f"{API}/studies/{study_id}/cases/{case}/engagements{query}")


def test_both_tables_as_json(service: Service, one_case: str) -> None:
    response = asked(service, one_case)
    assert response.status_code == 200, response.text
    body = response.json()
    fits(results.EngagementTables, body)
    assert (body["case"], body["regime"], body["ending"]) == (4, None, "ok")
    assert body["parameters"] == {"excitation.frequency": 25.5, "shaft.load": 0.1}
    assert (body["start"], body["end"]) == pytest.approx((6 / 25.5, 12 / 25.5))
    result = models.run_chunk(service.store.studies.study(one_case), 4, 1)
    row = dict(
        zip(
            [i.name for i in models.study_results(service.store.studies.study(one_case))], result.values[0], strict=True
        )
    )
    assert max(each["torque_max"] for each in body["engagements"]) == pytest.approx(row["torque.max"], rel=1e-12)
    assert max(each["windup_max"] for each in body["engagements"]) == pytest.approx(
        row["pendulums.0.windup.max"], rel=1e-9
    )
    assert all(each["torque_rate_max"] > 0.0 for each in body["engagements"])
    begun = [each["start"] > body["start"] for each in body["engagements"]]
    assert [each["impact_speed"] is not None for each in body["engagements"]] == begun
    work = sum(each["work_shaft"] for each in body["engagements"])
    assert work == pytest.approx(row["power.clutch.mean"] * 6 / 25.5, rel=1e-9)
    assert len(body["periods"]) == 12
    links = service.get(f"/studies/{one_case}/cases/4")["links"]
    assert service.http.get(links["engagements"]).json() == body


@pytest.mark.parametrize("table", ["engagements", "periods"])
def test_each_table_as_csv(service: Service, one_case: str, table: str) -> None:
    response = asked(service, one_case, f"?format=csv&table={table}")
    assert response.headers["content-disposition"].endswith(f'-case-4-{table}.csv"')
    rows = list(csv.DictReader(io.StringIO(response.text)))
    expected = asked(service, one_case).json()[table]
    assert rows
    assert list(rows[0]) == list(expected[0])
    assert [float(row["start"]) for row in rows] == [row["start"] for row in expected]
    by_accept = service.http.get(
        f"{API}/studies/{one_case}/cases/4/engagements?table={table}", headers={"Accept": "text/csv"}
    )
    assert by_accept.content == response.content


def test_of_a_settled_study_one_turn(service: Service, spec: dict[str, Any]) -> None:
    spec["run"] = {"until": "settled"}
    body = asked(service, service.submit(spec)).json()
    fits(results.EngagementTables, body)
    assert body["regime"] in models.REGIME_SENTENCES
    assert body["start"] == 0.0


def test_a_wrong_parameter_is_refused_with_what_is_allowed(service: Service, one_case: str) -> None:
    response = asked(service, one_case, "?table=clutches")
    assert response.status_code == 422
    (error,) = response.json()["errors"]
    assert (error["parameter"], error["value"], error["allowed"]) == ("table", "clutches", "engagements, periods")
    assert asked(service, one_case, case=10_000).status_code == 404
    assert service.computer.calls == []


def test_a_machine_without_clutches_has_no_engagements(service: Service) -> None:
    press = service.get("/presets/press")["spec"]
    study_id = service.submit(press)
    response = asked(service, study_id, case=0)
    assert response.status_code == 404
    assert response.json()["type"] == "/problems/not-found"
    assert "engagements" not in service.get(f"/studies/{study_id}/cases/0")["links"]
    page = service.http.get(f"/studies/{study_id}/cases/0?show=engagements")
    assert page.status_code == 404


def test_the_client_gives_the_same(service: Service, one_case: str, portal: Any) -> None:
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        assert client.study(one_case).engagements(4).data == asked(service, one_case).json()


def test_the_page_of_a_case_shows_the_table(service: Service, one_case: str) -> None:
    own = f"/studies/{one_case}/cases/4"
    assert f"{own}?show=engagements" in service.http.get(own).text
    table = service.http.get(f"{own}?show=engagements")
    assert table.status_code == 200, table.text
    rows = asked(service, one_case).json()["engagements"]
    body = table.text.partition('id="engagements"')[2].partition("<tbody>")[2].partition("</tbody>")[0]
    assert body.count("<tr>") == len(rows)
    for query in ("table=engagements&", "table=periods&", ""):
        assert re.search(rf'href="/api/v1{own}/engagements\?[^"]*', table.text), query
    assert "csv, periods" in table.text
