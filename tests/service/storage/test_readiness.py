"""Whether studies can be taken and run is told as it is: worker, write lock, database file; a hung worker is ended."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import httpx
import psutil
import pytest
import sqlalchemy as sa

from sprag_study.service.http.app import create_app
from sprag_study.service.jobs import dispatching
from sprag_study.service.jobs.dispatching import WorkerSettings, require_file, run_dispatcher
from sprag_study.service.settings import Settings
from sprag_study.service.storage.database.lock import DispatcherLock
from sprag_study.service.storage.database.sqlite_files import sqlite_driver
from sprag_study.service.storage.errors import DatabaseError, DatabaseFullError
from sprag_study.service.storage.readiness import Readiness
from sprag_study.service.storage.store import Store
from sprag_study.worker.executors.inline import InlineExecutor
from sprag_study.worker.pool.process_table import start_time
from tests.conftest import ROOT
from tests.faults import refused
from tests.service.conftest import SPEC, InThread
from tests.worker import fakes

#: Takes the dispatcher's lock and the write lock of a database, and stands still.
STOPPED = """
import os, signal, sys
from pathlib import Path
from sprag_study.service.storage.database.lock import DispatcherLock
from sprag_study.service.storage.database.session import Session
session = Session(f"sqlite:///{sys.argv[1]}")
lock = DispatcherLock(Path(sys.argv[1]))
assert lock.take()
with session.write():
    print("ready", flush=True)
    os.kill(os.getpid(), signal.SIGSTOP)
"""


@pytest.fixture
def clock() -> fakes.HandClock:
    return fakes.HandClock()


@pytest.fixture
def store(settings: Settings, clock: fakes.HandClock) -> Iterator[Store]:
    with Store.open(settings.database_url, clock=clock) as opened:
        yield opened


@pytest.fixture
def stopped(store: Store) -> Iterator[subprocess.Popen[str]]:
    """A worker that was stopped in its write transaction."""
    command = [sys.executable, "-c", STOPPED, str(store.session.path)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment, cwd=ROOT)
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    os.waitid(os.P_PID, process.pid, os.WSTOPPED | os.WNOWAIT)
    yield process
    process.kill()
    process.wait()
    process.stdout.close()


def test_a_silent_worker_is_told_by_readyz_and_by_studies(
    settings: Settings, store: Store, clock: fakes.HandClock, connect: Callable[..., httpx.Client]
) -> None:
    http = connect(create_app(settings, store=store, checker=InThread()))
    study = store.studies.create({}, fakes.study(4))
    assert http.get("/readyz").status_code == 200, "no worker has begun yet"
    epoch = store.work.take_over("here:1")
    clock.seconds = 60.0
    assert http.get("/readyz").status_code == 200
    assert store.studies.get(study.id).reason is None
    clock.seconds = 158.0
    answer = http.get("/readyz")
    assert (answer.status_code, answer.json()["detail"]) == (
        503, "No worker has responded for 158 s: studies are not run.",
    )  # fmt: skip
    reason = (
        "the worker (process here:1) has not responded since 2026-01-01T00:00:00+00:00; the study continues when "
        "a worker is at work"
    )
    assert {record.reason for record in (*store.studies.page().studies, store.studies.look(study.id)[0])} == {reason}
    late = store.studies.create({}, fakes.study(4))
    assert {late.reason, store.studies.prioritize(late.id, 1).reason} == {reason}, "in the answers to a change too"
    assert store.studies.pause(late.id).reason is None
    assert store.studies.resume(late.id).reason == reason
    store.work.heartbeat(epoch, fakes.report())
    clock.seconds += 10.0
    assert http.get("/readyz").status_code == 200
    assert store.studies.get(study.id).reason is None


def test_a_worker_beside_the_service_makes_no_database_in_the_place_of_one_that_is_gone(tmp_path: Path) -> None:
    path = tmp_path / "gone.sqlite3"
    with pytest.raises(DatabaseError, match="was deleted or moved"):
        require_file(f"sqlite:///{path}")
    path.touch()
    require_file(f"sqlite:///{path}")
    require_file("postgresql+psycopg://nobody@localhost/sprag")


def test_a_write_lock_that_is_never_free_is_told(store: Store, clock: fakes.HandClock) -> None:
    readiness = Readiness(store, locked_seconds=0.01)
    other = sqlite_driver().connect(store.session.path, isolation_level=None)
    other.execute("BEGIN IMMEDIATE")
    assert "The write lock of the database was not free for 0.01 s" in readiness.problems()[0]
    other.execute("ROLLBACK")
    other.close()
    clock.seconds = 10.0
    assert readiness.problems() == ()


@pytest.mark.parametrize(("change", "reason"), [(Path.unlink, "was deleted"), (None, "was replaced")])
def test_what_would_be_lost_with_a_file_is_not_taken(
    store: Store, change: Callable[[Path], None] | None, reason: str
) -> None:
    path = store.session.path
    if change is None:
        shutil.copy(path, path.with_name("copy"))
        os.replace(path.with_name("copy"), path)
    else:
        change(path)
    (problem,) = Readiness(store).problems()
    assert reason in problem
    with pytest.raises(DatabaseError, match=reason):
        store.studies.create({}, fakes.study(4))


def _replace(path: Path) -> None:
    shutil.copy(path, path.with_name("copy"))
    os.replace(path.with_name("copy"), path)


def _move(path: Path) -> None:
    path.rename(path.with_name("away"))


@pytest.mark.parametrize(
    ("change", "reason"),
    [(_move, "was deleted or moved"), (Path.unlink, "was deleted or moved"), (_replace, "was replaced")],
)
def test_submissions_tell_that_the_file_is_gone(
    settings: Settings,
    store: Store,
    connect: Callable[..., httpx.Client],
    change: Callable[[Path], None],
    reason: str,
    caplog: pytest.LogCaptureFixture,
) -> None:
    http = connect(create_app(settings, store=store, checker=InThread()))
    path = store.session.path
    change(path)
    there = path.exists()
    store.session.close()  # so that the next request opens the file anew
    answer = http.post("/api/v1/studies", json=SPEC)
    assert (answer.status_code, answer.json()["type"]) == (503, "/problems/unavailable")
    assert reason in answer.json()["detail"]
    assert f"POST /api/v1/studies: {answer.json()['detail']}" in caplog.text
    assert path.exists() == there, "no empty file takes its place"
    with refused(DatabaseError, "database-replaced"):
        store.room.left()


def test_errors_of_the_disk_are_those_of_a_file_that_is_gone(store: Store) -> None:
    error = sa.exc.OperationalError("SELECT 1", None, sqlite_driver().OperationalError("disk I/O error"))
    with refused(DatabaseFullError, "storage-full"), store.session.read():
        raise error
    _move(store.session.path)
    with refused(DatabaseError, "database-replaced") as raised, store.session.read():
        raise error
    assert not isinstance(raised.value, DatabaseFullError)


def test_damage_is_found_and_told(store: Store, clock: fakes.HandClock) -> None:
    readiness = Readiness(store)
    for _ in range(20):
        store.studies.create({"text": "x" * 10_000}, fakes.study(50))
    with store.session.plain() as connection:
        connection.exec_driver_sql("PRAGMA wal_checkpoint(TRUNCATE)")
    data = bytearray(store.session.path.read_bytes())
    data[len(data) // 2 :] = b"\xff" * (len(data) - len(data) // 2)
    store.session.path.write_bytes(data)
    clock.seconds = 600.0
    for _ in range(2):
        assert "is damaged" in readiness.problems()[0]
        clock.seconds += 10.0


def test_a_worker_that_was_stopped_in_its_transaction_is_ended_by_take_over(
    settings: Settings, store: Store, stopped: subprocess.Popen[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dispatching, "LOCKED_SECONDS", 0.01)
    assert Readiness(store, locked_seconds=0.01).problems()
    study = store.studies.get  # reads go on
    said: list[str] = []
    run_dispatcher(
        WorkerSettings(settings.database_url, 1, 60.0), lambda: True, say=said.append,
        executor=lambda _: InlineExecutor(fakes.run), take_over=True,
    )  # fmt: skip
    assert stopped.wait(600) == -signal.SIGKILL
    assert said[0] == f"process {stopped.pid} hung and was ended"
    record = store.studies.create({}, fakes.study(4))
    assert study(record.id).cases == 4


def test_only_the_very_process_that_took_the_lock_is_ended(store: Store, stopped: subprocess.Popen[str]) -> None:
    lock = DispatcherLock(store.session.path)
    pid, start, host = lock.path.read_text(encoding="ascii").split()
    assert (int(pid), int(start)) == (stopped.pid, start_time(stopped.pid))
    for other in (
        f"{pid} {int(start) + 1} {host}",
        f"{pid} {start} elsewhere",
        f"{pid}",
        f"{pid}  {host}",
        "",
        "x y z",
    ):
        lock.path.write_text(other + "\n", encoding="ascii")
        assert not lock.end_holder()
    assert psutil.Process(stopped.pid).status() == psutil.STATUS_STOPPED


def test_the_table_of_processes_tells_their_start() -> None:
    ticks = start_time(os.getpid())
    assert ticks is not None
    uptime = float(Path("/proc/uptime").read_text(encoding="ascii").split()[0])
    assert 0.0 < ticks / os.sysconf("SC_CLK_TCK") <= uptime
    assert start_time(2**30) is None
