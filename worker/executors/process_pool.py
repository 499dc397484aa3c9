"""Chunks run in a pool of spawned processes: one that dies takes only its own chunk with it."""

from __future__ import annotations

import os
from collections import Counter
from multiprocessing import get_context
from queue import Empty, SimpleQueue
from time import monotonic
from typing import TYPE_CHECKING, Any, TypeVar

from pebble import ProcessExpired, ProcessFuture, ProcessPool

from worker import kernels
from worker.limits import LOAD_SECONDS
from worker.ports import Chunk, ExecutorError, Fate, KernelError, Outcome
from worker.processes import interrupts_held_back, single_threaded_children, start_pool_process

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
#: Times that the compilation of a kernel may come to nothing before its studies are held.
MAX_LOADS = 2
#: Seconds between two looks whether the pool still lives.
LOOK_SECONDS = 0.2
#: Seconds for the processes of a closed pool to be gone.
CLOSE_SECONDS = 10.0


class ProcessPoolExecutor:
    """An `Executor` on a pool of ``processes`` processes.

    A kernel is compiled by one process into the cache on disk, so that the others load it instead of all compiling the
    same; at most half of the processes compile, and the others run chunks meanwhile.

    Parameters
    ----------
    processes : int
        At least 1.
    chunk_timeout : float
        Seconds after which a chunk that is being run is killed with its process.
    run, load, prepare : functions
        What a process does with a chunk, with a new kernel, and when it starts; importable by name. Other than the
        engine's in tests.
    compiled : function
        Whether a kernel lies in the cache on disk already, so that nobody has to wait for it.
    load_timeout : float
        Seconds after which the compilation of a kernel is given up.
    """

    def __init__(
        self,
        processes: int,
        *,
        chunk_timeout: float,
        run: Callable[[kernels.ChunkTask], kernels.ChunkResult] = kernels.run_task,
        load: Callable[[kernels.KernelShape], None] = kernels.load,
        compiled: Callable[[kernels.KernelShape], bool] = kernels.is_compiled,
        prepare: Callable[[], None] = kernels.prepare,
        load_timeout: float = LOAD_SECONDS,
    ) -> None:
        self._processes = processes
        self._timeout = chunk_timeout
        self._run = run
        self._load = load
        self._compiled = compiled
        self._prepare = prepare
        self._load_timeout = load_timeout
        self._futures: dict[int, ProcessFuture[kernels.ChunkResult]] = {}
        self._loaded: set[kernels.KernelShape] = set()
        self._loading: dict[kernels.KernelShape, ProcessFuture[None]] = {}
        self._failed_loads: Counter[kernels.KernelShape] = Counter()
        self._ready: SimpleQueue[Outcome | None] = SimpleQueue()
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
        with interrupts_held_back():
            # Asking starts the processes: they get ready while the first study is on its way.
            active = pool.active
        if not active:
            raise ExecutorError("the processes of the pool cannot be started")
        return pool

    @property
    def capacity(self) -> int:
        """Number of chunks worth having in flight at once."""
        return self._processes + SPARE_CHUNKS

    def ready(self, study: Study) -> bool:
        """Whether the kernel of ``study`` is loaded; begins to load it where it is not."""
        shape = kernels.shape_of(study)
        loading = self._loading.get(shape)
        if loading is not None and loading.done():
            del self._loading[shape]
            self._take_load(shape, loading)
        if shape in self._loaded or (loading is None and self._compiled(shape)):
            return True
        if shape not in self._loading and len(self._loading) < max(1, self._processes // 2):
            self._loading[shape] = begun = self._schedule(self._load, shape, self._load_timeout)
            begun.add_done_callback(lambda _: self._ready.put(None))
        return False

    def _take_load(self, shape: kernels.KernelShape, loading: ProcessFuture[None]) -> None:
        """Note a kernel that is there; raise KernelError when it failed too often."""
        if loading.cancelled():  # with its pool
            return
        error = loading.exception()
        if error is None:
            self._loaded.add(shape)
            self._broken = 0
            return
        if not self._pool.active:
            return
        self._failed_loads[shape] += 1
        if self._failed_loads[shape] < MAX_LOADS and isinstance(error, ProcessExpired):
            return
        del self._failed_loads[shape]
        if isinstance(error, TimeoutError):
            raise KernelError(f"its kernel was not compiled within {self._load_timeout:g} s")
        if isinstance(error, ProcessExpired):
            raise KernelError(f"the process that compiled its kernel died (exit code {error.exitcode})")
        raise KernelError(f"its kernel cannot be compiled ({type(error).__name__}: {error})")

    def submit(self, ticket: int, study: Study, chunk: Chunk) -> None:
        """Start a chunk; returns at once."""
        future = self._schedule(self._run, kernels.chunk_task(study, chunk.first, chunk.count), self._timeout)
        self._futures[ticket] = future
        future.add_done_callback(lambda done: self._ready.put(self._outcome(ticket, done)))

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
        """Outcomes that have come in; waits for the first at most ``timeout`` s, gives [] when none came.

        It also comes back when a kernel was loaded.
        """
        found: list[Outcome] = []
        deadline = monotonic() + timeout
        while not found:
            if self._futures or self._loading:
                self._living_pool()
            left = max(0.0, deadline - monotonic())
            try:
                came = self._ready.get(timeout=min(left, LOOK_SECONDS))
                if came is None:
                    break
                self._sort(came, found)
                while (more := self._ready.get_nowait()) is not None:
                    self._sort(more, found)
            except Empty:
                if left == 0.0:
                    break
        return found

    def _sort(self, outcome: Outcome, found: list[Outcome]) -> None:
        self._futures.pop(outcome.ticket, None)
        found.append(outcome)

    def stop(self, ticket: int) -> None:
        """Stop a chunk, with its process when it runs."""
        if future := self._futures.get(ticket):
            future.cancel()  # type: ignore[no-untyped-call]

    def close(self) -> None:
        """Kill what runs and leave no process behind."""
        self._shut(self._pool)

    @staticmethod
    def _shut(pool: ProcessPool) -> None:
        pool.stop()  # type: ignore[no-untyped-call]
        pool.join(CLOSE_SECONDS)
