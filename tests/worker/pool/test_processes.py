"""Processes this program starts: an interrupt at the terminal never finds them unprepared."""

from __future__ import annotations

import os
import signal
from multiprocessing import get_context
from typing import TYPE_CHECKING

from sprag.worker.pool.child_process import ChildProcess
from sprag.worker.pool.processes import NICENESS, interrupts_held_back
from tests.worker import fakes

if TYPE_CHECKING:
    from multiprocessing.connection import Connection


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


def test_pool_processes_give_way_to_the_process_that_answers() -> None:
    child = ChildProcess(fakes.prepare_nothing)
    child.start()
    try:
        assert child.run(os.nice, (0,), 600.0) == min(os.nice(0) + NICENESS, 19)
    finally:
        child.close()
        child.join()
