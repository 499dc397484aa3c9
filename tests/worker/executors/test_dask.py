"""The Dask executor: the same bits as the others, one chunk to a death, and workers that are refused."""

from __future__ import annotations

import os
import re
import shutil
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from threading import Event

import numpy as np
import pytest
from distributed import Client, Future

from sprag_study.service.jobs.dispatching import WorkerSettings, pool
from sprag_study.service.jobs.workers import worker_list
from sprag_study.service.storage.part import SystemClock
from sprag_study.service.storage.store import Store
from sprag_study.worker import fingerprint, models, traces
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.dispatcher import Dispatcher
from sprag_study.worker.executors.dask import DaskExecutor
from sprag_study.worker.executors.dask_jobs import Worker
from sprag_study.worker.executors.dask_tasks import load_and_answer
from sprag_study.worker.executors.inline import InlineExecutor
from sprag_study.worker.executors.process_pool import SPARE_CHUNKS, ProcessPoolExecutor
from sprag_study.worker.ports import Chunk, Executor, ExecutorError, Fate, KernelError, Outcome
from sprag_study.worker.reports import processor
from sprag_study.worker.states import StudyState
from sprag_study.worker.study import Study
from tests.conftest import ROOT
from tests.otlp import receiver
from tests.worker import fakes
from tests.worker.executors.clusters import DEADLINE, LEAVES_CONNECTIONS, Cluster, clusters

pytestmark = LEAVES_CONNECTIONS


def eventually(true: Callable[[], object]) -> None:
    begin = time.monotonic()
    while not true():
        assert time.monotonic() - begin < DEADLINE
        time.sleep(0.02)


def ready(executor: Executor, study: Study) -> None:
    begin = time.monotonic()
    while not executor.ready(study):
        assert time.monotonic() - begin < DEADLINE
        executor.wait(0.05)


def gather(executor: Executor, count: int) -> dict[int, Outcome]:
    found: dict[int, Outcome] = {}
    begin = time.monotonic()
    while len(found) < count:
        assert time.monotonic() - begin < DEADLINE
        for outcome in executor.wait(0.1):
            assert outcome.ticket not in found
            found[outcome.ticket] = outcome
    return found


def run_all(executor: Executor, study: Study, size: int) -> dict[int, Outcome]:
    ready(executor, study)
    spans = range(0, study.cases, size)
    for ticket, first in enumerate(spans):
        executor.submit(ticket, study, Chunk(1, first, min(size, study.cases - first)))
    return gather(executor, len(spans))


@pytest.fixture(scope="module")
def cluster() -> Iterator[Cluster]:
    """A scheduler and two workers, as processes; libraries of the second one take their code for any processor."""
    with clusters() as made:
        made.start_scheduler()
        made.start_worker()
        made.start_worker(**fakes.of_any_processor())
        yield made


@pytest.fixture
def start(cluster: Cluster) -> Iterator[Callable[..., DaskExecutor]]:
    made: list[DaskExecutor] = []

    def begin(**options: object) -> DaskExecutor:
        given = {"chunk_timeout": DEADLINE, "run": fakes.run, "load": fakes.load} | options
        made.append(DaskExecutor(cluster.url, 0, **given))  # type: ignore[arg-type]
        return made[-1]

    yield begin
    for executor in made:
        executor.close()


def test_inline_pool_and_dask_give_the_same_bits(start: Callable[..., DaskExecutor], tmp_path: Path) -> None:
    """On Dask's workers too, whose numpy and C library compute as on two kinds of processors."""
    study = fakes.study(30)
    dask = start(run=partial(fakes.run_beside, folder=str(tmp_path)), load=load_and_answer)
    processes = ProcessPoolExecutor(2, chunk_timeout=DEADLINE)
    cuts = ((InlineExecutor(), 30), (processes, 4), (dask, 7))
    try:
        found = [run_all(executor, study, size) for executor, size in cuts]
    finally:
        processes.close()
    rows = []
    for outcomes in found:
        results = [outcomes[ticket].result for ticket in sorted(outcomes)]
        rows.append(
            (
                np.concatenate([result.values for result in results if result]).tobytes(),
                [ending for result in results if result for ending in result.endings],
                [flag for result in results if result for flag in result.flags],
            )
        )
    assert rows[0] == rows[1] == rows[2]
    assert len(rows[0][1]) == 30
    assert sorted(file.read_text() for file in tmp_path.iterdir()) == ["", " ".join(fakes.numpy_features())]
    workers = dask.report().workers
    assert [(worker.usable, worker.processor) for worker in workers] == [(True, processor())] * 2


def test_a_death_costs_one_chunk_and_the_worker_comes_back(start: Callable[..., DaskExecutor]) -> None:
    executor = start(run=fakes.faulty(crash=frozenset({9})))
    eventually(lambda: executor.wait(0.05) or executor.capacity == 2 + SPARE_CHUNKS)
    outcomes = run_all(executor, fakes.study(40), 4)
    assert {ticket: outcome.fate for ticket, outcome in outcomes.items() if outcome.fate is not Fate.DONE} == {
        2: Fate.CRASHED
    }
    for ticket, outcome in outcomes.items():
        if ticket != 2:
            assert outcome.result is not None
            np.testing.assert_array_equal(outcome.result.values, fakes.values(ticket * 4, 4))
    eventually(lambda: executor.wait(0.05) or executor.capacity == 2 + SPARE_CHUNKS)


def test_what_never_returns_ends_with_its_worker(start: Callable[..., DaskExecutor]) -> None:
    executor = start(run=fakes.faulty(hang=frozenset({0})), chunk_timeout=1.0)
    outcomes = run_all(executor, fakes.study(12), 4)
    assert {ticket: outcome.fate for ticket, outcome in outcomes.items()} == {
        0: Fate.TIMED_OUT, 1: Fate.DONE, 2: Fate.DONE,
    }  # fmt: skip
    # Of what the worker died is not known: a lack of memory looks the same.
    assert re.fullmatch(r"its worker was gone after \S+ s; the limit is 1 s of processor time", outcomes[0].detail)


def test_a_fault_of_the_program_is_told_by_its_name(start: Callable[..., DaskExecutor]) -> None:
    outcomes = run_all(start(run=fakes.raising), fakes.study(4), 4)
    assert (outcomes[0].fate, outcomes[0].detail) == (Fate.CRASHED, "ZeroDivisionError: no such thing")


def test_chunks_are_stopped_whether_they_run_or_not(
    start: Callable[..., DaskExecutor], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sprag_study.worker.executors.dask.STOP_SECONDS", 0.2)
    monkeypatch.setattr("sprag_study.worker.executors.dask.WAITING_SECONDS", DEADLINE)
    executor = start(run=fakes.faulty(hang=frozenset(range(8))), chunk_timeout=10 * DEADLINE)
    study = fakes.study(12)
    ready(executor, study)
    for ticket in range(3):
        executor.submit(ticket, study, Chunk(1, 4 * ticket, 4))
    for ticket in range(2):
        executor.stop(ticket)
        executor.stop(ticket)
    executor.stop(99)
    outcomes = gather(executor, 3)  # the third one runs when a worker was ended, and is back
    assert [outcomes[ticket].fate for ticket in range(3)] == [Fate.STOPPED, Fate.STOPPED, Fate.DONE]
    assert executor.wait(0.0) == []


@pytest.mark.parametrize("fate", ["finished", "lost"])
def test_the_connection_stays_until_what_came_of_a_job_is_fetched(
    start: Callable[..., DaskExecutor], monkeypatch: pytest.MonkeyPatch, fate: str
) -> None:
    fetching, closing, seen, own = Event(), Event(), [], []
    name = "result" if fate == "finished" else "exception"
    fetch, close = getattr(Future, name), Client.close

    def slow(future: Future, *args: object, **options: object) -> object:
        if not future.key.startswith("sprag-1-"):
            return fetch(future, *args, **options)
        own.append(future.client)
        fetching.set()
        seen.append(closing.wait(0.5))  # which only a connection that is closed too soon ends
        found = fetch(future, *args, **options)
        seen.append(future.client.status)
        return found

    def closed(client: Client, *args: object, **options: object) -> object:
        if client in own:  # not one that an earlier test left to be collected
            closing.set()
        return close(client, *args, **options)

    executor = start(run=fakes.run if fate == "finished" else fakes.raising)
    study = fakes.study(4)
    ready(executor, study)
    monkeypatch.setattr(Future, name, slow)
    monkeypatch.setattr(Client, "close", closed)
    executor.submit(0, study, Chunk(1, 0, 4))
    assert fetching.wait(DEADLINE)
    executor.close()
    assert seen == [False, "running"]
    assert closing.is_set()


def test_nothing_is_asked_of_a_connection_that_was_closed(
    start: Callable[..., DaskExecutor], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    asked: list[str] = []
    begun, told = tmp_path / "begun", tmp_path / "told"
    for fifo in (begun, told):
        os.mkfifo(fifo)
    executor = start(run=partial(fakes.run_between, begun=str(begun), told=str(told)))
    study = fakes.study(4)
    ready(executor, study)
    executor.submit(0, study, Chunk(1, 0, 4))
    assert begun.read_text() == "begun"
    monkeypatch.setattr(Future, "exception", lambda future, **_: asked.append(future.key))
    monkeypatch.setattr(Future, "result", lambda future, **_: asked.append(future.key))
    executor.close()
    told.write_text("now")  # the worker is free for the next test
    # One thread calls back after the other, so that of the chunk is through when this one is.
    if Future._cb_executor is not None:
        Future._cb_executor.submit(int).result(DEADLINE)
    assert asked == []


def test_a_worker_with_another_numpy_is_refused(
    start: Callable[..., DaskExecutor], caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    executor = start(expected={**fingerprint.present(), "numpy": "0.9"})
    eventually(lambda: executor.wait(0.05) or caplog.text.count("is refused") == 2)
    reason = f"is refused: numpy: {np.__version__} instead of 0.9"
    assert reason in caplog.text
    assert executor.capacity == 0
    # Another dispatcher may have workers for what waits.
    monkeypatch.setattr("sprag_study.worker.executors.dask.WAITING_SECONDS", 0.0)
    executor.submit(7, fakes.study(4), Chunk(1, 0, 4))
    assert gather(executor, 1)[7].fate is Fate.STOPPED
    assert not executor.ready(fakes.study(1))
    assert (executor.shortage or "").startswith("No usable worker has joined the scheduler tcp://127.0.0.1:")
    assert f"{reason} (and 1 more)." in (executor.shortage or "")


def test_workers_of_earlier_versions_tell_nothing_of_their_processor() -> None:
    worker = Worker("tcp://a:1", "a")
    worker.introduced({**fingerprint.present(), "sprag": "0.0.1"}, fingerprint.present())
    assert (worker.usable, worker.processor) == (False, "")
    assert worker.refusal == f"sprag: 0.0.1 instead of {fingerprint.present()['sprag']}"


def test_another_process_at_the_address_of_a_worker_runs_nothing(start: Callable[..., DaskExecutor]) -> None:
    executor, study = start(), fakes.study(8)
    ready(executor, study)
    accepted, executor._digest = executor._digest, "of the processes before"
    executor.submit(0, study, Chunk(1, 0, 4))
    outcome = gather(executor, 1)[0]
    assert (outcome.fate, outcome.detail) == (Fate.STOPPED, "another process has the address of its worker")
    another = fakes.study(4, tolerance=1e-8)
    executor.ready(another)
    executor.wait(1.0)
    assert not executor.ready(another)  # a failed load would be a KernelError
    executor._digest = accepted
    assert {found.fate for found in run_all(executor, another, 4).values()} == {Fate.DONE}


def test_a_worker_whose_kernel_gives_other_answers_is_refused(
    start: Callable[..., DaskExecutor], tmp_path: Path
) -> None:
    executor, study = start(load=partial(fakes.load_answering, folder=str(tmp_path))), fakes.study(40)
    eventually(lambda: executor.wait(0.05) or executor.capacity == 2 + SPARE_CHUNKS)
    outcomes = run_all(executor, study, 4)
    assert {outcome.fate for outcome in outcomes.values()} == {Fate.DONE}
    eventually(lambda: executor.wait(0.05) or executor.capacity == 1 + SPARE_CHUNKS)
    (refused,) = [worker for worker in executor.report().workers if not worker.usable]
    (first,) = [worker for worker in executor.report().workers if worker.usable]
    assert refused.refusal == f"known answers of its kernel: others instead of ones of {first.address}"


def edited_engine(folder: Path) -> dict[str, str]:
    """A copy of the sources whose engine is a hundred times less accurate, under the same version."""
    for package in ("sprag_study", "engine", "worker"):
        copied = {"symlinks": True, "ignore": shutil.ignore_patterns("__pycache__")}
        shutil.copytree(ROOT / package, folder / package, **copied)
    cases = folder / "engine" / "vibration_drive" / "cases.py"
    cases.write_text(cases.read_text(encoding="utf-8") + "\nTOLERANCE_FACTOR = 100.0\n", encoding="utf-8")
    return {}


def no_sprag(folder: Path) -> dict[str, str]:
    """No package of Sprag that could be imported."""
    (folder / "sprag_study.py").write_text("raise ImportError('there is no Sprag here')\n", encoding="utf-8")
    return {}


def other_settings(folder: Path) -> dict[str, str]:
    """The same sources, compiled otherwise."""
    (folder / "sprag_study").symlink_to(ROOT / "sprag_study")
    return {"NUMBA_OPT": "0"}


def test_workers_that_would_give_other_values_run_nothing_and_the_study_says_so(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    others: dict[Callable[[Path], dict[str, str]], str] = {
        edited_engine: "sources of engine and worker: ",
        no_sprag: "it cannot run Sprag (ImportError: there is no Sprag here)",
        other_settings: "numba settings: NUMBA_OPT=0 instead of ",
    }
    with clusters() as made, Store.open(f"sqlite:///{tmp_path / 'a.sqlite3'}", chunking=Chunking(cases=4)) as store:
        record = store.studies.create({}, fakes.study(20))
        made.start_scheduler()
        for other in others:
            folder = tmp_path / other.__name__
            folder.mkdir()
            made.start_worker(folder=folder, **other(folder))
        executor = DaskExecutor(made.url, 0, chunk_timeout=DEADLINE, run=fakes.run, load=fakes.load)

        def told() -> bool:
            reason = store.studies.get(record.id).reason or ""
            reported = sum(len(item["refused"]) for item in worker_list(store.dispatchers)["dispatchers"]) == len(
                others
            )
            return (
                reported
                and f"(and {len(others) - 1} more)" in reason
                and any(each in reason for each in others.values())
            )

        begin = time.monotonic()
        Dispatcher(store.work, executor, SystemClock()).run(lambda: told() or time.monotonic() - begin > DEADLINE)
        assert told()
        assert store.studies.get(record.id).done == 0
        assert [each for each in others.values() if each not in caplog.text] == []
        (found,) = worker_list(store.dispatchers)["dispatchers"]
        assert (found["usable"], [host["refused"] for host in found["hosts"]]) == (0, [len(others)])
        reasons = " ".join(worker["reason"] for worker in found["refused"])
        assert [each for each in others.values() if each not in reasons] == []
        assert (found["shortage"] or "").startswith("No usable worker")


def test_a_kernel_that_cannot_be_had_is_told(start: Callable[..., DaskExecutor]) -> None:
    executor = start(load=fakes.raising)
    with pytest.raises(KernelError, match=r"cannot be compiled \(ZeroDivisionError: no such thing\)"):
        ready(executor, fakes.study(1))


def test_damaged_kernels_are_compiled_anew(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    study = fakes.study(80)
    with clusters() as made, Store.open(f"sqlite:///{tmp_path / 'a.sqlite3'}", chunking=Chunking(cases=4)) as store:
        made.start_scheduler()
        made.start_worker(2, SPRAG_KERNEL_CACHE=str(tmp_path))
        # One after the other dies while it loads; the next one finds the damaged file gone.
        executor = DaskExecutor(made.url, 0, chunk_timeout=DEADLINE, run=fakes.run, load=fakes.load_or_die)
        eventually(lambda: executor.wait(0.05) or executor.capacity == 2 + SPARE_CHUNKS)
        damaged = tmp_path / "kernels" / models.cache_folder().name / fakes.DAMAGED
        damaged.parent.mkdir(parents=True, exist_ok=True)
        damaged.touch()
        assert {outcome.fate for outcome in run_all(executor, study, 20).values()} == {Fate.DONE}
        assert caplog.text.count("died while loading a kernel; their host compiles its kernels anew") == 1
        assert not damaged.exists()
        executor.close()
        # Every chunk crashes, of workers that have the damaged kernel in hand; nobody is quarantined.
        damaged.touch()
        given = {"chunk_timeout": DEADLINE, "run": fakes.run_or_die, "load": fakes.load_damaged}
        first = DaskExecutor(made.url, 0, **given)  # type: ignore[arg-type]
        record = store.studies.create({}, study)
        dispatcher = Dispatcher(
            store.work, first, SystemClock(),
            renew=lambda: DaskExecutor(made.url, 0, renew=True, **given),  # type: ignore[arg-type]
        )  # fmt: skip
        dispatcher.run(lambda: not store.work.active_studies())
        ended = store.studies.get(record.id)
        assert (ended.state, ended.ok) == (StudyState.FINISHED, 80)
        assert caplog.text.count("Its kernels are compiled anew and its cases run again.") == 1
        assert not damaged.exists()


def test_a_scheduler_that_stays_away_ends_the_executor_with_a_sentence() -> None:
    with clusters() as made:
        executor = DaskExecutor(made.url, 0, chunk_timeout=1.0, scheduler_seconds=0.0)
        why = rf"The scheduler tcp://127\.0\.0\.1:{made.port} cannot be reached; retrying: .*Connection refused"
        assert re.fullmatch(why, executor.shortage or "")
        with pytest.raises(ExecutorError, match=rf"127.0.0.1:{made.port} could not be reached for 0 s"):
            eventually(lambda: executor.wait(0.05))
        executor.close()


def test_a_cluster_of_its_own_runs_chunks() -> None:
    executor = pool(WorkerSettings("", 1, DEADLINE, executor="dask"))
    try:
        study = fakes.study(3)
        result = run_all(executor, study, 3)[0].result
        assert result is not None
        assert result.values.tobytes() == models.run_chunk(study, 0, 3).values.tobytes()
    finally:
        executor.close()


def test_the_span_of_a_task_is_a_part_of_its_chunk(monkeypatch: pytest.MonkeyPatch) -> None:
    with receiver() as otlp:
        for name, value in otlp.environment.items():
            monkeypatch.setenv(name, value)
        traces.start()
        executor = DaskExecutor("", 1, chunk_timeout=DEADLINE, run=fakes.run, load=fakes.load)  # type: ignore[arg-type]
        try:
            study = fakes.study(2)
            with traces.span("study"):
                ready(executor, study)
            with traces.span("chunk"):
                executor.submit(1, study, Chunk(1, 0, 2))
            assert gather(executor, 1)[1].fate is Fate.DONE
            (run,), (load,) = otlp.named("run chunk"), otlp.named("load kernel")
        finally:
            executor.close()
            traces.stop()
        assert otlp.above(run) == ["chunk"]
        assert otlp.above(load) == ["study"]
        assert run.process["process.pid"] == load.process["process.pid"] != os.getpid()
