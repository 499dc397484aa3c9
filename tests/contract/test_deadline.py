"""Studies with a deadline, run coarse to fine: what every store must do, against orders written out by hand."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from datetime import timedelta

import numpy as np
import pytest

from sprag_study.service.storage.errors import NothingToRetryError
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.studies.records import InTime, StudyRecord
from sprag_study.worker import models
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.models import ChunkResult
from sprag_study.worker.ports import Chunk
from sprag_study.worker.states import StudyState
from sprag_study.worker.study import Axis, Study
from tests.worker import fakes

HOUR = timedelta(hours=1)
#: Nine values: both ends, the middle, the quarters, the eighths.
ORDER = [0, 8, 4, 2, 6, 1, 3, 5, 7]


@pytest.fixture
def store(url: str, clock: fakes.HandClock) -> Iterator[Store]:
    with Store.open(url, chunking=Chunking(cases=2), clock=clock) as store:
        yield store


def create(store: Store, study: Study | None = None, fresh: bool = False) -> StudyRecord:
    return store.studies.create({}, study or fakes.study(9), finish_by=store.clock.now() + HOUR, fresh=fresh)


def run(store: Store, epoch: int, record: StudyRecord, chunk: Chunk, bad: frozenset[int] = frozenset()) -> list[int]:
    """Run a chunk as the dispatcher does; gives the cases that had to be run."""
    assert store.work.claim(epoch, [chunk]) == [chunk]
    known = store.work.known(store.studies.study(record.id), chunk)
    assert known is not None
    cases = known.missing
    values = np.concatenate([fakes.values(int(case), 1) for case in cases] or [np.empty((0, fakes.RESULTS))])
    endings = ["diverged" if case in bad else "ok" for case in cases.tolist()]
    assert store.work.commit(epoch, chunk, ChunkResult(0, endings, [""] * cases.size, values), known)
    found: list[int] = cases.tolist()
    return found


def test_chunks_are_taken_coarse_to_fine_and_rows_keep_their_numbers(store: Store) -> None:
    record = create(store)
    epoch = store.work.take_over("test")
    ran = []
    for chunk in store.work.open_chunks(record.number):
        ran.append(run(store, epoch, record, chunk))
        done = sorted(case for cases in ran for case in cases)
        assert store.rows.block(record.id).cases.tolist() == done
    assert [sorted(ORDER[first : first + 2]) for first in range(0, 9, 2)] == ran
    assert store.work.settle(epoch, record.number) is StudyState.FINISHED
    block = store.rows.block(record.id)
    np.testing.assert_array_equal(block.values, fakes.values(0, 9))
    ended = store.studies.get(record.id)
    assert (ended.done, ended.ok, ended.coarse, ended.finish_by) == (9, 9, True, record.finish_by)


def test_progress_tells_which_coarser_grid_is_complete(store: Store) -> None:
    record = create(store)
    epoch = store.work.take_over("test")
    chunks = store.work.open_chunks(record.number)
    found = []
    # The second is done last: until then only the first two values are complete.
    for chunk in (chunks[0], chunks[2], chunks[1], *chunks[3:]):
        run(store, epoch, record, chunk)
        covered = store.studies.progress(record.id).covered
        assert covered is not None
        found.append((covered.complete, covered.total, covered.cases, covered.values))
    assert found == [(1, 4, 2, (2,)), (1, 4, 2, (2,)), (3, 4, 5, (5,)), (3, 4, 5, (5,)), (4, 4, 9, (9,))]
    plain = store.studies.create({}, fakes.study(9))
    assert store.studies.progress(plain.id).covered is None


def test_at_the_deadline_the_study_is_held_and_says_what_it_has(store: Store, clock: fakes.HandClock) -> None:
    record = create(store)
    epoch = store.work.take_over("test")
    chunks = store.work.open_chunks(record.number)
    for chunk in chunks[:3]:
        run(store, epoch, record, chunk)
    assert [study.finish_by for study in store.work.active_studies()] == [record.finish_by]
    clock.seconds += 3600.0
    assert store.work.claim(epoch, chunks[3:]) == []
    store.work.time_is_over(epoch, record.number)
    held = store.studies.get(record.id)
    assert (held.state, held.done, held.time_over, held.over) == (StudyState.PAUSED, 6, True, True)
    assert (store.work.active_studies(), store.figures.current().waiting) == ([], 0)
    assert held.reason is not None
    for part in ("its deadline passed at 20", "+00:00", "6 of 9 cases", "pass 3 of 4 is complete, a grid of 5 values"):
        assert part in held.reason
    store.work.time_is_over(epoch, record.number)
    assert store.studies.get(record.id) == held
    resumed = store.studies.resume(record.id)
    assert (resumed.state, resumed.finish_by, resumed.coarse) == (StudyState.QUEUED, None, True)
    assert "has not responded since" in (resumed.reason or "")  # no worker has told of itself for an hour
    assert (resumed.time_over, len(store.work.active_studies()), store.figures.current().waiting) == (False, 1, 3)
    assert store.work.open_chunks(record.number) == chunks[3:]
    for chunk in chunks[3:]:
        run(store, epoch, record, chunk)
    assert store.work.settle(epoch, record.number) is StudyState.FINISHED


def test_a_deadline_that_is_still_to_come_stays_when_the_study_is_resumed(store: Store) -> None:
    record = create(store)
    store.studies.pause(record.id)
    assert store.studies.resume(record.id).finish_by == record.finish_by


def test_a_study_whose_time_was_over_is_pruned_like_one_that_ended(store: Store, clock: fakes.HandClock) -> None:
    record = create(store)
    epoch = store.work.take_over("test")
    clock.seconds += 3600.0
    store.work.time_is_over(epoch, record.number)
    waiting = create(store)
    assert store.purging.prune(clock.now()) == []
    clock.seconds += 1.0
    assert store.purging.prune(clock.now()) == [record.id]
    assert [study.id for study in store.studies.page().studies] == [waiting.id]


def test_a_study_that_was_just_through_comes_to_its_end_and_not_to_a_halt(store: Store) -> None:
    record = create(store)
    epoch = store.work.take_over("test")
    for chunk in store.work.open_chunks(record.number):
        run(store, epoch, record, chunk)
    store.work.time_is_over(epoch, record.number)
    assert store.studies.get(record.id).state is StudyState.FINISHED


def test_failed_cases_run_again_and_no_others(store: Store, clock: fakes.HandClock) -> None:
    record, bad = create(store), frozenset({8, 2, 3, 7})
    epoch = store.work.take_over("test")
    for chunk in store.work.open_chunks(record.number):
        run(store, epoch, record, chunk, bad)
    store.work.settle(epoch, record.number)
    clock.seconds += 7200.0
    queued = store.studies.retry(record.id)
    assert (queued.done, queued.finish_by) == (5, None)
    assert store.rows.block(record.id).cases.tolist() == [0, 1, 4, 5, 6]
    again = [run(store, epoch, record, chunk) for chunk in store.work.open_chunks(record.number)]
    assert sorted(case for cases in again for case in cases) == sorted(bad)
    assert store.work.settle(epoch, record.number) is StudyState.FINISHED
    np.testing.assert_array_equal(store.rows.block(record.id).values, fakes.values(0, 9))
    assert store.studies.progress(record.id).endings == {"ok": 9}
    with pytest.raises(NothingToRetryError):
        store.studies.retry(record.id)


def test_a_chunk_that_crashes_is_split_down_to_its_case(store: Store) -> None:
    record = create(store)
    epoch = store.work.take_over("test")
    chunk = store.work.open_chunks(record.number)[1]
    store.work.claim(epoch, [chunk])
    parts = [Chunk(record.number, 2, 1), Chunk(record.number, 3, 1)]
    store.work.split(epoch, chunk, parts, "its process died")
    assert store.work.claim(epoch, parts) == parts
    store.work.quarantine(epoch, parts[1], "crashed", "its process died")
    assert {row.case: row.ending for row in store.rows.block(record.id).rows()} == {ORDER[3]: "crashed"}


def test_cases_that_were_never_run_are_told_of_a_cancelled_study(store: Store) -> None:
    record = create(store)
    epoch = store.work.take_over("test")
    for chunk in store.work.open_chunks(record.number)[:2]:
        run(store, epoch, record, chunk)
    store.studies.cancel(record.id)
    store.work.settle(epoch, record.number)
    covered = store.studies.progress(record.id).covered
    assert covered is not None
    assert (covered.complete, covered.cases) == (2, 3), "the two ends, the middle, and one of the next pass"
    page = store.rows.page(record.id)
    assert page.cases.tolist() == list(range(9))
    assert [case for case, ending in zip(page.cases.tolist(), page.endings, strict=True) if ending == "ok"] == [
        0,
        2,
        4,
        8,
    ]
    assert store.rows.page(record.id, after_case=4, limit=2).cases.tolist() == [5, 6]


def test_rows_are_taken_from_a_study_that_was_held_at_its_deadline_and_by_one(store: Store) -> None:
    first = create(store)
    epoch = store.work.take_over("test")
    for chunk in store.work.open_chunks(first.number)[:2]:
        run(store, epoch, first, chunk)
    more = fakes.study(9)
    more = replace(more, axes=(Axis(("shaft.load",), (*more.axes[0].values, 0.1)),))
    assert store.reuse.count(more) == 4
    second = create(store, more)
    ran = [run(store, epoch, second, chunk) for chunk in store.work.open_chunks(second.number)]
    # Ten values now, by rank: 0 and 9; 4; 2 and 6; 1, 3, 5, 7; 8. Of them 0, 2, 4 and 8 are known.
    assert ran == [[9], [], [1, 6], [3, 5], [7]]
    assert store.studies.get(second.id).reused == 4
    block = store.rows.block(second.id)
    assert block.cases.tolist() == list(range(10))
    np.testing.assert_array_equal(block.values, fakes.values(0, 10))
    assert store.studies.progress(second.id).endings == {"ok": 10}
    assert store.studies.get(second.id).ok == 10


def test_whether_it_will_be_in_time_follows_from_the_interval(store: Store, clock: fakes.HandClock) -> None:
    record = create(store)
    assert store.studies.progress(record.id).in_time is None
    epoch = store.work.take_over("test")
    for chunk in store.work.open_chunks(record.number)[:3]:
        assert store.work.claim(epoch, [chunk]) == [chunk]
        clock.seconds += 10.0
        known = store.work.known(store.studies.study(record.id), chunk)
        store.work.commit(epoch, chunk, ChunkResult(0, [models.OK] * 2, [""] * 2, fakes.values(0, 2)), known)
    progress = store.studies.progress(record.id)
    assert progress.seconds_left is not None
    low, high = progress.seconds_left
    for seconds, expected in ((high + 1.0, InTime.YES), ((low + high) / 2.0, InTime.UNSURE), (low - 1.0, InTime.NO)):
        assert record.finish_by is not None
        assert replace(progress, asked_at=record.finish_by - timedelta(seconds=seconds)).in_time is expected
    # 0.2 cases a second: ten seconds more are two cases more than the six.
    assert record.finish_by is not None
    assert replace(progress, asked_at=record.finish_by - timedelta(seconds=10.0)).done_by_then == 8
    assert replace(progress, asked_at=record.finish_by + HOUR).done_by_then == 6
