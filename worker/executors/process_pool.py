"""Chunks run in a pool of spawned processes: one that dies takes only its own chunk with it."""

from __future__ import annotations

import os
from multiprocessing import get_context
from queue import Empty, SimpleQueue
from time import monotonic
from typing import TYPE_CHECKING, Any, TypeVar

from pebble import ProcessExpired, ProcessFuture, ProcessPool

from worker import kernels
from worker.ports import Chunk, ExecutorError, Fate, Outcome
from worker.processes import single_threaded_children, start_pool_process

if TYPE_CHECKING:
    from collections.abc import Callable
    from concurrent.futures import Future

    from worker.study import Study

T = TypeVar("T")
R = TypeVar("R")

#: Chunks beyond one for each process, so that a process that is through finds the next one waiting.
SPARE_CHUNKS = 2
#: Pools that may break one after the other, with no chunk done between, before the executor gives up.
MAX_BROKEN_POOLS = 3
#: Seconds at least in which a kernel must be compiled.
LOAD_SECONDS = 300.0
#: Seconds between two looks whether the pool still lives.
LOOK_SECONDS = 0.2
#: Seconds for the processes of a closed pool to be gone.
CLOSE_SECONDS = 10.0


class ProcessPoolExecutor:
    """An `Executor` on a pool of ``processes`` processes.

    The first chunk that needs a kernel waits until one process has compiled it into the cache on disk, so that the
    others load it instead of all compiling the same.

    Parameters
    ----------
    processes : int
        At least 1.
    chunk_timeout : float
        Seconds after which a chunk that is being run is killed with its process.
    run, load, prepare : functions
        What a process does with a chunk, with a new kernel, and when it starts; importable by name. Other than the
        engine's in tests.
    """

    def __init__(
        self,
        processes: int,
        *,
        chunk_timeout: float,
        run: Callable[[kernels.ChunkTask], kernels.ChunkResult] = kernels.run_task,
        load: Callable[[kernels.KernelShape], None] = kernels.load,
        prepare: Callable[[], None] = kernels.prepare,
    ) -> None:
        self._processes = processes
        self._timeout = chunk_timeout
        self._run = run
        self._load = load
        self._prepare = prepare
        self._futures: dict[int, ProcessFuture[kernels.ChunkResult]] = {}
        self._loaded: set[kernels.KernelShape] = set()
        self._loading: dict[kernels.KernelShape, ProcessFuture[None]] = {}
        self._held: dict[kernels.KernelShape, dict[int, kernels.ChunkTask]] = {}
        self._ready: SimpleQueue[Outcome | kernels.KernelShape] = SimpleQueue()
        self._broken = 0
        single_threaded_children()
        self._pool = self._new_pool()

    def _new_pool(self) -> ProcessPool:
        pool = ProcessPool(
            max_workers=self._processes,
            initializer=start_pool_process,
            initargs=(os.getpid(), self._prepare),
            context=get_context("spawn"),
        )
        # Asking starts the processes: they get ready while the first study is on its way.
        if not pool.active:
            raise ExecutorError("the processes of the pool cannot be started")
        return pool

    @property
    def capacity(self) -> int:
        """Number of chunks worth having in flight at once."""
        return self._processes + SPARE_CHUNKS

    def submit(self, ticket: int, study: Study, chunk: Chunk) -> None:
        """Start a chunk, or hold it until its kernel is loaded; returns at once."""
        task = kernels.chunk_task(study, chunk.first, chunk.count)
        if task.shape in self._loaded:
            self._start(ticket, task)
        elif task.shape in self._held:
            self._held[task.shape][ticket] = task
        else:
            self._held[task.shape] = {ticket: task}
            loading = self._schedule(self._load, task.shape, max(LOAD_SECONDS, self._timeout))
            self._loading[task.shape] = loading
            loading.add_done_callback(lambda _: self._ready.put(task.shape))

    def _living_pool(self) -> ProcessPool:
        """The pool; a new one when it broke, which takes more than the death of a process at work.

        A broken pool forgets tasks, so everything in flight is given back as stopped.
        """
        if not self._pool.active:
            self._broken += 1
            if self._broken > MAX_BROKEN_POOLS:
                raise ExecutorError("the processes of the pool die as soon as they start; see their messages above")
            lost: list[ProcessFuture[Any]] = [*self._futures.values(), *self._loading.values()]
            for future in lost:
                future.cancel()  # type: ignore[no-untyped-call]
            self._shut(self._pool)
            self._pool = self._new_pool()
        return self._pool

    def _schedule(self, function: Callable[[T], R], argument: T, timeout: float) -> ProcessFuture[R]:
        while True:
            pool = self._living_pool()
            try:
                future: ProcessFuture[R] = pool.schedule(function, args=(argument,), timeout=timeout)
            except RuntimeError:  # it broke a moment ago
                continue
            return future

    def _start(self, ticket: int, task: kernels.ChunkTask) -> None:
        future = self._schedule(self._run, task, self._timeout)
        self._futures[ticket] = future
        future.add_done_callback(lambda done: self._ready.put(self._outcome(ticket, done)))

    def _outcome(self, ticket: int, future: Future[kernels.ChunkResult]) -> Outcome:
        if future.cancelled():
            return Outcome(ticket, Fate.STOPPED, detail="stopped")
        error = future.exception()
        if error is None:
            self._broken = 0
            return Outcome(ticket, Fate.DONE, future.result())
        if isinstance(error, ProcessExpired):
            return Outcome(ticket, Fate.CRASHED, detail=f"its process died (exit code {error.exitcode})")
        if isinstance(error, TimeoutError):
            return Outcome(ticket, Fate.TIMED_OUT, detail=f"killed after {self._timeout:g} s")
        if not self._pool.active:
            return Outcome(ticket, Fate.STOPPED, detail="the pool broke")
        return Outcome(ticket, Fate.CRASHED, detail=f"{type(error).__name__}: {error}")

    def wait(self, timeout: float) -> list[Outcome]:
        """Outcomes that have come in; waits for the first at most ``timeout`` s, gives [] when none came."""
        found: list[Outcome] = []
        deadline = monotonic() + timeout
        while not found:
            if self._futures or self._loading:
                self._living_pool()
            left = max(0.0, deadline - monotonic())
            try:
                self._sort(self._ready.get(timeout=min(left, LOOK_SECONDS)), found)
                while True:
                    self._sort(self._ready.get_nowait(), found)
            except Empty:
                if left == 0.0:
                    break
        return found

    def _sort(self, item: Outcome | kernels.KernelShape, found: list[Outcome]) -> None:
        if isinstance(item, Outcome):
            self._futures.pop(item.ticket, None)
            found.append(item)
            return
        # Loaded or not: where it failed, the chunks will say so themselves.
        self._loaded.add(item)
        self._loading.pop(item, None)
        for ticket, task in self._held.pop(item, {}).items():
            self._start(ticket, task)

    def stop(self, ticket: int) -> None:
        """Stop a chunk, with its process when it runs."""
        for held in self._held.values():
            if held.pop(ticket, None) is not None:
                self._ready.put(Outcome(ticket, Fate.STOPPED, detail="stopped"))
                return
        if future := self._futures.get(ticket):
            future.cancel()  # type: ignore[no-untyped-call]

    def close(self) -> None:
        """Kill what runs and leave no process behind."""
        self._shut(self._pool)

    @staticmethod
    def _shut(pool: ProcessPool) -> None:
        pool.stop()  # type: ignore[no-untyped-call]
        pool.join(CLOSE_SECONDS)
