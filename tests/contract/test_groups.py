"""Several chunks in one transaction: all of what is ours is stored, counted and claimed, or nothing is."""

from __future__ import annotations

import dataclasses
from collections import Counter

import numpy as np
import pytest
import sqlalchemy as sa

from sprag_study.service.storage.rows.origins import Origin, names_of
from sprag_study.service.storage.store import Store
from sprag_study.worker import fingerprint, models
from sprag_study.worker.models import ChunkResult
from sprag_study.worker.ports import Chunk, EpochLostError, Finished
from sprag_study.worker.reuse import no_cases
from sprag_study.worker.states import StudyState
from tests.contract.filling import SPEC, create
from tests.worker import fakes

COUNTS = [index for index, info in enumerate(models.result_infos("vibration-drive", "1")) if info.kind == "count"]


def _varied(first: int, count: int, seed: int) -> ChunkResult:
    """A result with several endings, flags of several lengths and numbers that are missing."""
    draw = np.random.default_rng(seed)
    values = draw.standard_normal((count, fakes.RESULTS)) * 10.0 ** draw.integers(-300, 300, (count, 1))
    values[:, COUNTS] = draw.integers(0, 2**31 - 1, (count, len(COUNTS)))
    values[draw.random(values.shape) < 0.2] = np.nan
    endings = draw.choice([models.OK, "diverged", "no_motion"], count).tolist()
    flags = draw.choice(["", "irregular", "irregular,windup_out_of_data"], count).tolist()
    return ChunkResult(first, endings, flags, values)


def _open(store: Store, *cases: int) -> tuple[int, list[Chunk]]:
    """An epoch, and the chunks of new studies with that many cases."""
    records = [create(store, count, f"study {count}") for count in cases]
    return store.work.take_over("test"), [
        chunk for record in records for chunk in store.work.open_chunks(record.number)
    ]


def _by_id(store: Store) -> dict[int, str]:
    return {record.number: record.id for record in store.studies.page().studies}


def test_chunks_of_several_studies_are_stored_and_counted_together(store: Store) -> None:
    epoch, chunks = _open(store, 25, 30)
    assert store.work.claim(epoch, chunks) == chunks
    results = {chunk: _varied(chunk.first, chunk.count, seed) for seed, chunk in enumerate(chunks)}
    stored, claimed = store.work.exchange(epoch, [Finished(chunk, results[chunk]) for chunk in reversed(chunks)])
    assert (set(stored), claimed) == (set(chunks), [])
    for number, study_id in _by_id(store).items():
        expected = [results[chunk] for chunk in chunks if chunk.study == number]
        rows = store.rows.block(study_id)
        np.testing.assert_array_equal(rows.values, np.concatenate([result.values for result in expected]))
        assert list(rows.endings) == [ending for result in expected for ending in result.endings]
        assert [",".join(row.flags) for row in rows.rows()] == [text for result in expected for text in result.flags]
        progress = store.studies.progress(study_id)
        assert progress.endings == Counter(rows.endings)
        assert (progress.done, progress.ok) == (len(rows), progress.endings[models.OK])
        assert store.work.open_chunks(number) == []


def test_the_next_chunks_are_claimed_with_the_rows(store: Store) -> None:
    epoch, chunks = _open(store, 25, 5)
    first, last = chunks[0], chunks[-1]
    store.work.claim(epoch, [first])
    stored, claimed = store.work.exchange(epoch, [Finished(first, fakes.result(0, 10))], chunks[1:])
    assert (stored, claimed) == ([first], chunks[1:])
    ids = _by_id(store)
    assert store.studies.get(ids[last.study]).state is StudyState.RUNNING
    assert store.work.claim(epoch, chunks) == []


def test_chunks_keep_where_they_were_computed(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    epoch, chunks = _open(store, 50)
    store.work.claim(epoch, chunks)
    (study_id,) = _by_id(store).values()
    assert store.rows.origins(study_id) == ()
    monkeypatch.setattr(fingerprint, "digest", lambda: "one")
    group = [
        Finished(chunk, fakes.result(chunk.first, chunk.count), host=host)
        for chunk, host in zip(chunks[:3], ("left", "right", "left"), strict=True)
    ]
    store.work.exchange(epoch, group)
    monkeypatch.setattr(fingerprint, "digest", lambda: "two")
    store.work.exchange(epoch, [Finished(chunks[3], fakes.result(30, 10), host="left")])
    store.work.quarantine(epoch, chunks[4], "crashed", "its process died")
    assert store.rows.origins(study_id) == (
        Origin("left", "one", 2, 20),
        Origin("left", "two", 1, 10),
        Origin("right", "one", 1, 10),
        Origin(None, None, 1, 10),
    )


def test_copied_rows_keep_where_they_were_computed(store: Store) -> None:
    first = create(store, 50)
    epoch = store.work.take_over("test")
    chunks = store.work.open_chunks(first.number)
    store.work.claim(epoch, chunks)
    hosts = ("left", "left", "right", "far", "far")
    store.work.exchange(
        epoch,
        [
            Finished(chunk, fakes.result(chunk.first, chunk.count), host=host)
            for chunk, host in zip(chunks, hosts, strict=True)
        ],
    )
    store.work.settle(epoch, first.number)
    study = fakes.study(50, "another name")
    second = store.studies.create(SPEC, study)
    for chunk in store.work.open_chunks(second.number):
        known = store.work.known(study, chunk)
        assert known is not None
        assert known.cases.size == chunk.count
        store.work.claim(epoch, [chunk])
        store.work.exchange(epoch, [Finished(chunk, no_cases(study), known)])
    digest = fingerprint.digest()
    assert store.rows.origins(second.id) == (
        Origin("far", digest, 2, 20),
        Origin("left", digest, 2, 20),
        Origin("right", digest, 1, 10),
    )
    third = store.studies.create(SPEC, fakes.study(15, "a smaller one"))
    for chunk in store.work.open_chunks(third.number):
        store.work.claim(epoch, [chunk])
        known = store.work.known(study, chunk)
        store.work.exchange(epoch, [Finished(chunk, no_cases(study), known)])
    assert {origin.host for origin in store.rows.origins(third.id)} == {"left"}


def test_more_hosts_than_there_is_room_for_are_cut() -> None:
    assert names_of([]) is None
    assert names_of(["b", "a", "b"]) == "a, b"
    text = names_of(f"host-{number:03}" for number in range(100))
    assert text is not None
    assert len(text) <= 255
    assert text.startswith("host-000, host-001, ")
    assert text.endswith(", ...")


def test_a_chunk_that_is_not_ours_is_left_out_of_its_group(store: Store) -> None:
    epoch, chunks = _open(store, 30)
    store.work.claim(epoch, chunks[:2])
    other = dataclasses.replace(chunks[0], count=5)
    group = [Finished(chunk, fakes.result(chunk.first, chunk.count)) for chunk in (other, *chunks[1:])]
    assert store.work.exchange(epoch, group)[0] == [chunks[1]]
    (study_id,) = _by_id(store).values()
    assert store.rows.block(study_id).cases.tolist() == list(range(10, 20))
    assert store.studies.get(study_id).done == 10
    assert store.work.claim(epoch, [dataclasses.replace(chunks[2], count=5)]) == []


@pytest.mark.parametrize("fault", ["a key twice", "another epoch"])
def test_a_group_that_cannot_be_stored_changes_nothing(store: Store, fault: str) -> None:
    epoch, chunks = _open(store, 30)
    store.work.claim(epoch, chunks[:2])
    group = [Finished(chunk, fakes.result(chunk.first, chunk.count)) for chunk in chunks[:2]]
    if fault == "a key twice":
        table = "vibration_drive_1"
        with store.session.write() as connection:
            connection.exec_driver_sql(
                f"INSERT INTO {table} (study, case_number, ending, flags) VALUES ({chunks[0].study}, 15, 'ok', '')"
            )
        with pytest.raises(sa.exc.DBAPIError):
            store.work.exchange(epoch, group, chunks[2:])
        with store.session.write() as connection:
            connection.exec_driver_sql(f"DELETE FROM {table}")
    else:
        with pytest.raises(EpochLostError):
            store.work.exchange(store.work.take_over("another") - 1, group, chunks[2:])
    (study_id,) = _by_id(store).values()
    assert (len(store.rows.block(study_id)), store.studies.get(study_id).done) == (0, 0)
    epoch = store.work.take_over("a third")
    assert store.work.claim(epoch, chunks) == chunks
    assert len(store.work.exchange(epoch, group)[0]) == 2


def test_a_count_that_the_column_cannot_hold_is_refused_by_its_name(store: Store) -> None:
    epoch, chunks = _open(store, 10)
    store.work.claim(epoch, chunks)
    result = fakes.result(0, 10)
    result.values[3, COUNTS[0]] = 2.0**31
    if store.session.on_server:
        with pytest.raises(OverflowError, match="clutches_driving_max has a value outside -2147483648 to 2147483647"):
            store.work.commit(epoch, chunks[0], result)
        result.values[3, COUNTS[0]] -= 1.0
    assert store.work.commit(epoch, chunks[0], result)
    row = store.rows.case(next(iter(_by_id(store).values())), 3)
    assert row is not None
    assert row.results["clutches.driving_max"] == result.values[3, COUNTS[0]]
