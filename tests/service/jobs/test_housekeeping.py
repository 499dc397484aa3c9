"""Deleted studies are removed in the background and in steps; the log goes to its place while nothing happens."""

from __future__ import annotations

import shutil
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from sprag_study.service.jobs.housekeeping import Housekeeping
from sprag_study.service.storage.errors import DatabaseBusyError, StudyNotFoundError
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.studies import purging
from sprag_study.service.storage.studies.records import StudyRecord
from sprag_study.worker.chunking import Chunking
from tests.contract.filling import finish
from tests.worker import fakes

SECONDS = 600.0


@pytest.fixture
def store(sqlite_url: str) -> Iterator[Store]:
    with Store.open(sqlite_url, chunking=Chunking(cases=2)) as opened:
        yield opened


def finished(store: Store, cases: int = 9) -> StudyRecord:
    record = store.studies.create({}, fakes.study(cases))
    finish(store, record)
    return record


def count(store: Store, table: str) -> int:
    with store.session.read() as connection:
        return int(connection.exec_driver_sql(f"SELECT count(*) FROM {table}").scalar_one())


def test_deleting_removes_no_row_itself_and_each_step_few(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(purging, "PURGED_ROWS", 4)
    record, other = finished(store), finished(store)
    store.studies.delete(record.id)
    with pytest.raises(StudyNotFoundError):
        store.studies.get(record.id)
    assert count(store, "vibration_drive_1") == 18
    assert list(store.purging.steps()) == [4, 4, 1, 4, 1, 4, 4, 1, 1]  # rows, chunks, keys, the study itself
    assert (count(store, "vibration_drive_1"), count(store, "chunks"), count(store, "studies")) == (9, 5, 1)
    assert list(store.purging.steps()) == []
    assert len(store.rows.block(other.id)) == 9


def test_what_is_deleted_is_removed_in_the_background(store: Store) -> None:
    first, second = finished(store), finished(store)
    store.studies.delete(first.id)
    keeping = Housekeeping(store)
    gone = threading.Event()
    steps = store.purging.steps

    def noting() -> Iterator[int]:
        yield from steps()
        if not count(store, "studies"):
            gone.set()

    store.purging.steps = noting  # type: ignore[method-assign]
    keeping.start()
    store.studies.delete(second.id)
    assert gone.wait(SECONDS)
    keeping.stop()
    assert not keeping.is_alive()


def test_a_task_that_fails_stops_neither_the_others_nor_the_thread(
    store: Store, caplog: pytest.LogCaptureFixture
) -> None:
    done = threading.Event()
    keeping = Housekeeping(store, lambda: 1 // 0, done.set)  # type: ignore[arg-type,return-value]
    keeping.start()
    store.studies.deleted.set()
    assert done.wait(SECONDS)
    assert keeping.is_alive()
    keeping.stop()
    assert "ZeroDivisionError" in caplog.text


def test_a_purge_that_fails_is_tried_again(
    store: Store, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    store.studies.delete(finished(store).id)
    keeping = Housekeeping(store)

    def busy() -> Iterator[int]:
        raise DatabaseBusyError("busy")

    with monkeypatch.context() as patch:
        patch.setattr(store.purging, "steps", busy)
        keeping.purge()
    assert "removed later: busy" in caplog.text
    monkeypatch.setattr("sprag_study.service.jobs.housekeeping.LOOK_SECONDS", 0.0)
    keeping.start()
    for _ in range(1000):
        if not count(store, "studies"):
            break
        threading.Event().wait(0.05)
    keeping.stop()
    assert count(store, "studies") == 0


def test_a_file_copied_by_itself_is_whole_after_a_checkpoint(store: Store, tmp_path: Path) -> None:
    record = finished(store)
    path, copy = store.session.path, tmp_path / "copy.sqlite3"
    Housekeeping(store).checkpoint()
    shutil.copyfile(path, copy)
    with Store.open(f"sqlite:///{copy}") as read:
        assert read.studies.get(record.id).done == 9


def test_the_log_is_in_the_file_at_the_end(tmp_path: Path) -> None:
    path = tmp_path / "sprag.sqlite3"
    with Store.open(f"sqlite:///{path}") as store:
        finished(store)
        log = path.with_name(f"{path.name}-wal")
        assert log.stat().st_size > 0
    assert not log.exists()
