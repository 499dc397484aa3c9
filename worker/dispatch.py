"""Decisions of the dispatcher, without I/O: events in, instructions out.

A chunk whose process dies or times out is run once more, then split until the faulty case is found. A case that fails
alone twice is quarantined: it gets its ending and is not run again; so is a line of a sweep, whose cases cannot be run
apart. A crashed case is quarantined only when a success
or the end of the study shows that the engine works.

Three chunks without a common case that crash with no success of the study between them indicate a fault of the engine,
not of the cases; so do cases that crash alone when no chunk of the study ever succeeded. The first time, everything
restarts with newly compiled kernels, because the cached ones may be damaged; the second time, the study is held with
the reason. No case is quarantined then. Overlapping chunks count once, because one bad case explains the crash of every
chunk that contains it.
"""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING, assert_never

from sprag_study.sentences import Sentence
from sprag_study.worker.models import WorkerEnding
from sprag_study.worker.ports import Chunk, Fate

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

#: Number of parts of a split chunk. A failure costs the start of a process, a part almost nothing.
PARTS = 8
#: Failures after which a chunk is split, or quarantined if it is a single case.
MAX_FAILURES = 2
#: Successive crashes of chunks without a common case that indicate an engine fault.
FAULT_CRASHES = 3


@dataclass(frozen=True, slots=True)
class Offered:
    """A study may run; ``chunks`` are its unfinished ones.

    Studies of higher ``rank`` run first; at the same rank the owners take turns, and of the studies of one ``owner``
    those of higher ``priority`` run first. For an active study, this only ends a pause and updates rank and priority.
    ``proven``: an earlier round of the study has results.
    """

    study: int
    chunks: Sequence[Chunk] = ()
    priority: int = 0
    proven: bool = False
    rank: int = 0
    owner: str | None = None


@dataclass(frozen=True, slots=True)
class Paused:
    """Start no new chunks of the study; those in flight continue."""

    study: int


@dataclass(frozen=True, slots=True)
class Cancelled:
    """The study must end now."""

    study: int


@dataclass(frozen=True, slots=True)
class Refused:
    """The store refused the claim of a chunk, so it was not started; the next poll shows why."""

    ticket: int


@dataclass(frozen=True, slots=True)
class Ended:
    """A chunk in flight ended."""

    ticket: int
    fate: Fate
    detail: str = ""


@dataclass(frozen=True, slots=True)
class Broken:
    """The kernel of a study cannot be loaded."""

    study: int
    reason: str


@dataclass(frozen=True, slots=True)
class Lost:
    """The chunks in flight are useless because the store cannot accept them. Every study must be offered again."""


Event = Offered | Paused | Cancelled | Refused | Ended | Broken | Lost


@dataclass(frozen=True, slots=True)
class Run:
    """Claim the chunk and start it."""

    ticket: int
    chunk: Chunk


@dataclass(frozen=True, slots=True)
class Commit:
    """Store the rows of the finished chunk."""

    ticket: int
    chunk: Chunk


@dataclass(frozen=True, slots=True)
class PutBack:
    """Return the chunk to waiting with its new count of failures."""

    chunk: Chunk
    detail: str


@dataclass(frozen=True, slots=True)
class Split:
    """Replace the chunk by its parts."""

    chunk: Chunk
    parts: tuple[Chunk, ...]
    detail: str


@dataclass(frozen=True, slots=True)
class Quarantine:
    """Give the chunk's single case, or the cases of its single line, that ending and do not run them again."""

    chunk: Chunk
    ending: WorkerEnding
    detail: str


@dataclass(frozen=True, slots=True)
class Stop:
    """Stop a chunk in flight; its outcome is ignored unless it has just finished."""

    ticket: int


@dataclass(frozen=True, slots=True)
class Fault:
    """Hold the study with the reason and return its claims."""

    study: int
    reason: str


@dataclass(frozen=True, slots=True)
class Renew:
    """Restart with new processes and newly compiled kernels; every study must be offered again.

    It is caused by ``study``, whose failures are then reset, and occurs once per study before its `Fault`.
    """

    study: int
    reason: str


@dataclass(frozen=True, slots=True)
class Settle:
    """No chunk of the study is waiting or in flight: end it."""

    study: int


Instruction = Run | Commit | PutBack | Split | Quarantine | Stop | Fault | Renew | Settle


@dataclass(slots=True)
class _Open:
    """An active study."""

    waiting: deque[Chunk]
    priority: int = 0
    rank: int = 0
    owner: str | None = None
    running: dict[int, Chunk] = field(default_factory=dict)
    held: bool = False
    cancelled: bool = False
    #: Whether any of its chunks succeeded, which shows that the engine works.
    proven: bool = False
    crashed: list[Chunk] = field(default_factory=list)
    #: Cases to be quarantined as crashed once a success, or the end of the study, shows that the engine works.
    suspects: list[Quarantine] = field(default_factory=list)


def disjoint(chunks: Iterable[Chunk]) -> int:
    """Largest number of chunks of one study that pairwise share no case."""
    count, end = 0, -1
    for chunk in sorted(chunks, key=lambda chunk: chunk.last):
        if chunk.first > end:
            count, end = count + 1, chunk.last
    return count


def pieces(chunk: Chunk) -> tuple[Chunk, ...]:
    """The chunk in parts of nearly equal size, of whole units. Parts with several units are split at their next
    failure; a single one may fail twice.
    """
    units = chunk.count // chunk.unit
    count = min(PARTS, units)
    edges = [units * k // count * chunk.unit for k in range(count + 1)]
    return tuple(
        replace(chunk, first=chunk.first + a, count=b - a, failures=0 if b - a == chunk.unit else MAX_FAILURES - 1)
        for a, b in pairwise(edges)
    )


class Dispatch:
    """The state machine. At most ``capacity`` chunks are in flight; each `Run` is answered by one Refused or Ended."""

    def __init__(self, capacity: int) -> None:
        self.capacity = capacity
        self._open: dict[int, _Open] = {}
        self._study_of: dict[int, int] = {}
        self._next_ticket = 1
        #: Studies that have caused a restart.
        self._renewed: set[int] = set()
        #: By owner: ticket of the latest chunk that was started.
        self._turns: dict[str | None, int] = {}

    @property
    def in_flight(self) -> int:
        """Number of chunks that were started and have not ended."""
        return len(self._study_of)

    @property
    def studies(self) -> frozenset[int]:
        """Numbers of the active studies."""
        return frozenset(self._open)

    def handle(self, event: Event) -> list[Instruction]:
        """Process one event; returns the instructions in order. Events about unknown studies or chunks are ignored."""
        found: list[Instruction]
        match event:
            case Offered():
                found = self._offered(event)
            case Paused():
                found = self._paused(event)
            case Cancelled():
                found = self._cancelled(event)
            case Refused():
                found = self._refused(event)
            case Ended():
                found = self._ended(event)
            case Broken():
                found = self._fault(event.study, event.reason)
            case Lost():
                found = self._drop_all()
            case _:
                assert_never(event)
        return found + self._fill()

    def _offered(self, event: Offered) -> list[Instruction]:
        known = self._open.get(event.study)
        if known is None:
            known = self._open[event.study] = _Open(deque(event.chunks), proven=event.proven)
        known.held = False
        known.priority, known.rank, known.owner = event.priority, event.rank, event.owner
        return self._settled(event.study, known)

    def _paused(self, event: Paused) -> list[Instruction]:
        known = self._open.get(event.study)
        if known is None:
            return []
        known.held = True
        return self._settled(event.study, known)

    def _cancelled(self, event: Cancelled) -> list[Instruction]:
        known = self._open.setdefault(event.study, _Open(deque()))
        if known.cancelled:
            return []
        known.cancelled = True
        known.waiting.clear()
        stops: list[Instruction] = [Stop(ticket) for ticket in known.running]
        return stops + self._settled(event.study, known)

    def _refused(self, event: Refused) -> list[Instruction]:
        taken = self._take(event.ticket)
        if taken is None:
            return []
        number, known, chunk = taken
        known.held = True
        if not known.cancelled:
            known.waiting.appendleft(chunk)
        return self._settled(number, known)

    def _ended(self, event: Ended) -> list[Instruction]:
        taken = self._take(event.ticket)
        if taken is None:
            return []
        number, known, chunk = taken
        found: list[Instruction]
        if event.fate is Fate.DONE:
            known.crashed.clear()
            known.proven = True
            found = [Commit(event.ticket, chunk), *known.suspects]
            known.suspects.clear()
        elif known.cancelled:
            found = []
        elif event.fate is Fate.STOPPED:
            known.waiting.appendleft(chunk)
            found = [PutBack(chunk, event.detail)]
        else:
            found = self._failed(number, known, chunk, event)
            if number not in self._open:
                return found
        return found + self._settled(number, known)

    def _failed(self, number: int, known: _Open, chunk: Chunk, event: Ended) -> list[Instruction]:
        crashed = event.fate is Fate.CRASHED
        if crashed:
            known.crashed.append(chunk)
            if disjoint(known.crashed) >= FAULT_CRASHES:
                reason = (
                    Sentence(
                        "engine fault: {count} different chunks crashed with no success between them ({detail})",
                        count=FAULT_CRASHES,
                        detail=event.detail,
                    )
                    if event.detail
                    else Sentence(
                        "engine fault: {count} different chunks crashed with no success between them",
                        count=FAULT_CRASHES,
                    )
                )
                return self._fault(number, reason)
        failed = replace(chunk, failures=chunk.failures + 1)
        if failed.failures < MAX_FAILURES:
            known.waiting.appendleft(failed)
            return [PutBack(failed, event.detail)]
        if chunk.count == chunk.unit and crashed:
            known.suspects.append(Quarantine(chunk, WorkerEnding.CRASHED, event.detail))
            return []
        if chunk.count == chunk.unit:
            return [Quarantine(chunk, WorkerEnding.TIMED_OUT, event.detail)]
        parts = pieces(chunk)
        known.waiting.extendleft(reversed(parts))
        return [Split(chunk, parts, event.detail)]

    def _fault(self, number: int, reason: str) -> list[Instruction]:
        """The engine is at fault, not the cases: restart, or hold the study the second time."""
        if number not in self._renewed:
            self._renewed.add(number)
            return [*self._drop_all(), Renew(number, reason)]
        self._renewed.remove(number)
        known = self._open.pop(number, None)
        stops: list[Instruction] = [] if known is None else [Stop(ticket) for ticket in known.running]
        return [*stops, Fault(number, reason)]

    def _drop_all(self) -> list[Instruction]:
        stops: list[Instruction] = [Stop(ticket) for ticket in self._study_of]
        self._open.clear()
        self._study_of.clear()
        return stops

    def _take(self, ticket: int) -> tuple[int, _Open, Chunk] | None:
        """Remove a ticket from flight; None when its study is no longer active."""
        number = self._study_of.pop(ticket, None)
        known = None if number is None else self._open.get(number)
        chunk = None if known is None else known.running.pop(ticket, None)
        return None if number is None or known is None or chunk is None else (number, known, chunk)

    def _settled(self, number: int, known: _Open) -> list[Instruction]:
        """Release a study without chunks in flight: for good if none is waiting, or until it is offered again
        if held.
        """
        if known.running or (known.waiting and not known.held):
            return []
        if known.suspects and not (known.waiting or known.cancelled or known.proven) and number not in self._renewed:
            return self._fault(number, f"engine fault: no case came through ({known.suspects[-1].detail})")
        del self._open[number]
        if known.waiting:
            return [PutBack(suspect.chunk, suspect.detail) for suspect in known.suspects]
        self._renewed.discard(number)
        quarantined = [] if known.cancelled else known.suspects
        return [*quarantined, Settle(number)]

    def _fill(self) -> list[Instruction]:
        """Start waiting chunks while there is capacity.

        Order: highest rank; then the owner with the fewest chunks in flight, and of several the one whose latest chunk
        was started first, so that owners have equal shares however many studies they have; then, among the studies of
        this owner, highest priority, fewest chunks of the study in flight, oldest study.
        """
        found: list[Instruction] = []
        while len(self._study_of) < self.capacity:
            at_work = Counter[str | None]()
            for known in self._open.values():
                at_work[known.owner] += len(known.running)
            ready = [
                (-known.rank, at_work[known.owner], self._turns.get(known.owner, 0), -known.priority,
                 len(known.running), number)
                for number, known in self._open.items()
                if known.waiting and not known.held
            ]  # fmt: skip
            if not ready:
                break
            number = min(ready)[-1]
            known = self._open[number]
            ticket, self._next_ticket = self._next_ticket, self._next_ticket + 1
            chunk = known.waiting.popleft()
            known.running[ticket] = chunk
            self._study_of[ticket] = number
            self._turns[known.owner] = ticket
            found.append(Run(ticket, chunk))
        return found
