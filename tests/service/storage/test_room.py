"""How much room the database has: on the disk, under the limit of file sizes, within its own files."""

from __future__ import annotations

import resource
import shutil
from collections.abc import Callable, Iterator

import pytest
import sqlalchemy as sa

from sprag_study.service.storage.errors import DatabaseFullError
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.work.room import RESERVE_BYTES
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.ports import StoreFullError
from tests.contract.filling import finish
from tests.faults import refused
from tests.worker import fakes

PLENTY = 10**12


@pytest.fixture
def store(sqlite_url: str) -> Iterator[Store]:
    with Store.open(sqlite_url, chunking=Chunking(cases=500)) as store:
        yield store


@pytest.fixture
def world(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Says how much the disk has left, and how large a file may be."""

    def have(free: int = PLENTY, limit: int = resource.RLIM_INFINITY) -> None:
        monkeypatch.setattr(shutil, "disk_usage", lambda _: shutil._ntuple_diskusage(PLENTY, PLENTY - free, free))
        monkeypatch.setattr(resource, "getrlimit", lambda _: (limit, limit))

    return have


def fill(store: Store) -> str:
    """A finished study of some 8 MB of rows; its id."""
    record = store.studies.create({}, fakes.study(20_000))
    finish(store, record)
    return record.id


def test_the_disk_is_asked(store: Store, world: Callable[..., None]) -> None:
    world(free=PLENTY)
    assert (store.room.left(), store.work.shortage()) == (PLENTY, None)
    world(free=RESERVE_BYTES)
    assert store.work.shortage() is None
    world(free=0)
    shortage = store.work.shortage() or ""
    assert shortage.startswith(f"no room: the disk that holds {store.session.path} has 0 MB left; the study continues")


def test_the_largest_file_allowed_counts_too(store: Store, world: Callable[..., None]) -> None:
    size = store.session.path.stat().st_size
    world(limit=size + 3 * RESERVE_BYTES)
    assert store.work.shortage() is None
    assert 2 * RESERVE_BYTES < store.room.left() <= 3 * RESERVE_BYTES
    world(limit=size + RESERVE_BYTES // 2)
    assert "ulimit -f" in (store.work.shortage() or "")


def test_what_deleted_studies_left_free_is_room(store: Store, world: Callable[..., None]) -> None:
    study = fill(store)
    world(free=0)
    with store.session.plain() as connection:
        connection.exec_driver_sql("PRAGMA wal_checkpoint(TRUNCATE)")
    assert store.work.shortage() is not None
    world(free=PLENTY)
    store.studies.delete(study)
    store.purging.purge()
    world(free=0)
    assert store.room.left() > 5e6
    assert store.work.shortage() is None


def test_a_log_whose_pages_are_in_their_place_is_room(store: Store, world: Callable[..., None]) -> None:
    fill(store)
    log = store.session.path.with_name(f"{store.session.path.name}-wal").stat().st_size
    world(free=0)
    assert log > RESERVE_BYTES
    assert store.room.left() == pytest.approx(log, rel=0.05)


def test_a_database_that_takes_nothing_more_says_so_and_stays_whole(store: Store) -> None:
    """SQLite itself refuses pages beyond a limit just as it does on a full disk."""
    record = store.studies.create({}, fakes.study(20_000))
    epoch = store.work.take_over("test")
    with store.session.read() as connection:
        pages = connection.exec_driver_sql("PRAGMA page_count").scalar_one()
    chunks = store.work.open_chunks(record.number)
    store.work.claim(epoch, chunks)
    limit = [pages + 100]

    def limited(connection: object, _record: object, _proxy: object) -> None:
        connection.execute(f"PRAGMA max_page_count = {limit[0]}")  # type: ignore[attr-defined]

    sa.event.listen(store.session._engine, "checkout", limited)
    stored = []

    def commit_all() -> None:
        for chunk in chunks[len(stored) :]:
            assert store.work.commit(epoch, chunk, fakes.result(chunk.first, chunk.count))
            stored.append(chunk)

    with refused(DatabaseFullError, "storage-full") as caught:
        commit_all()
    assert isinstance(caught.value, StoreFullError)
    assert 0 < len(stored) < len(chunks)
    assert store.studies.get(record.id).done == 500 * len(stored) == len(store.rows.block(record.id, limit=20_000))
    limit[0] = pages + 10_000
    commit_all()
    assert len(store.rows.block(record.id, limit=20_000)) == 20_000
    assert not [problem for problem in store.check().problems if "SQLite" not in problem]
