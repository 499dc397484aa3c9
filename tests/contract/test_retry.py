"""Running failed cases again: exactly these, in the books and in the rows."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sprag_study.service.storage.errors import NothingToRetryError, StudyNotFoundError
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.studies.records import StudyRecord
from sprag_study.worker import models
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.models import ChunkResult
from sprag_study.worker.ports import Chunk, Finished
from sprag_study.worker.states import StudyState, TransitionError
from tests import postgres
from tests.worker import fakes


@pytest.fixture(scope="module", params=["sqlite", "postgresql"])
def store(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Store]:
    if request.param == "postgresql":
        server: postgres.Server = request.getfixturevalue("postgres_server")
        url = server.url(server.new_database())
    else:
        folder: Path = tmp_path_factory.mktemp("retry")
        url = f"sqlite:///{folder / 'store.sqlite3'}"
    with Store.open(url, chunking=Chunking(cases=10)) as store:
        yield store


def run(store: Store, record: StudyRecord, endings: list[str]) -> list[Chunk]:
    """Run every open chunk so that case N ends as ``endings[N]``; gives the chunks."""
    epoch = store.work.take_over("test")
    chunks = store.work.open_chunks(record.number)
    for chunk in chunks:
        assert store.work.claim(epoch, [chunk]) == [chunk]
        part = endings[chunk.first : chunk.last + 1]
        values = fakes.values(chunk.first, chunk.count)
        assert store.work.commit(epoch, chunk, ChunkResult(chunk.first, part, [""] * chunk.count, values))
    store.work.settle(epoch, record.number)
    return chunks


def made(store: Store, endings: list[str]) -> StudyRecord:
    """An ended study whose cases ended so."""
    record = store.studies.create({}, fakes.study(len(endings)))
    run(store, record, endings)
    return store.studies.get(record.id)


NAMES = st.sampled_from(["ok", "ok", "crashed", "timed_out", "diverged"])


@settings(max_examples=30)  # on each driver
@given(endings=st.lists(NAMES, min_size=1, max_size=45), chosen=st.sets(NAMES.filter(lambda name: name != "ok")))
def test_exactly_the_failed_cases_run_again(store: Store, endings: list[str], chosen: set[str]) -> None:
    record = made(store, endings)
    failed = [case for case, name in enumerate(endings) if (name in chosen if chosen else name != "ok")]
    if not failed:
        with pytest.raises(NothingToRetryError):
            store.studies.retry(record.id, chosen or None)
        assert store.studies.get(record.id) == record
        return
    queued = store.studies.retry(record.id, chosen or None)
    assert (queued.state, queued.done, queued.finished_at) == (StudyState.QUEUED, len(endings) - len(failed), None)
    assert queued.ok == record.ok
    assert queued.revision > record.revision
    kept = [case for case in range(len(endings)) if case not in failed]
    assert store.rows.block(record.id).cases.tolist() == kept
    ran = run(store, record, ["ok"] * len(endings))
    assert [case for chunk in ran for case in range(chunk.first, chunk.last + 1)] == failed
    ended = store.studies.get(record.id)
    assert (ended.state, ended.done) == (StudyState.FINISHED, len(endings))
    progress = store.studies.progress(record.id)
    expected = ["ok" if case in failed else name for case, name in enumerate(endings)]
    assert progress.endings == {name: expected.count(name) for name in set(expected)}
    block = store.rows.block(record.id)
    assert block.endings == expected
    np.testing.assert_array_equal(block.values, fakes.values(0, len(endings)))


def test_what_failed_again_can_be_run_again(store: Store) -> None:
    record = made(store, ["ok"] * 12 + ["crashed"] * 3)
    for _ in range(2):
        store.studies.retry(record.id)
        run(store, record, ["ok"] * 12 + ["crashed"] * 3)
        ended = store.studies.get(record.id)
        assert (ended.state, ended.done, ended.ok) == (StudyState.FINISHED, 15, 12)


def test_speed_is_told_from_the_time_that_was_really_taken(store: Store) -> None:
    clock = fakes.HandClock()
    with fakes.clocked(store, clock):
        record = store.studies.create({}, fakes.study(40))
        epoch = store.work.take_over("test")
        for chunk in store.work.open_chunks(record.number):
            store.work.claim(epoch, [chunk])
            clock.seconds += 5.0
            result = fakes.result(chunk.first, chunk.count)
            result.endings[3] = "diverged"
            store.work.commit(epoch, chunk, result)
        store.work.settle(epoch, record.number)
        assert store.studies.progress(record.id).rate == pytest.approx(2.0)
        clock.seconds += 3600.0
        store.studies.retry(record.id)
        progress = store.studies.progress(record.id)
    assert progress.rate == pytest.approx(2.0, rel=0.01)
    assert progress.seconds_left is not None
    low, high = progress.seconds_left
    assert low <= 2.0 <= high <= 6.0


def test_a_study_that_has_not_ended_or_was_cancelled_is_not_run_again(store: Store) -> None:
    record = store.studies.create({}, fakes.study(5))
    with pytest.raises(TransitionError, match="queued"):
        store.studies.retry(record.id)
    store.studies.cancel(record.id)
    store.work.settle(store.work.take_over("test"), record.number)
    with pytest.raises(TransitionError, match="cancelled"):
        store.studies.retry(record.id)
    with pytest.raises(StudyNotFoundError):
        store.studies.retry("st_nothing")


def test_nothing_to_run_again_is_said(store: Store) -> None:
    record = made(store, [models.OK] * 3)
    with pytest.raises(NothingToRetryError, match="every case of the study ended ok"):
        store.studies.retry(record.id)
    failed = made(store, ["diverged"] * 3)
    with pytest.raises(NothingToRetryError, match="ended as crashed or timed_out"):
        store.studies.retry(failed.id, ["timed_out", "crashed"])
    assert store.studies.retry(failed.id, ["diverged"]).state is StudyState.QUEUED


def test_what_is_kept_keeps_where_it_comes_from(store: Store) -> None:
    """Every tenth case of a study fails; those that are not run again stay attributed to their host."""
    record = store.studies.create({}, fakes.study(100))
    epoch = store.work.take_over("test")
    for chunk in store.work.open_chunks(record.number):
        store.work.claim(epoch, [chunk])
        result = fakes.result(chunk.first, chunk.count)
        result.endings[3] = "chatter"
        assert store.work.exchange(epoch, [Finished(chunk, result, None, f"host {chunk.first % 20}")])[0]
    store.work.settle(epoch, record.number)
    (before,) = {
        (origin.host, origin.fingerprint) for origin in store.rows.origins(record.id) if origin.host == "host 0"
    }
    store.studies.retry(record.id)
    origins = {(origin.host, origin.fingerprint): origin.cases for origin in store.rows.origins(record.id)}
    assert origins == {before: 45, ("host 10", before[1]): 45}
    assert before[1]
    epoch = store.work.take_over("again")
    for chunk in store.work.open_chunks(record.number):
        store.work.claim(epoch, [chunk])
        assert store.work.exchange(epoch, [Finished(chunk, fakes.result(chunk.first, chunk.count), None, "other")])[0]
    store.work.settle(epoch, record.number)
    origins = {(origin.host, origin.fingerprint): origin.cases for origin in store.rows.origins(record.id)}
    assert origins == {before: 45, ("host 10", before[1]): 45, ("other", before[1]): 10}
