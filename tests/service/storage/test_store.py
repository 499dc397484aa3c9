"""The database session: places that are refused, transactions, backups, the lock of the dispatcher."""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import sqlalchemy as sa

from sprag_study.service.storage.database import session as session_module
from sprag_study.service.storage.database import sqlite_files
from sprag_study.service.storage.database.lock import DispatcherLock
from sprag_study.service.storage.database.session import Session
from sprag_study.service.storage.database.sqlite_files import file_system_of, sqlite_warning
from sprag_study.service.storage.errors import DatabaseBusyError, DatabaseError
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.studies.progress import RECENT_CHUNKS, FinishedChunk, RunningChunk, estimate
from sprag_study.service.storage.tables import STUDIES
from tests import statements
from tests.faults import refused
from tests.worker import fakes


@pytest.fixture
def url(tmp_path: Path) -> str:
    return f"sqlite:///{tmp_path / 'a' / 'sprag.sqlite3'}"


def test_the_studies_kept_in_memory_are_few_values(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sprag_study.service.storage.studies.studies.KEPT_VALUES", 5)
    with Store.open(url) as store:
        made = [fakes.study(3, name=f"study {index}") for index in range(3)]
        ids = [store.studies.create({}, study).id for study in made]
        assert [store.studies.study(study_id) for study_id in ids] == made
        assert list(store.studies._studies) == ids[-1:]
        assert store.studies.study(ids[0]) == made[0]


def test_as_many_studies_as_a_list_has_are_kept_in_memory(url: str) -> None:
    with Store.open(url) as store:
        ids = [store.studies.create({}, fakes.study(3, name=f"study {index}")).id for index in range(50)]
        for study_id in ids:
            store.studies.study(study_id)
        assert list(store.studies._studies) == ids


@pytest.mark.parametrize(
    ("url", "code"),
    [
        ("postgresql://me:pass@host:abc/x", "invalid-database-url"),
        ("postgresql://me:a@@pass/1@host/x", "invalid-database-url"),
        ("no url", "invalid-database-url"),
        ("mysql://host/db", "invalid-database-url"),
        ("sqlite://", "invalid-database-url"),
        ("sqlite:///:memory:", "invalid-database-url"),
        ("sqlite:///rel.db?mode=ro", "invalid-database-url"),
        ("sqlite:////dev/null/x/sprag.sqlite3", "write-failed"),
    ],
)
def test_databases_that_cannot_be_used_are_refused_in_one_sentence(url: str, code: str) -> None:
    with refused(DatabaseError, code):
        Session(url)


def test_a_folder_is_no_database(tmp_path: Path) -> None:
    with refused(DatabaseError, "not-a-database"):
        Session(f"sqlite:///{tmp_path}")


def test_network_file_systems_are_refused(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sqlite_files, "file_system_of", lambda _: "nfs4")
    with refused(DatabaseError, "unsupported-database"):
        Session(url)


def test_a_read_only_folder_is_refused_with_the_command_that_mends_it(
    url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Root may write everywhere, so the system's answer is made up.
    monkeypatch.setattr(sqlite_files.os, "access", lambda *_: False)
    with refused(DatabaseError, "database-read-only") as caught:
        Session(url)
    assert "`chmod u+w " in str(caught.value)


def test_threads_queue_for_the_one_that_writes_and_give_up_in_the_end(
    url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(session_module, "BUSY_SECONDS", 0.05)
    with Store.open(url) as store, store.session.write(), ThreadPoolExecutor(1) as threads:
        waiting = threads.submit(store.studies.create, {}, fakes.study(1))
        assert isinstance(waiting.exception(), DatabaseBusyError)


def test_a_lock_that_is_seized_is_lost_to_its_holder(tmp_path: Path) -> None:
    first, second, third = (DispatcherLock(tmp_path / "db") for _ in range(3))
    assert first.take()
    second.seize()
    assert not third.take()
    first.release()
    assert not third.take()
    second.release()
    assert third.take()
    third.release()


MOUNTS = "/dev/a / ext4 rw 0 0\nserver:/x /home nfs4 rw 0 0\n/dev/b /home/me\\040too/local xfs rw 0 0\n\n"


@pytest.mark.parametrize(
    ("path", "kind"),
    [
        ("/var/x", "ext4"),
        ("/home/x", "nfs4"),
        ("/homeland/x", "ext4"),
        ("/home/me too/local/x", "xfs"),
        ("/home", "nfs4"),
    ],
)
def test_the_innermost_mount_counts(path: str, kind: str) -> None:
    assert file_system_of(Path(path), MOUNTS) == kind


def test_an_old_library_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sqlite_files, "sqlite_version", lambda: (3, 40, 1))
    assert "3.40.1" in (sqlite_warning() or "")
    monkeypatch.setattr(sqlite_files, "sqlite_version", lambda: (3, 51, 3))
    assert sqlite_warning() is None


def test_connections_are_safe(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sqlite_files.DatabaseFile, "_set_pragmas", statements.SET_PRAGMAS)
    with Store.open(url) as store, store.session.read() as connection:
        asked = {
            name: connection.exec_driver_sql(f"PRAGMA {name}").scalar_one()
            for name in ("journal_mode", "synchronous", "foreign_keys", "busy_timeout", "page_size")
        }
    assert asked == {
        "journal_mode": "wal",
        "synchronous": 2,
        "foreign_keys": 1,
        "busy_timeout": 30_000,
        "page_size": 16_384,
    }


def test_writers_take_the_lock_at_once_and_readers_go_on(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session_module, "BUSY_SECONDS", 0.05)
    with Store.open(url) as store, Store.open(url) as other, store.session.write():
        assert other.studies.page().studies == ()
        with refused(DatabaseBusyError, "database-busy"), other.session.write():
            pass


def test_a_transaction_is_whole_or_nothing(url: str) -> None:
    with Store.open(url) as store:
        record = store.studies.create({}, fakes.study(3))

        def half() -> None:
            with store.session.write() as connection:
                connection.execute(sa.update(STUDIES).values(name="half"))
                raise ZeroDivisionError

        with pytest.raises(ZeroDivisionError):
            half()
        assert store.studies.get(record.id).name == "a study"


def test_a_reader_sees_one_moment(url: str) -> None:
    with Store.open(url) as store, store.session.read() as connection:
        count = sa.select(sa.func.count()).select_from(STUDIES)
        assert connection.execute(count).scalar_one() == 0
        store.studies.create({}, fakes.study(3))
        assert connection.execute(count).scalar_one() == 0


def test_a_backup_is_a_whole_database_and_replaces_nothing(url: str, tmp_path: Path) -> None:
    copy = tmp_path / "copy.sqlite3"
    with Store.open(url) as store:
        record = store.studies.create({"sprag": 1}, fakes.study(3))
        with store.session.write() as connection:  # others may be at work
            connection.execute(sa.update(STUDIES).values(name="changed"))
            store.backup(copy)
        with refused(DatabaseError, "file-exists"):
            store.backup(copy)
        with refused(DatabaseError, "write-failed"):
            store.backup(tmp_path / "nowhere" / "copy.sqlite3")
    with Store.open(f"sqlite:///{copy}") as restored:
        assert restored.studies.get(record.id) == record
        assert not [problem for problem in restored.check().problems if "SQLite" not in problem]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "copy.sqlite3"]


def test_one_dispatcher_at_a_time(tmp_path: Path) -> None:
    first, second = DispatcherLock(tmp_path / "db"), DispatcherLock(tmp_path / "db")
    assert second.holder() == ""
    assert first.take()
    assert first.take()
    assert not second.take()
    assert int(second.holder()) > 0
    first.release()
    first.release()
    assert second.take()
    second.release()


def test_pauses_do_not_count_as_work() -> None:
    chunks = [FinishedChunk(0.0, 2.0, 10), FinishedChunk(1.0, 3.0, 10), FinishedChunk(100.0, 101.0, 10)]
    rate, left = estimate(0, chunks)
    assert rate == pytest.approx(30 / 4.0)
    assert left == (0.0, 0.0)


@pytest.mark.parametrize("processes", [1, 4, 32])
@pytest.mark.parametrize("done", [1, 7, 40, 100, 400])
def test_the_rate_is_right_however_many_chunks_run_side_by_side(processes: int, done: int) -> None:
    # Ten cases in 8 s on each process, which began one after the other: the next chunk begins when the last ends.
    begins = sorted(8.0 * (n // processes) + 8.0 * (n % processes) / processes for n in range(done + processes))
    ended = [FinishedChunk(begin, begin + 8.0, 10) for begin in begins[:done]]
    now = ended[-1].end
    running = [RunningChunk(begin, 10) for begin in begins[done:] if begin < now]
    rate, left = estimate(5000, ended[-RECENT_CHUNKS:], running, now, 10 * done)
    assert rate is not None
    assert left is not None
    # While processes are only just beginning, fewer run side by side.
    assert rate == pytest.approx(10.0 * processes / 8.0, rel=0.15 if done > 3 * processes else 0.6)
    if done > 3 * processes:
        assert left[0] < 5000 / (10.0 * processes / 8.0) < left[1]


def test_time_left_is_unknown_before_the_first_chunk() -> None:
    assert estimate(10, []) == (None, None)
    assert estimate(10, [FinishedChunk(5.0, 5.0, 3)]) == (None, None)


def test_the_interval_is_narrow_for_even_chunks_and_wide_for_uneven_ones() -> None:
    even = [FinishedChunk(float(i), float(i + 1), 10) for i in range(20)]
    uneven = [FinishedChunk(float(i * i), float((i + 1) ** 2), 10) for i in range(20)]
    widths = []
    for chunks in (even, uneven):
        rate, left = estimate(100, chunks)
        assert rate is not None
        assert left is not None
        assert left[0] < 100 / rate < left[1]
        widths.append((left[1] - left[0]) * rate / 100)
    assert widths[0] < 0.6
    assert widths[1] > 2.0 * widths[0]


def test_a_trend_is_carried_on() -> None:
    # From 1 s each chunk takes 40 ms longer than the one before; fifty are done and fifty are left.
    ends = np.cumsum(1.0 + 0.04 * np.arange(100))
    chunks = [
        FinishedChunk(float(end - cost), float(end), 10)
        for end, cost in zip(ends, np.diff(ends, prepend=0.0), strict=True)
    ]
    _, left = estimate(500, chunks[:50])
    assert left is not None
    assert left[0] < ends[99] - ends[49] < left[1]


def test_an_interval_is_narrower_where_the_cases_done_lie_among_those_left() -> None:
    chunks = [FinishedChunk(float(i), float(i + 1), 10) for i in range(20)]
    (_, plain), (_, sampled) = (estimate(1000, chunks, sampled=sampled) for sampled in (False, True))
    assert plain is not None
    assert sampled is not None
    assert plain[0] < sampled[0] < 100.0 < sampled[1] < plain[1]


@pytest.fixture
def _open_umask() -> Iterator[None]:
    """The umask that gives every right to everybody."""
    before = os.umask(0)
    yield
    os.umask(before)


@pytest.mark.usefixtures("_open_umask")
def test_database_log_lock_reserve_and_backup_are_private_whatever_the_umask(url: str, tmp_path: Path) -> None:
    with Store.open(url) as store:
        lock = DispatcherLock(store.session.path)
        assert lock.take()
        assert store.work.shortage() is None
        store.studies.create({}, fakes.study(1))
        store.backup(tmp_path / "a" / "copy.sqlite3")
        folder = store.session.path.parent
        modes = {path.name: path.stat().st_mode & 0o777 for path in folder.iterdir()}
        lock.release()
    beside = ("", "-wal", "-shm", ".lock", ".reserve")
    assert modes == dict.fromkeys([*(f"sprag.sqlite3{suffix}" for suffix in beside), "copy.sqlite3"], 0o600)
    assert folder.stat().st_mode & 0o777 == 0o700


def test_a_backup_removes_what_killed_ones_left_and_writes_the_folder_to_disk(
    url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    left, other = tmp_path / ".copy.sqlite3.4711.part", tmp_path / ".else.sqlite3.4711.part"
    for path in (left, other):
        path.touch()
        os.utime(path, (0, 0))
    synced: list[Path] = []
    fsync = os.fsync

    def noting(descriptor: int) -> None:
        synced.append(Path(os.readlink(f"/proc/self/fd/{descriptor}")))
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", noting)
    with Store.open(url) as store:
        store.backup(tmp_path / "copy.sqlite3")
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(["a", "copy.sqlite3", other.name])
    assert synced[-1] == tmp_path
    assert synced[-2].name.endswith(".part")


def test_an_interval_is_wider_where_the_cost_of_cases_differs_many_times() -> None:
    chunks = [FinishedChunk(float(i), float(i + 1), 10) for i in range(20)]
    for sampled in (False, True):
        (_, even), (_, uneven) = (estimate(1000, chunks, sampled=sampled, uneven=uneven) for uneven in (False, True))
        assert even is not None
        assert uneven is not None
        assert uneven[0] < even[0] < 100.0 < even[1] < uneven[1]
