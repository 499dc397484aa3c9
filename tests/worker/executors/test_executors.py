"""Both executors: the same results, one outcome for every chunk, and a death costs one chunk only."""

from __future__ import annotations

import os
import random
import signal
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path

import numpy as np
import psutil
import pytest

from sprag_study.worker import models
from sprag_study.worker.executors.inline import InlineExecutor
from sprag_study.worker.executors.process_pool import MAX_FAILED_STARTS, SPARE_CHUNKS, ProcessPoolExecutor
from sprag_study.worker.fingerprint import prepare_as
from sprag_study.worker.models import KernelShape
from sprag_study.worker.ports import Chunk, Executor, ExecutorError, Fate, KernelError, Outcome
from sprag_study.worker.study import Study
from tests.worker import fakes

DEADLINE = 600.0


def gather(executor: Executor, count: int) -> dict[int, Outcome]:
    """Wait for that many outcomes."""
    found: dict[int, Outcome] = {}
    while len(found) < count:
        came = executor.wait(DEADLINE)
        assert came, "nothing came back"
        for outcome in came:
            assert outcome.ticket not in found
            found[outcome.ticket] = outcome
    return found


def submit(executor: Executor, chunks: int, size: int = 4) -> None:
    study = fakes.study(chunks * size)
    for index in range(chunks):
        executor.submit(index, study, Chunk(1, index * size, size))


def pool_processes() -> list[psutil.Process]:
    """Processes of the pools that live."""
    found, own = [], psutil.Process().cmdline()
    for child in psutil.Process().children():
        with suppress(psutil.NoSuchProcess):  # a zombie is one, too
            command = child.cmdline()
            # A new process has the parent's command until it is replaced, and none for a moment then.
            if "spawn_main" in " ".join(command) or command in (own, []):
                found.append(child)
    return found


@pytest.fixture
def start() -> Iterator[Callable[..., ProcessPoolExecutor]]:
    """Starts pools and closes them at the end."""
    pools: list[ProcessPoolExecutor] = []

    def begin(processes: int = 2, **options: object) -> ProcessPoolExecutor:
        pools.append(fakes.pool(processes, **options))  # type: ignore[arg-type]
        return pools[-1]

    yield begin
    for pool in pools:
        pool.close()


def test_every_chunk_comes_back_with_its_own_cases(start: Callable[..., ProcessPoolExecutor]) -> None:
    pool = start(2)
    assert pool.capacity == 2 + SPARE_CHUNKS
    submit(pool, 6)
    for ticket, outcome in gather(pool, 6).items():
        assert outcome.fate is Fate.DONE
        assert outcome.result is not None
        assert outcome.result.first == ticket * 4
        np.testing.assert_array_equal(outcome.result.values, fakes.values(ticket * 4, 4))
    assert pool.wait(0.0) == []


def test_a_death_costs_one_chunk(start: Callable[..., ProcessPoolExecutor]) -> None:
    pool = start(2, run=fakes.faulty(crash=frozenset({9})))
    submit(pool, 6)
    outcomes = gather(pool, 6)
    assert {ticket for ticket, outcome in outcomes.items() if outcome.fate is Fate.CRASHED} == {2}
    assert f"{-signal.SIGKILL}" in outcomes[2].detail
    submit(pool, 1)
    assert gather(pool, 1)[0].fate is Fate.DONE


def test_every_chunk_comes_back_once_whoever_is_killed(start: Callable[..., ProcessPoolExecutor]) -> None:
    """A death at any moment of a process's life (as it starts, idle, at work) loses no chunk and no other chunk."""
    pool = start(2)
    chosen = random.Random(1)
    study = fakes.study(4)
    found: dict[int, Outcome] = {}
    killed = 0
    for ticket in range(30):
        pool.submit(ticket, study, Chunk(1, 0, 4))
        if ticket % 3 == 0:
            for victim in pool_processes()[: chosen.randrange(3)]:
                victim.kill()
                killed += 1
        while len(found) <= ticket - chosen.randrange(4):
            for outcome in pool.wait(DEADLINE):
                assert outcome.ticket not in found
                found[outcome.ticket] = outcome
    found |= gather(pool, 30 - len(found))
    assert set(found) == set(range(30))
    failed = [outcome for outcome in found.values() if outcome.fate is not Fate.DONE]
    assert killed > 1
    assert len(failed) <= killed
    assert all("did not start" in outcome.detail for outcome in failed if outcome.fate is not Fate.CRASHED)


def test_what_never_returns_is_killed(start: Callable[..., ProcessPoolExecutor]) -> None:
    pool = start(1, run=fakes.faulty(hang=frozenset({0})), chunk_timeout=2.0)
    submit(pool, 3)
    outcomes = gather(pool, 3)
    assert outcomes[0].fate is Fate.TIMED_OUT
    assert "2 s" in outcomes[0].detail
    assert [outcomes[1].fate, outcomes[2].fate] == [Fate.DONE, Fate.DONE]


def test_chunks_are_stopped_running_or_not(start: Callable[..., ProcessPoolExecutor]) -> None:
    pool = start(1, run=fakes.faulty(hang=frozenset({0})))
    submit(pool, 1)
    assert pool.wait(0.5) == []
    submit_second = partial(pool.submit, 1, fakes.study(8), Chunk(1, 4, 4))
    submit_second()
    pool.stop(1)
    assert gather(pool, 1)[1].fate is Fate.STOPPED
    pool.stop(0)
    assert gather(pool, 1)[0].fate is Fate.STOPPED
    submit_second()
    assert gather(pool, 1)[1].fate is Fate.DONE


def loaded(pool: ProcessPoolExecutor, study: Study) -> bool:
    """Whether the kernel is there once the pool has had time to load it; raises KernelError."""
    return any(pool.ready(study) or pool.wait(DEADLINE) for _ in range(4))


def test_a_kernel_is_loaded_before_its_study_is_ready(start: Callable[..., ProcessPoolExecutor]) -> None:
    pool = start(1)
    assert not pool.ready(fakes.study(4))
    assert loaded(pool, fakes.study(4))
    assert pool.ready(fakes.study(9))
    assert not pool.ready(fakes.study(4, tolerance=1e-6))


def test_chunks_are_run_while_a_kernel_compiles(start: Callable[..., ProcessPoolExecutor], tmp_path: Path) -> None:
    fifo = tmp_path / "told"
    os.mkfifo(fifo)
    slow = fakes.study(4, tolerance=1e-6)
    pool = start(2, load=partial(fakes.load_when_told, tolerance=1e-6, fifo=str(fifo)))
    assert not pool.ready(slow)
    assert not pool.ready(fakes.study(4)), "half of the processes at most compile"
    submit(pool, 4)
    assert {outcome.fate for outcome in gather(pool, 4).values()} == {Fate.DONE}
    assert not pool.ready(slow)
    fifo.write_text("now")
    assert loaded(pool, slow)
    assert loaded(pool, fakes.study(4))


def test_a_kernel_in_the_cache_waits_for_no_other(start: Callable[..., ProcessPoolExecutor]) -> None:
    pool = start(2, load=fakes.load_never, compiled=lambda shape: shape.key[-1] == 1e-9)
    assert not pool.ready(fakes.study(4, tolerance=1e-6))
    assert pool.ready(fakes.study(4))
    submit(pool, 4)
    assert {outcome.fate for outcome in gather(pool, 4).values()} == {Fate.DONE}


@pytest.mark.parametrize(
    ("load", "limit", "message"),
    [
        (fakes.load_never, 0.3, "not compiled within 0.3 s"),
        (fakes.load_dies, DEADLINE, "process that compiled its kernel died"),
        (fakes.load_fails, DEADLINE, "ZeroDivisionError: no such kernel"),
    ],
)
def test_a_kernel_that_does_not_come_is_not_taken_for_loaded(
    start: Callable[..., ProcessPoolExecutor], load: Callable[[KernelShape], None], limit: float, message: str
) -> None:
    pool = start(1, load=load, load_timeout=limit)
    for _ in range(2):
        with pytest.raises(KernelError, match=message):
            loaded(pool, fakes.study(4))


def test_an_exception_is_told_as_a_crash(start: Callable[..., ProcessPoolExecutor]) -> None:
    for executor in (start(1, run=fakes.raising), InlineExecutor(fakes.raising)):
        submit(executor, 1)
        (outcome,) = gather(executor, 1).values()
        assert outcome.fate is Fate.CRASHED
        assert outcome.detail == "ZeroDivisionError: no such thing"


def test_processes_that_die_as_they_start_are_not_started_for_ever(start: Callable[..., ProcessPoolExecutor]) -> None:
    pool = start(1, prepare=fakes.broken)
    fates: list[Fate] = []

    def insist() -> None:
        while len(fates) < 100:
            submit(pool, 1)
            fates.extend(outcome.fate for outcome in gather(pool, 1).values())

    with pytest.raises(ExecutorError, match="as soon as they start"):
        insist()
    assert set(fates) <= {Fate.STOPPED}
    assert len(fates) <= MAX_FAILED_STARTS + 1
    assert pool.shortage == pool.report().shortage == "The processes of the pool end as they start; the log says why."
    assert not any(worker.usable for worker in pool.report().workers)


def test_an_idle_process_that_is_killed_costs_nothing(start: Callable[..., ProcessPoolExecutor]) -> None:
    pool = start(1)
    submit(pool, 1)
    gather(pool, 1)
    pool_processes()[0].kill()
    submit(pool, 4)
    assert all(outcome.fate is Fate.DONE for outcome in gather(pool, 4).values())
    submit(pool, 1)
    assert gather(pool, 1)[0].fate is Fate.DONE


def test_processes_that_are_killed_idle_are_replaced_without_a_chunk(start: Callable[..., ProcessPoolExecutor]) -> None:
    pool = start(2)
    submit(pool, 4)
    gather(pool, 4)
    before = {process.pid for process in pool_processes()}
    for process in pool_processes():
        process.kill()
        process.wait(DEADLINE)
    assert pool.wait(0.0) == []
    after = {process.pid for process in pool_processes()}
    assert len(after) == 2
    assert not after & before
    submit(pool, 2)
    assert {outcome.fate for outcome in gather(pool, 2).values()} == {Fate.DONE}


def test_no_process_outlives_its_pool() -> None:
    pool = fakes.pool(2, run=fakes.faulty(hang=frozenset({0, 4})))
    submit(pool, 2)
    assert pool.wait(0.5) == []
    assert len(pool_processes()) == 2
    pool.close()
    assert pool_processes() == []


def test_one_process_warms_the_cache_and_the_engine_gives_the_same_everywhere() -> None:
    """Inline and pool agree bit for bit, for any cut of the study."""
    study = fakes.study(20)
    whole = models.run_chunk(study, 0, 20)
    pool = ProcessPoolExecutor(2, chunk_timeout=DEADLINE)
    try:
        assert loaded(pool, study)
        for executor, size in ((InlineExecutor(), 20), (InlineExecutor(), 3), (pool, 7), (pool, 1)):
            firsts = range(0, 20, size)
            for first in firsts:
                executor.submit(first, study, Chunk(1, first, min(size, 20 - first)))
            outcomes = gather(executor, len(firsts))
            results = [outcomes[first].result for first in firsts]
            found = np.concatenate([result.values for result in results if result is not None])
            np.testing.assert_array_equal(found, whole.values)
            assert [e for result in results if result is not None for e in result.endings] == whole.endings
    finally:
        pool.close()


def test_a_process_that_starts_after_an_upgrade_runs_nothing(capfd: pytest.CaptureFixture[str]) -> None:
    pool = fakes.pool(1, prepare=partial(prepare_as, "the fingerprint of before"))

    def insist() -> None:
        for _ in range(MAX_FAILED_STARTS + 1):
            submit(pool, 1)
            assert gather(pool, 1)[0].fate is Fate.STOPPED

    try:
        with pytest.raises(ExecutorError, match="die as soon as they start"):
            insist()
        assert "changed while the worker ran: it must be started again" in capfd.readouterr().err
    finally:
        pool.close()


def test_inline_runs_one_at_a_time_and_drops_what_is_stopped() -> None:
    executor = InlineExecutor(fakes.run)
    assert executor.capacity == 1
    submit(executor, 3)
    executor.stop(1)
    outcomes = gather(executor, 3)
    assert [outcomes[ticket].fate for ticket in range(3)] == [Fate.DONE, Fate.STOPPED, Fate.DONE]
    assert executor.wait(0.0) == []
    submit(executor, 1)
    executor.close()
    assert executor.wait(0.0) == []
