"""Functions run in several processes; each thread manages one `ChildProcess`."""

from __future__ import annotations

import threading
import time
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Generic, TypeVar, TypeVarTuple

from sprag_study.worker.pool.child_process import ChildProcess, ProcessDiedError, ProcessStartError

if TYPE_CHECKING:
    from collections.abc import Callable

Args = TypeVarTuple("Args")
R = TypeVar("R")


class JobStoppedError(Exception):
    """The job was stopped before it was done."""


class Job(Generic[R]):
    """A function that waits for a process, or runs in one.

    Attributes
    ----------
    future : Future
        Its value, or TimeoutError, ProcessDiedError, ProcessStartError, JobStoppedError, or what it raised; cancelled
        when it was stopped before a process took it.
    begun : Future
        Done once a process has taken it.
    """

    future: Future[R]

    def __init__(self) -> None:
        self.begun: Future[None] = Future()
        self._received: float | None = None
        self._child: ChildProcess | None = None
        self._stopped = False
        self._lock = threading.Lock()

    @property
    def seconds(self) -> float | None:
        """How long ago its process received it, in s; None while it waits for one, or for one that starts."""
        return None if self._received is None else time.monotonic() - self._received

    def stop(self) -> None:
        """End the job, with its process if it is running. A job that has just finished stays done."""
        if self.future.cancel():
            return
        with self._lock:
            self._stopped = True
            if self._child is not None:
                self._child.kill()

    def _enter(self, child: ChildProcess) -> None:
        """Record the process that `stop` would kill."""
        with self._lock:
            if self._stopped:
                raise JobStoppedError
            self._child = child
            child.start()

    def _note_received(self) -> None:
        self._received = time.monotonic()

    def _leave(self) -> bool:
        """Release the process from this job; whether the job was stopped."""
        with self._lock:
            self._child = None
            return self._stopped


class ChildPool:
    """A number of processes, started immediately; one that dies is replaced and affects only the function it ran.

    Parameters
    ----------
    processes : int
        At least 1.
    prepare : function
        Called first in a new process; importable by name.
    """

    def __init__(self, processes: int, prepare: Callable[[], None]) -> None:
        self._children = [ChildProcess(prepare) for _ in range(processes)]
        self._idle: SimpleQueue[ChildProcess] = SimpleQueue()
        for child in self._children:
            child.start()
            self._idle.put(child)
        self._threads = ThreadPoolExecutor(processes, thread_name_prefix="child")
        self._failed_starts = 0
        self._closed = False

    @property
    def failed_starts(self) -> int:
        """Number of successive processes that died before they were ready, without any completed function."""
        return self._failed_starts

    def schedule(self, timeout: float, function: Callable[[*Args], R], *args: *Args) -> Job[R]:
        """Run a function in the next free process, for at most ``timeout`` s; returns at once."""
        return self._submitted(timeout, function, args, None)

    def stream(
        self, timeout: float, receive: Callable[[bytes], None], function: Callable[[*Args], R], *args: *Args
    ) -> Job[R]:
        """The same for a function that uses `send_piece`: ``receive`` takes the pieces in a thread of the pool."""
        return self._submitted(timeout, function, args, receive)

    def _submitted(
        self,
        timeout: float,
        function: Callable[..., R],
        args: tuple[object, ...],
        receive: Callable[[bytes], None] | None,
    ) -> Job[R]:
        job: Job[R] = Job()
        job.future = self._threads.submit(self._run, job, timeout, function, args, receive)
        return job

    def _run(
        self,
        job: Job[R],
        timeout: float,
        function: Callable[..., R],
        args: tuple[object, ...],
        receive: Callable[[bytes], None] | None,
    ) -> R:
        child = self._idle.get()
        job.begun.set_result(None)
        try:
            return self._run_in(child, job, timeout, function, args, receive)
        finally:
            with suppress(ProcessStartError):  # the next job tries again and reports the error
                child.start()
            self._idle.put(child)

    def _run_in(
        self,
        child: ChildProcess,
        job: Job[R],
        timeout: float,
        function: Callable[..., R],
        args: tuple[object, ...],
        receive: Callable[[bytes], None] | None,
    ) -> R:
        for last in (False, False, True):
            try:
                job._enter(child)
                value: R = child.run(function, args, timeout, receive, job._note_received)
                break
            except (ProcessDiedError, ProcessStartError) as error:
                if job._leave() or self._closed:
                    raise JobStoppedError from error
                if isinstance(error, ProcessDiedError):
                    raise
                self._failed_starts += 1
                if last:
                    raise
            finally:
                job._leave()
        self._failed_starts = 0
        return value

    def tend(self) -> None:
        """Replace processes that died idle; must be called periodically."""
        for _ in self._children:
            try:
                child = self._idle.get_nowait()
            except Empty:  # all are busy
                return
            try:
                child.tend()
            except ProcessStartError:
                self._failed_starts += 1
            finally:
                self._idle.put(child)

    def close(self) -> None:
        """Kill running jobs, drop waiting ones and end all processes."""
        self._closed = True
        self._threads.shutdown(wait=False, cancel_futures=True)
        for child in self._children:
            child.close()
        self._threads.shutdown()
        for child in self._children:
            child.join()
