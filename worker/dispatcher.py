"""The dispatcher: carries out what `worker.dispatch` decides, between the store and the executor."""

from __future__ import annotations

import logging
from contextlib import suppress
from itertools import groupby
from math import inf
from typing import TYPE_CHECKING, assert_never

from worker import dispatch
from worker.dispatch import Dispatch
from worker.ports import EpochLostError, KernelError
from worker.states import StudyState

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from worker.kernels import ChunkResult
    from worker.ports import ActiveStudy, Chunk, Clock, Executor, Store
    from worker.study import Study

_LOG = logging.getLogger(__name__)

#: Seconds between two looks at the store for new studies and wishes; also the longest wait for the executor.
POLL_SECONDS = 0.2
HEARTBEAT_SECONDS = 5.0
#: Studies worked on side by side; the others wait in order of submission.
OPEN_STUDIES = 8
#: Seconds that a study waits for its kernel before it says so: one that lies in the cache is there sooner.
NOTE_SECONDS = 3.0
COMPILING = "The kernel of this study is being compiled, which happens once and can take a minute; other studies go on."


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
        self._ids: dict[int, str] = {}
        #: Studies that wait for their kernels, and when they began to; infinity once they say so.
        self._compiling: dict[int, float] = {}
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
            if study.state in {StudyState.PAUSED, StudyState.CANCELLING}:
                if self._compiling.pop(study.number, None) is not None:
                    self._forget(study.number)
                wish = dispatch.Paused if study.state is StudyState.PAUSED else dispatch.Cancelled
                self._handle(wish(study.number))
            elif study.number in self._machine.studies:
                self._handle(dispatch.Offered(study.number))
            elif self._may_open(study) and self._has_kernel(study):
                self._handle(dispatch.Offered(study.number, self._store.open_chunks(study.number)))

    def _may_open(self, study: ActiveStudy) -> bool:
        """Studies that wait for kernels leave room for as many that have theirs."""
        waits = study.number in self._compiling
        return len(self._machine.studies) < OPEN_STUDIES and (waits or len(self._compiling) < OPEN_STUDIES)

    def _has_kernel(self, study: ActiveStudy) -> bool:
        """Whether the study can be run now; if not, its kernel is on the way or the study is held."""
        number = study.number
        if number not in self._studies:
            self._studies[number] = self._store.study_of(number)
            self._ids[number] = study.id
        try:
            ready = self._executor.ready(self._studies[number])
        except KernelError as error:
            self._compiling.pop(number, None)
            self._hold(number, str(error))
            return False
        if ready:
            self._compiling.pop(number, None)
            self._store.note(self._epoch, number, None)  # it may be that of a dispatcher before this one
            return True
        now = self._clock.monotonic()
        if now - self._compiling.setdefault(number, now) >= NOTE_SECONDS:
            self._store.note(self._epoch, number, COMPILING)
            self._compiling[number] = inf
        return False

    def _hold(self, number: int, reason: str) -> None:
        """Hold a study for a fault that is not its cases', and let the log know."""
        self._store.fault(self._epoch, number, reason)
        if self._only is None:  # who runs a single study is told by its state
            _LOG.error("The study %s is held: %s", self._ids.get(number, number), reason)
        self._forget(number)

    def _forget(self, number: int) -> None:
        self._studies.pop(number, None)
        self._ids.pop(number, None)

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
                self._hold(number, reason)
            case dispatch.Settle(study=number):
                self._store.settle(self._epoch, number)
                self._forget(number)
            case dispatch.Run():
                self._start([instruction])
            case _:
                assert_never(instruction)
