"""What several measurements share: an executor that answers at once, and the time of a call."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from sprag_study.worker.models import ChunkResult
from sprag_study.worker.ports import Chunk, Fate, Outcome
from sprag_study.worker.reports import ExecutorReport
from sprag_study.worker.study import Study

T = TypeVar("T")


def timed(work: Callable[[], T]) -> tuple[float, T]:
    """Seconds of a call, and its answer."""
    begin = time.perf_counter()
    answer = work()
    return time.perf_counter() - begin, answer


class AtOnce:
    """An `Executor` whose chunks are done as soon as they are submitted.

    ``values_of`` gives the results of the cases from ``first``, of shape (count, results).
    """

    shortage = None

    def __init__(self, values_of: Callable[[int, int], np.ndarray[Any, Any]], in_flight: int = 4) -> None:
        self.capacity = in_flight
        self._values_of = values_of
        self._done: list[Outcome] = []

    @property
    def busy(self) -> bool:
        """Whether a chunk is in flight."""
        return bool(self._done)

    def ready(self, study: Study) -> bool:  # noqa: ARG002 - nothing is loaded
        """Always."""
        return True

    def submit(self, ticket: int, study: Study, chunk: Chunk) -> None:  # noqa: ARG002 - the case says it all
        """Answer."""
        values = self._values_of(chunk.first, chunk.count)
        result = ChunkResult(chunk.first, ["ok"] * chunk.count, [""] * chunk.count, values)
        self._done.append(Outcome(ticket, Fate.DONE, result, host="at once"))

    def wait(self, timeout: float) -> list[Outcome]:  # noqa: ARG002 - there is always an answer, or no chunk
        """All answers."""
        found, self._done = self._done, []
        return found

    def stop(self, ticket: int) -> None:
        """Nothing runs."""

    def at_work(self) -> dict[int, float]:
        """None."""
        return {}

    def report(self) -> ExecutorReport:
        """No workers."""
        return ExecutorReport("at once", (), {})

    def close(self) -> None:
        """Nothing is open."""
