"""Stages of studies: what takes how long. The dispatcher measures those that no time in the store shows."""

from __future__ import annotations

import time
from collections import defaultdict
from contextlib import contextmanager, nullcontext
from enum import StrEnum
from typing import TYPE_CHECKING

from sprag_study.worker import traces
from sprag_study.worker.ports import Fate

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from contextlib import AbstractContextManager

    from sprag_study.worker.ports import ActiveStudy, Chunk, Clock, Outcome, Store
    from sprag_study.worker.study import Study


class Stage(StrEnum):
    """A stage of a study that was due at a time, in the order in which they begin."""

    WAITING = "waiting"
    CHECKING = "checking"
    COMPILING = "compiling"
    COMPUTING = "computing"
    WRITING = "writing"
    PLANNING = "planning"
    INTERRUPTED = "interrupted"
    REPORT = "report"
    SENDING = "sending"


class Stages:
    """The stages of the studies of a dispatcher: their seconds, for the store, and their spans, where traces are on."""

    def __init__(self, store: Store, clock: Clock) -> None:
        self._store = store
        self._clock = clock
        self._spent: dict[int, dict[Stage, float]] = defaultdict(lambda: defaultdict(float))
        #: The spans of studies by number, and of chunks in flight by ticket.
        self._studies: dict[int, traces.Begun] = {}
        self._chunks: dict[int, traces.Begun] = {}

    def opened(self, active: ActiveStudy, study: Study) -> None:
        """This dispatcher takes a study up."""
        if active.number not in self._studies:
            about: dict[str, str | int] = {
                traces.STUDY: active.id,
                traces.MODEL: study.model,
                traces.CASES: study.cases,
            }
            self._studies[active.number] = traces.Begun("study", active.trace, about)

    def of_study(self, number: int) -> AbstractContextManager[None]:
        """A block whose spans are parts of the study's."""
        begun = self._studies.get(number)
        return nullcontext() if begun is None else begun.current()

    def closed(self, number: int) -> None:
        """This dispatcher no longer has the study."""
        if begun := self._studies.pop(number, None):
            begun.end()

    @contextmanager
    def chunk(self, ticket: int, chunk: Chunk, cases: int) -> Iterator[None]:
        """A block that gives ``cases`` of a chunk to the executor."""
        about = {traces.FIRST: chunk.first, traces.CASES: cases}
        with self.of_study(chunk.study):
            self._chunks[ticket] = begun = traces.Begun("chunk", traces.context(), about)
        with begun.current():
            yield

    def chunk_ended(self, outcome: Outcome) -> None:
        """A chunk came back."""
        if begun := self._chunks.pop(outcome.ticket, None):
            begun.end({traces.ENDED: outcome.fate.value}, "" if outcome.fate is Fate.DONE else outcome.detail)

    def spend(self, number: int, stage: Stage, seconds: float) -> None:
        """Count seconds for a stage of a study."""
        self._spent[number][stage] += seconds

    @contextmanager
    def stage(self, stage: Stage, shares: Mapping[int, int]) -> Iterator[None]:
        """Measure a block that works for several studies, for each in proportion to its share of cases."""
        began, moment, total = self._clock.monotonic(), time.time_ns(), sum(shares.values()) or 1
        try:
            yield
        finally:
            seconds = self._clock.monotonic() - began
            for number, share in shares.items():
                self.spend(number, stage, seconds * share / total)
                with self.of_study(number):
                    traces.Begun(stage.value, traces.context(), {traces.CASES: share}, moment).end()

    def keep(self) -> None:
        """Store the seconds since the last call; raises StoreFullError."""
        spent = {number: dict(stages) for number, stages in self._spent.items() if any(stages.values())}
        self._spent.clear()
        if spent:
            self._store.spent(spent)

    def close(self) -> None:
        """End every span."""
        for begun in (*self._chunks.values(), *self._studies.values()):
            begun.end()
        self._chunks.clear()
        self._studies.clear()
