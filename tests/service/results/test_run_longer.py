"""Cases that have not settled are run longer: a new study of them, by the API, the client, the command and the page."""

from __future__ import annotations

from typing import Any

import pytest

from sprag_study.service.client import Client
from tests.service.conftest import API, PortalTransport, Service
from tests.service.results.conftest import Linked
from tests.service.results.settled import flagged
from tests.service.spec_sample import changed


def test_unsettled_cases_are_run_longer(service: Service, study_id: str) -> None:
    made = service.http.post(f"{API}/studies/{study_id}:longer")
    assert made.status_code == 202, made.text
    assert made.json()["cases"] == 1
    old, new = service.store.studies.study(study_id), service.store.studies.study(made.json()["id"])
    assert new.columns([0]) == old.columns([3])
    assert new.run == old.run | {"at_most": 4000}
    assert new.base == old.base
    assert new.name == f"{old.name}, longer"


def test_other_regimes_and_times_are_asked_for(service: Service, study_id: str) -> None:
    query: dict[str, str] = {"regime": "irregular", "at_most": "20000"}
    key = {"Idempotency-Key": "once"}
    made = [service.http.post(f"{API}/studies/{study_id}:longer", params=query, headers=key).json() for _ in range(2)]
    assert made[0]["id"] == made[1]["id"]
    new = service.store.studies.study(made[0]["id"])
    assert (new.cases, new.run["at_most"]) == (1, 20_000)
    assert new.case_parameters(0) == service.store.studies.study(study_id).case_parameters(1)


def test_what_cannot_be_run_longer_is_refused(service: Service, study_id: str) -> None:
    timed = service.submit(changed({"/run": {"duration": "60 periods"}}))
    for study, query in ((study_id, {"regime": "held"}), (timed, {}), (study_id, {"at_most": "99"})):
        response = service.http.post(f"{API}/studies/{study}:longer", params=query)
        assert response.status_code == 422
        assert response.json()["errors"][0]["parameter"] in query or not query


@pytest.mark.parametrize(
    ("run", "query", "longer"),
    [
        ({"duration": "60 periods"}, {}, {"duration": [240.0, "periods"], "window": None}),
        (
            {"duration": "60 periods", "window": ["30 periods", "50 periods"]},
            {"at_most": 500},
            {"duration": [500.0, "periods"], "window": [[480.0, "periods"], [500.0, "periods"]]},
        ),
        (
            {"duration": "2 s", "window": ["1.5 s", "2 s"], "tolerance": 1e-8},
            {},
            {"duration": [8.0, "s"], "window": [[7.5, "s"], [8.0, "s"]], "tolerance": 1e-8},
        ),
        (
            {"duration": "2 s", "window": ["1.5 s", "2 s"]}, {"at_most": 300},
            {"duration": [300.0, "periods"], "window": None},
        ),
    ],
)  # fmt: skip
def test_runs_of_a_given_time_that_had_not_settled_are_run_longer(
    service: Service, portal: Any, run: dict[str, Any], query: dict[str, int], longer: dict[str, Any]
) -> None:
    timed = flagged(service, run)
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        new = service.store.studies.study(client.study(timed).run_longer(**query).id)
    assert new.columns([0, 1])["shaft.load"].tolist() == [0.2, 0.7]
    assert new.run == {"tolerance": 1e-9, "reset": "contact"} | longer
    refused = service.http.post(f"{API}/studies/{timed}:longer", params={"regime": "unsettled"})
    assert refused.json()["errors"][0]["parameter"] == "regime"


def test_the_command_runs_longer_what_the_button_does(
    service: Service, study_id: str, linked: Linked, sprag: Any
) -> None:
    timed = flagged(service, {"duration": "60 periods"})
    linked("extend")
    for study, at_most in ((study_id, 2000), (timed, 500)):
        done = sprag("study", "longer", study, "--at-most", at_most, "--json")
        assert done.code == 0, done.err
        new = service.store.studies.study(done.data["id"])
        assert new.run.get("at_most", new.run.get("duration")) in (2000, [500.0, "periods"])
        assert new.cases == {study_id: 1, timed: 2}[study]
    shown = [service.http.post(f"/studies/{timed}/longer/not_settled").headers["location"] for _ in range(2)]
    assert shown[0] == shown[1]
    assert f'action="/studies/{timed}/longer/not_settled"' in service.http.get(f"/studies/{timed}").text
    assert service.http.post(f"/studies/{timed}/longer/windup_out_of_data").status_code == 404


def test_the_page_of_a_study_has_a_button_that_runs_cases_longer(service: Service, study_id: str) -> None:
    address = f"/studies/{study_id}/longer/unsettled"
    page = service.http.get(f"/studies/{study_id}").text
    assert f'action="{address}"' in page
    assert f'action="/studies/{study_id}/longer/periodic"' not in page
    shown = [service.http.post(address).headers["location"] for _ in range(2)]
    assert shown[0] == shown[1]
    assert service.store.studies.study(shown[0].rpartition("/")[2]).run["at_most"] == 4000
    assert service.http.post(f"/studies/{study_id}/longer/held").status_code == 404
