"""Common behaviour of the processes that this program starts: one thread each, and no survival of the parent."""

from __future__ import annotations

import math
import os
import signal
import sys
from contextlib import contextmanager, suppress
from multiprocessing import resource_tracker
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar, TypeVarTuple

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

_A = TypeVarTuple("_A")
_R = TypeVar("_R")

#: Variables of libraries that would start their own threads; the pool already has a process per core.
_THREAD_VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)
_PR_SET_PDEATHSIG = 1
#: Nice value of pool processes, so that others, above all the one that answers requests, take precedence.
NICENESS = 10


def single_threaded_children() -> None:
    """Limit processes started from now on to one thread, unless the user's environment sets another number."""
    for variable in _THREAD_VARIABLES:
        os.environ.setdefault(variable, "1")


def end_with_parent(parent: int, number: signal.Signals) -> None:
    """Let the operating system send this process ``number`` when its parent (id ``parent``) dies; Linux only."""
    if sys.platform != "linux":
        return
    import ctypes

    ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, int(number), 0, 0, 0)
    if os.getppid() != parent:  # the parent died before the line above
        os.kill(os.getpid(), number)


@contextmanager
def interrupts_held_back() -> Iterator[None]:
    """Start processes and threads with SIGINT blocked, because Ctrl-C would also interrupt a child's imports.

    The child calls `ignore_interrupts` once it runs.
    """
    # The resource tracker would lift the block when it starts, which is with the first child.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def ignore_interrupts() -> None:
    """Ignore interrupts from the terminal; the parent handles them and ends this process cleanly."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def start_pool_process(parent: int, prepare: Callable[[], None]) -> None:
    """First task of a pool process. A stop takes effect immediately."""
    ignore_interrupts()
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    end_with_parent(parent, signal.SIGKILL)
    give_way()
    prepare()


def give_way() -> None:
    """Let other processes take precedence; nothing where this system has no such call or forbids it."""
    # A filter of system calls may forbid even what any process may do to itself. Results do not depend on it.
    with suppress(PermissionError):
        if hasattr(os, "nice"):
            os.nice(NICENESS)


def limit_memory(more: int) -> None:
    """Limit this process to ``more`` bytes beyond its current memory; larger allocations fail. Linux only."""
    if sys.platform != "linux":
        return
    import resource

    # VmData is what the limit counts: heap and private mappings, not the libraries.
    status = Path("/proc/self/status").read_text(encoding="ascii", errors="replace")
    taken = next(int(line.split()[1]) * 1024 for line in status.splitlines() if line.startswith("VmData:"))
    resource.setrlimit(resource.RLIMIT_DATA, (taken + more, taken + more))


def within_processor_time(seconds: float, function: Callable[[*_A], _R], *args: *_A) -> _R:
    """The value of ``function(*args)``; the process ends by SIGPROF where that takes more processor time (s).

    The operating system counts the time and ends the process, even in compiled code that never returns. There is no
    limit where ``seconds`` is infinite.
    """
    signal.setitimer(signal.ITIMER_PROF, seconds if math.isfinite(seconds) else 0.0)
    try:
        return function(*args)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
