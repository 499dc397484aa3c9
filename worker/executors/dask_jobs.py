"""What `sprag.worker.executors.dask` knows of its workers and of what they are busy with."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from collections.abc import Iterable

    from distributed import Future

    from sprag.worker import models


@dataclass(eq=False, slots=True)
class Job:
    """What a worker is busy with: saying who it is, loading the kernel ``shape``, or the chunk ``ticket``.

    What comes of a chunk that was ``dropped`` (then, on the monotonic clock, in s) is of no interest any more.
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

    ``usable`` is False until it has said who it is, and for ever when that was wrong; ``refusal`` then says why.
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
    """A sentence, with a blank before it, that says why workers are refused; "" where none is."""
    refused = [f"The worker {worker.address} is refused: {worker.refusal}" for worker in workers if worker.refusal]
    if not refused:
        return ""
    more = f" (and {len(refused) - 1} more)" if len(refused) > 1 else ""
    return f" {refused[0]}{more}."
