"""Schedules: what is due is submitted once, missed times are made up for once, windows hold studies."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Any

import pytest

from service.http.api.examples import SPEC
from service.http.api.schedules import EXAMPLE
from service.http.app import chunking, create_app
from service.jobs import scheduler as module
from service.jobs.scheduler import Scheduler
from service.schedules.fields import ScheduleFields, read_fields
from service.storage.errors import DatabaseBusyError, ScheduleNotFound
from service.storage.schedules import RunState
from service.storage.store import Store
from tests.service.conftest import InThread, Service
from tests.worker.fakes import HandClock
from worker.states import StudyState

if TYPE_CHECKING:
    import httpx

    from service.settings import Settings

NEW_YEAR = datetime(2026, 1, 1, tzinfo=UTC)  # where the clock of the tests begins: a Thursday


class Clock(HandClock):
    """A clock that is set by hand to a time of UTC."""

    def set(self, text: str) -> None:
        """Stand at that time."""
        self.seconds = (datetime.fromisoformat(text).replace(tzinfo=UTC) - NEW_YEAR).total_seconds()


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def service(settings: Settings, clock: Clock, connect: Callable[..., httpx.Client]) -> Iterator[Service]:
    """A service by the clock of the test."""
    computer = InThread()
    with Store.open(settings.database_url, chunking=chunking(settings), clock=clock) as store:
        app = create_app(settings, store=store, computer=computer, checker=InThread())
        yield Service(app, connect(app), store, computer)


def fields(**given: Any) -> ScheduleFields:
    return read_fields({"spec": SPEC, **given}, NEW_YEAR)


def names(store: Store) -> list[str]:
    return [study.name for study in store.list_studies().studies]


def test_a_cron_schedule_submits_a_study_whenever_it_is_due(service: Service, clock: Clock) -> None:
    store, look = service.store, Scheduler(service.store).look
    kept = store.create_schedule(
        fields(cron="0 22 * * *", zone="Europe/Berlin", name="nightly", priority=3, fresh=True)
    )
    assert kept.next_due == datetime(2026, 1, 1, 21, tzinfo=UTC)
    look()
    assert names(store) == []
    for day in (1, 2):
        clock.set(f"2026-01-0{day}T21:00")
        look()
        look()
        assert names(store) == ["nightly"] * day
    study = store.list_studies().studies[0]
    assert study.priority == 3
    assert store.spec(study.id) == SPEC
    found = store.get_schedule(kept.id)
    assert found.next_due == datetime(2026, 1, 3, 21, tzinfo=UTC)
    assert found.last is not None
    assert (found.last.state, found.last.study, found.last.missed) == (RunState.SUBMITTED, study.id, 0)
    assert [run.due.day for run in store.schedule_runs(kept.id)] == [2, 1]


def test_missed_times_become_one_run(service: Service, clock: Clock) -> None:
    kept = service.store.create_schedule(fields(cron="0 * * * *"))
    clock.set("2026-01-01T05:20")
    Scheduler(service.store).look()
    (run,) = service.store.schedule_runs(kept.id)
    assert (run.due, run.missed) == (datetime(2026, 1, 1, 5, tzinfo=UTC), 4)
    assert len(names(service.store)) == 1
    assert service.store.get_schedule(kept.id).next_due == datetime(2026, 1, 1, 6, tzinfo=UTC)


def test_once_is_made_up_for_when_it_was_missed_and_never_again(service: Service, clock: Clock) -> None:
    kept = service.store.create_schedule(fields(at="2026-01-01T02:00"))
    clock.set("2026-01-09T00:00")
    look = Scheduler(service.store).look
    look()
    look()
    assert len(names(service.store)) == 1
    assert service.store.get_schedule(kept.id).next_due is None


def test_two_schedulers_at_once_submit_one_study(settings: Settings, clock: Clock) -> None:
    with (
        Store.open(settings.database_url, clock=clock) as one,
        Store.open(settings.database_url, clock=clock) as other,
    ):
        for number in range(4):
            one.create_schedule(fields(cron="*/5 * * * *", name=str(number)))
        for turn in range(1, 6):
            clock.set(f"2026-01-01T00:{5 * turn:02}")
            gate = threading.Barrier(2)
            faults: list[BaseException] = []

            def look(store: Store, gate: threading.Barrier = gate, faults: list[BaseException] = faults) -> None:
                gate.wait(30)
                try:
                    Scheduler(store).look()
                except BaseException as fault:
                    faults.append(fault)

            threads = [threading.Thread(target=look, args=(store,)) for store in (one, other)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join(60)
            assert faults == []
        assert sorted(names(one)) == sorted(["0", "1", "2", "3"] * 5)


def test_one_key_from_many_threads_keeps_one_schedule(settings: Settings, clock: Clock) -> None:
    with Store.open(settings.database_url, chunking=chunking(settings), clock=clock) as store:
        kept = fields(cron="0 * * * *")
        with ThreadPoolExecutor(8) as threads:
            made = {
                record.id
                for record in threads.map(
                    lambda _: store.create_schedule(kept, idempotency_key="k", body_hash="a"), range(16)
                )
            }
        assert made == {record.id for record in store.list_schedules()}
        assert len(made) == 1


def test_who_saw_it_due_before_another_took_it_takes_nothing(service: Service, clock: Clock) -> None:
    store = service.store
    store.create_schedule(fields(cron="0 * * * *"))
    clock.set("2026-01-01T01:00")
    (seen,) = store.due_schedules(clock.now())
    due, following = clock.now(), clock.now() + timedelta(hours=1)
    assert store.take_due(seen, due, 0, following)
    assert not store.take_due(seen, due, 0, following)
    assert len(store.open_runs()) == 1


def test_a_clock_that_is_put_back_comes_to_no_due_time_twice(service: Service, clock: Clock) -> None:
    look = Scheduler(service.store).look
    kept = service.store.create_schedule(fields(cron="0 * * * *"))
    clock.set("2026-01-01T01:00")
    look()
    clock.set("2026-01-01T00:30")
    service.store.change_schedule(kept.id, fields(cron="0 * * * *", name="changed"))
    clock.set("2026-01-01T01:00")
    look()
    look()
    assert len(names(service.store)) == 1
    assert service.store.get_schedule(kept.id).next_due == datetime(2026, 1, 1, 2, tzinfo=UTC)


def test_a_scheduler_that_died_before_submitting_is_made_up_for_once(
    service: Service, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    service.store.create_schedule(fields(at="2026-01-01T02:00"))
    clock.set("2026-01-01T02:00")
    scheduler = Scheduler(service.store)
    with monkeypatch.context() as patch:
        patch.setattr(service.store, "close_run", lambda *_, **__: (_ for _ in ()).throw(DatabaseBusyError("busy")))
        with pytest.raises(DatabaseBusyError):
            scheduler.look()  # the study is there, and nothing says so
    assert len(names(service.store)) == 1
    Scheduler(service.store).look()
    assert len(names(service.store)) == 1
    assert service.store.list_schedules()[0].last.state is RunState.SUBMITTED  # type: ignore[union-attr]


def test_a_spec_that_this_program_does_not_read_is_told(service: Service, clock: Clock) -> None:
    good = fields(at="2026-01-01T02:00")
    kept = service.store.create_schedule(
        ScheduleFields("old", {"sprag": 0}, good.timing, None, 0, fresh=False, enabled=True)
    )
    clock.set("2026-01-01T02:00")
    Scheduler(service.store).look()
    (run,) = service.store.schedule_runs(kept.id)
    assert run.state is RunState.REFUSED
    assert run.problem is not None
    assert "/sprag" in run.problem
    assert names(service.store) == []


def test_a_study_is_held_outside_its_window_and_goes_on_inside(service: Service, clock: Clock) -> None:
    store, look = service.store, Scheduler(service.store).look
    store.create_schedule(fields(at="2026-01-01T12:00", window=["22:00", "06:00"], zone="UTC"))
    clock.set("2026-01-01T12:00")
    look()
    (study,) = store.list_studies().studies
    assert (study.state, study.reason) == (
        StudyState.PAUSED,
        "outside its window, 22:00 to 06:00 (UTC); it goes on by itself",
    )
    clock.set("2026-01-01T22:00")
    look()
    assert store.get_study(study.id).state is StudyState.QUEUED
    clock.set("2026-01-02T06:00")
    look()
    assert store.get_study(study.id).state is StudyState.PAUSED


def test_the_window_stays_when_the_schedule_is_deleted(service: Service, clock: Clock) -> None:
    store, look = service.store, Scheduler(service.store).look
    kept = store.create_schedule(fields(at="2026-01-01T12:00", window=["22:00", "06:00"]))
    clock.set("2026-01-01T12:00")
    look()
    store.delete_schedule(kept.id)
    with pytest.raises(ScheduleNotFound):
        store.get_schedule(kept.id)
    clock.set("2026-01-01T23:00")
    look()
    assert store.list_studies().studies[0].state is StudyState.QUEUED


def test_who_resumes_a_held_study_lifts_its_window(service: Service, clock: Clock) -> None:
    store, look = service.store, Scheduler(service.store).look
    store.create_schedule(fields(at="2026-01-01T12:00", window=["22:00", "06:00"]))
    clock.set("2026-01-01T12:00")
    look()
    (study,) = store.list_studies().studies
    store.resume_study(study.id)
    look()
    assert store.get_study(study.id).state is StudyState.QUEUED


def test_who_pauses_a_study_keeps_it_paused_in_its_window(service: Service, clock: Clock) -> None:
    store, look = service.store, Scheduler(service.store).look
    store.create_schedule(fields(at="2026-01-01T12:00", window=["22:00", "06:00"]))
    clock.set("2026-01-01T12:00")
    look()
    (study,) = store.list_studies().studies
    store.pause_study(study.id)
    clock.set("2026-01-01T23:00")
    look()
    assert store.get_study(study.id).state is StudyState.PAUSED


def test_a_disabled_schedule_is_not_due_and_forgets_what_it_missed(service: Service, clock: Clock) -> None:
    store, look = service.store, Scheduler(service.store).look
    kept = store.create_schedule(fields(cron="0 * * * *", enabled=False))
    assert kept.next_due is None
    clock.set("2026-01-01T03:10")
    look()
    again = store.change_schedule(kept.id, fields(cron="0 * * * *"))
    assert again.next_due == datetime(2026, 1, 1, 4, tzinfo=UTC)
    look()
    assert names(store) == []


def test_a_study_of_a_schedule_can_be_deleted(service: Service, clock: Clock) -> None:
    store = service.store
    kept = store.create_schedule(fields(at="2026-01-01T12:00"))
    clock.set("2026-01-01T12:00")
    Scheduler(store).look()
    (study,) = store.list_studies().studies
    service.fill(study.id)
    store.delete_study(study.id)
    Scheduler(store).look()
    (run,) = store.schedule_runs(kept.id)
    assert (run.state, run.study) == (RunState.SUBMITTED, None)
    assert names(store) == []


def test_the_thread_looks_again_after_trouble(
    service: Service, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(module, "LOOK_SECONDS", 0.001)
    looked = threading.Semaphore(0)

    class Troubled(Scheduler):
        def look(self) -> None:
            looked.release()
            raise DatabaseBusyError("the database is busy")

    scheduler = Troubled(service.store)
    scheduler.start()
    for _ in range(3):
        assert looked.acquire(timeout=20)
    scheduler.stop()
    assert not scheduler.is_alive()
    assert caplog.messages == ["The schedules cannot be kept: the database is busy"]


API = "/api/v1/schedules"


def test_the_interface_keeps_changes_disables_and_deletes(service: Service, clock: Clock) -> None:
    made = service.http.post(API, json=EXAMPLE)
    assert made.status_code == 201, made.text
    address = made.headers["location"]
    found = service.http.get(address).json()
    assert found == made.json()
    assert found["next_due"] == "2026-01-01T21:00:00Z"
    assert (found["window"], found["spec"]) == (["22:00", "06:00"], SPEC)
    changed = service.http.patch(address, json={"at": "2026-02-01T09:00", "window": None, "name": "once"}).json()
    assert (changed["cron"], changed["at"]) == (None, "2026-02-01T09:00:00+01:00")
    assert (changed["window"], changed["name"], changed["next_due"]) == (None, "once", "2026-02-01T08:00:00Z")
    assert service.http.patch(address, json={"enabled": False}).json()["next_due"] is None
    clock.set("2026-03-01T00:00")
    late = service.http.patch(address, json={"enabled": True, "name": "too late"})  # its time has passed
    assert (late.status_code, late.json()["next_due"]) == (200, None)
    assert [s["name"] for s in service.get("/schedules")["schedules"]] == ["too late"]
    assert service.http.delete(address).status_code == 204
    assert service.http.get(address).status_code == 404
    assert service.http.patch(address, json={}).status_code == 404
    assert service.get("/schedules") == {"schedules": []}


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


def test_a_near_name_of_a_zone_is_offered(service: Service) -> None:
    answer = service.http.post(API, json={"spec": SPEC, "cron": "0 1 * * *", "zone": "Europe/Berlim"})
    assert "did you mean 'Europe/Berlin'?" in answer.text


def fill_in(**given: str) -> dict[str, str]:
    """A form as a browser sends it."""
    empty = {"name": "", "at": "", "window_begin": "", "window_end": "", "priority": "0", "zone": "UTC"}
    return {**empty, "when": "cron", "cron": "0 22 * * *", "source": "preset one_pendulum", **given}


def test_a_schedule_is_kept_changed_and_deleted_by_the_pages(service: Service, clock: Clock) -> None:
    study_id = service.submit()
    assert f'value="study {study_id}" selected' in service.http.get(f"/schedules/new?study={study_id}").text
    form = fill_in(source=f"study {study_id}", window_begin="22:00", window_end="06:00", name="<b>by form</b>")
    assert service.http.post("/schedules/new", data=form).status_code == 303
    (kept,) = service.store.list_schedules()
    assert (kept.fields.spec, kept.fields.name) == (SPEC, "<b>by form</b>")
    listed = service.http.get("/schedules").text
    assert "&lt;b&gt;by form" in listed
    assert "22:00 to 06:00" in listed
    assert "2026-01-01 22:00:00 UTC" in listed
    assert 'value="22:00"' in service.http.get(f"/schedules/{kept.id}").text
    change = fill_in(source="", when="at", at="2026-01-05T07:30", zone="Europe/Berlin", fresh="on", priority="-2")
    assert service.http.post(f"/schedules/{kept.id}", data=change).status_code == 303
    (changed,) = service.store.list_schedules()
    assert changed.next_due == datetime(2026, 1, 5, 6, 30, tzinfo=UTC)
    assert (changed.fields.spec, changed.fields.fresh, changed.fields.priority) == (SPEC, True, -2)
    clock.set("2026-01-06T00:00")
    Scheduler(service.store).look()
    assert ">its study</a>" in service.http.get("/schedules").text
    assert service.http.post(f"/schedules/{kept.id}", data={**change, "name": "later"}).status_code == 303
    service.http.post(f"/schedules/{kept.id}/disable")
    assert "disabled" in service.http.get("/schedules").text
    assert service.http.post(f"/schedules/{kept.id}/explode").status_code == 404
    assert service.http.post(f"/schedules/{kept.id}/delete").status_code == 303
    assert service.store.list_schedules() == ()


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
    ],
)
def test_the_form_tells_what_is_wrong_beside_the_field(service: Service, given: dict[str, str], field: str) -> None:
    answer = service.http.post("/schedules/new", data=fill_in(**given))
    assert answer.status_code == 422
    assert f'id="wrong-{field}" role="alert">' in answer.text
    assert service.store.list_schedules() == ()
