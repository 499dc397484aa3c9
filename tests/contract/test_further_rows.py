"""Cases with several rows: all of them or none are stored, read, copied and removed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa

from sprag_study.service.storage.rows.columns import records
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.studies.copying import copy_study
from sprag_study.service.storage.tables import further_table
from sprag_study.worker import models
from sprag_study.worker.models import ChunkResult, FurtherRows
from sprag_study.worker.ports import Known
from sprag_study.worker.study import Study
from tests.worker import fakes

STARTS = {"count": 4, "seed": 1, "ranges": {"shaft.initial_speed": [0.0, 30.0]}, "values": {}}
RUN = {
    "until": "settled", "at_most": 1000, "settled": 1e-8, "max_period": 32, "tolerance": 1e-9, "reset": "contact",
    "starts": STARTS,
}  # fmt: skip
INFOS = models.result_infos("vibration-drive", "1-starts")
NUMBER = [info.name for info in INFOS].index("regime.number")
SPEED = "shaft.speed.mean"


def _study(name: str = "starts") -> Study:
    return replace(fakes.study(4, name), run=RUN)


def _result(*further: tuple[int, int]) -> ChunkResult:
    """The rows of all four cases; ``further`` has the case and the number of each further one."""
    values = np.zeros((4, len(INFOS)))
    values[:, 0] = np.arange(4)
    more = np.zeros((len(further), len(INFOS)))
    more[:, 0] = [10.0 * number + case for case, number in further]
    more[:, NUMBER] = [number for _, number in further]
    of = np.array([case for case, _ in further], dtype=np.int64)
    flags = ["irregular"] * len(further)
    return ChunkResult(0, [models.OK] * 4, [""] * 4, values, FurtherRows(of, flags, more))


def _filled(store: Store, result: ChunkResult) -> tuple[str, int]:
    record = store.studies.create({"sprag": 1}, _study())
    epoch = store.work.take_over("test")
    (chunk,) = store.work.open_chunks(record.number)
    store.work.claim(epoch, [chunk])
    store.work.commit(epoch, chunk, result)
    store.work.settle(epoch, record.number)
    return record.id, record.number


def _count(store: Store) -> int:
    table = further_table("vibration-drive", "1-starts")
    assert table is not None
    with store.session.read() as connection:
        found: int = connection.execute(sa.select(sa.func.count()).select_from(table)).scalar_one()
    return found


def _speeds(rows: Any) -> list[tuple[int, object]]:
    return [(row.case, row.results[SPEED]) for row in rows]


def test_rows_of_a_case_come_back_in_order(store: Store) -> None:
    study_id, _ = _filled(store, _result((2, 1), (2, 2), (0, 1)))
    every = [(0, 0.0), (0, 10.0), (1, 1.0), (2, 2.0), (2, 12.0), (2, 22.0), (3, 3.0)]
    assert _speeds(store.rows.block(study_id).rows()) == every
    assert _speeds(row for block in store.rows.blocks(study_id, 2) for row in block.rows()) == every
    assert _speeds(store.rows.of_case(study_id, 2)) == [(2, 2.0), (2, 12.0), (2, 22.0)]
    assert [row.flags for row in store.rows.of_case(study_id, 0)] == [(), ("irregular",)]
    assert _speeds(store.rows.page(study_id).rows()) == [(case, float(case)) for case in range(4)]


def test_a_study_is_copied_into_another_database(store: Store, tmp_path: Path) -> None:
    _filled(store, _result())
    study_id, _ = _filled(store, _result((2, 1), (2, 2), (0, 1)))
    with Store.open(f"sqlite:///{tmp_path / 'copy.sqlite3'}") as copy:
        copy_study(store.session, copy.session, study_id)
        assert _speeds(copy.rows.block(study_id).rows()) == _speeds(store.rows.block(study_id).rows())
        assert copy.studies.get(study_id) == store.studies.get(study_id)
        assert _count(copy) == 3
        assert copy.check().problems == store.check().problems


def test_a_number_chooses_among_the_rows_of_each_case(store: Store) -> None:
    study_id, _ = _filled(store, _result((2, 1), (2, 2), (0, 1)))
    first = store.rows.for_cases(study_id, [2, 0, 1], [SPEED])
    assert first.values[SPEED].tolist() == [2.0, 0.0, 1.0]
    second = store.rows.for_cases(study_id, [2, 0, 1], [SPEED], number=1)
    assert second.endings == [models.OK] * 3
    np.testing.assert_array_equal(second.values[SPEED], [12.0, 10.0, np.nan])


def test_a_failure_between_two_rows_of_columns_is_an_error_of_the_database(store: Store) -> None:
    """Drivers raise errors of their own there, which become DatabaseErrors where the session ends."""
    query = sa.text("SELECT 1 UNION ALL SELECT abs(-9223372036854775807 - 1)")
    with store.session.read() as connection:
        with pytest.raises(sa.exc.DBAPIError):
            records(connection, query, np.dtype([("number", np.int64)]))  # type: ignore[arg-type]
        connection.rollback()


def test_rows_of_a_case_are_committed_together(store: Store) -> None:
    record = store.studies.create({"sprag": 1}, _study())
    epoch = store.work.take_over("test")
    (chunk,) = store.work.open_chunks(record.number)
    store.work.claim(epoch, [chunk])
    with pytest.raises(sa.exc.DBAPIError):
        store.work.commit(epoch, chunk, _result((2, 1), (3, 1), (3, 1)))  # one key twice
    assert len(store.rows.block(record.id)) == 0
    assert _count(store) == 0
    assert store.work.commit(epoch, chunk, _result((2, 1), (3, 1)))
    assert len(store.rows.block(record.id)) == 6


def test_further_rows_are_copied_with_their_case(store: Store) -> None:
    _, source = _filled(store, _result((2, 1), (2, 2), (0, 1)))
    record = store.studies.create({"sprag": 1}, _study("again"))
    epoch = store.work.take_over("test")
    (chunk,) = store.work.open_chunks(record.number)
    store.work.claim(epoch, [chunk])
    cases = np.arange(4)
    none = ChunkResult(0, [], [], np.empty((0, len(INFOS))))
    known = Known(np.empty(0, dtype=np.int64), cases, np.full(4, source), cases)
    assert store.work.commit(epoch, chunk, none, known)
    assert _speeds(store.rows.of_case(record.id, 2)) == [(2, 2.0), (2, 12.0), (2, 22.0)]


def test_further_rows_go_with_their_study(store: Store) -> None:
    study_id, _ = _filled(store, _result((2, 1), (2, 2), (0, 1)))
    assert _count(store) == 3
    store.studies.delete(study_id)
    store.purging.purge()
    assert _count(store) == 0
