"""Processes this program starts: an interrupt at the terminal never finds them unprepared."""

from __future__ import annotations

import os
import signal
from multiprocessing import get_context
from typing import TYPE_CHECKING

import numpy as np
import pytest

from sprag_study.worker.pool.child_process import ChildProcess, ProcessDiedError, _read
from sprag_study.worker.pool.processes import NICENESS, interrupts_held_back
from tests.worker import fakes

if TYPE_CHECKING:
    from collections.abc import Iterator
    from multiprocessing.connection import Connection

    from numpy.typing import NDArray


@pytest.fixture
def child() -> Iterator[ChildProcess]:
    """A process that prepares nothing."""
    started = ChildProcess(fakes.prepare_nothing)
    started.start()
    yield started
    started.close()
    started.join()


def tell(pipe: Connection) -> None:
    """Tell whether SIGINT was blocked before the first line of this process."""
    pipe.send(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, []))


def test_children_start_with_interrupts_blocked_and_this_process_goes_on_without() -> None:
    context = get_context("spawn")
    ours, theirs = context.Pipe()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [])
    process = context.Process(target=tell, args=(theirs,))
    with interrupts_held_back():
        process.start()
    assert signal.pthread_sigmask(signal.SIG_BLOCK, []) == before
    assert ours.poll(600)
    assert ours.recv() is True
    process.join()


def test_pool_processes_are_started_so_and_then_ignore_interrupts() -> None:
    pool = fakes.pool(1, prepare=fakes.interrupt)
    try:
        study = fakes.study(4)
        assert any(pool.ready(study) or pool.wait(600.0) for _ in range(3))
    finally:
        pool.close()


def test_pool_processes_give_way_to_the_process_that_answers(child: ChildProcess) -> None:
    assert child.run(os.nice, (0,), 600.0) == min(os.nice(0) + NICENESS, 19)


def test_arrays_arrive_as_they_were(child: ChildProcess) -> None:
    """Larger than what a pipe holds, empty, of other orders and types; and they may be changed."""
    large = np.random.default_rng(1).normal(size=(9_000, 43))
    given = [large, large.T, large[::2], np.empty((0, 43)), np.array(["ok", "impact"]), np.array([np.nan, -0.0]), 7]
    arrived = child.run(list, (given,), 600.0)
    assert [np.asarray(part).tobytes() for part in arrived] == [np.asarray(part).tobytes() for part in given]
    assert arrived[1].shape == (43, 9_000)
    arrived[0][0, 0] = 1.0


class Half:
    """Ends its process when its numbers are about to be sent."""

    def __init__(self, numbers: NDArray[np.float64]) -> None:
        self.numbers = numbers

    def __reduce_ex__(self, _protocol: object) -> tuple[object, ...]:
        os.kill(os.getpid(), signal.SIGKILL)
        return Half, (self.numbers,)


def test_numbers_that_end_early_are_no_answer() -> None:
    ours, theirs = get_context("spawn").Pipe()
    with pytest.raises(TimeoutError):
        _read(ours, b"", [8], 0.0)
    theirs.close()
    with pytest.raises(EOFError):
        _read(ours, b"", [8], 600.0)
    ours.close()


def test_a_process_that_dies_while_it_answers_is_noticed(child: ChildProcess) -> None:
    with pytest.raises(ProcessDiedError):
        child.run(Half, (np.zeros(9),), 600.0)
    child.start()
    assert child.run(abs, (-3,), 600.0) == 3
