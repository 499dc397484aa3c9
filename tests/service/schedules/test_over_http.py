"""Schedules by the interface for programs and by the pages."""

from __future__ import annotations

import copy
from datetime import UTC, datetime
from typing import Any

import pytest

from sprag_study.service.http.api.schedules import EXAMPLE
from sprag_study.service.jobs.scheduler import Scheduler
from sprag_study.worker import models
from tests.service.conftest import Service
from tests.service.schedules.conftest import Clock
from tests.service.timed_spec import SPEC

API = "/api/v1/schedules"


def test_the_interface_keeps_changes_disables_and_deletes(service: Service, clock: Clock) -> None:
    made = service.http.post(API, json=EXAMPLE)
    assert made.status_code == 201, made.text
    address = made.headers["location"]
    found = service.http.get(address).json()
    assert found == made.json()
    assert found["next_due"] == "2026-01-01T21:00:00.000000Z"
    assert (found["window"], found["spec"]) == (["22:00", "06:00"], EXAMPLE["spec"])
    changed = service.http.patch(address, json={"at": "2026-02-01T09:00", "window": None, "name": "once"}).json()
    assert (changed["cron"], changed["at"]) == (None, "2026-02-01T09:00:00+01:00")
    assert (changed["window"], changed["name"], changed["next_due"]) == (None, "once", "2026-02-01T08:00:00.000000Z")
    assert service.http.patch(address, json={"enabled": False}).json()["next_due"] is None
    clock.set("2026-03-01T00:00")
    late = service.http.patch(address, json={"enabled": True, "name": "too late"})  # its time has passed
    assert (late.status_code, late.json()["next_due"]) == (200, None)
    assert [s["name"] for s in service.get("/schedules")["schedules"]] == ["too late"]
    assert service.http.delete(address).status_code == 204
    assert service.http.get(address).status_code == 404
    assert service.http.patch(address, json={}).status_code == 404
    assert service.get("/schedules") == {"off": None, "schedules": []}


def test_pausing_and_resuming_wait_for_no_process(service: Service, clock: Clock) -> None:
    address = service.http.post(API, json=EXAMPLE).headers["location"]
    checked = len(service.checker.calls)
    for change, paused in (
        ({"enabled": False}, True),
        ({"enabled": True, "paused_until": None}, False),
        ({"paused_until": "2026-01-07T00:00"}, False),
    ):
        answer = service.http.patch(address, json=change)
        assert (answer.status_code, answer.json()["next_due"] is None) == (200, paused)
    for wrong in ({"enabled": 3}, {"paused_until": "soon"}):
        assert service.http.patch(address, json=wrong).status_code == 422
    assert len(service.checker.calls) == checked
    assert service.http.patch(address, json={"enabled": True, "name": "changed"}).status_code == 200
    assert service.http.patch(address, content="{", headers={"content-type": "application/json"}).status_code == 422
    assert len(service.checker.calls) == checked + 2


def test_studies_of_a_schedule_start_from_the_end_of_a_case(
    service: Service, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(models, "run_end_state", lambda *_: {"shaft.initial_speed": 2.5})
    monkeypatch.setattr(models, "is_compiled", lambda _: True)
    spec: dict[str, Any] = copy.deepcopy(SPEC)
    spec["base"]["start"] = {"study": service.submit(), "case": 0}
    spec["base"]["shaft"].pop("initial_speed", None)
    made = service.http.post(API, json={"spec": spec, "at": "2026-01-01T02:00"})
    assert made.status_code == 201, made.text
    base = made.json()["spec"]["base"]
    assert (base["shaft"]["initial_speed"], "start" in base) == (2.5, False)
    clock.set("2026-01-01T02:00")
    Scheduler(service.store).look()
    assert [study["name"] for study in service.get("/studies")["studies"]].count(SPEC["name"]) == 2
    spec["base"]["start"]["case"] = 10**6
    wrong = service.http.post(API, json={"spec": spec, "at": "2026-01-01T03:00"})
    assert (wrong.status_code, wrong.json()["errors"][0]["pointer"]) == (422, "/spec/base/start/case")


def test_the_same_key_keeps_a_schedule_once(service: Service, clock: Clock) -> None:
    key, body = {"Idempotency-Key": "nights"}, {"spec": SPEC, "at": "2026-01-01T02:00"}
    first = service.http.post(API, json=body, headers=key)
    assert first.status_code == 201, first.text
    turned = dict(reversed(body.items()))
    again = service.http.post(API, json=turned, headers=key)
    assert (again.status_code, again.json()) == (201, first.json())
    assert again.headers["location"] == first.headers["location"]
    other = service.http.post(API, json={**body, "at": "2026-01-01T03:00"}, headers=key)
    assert (other.status_code, other.json()["type"]) == (422, "/problems/idempotency-conflict")
    clock.set("2026-01-01T05:00")  # who asks again after the time has passed is told of the same schedule
    assert service.http.post(API, json=body, headers=key).json()["id"] == first.json()["id"]
    assert [kept["id"] for kept in service.get("/schedules")["schedules"]] == [first.json()["id"]]
    assert service.http.delete(first.headers["location"]).status_code == 204
    late = service.http.post(API, json=body, headers=key)
    assert (late.status_code, late.json()["errors"][0]["pointer"]) == (422, "/at"), "the key went with its schedule"
    assert service.http.post(API, content=b"{", headers={**key, "Content-Type": "application/json"}).status_code == 422


@pytest.mark.parametrize(
    ("given", "pointer"),
    [
        ({"cron": "0 25 * * *"}, "/cron"),
        ({"cron": 5}, "/cron"),
        ({}, "/cron"),
        ({"cron": "0 1 * * *", "at": "2027-01-01T00:00"}, "/cron"),
        ({"at": "2025-01-01T00:00"}, "/at"),
        ({"at": 1}, "/at"),
        ({"cron": "0 1 * * *", "zone": "Europe/Berlim"}, "/zone"),
        ({"cron": "0 1 * * *", "zone": "../../etc/passwd"}, "/zone"),
        ({"cron": "0 1 * * *", "window": ["22:00", "22:00"]}, "/window"),
        ({"cron": "0 1 * * *", "window": "22:00-06:00"}, "/window"),
        ({"cron": "0 1 * * *", "priority": 1e9}, "/priority"),
        ({"cron": "0 1 * * *", "fresh": 1}, "/fresh"),
        ({"cron": "@never"}, "/cron"),
        ({"cron": "0 1 * * *", "overlap": "both"}, "/overlap"),
        ({"cron": "0 1 * * *", "overlap": None}, "/overlap"),
        ({"cron": "0 1 * * *", "catch_up": 3}, "/catch_up"),
        ({"cron": "0 1 * * *", "misfire_grace": "soon"}, "/misfire_grace"),
        ({"cron": "0 1 * * *", "misfire_grace": "1 ms"}, "/misfire_grace"),
        ({"cron": "0 1 * * *", "misfire_grace": 60}, "/misfire_grace"),
        ({"cron": "0 1 * * *", "paused_until": "2025-01-01T00:00"}, "/paused_until"),
        ({"cron": "0 1 * * *", "paused_until": "later"}, "/paused_until"),
        ({"at": "2026-01-01T02:00", "paused_until": "2026-01-01T02:01"}, "/paused_until"),
        ({"cron": "0 1 * * *", "name": ["x"]}, "/name"),
        ({"cron": "0 1 * * *", "name": "a\r\nb"}, "/name"),
        ({"cron": "0 1 * * *", "name": ""}, "/name"),
        ({"cron": "0 1 * * *", "spec": {**SPEC, "model": "x"}}, "/spec/model"),
        ({"cron": "0 1 * * *", "wndow": None}, "/wndow"),
    ],
)
def test_what_is_wrong_is_named(service: Service, given: dict[str, Any], pointer: str) -> None:
    answer = service.http.post(API, json={"spec": SPEC, **given})
    assert answer.status_code == 422, answer.text
    assert pointer in [error["pointer"] for error in answer.json()["errors"]]
    assert all(error["allowed"] for error in answer.json()["errors"])


@pytest.mark.parametrize("times", [{"cron": "0 22 * * *"}, {"at": "2026-01-05T22:00"}])
def test_a_window_that_is_closed_until_the_deadline_is_refused(service: Service, times: dict[str, str]) -> None:
    wrong = {"spec": SPEC, **times, "zone": "Europe/Berlin", "window": ["06:00", "22:00"], "finish_by": "06:00"}
    refused = service.http.post(API, json=wrong)
    assert refused.status_code == 422
    (error,) = refused.json()["errors"]
    assert error["pointer"] == "/window"
    assert error["code"] == "conflict"
    for right in ({"window": ["22:00", "06:00"]}, {"finish_by": "06:01"}, {"finish_by": "25 h"}, {"enabled": False}):
        assert service.http.post(API, json={**wrong, **right}).status_code == 201


def test_a_near_name_of_a_zone_is_offered(service: Service) -> None:
    answer = service.http.post(API, json={"spec": SPEC, "cron": "0 1 * * *", "zone": "Europe/Berlim"})
    assert "did you mean 'Europe/Berlin'?" in answer.text


def fill_in(**given: str) -> dict[str, str]:
    """A form as a browser sends it."""
    empty = {"name": "", "at": "", "window_begin": "", "window_end": "", "priority": "0", "zone": "UTC"}
    return {**empty, "when": "cron", "cron": "0 22 * * *", "source": "preset one_pendulum", **given}


def test_a_schedule_is_kept_changed_and_deleted_by_the_pages(service: Service, clock: Clock) -> None:
    study_id = service.submit()
    assert f'value="study {study_id}" selected' in service.http.get(f"/nights/new?study={study_id}").text
    form = fill_in(source=f"study {study_id}", window_begin="22:00", window_end="06:00", name="<b>by form</b>")
    assert service.http.post("/nights/new", data=form).status_code == 303
    (kept,) = service.store.schedules.all()
    assert (kept.fields.spec, kept.fields.name) == (SPEC, "<b>by form</b>")
    listed = service.http.get("/nights").text
    assert "&lt;b&gt;by form" in listed
    assert "22:00–06:00" in listed
    assert "2026-01-01 22:00</time>" in listed
    assert 'value="22:00"' in service.http.get(f"/nights/{kept.id}").text
    change = fill_in(source="", when="at", at="2026-01-05T07:30", zone="Europe/Berlin", fresh="on", priority="-2")
    assert service.http.post(f"/nights/{kept.id}", data=change).status_code == 303
    (changed,) = service.store.schedules.all()
    assert changed.next_due == datetime(2026, 1, 5, 6, 30, tzinfo=UTC)
    assert (changed.fields.spec, changed.fields.fresh, changed.fields.priority) == (SPEC, True, -2)
    clock.set("2026-01-06T00:00")
    Scheduler(service.store).look()
    assert ">its study</a>" in service.http.get("/nights").text
    assert service.http.post(f"/nights/{kept.id}", data={**change, "name": "later"}).status_code == 303
    service.http.post(f"/nights/{kept.id}/pause")
    assert "paused" in service.http.get("/nights").text
    assert service.http.post(f"/nights/{kept.id}/explode").status_code == 404
    assert service.http.post(f"/nights/{kept.id}/delete").status_code == 303
    assert service.store.schedules.all() == ()


@pytest.mark.parametrize(
    ("given", "field"),
    [
        ({"source": ""}, "source"),
        ({"source": "study st_0"}, "source"),
        ({"source": "preset ../../x"}, "source"),
        ({"cron": "0 25 * * *"}, "cron"),
        ({"when": "at", "at": "2020-01-01T00:00"}, "at"),
        ({"zone": "Mars"}, "zone"),
        ({"window_begin": "22:00"}, "window_begin"),
        ({"priority": "high"}, "priority"),
        ({"name": "n" * 201}, "name"),
        ({"overlap": "both"}, "overlap"),
        ({"misfire_grace": "soon"}, "misfire_grace"),
        ({"paused_until": "2020-01-01T00:00"}, "paused_until"),
    ],
)
def test_the_form_tells_what_is_wrong_beside_the_field(service: Service, given: dict[str, str], field: str) -> None:
    answer = service.http.post("/nights/new", data=fill_in(**given))
    assert answer.status_code == 422
    assert f'id="wrong-{field}" role="alert">' in answer.text
    assert service.store.schedules.all() == ()
