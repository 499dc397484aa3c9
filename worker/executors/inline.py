"""Chunks run one after the other in this process, for tests and for studies too small for a pool."""

from __future__ import annotations

import socket
import time
from collections import deque
from dataclasses import replace
from typing import TYPE_CHECKING

from sprag_study.worker import models, traces
from sprag_study.worker.executors import known_answers
from sprag_study.worker.ports import Chunk, Fate, Outcome
from sprag_study.worker.reports import ExecutorReport, WorkerReport, processor

if TYPE_CHECKING:
    from collections.abc import Callable

    from sprag_study.worker.study import Study


class InlineExecutor:
    """An `Executor` without processes. A chunk cannot be stopped or timed out once it runs."""

    def __init__(self, run: Callable[[models.ChunkTask], models.ChunkResult] = known_answers.run_task) -> None:
        self._run = run
        self._waiting: deque[tuple[int, Callable[[models.ChunkTask], models.ChunkResult], models.ChunkTask]] = deque()
        self._stopped: list[Outcome] = []
        self._cases = 0

    @property
    def capacity(self) -> int:
        """Always 1: further chunks would only wait."""
        return 1

    @property
    def shortage(self) -> None:
        """Always None: no workers have to join."""
        return None

    def ready(self, study: Study) -> bool:  # noqa: ARG002 - the first chunk compiles what it needs
        """Always True: nothing else could run in the meantime."""
        return True

    def submit(self, ticket: int, study: Study, chunk: Chunk) -> None:
        """Queue the chunk; `wait` runs it."""
        task = models.chunk_task(study, chunk.first, chunk.count)
        self._waiting.append((ticket, traces.carried("run chunk", self._run), task))

    def wait(self, timeout: float) -> list[Outcome]:
        """Run the oldest chunk to its end, however long it takes."""
        if self._stopped:
            found, self._stopped = self._stopped, []
            return found
        if not self._waiting:
            time.sleep(timeout)
            return []
        ticket, run, task = self._waiting.popleft()
        began = time.monotonic()
        try:
            result = run(task)
            outcome = Outcome(ticket, Fate.DONE, result, host=socket.gethostname())
            self._cases += result.count
        except Exception as error:  # a bug, reported like the crash of a process
            outcome = Outcome(ticket, Fate.CRASHED, detail=f"{type(error).__name__}: {error}")
        return [replace(outcome, seconds=time.monotonic() - began)]

    def stop(self, ticket: int) -> None:
        """Drop a chunk that has not run."""
        kept = deque(item for item in self._waiting if item[0] != ticket)
        if len(kept) < len(self._waiting):
            self._waiting = kept
            self._stopped.append(Outcome(ticket, Fate.STOPPED, detail="stopped"))

    def at_work(self) -> dict[int, float]:
        """None: `wait` runs a chunk to its end."""
        return {}

    def report(self) -> ExecutorReport:
        """This process, between two chunks."""
        host = socket.gethostname()
        worker = WorkerReport("this process", host, True, processor=processor())
        return ExecutorReport("inline", (worker,), {host: self._cases})

    def close(self) -> None:
        """Drop what has not run."""
        self._waiting.clear()
