"""What every store does for the dispatcher: claims, rows, endings, holding and settling."""

from __future__ import annotations

import re

import numpy as np
import pytest
import sqlalchemy as sa

from sprag_study.service.storage.store import Store
from sprag_study.service.storage.tables import CHUNKS
from sprag_study.service.storage.work.dispatchers import CLAIMED, run_owner
from sprag_study.worker.ports import Chunk, EpochLostError
from sprag_study.worker.states import StudyState
from tests.contract.conftest import EVERY_DRIVER
from tests.contract.filling import SPEC, create, finish
from tests.worker import fakes

pytestmark = EVERY_DRIVER


def test_claims_are_granted_once_and_only_while_the_study_may_run(store: Store) -> None:
    record = create(store)
    epoch = store.work.take_over("test")
    chunks = store.work.open_chunks(record.number)
    assert store.work.claim(epoch, chunks[:2]) == chunks[:2]
    assert store.studies.get(record.id).state is StudyState.RUNNING
    assert store.work.claim(epoch, chunks) == chunks[2:]
    store.work.put_back(epoch, chunks[0], "")
    store.studies.pause(record.id)
    assert store.work.claim(epoch, chunks) == []
    store.studies.resume(record.id)
    assert store.work.claim(epoch, chunks) == chunks[:1]
    assert store.work.claim(epoch, [Chunk(99, 0, 10), Chunk(record.number, 5, 10)]) == []


def test_rows_are_there_exactly_once(store: Store) -> None:
    record = create(store)
    epoch = store.work.take_over("test")
    chunk = store.work.open_chunks(record.number)[0]
    assert not store.work.commit(epoch, chunk, fakes.result(0, 10))
    store.work.claim(epoch, [chunk])
    assert store.work.commit(epoch, chunk, fakes.result(0, 10))
    assert not store.work.commit(epoch, chunk, fakes.result(0, 10))
    assert len(store.rows.block(record.id)) == 10
    found = store.studies.get(record.id)
    assert (found.done, found.ok) == (10, 10)


def test_a_new_epoch_takes_over_and_the_old_one_can_do_nothing(store: Store) -> None:
    record = create(store)
    old = store.work.take_over("old")
    chunk = store.work.open_chunks(record.number)[0]
    store.work.claim(old, [chunk])
    new = store.work.take_over("new")
    assert new > old
    before = store.studies.get(record.id)
    for act in (
        lambda: store.work.claim(old, [chunk]),
        lambda: store.work.commit(old, chunk, fakes.result(0, 10)),
        lambda: store.work.put_back(old, chunk, ""),
        lambda: store.work.split(old, chunk, [], ""),
        lambda: store.work.quarantine(old, chunk, "crashed", ""),
        lambda: store.work.fault(old, record.number, ""),
        lambda: store.work.begin_again(old, record.number),
        lambda: store.work.hold(old, "no room", returned=False),
        lambda: store.work.let_go(old),
        lambda: store.work.settle(old, record.number),
        lambda: store.work.heartbeat(old, fakes.report()),
        lambda: store.work.release(old),
    ):
        with pytest.raises(EpochLostError, match="another dispatcher"):
            act()
    assert store.studies.get(record.id) == before
    assert store.work.claim(new, [chunk]) == [chunk]
    dispatcher = store.dispatchers.latest()
    assert dispatcher is not None
    assert (dispatcher.owner, dispatcher.epoch) == ("new", new)


def test_the_study_of_a_run_that_was_killed_is_held_and_no_other(store: Store) -> None:
    asked, other = create(store), create(store)
    owner = run_owner("host:12", asked.id)
    first = store.work.take_over(owner)
    store.work.claim(first, [*store.work.open_chunks(asked.number)[:1], *store.work.open_chunks(other.number)[:1]])
    store.work.take_over(owner)  # the same run, once more
    assert store.studies.get(asked.id).state is StudyState.RUNNING
    store.work.take_over("worker")
    held = store.studies.get(asked.id)
    assert held.state is StudyState.PAUSED
    assert held.reason is not None
    assert held.reason.startswith("`sprag run` (process host:12) ended before its study did; resume the study")
    assert store.studies.get(other.id).state is StudyState.RUNNING
    assert store.studies.resume(asked.id).state is StudyState.QUEUED
    store.work.take_over("another worker")
    assert store.studies.get(asked.id).state is StudyState.QUEUED


def test_a_run_that_came_to_its_end_leaves_nothing_to_hold(store: Store) -> None:
    record = create(store)
    finish(store, record)
    store.work.take_over(run_owner("host:12", record.id))
    store.work.take_over("worker")
    assert store.studies.get(record.id).state is StudyState.FINISHED


def test_a_stale_result_of_a_returned_claim_is_dropped(store: Store) -> None:
    record = create(store)
    epoch = store.work.take_over("test")
    chunk = store.work.open_chunks(record.number)[0]
    store.work.claim(epoch, [chunk])
    store.work.begin_again(epoch, record.number)
    assert not store.work.commit(epoch, chunk, fakes.result(0, 10))
    assert len(store.rows.block(record.id)) == 0


def test_a_result_of_other_cases_is_a_fault_of_the_program(store: Store) -> None:
    record = create(store)
    epoch = store.work.take_over("test")
    chunk = store.work.open_chunks(record.number)[0]
    store.work.claim(epoch, [chunk])
    with pytest.raises(ValueError, match="does not belong to"):
        store.work.commit(epoch, chunk, fakes.result(0, 9))


def test_failures_are_remembered_and_parts_replace_the_whole(store: Store) -> None:
    record = create(store)
    epoch = store.work.take_over("test")
    chunk = store.work.open_chunks(record.number)[0]
    store.work.claim(epoch, [chunk])
    failed = Chunk(record.number, 0, 10, failures=1)
    store.work.put_back(epoch, failed, "its process died")
    assert store.work.open_chunks(record.number)[0] == failed
    store.work.claim(epoch, [failed])
    parts = [Chunk(record.number, 0, 5, 1), Chunk(record.number, 5, 5, 1)]
    store.work.split(epoch, failed, parts, "its process died")
    assert store.work.open_chunks(record.number)[:2] == parts


def test_quarantine_is_an_ending_without_results(store: Store) -> None:
    record = create(store, 1)
    epoch = store.work.take_over("test")
    (chunk,) = store.work.open_chunks(record.number)
    store.work.claim(epoch, [chunk])
    store.work.quarantine(epoch, chunk, "crashed", "its process died")
    row = store.rows.case(record.id, 0)
    assert row is not None
    assert row.ending == "crashed"
    assert set(row.results.values()) == {None}
    assert store.work.settle(epoch, record.number) is StudyState.FAILED
    assert "crashed" in (store.studies.get(record.id).reason or "")


def test_a_note_stands_until_it_is_taken_away_or_the_study_starts(store: Store) -> None:
    record = create(store)
    epoch = store.work.take_over("test")
    store.work.note(epoch, record.number, "wait for it")
    noted = store.studies.get(record.id)
    assert (noted.state, noted.reason) == (StudyState.QUEUED, "wait for it")
    assert noted.revision > record.revision
    store.work.claim(epoch, store.work.open_chunks(record.number)[:1])
    assert store.studies.get(record.id).reason is None
    store.work.note(epoch, record.number, "once more")
    assert store.studies.get(record.id).reason == "once more"
    store.work.note(epoch, record.number, None)
    cleared = store.studies.get(record.id)
    assert cleared.reason is None
    store.work.note(epoch, record.number, None)
    assert store.studies.get(record.id).revision == cleared.revision
    store.studies.pause(record.id)
    store.work.note(epoch, record.number, "too late")
    assert store.studies.get(record.id).reason is None
    store.work.take_over("another")
    with pytest.raises(EpochLostError):
        store.work.note(epoch, record.number, "not ours")


def test_a_fault_holds_the_study_without_blame(store: Store) -> None:
    record = create(store)
    epoch = store.work.take_over("test")
    chunks = store.work.open_chunks(record.number)
    store.work.claim(epoch, chunks)
    store.work.put_back(epoch, Chunk(record.number, 0, 10, failures=1), "")
    store.work.fault(epoch, record.number, "engine fault")
    held = store.studies.get(record.id)
    assert (held.state, held.reason) == (StudyState.PAUSED, "engine fault")
    assert store.work.open_chunks(record.number) == chunks
    assert store.studies.resume(record.id).reason is None
    assert store.work.claim(epoch, chunks) == chunks


def test_to_begin_again_returns_every_claim_and_takes_the_blame_from_one_study(store: Store) -> None:
    record, other = create(store), create(store)
    epoch = store.work.take_over("test")
    for study in (record, other):
        chunks = store.work.open_chunks(study.number)
        store.work.claim(epoch, chunks)
        store.work.put_back(epoch, Chunk(study.number, 0, 10, failures=1), "")
    store.work.begin_again(epoch, record.number)
    assert store.studies.get(record.id).state is StudyState.RUNNING
    assert [chunk.failures for chunk in store.work.open_chunks(record.number)] == [0, 0, 0]
    assert [chunk.failures for chunk in store.work.open_chunks(other.number)] == [1, 0, 0]
    for study in (record, other):
        assert len(store.work.claim(epoch, store.work.open_chunks(study.number))) == 3


def test_studies_are_held_while_there_is_no_room_and_go_on_unless_somebody_chose_otherwise(store: Store) -> None:
    queued, running, paused, stays, cancelled = (create(store, name=str(number)) for number in range(5))
    epoch = store.work.take_over("test")
    store.work.claim(epoch, store.work.open_chunks(running.number)[:1])
    store.studies.pause(paused.id)
    store.work.hold(epoch, "the disk is full", returned=False)
    for study in (queued, running, stays, cancelled):
        held = store.studies.get(study.id)
        assert (held.state, held.reason) == (StudyState.PAUSED, "the disk is full")
    assert [study.waits_for_room for study in store.work.active_studies()] == [True, True, False, True, True]
    assert store.studies.pause(stays.id).reason is None
    store.studies.cancel(cancelled.id)
    store.work.let_go(epoch)
    states = {study.number: study.state for study in store.work.active_studies()}
    assert states == {
        queued.number: StudyState.QUEUED,
        running.number: StudyState.QUEUED,
        paused.number: StudyState.PAUSED,
        stays.number: StudyState.PAUSED,
        cancelled.number: StudyState.CANCELLING,
    }
    assert store.studies.get(queued.id).reason is None


def test_the_highest_priority_comes_first(store: Store) -> None:
    low, usual, high, late = (
        store.studies.create(SPEC, fakes.study(5), priority=priority) for priority in (-1, 0, 5, 0)
    )
    order = [low.number, usual.number, high.number, late.number]
    active = store.work.active_studies()
    assert [study.number for study in active] == [order[2], order[1], order[3], order[0]]
    assert [study.priority for study in active] == [5, 0, 0, -1]
    changed = store.studies.prioritize(low.id, 9)
    assert (changed.priority, changed.revision) == (9, low.revision + 1)
    assert store.studies.prioritize(low.id, 9).revision == changed.revision
    assert store.work.active_studies()[0].number == low.number


@pytest.mark.parametrize(("ending", "state"), [("ok", StudyState.FINISHED), ("diverged", StudyState.FAILED)])
def test_a_study_is_failed_when_no_case_is_ok(store: Store, ending: str, state: StudyState) -> None:
    record = create(store)
    finish(store, record, ending)
    ended = store.studies.get(record.id)
    assert ended.state is state
    assert ended.finished_at is not None
    assert store.work.active_studies() == []


def test_settling_waits_for_open_chunks_unless_cancelled(store: Store) -> None:
    record = create(store)
    epoch = store.work.take_over("test")
    chunk = store.work.open_chunks(record.number)[0]
    store.work.claim(epoch, [chunk])
    assert store.work.settle(epoch, record.number) is StudyState.RUNNING
    store.work.commit(epoch, chunk, fakes.result(0, 10))
    store.studies.cancel(record.id)
    assert store.work.settle(epoch, record.number) is StudyState.CANCELLED
    assert store.work.open_chunks(record.number) == []
    assert store.work.settle(epoch, record.number) is StudyState.CANCELLED
    assert len(store.rows.block(record.id)) == 10


def test_cases_that_a_cancelled_study_never_ran_are_cancelled(store: Store) -> None:
    record = create(store, 35)
    epoch = store.work.take_over("test")
    for chunk in store.work.open_chunks(record.number)[1::2]:  # 10 .. 19 and 30 .. 34
        store.work.claim(epoch, [chunk])
        store.work.commit(epoch, chunk, fakes.result(chunk.first, chunk.count))
    assert store.rows.case(record.id, 0) is None
    store.studies.cancel(record.id)
    assert store.rows.page(record.id, ending="cancelled").cases.tolist() == []
    store.work.settle(epoch, record.number)
    row = store.rows.case(record.id, 25)
    assert row is not None
    assert (row.ending, row.flags, set(row.results.values())) == ("cancelled", (), {None})
    ran = [*range(10, 20), *range(30, 35)]
    never = [case for case in range(35) if case not in ran]
    assert store.rows.page(record.id, ending="cancelled").cases.tolist() == never
    assert store.rows.page(record.id, 4, 17, ending="cancelled").cases.tolist() == never[5:22]
    assert store.rows.page(record.id, ending="ok").cases.tolist() == ran
    page = store.rows.page(record.id, 5, 20)
    assert page.cases.tolist() == list(range(6, 26))
    assert page.endings == ["cancelled"] * 4 + ["ok"] * 10 + ["cancelled"] * 6
    np.testing.assert_array_equal(page.values[4:14], fakes.values(10, 10))
    assert store.rows.for_cases(record.id, [34, 0, 12], []).endings == ["ok", "cancelled", "ok"]
    assert np.concatenate([block.cases for block in store.rows.blocks(record.id, 4)]).tolist() == ran
    assert store.rows.case(record.id, 35) is None


def test_an_ending_that_no_case_has_is_not_searched_for(store: Store) -> None:
    record = create(store, 25)
    epoch = store.work.take_over("test")
    for chunk, ending in zip(store.work.open_chunks(record.number), ("ok", "diverged", "ok"), strict=True):
        store.work.claim(epoch, [chunk])
        store.work.commit(epoch, chunk, fakes.result(chunk.first, chunk.count, ending))
    assert store.rows.page(record.id, 4, 100, "diverged").cases.tolist() == list(range(10, 20))
    assert store.rows.page(record.id, 12, 3, "diverged").cases.tolist() == [13, 14, 15]
    asked: list[str] = []

    def note(*given: object) -> None:
        asked.append(str(given[2]))

    sa.event.listen(sa.Engine, "before_cursor_execute", note)
    try:
        assert len(store.rows.page(record.id, ending="crashed")) == 0
    finally:
        sa.event.remove(sa.Engine, "before_cursor_execute", note)
    assert asked
    assert not [statement for statement in asked if "vibration_drive_1" in statement]


def test_claims_are_returned_without_reading_every_chunk(store: Store) -> None:
    statement = sa.update(CHUNKS).where(CLAIMED).values(state="waiting")
    text = str(statement.compile(dialect=store.session.dialect, compile_kwargs={"literal_binds": True}))
    if store.session.on_server:
        with store.session.write() as connection:
            connection.exec_driver_sql("SET LOCAL enable_seqscan = off")  # it reads small tables whole, and rightly so
            plan = " ".join(connection.exec_driver_sql(f"EXPLAIN {text}").scalars())
        assert "Seq Scan on chunks" not in plan
        assert re.search(r"Index Scan (using|on) \w*chunks", plan)
        return
    with store.session.write() as connection:
        plan = " ".join(str(row[3]) for row in connection.exec_driver_sql(f"EXPLAIN QUERY PLAN {text}"))
    assert "SCAN chunks" not in plan
    assert "SEARCH chunks USING" in plan


def test_a_cancelled_study_whose_last_chunk_came_through_is_finished(store: Store) -> None:
    record = create(store, 5)
    epoch = store.work.take_over("test")
    (chunk,) = store.work.open_chunks(record.number)
    store.work.claim(epoch, [chunk])
    store.studies.cancel(record.id)
    assert store.work.commit(epoch, chunk, fakes.result(0, 5))
    assert store.work.settle(epoch, record.number) is StudyState.FINISHED
