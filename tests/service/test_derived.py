"""A study with a derived parameter on the API, the pages and the report: shown as such, and never an axis."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from tests.service.conftest import Service

INERTIA = "pendulums.0.inertia"
FORMULA = "1.1 * pendulums.0.mass * pendulums.0.arm^2 + 2e-4 kg*m^2"
STORED = "1.1 * pendulums.0.mass * pendulums.0.arm^2 + 0.0002"


@pytest.fixture
def filled(service: Service, spec: dict[str, Any]) -> tuple[Service, str]:
    """A finished study of four cases."""
    del spec["base"]["pendulums"][0]["inertia"]
    spec["derive"] = {INERTIA: FORMULA}
    spec["axes"] = [
        {"path": "pendulums.0.mass", "values": [0.6, 0.5]},
        {"path": "shaft.load", "values": [0.1, 0.3]},
    ]
    study_id = service.submit(spec)
    service.fill(study_id)
    return service, study_id


def test_a_derived_value_is_shown_as_such(filled: tuple[Service, str]) -> None:
    service, study_id = filled
    detail = service.get(f"/studies/{study_id}")
    assert (detail["derive"], detail["spec"]["derive"]) == ({INERTIA: STORED}, {INERTIA: FORMULA})
    assert [axis["paths"] for axis in detail["axes"]] == [["pendulums.0.mass"], ["shaft.load"]]
    case = service.get(f"/studies/{study_id}/cases/2")
    assert case["parameters"] == {
        "pendulums.0.mass": 0.5, "shaft.load": 0.1, INERTIA: pytest.approx(1.1 * 0.5 * 0.03**2 + 2e-4, rel=1e-15),
    }  # fmt: skip
    own = f"/studies/{study_id}"
    in_words = "1.1 · (mass) · (arm of the mass)² + 0.0002 kg·m²"
    for page, formula in ((own, in_words), (f"{own}/cases/2", STORED)):
        text = service.http.get(page).text
        assert re.search(rf'title="{INERTIA}[^"]*">Inertia <small class="soft">\(derived\)</small>', text)
        assert formula in text.replace("\N{NO-BREAK SPACE}", " ").replace("&nbsp;", " ")
    assert '<td class="num">derived</td>' in service.http.get(own).text
    rows = service.http.get(f"{own}/rows", params={"sort": INERTIA}).text
    assert re.search(r'aria-sort="ascending"><a [^>]*>Inertia</a>', rows)
    # The first two cases have the larger mass, and therefore the larger inertia.
    assert re.findall(r'<tr data-case="(\d+)"', rows) == ["2", "3", "0", "1"]
    report = service.http.get(f"/api/v1{own}/report", params={"names": "codes", "appendix": "inputs"}).text
    assert f'<th scope="row">{INERTIA}</th><td class="number">= {FORMULA}</td>' in report
    assert "<td>derived</td>" in report
    assert service.http.get(f"/api/v1{own}/report", params={"format": "pdf"}).status_code == 200
    assert service.http.get(f"/new?clone={study_id}").text.count(f'value="= {FORMULA}"') == 1


def test_it_is_no_axis(filled: tuple[Service, str]) -> None:
    service, study_id = filled
    for params in ({"x": INERTIA}, {"x": "shaft.load", "at": f"{INERTIA}=7e-4"}):
        response = service.http.get(f"/api/v1/studies/{study_id}/curves", params={"y": "shaft.speed.mean", **params})
        assert response.status_code == 422
        (error,) = response.json()["errors"]
        assert (error["code"], "derived" in str(error)) == ("not-an-axis", True)
    curves = service.get(f"/studies/{study_id}/curves", x="shaft.load", y="shaft.speed.mean", by="pendulums.0.mass")
    assert len(curves["curves"]) == 2


def test_it_is_extended_with_its_formula(filled: tuple[Service, str]) -> None:
    service, study_id = filled
    addition = {"axes": [{"path": "pendulums.0.mass", "values": [0.7]}]}
    answer = service.http.post(f"/api/v1/studies/{study_id}:extend", json=addition)
    assert answer.status_code == 202, answer.text
    wider = service.store.studies.study(answer.json()["id"])
    assert (wider.cases, wider.derive) == (6, {INERTIA: STORED})
    assert service.store.reuse.count(wider) == 4


def test_it_is_scheduled(filled: tuple[Service, str]) -> None:
    service, study_id = filled
    given = {"name": "nightly", "cron": "0 2 * * *", "zone": "UTC", "spec": service.store.studies.spec(study_id)}
    kept = service.http.post("/api/v1/schedules", json=given)
    assert kept.status_code == 201, kept.text
    given["spec"]["derive"] = {INERTIA: "2 * pendulums.0.mass"}
    refused = service.http.post("/api/v1/schedules", json=given)
    assert refused.status_code == 422
    assert [error["code"] for error in refused.json()["errors"]] == ["wrong-unit"]
