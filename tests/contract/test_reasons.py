"""Reasons keep their values on every database: each reader gets the whole sentence in his language."""

from __future__ import annotations

import json
from datetime import UTC, datetime, time

import pytest
import sqlalchemy as sa

from sprag_study.sentences import Amount, Sentence
from sprag_study.service.languages import language, recorded
from sprag_study.service.reading.reader import shown_stored
from sprag_study.service.schedules.fields import read_fields
from sprag_study.service.schedules.outcomes import Outcome
from sprag_study.service.schedules.policies import DueTime
from sprag_study.service.schedules.times import Window
from sprag_study.service.storage.schedules.tables import SCHEDULE_RUNS
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.tables import STUDIES
from tests.contract.filling import create
from tests.service.timed_spec import SPEC

NEW_YEAR = datetime(2026, 1, 1, tzinfo=UTC)  # where the clock of the tests begins
FULL = Sentence(recorded.NO_ROOM, limit=Sentence(recorded.DISK, path="/data", free=Amount(3.2, digits=3)))
ENGLISH = "no room: the disk that holds /data has 3.2 MB left; the study continues when there is room"
UKRAINIAN = "бракує місця: на диску, де лежить /data, залишилося 3,2 МБ; дослідження продовжиться, коли місце з’явиться"
WINDOW = Sentence(recorded.OUTSIDE_WINDOW, window=Window(time(22), time(6), "Europe/Kyiv").sentence)


def in_ukrainian(text: str | None) -> str:
    with language("uk"):
        return shown_stored(text or "")


@pytest.mark.parametrize("how", ["hold", "fault", "note", "window"])
def test_the_reason_of_a_study_is_whole_in_every_language(store: Store, how: str) -> None:
    record = create(store)
    epoch = store.work.take_over("test")
    if how == "hold":
        store.work.hold(epoch, FULL, returned=False)
        assert in_ukrainian(store.room.full()) == UKRAINIAN
    elif how == "fault":
        store.work.fault(epoch, record.number, FULL)
    elif how == "note":
        store.work.note(epoch, record.number, FULL)
        noted = store.studies.get(record.id)
        store.work.note(epoch, record.number, FULL)
        assert store.studies.get(record.id).revision == noted.revision
    else:
        store.schedules.hold_for_window(record.number, WINDOW)
        store.schedules.hold_for_window(record.number, FULL)
    reason = store.studies.get(record.id).reason
    assert reason == ENGLISH
    assert isinstance(reason, Sentence)
    assert in_ukrainian(reason) == UKRAINIAN
    (listed,) = store.studies.page().studies
    assert in_ukrainian(listed.reason) == UKRAINIAN
    store.studies.resume(record.id) if how != "note" else store.work.note(epoch, record.number, None)
    with store.session.read() as connection:
        kept = connection.execute(sa.select(STUDIES.c.reason, STUDIES.c.reason_values)).one()
    assert tuple(kept) == (None, None)


def test_a_reason_that_an_earlier_release_wrote_is_read_as_before(store: Store) -> None:
    record = create(store)
    epoch = store.work.take_over("test")
    store.work.fault(epoch, record.number, WINDOW)
    with store.session.write() as connection:
        connection.execute(sa.update(STUDIES).values(reason=ENGLISH))
    reason = store.studies.get(record.id).reason
    assert (reason, isinstance(reason, Sentence)) == (ENGLISH, False)
    assert in_ukrainian(reason) == UKRAINIAN.replace("3,2", "3.2")


def test_the_problem_of_a_due_time_keeps_its_values(store: Store) -> None:
    schedule = store.schedules.create(read_fields({"spec": SPEC, "cron": "@hourly"}, NEW_YEAR))
    assert schedule.next_due is not None
    assert store.runs.take_due(schedule, [DueTime(schedule.next_due)], None, schedule.next_due)
    (run,) = store.runs.open()
    problem = Sentence(recorded.TRIED_AGAIN, problem=Sentence(recorded.MANY_STUDIES, count="64"), time="06:00")
    store.runs.put_off(run, problem)
    (run,) = store.runs.open()
    assert run.problem == "64 studies have not ended yet. It is tried again until 06:00."
    assert in_ukrainian(run.problem) == "Досліджень, які ще не закінчилися: 64. Спроби повторюються до 06:00."
    (expected,) = store.runs.expected(store.clock.now().replace(year=2027))
    assert in_ukrainian(expected.problem) == in_ukrainian(problem)
    store.runs.close(run, problem)
    (closed,) = store.schedules.runs(schedule.id)
    assert in_ukrainian(closed.problem) == in_ukrainian(closed.outcome.reason) == in_ukrainian(problem)
    with store.session.read() as connection:
        assert connection.execute(sa.select(SCHEDULE_RUNS.c.problem)).scalar_one() == str(problem)
    (ended,) = store.runs.ended()
    assert store.runs.conclude(ended, ended.outcome)
    with store.session.read() as connection:
        kept = connection.execute(sa.select(SCHEDULE_RUNS.c.outcome)).scalar_one()
    assert in_ukrainian(Outcome.of_json(json.loads(kept)).reason) == in_ukrainian(problem)
