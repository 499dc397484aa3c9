"""Chunks run in a pool of spawned processes; a process that dies affects only its own chunk."""

from __future__ import annotations

import signal
import socket
from collections import Counter
from dataclasses import replace
from functools import partial
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING

from sprag_study.sentences import Sentence
from sprag_study.worker import fingerprint, models, traces
from sprag_study.worker.executors import known_answers
from sprag_study.worker.fingerprint import prepare_as
from sprag_study.worker.limits import LOAD_SECONDS, WALL_TIMES
from sprag_study.worker.pool.child_pool import ChildPool, JobStoppedError
from sprag_study.worker.pool.child_process import ProcessDiedError, ProcessStartError
from sprag_study.worker.pool.processes import single_threaded_children, within_processor_time
from sprag_study.worker.ports import Chunk, ExecutorError, Fate, KernelError, Outcome
from sprag_study.worker.reports import ExecutorReport, WorkerReport, processor

if TYPE_CHECKING:
    from collections.abc import Callable
    from concurrent.futures import Future

    from sprag_study.worker.pool.child_pool import Job
    from sprag_study.worker.study import Study

#: Chunks in flight beyond one per process, so that a finished process finds the next one waiting: at least so many,
#: and that share of the processes, because more of them finish while the rows of others are being stored.
SPARE_CHUNKS = 2
SPARE_SHARE = 0.25
#: Successive failed starts per process, without any completed work, after which the executor gives up.
MAX_FAILED_STARTS = 3
_NO_START = Sentence("The processes of the pool end as they start; the log says why.")
#: Failed compilations of a kernel after which its studies are held.
MAX_LOADS = 2


def useful_chunks(processes: int) -> int:
    """Useful number of chunks in flight for that many processes or workers."""
    return processes + max(SPARE_CHUNKS, int(SPARE_SHARE * processes))


class ProcessPoolExecutor:
    """An `Executor` on a pool of ``processes`` processes.

    One process compiles a kernel into the cache on disk, and the others load it. At most half of the processes compile,
    while the others run chunks.

    Parameters
    ----------
    processes : int
        At least 1.
    chunk_timeout : float
        Seconds of processor time after which a running chunk is killed with its process.
    wall_timeout : float, optional
        The limit of elapsed time, for chunks that hang without using the processor; default: `WALL_TIMES` times as
        long.
    run, load, prepare : functions
        Called for a chunk, for a new kernel, and at the start of a process; importable by name. Replaced in tests. By
        default processes load the engine and exit where their fingerprint is not that of this process, and kernels give
        their known answers before they run a chunk.
    compiled : function
        Whether a kernel is already in the cache on disk.
    load_timeout : float
        Seconds after which the compilation of a kernel is abandoned.
    """

    def __init__(
        self,
        processes: int,
        *,
        chunk_timeout: float,
        run: Callable[[models.ChunkTask], models.ChunkResult] = known_answers.run_task,
        load: Callable[[models.KernelShape], None] = known_answers.load,
        compiled: Callable[[models.KernelShape], bool] = models.is_compiled,
        prepare: Callable[[], None] | None = None,
        load_timeout: float = LOAD_SECONDS,
        wall_timeout: float | None = None,
    ) -> None:
        self._processes = processes
        self._timeout = chunk_timeout
        self._wall = WALL_TIMES * chunk_timeout if wall_timeout is None else wall_timeout
        self._run = run
        self._load = load
        self._compiled = compiled
        self._load_timeout = load_timeout
        self._jobs: dict[int, Job[models.ChunkResult]] = {}
        self._loaded: set[models.KernelShape] = set()
        self._loading: dict[models.KernelShape, Job[None]] = {}
        self._failed_loads: Counter[models.KernelShape] = Counter()
        self._cases = 0
        self._ready: SimpleQueue[Outcome | None] = SimpleQueue()
        single_threaded_children()
        self._pool = ChildPool(processes, prepare or partial(prepare_as, fingerprint.digest()))

    @property
    def capacity(self) -> int:
        """Useful number of chunks in flight."""
        return useful_chunks(self._processes)

    @property
    def shortage(self) -> str | None:
        """A sentence while the processes die as they start, more often than each of them once."""
        return _NO_START if self._pool.failed_starts > self._processes else None

    def ready(self, study: Study) -> bool:
        """Whether the kernel of ``study`` is loaded; starts loading it otherwise."""
        shape = models.shape_of(study)
        loading = self._loading.get(shape)
        if loading is not None and loading.future.done():
            del self._loading[shape]
            self._take_load(shape, loading.future)
        if shape in self._loaded or (loading is None and self._compiled(shape)):
            return True
        if shape not in self._loading and len(self._loading) < max(1, self._processes // 2):
            self._loading[shape] = begun = self._pool.schedule(
                self._load_timeout, traces.carried("load kernel", self._load), shape
            )
            begun.future.add_done_callback(lambda _: self._ready.put(None))
        return False

    def _take_load(self, shape: models.KernelShape, loading: Future[None]) -> None:
        """Record a loaded kernel; raise KernelError when loading failed too often."""
        error = loading.exception()
        if error is None:
            self._loaded.add(shape)
            return
        if isinstance(error, ProcessStartError):  # no attempt was made
            return
        self._failed_loads[shape] += 1
        if self._failed_loads[shape] < MAX_LOADS and isinstance(error, ProcessDiedError):
            return
        del self._failed_loads[shape]
        if isinstance(error, TimeoutError):
            raise KernelError(f"its kernel was not compiled within {self._load_timeout:g} s")
        if isinstance(error, ProcessDiedError):
            raise KernelError(f"the process that compiled its kernel died (exit code {error.exitcode})")
        raise KernelError(f"its kernel cannot be compiled ({type(error).__name__}: {error})")

    def submit(self, ticket: int, study: Study, chunk: Chunk) -> None:
        """Start a chunk; returns at once."""
        task = models.chunk_task(study, chunk.first, chunk.count)
        self._jobs[ticket] = job = self._pool.schedule(
            self._wall, within_processor_time, self._timeout, traces.carried("run chunk", self._run), task
        )
        job.future.add_done_callback(
            lambda done: self._ready.put(replace(self._outcome(ticket, done), seconds=job.seconds or 0.0))
        )

    def _outcome(self, ticket: int, future: Future[models.ChunkResult]) -> Outcome:
        error = JobStoppedError() if future.cancelled() else future.exception()
        match error:
            case None:
                return Outcome(ticket, Fate.DONE, future.result(), host=socket.gethostname())
            case JobStoppedError():
                return Outcome(ticket, Fate.STOPPED, detail="stopped")
            case ProcessStartError():
                return Outcome(ticket, Fate.STOPPED, detail=f"its process did not start ({error})")
            case ProcessDiedError(exitcode=code) if code == -signal.SIGPROF:
                return Outcome(ticket, Fate.TIMED_OUT, detail=f"killed after {self._timeout:g} s of processor time")
            case ProcessDiedError(exitcode=code):
                return Outcome(ticket, Fate.CRASHED, detail=f"its process died (exit code {code})")
            case TimeoutError():
                return Outcome(ticket, Fate.TIMED_OUT, detail=f"killed after {self._wall:g} s")
        return Outcome(ticket, Fate.CRASHED, detail=f"{type(error).__name__}: {error}")

    def wait(self, timeout: float) -> list[Outcome]:
        """Available outcomes; waits at most ``timeout`` s for the first, and returns [] when there is none.

        It also returns when a kernel is loaded. Raises ExecutorError when no process can be started.
        """
        self._pool.tend()
        found: list[Outcome] = []
        try:
            came = self._ready.get(timeout=timeout)
            while came is not None:
                self._jobs.pop(came.ticket, None)
                self._cases += came.result.count if came.result is not None else 0
                found.append(came)
                came = self._ready.get_nowait()
        except Empty:
            pass
        if self._pool.failed_starts > MAX_FAILED_STARTS * self._processes:
            raise ExecutorError("the processes of the pool die as soon as they start; see their messages above")
        return found

    def stop(self, ticket: int) -> None:
        """Stop a chunk, with its process when it runs."""
        if job := self._jobs.get(ticket):
            job.stop()

    def at_work(self) -> dict[int, float]:
        """How long processes have had the chunks that are not back yet, in s by ticket."""
        seconds = {ticket: job.seconds for ticket, job in self._jobs.items()}
        return {ticket: taken for ticket, taken in seconds.items() if taken is not None}

    def report(self) -> ExecutorReport:
        """The processes of the pool; they start with the first chunk."""
        host, busy, shortage = socket.gethostname(), len(self._jobs) + len(self._loading), self.shortage
        workers = tuple(
            WorkerReport(f"process {number + 1}", host, shortage is None, number < busy, processor=processor())
            for number in range(self._processes)
        )
        return ExecutorReport("pool", workers, {host: self._cases}, shortage or "")

    def close(self) -> None:
        """Kill all processes."""
        self._pool.close()
