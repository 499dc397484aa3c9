"""The dispatcher: carries out what `worker.dispatch` decides, between the store and the executor."""

from __future__ import annotations

from contextlib import suppress
from itertools import groupby
from typing import TYPE_CHECKING, assert_never

from worker import dispatch
from worker.dispatch import Dispatch
from worker.ports import EpochLostError
from worker.states import StudyState

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from worker.kernels import ChunkResult
    from worker.ports import Chunk, Clock, Executor, Store
    from worker.study import Study

#: Seconds between two looks at the store for new studies and wishes; also the longest wait for the executor.
POLL_SECONDS = 0.2
HEARTBEAT_SECONDS = 5.0
#: Studies worked on side by side; the others wait in order of submission.
OPEN_STUDIES = 8


class Dispatcher:
    """Runs every study of a store, or only study number ``only``.

    The caller sees to it that there is one dispatcher at a time (a lock); the epoch makes sure of it.
    """

    def __init__(
        self, store: Store, executor: Executor, clock: Clock, *, owner: str = "dispatcher", only: int | None = None
    ) -> None:
        self._store = store
        self._executor = executor
        self._clock = clock
        self._owner = owner
        self._only = only
        self._machine = Dispatch(executor.capacity)
        self._studies: dict[int, Study] = {}
        self._epoch = 0
        self._next_poll = 0.0
        self._next_beat = 0.0

    def run(self, stopping: Callable[[], bool]) -> None:
        """Work until ``stopping()``; then stop the chunks in flight and hand their claims back.

        Raises EpochLostError when another dispatcher took over, ExecutorError when nothing can be run.
        """
        self._epoch = self._store.take_over(self._owner)
        try:
            while not stopping():
                self.step()
        finally:
            self._executor.close()
            with suppress(EpochLostError):  # whoever took over has returned the claims already
                self._store.release(self._epoch)

    def step(self) -> None:
        """One turn: look for new studies and wishes when it is time, then take what the executor has done."""
        now = self._clock.monotonic()
        if now >= self._next_beat:
            self._store.heartbeat(self._epoch)
            self._next_beat = now + HEARTBEAT_SECONDS
        if now >= self._next_poll:
            self._poll()
            self._next_poll = now + POLL_SECONDS
        for outcome in self._executor.wait(POLL_SECONDS):
            self._handle(dispatch.Ended(outcome.ticket, outcome.fate, outcome.detail), outcome.result)

    def _poll(self) -> None:
        """Tell the state machine what the store says of every study; what it knows already changes nothing."""
        for study in self._store.active_studies():
            if self._only not in {None, study.number}:
                continue
            if study.state is StudyState.PAUSED:
                self._handle(dispatch.Paused(study.number))
            elif study.state is StudyState.CANCELLING:
                self._handle(dispatch.Cancelled(study.number))
            elif study.number in self._machine.studies:
                self._handle(dispatch.Offered(study.number))
            elif len(self._machine.studies) < OPEN_STUDIES:
                self._studies[study.number] = self._store.study_of(study.number)
                self._handle(dispatch.Offered(study.number, self._store.open_chunks(study.number)))

    def _handle(self, event: dispatch.Event, result: ChunkResult | None = None) -> None:
        """Give the event to the state machine and do what it says."""
        for starts, instructions in groupby(self._machine.handle(event), lambda item: isinstance(item, dispatch.Run)):
            if starts:
                self._start([item for item in instructions if isinstance(item, dispatch.Run)])
            else:
                for instruction in instructions:
                    self._do(instruction, result)

    def _start(self, runs: Sequence[dispatch.Run]) -> None:
        """Claim the chunks in one transaction and start those that were got."""
        got: set[Chunk] = set(self._store.claim(self._epoch, [run.chunk for run in runs]))
        for run in runs:
            if run.chunk in got:
                self._executor.submit(run.ticket, self._studies[run.chunk.study], run.chunk)
        for run in runs:
            if run.chunk not in got:
                self._handle(dispatch.Refused(run.ticket))

    def _do(self, instruction: dispatch.Instruction, result: ChunkResult | None) -> None:
        match instruction:
            case dispatch.Commit(chunk=chunk):
                if result is None:
                    raise ValueError(f"the executor gave no result for {chunk}")
                self._store.commit(self._epoch, chunk, result)
            case dispatch.PutBack(chunk=chunk, detail=detail):
                self._store.put_back(self._epoch, chunk, detail)
            case dispatch.Split(chunk=chunk, parts=parts, detail=detail):
                self._store.split(self._epoch, chunk, parts, detail)
            case dispatch.Quarantine(chunk=chunk, ending=ending, detail=detail):
                self._store.quarantine(self._epoch, chunk, ending.value, detail)
            case dispatch.Stop(ticket=ticket):
                self._executor.stop(ticket)
            case dispatch.Fault(study=number, reason=reason):
                self._store.fault(self._epoch, number, reason)
                self._studies.pop(number, None)
            case dispatch.Settle(study=number):
                self._store.settle(self._epoch, number)
                self._studies.pop(number, None)
            case dispatch.Run():
                self._start([instruction])
            case _:
                assert_never(instruction)
