"""The dispatcher: carries out what `sprag_study.worker.dispatch` decides, between the store and the executor."""

from __future__ import annotations

import logging
from collections import Counter
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, assert_never

from sprag_study.sentences import Sentence
from sprag_study.worker import dispatch
from sprag_study.worker.dispatch import Dispatch
from sprag_study.worker.opening import Opening
from sprag_study.worker.ports import (
    Chunk,
    EpochLostError,
    Fate,
    Finished,
    KernelError,
    Outcome,
    StoreFullError,
    UnreadableStudyError,
)
from sprag_study.worker.reports import Reporter
from sprag_study.worker.reuse import no_cases, taken
from sprag_study.worker.rounds import PlanError, Rounds
from sprag_study.worker.stages import Stage, Stages
from sprag_study.worker.states import StudyState

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from sprag_study.worker.ports import ActiveStudy, Clock, Executor, Known, News, Store
    from sprag_study.worker.study import Study

_LOG = logging.getLogger("sprag.worker")

#: Seconds between two polls of the store for new studies and requests; also the longest wait for the executor.
POLL_SECONDS = 0.1
#: The same with notifications from the store; polling then finds only changes without a notification.
QUIET_POLL_SECONDS = 2.0
HEARTBEAT_SECONDS = 5.0
#: Cases after which a transaction of results ends, because other writers wait for it: a fraction of a second.
GROUP_CASES = 20_000
#: Seconds before a store that refused writes is retried: doubled each time, reset after a success.
FULL_SECONDS = (2.0, 60.0)


class Dispatcher:
    """Runs the studies of a store that belong to it, or only study number ``only``.

    Where the store admits several dispatchers they share the studies; the epoch ensures that each study has one of them
    at a time. ``renew`` returns a
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
        self._reporter = Reporter()
        self._studies: dict[int, Study] = {}
        self._ids: dict[int, str] = {}
        self._stages = Stages(store, clock)
        self._opening = Opening(store, clock, only, self._stages)
        #: By ticket: cases of a chunk in flight that the store already has; and outcomes of chunks it has completely.
        self._known: dict[int, Known] = {}
        self._had_all: list[Outcome] = []
        #: Finished chunks to be stored and chunks to be claimed by the next transaction.
        self._finished: list[Finished] = []
        self._waiting_cases = 0
        self._runs: list[dispatch.Run] = []
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
        self._epoch = self._opening.epoch = self._store.take_over(self._owner)
        try:
            while not stopping():
                self.step()
        finally:
            # First, because killed processes take long to exit on a busy machine, and this one may be killed then. The
            # dispatcher that has taken over, or the next one, returns the claims where this one cannot.
            try:
                with suppress(EpochLostError, StoreFullError):
                    self._store.release(self._epoch)
                    self._stages.keep(self._executor.at_work())
            finally:
                self._stages.close()
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
                report = self._reporter.summary(self._executor.report(), self._machine.in_flight, now)
                self._store.heartbeat(self._epoch, report)
                self._stages.keep(self._executor.at_work())
                self._next_beat = now + HEARTBEAT_SECONDS
            if now >= self._next_poll or (self._news is not None and self._news.wait(0.0)):
                self._poll()
                # There are no notifications about compiled kernels or free space.
                quiet = self._news is not None and not self._opening.compiling
                self._next_poll = now + (QUIET_POLL_SECONDS if quiet else POLL_SECONDS)
            at_once, self._had_all = self._had_all, []
            timeout = 0.0 if at_once else POLL_SECONDS
            if self._news is not None and not (at_once or self._opening.compiling or self._machine.in_flight):
                # The executor has no outcomes, and is only asked so that it looks for workers that come and go.
                if self._news.wait(POLL_SECONDS):
                    self._next_poll = now
                timeout = 0.0
            for outcome in (*at_once, *self._executor.wait(timeout)):
                self._stages.chunk_ended(outcome)
                known = self._known.pop(outcome.ticket, None)
                for instruction in self._machine.handle(dispatch.Ended(outcome.ticket, outcome.fate, outcome.detail)):
                    if isinstance(instruction, dispatch.Commit):
                        self._store_later(instruction.chunk, outcome, known)
                    else:
                        self._do(instruction)
            self._exchange()
        except StoreFullError as error:
            self._store_is_full(str(error))

    def _store_is_full(self, reason: str) -> None:
        if self._full is None:
            self._try_again = self._clock.monotonic() + self._full_delay
            self._full_delay = min(2.0 * self._full_delay, FULL_SECONDS[1])
        self._full = reason
        self._drop()
        self._handle(dispatch.Lost())
        for number in list(self._studies):
            self._forget(number)

    def _has_room(self, studies: Sequence[ActiveStudy]) -> bool:
        """Hold all studies while there is no room, and resume them when there is; False when any has changed."""
        shortage = self._store.shortage()
        dropped = self._full is not None
        if dropped:
            shortage = shortage or Sentence("{reason}; it is retried from time to time", reason=self._full or "")
        going = any(study.state in {StudyState.QUEUED, StudyState.RUNNING} for study in studies)
        if shortage is not None or self._clock.monotonic() < self._try_again:
            if going or dropped:
                self._store.hold(self._epoch, shortage or Sentence("no room"), returned=dropped)
                if self._only is None:
                    _LOG.error("Every study is held: %s", shortage)
            self._full = None
            return not going
        if any(study.waits_for_room for study in studies):
            self._store.let_go(self._epoch)
            return False
        return True

    def _poll(self) -> None:
        """Pass the state of every study that is ours or free to the state machine; known facts change nothing."""
        self._machine.capacity = self._executor.capacity  # changes as workers join and leave
        self._store.end_absent(self._epoch)
        studies = self._opening.studies()
        if not self._has_room(studies):
            studies = self._opening.studies()
        known = {number: name for number, name in self._ids.items() if number in self._machine.studies}
        self._ids = known | {study.number: study.id for study in studies}
        given = self._opening.given(studies, self._executor.shortage)
        for study in filter(self._opening.chosen, studies):
            over = study.finish_by is not None and study.finish_by <= self._clock.now()
            paused = study.state is StudyState.PAUSED and not (over and study.goes_on)
            if paused or study.number == given:
                self._part_with(study)
            elif study.state is StudyState.CANCELLING:
                self._opening.unnoted(study.number)
                if self._opening.stop_waiting(study.number):
                    self._forget(study.number)
                if self._opening.adopted(study):
                    self._handle(dispatch.Cancelled(study.number))
            elif over:
                self._time_is_over(study)
            elif study.number in self._machine.studies:
                self._opening.tell_shortage(study.number, self._executor)
                self._handle(offered(study))
            elif self._opening.may_open(study, self._machine.studies) and self._has_kernel(study):
                chunks = self._store.open_chunks(study.number)
                self._say("The study %s starts: %d cases in %d chunks to be run.", study.number,
                    sum(chunk.count for chunk in chunks), len(chunks))  # fmt: skip
                self._handle(offered(study, chunks))

    def _part_with(self, study: ActiveStudy) -> None:
        """A study is paused, or another dispatcher is to have it: it is free when its chunks in flight have ended."""
        self._opening.unnoted(study.number)
        if self._opening.stop_waiting(study.number):
            self._forget(study.number)
        self._handle(dispatch.Paused(study.number))
        if self._opening.is_ours(study) and study.number not in self._machine.studies and not study.waits_for_room:
            self._store.leave(self._epoch, study.number)
            self._forget(study.number)

    def _time_is_over(self, study: ActiveStudy) -> None:
        """The deadline of the study has passed: chunks in flight finish, then the study is held."""
        number = study.number
        self._opening.stop_waiting(number)
        self._handle(dispatch.Paused(number))
        if number not in self._machine.studies and self._opening.adopted(study):
            self._stages.keep(self._executor.at_work())
            self._store.time_is_over(self._epoch, number)
            self._say("The deadline of the study %s has passed.", number)
            self._forget(number)

    def _has_kernel(self, study: ActiveStudy) -> bool:
        """Whether the study can run now; if not, its kernel is being loaded or the study is held."""
        number = study.number
        try:
            if number not in self._studies:
                self._studies[number] = self._store.study_of(number)
            self._stages.opened(study, self._studies[number])
            return self._opening.loaded(number, self._studies[number], self._executor)
        except (KernelError, UnreadableStudyError) as error:
            self._opening.stop_waiting(number)
            self._handle(dispatch.Broken(number, str(error)))
            return False

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
        self._stages.closed(number)
        self._opening.forget(number)

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
        self._stages.count(self._executor.at_work())
        self._stages.close()  # their outcomes never come
        self._executor.close()
        self._drop()
        self._executor = self._renew()
        self._store.begin_again(self._epoch, number)
        for known in list(self._studies):
            self._forget(known)

    def _drop(self) -> None:
        """Forget the results and claims of chunks in flight."""
        for pending in (self._known, self._had_all, self._finished, self._runs):
            pending.clear()

    def _handle(self, event: dispatch.Event) -> None:
        """Pass an event that stores no rows to the state machine and carry out its instructions."""
        for instruction in self._machine.handle(event):
            self._do(instruction)
        self._exchange()

    def _store_later(self, chunk: Chunk, outcome: Outcome, known: Known | None) -> None:
        """Let the next transaction store a finished chunk."""
        if outcome.result is None:
            raise ValueError(f"the executor gave no result for {chunk}")
        self._finished.append(Finished(chunk, outcome.result, known, outcome.host))
        self._waiting_cases += chunk.count
        if self._waiting_cases >= GROUP_CASES:
            self._exchange()

    def _exchange(self) -> None:
        """Store what is finished and claim what is to run next, in one transaction; start what was granted."""
        finished, self._finished = self._finished, []
        runs, self._runs = self._runs, []
        self._waiting_cases = 0
        if not (finished or runs):
            return
        written = Counter[int]()
        for item in finished:
            written[item.chunk.study] += item.chunk.count
        with self._stages.stage(Stage.WRITING, written):
            claimed = set(self._store.exchange(self._epoch, finished, [run.chunk for run in runs])[1])
        if finished:
            self._full_delay = FULL_SECONDS[0]
        for run in runs:
            if run.chunk in claimed:
                self._submit(run.ticket, run.chunk)
        for run in runs:
            if run.chunk not in claimed:
                self._handle(dispatch.Refused(run.ticket))

    def _submit(self, ticket: int, chunk: Chunk) -> None:
        """Start the cases of the chunk that no other study has."""
        study = self._studies[chunk.study]
        known = self._store.known(study, chunk)
        cases = chunk.count if known is None else known.missing.size
        if known is not None:
            self._known[ticket] = known
        if not cases:
            self._had_all.append(Outcome(ticket, Fate.DONE, no_cases(study)))
            return
        with self._stages.chunk(ticket, chunk, cases):
            if known is None:
                self._executor.submit(ticket, study, chunk)
            else:
                self._executor.submit(ticket, taken(study, known.missing), Chunk(chunk.study, 0, cases))

    def _settle(self, number: int) -> None:
        """End a study without open chunks, or let it choose its next ones."""
        study = self._studies.get(number)
        if study is not None and study.plan is not None:
            self._stages.keep(self._executor.at_work())  # where no round is left, `advance` ends it
            try:
                with self._stages.stage(Stage.PLANNING, {number: study.cases}):
                    appended = self._rounds.advance(self._epoch, number, study)
            except (PlanError, UnreadableStudyError) as error:
                self._hold(number, str(error))
                return
            if appended is not None:
                self._studies[number] = appended.study
                polled = self._opening.polled.get(number)
                again = dispatch.Offered(number) if polled is None else offered(polled)
                self._handle(replace(again, chunks=appended.chunks, proven=True))
                return
        self._stages.keep(self._executor.at_work())  # as soon as it has ended, others read how long it took
        ended = self._store.settle(self._epoch, number)
        self._say("The study %s is %s.", number, ended.value)
        self._forget(number)

    def _do(self, instruction: dispatch.Instruction) -> None:
        """Carry out an instruction, in order: only claims may be put off, to be made together."""
        if isinstance(instruction, dispatch.Run):
            self._runs.append(instruction)
            return
        self._exchange()
        match instruction:
            case dispatch.PutBack(chunk=chunk, detail=detail):
                self._store.put_back(self._epoch, chunk, detail)
            case dispatch.Split(chunk=chunk, parts=parts, detail=detail):
                self._store.split(self._epoch, chunk, parts, detail)
            case dispatch.Quarantine(chunk=chunk, ending=ending, detail=detail):
                self._store.quarantine(self._epoch, chunk, ending.value, detail)
            case dispatch.Stop(ticket=ticket):
                self._executor.stop(ticket)
            case dispatch.Fault(study=number, reason=reason):
                if self._renew is not None:
                    reason = Sentence("{reason}; the same happened with newly compiled kernels", reason=reason)
                self._hold(number, reason)
            case dispatch.Renew(study=number, reason=reason):
                self._begin_again(number, reason)
            case dispatch.Settle(study=number):
                self._settle(number)
            case dispatch.Commit():
                raise AssertionError("only the end of a chunk stores rows")
            case _:
                assert_never(instruction)


def offered(study: ActiveStudy, chunks: Sequence[Chunk] = ()) -> dispatch.Offered:
    """A study, as it was polled, for the state machine."""
    return dispatch.Offered(study.number, chunks, study.priority, study.proven, study.rank, study.owner)
