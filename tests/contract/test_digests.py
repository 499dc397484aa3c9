"""Changed bits in stored rows are noticed, named, held back and run again, on both kinds of databases."""

from __future__ import annotations

import numpy as np
import pytest
import sqlalchemy as sa

from sprag.service.storage import digests
from sprag.service.storage.digests import digest_of, row_words
from sprag.service.storage.errors import DatabaseError
from sprag.service.storage.store import Store
from sprag.service.storage.tables import CHUNKS, results_table
from sprag.worker.states import StudyState
from tests.contract.filling import create, finish
from tests.faults import refused

TABLE = results_table("vibration-drive", "1")


def change(store: Store, case: int, **values: object) -> None:
    with store.session.write() as connection:
        done = connection.execute(sa.update(TABLE).where(TABLE.c.case_number == case).values(values))
        assert done.rowcount == 1


def damaged(store: Store) -> list[str]:
    """What `sprag db check` says of rows."""
    found = [str(item) for item in store.all_damaged_rows()]
    assert [problem for problem in store.check().problems if "rows of the study" in problem] == found
    return found


@pytest.mark.parametrize("part", [3, 5000])
def test_every_flip_of_a_bit_is_noticed_and_its_chunk_named(
    store: Store, part: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(digests, "_PART", part)
    record = create(store, 25)
    finish(store, record)
    assert damaged(store) == []
    column = next(c for c in TABLE.c if isinstance(c.type, sa.Double))
    with store.session.read() as connection:
        (before,) = connection.execute(sa.select(column).where(TABLE.c.case_number == 13)).scalars()
    for bit in (0, 1, 20, 51):
        flipped = float((np.float64(before).view(np.uint64) ^ np.uint64(1 << bit)).view(np.float64))
        change(store, 13, **{column.name: flipped})
        assert damaged(store) == [f"the rows of the study {record.id}, cases 10 to 19, are not those that were stored"]
    change(store, 13, **{column.name: before})
    assert damaged(store) == []
    for case, values in ((3, {"ending": "diverged"}), (24, {"flags": "odd"}), (24, {column.name: None})):
        change(store, case, **values)
        assert len(damaged(store)) == 1, values
        store.run_damaged_again(record.id)
        finish(store, record)
    with store.session.write() as connection:
        connection.execute(sa.delete(TABLE).where(TABLE.c.case_number == 9))
    assert "cases 0 to 9" in damaged(store)[0], "a row that is gone"


def test_damaged_rows_are_held_back_and_run_again(store: Store) -> None:
    record = create(store, 25)
    finish(store, record)
    rows = store.case_rows(record.id)
    column = next(c for c in TABLE.c if isinstance(c.type, sa.Double))
    change(store, 13, **{column.name: 1e9})
    with refused(DatabaseError, "database-damaged") as caught:
        store.require_undamaged(record.id)
    assert f"study {record.id}, cases 10 to 19" in str(caught.value)
    waiting = store.get_study(record.id)
    assert (waiting.state, waiting.done) == (StudyState.QUEUED, 15)
    assert store.case_rows(record.id).cases.tolist() == [*range(10), *range(20, 25)], "no wrong row is left"
    finish(store, record)
    again = store.case_rows(record.id)
    np.testing.assert_array_equal(again.values, rows.values)
    store.require_undamaged(record.id)
    assert store.get_study(record.id).done == 25


def test_chunks_without_a_digest_are_said_to_be_unchecked(store: Store) -> None:
    record = create(store, 25)
    finish(store, record)
    with store.session.write() as connection:
        connection.execute(sa.update(CHUNKS).values(digest=None))
    report = store.check()
    assert (damaged(store), report.unchecked) == ([], 3)


def test_the_digest_of_rows_is_that_of_what_a_database_keeps_in_any_order() -> None:
    draw = np.random.default_rng(1)
    cases, values = np.arange(40), draw.standard_normal((40, 5))
    values[3, 2], values[4, 1], values[5, 0] = np.nan, np.inf, -0.0
    kept = np.where(np.isinf(values), np.nan, values) + 0.0
    endings, flags = ["ok"] * 39 + ["diverged"], [""] * 40
    words = row_words(cases, endings, flags, values)
    assert digest_of(words) == digest_of(words[::-1]) == digest_of(row_words(cases, endings, flags, kept))
    assert digest_of(words) == digest_of(words[:7], words[7:])
    seen = {digest_of(words)}
    for row in range(40):
        for result in range(5):
            if np.isfinite(values[row, result]) and values[row, result]:
                bits = kept.copy().view(np.uint64)
                bits[row, result] ^= np.uint64(1) << np.uint64((row + result) % 52)
                seen.add(digest_of(row_words(cases, endings, flags, bits.view(np.float64))))
    assert len(seen) == 1 + 197
