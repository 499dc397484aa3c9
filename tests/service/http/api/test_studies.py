"""Studies over HTTP: submit, preview, list, look at, hold, cancel, delete."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import datetime
from typing import TYPE_CHECKING, Any

import pytest

from sprag_study.service.answers import studies
from sprag_study.service.http.api.examples import SPEC_TOML
from sprag_study.service.storage.work.room import RESERVE_BYTES, Room
from tests.service.shapes import fits
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from conftest import Service

API = "/api/v1"
STUDIES = f"{API}/studies"


def test_a_study_is_accepted_and_found_where_it_says(service: Service) -> None:
    response = service.http.post(STUDIES, json=SPEC)
    assert response.status_code == 202
    body = response.json()
    fits(studies.StudySummary, body)
    assert (body["state"], body["cases"], body["progress"]) == ("queued", 9, {"total": 9, "done": 0, "ok": 0})
    assert response.headers["location"] == f"{STUDIES}/{body['id']}" == body["links"]["self"]
    shown = service.get(f"/studies/{body['id']}")
    fits(studies.StudyDetail, shown)
    assert shown["spec"] == SPEC
    assert shown["axes"][1] == {"paths": ["shaft.load"], "unit": "N*m", "values": 3, "first": 0.02, "last": 0.3,
                                "least": 0.02, "largest": 0.3}  # fmt: skip
    assert datetime.fromisoformat(shown["created_at"]).tzinfo is not None
    assert shown["progress"]["seconds_left"] is None
    assert shown["finished_at"] is None


def test_every_link_of_a_study_leads_somewhere(service: Service) -> None:
    study_id = service.submit()
    links = service.get(f"/studies/{study_id}")["links"]
    service.fill(study_id)
    assert service.http.post(links.pop("cancel")).status_code == 409
    for name, address in links.items():
        needs_axes = name in ("map", "sensitivity")
        assert service.http.get(address).status_code == (422 if needs_axes else 200), name


def test_toml_is_taken_too(service: Service) -> None:
    response = service.http.post(STUDIES, content=SPEC_TOML, headers={"Content-Type": "application/toml"})
    assert response.status_code == 202
    assert response.json()["cases"] == 3


def test_an_idempotency_key_submits_once(service: Service) -> None:
    first = service.submit(None, **{"Idempotency-Key": "k-1"})
    turned = json.dumps(dict(reversed(SPEC.items())), indent=3)
    again = service.http.post(
        STUDIES, content=turned, headers={"Idempotency-Key": "k-1", "Content-Type": "application/json; charset=UTF-8"}
    )
    assert again.status_code == 202
    assert again.json()["id"] == first
    assert len(service.get("/studies")["studies"]) == 1
    assert service.submit(None, **{"Idempotency-Key": "k-2"}) != first
    other = service.http.post(STUDIES, json={**SPEC, "name": "other"}, headers={"Idempotency-Key": "k-1"})
    assert other.status_code == 422
    assert other.json()["type"] == "/problems/idempotency-conflict"


@pytest.mark.parametrize("key", ["", "a b", "x" * 201, "caf\u00e9"])
def test_a_useless_idempotency_key_is_refused(service: Service, key: str) -> None:
    headers = {"Idempotency-Key": key.encode("latin-1")}
    response = service.http.post(STUDIES, json=SPEC, headers=headers)
    assert response.status_code == 422
    (error,) = response.json()["errors"]
    assert error["parameter"] == "Idempotency-Key"
    assert "[!-~]" not in response.text
    if key in ("a b", "caf\u00e9"):
        assert error["code"] == "invalid-text"


def test_two_keys_are_one_too_many(service: Service) -> None:
    keys = [("Idempotency-Key", "a"), ("Idempotency-Key", "b")]
    response = service.http.post(STUDIES, json=SPEC, headers=keys)
    assert response.status_code == 422
    (error,) = response.json()["errors"]
    assert (error["parameter"], error["code"]) == ("Idempotency-Key", "repeated")
    assert service.get("/studies")["studies"] == []


def test_studies_are_listed_in_pages_newest_first(service: Service, spec: dict[str, Any]) -> None:
    made = [service.submit({**spec, "name": f"study {number}"}) for number in range(5)]
    service.fill(made[2])
    seen: list[str] = []
    token: str | None = None
    while True:
        page = service.get("/studies", page_size=2, **({"page_token": token} if token else {}))
        fits(studies.StudyPage, page)
        seen += [study["id"] for study in page["studies"]]
        token = page["next_page_token"]
        if token is None:
            break
    assert seen == made[::-1]
    assert [study["id"] for study in service.get("/studies", state="finished")["studies"]] == [made[2]]


def test_a_finished_study_shows_its_counts_and_keeps_its_tag(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id, range(2))
    running = service.http.get(f"{STUDIES}/{study_id}")
    assert running.json()["progress"]["done"] == 2
    service.fill(study_id)
    done = service.http.get(f"{STUDIES}/{study_id}", headers={"If-None-Match": running.headers["etag"]})
    assert done.status_code == 200
    assert done.json()["state"] == "finished"
    assert done.json()["progress"]["endings"] == {"ok": 8, "chatter": 1}
    assert done.json()["finished_at"] is not None
    again = service.http.get(f"{STUDIES}/{study_id}", headers={"If-None-Match": done.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
    assert again.headers["etag"] == done.headers["etag"]


def test_wishes_change_the_state(service: Service) -> None:
    study_id = service.submit()
    for verb, state in (("pause", "paused"), ("resume", "queued"), ("cancel", "cancelling"), ("cancel", "cancelling")):
        response = service.http.post(f"{STUDIES}/{study_id}:{verb}")
        assert (response.status_code, response.json()["state"]) == (202, state)
    late = service.http.post(f"{STUDIES}/{study_id}:resume")
    assert late.status_code == 409
    assert late.json()["type"] == "/problems/wrong-state"


def test_only_an_ended_study_can_be_deleted(service: Service) -> None:
    study_id = service.submit()
    assert service.http.delete(f"{STUDIES}/{study_id}").status_code == 409
    service.fill(study_id)
    assert service.http.delete(f"{STUDIES}/{study_id}").status_code == 204
    for path in ("", "/cases", "/cases/0", "/results", "/curves?x=shaft.load&y=torque.max"):
        gone = service.http.get(f"{STUDIES}/{study_id}{path}")
        assert (gone.status_code, gone.json()["type"]) == (404, "/problems/study-not-found")


def test_a_preview_submits_nothing(service: Service, spec: dict[str, Any]) -> None:
    clutch = {"data": [[0, 0], [0.01, 2.0], [0.02, 4.0], [0.03, 6.0]], "accuracy": "0.01 N*m"}
    spec["base"]["clutch"] = clutch
    response = service.http.post(f"{STUDIES}:preview", json=spec)
    assert response.status_code == 200, response.text
    body = response.json()
    fits(studies.Preview, body)
    assert (body["cases"], body["shape"]) == (9, [3, 3])
    assert body["first_cases"][1] == {"case": 1, "parameters": {"excitation.frequency": 16.0, "shaft.load": 0.1}}
    assert body["fits"]["/base/clutch"]["coefficients"][1] == pytest.approx(200.0)
    assert body["estimated_seconds"] > 0
    assert body["estimated_bytes"] > 0
    assert service.get("/studies")["studies"] == []


def test_preview_and_submission_warn_of_cases_that_take_too_long(service: Service, spec: dict[str, Any]) -> None:
    service.store.dispatchers.base_chunking = replace(service.store.dispatchers.base_chunking, timeout=1e-9)
    for path, status in ((f"{STUDIES}:preview", 200), (STUDIES, 202)):
        response = service.http.post(path, json=spec)
        assert response.status_code == status
        assert response.json()["warning_codes"][-1] == "exceeds-chunk-timeout"


def test_a_preview_of_many_cases_is_quick_and_small(service: Service, spec: dict[str, Any]) -> None:
    spec["axes"] = [
        {"path": "excitation.frequency", "linspace": [16, 35, 1000]},
        {"path": "shaft.load", "linspace": [0, 1, 1000]},
        {"path": "pendulums.0.mass", "linspace": [0.1, 1, 10]},
    ]
    response = service.http.post(f"{STUDIES}:preview", json=spec)
    assert response.json()["cases"] == 10_000_000
    assert len(response.content) < 20_000


@pytest.mark.parametrize("path", ["/studies/st_none", "/studies/st_none/cases", "/studies/st_none/cases/0"])
def test_an_unknown_study_is_a_problem(service: Service, path: str) -> None:
    response = service.http.get(API + path)
    assert response.status_code == 404
    assert response.json()["type"] == "/problems/study-not-found"
    assert response.headers["content-type"] == "application/problem+json"


def test_a_study_that_does_not_fit_on_the_disk_is_refused(
    service: Service, spec: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    accepted = service.submit(None, **{"Idempotency-Key": "before"})
    monkeypatch.setattr(Room, "left", lambda _: RESERVE_BYTES + 10_000)
    response = service.http.post(STUDIES, json={**spec, "axes": [{"path": "shaft.load", "linspace": [0, 1, 1000]}]})
    assert (response.status_code, response.json()["type"]) == (507, "/problems/storage-full")
    assert "0.01 MB" in response.json()["detail"]
    assert service.submit()
    monkeypatch.setattr(Room, "left", lambda _: 0)
    assert service.http.post(STUDIES, json=SPEC).status_code == 507
    assert service.submit(None, **{"Idempotency-Key": "before"}) == accepted, "it was accepted before"


def test_failed_cases_are_run_again(service: Service) -> None:
    study_id = service.submit()
    address = f"{STUDIES}/{study_id}:retry"
    assert service.http.post(address).status_code == 409
    service.fill(study_id)
    unknown = service.http.post(address, params={"ending": "bored"})
    assert unknown.status_code == 422
    assert "timed_out" in unknown.json()["errors"][0]["allowed"]
    none = service.http.post(address, params={"ending": ["crashed", "timed_out"]})
    assert (none.status_code, none.json()["type"]) == (409, "/problems/wrong-state")
    again = service.http.post(address, params={"ending": ["chatter"]})
    fits(studies.StudySummary, again.json())
    assert (again.status_code, again.json()["state"]) == (202, "queued")
    assert again.json()["progress"] == {"total": 9, "done": 8, "ok": 8}
    assert [row["case"] for row in service.get(f"/studies/{study_id}/cases")["cases"]] == [0, 1, 2, 3, 5, 6, 7, 8]
    service.fill(study_id)
    assert service.get(f"/studies/{study_id}")["progress"]["done"] == 9


def test_priorities_are_given_and_changed(service: Service) -> None:
    made = service.http.post(STUDIES, json=SPEC, params={"priority": 7})
    assert (made.status_code, made.json()["priority"]) == (202, 7)
    address = f"{STUDIES}/{made.json()['id']}:prioritize"
    changed = service.http.post(address, params={"priority": -3})
    assert (changed.status_code, changed.json()["priority"]) == (202, -3)
    assert service.get(f"/studies/{made.json()['id']}")["priority"] == -3
    for value in ("101", "high", ""):
        refused = service.http.post(address, params={"priority": value})
        assert refused.status_code == 422
        assert refused.json()["errors"][0]["parameter"] == "priority"
    assert service.http.post(address).status_code == 422


def test_a_study_that_has_ended_gets_no_priority(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id)
    refused = service.http.post(f"{STUDIES}/{study_id}:prioritize", params={"priority": 5})
    assert (refused.status_code, refused.json()["type"]) == (409, "/problems/wrong-state")
    assert service.get(f"/studies/{study_id}")["priority"] == 0


@pytest.mark.parametrize("changed", [{"finish_by": "9 h"}, {"priority": 3}, {"fresh": "true"}, {}], ids=str)
def test_a_key_with_other_parameters_is_a_conflict(service: Service, changed: dict[str, str]) -> None:
    """A deadline that is given as a duration is the same for the same words, whatever the time is."""
    headers = {"Idempotency-Key": "nightly"}
    first = service.http.post(STUDIES, json=SPEC, headers=headers, params={"finish_by": "8 h"})
    again = service.http.post(STUDIES, json=SPEC, headers=headers, params={"finish_by": "8 h"})
    assert (first.status_code, again.json()["id"]) == (202, first.json()["id"])
    other = service.http.post(STUDIES, json=SPEC, headers=headers, params=changed)
    assert (other.status_code, other.json()["type"]) == (422, "/problems/idempotency-conflict")
