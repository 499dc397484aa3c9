"""Runs of schedules that are refused for a while, and deadlines that come while a window is closed."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime
from typing import Any

import pytest

from sprag_study.service.jobs.scheduler import Scheduler
from sprag_study.service.schedules.fields import ScheduleFields, change_fields, read_fields
from sprag_study.service.settings import Settings
from sprag_study.service.storage.schedules.runs import RunState
from sprag_study.service.storage.store import Store
from sprag_study.worker.dispatcher import Dispatcher
from sprag_study.worker.executors.inline import InlineExecutor
from sprag_study.worker.states import StudyState
from tests.service.timed_spec import SPEC
from tests.worker import fakes

NEW_YEAR = datetime(2026, 1, 1, tzinfo=UTC)  # where the clock of the tests begins


class Clock(fakes.HandClock):
    """A clock that is set by hand to a time of UTC."""

    def set(self, text: str) -> None:
        """Stand at that time."""
        self.seconds = (datetime.fromisoformat(text).replace(tzinfo=UTC) - NEW_YEAR).total_seconds()


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def store(settings: Settings, clock: Clock) -> Iterator[Store]:
    with Store.open(settings.database_url, clock=clock) as opened:
        yield opened


def fields(**given: Any) -> ScheduleFields:
    return read_fields({"spec": SPEC, **given}, NEW_YEAR)


def test_a_deadline_outside_the_window_is_kept(store: Store, clock: Clock) -> None:
    look = Scheduler(store).look
    store.schedules.create(fields(at="2026-01-01T00:26", window=["00:25", "00:27"], finish_by="00:28"))
    clock.set("2026-01-01T00:26")
    look()
    (study,) = store.studies.page().studies
    clock.set("2026-01-01T00:27")
    look()
    assert (store.studies.get(study.id).reason or "").startswith("outside its window")
    clock.set("2026-01-01T00:29")
    look()
    turns = iter(range(10))
    Dispatcher(store.work, InlineExecutor(fakes.run), clock).run(lambda: next(turns) == 9)
    held = store.studies.get(study.id)
    assert (held.state, held.time_over) == (StudyState.PAUSED, True)
    assert (held.reason or "").startswith("its deadline passed at 2026-01-01T00:28:00+00:00: 0 of 9 cases are done")
    assert store.work.active_studies() == []
    clock.set("2026-01-02T00:25")
    look()
    assert store.studies.get(study.id) == held, "the window that opens again does not let it go on"
    assert store.studies.resume(study.id).state is StudyState.QUEUED


def test_what_was_refused_for_a_reason_that_passes_is_tried_again(
    store: Store, clock: Clock, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    look = Scheduler(store).look
    kept = store.schedules.create(fields(at="2026-01-01T22:00", finish_by="06:00"))
    clock.set("2026-01-01T22:00")
    with monkeypatch.context() as patch:
        patch.setattr("sprag_study.service.jobs.submission.MAX_WAITING_STUDIES", 0)
        for _ in range(3):
            look()
        (run,) = store.schedules.runs(kept.id)
        assert (run.state, run.problem) == (
            RunState.TAKEN,
            "0 studies have not ended yet. It is tried again until 2026-01-02T06:00:00+00:00.",
        )
        clock.set("2026-01-02T01:00")
        look()
    assert store.studies.page().studies == ()
    assert caplog.text.count("its study is not submitted yet") == 1
    clock.set("2026-01-02T01:01")
    look()
    (study,) = store.studies.page().studies
    assert study.finish_by == datetime(2026, 1, 2, 6, tzinfo=UTC)
    (run,) = store.schedules.runs(kept.id)
    assert (run.state, run.problem) == (RunState.SUBMITTED, None)


def put_off(store: Store, clock: Clock, monkeypatch: pytest.MonkeyPatch, **given: Any) -> str:
    """The id of a schedule that was due at 22:00 and was refused for a reason that passes at once."""
    kept = store.schedules.create(fields(**given))
    clock.set("2026-01-01T22:00")
    with monkeypatch.context() as patch:
        patch.setattr("sprag_study.service.jobs.submission.MAX_WAITING_STUDIES", 0)
        Scheduler(store).look()
    return kept.id


@pytest.mark.parametrize(
    ("given", "studies"),
    [
        ({"at": "2026-01-01T22:00"}, 0),
        ({"at": "2026-01-01T22:00", "finish_by": "06:00"}, 0),
        ({"cron": "0 22 * * *"}, 1),  # that of the day before, which was missed
    ],
)
def test_a_worker_that_starts_after_the_grace_submits_it_no_more(
    store: Store, clock: Clock, monkeypatch: pytest.MonkeyPatch, given: dict[str, Any], studies: int
) -> None:
    kept = put_off(store, clock, monkeypatch, **given)
    clock.set("2026-01-04T09:00")
    Scheduler(store).look()
    assert len(store.studies.page().studies) == studies
    run = store.schedules.runs(kept)[-1]
    assert (run.state, run.problem) == (RunState.REFUSED, "0 studies have not ended yet.")


def test_a_paused_schedule_is_tried_no_more(store: Store, clock: Clock, monkeypatch: pytest.MonkeyPatch) -> None:
    kept = put_off(store, clock, monkeypatch, cron="0 22 * * *")
    changed = change_fields(store.schedules.get(kept).fields, {"enabled": False}, clock.now())
    store.schedules.change(kept, changed)
    Scheduler(store).look()
    assert store.studies.page().studies == ()
    (run,) = store.schedules.runs(kept)
    assert (run.state, run.problem) == (RunState.REFUSED, "The schedule was paused before a study was submitted.")


def test_a_schedule_that_is_paused_as_its_study_is_checked_gets_none(
    store: Store, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = store.schedules.create(fields(at="2026-01-01T22:00"))
    clock.set("2026-01-01T22:00")

    def pausing() -> int:
        store.schedules.change(kept.id, change_fields(kept.fields, {"enabled": False}, clock.now()))
        return 10**15

    monkeypatch.setattr(store.room, "left", pausing)
    Scheduler(store).look()
    assert store.studies.page().studies == ()
    (run,) = store.schedules.runs(kept.id)
    assert (run.state, run.problem) == (RunState.REFUSED, "The schedule was paused before a study was submitted.")


def test_a_held_study_follows_the_window_of_its_schedule(store: Store, clock: Clock) -> None:
    look = Scheduler(store).look
    kept = store.schedules.create(fields(at="2026-01-01T12:00", window=["22:00", "06:00"]))
    clock.set("2026-01-01T12:00")
    look()
    look()
    (study,) = store.studies.page().studies
    assert study.reason == "outside its window, 22:00 to 06:00 (UTC); it continues by itself"
    for window, reason in (
        (["20:00", "06:00"], "outside its window, 20:00 to 06:00 (UTC); it continues by itself"),
        (None, None),
    ):
        changed = change_fields(store.schedules.get(kept.id).fields, {"window": window}, clock.now())
        store.schedules.change(kept.id, changed)
        look()
        assert store.studies.get(study.id).reason == reason
    assert store.studies.get(study.id).state is StudyState.QUEUED


@pytest.mark.parametrize(
    ("given", "end"),
    [
        ({"at": "2026-01-01T22:00"}, "2026-01-02T10:00"),
        ({"at": "2026-01-01T22:00", "finish_by": "1 h"}, "2026-01-01T23:00"),
        ({"cron": "0 * * * *"}, "2026-01-01T02:00"),
    ],
)
def test_a_refusal_that_does_not_pass_within_the_grace_is_final(
    store: Store, clock: Clock, monkeypatch: pytest.MonkeyPatch, given: dict[str, Any], end: str
) -> None:
    monkeypatch.setattr("sprag_study.service.jobs.submission.MAX_WAITING_STUDIES", 0)
    look = Scheduler(store).look
    kept = store.schedules.create(fields(**given))
    clock.set(given.get("at", "2026-01-01T01:00"))
    look()
    assert store.schedules.runs(kept.id)[0].state is RunState.TAKEN
    clock.set(end)
    look()
    assert store.schedules.runs(kept.id)[-1].state is RunState.REFUSED
    assert store.studies.page().studies == ()
