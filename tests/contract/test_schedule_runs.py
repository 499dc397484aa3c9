"""Due times of schedules on every database: each has one outcome, and a study only together with it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from threading import Thread

import pytest

from sprag_study.service.schedules.fields import change_fields, read_fields
from sprag_study.service.schedules.outcomes import Result
from sprag_study.service.schedules.policies import DueTime
from sprag_study.service.storage.errors import RunClosedError
from sprag_study.service.storage.people.audit import AuditFilter
from sprag_study.service.storage.schedules.runs import OpenRun, RunState, ScheduleRecord
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.studies.study_row import study_row
from tests.service.timed_spec import SPEC
from tests.worker import fakes

NEW_YEAR = datetime(2026, 1, 1, tzinfo=UTC)  # where the clock of the tests begins
End = Callable[[Store, ScheduleRecord], None]


def pause(store: Store, schedule: ScheduleRecord) -> None:
    store.schedules.change(schedule.id, change_fields(schedule.fields, {"enabled": False}, store.clock.now()))


def delete(store: Store, schedule: ScheduleRecord) -> None:
    store.schedules.delete(schedule.id)


def submit(store: Store, run: OpenRun) -> None:
    store.studies.insert(study_row(SPEC, fakes.study(1), store.dispatchers.chunking, ()), run=run)


@pytest.fixture
def schedule(store: Store) -> ScheduleRecord:
    """A schedule whose first due time was taken up."""
    record = store.schedules.create(read_fields({"spec": SPEC, "cron": "@hourly"}, NEW_YEAR))
    assert record.next_due is not None
    assert store.runs.take_due(record, [DueTime(record.next_due)], None, record.next_due)
    return record


@pytest.mark.parametrize(("end", "verb"), [(pause, "paused"), (delete, "deleted")])
def test_a_run_that_was_refused_in_the_meantime_gets_no_study(
    store: Store, schedule: ScheduleRecord, end: End, verb: str
) -> None:
    (run,) = store.runs.open()
    end(store, schedule)
    with pytest.raises(RunClosedError):
        submit(store, run)
    store.runs.put_off(run, "no room")
    store.runs.close(run, "given up")
    assert store.studies.page().studies == ()
    (found,) = store.runs.between(NEW_YEAR, datetime(2027, 1, 1, tzinfo=UTC), 9)  # those of deleted schedules too
    assert found.outcome.result is Result.REFUSED
    assert found.outcome.reason == f"The schedule was {verb} before a study was submitted."
    (refused,) = store.audit.rows(AuditFilter(action="schedule.refuse"))
    assert (refused.target, refused.detail["due"]) == (schedule.id, "2026-01-01T01:00:00.000000Z")


def test_a_run_gets_one_study(store: Store, schedule: ScheduleRecord) -> None:
    (run,) = store.runs.open()
    submit(store, run)
    with pytest.raises(RunClosedError):
        submit(store, run)
    store.runs.close(run, "given up", skipped=True)
    pause(store, schedule)
    (study,) = store.studies.page().studies
    (found,) = store.schedules.runs(schedule.id)
    assert (found.state, found.study, found.problem) == (RunState.SUBMITTED, study.id, None)
    assert list(store.audit.rows(AuditFilter(action="schedule.refuse"))) == []


@pytest.fixture
def other(url: str, store: Store) -> Iterator[Store]:
    """The same database, as another process opens it."""
    with Store.open(url, clock=store.clock) as opened:
        yield opened


def test_of_two_processes_that_submit_and_pause_one_is_first(
    store: Store, other: Store, schedule: ScheduleRecord
) -> None:
    (run,) = store.runs.open()
    refused = []

    def submitting() -> None:
        try:
            submit(other, run)
        except RunClosedError as error:
            refused.append(error)

    threads = [Thread(target=submitting), Thread(target=pause, args=(store, schedule))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    (found,) = store.schedules.runs(schedule.id)
    studies = len(store.studies.page().studies)
    assert (found.state, studies) == ((RunState.REFUSED, 0) if refused else (RunState.SUBMITTED, 1))
