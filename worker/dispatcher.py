"""The dispatcher: carries out what `sprag.worker.dispatch` decides, between the store and the executor."""

from __future__ import annotations

import logging
from contextlib import suppress
from itertools import groupby
from typing import TYPE_CHECKING, assert_never

from sprag.worker import dispatch
from sprag.worker.dispatch import Dispatch
from sprag.worker.ports import Chunk, EpochLostError, Fate, KernelError, Outcome, StoreFullError
from sprag.worker.reuse import no_cases, taken
from sprag.worker.rounds import PlanError, Rounds
from sprag.worker.states import StudyState

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from sprag.worker.models import ChunkResult
    from sprag.worker.ports import ActiveStudy, Clock, Executor, Known, News, Store
    from sprag.worker.study import Study

_LOG = logging.getLogger(__name__)

#: Seconds between two polls of the store for new studies and requests; also the longest wait for the executor.
POLL_SECONDS = 0.1
#: The same with notifications from the store; polling then finds only changes without a notification.
QUIET_POLL_SECONDS = 2.0
HEARTBEAT_SECONDS = 5.0
#: Number of studies active at the same time; the others wait in order of submission.
OPEN_STUDIES = 8
#: Seconds that a study waits for its kernel before this is reported; cached kernels load sooner.
NOTE_SECONDS = 3.0
#: Seconds before a store that refused writes is retried: doubled each time, reset after a success.
FULL_SECONDS = (2.0, 60.0)
COMPILING = "The kernel of this study is being compiled, once, which can take a minute; other studies continue."


class Dispatcher:
    """Runs every study of a store, or only study number ``only``.

    The caller ensures, by a lock, that there is one dispatcher at a time; the epoch enforces it. ``renew`` returns a
    new executor that compiles its kernels anew, replacing one whose chunks all crash. With ``news`` the store is polled
    when it has changed, and rarely otherwise.
    """

    def __init__(
        self,
        store: Store,
        executor: Executor,
        clock: Clock,
        *,
        owner: str = "dispatcher",
        only: int | None = None,
        renew: Callable[[], Executor] | None = None,
        news: News | None = None,
    ) -> None:
        self._store = store
        self._executor = executor
        self._clock = clock
        self._owner = owner
        self._only = only
        self._renew = renew
        self._news = news
        self._machine = Dispatch(executor.capacity)
        self._rounds = Rounds(store)
        self._studies: dict[int, Study] = {}
        self._ids: dict[int, str] = {}
        #: Studies waiting for their kernels, and those that cannot run at present; with the time when this began.
        self._compiling: dict[int, float] = {}
        self._short: dict[int, float] = {}
        #: The reasons recorded on studies.
        self._notes: dict[int, str | None] = {}
        self._priorities: dict[int, int] = {}
        #: By ticket: cases of a chunk in flight that the store already has; and outcomes of chunks it has completely.
        self._known: dict[int, Known] = {}
        self._had_all: list[Outcome] = []
        #: Why the store refused the last write; claims must still be returned then.
        self._full: str | None = None
        self._full_delay = FULL_SECONDS[0]
        self._try_again = 0.0
        self._epoch = 0
        self._next_poll = 0.0
        self._next_beat = 0.0

    def run(self, stopping: Callable[[], bool]) -> None:
        """Work until ``stopping()``; then return the claims of the chunks in flight and stop these.

        Raises EpochLostError when another dispatcher took over, ExecutorError when nothing can be run.
        """
        self._epoch = self._store.take_over(self._owner)
        try:
            while not stopping():
                self.step()
        finally:
            # First, because killed processes take long to exit on a busy machine, and this one may be killed then. The
            # dispatcher that has taken over, or the next one, returns the claims where this one cannot.
            try:
                with suppress(EpochLostError, StoreFullError):
                    self._store.release(self._epoch)
            finally:
                self._executor.close()
                if self._news is not None:
                    self._news.close()

    def step(self) -> None:
        """One iteration: poll for new studies and requests when it is time, then process the executor's outcomes.

        When the store refuses writes, unfinished work is dropped and computed again later.
        """
        now = self._clock.monotonic()
        try:
            if now >= self._next_beat:
                self._store.heartbeat(self._epoch)
                self._next_beat = now + HEARTBEAT_SECONDS
            if now >= self._next_poll or (self._news is not None and self._news.wait(0.0)):
                self._poll()
                # There are no notifications about compiled kernels or free space.
                quiet = self._news is not None and not self._compiling
                self._next_poll = now + (QUIET_POLL_SECONDS if quiet else POLL_SECONDS)
            at_once, self._had_all = self._had_all, []
            if self._news is not None and not (at_once or self._compiling or self._machine.in_flight):
                # The executor has nothing to report.
                if self._news.wait(POLL_SECONDS):
                    self._next_poll = now
                return
            for outcome in (*at_once, *self._executor.wait(0.0 if at_once else POLL_SECONDS)):
                self._handle(dispatch.Ended(outcome.ticket, outcome.fate, outcome.detail), outcome.result)
                self._known.pop(outcome.ticket, None)
        except StoreFullError as error:
            self._store_is_full(str(error))

    def _store_is_full(self, reason: str) -> None:
        if self._full is None:
            self._try_again = self._clock.monotonic() + self._full_delay
            self._full_delay = min(2.0 * self._full_delay, FULL_SECONDS[1])
        self._full = reason
        self._known.clear()
        self._had_all.clear()
        self._handle(dispatch.Lost())
        for number in list(self._studies):
            self._forget(number)

    def _has_room(self, studies: Sequence[ActiveStudy]) -> bool:
        """Hold all studies while there is no room, and resume them when there is; False when any has changed."""
        shortage = self._store.shortage()
        dropped = self._full is not None
        if dropped:
            shortage = shortage or f"{self._full}; it is retried from time to time"
        going = any(study.state in {StudyState.QUEUED, StudyState.RUNNING} for study in studies)
        if shortage is not None or self._clock.monotonic() < self._try_again:
            if going or dropped:
                self._store.hold(self._epoch, shortage or "no room", returned=dropped)
                if self._only is None:
                    _LOG.error("Every study is held: %s", shortage)
            self._full = None
            return not going
        if any(study.waits_for_room for study in studies):
            self._store.let_go(self._epoch)
            return False
        return True

    def _poll(self) -> None:
        """Pass the state of every study in the store to the state machine; known facts change nothing."""
        self._machine.capacity = self._executor.capacity  # changes as workers join and leave
        studies = self._store.active_studies()
        if not self._has_room(studies):
            studies = self._store.active_studies()
        for study in studies:
            self._priorities[study.number] = study.priority
            if self._only not in {None, study.number}:
                continue
            over = study.finish_by is not None and study.finish_by <= self._clock.now()
            paused = study.state is StudyState.PAUSED and not (over and study.goes_on)
            if paused or study.state is StudyState.CANCELLING:
                self._notes.pop(study.number, None)
                if self._compiling.pop(study.number, None) is not None:
                    self._forget(study.number)
                wish = dispatch.Paused if study.state is StudyState.PAUSED else dispatch.Cancelled
                self._handle(wish(study.number))
            elif over:
                self._time_is_over(study.number)
            elif study.number in self._machine.studies:
                self._tell_shortage(study.number)
                self._handle(dispatch.Offered(study.number, priority=study.priority))
            elif self._may_open(study) and self._has_kernel(study):
                chunks = self._store.open_chunks(study.number)
                self._say("The study %s starts: %d cases in %d chunks to be run.", study.number,
                    sum(chunk.count for chunk in chunks), len(chunks))  # fmt: skip
                self._handle(dispatch.Offered(study.number, chunks, study.priority, study.proven))

    def _time_is_over(self, number: int) -> None:
        """The deadline of the study has passed: chunks in flight finish, then the study is held."""
        self._compiling.pop(number, None)
        self._handle(dispatch.Paused(number))
        if number not in self._machine.studies:
            self._store.time_is_over(self._epoch, number)
            self._say("The deadline of the study %s has passed.", number)
            self._forget(number)

    def _may_open(self, study: ActiveStudy) -> bool:
        """Whether a study may become active; those that wait for kernels or have a lower priority do not count."""
        if study.number in self._compiling:
            return True
        rivals = (self._machine.studies, self._compiling)
        return all(
            sum(self._priorities.get(number, 0) >= study.priority for number in group) < OPEN_STUDIES
            for group in rivals
        )

    def _has_kernel(self, study: ActiveStudy) -> bool:
        """Whether the study can run now; if not, its kernel is being loaded or the study is held."""
        number = study.number
        if number not in self._studies:
            self._studies[number] = self._store.study_of(number)
            self._ids[number] = study.id
        try:
            ready = self._executor.ready(self._studies[number])
        except KernelError as error:
            self._compiling.pop(number, None)
            self._handle(dispatch.Broken(number, str(error)))
            return False
        if ready:
            self._compiling.pop(number, None)
            self._notes.pop(number, None)
            self._store.note(self._epoch, number, None)  # the reason may come from an earlier dispatcher
            return True
        now = self._clock.monotonic()
        if now - self._compiling.setdefault(number, now) >= NOTE_SECONDS:
            self._note(number, self._executor.shortage or COMPILING)
        return False

    def _tell_shortage(self, number: int) -> None:
        """Record on an active study that nothing can be run, when this persists."""
        shortage, now = self._executor.shortage, self._clock.monotonic()
        if shortage is None:
            self._short.pop(number, None)
            self._note(number, None)
        elif now - self._short.setdefault(number, now) >= NOTE_SECONDS:
            self._note(number, shortage)

    def _note(self, number: int, note: str | None) -> None:
        if self._notes.get(number) != note:
            self._store.note(self._epoch, number, note)
            self._notes[number] = note

    def _hold(self, number: int, reason: str) -> None:
        """Hold a study for a fault outside its cases, and log it."""
        self._store.fault(self._epoch, number, reason)
        if self._only is None:  # the state of a single study shows it
            _LOG.error("The study %s is held: %s", self._ids.get(number, number), reason)
        self._forget(number)

    def _say(self, text: str, number: int, *values: object) -> None:
        """Log the progress of a study, except in the run of a single study."""
        if self._only is None:
            _LOG.info(text, self._ids.get(number, number), *values)

    def _forget(self, number: int) -> None:
        self._studies.pop(number, None)
        self._rounds.forget(number)
        self._ids.pop(number, None)
        for known in (self._compiling, self._short, self._notes):
            known.pop(number, None)

    def _begin_again(self, number: int, reason: str) -> None:
        """Restart with new processes and kernels, because the cached kernels may be damaged."""
        if self._renew is None:
            self._store.begin_again(self._epoch, number)
            self._handle(dispatch.Broken(number, reason))
            return
        _LOG.error(
            "The study %s: %s. Its kernels are compiled anew and its cases run again.",
            self._ids.get(number, number), reason,
        )  # fmt: skip
        self._executor.close()
        self._known.clear()
        self._had_all.clear()
        self._executor = self._renew()
        self._store.begin_again(self._epoch, number)
        for known in list(self._studies):
            self._forget(known)

    def _handle(self, event: dispatch.Event, result: ChunkResult | None = None) -> None:
        """Pass the event to the state machine and carry out its instructions."""
        for starts, instructions in groupby(self._machine.handle(event), lambda item: isinstance(item, dispatch.Run)):
            if starts:
                self._start([item for item in instructions if isinstance(item, dispatch.Run)])
            else:
                for instruction in instructions:
                    self._do(instruction, result)

    def _start(self, runs: Sequence[dispatch.Run]) -> None:
        """Claim the chunks in one transaction and start those that were granted."""
        got: set[Chunk] = set(self._store.claim(self._epoch, [run.chunk for run in runs]))
        for run in runs:
            if run.chunk in got:
                self._submit(run.ticket, run.chunk)
        for run in runs:
            if run.chunk not in got:
                self._handle(dispatch.Refused(run.ticket))

    def _submit(self, ticket: int, chunk: Chunk) -> None:
        """Start the cases of the chunk that no other study has."""
        study = self._studies[chunk.study]
        known = self._store.known(study, chunk)
        if known is None:
            self._executor.submit(ticket, study, chunk)
            return
        self._known[ticket] = known
        if known.missing.size:
            self._executor.submit(ticket, taken(study, known.missing), Chunk(chunk.study, 0, known.missing.size))
        else:
            self._had_all.append(Outcome(ticket, Fate.DONE, no_cases(study)))

    def _settle(self, number: int) -> None:
        """End a study without open chunks, or let it choose its next ones."""
        study = self._studies.get(number)
        if study is not None and study.plan is not None:
            try:
                appended = self._rounds.advance(self._epoch, number, study)
            except PlanError as error:
                self._hold(number, str(error))
                return
            if appended is not None:
                self._studies[number] = appended.study
                priority = self._priorities.get(number, 0)
                self._handle(dispatch.Offered(number, appended.chunks, priority, proven=True))
                return
        ended = self._store.settle(self._epoch, number)
        self._say("The study %s is %s.", number, ended.value)
        self._forget(number)

    def _do(self, instruction: dispatch.Instruction, result: ChunkResult | None) -> None:
        match instruction:
            case dispatch.Commit(ticket=ticket, chunk=chunk):
                if result is None:
                    raise ValueError(f"the executor gave no result for {chunk}")
                self._store.commit(self._epoch, chunk, result, self._known.get(ticket))
                self._full_delay = FULL_SECONDS[0]
            case dispatch.PutBack(chunk=chunk, detail=detail):
                self._store.put_back(self._epoch, chunk, detail)
            case dispatch.Split(chunk=chunk, parts=parts, detail=detail):
                self._store.split(self._epoch, chunk, parts, detail)
            case dispatch.Quarantine(chunk=chunk, ending=ending, detail=detail):
                self._store.quarantine(self._epoch, chunk, ending.value, detail)
            case dispatch.Stop(ticket=ticket):
                self._executor.stop(ticket)
            case dispatch.Fault(study=number, reason=reason):
                in_vain = "" if self._renew is None else "; the same happened with newly compiled kernels"
                self._hold(number, f"{reason}{in_vain}")
            case dispatch.Renew(study=number, reason=reason):
                self._begin_again(number, reason)
            case dispatch.Settle(study=number):
                self._settle(number)
            case dispatch.Run():
                self._start([instruction])
            case _:
                assert_never(instruction)
