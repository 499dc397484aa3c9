"""Running one study here, and a dispatcher on a database of its own or shared with others."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
import psutil
import pytest

from sprag_study.service.jobs import dispatching
from sprag_study.service.jobs.dispatching import StopFlag, WorkerSettings, run_dispatcher, start_dispatcher_process
from sprag_study.service.jobs.local import RunInterruptedError, StudyHeldError, run_here
from sprag_study.service.storage.database.lock import DispatcherLock
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.studies.records import Progress
from sprag_study.service.storage.work import room
from sprag_study.worker import models
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.executors.inline import InlineExecutor
from sprag_study.worker.ports import EpochLostError, Executor
from sprag_study.worker.states import StudyState
from tests.conftest import Finished
from tests.worker import fakes

DEADLINE = 600.0


def eventually(condition: Callable[[], bool]) -> None:
    """Wait for something another process or thread does."""
    pause = threading.Event()
    for _ in range(int(DEADLINE / 0.05)):
        if condition():
            return
        pause.wait(0.05)
    raise AssertionError("it did not come about")


@pytest.fixture
def url(sqlite_url: str) -> str:
    return sqlite_url


def test_a_study_is_run_in_a_passing_database() -> None:
    study = fakes.study(20)
    seen: list[Progress] = []
    with run_here({"sprag": 1}, study, processes=0, chunk_cases=3, on_progress=seen.append) as run:
        path = run.store.session.path
        assert run.record.state is StudyState.FINISHED
        rows = run.store.rows.block(run.record.id)
    assert not path.exists()
    assert (seen[-1].done, seen[-1].total) == (20, 20)
    np.testing.assert_array_equal(rows.values, models.run_chunk(study, 0, 20).values)


def test_a_study_stays_in_the_database_that_was_given(url: str) -> None:
    with run_here({"sprag": 1}, fakes.study(5), processes=2, database_url=url, executor=fakes.pool(2)) as run:
        record = run.record
    with Store.open(url) as store:
        assert store.studies.get(record.id) == record
        assert len(store.rows.block(record.id)) == 5


def test_a_held_study_is_no_result() -> None:
    with (
        pytest.raises(StudyHeldError, match=r"engine fault.*no such thing"),
        run_here({}, fakes.study(20), processes=0, chunk_cases=4, executor=InlineExecutor(fakes.raising)),
    ):
        raise AssertionError("there is nothing to do with it")


@pytest.mark.parametrize(
    ("database", "advice"),
    [([], "nothing of it is kept: free some space, or name another place with TMPDIR or --db"),
     (["--db", "runs.sqlite3"], "are kept as st_")],
)  # fmt: skip
def test_a_run_without_room_for_its_rows_is_trouble_of_the_storage(
    sprag: Callable[..., Finished],
    examples: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    database: list[str],
    advice: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    usage = shutil.disk_usage(tmp_path)
    monkeypatch.setattr(room.shutil, "disk_usage", lambda _: usage._replace(free=0))  # the new database's log has some
    done = sprag("run", examples / "measured_clutch.json", "-o", "rows.csv", *database)
    assert (done.code, done.out) == (3, "")
    assert "sprag: the study was held: no room: the disk that holds" in done.err
    assert advice in done.err
    assert "by itself" not in done.err
    assert not (tmp_path / "rows.csv").exists()


def test_rows_that_find_no_room_are_trouble_of_the_storage(sprag: Callable[..., Finished], examples: Path) -> None:
    done = sprag("show", examples / "press.toml", "trajectory", "--points", "20000", "-o", "/dev/full")
    assert (done.code, done.err) == (3, "sprag: /dev/full: no space left on device\n")


def test_a_failed_study_is_told_with_its_reason() -> None:
    def failing(task: models.ChunkTask) -> models.ChunkResult:
        return fakes.run(task, failing=True)

    with run_here({}, fakes.study(4), processes=0, executor=InlineExecutor(failing)) as run:
        assert run.record.state is StudyState.FAILED
        assert "none of the 4 cases ended ok; most of them: diverged." in (run.record.reason or "")


def inline(_: WorkerSettings) -> Executor:
    return InlineExecutor(fakes.run)


def test_where_another_dispatcher_is_at_work_that_one_runs_the_study(url: str) -> None:
    stop = StopFlag()
    settings = WorkerSettings(url, 1, DEADLINE)
    Store.open(url).close()
    other = threading.Thread(target=run_dispatcher, args=(settings, stop), kwargs={"executor": inline})
    other.start()
    try:
        eventually(lambda: DispatcherLock(Path(url.removeprefix("sqlite:///"))).holder() != "")
        with run_here({}, fakes.study(9), processes=1, database_url=url) as run:
            np.testing.assert_array_equal(run.store.rows.block(run.record.id).values, fakes.values(0, 9))
    finally:
        stop.set()
        other.join(DEADLINE)
    assert not other.is_alive()


def test_a_standby_waits_and_says_so(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dispatching, "STANDBY_SECONDS", 0.0)
    said: list[str] = []
    with Store.open(url) as store:
        lock = DispatcherLock(store.session.path)
        assert lock.take()
        turns = iter(range(10))

        def stopping() -> bool:
            turn = next(turns)
            if turn == 3:
                lock.release()
            return turn >= 5

        run_dispatcher(WorkerSettings(url, 1, DEADLINE), stopping, say=said.append, executor=inline)
    assert f"process {os.getpid()}" in said[0]
    assert "waiting for it to stop" in said[0]
    assert "is working on" in said[1]


def test_a_standby_tells_of_a_silent_worker_and_one_that_takes_over_does_not_wait(
    url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dispatching, "STANDBY_SECONDS", 0.0)
    monkeypatch.setattr(dispatching, "SILENT_SECONDS", -1.0)
    said: list[str] = []
    with Store.open(url) as store:
        lock, settings = DispatcherLock(store.session.path), WorkerSettings(url, 1, DEADLINE)
        assert lock.take()
        epoch = store.work.take_over("the silent one")
        turns = iter([False, False, False, True])
        run_dispatcher(settings, lambda: next(turns), say=said.append, executor=inline)
        assert [line for line in said if "--take-over" in line] == [said[1]]
        assert f"process {os.getpid()} has not responded" in said[1]
        run_dispatcher(settings, lambda: True, say=said.append, executor=inline, take_over=True)
        with pytest.raises(EpochLostError):
            store.work.heartbeat(epoch, fakes.report())
        lock.release()


def test_a_standby_ends_when_it_is_asked_to(url: str) -> None:
    with Store.open(url) as store:
        lock = DispatcherLock(store.session.path)
        assert lock.take()
        run_dispatcher(WorkerSettings(url, 1, DEADLINE), lambda: True, say=lambda _: None, executor=inline)
        assert store.dispatchers.latest() is None
        lock.release()


def test_a_new_dispatcher_clears_away_half_deleted_studies(url: str) -> None:
    with Store.open(url, chunking=Chunking(cases=4)) as store:
        record = store.studies.create({}, fakes.study(9))
        run_dispatcher(
            WorkerSettings(url, 1, DEADLINE),
            lambda: store.studies.get(record.id).state.terminal,
            say=lambda _: None,
            executor=inline,
        )
        store.studies.delete(record.id)
        with store.session.read() as connection:
            assert connection.exec_driver_sql("SELECT count(*) FROM vibration_drive_1").scalar_one() == 9

        def clear() -> bool:
            with store.session.read() as connection:
                return all(
                    connection.exec_driver_sql(f"SELECT count(*) FROM {table}").scalar_one() == 0
                    for table in ("vibration_drive_1", "chunks", "studies")
                )

        run_dispatcher(WorkerSettings(url, 1, DEADLINE), clear, say=lambda _: None, executor=inline)


def test_a_dispatcher_process_runs_studies_and_ends_in_order(url: str) -> None:
    with Store.open(url, chunking=Chunking(cases=4)) as store:
        record = store.studies.create({}, fakes.study(20))
        process = start_dispatcher_process(WorkerSettings(url, 2, DEADLINE))
        try:
            eventually(lambda: store.studies.get(record.id).state is StudyState.FINISHED)
            np.testing.assert_array_equal(
                store.rows.block(record.id).values, models.run_chunk(fakes.study(20), 0, 20).values
            )
        finally:
            process.terminate()
            process.join(DEADLINE)
        assert process.exitcode == 0


PARENT = """
import os, sys
from sprag_study.service.jobs.dispatching import WorkerSettings, start_dispatcher_process
if __name__ == "__main__":
    print(start_dispatcher_process(WorkerSettings(sys.argv[1], 2, 600.0)).pid, flush=True)
    sys.stdin.read()
"""


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux can tie a process to its parent")
def test_no_process_outlives_a_parent_that_is_killed(url: str, tmp_path: Path) -> None:
    script = tmp_path / "parent.py"
    script.write_text(PARENT, encoding="utf-8")
    command = [sys.executable, str(script), url]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        dispatcher = psutil.Process(int(parent.stdout.readline()))
        eventually(lambda: len(dispatcher.children()) >= 2)
        family = [dispatcher, *dispatcher.children(recursive=True)]
        parent.kill()
    assert psutil.wait_procs(family, timeout=DEADLINE)[1] == []


def test_a_run_that_is_interrupted_leaves_nothing_to_later_workers_and_its_rows_to_later_runs(url: str) -> None:
    study, chunks = fakes.study(20), iter(range(3))

    def interrupted(task: models.ChunkTask) -> models.ChunkResult:
        if next(chunks, None) is None:
            raise KeyboardInterrupt
        return models.run_task(task)

    with (
        pytest.raises(RunInterruptedError) as caught,
        run_here({}, study, processes=0, database_url=url, chunk_cases=4, executor=InlineExecutor(interrupted)),
    ):
        pass
    record = caught.value.record
    assert (record.state, record.cases) == (StudyState.CANCELLED, 20)
    assert record.done == 12
    with Store.open(url) as store:
        assert store.work.active_studies() == []
        assert store.studies.page().studies[0].state is StudyState.CANCELLED
    with run_here({}, study, processes=0, database_url=url, chunk_cases=4) as run:
        assert (run.record.state, run.record.reused) == (StudyState.FINISHED, record.done)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_that_a_callback_swallows_ends_the_run_all_the_same(url: str, number: signal.Signals) -> None:
    asked: list[signal.Signals] = []

    def swallow(_: Progress) -> None:
        asked.append(number)
        with suppress(KeyboardInterrupt):
            signal.raise_signal(number)

    handlers = {each: signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM)}
    try:
        for each in handlers:
            signal.signal(each, signal.default_int_handler)
        with (
            pytest.raises(RunInterruptedError) as caught,
            run_here({}, fakes.study(20), processes=0, database_url=url, chunk_cases=4, on_progress=swallow),
        ):
            pass
        assert [signal.getsignal(each) for each in handlers] == [signal.default_int_handler] * 2
    finally:
        for each, before in handlers.items():
            signal.signal(each, before)
    assert len(asked) == 1
    assert caught.value.record.state is StudyState.CANCELLED


def test_a_run_that_is_killed_leaves_its_study_held(url: str) -> None:
    class KilledError(BaseException):
        """Nothing after it is done."""

    def killed(_: models.ChunkTask) -> models.ChunkResult:
        raise KilledError

    with (
        pytest.raises(KilledError),
        run_here({}, fakes.study(20), processes=0, database_url=url, chunk_cases=4, executor=InlineExecutor(killed)),
    ):
        pass
    with Store.open(url) as store:
        (left,) = store.studies.page().studies
        assert left.state is StudyState.RUNNING
        store.work.take_over("a worker")
        assert store.studies.get(left.id).state is StudyState.PAUSED


def test_a_run_that_another_dispatcher_works_on_is_cancelled_too(url: str) -> None:
    lock = DispatcherLock(Path(url.removeprefix("sqlite:///")))
    assert lock.take()

    def interrupt(_: Progress) -> None:
        raise KeyboardInterrupt

    with (
        pytest.raises(RunInterruptedError) as caught,
        run_here({}, fakes.study(20), processes=0, database_url=url, on_progress=interrupt),
    ):
        pass
    assert caught.value.record.state is StudyState.CANCELLING
    lock.release()


def test_ctrl_c_tells_what_is_kept_and_how_to_go_on(
    sprag: Callable[..., Finished], examples: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("sprag_study.service.jobs.local.Dispatcher.run", interrupt)
        stopped = sprag("run", examples / "press.toml", "--db", tmp_path / "kept.sqlite3", "-o", tmp_path / "rows.csv")
    assert stopped.code == 130
    assert "is cancelled: 0 of" in stopped.err
    assert "the same command without --fresh reuses them" in stopped.err
    assert not (tmp_path / "rows.csv").exists()
