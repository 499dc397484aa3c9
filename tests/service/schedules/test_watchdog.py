"""The watchdog: what should have run and has not is said once, by every way that people look at."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import pytest

from sprag_study.service.cli import doctor
from sprag_study.service.delivery import Delivery
from sprag_study.service.jobs.reports.reporter import Reporter
from sprag_study.service.jobs.reports.watchdog import Watchdog, late_runs
from sprag_study.service.jobs.scheduler import Scheduler
from sprag_study.service.schedules.fields import change_fields, read_fields
from tests.service.schedules.conftest import NEW_YEAR
from tests.service.schedules.receivers import Hook, webhook
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from sprag_study.service.storage.store import Store
    from tests.service.conftest import Service
    from tests.service.schedules.conftest import Clock


@pytest.fixture
def hook(monkeypatch: pytest.MonkeyPatch) -> Iterator[Hook]:
    for name in ("HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY", "http_proxy", "https_proxy", "all_proxy"):
        monkeypatch.delenv(name, raising=False)
    with webhook() as received:
        yield received


def nightly(store: Store, **given: Any) -> str:
    fields = {"spec": SPEC, "cron": "0 1 * * *", "name": "nightly", **given}
    return store.schedules.create(read_fields(fields, NEW_YEAR)).id


def sentences(store: Store) -> list[str]:
    return [late.sentence.partition("nothing has run: ")[2] for late in late_runs(store)]


def test_a_due_time_that_nobody_takes_up_is_late_after_a_quarter_of_an_hour(
    service: Service, clock: Clock, hook: Hook, caplog: pytest.LogCaptureFixture
) -> None:
    store, watchdog = service.store, Watchdog(service.store)
    schedule = nightly(store, report_webhook=hook.address)
    clock.set("2026-01-01T01:14")
    watchdog.look()
    assert late_runs(store) == []
    clock.set("2026-01-01T01:15")
    watchdog.look()
    watchdog.look()
    Watchdog(store).look()  # that of another process, or after a restart
    assert sentences(store) == ["no worker has taken it up."]
    assert caplog.text.count(f"The schedule {schedule} is late.") == 2
    reporter = Reporter(store, Delivery(origins=(hook.address,), secret=bytes(32), sender="a@b"))
    reporter.look()
    ((_, _, body),) = hook.requests
    said = json.loads(body)
    assert (said["type"], said["data"]["schedule"]) == ("schedule.overdue", schedule)
    assert "2026-01-01 01:00 UTC" in said["data"]["sentence"]
    Scheduler(store).look()
    assert late_runs(store) == []
    clock.set("2026-01-02T02:00")
    watchdog.look()
    reporter.look()
    assert len(hook.requests) == 2, "the next night is another due time"


def test_late_runs_are_shown_wherever_people_look(
    service: Service, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    schedule = nightly(service.store, name="<b>late</b>", zone="Europe/Berlin", cron="0 2 * * *")
    clock.set("2026-01-01T03:00")
    found = service.get("/night")
    assert [(late["schedule"], late["due_local"]) for late in found["late"]] == [
        (schedule, "2026-01-01T02:00:00+01:00")
    ]
    page = service.http.get("/nights").text
    assert "&lt;b&gt;late&lt;/b&gt;</a> is late" in page
    assert "no worker has taken it up" in page
    (warning,) = service.http.get("/readyz").json()["warnings"]
    assert warning.startswith("Schedules are late: 1.")
    assert "late</b>" not in warning
    assert "sprag_schedules_late 1.0" in service.http.get("/metrics").text
    monkeypatch.setattr("sprag_study.service.storage.store.SystemClock", lambda: clock)
    url = str(service.store.session.url)
    found_by_doctor = {finding.subject: finding for finding in doctor.examine(url)}["schedules"]
    assert not found_by_doctor.ok
    assert "no worker has taken it up" in found_by_doctor.detail
    Scheduler(service.store).look()
    assert service.get("/night")["late"] == []
    assert "warnings" not in service.http.get("/readyz").json()
    assert "sprag_schedules_late 0.0" in service.http.get("/metrics").text


def test_a_study_waits_without_a_worker(service: Service, clock: Clock) -> None:
    store = service.store
    nightly(store)
    clock.set("2026-01-01T01:00")
    Scheduler(store).look()
    clock.set("2026-01-01T01:14")
    assert sentences(store) == []
    clock.set("2026-01-01T01:15")
    assert sentences(store) == ["its study waits, and no worker has responded for a quarter of an hour."]
    service.fill(store.studies.page().studies[0].id)
    assert sentences(store) == []


def beat(store: Store, epoch: int) -> None:
    report: dict[str, Any] = {
        "executor": "pool",
        "scheduler": "",
        "dashboard": "",
        "shortage": "",
        "chunks_in_flight": 0,
        "hosts": [],
        "refused": [],
    }
    store.work.heartbeat(epoch, report)


def test_a_worker_that_finishes_nothing_for_two_hours(service: Service, clock: Clock) -> None:
    store = service.store
    nightly(store, window=["22:00", "06:00"])
    epoch = store.work.take_over("test")
    clock.set("2026-01-01T01:00")
    Scheduler(store).look()
    study = store.studies.page().studies[0]
    for time, expected in (
        ("2026-01-01T03:00", []),
        ("2026-01-01T03:01", ["its study waits, and no chunk of any study has been finished for two hours."]),
    ):
        clock.set(time)
        beat(store, epoch)
        assert sentences(store) == expected
    epoch = store.work.take_over("test")
    chunk = store.work.open_chunks(study.number)[0]
    assert store.work.claim(epoch, [chunk])
    clock.set("2026-01-01T06:30")
    Scheduler(store).look()
    clock.set("2026-01-01T22:00")
    Scheduler(store).look()
    beat(store, epoch)
    assert sentences(store) == [], "its window has just opened"


def test_a_study_that_is_not_submitted_says_why(
    service: Service, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = service.store
    kept = nightly(store)
    monkeypatch.setattr("sprag_study.service.jobs.submission.MAX_WAITING_STUDIES", 0)
    clock.set("2026-01-01T01:00")
    Scheduler(store).look()
    clock.set("2026-01-01T02:00")
    (said,) = sentences(store)
    assert said.startswith("its study is not submitted yet; 0 studies have not ended yet.")
    paused = change_fields(store.schedules.get(kept).fields, {"enabled": False}, clock.now())
    store.schedules.change(kept, paused)
    assert sentences(store) == []


def test_what_is_paused_or_over_is_not_late(service: Service, clock: Clock) -> None:
    store = service.store
    nightly(store, paused_until="2026-02-01T00:00")
    nightly(store, enabled=False)
    store.schedules.delete(nightly(store))
    clock.set("2026-01-05T00:00")
    assert late_runs(store) == []
