"""Changed bits in stored rows are noticed, named, held back and run again, on both kinds of databases."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import sqlalchemy as sa

from sprag_study.service.jobs.housekeeping import Scrubbing
from sprag_study.service.storage.errors import DatabaseError, NothingToRetryError
from sprag_study.service.storage.rows import digests
from sprag_study.service.storage.rows.hashes import as_kept, digest_of, digests_of, row_words
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.tables import CASE_KEYS, CHUNKS, ENDINGS, STUDIES, results_table
from sprag_study.worker import models
from sprag_study.worker.ports import Chunk
from sprag_study.worker.states import StudyState
from tests.contract.filling import create, finish
from tests.faults import refused
from tests.worker import fakes

TABLE = results_table("vibration-drive", "1")


def change(store: Store, case: int, **values: object) -> None:
    with store.session.write() as connection:
        done = connection.execute(sa.update(TABLE).where(TABLE.c.case_number == case).values(values))
        assert done.rowcount == 1


def damaged(store: Store) -> list[str]:
    """What `sprag admin db check` says of rows."""
    found = [str(item) for item in store.digests.all_damaged_rows()]
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
        store.digests.run_damaged_again(record.id)
        finish(store, record)
    with store.session.write() as connection:
        connection.execute(sa.delete(TABLE).where(TABLE.c.case_number == 9))
    assert "cases 0 to 9" in damaged(store)[0], "a row that is gone"


def test_damaged_rows_are_held_back_and_run_again(store: Store) -> None:
    record = create(store, 25)
    finish(store, record)
    rows = store.rows.block(record.id)
    column = next(c for c in TABLE.c if isinstance(c.type, sa.Double))
    change(store, 13, **{column.name: 1e9})
    with refused(DatabaseError, "database-damaged") as caught:
        store.digests.require_undamaged(record.id)
    assert f"study {record.id}, cases 10 to 19" in str(caught.value)
    waiting = store.studies.get(record.id)
    assert (waiting.state, waiting.done) == (StudyState.QUEUED, 15)
    assert store.rows.block(record.id).cases.tolist() == [*range(10), *range(20, 25)], "no wrong row is left"
    finish(store, record)
    again = store.rows.block(record.id)
    np.testing.assert_array_equal(again.values, rows.values)
    store.digests.require_undamaged(record.id)
    assert store.studies.get(record.id).done == 25


def flip(store: Store, case: int) -> None:
    """Change one number of the row of a case."""
    column = next(c for c in TABLE.c if isinstance(c.type, sa.Double))
    change(store, case, **{column.name: 1e9 + case})


@pytest.mark.parametrize("most", [20_000, 20])
def test_no_answer_is_made_of_damaged_rows(store: Store, most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(digests, "LOOKED_OVER", most)  # of a larger study the chunks with the wanted cases
    record = create(store, 25)
    answers: tuple[Callable[[], object], ...] = (
        lambda: store.rows.case(record.id, 13),
        lambda: store.rows.page(record.id, 12, 5),
        lambda: store.rows.page(record.id, ending="ok", limit=14),
        lambda: store.rows.of_case(record.id, 13),
        lambda: store.rows.for_cases(record.id, [13], [models.result_infos("vibration-drive", "1")[0].name]),
    )
    for answer in answers:
        finish(store, record)
        flip(store, 13)
        with refused(DatabaseError, "database-damaged"):
            answer()
        assert store.studies.get(record.id).state is StudyState.QUEUED
    finish(store, record)
    for answer in answers:
        answer()


def test_numbers_of_cases_are_counted_again_where_all_rows_are_looked_at(store: Store) -> None:
    record = create(store, 25)
    finish(store, record)
    with store.session.write() as connection:
        connection.execute(sa.update(ENDINGS).values(cases=24))
        connection.execute(sa.update(STUDIES).values(ok=24))
    store.digests.require_undamaged(record.id, anew=True)
    found, progress = store.studies.look(record.id)
    assert (found.done, found.ok, progress.endings) == (25, 25, {"ok": 25})


def test_columns_of_all_rows_are_looked_over(store: Store) -> None:
    record = create(store, 25)
    finish(store, record)
    flip(store, 13)
    with refused(DatabaseError, "database-damaged"):
        store.rows.columns(record.id, [])
    assert store.rows.columns(record.id, []).cases.tolist() == [*range(10), *range(20, 25)]


def test_rows_that_changed_later_are_noticed_by_exports_at_once(store: Store) -> None:
    record = create(store, 25)
    finish(store, record)
    store.digests.require_undamaged(record.id)
    flip(store, 13)
    with refused(DatabaseError, "database-damaged"):
        store.digests.require_undamaged(record.id, anew=True)


def test_damaged_rows_are_not_copied_for_another_study(store: Store) -> None:
    record = create(store, 25)
    finish(store, record)
    right = store.rows.block(record.id).values
    flip(store, 13)
    later, study = create(store, 30, "a larger one"), fakes.study(30, "a larger one")
    epoch, taken = store.work.take_over("test"), []
    for chunk in store.work.open_chunks(later.number):
        assert store.work.claim(epoch, [chunk]) == [chunk]
        known = store.work.known(study, chunk)
        if known is None:
            assert store.work.commit(epoch, chunk, fakes.result(chunk.first, chunk.count))
            continue
        taken += known.cases.tolist()
        assert store.work.commit(epoch, chunk, fakes.result(0, known.missing.size), known)
    store.work.settle(epoch, later.number)
    assert taken == [*range(10), *range(20, 25)]
    np.testing.assert_array_equal(store.rows.block(later.id).values[:25], right)
    assert (store.studies.get(record.id).state, store.studies.get(record.id).done) == (StudyState.QUEUED, 15)
    assert damaged(store) == []


def test_a_key_that_names_another_study_after_a_flip_copies_no_rows_of_another_run(store: Store) -> None:
    """Studies of other runs have the same parameters: only the kin of a study tells its rows apart."""
    mine, other = create(store, 25), store.studies.create({}, fakes.study(25, "of less accuracy", tolerance=1e-6))
    for record in (mine, other):
        finish(store, record)
    wanted = fakes.study(30, "a larger one")
    assert store.reuse.count(wanted) == 25
    with store.session.write() as connection:
        connection.execute(sa.update(CASE_KEYS).where(CASE_KEYS.c.study == other.number).values(study=99))
        connection.execute(sa.update(CASE_KEYS).where(CASE_KEYS.c.study == mine.number).values(study=other.number))
    assert store.reuse.count(wanted) == 0


def test_a_retry_does_not_bless_damaged_rows(store: Store) -> None:
    record = create(store, 25)
    finish(store, record)
    with store.session.write() as connection:  # case 12 failed, honestly stored
        at = sa.update(TABLE).where(TABLE.c.case_number == 12).values(ending="diverged")
        connection.execute(at)
        connection.execute(sa.update(ENDINGS).values(cases=24))
        connection.execute(sa.insert(ENDINGS).values(study=record.number, ending="diverged", cases=1))
        for first in (0, 10, 20):
            store.digests.seal(connection, Chunk(record.number, first, min(10, 25 - first)))
    flip(store, 15)
    store.studies.retry(record.id)
    assert damaged(store) == [
        f"the rows of the study {record.id}, cases 10 to 11, are not those that were stored",
        f"the rows of the study {record.id}, cases 13 to 19, are not those that were stored",
    ]
    store.digests.run_damaged_again(record.id)
    finish(store, record)
    assert (damaged(store), store.studies.get(record.id).done) == ([], 25)
    np.testing.assert_array_equal(store.rows.block(record.id).values, fakes.values(0, 25))


def test_a_retry_notices_that_the_failed_row_is_gone(store: Store) -> None:
    record = create(store, 25)
    epoch = store.work.take_over("test")
    for chunk in store.work.open_chunks(record.number):
        store.work.claim(epoch, [chunk])
        ending = models.OK if chunk.first else "diverged"
        store.work.commit(epoch, chunk, fakes.result(chunk.first, chunk.count, ending))
    store.work.settle(epoch, record.number)
    change(store, 3, ending="diverge$")
    with refused(DatabaseError, "database-damaged"):
        store.studies.retry(record.id)
    finish(store, record)
    assert (damaged(store), store.studies.get(record.id).done, store.studies.get(record.id).ok) == ([], 25, 25)


def test_a_retry_with_wrong_numbers_of_endings_counts_again(store: Store) -> None:
    record = create(store, 25)
    finish(store, record)
    with store.session.write() as connection:
        connection.execute(sa.insert(ENDINGS).values(study=record.number, ending="diverged", cases=1))
    with refused(NothingToRetryError, "wrong-state"):
        store.studies.retry(record.id)
    assert [ending for ending, _ in store.studies.look(record.id)[1].endings.items()] == ["ok"]


@pytest.mark.parametrize("answer", ["export", "page"])
def test_answers_of_a_study_under_way_are_not_made_of_damaged_rows(store: Store, answer: str) -> None:
    record = create(store, 25)
    epoch = store.work.take_over("test")
    first, second, _ = store.work.open_chunks(record.number)
    for chunk in (first, second):
        store.work.claim(epoch, [chunk])
        store.work.commit(epoch, chunk, fakes.result(chunk.first, 10))
    flip(store, 13)
    with refused(DatabaseError, "database-damaged"):
        store.digests.require_undamaged(record.id, anew=True) if answer == "export" else store.rows.case(record.id, 13)
    assert (store.studies.get(record.id).state, store.studies.get(record.id).done) == (StudyState.RUNNING, 10)
    assert store.rows.case(record.id, 13) is None
    assert store.rows.case(record.id, 3) is not None


@pytest.mark.parametrize("paused", [False, True])
def test_a_damaged_chunk_of_a_study_under_way_is_run_again_by_the_housekeeping(store: Store, paused: bool) -> None:
    record = create(store, 25)
    epoch = store.work.take_over("test")
    first, second, third = store.work.open_chunks(record.number)
    store.work.claim(epoch, [first, second])
    store.work.commit(epoch, first, fakes.result(0, 10))
    if paused:
        store.studies.pause(record.id)
    flip(store, 3)
    Scrubbing(store).look()
    assert (store.studies.get(record.id).done, store.studies.get(record.id).ok) == (0, 0)
    assert store.work.commit(epoch, second, fakes.result(10, 10)), "what runs is not disturbed"
    assert [chunk.first for chunk in store.work.open_chunks(record.number)] == [first.first, third.first]
    if paused:
        store.studies.resume(record.id)
    finish(store, record)
    assert (damaged(store), store.studies.get(record.id).done) == ([], 25)
    np.testing.assert_array_equal(store.rows.block(record.id).values, fakes.values(0, 25))


def test_damaged_rows_of_a_cancelled_study_are_held_back_and_kept(store: Store) -> None:
    record = create(store, 25)
    epoch = store.work.take_over("test")
    first = store.work.open_chunks(record.number)[0]
    store.work.claim(epoch, [first])
    store.work.commit(epoch, first, fakes.result(0, 10))
    store.studies.cancel(record.id)
    store.work.settle(epoch, record.number)
    flip(store, 3)
    with refused(DatabaseError, "database-damaged") as caught:
        store.rows.case(record.id, 3)
    assert "cancelled, so submit it as a new one" in str(caught.value)
    assert (store.studies.get(record.id).state, store.studies.get(record.id).done) == (StudyState.CANCELLED, 10)


def test_chunks_without_a_digest_are_said_to_be_unchecked(store: Store) -> None:
    record = create(store, 25)
    finish(store, record)
    with store.session.write() as connection:
        connection.execute(sa.update(CHUNKS).values(digest=None))
    report = store.check()
    assert (damaged(store), report.unchecked) == ([], 3)


def test_numbers_are_copied_only_where_the_database_keeps_them_otherwise() -> None:
    values = np.random.default_rng(2).standard_normal((30, 4))
    values[0, 0], values[1, 1] = np.nan, 0.0
    assert as_kept(values) is values
    for number, bits in ((-0.0, 0), (np.inf, 0x7FF8 << 48), (-np.inf, 0x7FF8 << 48), (-np.nan, 0x7FF8 << 48)):
        other = values.copy()
        other[7, 2] = number
        kept = as_kept(other)
        assert kept is not other
        assert kept.view(np.int64)[7, 2] == bits
        kept[7, 2] = other[7, 2] = 1.0
        np.testing.assert_array_equal(kept.view(np.int64), other.view(np.int64))


def test_chunks_that_are_stored_together_have_the_digests_of_their_own_rows(store: Store) -> None:
    record = create(store, 47)
    finish(store, record)
    with store.session.read() as connection:
        stored = {row.first: row.digest for row in connection.execute(sa.select(CHUNKS.c["first"], CHUNKS.c.digest))}
        found = {
            first: store.digests.digest_in(connection, Chunk(record.number, first, min(10, 47 - first)))
            for first in stored
        }
    assert stored == found
    assert len({*stored.values()}) == len(stored) == 5


def test_rows_keep_their_digest_where_results_are_added() -> None:
    draw = np.random.default_rng(3)
    cases, endings, flags = np.arange(30), ["ok"] * 30, [""] * 30
    values = draw.standard_normal((30, 3))
    values[4, 1] = np.nan
    before = digest_of(row_words(cases, endings, flags, values))
    wide = np.full((30, 6), np.nan)
    wide[:, [0, 2, 5]] = values
    generations = (0, 2, 0, 1, 2, 0)

    def digest(rows: np.ndarray, chosen: tuple[int, ...]) -> int:
        return digest_of(row_words(cases, endings, flags, rows, generations=chosen))

    assert digest(wide, generations) == before
    wide[7, 3] = 0.5
    once = digest(wide, generations)
    assert once == digest(wide[:, [0, 2, 3, 5]], (0, 0, 1, 0)) != before
    wide[:, 1] = draw.standard_normal(30)
    whole = digest(wide, generations)
    assert len({before, once, whole}) == 3
    for number in (np.nan, 0.0, np.nextafter(wide[9, 1], 2.0)):
        changed = wide.copy()
        changed[9, 1] = number
        assert digest(changed, generations) != whole


def test_the_digest_of_rows_is_that_of_what_a_database_keeps_in_any_order() -> None:
    draw = np.random.default_rng(1)
    cases, values = np.arange(40), draw.standard_normal((40, 5))
    values[3, 2], values[4, 1], values[5, 0] = np.nan, np.inf, -0.0
    kept = np.where(np.isinf(values), np.nan, values) + 0.0
    endings, flags = ["ok"] * 39 + ["diverged"], [""] * 40
    words = row_words(cases, endings, flags, as_kept(values))
    assert digest_of(words) == digest_of(words[::-1]) == digest_of(row_words(cases, endings, flags, kept))
    assert digests_of(words, [1, 36, 3]) == [digest_of(words[part]) for part in (slice(1), slice(1, 37), slice(37, 40))]
    assert digest_of(words) == digest_of(words[:7], words[7:])
    seen = {digest_of(words)}
    for row in range(40):
        for result in range(5):
            if np.isfinite(values[row, result]) and values[row, result]:
                bits = kept.copy().view(np.uint64)
                bits[row, result] ^= np.uint64(1) << np.uint64((row + result) % 52)
                seen.add(digest_of(row_words(cases, endings, flags, bits.view(np.float64))))
    assert len(seen) == 1 + 197
