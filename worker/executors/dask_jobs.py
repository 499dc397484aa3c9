"""The workers of `sprag.worker.executors.dask` and their current jobs."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from collections.abc import Iterable

    from distributed import Future

    from sprag.worker import models


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


@dataclass(eq=False, slots=True)
class Worker:
    """A worker of the cluster.

    ``usable`` is False until its introduction is accepted; for a refused worker ``refusal`` states why.
    """

    address: str
    host: str
    usable: bool = False
    refusal: str = ""
    shapes: set[models.KernelShape] = field(default_factory=set)
    job: Job | None = None


@dataclass(frozen=True, slots=True)
class Waiting:
    """A chunk that no worker has yet."""

    ticket: int
    key: str
    task: models.ChunkTask


def refusals(workers: Iterable[Worker]) -> str:
    """A sentence, after a blank, that states why workers are refused; "" where none is."""
    refused = [f"The worker {worker.address} is refused: {worker.refusal}" for worker in workers if worker.refusal]
    if not refused:
        return ""
    more = f" (and {len(refused) - 1} more)" if len(refused) > 1 else ""
    return f" {refused[0]}{more}."
