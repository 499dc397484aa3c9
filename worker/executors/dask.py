"""Chunks run by the workers of a Dask cluster: one at a time on each of them, placed and counted here.

Dask starts processes, finds them and carries values. Which chunk runs where, how often and for how long is decided
here: a task is bound to one worker that has nothing else to do, so a worker that dies takes exactly one chunk with it,
and that chunk is the one to blame.
"""

from __future__ import annotations

import logging
import time
from collections import Counter, deque
from concurrent.futures import CancelledError
from contextlib import suppress
from functools import partial
from queue import Empty, SimpleQueue
from threading import Condition, RLock
from typing import TYPE_CHECKING, Any, Final
from uuid import uuid4

import dask
from distributed import Client, LocalCluster
from distributed.scheduler import KilledWorker

from worker import kernels
from worker.executors.dask_jobs import Job, Waiting, Worker
from worker.executors.dask_tasks import blame_at_once, introduce, load_kernel, run_chunk, scheduler_address
from worker.executors.process_pool import MAX_LOADS, SPARE_CHUNKS
from worker.ports import Chunk, ExecutorError, Fate, KernelError, Outcome

if TYPE_CHECKING:
    from collections.abc import Callable

    from distributed import Future

    from worker.study import Study

_LOG = logging.getLogger(__name__)
# What it tells of its own doings is for those who look into a cluster, not for the log of a service.
logging.getLogger("distributed").setLevel(logging.WARNING)

#: Seconds between two looks at who has joined and who has gone; between two tries to reach a scheduler that is gone.
LOOK_SECONDS: Final = 0.5
#: Seconds for which a scheduler may be away before the executor gives up.
SCHEDULER_SECONDS: Final = 60.0
#: Seconds beyond a chunk's own after which a worker that should have ended itself counts as frozen.
FROZEN_SECONDS: Final = 15.0
#: Seconds for which the connection is kept for results that are just being fetched.
FETCH_SECONDS: Final = 5.0
#: What is asked of every Dask process that is started here.
_CONFIG: Final = {
    "distributed.scheduler.allowed-failures": 0,
    # No dashboard, and no pages of any kind.
    "distributed.scheduler.http.routes": [],
    "distributed.worker.http.routes": [],
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,
    "distributed.worker.memory.terminate": False,
}


class DaskExecutor:
    """An `Executor` on a Dask cluster. Workers may come and go at any time.

    Parameters
    ----------
    url : str
        ``dask://host:port`` of a scheduler; "" starts a cluster of ``processes`` workers on this machine, for this
        executor alone.
    processes : int
    chunk_timeout : float
        Seconds after which a chunk that is being run ends with its worker.
    run, load : functions
        What a worker does with a chunk and with a new kernel; importable by name. Other than the engine's in tests.
    engine : str
        The engine's version; workers with another one are not used.
    scheduler_seconds : float
        Seconds for which a scheduler may be away.
    """

    def __init__(
        self,
        url: str,
        processes: int,
        *,
        chunk_timeout: float,
        run: Callable[[kernels.ChunkTask], kernels.ChunkResult] = kernels.run_task,
        load: Callable[[kernels.KernelShape], None] = kernels.load,
        engine: str = kernels.ENGINE_VERSION,
        scheduler_seconds: float = SCHEDULER_SECONDS,
    ) -> None:
        self._timeout = chunk_timeout
        self._run = run
        self._load = load
        self._engine = engine
        self._scheduler_seconds = scheduler_seconds
        self._name = uuid4().hex[:12]
        self._lock = RLock()
        #: Threads of Dask's that fetch what came of a job, over a connection that must stay till they are through.
        self._fetching = 0
        self._fetched = Condition(self._lock)
        self._workers: dict[str, Worker] = {}
        self._waiting: deque[Waiting] = deque()
        self._failed_loads: Counter[kernels.KernelShape] = Counter()
        self._broken: dict[kernels.KernelShape, str] = {}
        self._outcomes: SimpleQueue[Outcome | None] = SimpleQueue()
        self._next_look = 0.0
        self._gone_since: float | None = None
        self._cluster: LocalCluster | None = None
        self._client: Client | None = None
        with dask.config.set(_CONFIG):
            self._address, self._security = scheduler_address(url) if url else self._start_cluster(processes)
        self._look()

    def _start_cluster(self, processes: int) -> tuple[str, None]:
        self._cluster = LocalCluster(
            n_workers=processes, threads_per_worker=1, host="127.0.0.1", memory_limit=0,
            dashboard_address="127.0.0.1:0", scheduler_kwargs={"dashboard": False}, silence_logs=logging.CRITICAL,
        )  # fmt: skip
        return self._cluster.scheduler_address, None

    @property
    def capacity(self) -> int:
        """Number of chunks worth having in flight at once; it changes as workers come and go."""
        with self._lock:
            return sum(worker.usable for worker in self._workers.values()) + SPARE_CHUNKS

    def ready(self, study: Study) -> bool:
        """Whether some worker has loaded the kernel of ``study``; lets one begin to where none has."""
        shape = kernels.shape_of(study)
        self._look()
        with self._lock:
            if reason := self._broken.pop(shape, None):
                raise KernelError(reason)
            if any(shape in worker.shapes for worker in self._workers.values()):
                return True
            if not any(self._loads(worker, shape) for worker in self._workers.values()):
                idle = next((w for w in self._workers.values() if w.usable and w.job is None), None)
                if idle is not None:
                    self._begin_load(idle, shape)
        return False

    def submit(self, ticket: int, study: Study, chunk: Chunk) -> None:
        """Give the chunk to the next worker that is free; returns at once."""
        task = kernels.chunk_task(study, chunk.first, chunk.count)
        key = f"sprag-{chunk.study}-{chunk.first}-{chunk.count}-{chunk.failures}-{self._name}-{ticket}"
        with self._lock:
            self._waiting.append(Waiting(ticket, key, task))
            self._fill()

    def wait(self, timeout: float) -> list[Outcome]:
        """Outcomes that have come in; waits for the first at most ``timeout`` s, gives [] when none came.

        Raises ExecutorError when the scheduler stays away.
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
        """Stop a chunk. One that runs goes on to its end, its worker is busy until then, and its result is dropped."""
        with self._lock:
            kept = deque(waiting for waiting in self._waiting if waiting.ticket != ticket)
            running = [
                job
                for worker in self._workers.values()
                if (job := worker.job) and job.kind == "chunk" and job.ticket == ticket and not job.dropped
            ]
            if len(kept) == len(self._waiting) and not running:
                return
            self._waiting = kept
            for job in running:
                job.dropped = True
            self._outcomes.put(Outcome(ticket, Fate.STOPPED, detail="stopped"))

    def close(self) -> None:
        """Leave the cluster, and end it when it is this executor's own."""
        with self._lock:
            self._waiting.clear()
        self._disconnect(timeout=5.0)
        if self._cluster is not None:
            self._cluster.close(timeout=5)

    def _look(self) -> None:
        """Look, when it is time, at the scheduler and at who is there."""
        now = time.monotonic()
        if now < self._next_look:
            return
        self._next_look = now + LOOK_SECONDS
        try:
            present = self._present()
        except (OSError, TimeoutError, ValueError) as error:
            self._scheduler_is_gone(error)
            return
        self._gone_since = None
        with self._lock:
            for address in [address for address in self._workers if address not in present]:
                self._worker_is_gone(self._workers.pop(address))
            for address, info in present.items():
                if address not in self._workers:
                    self._workers[address] = worker = Worker(address, str(info.get("host", address)))
                    key = f"sprag-introduce-{self._name}-{uuid4().hex}"
                    self._begin(worker, Job("introduce", now), key, introduce)
            for worker in list(self._workers.values()):
                if worker.job and worker.job.kind == "chunk" and now - worker.job.began > self._longest:
                    self._worker_is_frozen(worker)
            self._fill()

    @property
    def _longest(self) -> float:
        return self._timeout + FROZEN_SECONDS

    def _present(self) -> dict[str, dict[str, Any]]:
        """The workers that the scheduler knows, by address. Raises OSError or TimeoutError when it is not there."""
        if self._client is None:
            self._client = Client(
                self._address, security=self._security, timeout=5, set_as_default=False, name=f"sprag-{self._name}"
            )
            # A death is counted here, once; the scheduler is not to try the chunk on another worker by itself.
            self._client.run_on_scheduler(blame_at_once)
        if self._client.status != "running":
            raise OSError("the connection to the scheduler is lost")
        scheduler: Any = self._client.scheduler
        present: dict[str, dict[str, Any]] = self._client.sync(scheduler.identity, n_workers=-1, callback_timeout=5)[
            "workers"
        ]
        return present

    def _scheduler_is_gone(self, error: Exception) -> None:
        """Hand back what was on its way; somebody may start the scheduler again."""
        now = time.monotonic()
        with self._lock:
            for worker in self._workers.values():
                if (job := worker.job) and job.kind == "chunk" and not job.dropped:
                    self._outcomes.put(Outcome(job.ticket, Fate.STOPPED, detail="the scheduler was lost"))
        self._disconnect(timeout=1.0)
        if self._gone_since is None:
            self._gone_since = now
            _LOG.error("The scheduler %s is not there; it is tried again: %s", self._address, error)
        elif now - self._gone_since > self._scheduler_seconds:
            raise ExecutorError(
                f"the scheduler {self._address} was not there for {self._scheduler_seconds:g} s: {error}"
            )

    def _disconnect(self, timeout: float) -> None:
        """Give up every job, and close the connection when nobody is fetching a result over it any more."""
        with self._lock:
            client, self._client = self._client, None
            for worker in self._workers.values():
                worker.job = None
            self._workers.clear()
            self._fetched.wait_for(lambda: not self._fetching, FETCH_SECONDS)
        if client is not None:
            with suppress(Exception):
                client.close(timeout=timeout)

    def _worker_is_gone(self, worker: Worker) -> None:
        if worker.job is not None:
            self._died(worker.job)
            worker.job = None

    def _worker_is_frozen(self, worker: Worker) -> None:
        _LOG.error("The worker %s does not answer and is not used any more.", worker.address)
        job, worker.job, worker.usable = worker.job, None, False
        if job is not None:
            self._died(job)

    def _died(self, job: Job) -> None:
        """The worker that was busy with ``job`` is gone."""
        if job.kind == "load" and job.shape is not None:
            self._load_failed(job.shape, "the worker that compiled its kernel died", MAX_LOADS)
        elif job.kind == "chunk" and not job.dropped:
            if time.monotonic() - job.began >= self._timeout:
                self._outcomes.put(Outcome(job.ticket, Fate.TIMED_OUT, detail=f"killed after {self._timeout:g} s"))
            else:
                self._outcomes.put(Outcome(job.ticket, Fate.CRASHED, detail="its worker died"))

    def _loads(self, worker: Worker, shape: kernels.KernelShape) -> bool:
        return worker.job is not None and worker.job.kind == "load" and worker.job.shape == shape

    def _fill(self) -> None:
        """Give waiting chunks to workers with nothing to do; on one host one worker compiles, the others load."""
        for worker in self._workers.values():
            if not self._waiting:
                return
            if not worker.usable or worker.job is not None:
                continue
            chosen = next((item for item in self._waiting if item.task.shape in worker.shapes), None)
            if chosen is not None:
                self._waiting.remove(chosen)
                job = Job("chunk", time.monotonic(), chosen.ticket)
                self._begin(worker, job, chosen.key, run_chunk, self._run, chosen.task, self._timeout)
                continue
            shape = self._waiting[0].task.shape
            fellows = [other for other in self._workers.values() if other.host == worker.host]
            if any(shape in other.shapes for other in fellows) or not any(self._loads(o, shape) for o in fellows):
                self._begin_load(worker, shape)

    def _begin_load(self, worker: Worker, shape: kernels.KernelShape) -> None:
        key = f"sprag-load-{self._name}-{uuid4().hex}"
        self._begin(worker, Job("load", time.monotonic(), shape=shape), key, load_kernel, self._load, shape)

    def _begin(self, worker: Worker, job: Job, key: str, function: Callable[..., Any], *given: Any) -> None:
        worker.job = job
        if self._client is None:
            return
        # Where the connection is just being lost, the next look finds that out and takes the job back.
        with suppress(Exception):
            job.future = self._client.submit(
                function, *given, key=key, workers=[worker.address], allow_other_workers=False, pure=False, retries=0
            )
            job.future.add_done_callback(partial(self._done, worker, job))

    def _done(self, worker: Worker, job: Job, future: Future[Any]) -> None:
        """In a thread of Dask's: note what came of a job, and give the worker its next one."""
        with self._lock:
            if worker.job is not job:  # given up, and the connection perhaps as well
                return
            self._fetching += 1
        value, error = _fetched(future)
        with self._lock:
            self._fetching -= 1
            self._fetched.notify_all()
            if worker.job is not job:  # given up meanwhile
                return
            worker.job = None
            if isinstance(error, KilledWorker):
                self._workers.pop(worker.address, None)
                self._died(job)
            elif job.kind == "chunk":
                if not job.dropped:
                    self._outcomes.put(_outcome(job.ticket, value, error))
            elif job.kind == "introduce":
                self._introduced(worker, value, error)
            elif job.shape is not None:
                self._loaded(worker, job.shape, error)
            self._fill()

    def _introduced(self, worker: Worker, engine: str | None, error: BaseException | None) -> None:
        if error is not None:
            _LOG.error("The worker %s cannot be used: %s: %s", worker.address, type(error).__name__, error)
        elif engine != self._engine:
            _LOG.error(
                "The worker %s has engine %s and is not used; this is engine %s.", worker.address, engine, self._engine
            )
        else:
            worker.usable = True
            self._outcomes.put(None)

    def _loaded(self, worker: Worker, shape: kernels.KernelShape, error: BaseException | None) -> None:
        if error is None:
            worker.shapes.add(shape)
            self._failed_loads.pop(shape, None)
            self._outcomes.put(None)
        elif not isinstance(error, CancelledError):
            self._load_failed(shape, f"its kernel cannot be compiled ({type(error).__name__}: {error})", 1)

    def _load_failed(self, shape: kernels.KernelShape, reason: str, allowed: int) -> None:
        self._failed_loads[shape] += 1
        if self._failed_loads[shape] >= allowed:
            del self._failed_loads[shape]
            self._broken[shape] = reason
            self._outcomes.put(None)


def _fetched(future: Future[Any]) -> tuple[Any, BaseException | None]:
    """The value of a future that is through, or why there is none."""
    try:
        error = future.exception(timeout=FROZEN_SECONDS) if future.status != "finished" else None
        return (future.result(timeout=FROZEN_SECONDS) if error is None else None), error
    except Exception as trouble:  # the value was lost with its worker, or the scheduler
        return None, CancelledError(str(trouble))
    except CancelledError as trouble:
        return None, trouble


def _outcome(ticket: int, value: Any, error: BaseException | None) -> Outcome:
    if error is None:
        return Outcome(ticket, Fate.DONE, value)
    if isinstance(error, CancelledError):
        return Outcome(ticket, Fate.STOPPED, detail=f"its result was lost on the way ({error})")
    return Outcome(ticket, Fate.CRASHED, detail=f"{type(error).__name__}: {error}")
