"""What every store does for the dispatcher: claims, rows, endings, holding and settling."""

from __future__ import annotations

import re

import numpy as np
import pytest
import sqlalchemy as sa

from sprag.service.storage.dispatchers import CLAIMED
from sprag.service.storage.owners import run_owner
from sprag.service.storage.store import Store
from sprag.service.storage.tables import CHUNKS
from sprag.worker.ports import Chunk, EpochLostError
from sprag.worker.states import StudyState
from tests.contract.filling import SPEC, create, finish
from tests.worker import fakes


def test_claims_are_granted_once_and_only_while_the_study_may_run(store: Store) -> None:
    record = create(store)
    epoch = store.take_over("test")
    chunks = store.open_chunks(record.number)
    assert store.claim(epoch, chunks[:2]) == chunks[:2]
    assert store.get_study(record.id).state is StudyState.RUNNING
    assert store.claim(epoch, chunks) == chunks[2:]
    store.put_back(epoch, chunks[0], "")
    store.pause_study(record.id)
    assert store.claim(epoch, chunks) == []
    store.resume_study(record.id)
    assert store.claim(epoch, chunks) == chunks[:1]
    assert store.claim(epoch, [Chunk(99, 0, 10), Chunk(record.number, 5, 10)]) == []


def test_rows_are_there_exactly_once(store: Store) -> None:
    record = create(store)
    epoch = store.take_over("test")
    chunk = store.open_chunks(record.number)[0]
    assert not store.commit(epoch, chunk, fakes.result(0, 10))
    store.claim(epoch, [chunk])
    assert store.commit(epoch, chunk, fakes.result(0, 10))
    assert not store.commit(epoch, chunk, fakes.result(0, 10))
    assert len(store.case_rows(record.id)) == 10
    found = store.get_study(record.id)
    assert (found.done, found.ok) == (10, 10)


def test_a_new_epoch_takes_over_and_the_old_one_can_do_nothing(store: Store) -> None:
    record = create(store)
    old = store.take_over("old")
    chunk = store.open_chunks(record.number)[0]
    store.claim(old, [chunk])
    new = store.take_over("new")
    assert new > old
    before = store.get_study(record.id)
    for act in (
        lambda: store.claim(old, [chunk]),
        lambda: store.commit(old, chunk, fakes.result(0, 10)),
        lambda: store.put_back(old, chunk, ""),
        lambda: store.split(old, chunk, [], ""),
        lambda: store.quarantine(old, chunk, "crashed", ""),
        lambda: store.fault(old, record.number, ""),
        lambda: store.begin_again(old, record.number),
        lambda: store.hold(old, "no room", returned=False),
        lambda: store.let_go(old),
        lambda: store.settle(old, record.number),
        lambda: store.heartbeat(old, fakes.report()),
        lambda: store.release(old),
    ):
        with pytest.raises(EpochLostError, match="another dispatcher"):
            act()
    assert store.get_study(record.id) == before
    assert store.claim(new, [chunk]) == [chunk]
    dispatcher = store.dispatcher()
    assert dispatcher is not None
    assert (dispatcher.owner, dispatcher.epoch) == ("new", new)


def test_the_study_of_a_run_that_was_killed_is_held_and_no_other(store: Store) -> None:
    asked, other = create(store), create(store)
    owner = run_owner("host:12", asked.id)
    first = store.take_over(owner)
    store.claim(first, [*store.open_chunks(asked.number)[:1], *store.open_chunks(other.number)[:1]])
    store.take_over(owner)  # the same run, once more
    assert store.get_study(asked.id).state is StudyState.RUNNING
    store.take_over("worker")
    held = store.get_study(asked.id)
    assert held.state is StudyState.PAUSED
    assert held.reason is not None
    assert held.reason.startswith("`sprag run` (process host:12) ended before its study did; resume the study")
    assert store.get_study(other.id).state is StudyState.RUNNING
    assert store.resume_study(asked.id).state is StudyState.QUEUED
    store.take_over("another worker")
    assert store.get_study(asked.id).state is StudyState.QUEUED


def test_a_run_that_came_to_its_end_leaves_nothing_to_hold(store: Store) -> None:
    record = create(store)
    finish(store, record)
    store.take_over(run_owner("host:12", record.id))
    store.take_over("worker")
    assert store.get_study(record.id).state is StudyState.FINISHED


def test_a_stale_result_of_a_returned_claim_is_dropped(store: Store) -> None:
    record = create(store)
    epoch = store.take_over("test")
    chunk = store.open_chunks(record.number)[0]
    store.claim(epoch, [chunk])
    store.begin_again(epoch, record.number)
    assert not store.commit(epoch, chunk, fakes.result(0, 10))
    assert len(store.case_rows(record.id)) == 0


def test_a_result_of_other_cases_is_a_fault_of_the_program(store: Store) -> None:
    record = create(store)
    epoch = store.take_over("test")
    chunk = store.open_chunks(record.number)[0]
    store.claim(epoch, [chunk])
    with pytest.raises(ValueError, match="does not belong to"):
        store.commit(epoch, chunk, fakes.result(0, 9))


def test_failures_are_remembered_and_parts_replace_the_whole(store: Store) -> None:
    record = create(store)
    epoch = store.take_over("test")
    chunk = store.open_chunks(record.number)[0]
    store.claim(epoch, [chunk])
    failed = Chunk(record.number, 0, 10, failures=1)
    store.put_back(epoch, failed, "its process died")
    assert store.open_chunks(record.number)[0] == failed
    store.claim(epoch, [failed])
    parts = [Chunk(record.number, 0, 5, 1), Chunk(record.number, 5, 5, 1)]
    store.split(epoch, failed, parts, "its process died")
    assert store.open_chunks(record.number)[:2] == parts


def test_quarantine_is_an_ending_without_results(store: Store) -> None:
    record = create(store, 1)
    epoch = store.take_over("test")
    (chunk,) = store.open_chunks(record.number)
    store.claim(epoch, [chunk])
    store.quarantine(epoch, chunk, "crashed", "its process died")
    row = store.case_row(record.id, 0)
    assert row is not None
    assert row.ending == "crashed"
    assert set(row.results.values()) == {None}
    assert store.settle(epoch, record.number) is StudyState.FAILED
    assert "crashed" in (store.get_study(record.id).reason or "")


def test_a_note_stands_until_it_is_taken_away_or_the_study_starts(store: Store) -> None:
    record = create(store)
    epoch = store.take_over("test")
    store.note(epoch, record.number, "wait for it")
    noted = store.get_study(record.id)
    assert (noted.state, noted.reason) == (StudyState.QUEUED, "wait for it")
    assert noted.revision > record.revision
    store.claim(epoch, store.open_chunks(record.number)[:1])
    assert store.get_study(record.id).reason is None
    store.note(epoch, record.number, "once more")
    assert store.get_study(record.id).reason == "once more"
    store.note(epoch, record.number, None)
    cleared = store.get_study(record.id)
    assert cleared.reason is None
    store.note(epoch, record.number, None)
    assert store.get_study(record.id).revision == cleared.revision
    store.pause_study(record.id)
    store.note(epoch, record.number, "too late")
    assert store.get_study(record.id).reason is None
    store.take_over("another")
    with pytest.raises(EpochLostError):
        store.note(epoch, record.number, "not ours")


def test_a_fault_holds_the_study_without_blame(store: Store) -> None:
    record = create(store)
    epoch = store.take_over("test")
    chunks = store.open_chunks(record.number)
    store.claim(epoch, chunks)
    store.put_back(epoch, Chunk(record.number, 0, 10, failures=1), "")
    store.fault(epoch, record.number, "engine fault")
    held = store.get_study(record.id)
    assert (held.state, held.reason) == (StudyState.PAUSED, "engine fault")
    assert store.open_chunks(record.number) == chunks
    assert store.resume_study(record.id).reason is None
    assert store.claim(epoch, chunks) == chunks


def test_to_begin_again_returns_every_claim_and_takes_the_blame_from_one_study(store: Store) -> None:
    record, other = create(store), create(store)
    epoch = store.take_over("test")
    for study in (record, other):
        chunks = store.open_chunks(study.number)
        store.claim(epoch, chunks)
        store.put_back(epoch, Chunk(study.number, 0, 10, failures=1), "")
    store.begin_again(epoch, record.number)
    assert store.get_study(record.id).state is StudyState.RUNNING
    assert [chunk.failures for chunk in store.open_chunks(record.number)] == [0, 0, 0]
    assert [chunk.failures for chunk in store.open_chunks(other.number)] == [1, 0, 0]
    for study in (record, other):
        assert len(store.claim(epoch, store.open_chunks(study.number))) == 3


def test_studies_are_held_while_there_is_no_room_and_go_on_unless_somebody_chose_otherwise(store: Store) -> None:
    queued, running, paused, stays, cancelled = (create(store, name=str(number)) for number in range(5))
    epoch = store.take_over("test")
    store.claim(epoch, store.open_chunks(running.number)[:1])
    store.pause_study(paused.id)
    store.hold(epoch, "the disk is full", returned=False)
    for study in (queued, running, stays, cancelled):
        held = store.get_study(study.id)
        assert (held.state, held.reason) == (StudyState.PAUSED, "the disk is full")
    assert [study.waits_for_room for study in store.active_studies()] == [True, True, False, True, True]
    assert store.pause_study(stays.id).reason is None
    store.cancel_study(cancelled.id)
    store.let_go(epoch)
    states = {study.number: study.state for study in store.active_studies()}
    assert states == {
        queued.number: StudyState.QUEUED,
        running.number: StudyState.QUEUED,
        paused.number: StudyState.PAUSED,
        stays.number: StudyState.PAUSED,
        cancelled.number: StudyState.CANCELLING,
    }
    assert store.get_study(queued.id).reason is None


def test_the_highest_priority_comes_first(store: Store) -> None:
    low, usual, high, late = (store.create_study(SPEC, fakes.study(5), priority=priority) for priority in (-1, 0, 5, 0))
    order = [low.number, usual.number, high.number, late.number]
    active = store.active_studies()
    assert [study.number for study in active] == [order[2], order[1], order[3], order[0]]
    assert [study.priority for study in active] == [5, 0, 0, -1]
    changed = store.prioritize_study(low.id, 9)
    assert (changed.priority, changed.revision) == (9, low.revision + 1)
    assert store.prioritize_study(low.id, 9).revision == changed.revision
    assert store.active_studies()[0].number == low.number


@pytest.mark.parametrize(("ending", "state"), [("ok", StudyState.FINISHED), ("diverged", StudyState.FAILED)])
def test_a_study_is_failed_when_no_case_is_ok(store: Store, ending: str, state: StudyState) -> None:
    record = create(store)
    finish(store, record, ending)
    ended = store.get_study(record.id)
    assert ended.state is state
    assert ended.finished_at is not None
    assert store.active_studies() == []


def test_settling_waits_for_open_chunks_unless_cancelled(store: Store) -> None:
    record = create(store)
    epoch = store.take_over("test")
    chunk = store.open_chunks(record.number)[0]
    store.claim(epoch, [chunk])
    assert store.settle(epoch, record.number) is StudyState.RUNNING
    store.commit(epoch, chunk, fakes.result(0, 10))
    store.cancel_study(record.id)
    assert store.settle(epoch, record.number) is StudyState.CANCELLED
    assert store.open_chunks(record.number) == []
    assert store.settle(epoch, record.number) is StudyState.CANCELLED
    assert len(store.case_rows(record.id)) == 10


def test_cases_that_a_cancelled_study_never_ran_are_cancelled(store: Store) -> None:
    record = create(store, 35)
    epoch = store.take_over("test")
    for chunk in store.open_chunks(record.number)[1::2]:  # 10 .. 19 and 30 .. 34
        store.claim(epoch, [chunk])
        store.commit(epoch, chunk, fakes.result(chunk.first, chunk.count))
    assert store.case_row(record.id, 0) is None
    store.cancel_study(record.id)
    assert store.case_page(record.id, ending="cancelled").cases.tolist() == []
    store.settle(epoch, record.number)
    row = store.case_row(record.id, 25)
    assert row is not None
    assert (row.ending, row.flags, set(row.results.values())) == ("cancelled", (), {None})
    ran = [*range(10, 20), *range(30, 35)]
    never = [case for case in range(35) if case not in ran]
    assert store.case_page(record.id, ending="cancelled").cases.tolist() == never
    assert store.case_page(record.id, 4, 17, ending="cancelled").cases.tolist() == never[5:22]
    assert store.case_page(record.id, ending="ok").cases.tolist() == ran
    page = store.case_page(record.id, 5, 20)
    assert page.cases.tolist() == list(range(6, 26))
    assert page.endings == ["cancelled"] * 4 + ["ok"] * 10 + ["cancelled"] * 6
    np.testing.assert_array_equal(page.values[4:14], fakes.values(10, 10))
    assert store.rows_for_cases(record.id, [34, 0, 12], []).endings == ["ok", "cancelled", "ok"]
    assert np.concatenate([block.cases for block in store.iter_rows(record.id, 4)]).tolist() == ran
    assert store.case_row(record.id, 35) is None


def test_an_ending_that_no_case_has_is_not_searched_for(store: Store) -> None:
    record = create(store, 25)
    epoch = store.take_over("test")
    for chunk, ending in zip(store.open_chunks(record.number), ("ok", "diverged", "ok"), strict=True):
        store.claim(epoch, [chunk])
        store.commit(epoch, chunk, fakes.result(chunk.first, chunk.count, ending))
    assert store.case_page(record.id, 4, 100, "diverged").cases.tolist() == list(range(10, 20))
    assert store.case_page(record.id, 12, 3, "diverged").cases.tolist() == [13, 14, 15]
    asked: list[str] = []

    def note(*given: object) -> None:
        asked.append(str(given[2]))

    sa.event.listen(sa.Engine, "before_cursor_execute", note)
    try:
        assert len(store.case_page(record.id, ending="crashed")) == 0
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
    epoch = store.take_over("test")
    (chunk,) = store.open_chunks(record.number)
    store.claim(epoch, [chunk])
    store.cancel_study(record.id)
    assert store.commit(epoch, chunk, fakes.result(0, 5))
    assert store.settle(epoch, record.number) is StudyState.FINISHED
