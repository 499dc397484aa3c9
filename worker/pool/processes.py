"""Habits of the processes this program starts: one thread each, and never longer alive than their parent."""

from __future__ import annotations

import math
import os
import signal
import sys
from contextlib import contextmanager
from multiprocessing import resource_tracker
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar, TypeVarTuple

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

_A = TypeVarTuple("_A")
_R = TypeVar("_R")

#: Libraries that would start threads of their own; the pool has a process for each core already.
_THREAD_VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)
_PR_SET_PDEATHSIG = 1
#: How much pool processes give way to others, to the process that answers requests above all.
NICENESS = 10


def single_threaded_children() -> None:
    """Processes started from now on compute with one thread, unless the user's environment says otherwise."""
    for variable in _THREAD_VARIABLES:
        os.environ.setdefault(variable, "1")


def end_with_parent(parent: int, number: signal.Signals) -> None:
    """Have the kernel send this process ``number`` when its parent (process id ``parent``) dies; only Linux can."""
    if sys.platform != "linux":
        return
    import ctypes

    ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, int(number), 0, 0, 0)
    if os.getppid() != parent:  # it died before the line above
        os.kill(os.getpid(), number)


@contextmanager
def interrupts_held_back() -> Iterator[None]:
    """Processes and threads started inside begin with SIGINT blocked: Ctrl-C reaches a child's imports too otherwise.

    The child calls `ignore_interrupts` when it has come so far.
    """
    # It would lift the block when it starts, which is with the first child.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def ignore_interrupts() -> None:
    """Interrupts at the terminal are the parent's to handle, which ends this process in order."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def start_pool_process(parent: int, prepare: Callable[[], None]) -> None:
    """First thing a pool process does. A stop is at once."""
    ignore_interrupts()
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    end_with_parent(parent, signal.SIGKILL)
    if hasattr(os, "nice"):
        os.nice(NICENESS)
    prepare()


def limit_memory(more: int) -> None:
    """Let this process take ``more`` bytes beyond what it has now: what asks for more fails. Only on Linux."""
    if sys.platform != "linux":
        return
    import resource

    # VmData is what the limit counts: heap and private mappings, not the libraries.
    status = Path("/proc/self/status").read_text(encoding="ascii", errors="replace")
    taken = next(int(line.split()[1]) * 1024 for line in status.splitlines() if line.startswith("VmData:"))
    resource.setrlimit(resource.RLIMIT_DATA, (taken + more, taken + more))


def within_processor_time(seconds: float, function: Callable[[*_A], _R], *args: *_A) -> _R:
    """The value of ``function(*args)``; the process ends by SIGPROF where that takes more processor time (s).

    The kernel counts and ends it, also in compiled code that never comes back. No limit where ``seconds`` is infinite.
    """
    signal.setitimer(signal.ITIMER_PROF, seconds if math.isfinite(seconds) else 0.0)
    try:
        return function(*args)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
