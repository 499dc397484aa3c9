"""Schedules: what is due is submitted once, missed times are made up for once, windows hold studies."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Any
from unittest.mock import Mock

import pytest
import sqlalchemy as sa

from sprag_study.service.http.app import chunking
from sprag_study.service.jobs.scheduler import Scheduler
from sprag_study.service.schedules.fields import ScheduleFields, read_fields
from sprag_study.service.schedules.policies import DueTime
from sprag_study.service.storage.errors import DatabaseBusyError, ScheduleNotFoundError
from sprag_study.service.storage.schedules.runs import RunState
from sprag_study.service.storage.store import Store
from sprag_study.worker.states import StudyState
from tests.service.conftest import Service
from tests.service.schedules.conftest import NEW_YEAR, Clock
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from sprag_study.service.settings import Settings


def fields(**given: Any) -> ScheduleFields:
    return read_fields({"spec": SPEC, **given}, NEW_YEAR)


def names(store: Store) -> list[str]:
    return [study.name for study in store.studies.page().studies]


def test_a_cron_schedule_submits_a_study_whenever_it_is_due(service: Service, clock: Clock) -> None:
    store, look = service.store, Scheduler(service.store).look
    kept = store.schedules.create(
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
    study = store.studies.page().studies[0]
    assert study.priority == 3
    assert store.studies.spec(study.id) == SPEC
    found = store.schedules.get(kept.id)
    assert found.next_due == datetime(2026, 1, 3, 21, tzinfo=UTC)
    assert found.last is not None
    assert (found.last.state, found.last.study, found.last.missed) == (RunState.SUBMITTED, study.id, 0)
    assert [run.due.day for run in store.schedules.runs(kept.id)] == [2, 1]


def test_a_look_asks_one_question_where_there_are_no_schedules(service: Service, clock: Clock) -> None:
    statements: list[str] = []

    def note(_connection: Any, _cursor: Any, statement: str, *_: Any) -> None:
        if not statement.startswith("BEGIN"):
            statements.append(statement)

    look = Scheduler(service.store).look
    sa.event.listen(sa.Engine, "before_cursor_execute", note)
    try:
        look()
        assert len(statements) == 1, statements
    finally:
        sa.event.remove(sa.Engine, "before_cursor_execute", note)
    service.store.schedules.create(fields(cron="0 22 * * *", zone="Europe/Berlin", name="nightly"))
    clock.set("2026-01-01T21:00")
    look()
    assert names(service.store) == ["nightly"]


def test_a_schedule_from_before_goes_on_as_before(
    service: Service, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A table that an earlier version read with decimal points beside decimal commas."""
    old, then = (
        {**SPEC, "axes": [{"points": f"gravity [mm/s^2];shaft.load [N*mm]\n{rows}"}], "combine": "zip"}
        for rows in ("20.000;100,5\n25.000;100,5\n", "20;100.5\n25;100.5\n")
    )
    store, look = service.store, Scheduler(service.store).look
    store.schedules.create(read_fields({"spec": old, "cron": "0 22 * * *"}, NEW_YEAR))
    with monkeypatch.context() as patch:
        patch.setattr("sprag_study.service.spec.stored.accepted", lambda *_: then)
        clock.set("2026-01-01T22:00")
        look()
    clock.set("2026-01-02T22:00")
    look()
    made = [store.studies.study(study.id) for study in store.studies.page().studies]
    assert [study.columns(range(2))["gravity"].tolist() for study in made] == [pytest.approx([0.020, 0.025])] * 2


def test_missed_times_become_one_run(service: Service, clock: Clock) -> None:
    kept = service.store.schedules.create(fields(cron="0 * * * *"))
    clock.set("2026-01-01T05:20")
    Scheduler(service.store).look()
    (run,) = service.store.schedules.runs(kept.id)
    assert (run.due, run.missed) == (datetime(2026, 1, 1, 5, tzinfo=UTC), 4)
    assert len(names(service.store)) == 1
    assert service.store.schedules.get(kept.id).next_due == datetime(2026, 1, 1, 6, tzinfo=UTC)


def test_once_is_made_up_for_when_it_was_missed_and_never_again(service: Service, clock: Clock) -> None:
    kept = service.store.schedules.create(fields(at="2026-01-01T02:00"))
    clock.set("2026-01-09T00:00")
    look = Scheduler(service.store).look
    look()
    look()
    assert len(names(service.store)) == 1
    assert service.store.schedules.get(kept.id).next_due is None


def test_two_schedulers_at_once_submit_one_study(settings: Settings, clock: Clock) -> None:
    with (
        Store.open(settings.database_url, clock=clock) as one,
        Store.open(settings.database_url, clock=clock) as other,
    ):
        for number in range(4):
            one.schedules.create(fields(cron="*/5 * * * *", name=str(number)))
        for turn in range(1, 6):
            clock.set(f"2026-01-01T00:{5 * turn:02}")
            gate = threading.Barrier(2)
            faults: list[BaseException] = []

            def look(store: Store, gate: threading.Barrier = gate, faults: list[BaseException] = faults) -> None:
                gate.wait(600)
                try:
                    Scheduler(store).look()
                except BaseException as fault:
                    faults.append(fault)

            threads = [threading.Thread(target=look, args=(store,)) for store in (one, other)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join(600)
            assert faults == []
        assert sorted(names(one)) == sorted(["0", "1", "2", "3"] * 5)


def test_one_key_from_many_threads_keeps_one_schedule(settings: Settings, clock: Clock) -> None:
    with Store.open(settings.database_url, chunking=chunking(settings), clock=clock) as store:
        kept = fields(cron="0 * * * *")
        with ThreadPoolExecutor(8) as threads:
            made = {
                record.id
                for record in threads.map(
                    lambda _: store.schedules.create(kept, idempotency_key="k", body_hash="a"), range(16)
                )
            }
        assert made == {record.id for record in store.schedules.all()}
        assert len(made) == 1


def test_who_saw_it_due_before_another_took_it_takes_nothing(service: Service, clock: Clock) -> None:
    store = service.store
    store.schedules.create(fields(cron="0 * * * *"))
    clock.set("2026-01-01T01:00")
    (seen,) = store.schedules.due(clock.now())
    due, following = clock.now(), clock.now() + timedelta(hours=1)
    assert store.runs.take_due(seen, [DueTime(due)], following, due)
    assert not store.runs.take_due(seen, [DueTime(due)], following, due)
    assert len(store.runs.open()) == 1


def test_a_clock_that_is_put_back_comes_to_no_due_time_twice(service: Service, clock: Clock) -> None:
    look = Scheduler(service.store).look
    kept = service.store.schedules.create(fields(cron="0 * * * *"))
    clock.set("2026-01-01T01:00")
    look()
    clock.set("2026-01-01T00:30")
    service.store.schedules.change(kept.id, fields(cron="0 * * * *", name="changed"))
    clock.set("2026-01-01T01:00")
    look()
    look()
    assert len(names(service.store)) == 1
    assert service.store.schedules.get(kept.id).next_due == datetime(2026, 1, 1, 2, tzinfo=UTC)


def test_a_scheduler_that_dies_as_it_submits_is_made_up_for_once(
    service: Service, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = service.store.schedules.create(fields(at="2026-01-01T02:00"))
    clock.set("2026-01-01T02:00")
    with monkeypatch.context() as patch:
        patch.setattr(
            "sprag_study.service.storage.schedules.runs.inherit_figures", Mock(side_effect=DatabaseBusyError("busy"))
        )
        with pytest.raises(DatabaseBusyError):
            Scheduler(service.store).look()
    assert names(service.store) == [], "neither the study nor its outcome is there"
    assert service.store.schedules.runs(kept.id)[0].state is RunState.TAKEN
    for _ in range(2):
        Scheduler(service.store).look()
    assert len(names(service.store)) == 1
    assert service.store.schedules.runs(kept.id)[0].state is RunState.SUBMITTED


def test_a_spec_that_this_program_does_not_read_is_told(service: Service, clock: Clock) -> None:
    good = fields(at="2026-01-01T02:00")
    kept = service.store.schedules.create(
        ScheduleFields("old", {"sprag": 0}, good.timing, None, 0, fresh=False, enabled=True)
    )
    clock.set("2026-01-01T02:00")
    Scheduler(service.store).look()
    (run,) = service.store.schedules.runs(kept.id)
    assert run.state is RunState.REFUSED
    assert run.problem is not None
    assert "/sprag" in run.problem
    assert names(service.store) == []


def test_a_study_is_held_outside_its_window_and_goes_on_inside(service: Service, clock: Clock) -> None:
    store, look = service.store, Scheduler(service.store).look
    store.schedules.create(fields(at="2026-01-01T12:00", window=["22:00", "06:00"], zone="UTC"))
    clock.set("2026-01-01T12:00")
    look()
    (study,) = store.studies.page().studies
    assert (study.state, study.reason) == (
        StudyState.PAUSED,
        "outside its window, 22:00 to 06:00 (UTC); it continues by itself",
    )
    clock.set("2026-01-01T22:00")
    look()
    assert store.studies.get(study.id).state is StudyState.QUEUED
    clock.set("2026-01-02T06:00")
    look()
    assert store.studies.get(study.id).state is StudyState.PAUSED


def test_the_window_stays_when_the_schedule_is_deleted(service: Service, clock: Clock) -> None:
    store, look = service.store, Scheduler(service.store).look
    kept = store.schedules.create(fields(at="2026-01-01T12:00", window=["22:00", "06:00"]))
    clock.set("2026-01-01T12:00")
    look()
    store.schedules.delete(kept.id)
    with pytest.raises(ScheduleNotFoundError):
        store.schedules.get(kept.id)
    clock.set("2026-01-01T23:00")
    look()
    assert store.studies.page().studies[0].state is StudyState.QUEUED


def test_who_resumes_a_held_study_lifts_its_window(service: Service, clock: Clock) -> None:
    store, look = service.store, Scheduler(service.store).look
    store.schedules.create(fields(at="2026-01-01T12:00", window=["22:00", "06:00"]))
    clock.set("2026-01-01T12:00")
    look()
    (study,) = store.studies.page().studies
    store.studies.resume(study.id)
    look()
    assert store.studies.get(study.id).state is StudyState.QUEUED


def test_who_resumes_a_study_outside_its_window_lifts_it_whatever_held_the_study(
    service: Service, clock: Clock
) -> None:
    store, look = service.store, Scheduler(service.store).look
    store.schedules.create(fields(at="2026-01-01T23:00", window=["22:00", "06:00"], finish_by="05:00"))
    clock.set("2026-01-01T23:00")
    look()
    (study,) = store.studies.page().studies
    store.studies.pause(study.id)
    store.studies.resume(study.id)  # in its window, which stays
    clock.set("2026-01-02T12:00")
    look()
    assert store.studies.get(study.id).state is StudyState.PAUSED
    store.work.time_is_over(store.work.take_over("tests"), study.number)
    assert store.studies.get(study.id).time_over
    store.studies.resume(study.id)
    look()
    assert store.studies.get(study.id).state is StudyState.QUEUED


def test_who_pauses_a_study_keeps_it_paused_in_its_window(service: Service, clock: Clock) -> None:
    store, look = service.store, Scheduler(service.store).look
    store.schedules.create(fields(at="2026-01-01T12:00", window=["22:00", "06:00"]))
    clock.set("2026-01-01T12:00")
    look()
    (study,) = store.studies.page().studies
    store.studies.pause(study.id)
    clock.set("2026-01-01T23:00")
    look()
    assert store.studies.get(study.id).state is StudyState.PAUSED


def test_a_disabled_schedule_is_not_due_and_forgets_what_it_missed(service: Service, clock: Clock) -> None:
    store, look = service.store, Scheduler(service.store).look
    kept = store.schedules.create(fields(cron="0 * * * *", enabled=False))
    assert kept.next_due is None
    clock.set("2026-01-01T03:10")
    look()
    again = store.schedules.change(kept.id, fields(cron="0 * * * *"))
    assert again.next_due == datetime(2026, 1, 1, 4, tzinfo=UTC)
    look()
    assert names(store) == []


def test_a_study_of_a_schedule_can_be_deleted(service: Service, clock: Clock) -> None:
    store = service.store
    kept = store.schedules.create(fields(at="2026-01-01T12:00"))
    clock.set("2026-01-01T12:00")
    Scheduler(store).look()
    (study,) = store.studies.page().studies
    service.fill(study.id)
    store.studies.delete(study.id)
    Scheduler(store).look()
    (run,) = store.schedules.runs(kept.id)
    assert (run.state, run.study) == (RunState.SUBMITTED, None)
    assert names(store) == []


def test_the_thread_looks_again_after_trouble(
    service: Service, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(Scheduler, "look_seconds", 0.001)
    looked = threading.Semaphore(0)

    class Troubled(Scheduler):
        def look(self) -> None:
            looked.release()
            raise DatabaseBusyError("the database is busy")

    scheduler = Troubled(service.store)
    scheduler.start()
    for _ in range(3):
        assert looked.acquire(timeout=600)
    scheduler.stop()
    assert not scheduler.is_alive()
    assert caplog.messages == ["Looking at the schedules failed: the database is busy"]


def test_a_time_that_passes_between_its_check_and_its_storage_is_run(service: Service, clock: Clock) -> None:
    checked, other = fields(at="2026-01-01T02:00"), fields(at="2026-01-01T02:30")
    clock.set("2026-01-01T03:00")
    kept = service.store.schedules.create(checked)
    look = Scheduler(service.store).look
    look()
    service.store.schedules.change(kept.id, other)
    look()
    service.store.schedules.change(kept.id, replace(other, priority=3))
    look()
    assert [run.due.minute for run in service.store.schedules.runs(kept.id)] == [30, 0]
    assert len(names(service.store)) == 2
