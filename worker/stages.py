"""Stages of studies: what takes how long. The dispatcher measures those that no time in the store shows."""

from __future__ import annotations

import time
from collections import defaultdict
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from datetime import timedelta
from enum import StrEnum
from typing import TYPE_CHECKING, Final, TypeAlias

from sprag_study.worker import traces
from sprag_study.worker.ports import Fate

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from contextlib import AbstractContextManager
    from datetime import datetime

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


@dataclass(frozen=True, slots=True)
class Spent:
    """The ``seconds`` of a stage, in one or several parts between two times."""

    seconds: float
    begin: datetime
    end: datetime

    def __add__(self, other: Spent) -> Spent:
        return Spent(self.seconds + other.seconds, min(self.begin, other.begin), max(self.end, other.end))


#: Begin and end, in s.
Interval: TypeAlias = tuple[float, float]
#: A moment of a study belongs to the first of these stages that it is in.
_PRECEDENCE: Final = (Stage.WRITING, Stage.PLANNING, Stage.COMPUTING, Stage.COMPILING)


def apart(intervals: Mapping[Stage, Iterable[Interval]], begin: float, end: float) -> dict[Stage, list[Interval]]:
    """The intervals of stages from ``begin`` to ``end``, ascending and cut so that none overlaps another.

    Of stages at the same time WRITING counts first, then PLANNING, COMPUTING and COMPILING.
    """
    taken: list[Interval] = []
    parts = {}
    for stage in _PRECEDENCE:
        clipped = ((max(first, begin), min(last, end)) for first, last in intervals.get(stage, ()))
        if left := _outside(_union(clipped), taken):
            parts[stage] = left
            taken = _union((*taken, *left))
    return parts


def _union(intervals: Iterable[Interval]) -> list[Interval]:
    union: list[Interval] = []
    for begin, end in sorted(interval for interval in intervals if interval[0] < interval[1]):
        if union and begin <= union[-1][1]:
            union[-1] = union[-1][0], max(union[-1][1], end)
        else:
            union.append((begin, end))
    return union


def _outside(intervals: Iterable[Interval], taken: Iterable[Interval]) -> list[Interval]:
    """What of the intervals lies outside of those that are ``taken``, which are ascending and disjoint."""
    outside = []
    for begin, end in intervals:
        for first, last in taken:
            if begin < last and first < end:
                outside.append((begin, first))
                begin = last  # noqa: PLW2901 - the rest of the interval
        outside.append((begin, end))
    return [interval for interval in outside if interval[0] < interval[1]]


class Stages:
    """The stages of the studies of a dispatcher: their seconds, for the store, and their spans, where traces are on."""

    def __init__(self, store: Store, clock: Clock) -> None:
        self._store = store
        self._clock = clock
        #: What is to be stored, by study.
        self._spent: dict[int, dict[Stage, Spent]] = defaultdict(dict)
        #: Intervals of the stages of studies that ended after `_counted`, and since when others go on; all on the
        #: monotonic clock.
        self._intervals: dict[int, dict[Stage, list[Interval]]] = defaultdict(lambda: defaultdict(list))
        self._since: dict[tuple[int, Stage], float] = {}
        self._counted = clock.monotonic()
        #: The spans of studies by number; studies and spans of chunks in flight by ticket.
        self._studies: dict[int, traces.Begun] = {}
        self._chunks: dict[int, tuple[int, traces.Begun]] = {}

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
            begun = traces.Begun("chunk", traces.context(), about)
        self._chunks[ticket] = chunk.study, begun
        with begun.current():
            yield

    def chunk_ended(self, outcome: Outcome) -> None:
        """A chunk came back, done or not."""
        if outcome.ticket not in self._chunks:
            return
        number, begun = self._chunks.pop(outcome.ticket)
        now = self._clock.monotonic()
        self._intervals[number][Stage.COMPUTING].append((now - outcome.seconds, now))
        begun.end({traces.ENDED: outcome.fate.value}, "" if outcome.fate is Fate.DONE else outcome.detail)

    def begin(self, number: int, stage: Stage) -> None:
        """A study is in a stage from now on, if it was not."""
        self._since.setdefault((number, stage), self._clock.monotonic())

    def end(self, number: int, stage: Stage) -> None:
        """A study is no longer in a stage, if it was."""
        if (began := self._since.pop((number, stage), None)) is not None:
            self._intervals[number][stage].append((began, self._clock.monotonic()))

    @contextmanager
    def stage(self, stage: Stage, shares: Mapping[int, int]) -> Iterator[None]:
        """Measure a block that works for several studies, for each in proportion to its share of cases."""
        began, moment, total = self._clock.monotonic(), time.time_ns(), sum(shares.values()) or 1
        try:
            yield
        finally:
            seconds = self._clock.monotonic() - began
            for number, share in shares.items():
                self._intervals[number][stage].append((began, began + seconds * share / total))
                with self.of_study(number):
                    traces.Begun(stage.value, traces.context(), {traces.CASES: share}, moment).end()

    def count(self, at_work: Mapping[int, float]) -> None:
        """Count the time since the last call; ``at_work``: s for which workers have had chunks so far, by ticket."""
        now, today = self._clock.monotonic(), self._clock.now()
        for ticket, seconds in at_work.items():
            if ticket in self._chunks:
                self._intervals[self._chunks[ticket][0]][Stage.COMPUTING].append((now - seconds, now))
        for (number, stage), began in self._since.items():
            self._intervals[number][stage].append((began, now))
        for number, intervals in self._intervals.items():
            for stage, parts in apart(intervals, self._counted, now).items():
                begin, end = (today - timedelta(seconds=now - at) for at in (parts[0][0], parts[-1][1]))
                spent = Spent(sum(last - first for first, last in parts), begin, end)
                earlier = self._spent[number].get(stage)
                self._spent[number][stage] = spent if earlier is None else earlier + spent
        self._intervals.clear()
        self._counted = now

    def keep(self, at_work: Mapping[int, float]) -> None:
        """Count as `count` does, and store what is not stored yet; raises StoreFullError, and keeps it then."""
        self.count(at_work)
        if self._spent:
            self._store.spent(self._spent)
            self._spent.clear()

    def close(self) -> None:
        """End every span."""
        for begun in (*(begun for _, begun in self._chunks.values()), *self._studies.values()):
            begun.end()
        self._chunks.clear()
        self._studies.clear()
