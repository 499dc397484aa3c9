"""What every store gives back: rows bit for bit, pages, columns, progress."""

from __future__ import annotations

from collections import Counter
from datetime import UTC, datetime
from typing import Any

import numpy as np
import pytest

from sprag_study.service.storage.rows import rows as cases_of_store
from sprag_study.service.storage.store import Store
from sprag_study.worker import models
from sprag_study.worker.chunking import Chunking
from tests.contract.filling import SPEC, create, finish
from tests.worker import fakes


def test_rows_come_back_bit_for_bit(store: Store) -> None:
    record = create(store)
    epoch = store.work.take_over("test")
    odd = fakes.result(0, 10)
    odd.values[:, :] = (
        np.random.default_rng(1).standard_normal(odd.values.shape) * 10.0 ** np.arange(-300, 300, 60)[:, None]
    )
    counts = [index for index, info in enumerate(models.result_infos("vibration-drive", "1")) if info.kind == "count"]
    odd.values[:, counts] = np.arange(10)[:, None]
    odd.values[3, 0], odd.values[4, counts[0]] = np.nan, np.nan
    odd.flags[2] = "windup_out_of_data"
    chunk = store.work.open_chunks(record.number)[0]
    store.work.claim(epoch, [chunk])
    store.work.commit(epoch, chunk, odd)
    block = store.rows.block(record.id)
    np.testing.assert_array_equal(block.values, odd.values)
    assert block.cases.tolist() == list(range(10))
    rows = list(block.rows())
    assert rows[3].results["shaft.speed.mean"] is None
    assert rows[4].results["clutches.driving_max"] is None
    assert rows[5].results["clutches.driving_max"] == 5
    assert isinstance(rows[5].results["clutches.driving_max"], int)
    assert rows[2].flags == ("windup_out_of_data",)
    assert rows[1].flags == ()


def test_infinities_are_no_numbers(store: Store) -> None:
    record = create(store, 1)
    epoch = store.work.take_over("test")
    (chunk,) = store.work.open_chunks(record.number)
    store.work.claim(epoch, [chunk])
    result = fakes.result(0, 1, "diverged")
    result.values[0, 0] = np.inf
    store.work.commit(epoch, chunk, result)
    row = store.rows.case(record.id, 0)
    assert row is not None
    assert row.results["shaft.speed.mean"] is None


def test_pages_and_streams_give_every_row_once_in_order(store: Store) -> None:
    record = create(store)
    finish(store, record)
    assert store.rows.block(record.id, after_case=7, limit=3).cases.tolist() == [8, 9, 10]
    assert np.concatenate([block.cases for block in store.rows.blocks(record.id, 4)]).tolist() == list(range(25))
    np.testing.assert_array_equal(
        np.concatenate([block.values for block in store.rows.blocks(record.id, 4)]), fakes.values(0, 25)
    )
    assert store.rows.case(record.id, 25) is None


def test_columns_are_aligned_with_the_cases_asked_for(store: Store) -> None:
    record = create(store)
    epoch = store.work.take_over("test")
    for chunk in store.work.open_chunks(record.number)[:2]:
        store.work.claim(epoch, [chunk])
        store.work.commit(epoch, chunk, fakes.result(chunk.first, chunk.count))
    names = ["shaft.speed.max", "shaft.speed.mean"]
    for cases in ([19, 3, 3, 22, 0], list(range(5, 15)), [], [24]):
        found = store.rows.for_cases(record.id, cases, names)
        assert found.cases.tolist() == cases
        assert found.endings == ["ok" if case < 20 else None for case in cases]
        for name, column in (("shaft.speed.max", 1), ("shaft.speed.mean", 0)):
            expected = [case * 1000.0 + column if case < 20 else np.nan for case in cases]
            np.testing.assert_array_equal(found.values[name], expected)
    with pytest.raises(KeyError):
        store.rows.for_cases(record.id, [0], ["no.such"])


def test_many_scattered_cases_are_read_in_several_statements(store: Store) -> None:
    store.dispatchers.base_chunking = Chunking(cases=20_000)
    record = create(store, 20_000)
    finish(store, record)
    cases = np.random.default_rng(2).permutation(20_000)[:12_000]
    found = store.rows.for_cases(record.id, cases, ["shaft.speed.mean"])
    np.testing.assert_array_equal(found.values["shaft.speed.mean"], cases * 1000.0)


def test_progress_counts_and_tells_the_time_left(store: Store, clock: fakes.HandClock) -> None:
    record = create(store, 100)
    assert store.studies.progress(record.id).rate is None
    epoch = store.work.take_over("test")
    for index, chunk in enumerate(store.work.open_chunks(record.number)[:4]):
        store.work.claim(epoch, [chunk])
        clock.seconds += 5.0
        store.work.commit(epoch, chunk, fakes.result(chunk.first, chunk.count, "diverged" if index == 1 else "ok"))
    progress = store.studies.progress(record.id)
    assert (progress.total, progress.done, progress.ok) == (100, 40, 30)
    assert progress.endings == {"ok": 30, "diverged": 10}
    assert progress.rate == pytest.approx(2.0)
    assert progress.seconds_left is not None
    low, high = progress.seconds_left
    assert 10.0 < low < 30.0 < high < 90.0  # four chunks tell little
    store.studies.pause(record.id)
    assert store.studies.progress(record.id).seconds_left is None
    clock.seconds += 1000.0
    store.studies.resume(record.id)
    assert store.studies.progress(record.id).seconds_left == progress.seconds_left


@pytest.mark.parametrize("finish_by", [None, datetime(2126, 1, 1, tzinfo=UTC)], ids=["by number", "coarse to fine"])
def test_kinds_of_a_running_study_are_counted_once_for_each_row(
    store: Store, monkeypatch: pytest.MonkeyPatch, finish_by: datetime | None
) -> None:
    read: list[int] = []

    def counting(*arguments: Any) -> Counter[tuple[str, int | None]]:
        counts = count(*arguments)
        read.append(sum(counts.values()))
        return counts

    count = cases_of_store._count
    monkeypatch.setattr(cases_of_store, "_count", counting)
    record = store.studies.create(SPEC, fakes.study(25, "a study"), finish_by=finish_by)
    epoch = store.work.take_over("test")
    for number, chunk in enumerate(store.work.open_chunks(record.number)):
        result = fakes.result(chunk.first, chunk.count)
        result.flags[:] = ["windup_out_of_data"] * (number + 1) + [""] * (chunk.count - number - 1)
        store.work.claim(epoch, [chunk])
        store.work.commit(epoch, chunk, result)
        if number != 1:  # two chunks between two counts
            assert store.rows.kinds(record.id).flags == {"windup_out_of_data": [1, None, 6][number]}
    store.work.settle(epoch, record.number)
    assert store.rows.kinds(record.id).flags == {"windup_out_of_data": 6}
    assert read == [10, 15]


def test_kinds_are_counted_anew_after_a_retry(store: Store) -> None:
    record = create(store)
    epoch = finish(store, record, "chatter")
    assert store.rows.kinds(record.id).flags == {}
    store.studies.retry(record.id)
    for chunk in store.work.open_chunks(record.number):
        result = fakes.result(chunk.first, chunk.count)
        result.flags[:] = ["windup_out_of_data"] * chunk.count
        store.work.claim(epoch, [chunk])
        store.work.commit(epoch, chunk, result)
        assert store.rows.kinds(record.id).flags == {"windup_out_of_data": chunk.last + 1}
    store.work.settle(epoch, record.number)
    assert store.rows.kinds(record.id).flags == {"windup_out_of_data": 25}
