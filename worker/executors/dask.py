"""Chunks run by the workers of a Dask cluster, one at a time on each worker.

Dask starts processes, finds them and transfers values. This module decides which chunk runs where, how often and for
how long. Each task is bound to one idle worker, so a worker that dies takes exactly one chunk with it, and that chunk
is the cause.
"""

from __future__ import annotations

import logging
import time
from collections import Counter, deque
from concurrent.futures import CancelledError
from contextlib import suppress
from functools import partial
from math import inf
from queue import Empty, SimpleQueue
from threading import RLock
from typing import TYPE_CHECKING, Any, Final
from uuid import uuid4

import dask
from distributed.scheduler import KilledWorker

from sprag_study.sentences import Sentence, joined
from sprag_study.worker import fingerprint, models, traces
from sprag_study.worker.executors import dask_tasks as tasks
from sprag_study.worker.executors.dask_jobs import Job, Waiting, Worker, outcome_of, refusals, report_of, without_rows
from sprag_study.worker.executors.dask_link import CONFIG, Link, own_cluster, value_of
from sprag_study.worker.executors.process_pool import MAX_LOADS, useful_chunks
from sprag_study.worker.limits import WALL_TIMES
from sprag_study.worker.ports import Chunk, ExecutorError, Fate, KernelError, Outcome

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from distributed import Future

    from sprag_study.worker.reports import ExecutorReport
    from sprag_study.worker.study import Study

_LOG = logging.getLogger("sprag.worker")

#: Seconds between two polls of the workers that joined or left; between two attempts to reach a lost scheduler.
LOOK_SECONDS: Final = 0.5
#: Seconds without a scheduler after which the executor gives up.
SCHEDULER_SECONDS: Final = 60.0
#: Seconds without a usable worker after which waiting chunks are returned; one that was ended is back sooner.
WAITING_SECONDS: Final = 60.0
#: Seconds beyond a chunk's time limit after which a worker that should have exited counts as frozen.
FROZEN_SECONDS: Final = 15.0
#: Seconds that a stopped chunk gets to finish before its worker is ended; most finish sooner.
STOP_SECONDS: Final = 5.0


class DaskExecutor:
    """An `Executor` on a Dask cluster. Workers may come and go at any time.

    Parameters
    ----------
    url : str
        ``dask://host:port`` of a scheduler; "" starts a cluster of ``processes`` workers on this machine, for this
        executor alone.
    processes : int
    chunk_timeout : float
        Seconds of processor time after which a chunk ends with its worker; `WALL_TIMES` times as many of elapsed time.
    run, load : functions
        Called in a worker for a chunk, and for a new kernel, for its known answers; importable by name. Replaced in
        tests.
    expected : mapping, optional
        Fingerprint required of workers; default: that of this process.
    scheduler_seconds : float
        Seconds without a scheduler after which the executor gives up.
    renew : bool
        Whether every host first deletes its compiled kernels, because they may be damaged.
    """

    def __init__(
        self,
        url: str,
        processes: int,
        *,
        chunk_timeout: float,
        run: Callable[[models.ChunkTask], models.ChunkResult] = models.run_task,
        load: Callable[[models.KernelShape], str | None] = tasks.load_and_answer,
        expected: Mapping[str, str] | None = None,
        scheduler_seconds: float = SCHEDULER_SECONDS,
        renew: bool = False,
    ) -> None:
        self._timeout, self._wall = chunk_timeout, WALL_TIMES * chunk_timeout
        self._run = run
        self._load = load
        self._expected = fingerprint.present() if expected is None else expected
        self._digest = fingerprint.digest_of(self._expected)
        self._scheduler_seconds = scheduler_seconds
        self._name = uuid4().hex[:12]
        self._lock = RLock()
        self._workers: dict[str, Worker] = {}
        self._waiting: deque[Waiting] = deque()
        #: Texts for which a host deletes its compiled kernels once: for every host, and for hosts where workers died.
        self._renew = uuid4().hex if renew else ""
        self._discards: dict[str, str] = {}
        self._failed_loads: Counter[tuple[str, models.KernelShape]] = Counter()
        self._cases: Counter[str] = Counter()
        #: Hosts that cannot load a kernel, and kernels that no host can load, with the reason.
        self._unable: set[tuple[str, models.KernelShape]] = set()
        self._broken: dict[models.KernelShape, str] = {}
        self._outcomes: SimpleQueue[Outcome | None] = SimpleQueue()
        self._next_look = 0.0
        self._gone_since: float | None = None
        self._alone_since: float | None = None
        with dask.config.set(CONFIG):
            self._cluster = None if url else own_cluster(processes)
        place = tasks.scheduler_address(url) if self._cluster is None else (self._cluster.scheduler_address, None)
        self._link = Link(*place, f"sprag-{self._name}", self._lock)
        self._look()

    @property
    def capacity(self) -> int:
        """Useful number of chunks in flight, 0 without usable workers; it changes as workers join and leave."""
        with self._lock:
            return useful_chunks(usable) if (usable := sum(w.usable for w in self._workers.values())) else 0

    @property
    def shortage(self) -> str | None:
        """Why nothing can be run at present, as a sentence; None where chunks can run."""
        if self._gone_since is not None:
            return Sentence(
                "The scheduler {address} cannot be reached; retrying: {trouble}",
                address=self._link.address,
                trouble=self._link.trouble,
            )
        with self._lock:
            if any(worker.usable for worker in self._workers.values()):
                return None
            why = refusals(self._workers.values())
        waits = Sentence(
            "No usable worker has joined the scheduler {address}; the study waits for one.", address=self._link.address
        )
        return waits if why is None else joined(" ", (waits, why))

    def ready(self, study: Study) -> bool:
        """Whether any worker has loaded the kernel of ``study``; otherwise one starts to load it."""
        shape = models.shape_of(study)
        self._look()
        with self._lock:
            if reason := self._broken.pop(shape, None):
                self._unable = {(host, kernel) for host, kernel in self._unable if kernel != shape}
                raise KernelError(reason)
            if any(shape in worker.shapes for worker in self._workers.values()):
                return True
            if not any(worker.loads(shape) for worker in self._workers.values()):
                idle = (worker for worker in self._workers.values() if worker.usable and worker.job is None)
                able = next((worker for worker in idle if (worker.host, shape) not in self._unable), None)
                if able is not None:
                    self._begin_load(able, shape)
        return False

    def submit(self, ticket: int, study: Study, chunk: Chunk) -> None:
        """Give the chunk to the next free worker; returns immediately."""
        task = models.chunk_task(study, chunk.first, chunk.count)
        key = f"sprag-{chunk.study}-{chunk.first}-{chunk.count}-{chunk.failures}-{self._name}-{ticket}"
        with self._lock:
            self._waiting.append(Waiting(ticket, key, traces.carried("run chunk", self._run), task))
            self._fill()

    def wait(self, timeout: float) -> list[Outcome]:
        """Available outcomes; waits at most ``timeout`` s for the first, and returns [] when there is none.

        Raises ExecutorError when the scheduler stays unreachable.
        """
        self._look()
        found: list[Outcome] = []
        with suppress(Empty):
            came = self._outcomes.get(timeout=timeout)
            while True:
                if came is not None:
                    found.append(came)
                came = self._outcomes.get_nowait()
        return found

    def stop(self, ticket: int) -> None:
        """Stop a chunk. A running one gets `STOP_SECONDS` to finish, then its worker is ended."""
        with self._lock:
            kept = deque(waiting for waiting in self._waiting if waiting.ticket != ticket)
            running = [
                job
                for worker in self._workers.values()
                if (job := worker.job) and job.kind == "chunk" and job.ticket == ticket and job.dropped is None
            ]
            if len(kept) == len(self._waiting) and not running:
                return
            self._waiting = kept
            for job in running:
                job.dropped = time.monotonic()
                self._outcomes.put(without_rows(job, Fate.STOPPED, "stopped"))
            if not running:
                self._outcomes.put(Outcome(ticket, Fate.STOPPED, detail="stopped"))

    def at_work(self) -> dict[int, float]:
        """How long workers have had the chunks that are not back yet, in s by ticket."""
        with self._lock:
            jobs = [worker.job for worker in self._workers.values()]
            return {job.ticket: job.seconds for job in jobs if job and job.kind == "chunk" and job.dropped is None}

    def report(self) -> ExecutorReport:
        """The workers that the last poll found."""
        with self._lock:
            return report_of(self._link, self._workers.values(), self._cases, self.shortage)

    def close(self) -> None:
        """Leave the cluster, and end it if this executor started it."""
        with self._lock:
            self._waiting.clear()
        self._disconnect(timeout=5.0)
        if self._cluster is not None:
            self._cluster.close(timeout=5)

    def _look(self) -> None:
        """Poll the scheduler and its workers when it is time."""
        now = time.monotonic()
        if now < self._next_look:
            return
        self._next_look = now + LOOK_SECONDS
        try:
            present = self._link.present()
        except (OSError, TimeoutError, ValueError) as error:
            self._scheduler_is_gone(error)
            return
        self._gone_since = None
        with self._lock:
            for address in [address for address in self._workers if address not in present]:
                self._worker_is_gone(self._workers.pop(address))
            for address, info in present.items():
                if address not in self._workers:
                    self._workers[address] = worker = Worker.joined(address, info)
                    key = f"sprag-introduce-{self._name}-{uuid4().hex}"
                    self._begin(worker, Job("introduce", now), key, eval, tasks.INTRODUCE.format(self._renew))
            ended = []
            for worker in self._workers.values():
                if (job := worker.job) and job.kind == "chunk":
                    if now - job.began > self._wall + FROZEN_SECONDS:
                        self._worker_is_frozen(worker)
                        ended.append(worker.address)
                    elif job.dropped is not None and now - job.dropped > STOP_SECONDS:
                        job.dropped = inf
                        ended.append(worker.address)
            self._fill()
            self._return_waiting(now)
        for address in ended:
            self._link.end_worker(address)

    def _scheduler_is_gone(self, error: Exception) -> None:
        """Return the chunks in flight; the scheduler may be restarted."""
        now = time.monotonic()
        with self._lock:
            for worker in self._workers.values():
                if (job := worker.job) and job.kind == "chunk" and job.dropped is None:
                    self._outcomes.put(without_rows(job, Fate.STOPPED, "the scheduler was lost"))
        self._disconnect(timeout=1.0)
        self._return_waiting(now)
        if self._gone_since is None:
            self._gone_since = now
            _LOG.error("The scheduler %s cannot be reached; retrying: %s", self._link.address, error)
        elif now - self._gone_since > self._scheduler_seconds:
            raise ExecutorError(
                f"the scheduler {self._link.address} could not be reached for {self._scheduler_seconds:g} s: {error}"
            )

    def _return_waiting(self, now: float) -> None:
        """Return the waiting chunks where there is no worker for long: another dispatcher may take their study."""
        with self._lock:
            if any(worker.usable for worker in self._workers.values()):
                self._alone_since = None
            elif self._alone_since is None:
                self._alone_since = now
            elif now - self._alone_since >= WAITING_SECONDS:
                for item in self._waiting:
                    self._outcomes.put(Outcome(item.ticket, Fate.STOPPED, detail="no worker was left for it"))
                self._waiting.clear()

    def _disconnect(self, timeout: float) -> None:
        with self._lock:
            for worker in self._workers.values():
                worker.job = None
            self._workers.clear()
        self._link.close(timeout)

    def _worker_is_gone(self, worker: Worker) -> None:
        if worker.job is not None:
            self._died(worker, worker.job)
            worker.job = None

    def _worker_is_frozen(self, worker: Worker) -> None:
        _LOG.error("The worker %s does not answer; its nanny must start another.", worker.address)
        job, worker.job, worker.usable = worker.job, None, False
        if job is not None:
            self._died(worker, job)

    def _died(self, worker: Worker, job: Job) -> None:
        """Handle the death of a worker during ``job``."""
        if job.kind == "load" and job.shape is not None:
            self._died_of(worker.host, job.shape)
        elif job.kind == "chunk" and job.dropped is None:
            taken = job.seconds
            # Dask does not say of what a worker died. Before this it cannot have been the limit.
            if taken >= self._timeout:
                detail = f"its worker was gone after {taken:.3g} s; the limit is {self._timeout:g} s of processor time"
                self._outcomes.put(without_rows(job, Fate.TIMED_OUT, detail))
            else:
                self._outcomes.put(without_rows(job, Fate.CRASHED, "its worker died"))
        elif job.kind == "introduce":
            _LOG.error("The worker %s left before it reported its fingerprint.", worker.address)

    def _died_of(self, host: str, shape: models.KernelShape) -> None:
        """Handle a death while loading a kernel: after the second one, the kernel on the host's disk may be damaged."""
        if any(other.host == host and shape in other.shapes for other in self._workers.values()):
            return
        if self._failed_loads[host, shape] == MAX_LOADS - 1:
            _LOG.error("Workers of %s died while loading a kernel; their host compiles its kernels anew.", host)
            self._discards[host] = uuid4().hex
        self._load_failed(host, shape, "the worker that compiled its kernel died", MAX_LOADS + 1)

    def _fill(self) -> None:
        """Give waiting chunks to idle workers; on each host one worker compiles and the others load."""
        for worker in self._workers.values():
            if not self._waiting:
                return
            if not worker.usable or worker.job is not None:
                continue
            chosen = next((item for item in self._waiting if item.task.shape in worker.shapes), None)
            if chosen is not None:
                self._waiting.remove(chosen)
                job = Job("chunk", time.monotonic(), chosen.ticket)
                given = (self._digest, chosen.run, chosen.task, self._timeout, self._wall)
                self._begin(worker, job, chosen.key, tasks.run_chunk, *given)
                continue
            shape = next((s for item in self._waiting if (worker.host, s := item.task.shape) not in self._unable), None)
            if shape is None:
                continue
            fellows = [other for other in self._workers.values() if other.host == worker.host]
            if any(shape in other.shapes for other in fellows) or not any(other.loads(shape) for other in fellows):
                self._begin_load(worker, shape)

    def _begin_load(self, worker: Worker, shape: models.KernelShape) -> None:
        key = f"sprag-load-{self._name}-{uuid4().hex}"
        load = traces.carried("load kernel", self._load)
        given = (self._digest, load, shape, self._discards.get(worker.host, ""))
        self._begin(worker, Job("load", time.monotonic(), shape=shape), key, tasks.load_kernel, *given)

    def _begin(self, worker: Worker, job: Job, key: str, function: Callable[..., Any], *given: Any) -> None:
        worker.job = job
        # Where the connection is being lost, the next poll detects it and takes the job back.
        job.future = self._link.submit(worker.address, key, partial(self._done, worker, job), function, *given)

    def _done(self, worker: Worker, job: Job, future: Future[Any]) -> None:
        """Runs in a thread of Dask: record the outcome of a job, and give the worker its next one."""
        with self._lock:
            if worker.job is not job:  # abandoned, and perhaps the connection as well
                return
            self._link.begin_fetch()
        value, error = value_of(future)
        with self._lock:
            self._link.end_fetch()
            if worker.job is not job:  # abandoned in the meantime
                return
            worker.job = None
            if isinstance(error, KilledWorker | tasks.OtherFingerprintError):  # the next poll finds who has the address
                self._workers.pop(worker.address, None)
            if isinstance(error, KilledWorker):
                self._died(worker, job)
            elif job.kind == "chunk" and job.dropped is None:
                self._cases[worker.host] += 0 if error is not None else value.count
                self._outcomes.put(outcome_of(job, value, error, worker.host))
            elif job.kind == "introduce":
                self._introduced(worker, value, error)
            elif job.shape is not None:
                self._loaded(worker, job.shape, value, error)
            self._fill()

    def _introduced(self, worker: Worker, told: object, error: BaseException | None) -> None:
        if error is not None:
            worker.refuse(f"it cannot run Sprag ({type(error).__name__}: {error})")
        else:
            worker.introduced(told, self._expected)
            self._outcomes.put(None)

    def _loaded(self, worker: Worker, shape: models.KernelShape, answers: Any, error: BaseException | None) -> None:
        if error is None:
            first = next((other for other in self._workers.values() if shape in other.shapes), worker)
            if (expected := first.shapes.setdefault(shape, answers)) != answers:
                worker.refuse(f"known answers of its kernel: {answers} instead of {expected} of {first.address}")
            else:
                worker.shapes[shape] = answers
                self._failed_loads.pop((worker.host, shape), None)
            self._outcomes.put(None)
        elif not isinstance(error, CancelledError | tasks.OtherFingerprintError):
            self._load_failed(worker.host, shape, f"its kernel cannot be compiled ({type(error).__name__}: {error})", 1)

    def _load_failed(self, host: str, shape: models.KernelShape, reason: str, allowed: int) -> None:
        """Record a failed load: after too many, the host is excluded; when no host remains, the chunks fail."""
        place = (host, shape)
        self._failed_loads[place] += 1
        if self._failed_loads[place] < allowed:
            return
        del self._failed_loads[place]
        self._unable.add(place)
        _LOG.error("The workers of %s cannot run a study: %s.", host, reason)
        others = [other for other in self._workers.values() if other.usable]
        if all(shape not in other.shapes and (other.host, shape) in self._unable for other in others):
            self._broken[shape] = reason
            for item in [item for item in self._waiting if item.task.shape == shape]:
                self._waiting.remove(item)
                self._outcomes.put(Outcome(item.ticket, Fate.CRASHED, detail=reason))
            self._outcomes.put(None)
