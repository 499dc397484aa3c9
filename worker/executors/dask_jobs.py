"""The workers of `sprag_study.worker.executors.dask` and their current jobs."""

from __future__ import annotations

import logging
import time
from concurrent.futures import CancelledError
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from sprag_study.sentences import Sentence
from sprag_study.worker import fingerprint
from sprag_study.worker.executors.dask_tasks import OtherFingerprintError
from sprag_study.worker.ports import Fate, Outcome
from sprag_study.worker.reports import ExecutorReport, WorkerReport

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from distributed import Future

    from sprag_study.worker import models
    from sprag_study.worker.executors.dask_link import Link

_LOG = logging.getLogger("sprag.worker")


@dataclass(eq=False, slots=True)
class Job:
    """The job of a worker: its introduction, loading the kernel ``shape``, or the chunk ``ticket``.

    The outcome of a chunk that was ``dropped`` (time on the monotonic clock, s) is ignored.
    """

    kind: Literal["introduce", "load", "chunk"]
    began: float
    ticket: int = 0
    shape: models.KernelShape | None = None
    future: Future[Any] | None = None
    dropped: float | None = None

    @property
    def seconds(self) -> float:
        """How long ago it was given to its worker, in s."""
        return time.monotonic() - self.began


@dataclass(eq=False, slots=True)
class Worker:
    """A worker of the cluster.

    ``usable`` is False until its introduction is accepted; for a refused worker ``refusal`` states why.
    ``processor`` is "" until the worker has told it.
    ``shapes`` has the known answers of the kernels that it has loaded.
    """

    address: str
    host: str
    threads: int = 1
    usable: bool = False
    refusal: str = ""
    processor: str = ""
    shapes: dict[models.KernelShape, str | None] = field(default_factory=dict)
    job: Job | None = None

    @classmethod
    def joined(cls, address: str, info: Mapping[str, Any]) -> Worker:
        """A worker as the scheduler describes it."""
        return cls(address, str(info.get("host", address)), int(info.get("nthreads", 1)))

    def introduced(self, told: object, expected: Mapping[str, str]) -> None:
        """Take what `introduce` returned: the worker is usable where its fingerprint is the one expected.

        Other versions of Sprag may have returned anything; earlier ones return the fingerprint only.
        """
        match told:
            case (found, str(name)):
                self.processor = name
            case _:
                found = told
        if differs := fingerprint.differences(expected, found):
            self.refuse(differs)
        else:
            self.usable = True

    def refuse(self, reason: str) -> None:
        """Give it no chunks; ``reason`` is a clause."""
        self.refusal, self.usable = reason, False
        self.shapes.clear()
        _LOG.error("The worker %s is refused: %s.", self.address, reason)

    def loads(self, shape: models.KernelShape) -> bool:
        """Whether it loads that kernel at present."""
        return self.job is not None and self.job.kind == "load" and self.job.shape == shape


@dataclass(frozen=True, slots=True)
class Waiting:
    """A chunk that no worker has yet; ``run`` is to be called for its ``task``."""

    ticket: int
    key: str
    run: Callable[[models.ChunkTask], models.ChunkResult]
    task: models.ChunkTask


def refusals(workers: Iterable[Worker]) -> Sentence | None:
    """A sentence that states why workers are refused; None where none is."""
    refused = [worker for worker in workers if worker.refusal]
    if not refused:
        return None
    first = {"address": refused[0].address, "refusal": refused[0].refusal}
    if len(refused) == 1:
        return Sentence("The worker {address} is refused: {refusal}.", **first)
    return Sentence("The worker {address} is refused: {refusal} (and {count} more).", count=len(refused) - 1, **first)


def report_of(link: Link, workers: Iterable[Worker], cases: Mapping[str, int], shortage: str | None) -> ExecutorReport:
    """The report of workers that have run ``cases`` on their hosts."""
    found = (
        WorkerReport(
            worker.address, worker.host, worker.usable, worker.job is not None, worker.threads, worker.refusal,
            worker.processor,
        )
        for worker in workers
    )  # fmt: skip
    return ExecutorReport("dask", tuple(found), dict(cases), shortage or "", link.address, link.dashboard)


def outcome_of(job: Job, value: Any, error: BaseException | None, host: str) -> Outcome:
    """The outcome of a chunk whose worker, on ``host``, returned a value, or an error."""
    if error is None:
        return Outcome(job.ticket, Fate.DONE, value, host=host, seconds=job.seconds)
    if isinstance(error, CancelledError):
        return without_rows(job, Fate.STOPPED, f"its result was lost on the way ({error})")
    if isinstance(error, OtherFingerprintError):
        return without_rows(job, Fate.STOPPED, "another process has the address of its worker")
    return without_rows(job, Fate.CRASHED, f"{type(error).__name__}: {error}")


def without_rows(job: Job, fate: Fate, detail: str) -> Outcome:
    """The outcome of a chunk that its worker has not finished."""
    return Outcome(job.ticket, fate, detail=detail, seconds=job.seconds)
