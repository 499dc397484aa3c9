"""Interfaces of the dispatcher: a store, an executor, a clock. Only values, without database or pool."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Protocol

from sprag_study.worker.errors import SpragError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from datetime import datetime
    from typing import Any

    import numpy as np
    from numpy.typing import NDArray

    from sprag_study.worker.models import ChunkResult
    from sprag_study.worker.planning.rounds import Rows
    from sprag_study.worker.reports import ExecutorReport
    from sprag_study.worker.stages import Spent, Stage
    from sprag_study.worker.states import StudyState
    from sprag_study.worker.study import Study


@dataclass(frozen=True, slots=True)
class Chunk:
    """Consecutive cases of one study, the unit of claim and commit.

    They are consecutive in the order in which the study runs: by number, or as `sprag_study.worker.order` says.
    ``study`` is the study's number in order of submission. ``failures`` counts how often these cases, as one chunk,
    crashed their process or timed out. ``unit`` is the number of cases that cannot be run apart: those of a line of a
    sweep, otherwise 1. A chunk has whole units.
    """

    study: int
    first: int
    count: int
    failures: int = 0
    unit: int = 1

    @property
    def last(self) -> int:
        """Number of the last case."""
        return self.first + self.count - 1


@dataclass(frozen=True, slots=True)
class Known:
    """Partition of a chunk's cases: those to run, and those whose rows other studies already have.

    Attributes
    ----------
    missing : int64 array
        The cases of the chunk to run, ascending.
    cases, studies, there : int64 arrays of one length
        The other cases, ascending; the number of the study that has each, and its case number there.
    """

    missing: NDArray[np.int64]
    cases: NDArray[np.int64]
    studies: NDArray[np.int64]
    there: NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Finished:
    """A chunk that was run, on ``host`` ("" where no case was run).

    With ``known`` the result covers the missing cases only; the other rows are copied.
    """

    chunk: Chunk
    result: ChunkResult
    known: Known | None = None
    host: str = ""


@dataclass(frozen=True, slots=True)
class ActiveStudy:
    """An unfinished study, as polled by the dispatcher.

    Higher ``rank`` runs first; at the same rank each ``owner`` (None: nobody) has turns, and among the studies of one
    owner higher ``priority`` runs first. ``waits_for_room`` marks a paused study that resumes when there is room,
    ``goes_on`` one that resumes by itself for any reason. No chunk starts after ``finish_by``. ``proven``: an earlier
    round of the study has results, which shows that the engine works. ``dispatcher`` is the epoch of the dispatcher to
    which it belongs, None for none; ``fingerprint`` that of its rows, "" where it has none, or rows of several.
    ``trace`` is the `sprag_study.worker.traces.context` in which it was submitted.
    """

    number: int
    id: str
    state: StudyState
    priority: int = 0
    waits_for_room: bool = False
    finish_by: datetime | None = None
    goes_on: bool = False
    proven: bool = False
    dispatcher: int | None = None
    fingerprint: str = ""
    rank: int = 0
    owner: str | None = None
    trace: str = ""


@dataclass(frozen=True, slots=True)
class Peer:
    """Another dispatcher that is at work and has usable workers: its fingerprint and its number of studies."""

    fingerprint: str
    studies: int


class StoreError(SpragError):
    """An error of the store; the message is one sentence for a user, ``code`` is its stable kind."""


class StoreFullError(StoreError):
    """The store cannot write at present: no space, or a failing disk. This may be temporary."""


class EpochLostError(StoreError):
    """Another dispatcher has taken over: this one must stop and commit nothing more."""


class ExecutorError(SpragError):
    """The executor can no longer run anything; the message is one sentence for a user."""


class KernelError(Exception):
    """The kernel of a study cannot be loaded; the message states why."""


class UnreadableStudyError(Exception):
    """The store no longer has the study that was submitted; the message states why."""


class Store(Protocol):
    """The dispatcher's view of the database. Every write is one short transaction that first checks the epoch.

    A method that takes ``epoch`` raises EpochLostError, and changes nothing, when the epoch has ended. Studies that
    belong to another dispatcher are left as they are.
    Any method may raise StoreFullError, and has changed nothing then.
    """

    def take_over(self, owner: str) -> int:
        """Begin an epoch and return it; end the dispatchers that are gone, whose claims return to waiting."""

    def end_absent(self, epoch: int) -> bool:
        """End the other dispatchers that are gone; whether there were any."""

    def peers(self, epoch: int) -> list[Peer]:
        """The other dispatchers at work."""

    def adopt(self, epoch: int, number: int) -> bool:
        """Let an unfinished study that belongs to nobody belong to this dispatcher; whether it does."""

    def leave(self, epoch: int, number: int) -> None:
        """Let a study of this dispatcher, of which nothing is in flight, belong to nobody."""

    def heartbeat(self, epoch: int, report: Mapping[str, Any]) -> None:
        """Record that the dispatcher is alive, and the `Reporter.summary` of its workers.

        A missing heartbeat raises alarms but never decides ownership.
        """

    def spent(self, spent: Mapping[int, Mapping[Stage, Spent]]) -> None:
        """Add to the stages of studies, by number, whoever they belong to."""

    def active_studies(self) -> list[ActiveStudy]:
        """Studies that have not ended, by priority and then in order of submission.

        Those held by `time_is_over` are left out.
        """

    def study_of(self, number: int) -> Study:
        """The study to compute."""

    def open_chunks(self, number: int) -> list[Chunk]:
        """Unfinished chunks of a study, in the order in which they will run."""

    def known(self, study: Study, chunk: Chunk) -> Known | None:
        """Which cases of a chunk of ``study`` must be run, and which can be copied from other studies.

        None where all must be run and they are numbered ``chunk.first`` to ``chunk.last``.
        """

    def exchange(
        self, epoch: int, finished: Sequence[Finished], wanted: Sequence[Chunk] = ()
    ) -> tuple[list[Chunk], list[Chunk]]:
        """Store finished chunks and claim waiting ones, in one transaction: the chunks stored, and those claimed.

        A finished chunk that is not claimed by us is ignored. One whose rows were to be copied from a study that is
        gone returns to waiting. Claimed are chunks of queued or running studies before their deadline.
        """

    def release(self, epoch: int) -> None:
        """End the epoch: its claims return to waiting, its studies belong to nobody."""

    def put_back(self, epoch: int, chunk: Chunk, detail: str) -> None:
        """Return a claimed chunk to waiting, with ``chunk.failures`` as its new count and what happened to it."""

    def split(self, epoch: int, chunk: Chunk, parts: Sequence[Chunk], detail: str) -> None:
        """Replace a claimed chunk by waiting parts that cover the same cases."""

    def quarantine(self, epoch: int, chunk: Chunk, ending: str, detail: str) -> None:
        """Give every case of a claimed chunk ``ending`` without results and mark the chunk done."""

    def note(self, epoch: int, number: int, reason: str | None) -> None:
        """Record why a queued or running study does not proceed; None removes the reason."""

    def fault(self, epoch: int, number: int, reason: str) -> None:
        """Hold the study with a reason and return its claims to waiting."""

    def time_is_over(self, epoch: int, number: int) -> None:
        """Hold a study that is queued, running or would resume by itself at its deadline; no chunk is in flight."""

    def begin_again(self, epoch: int, number: int) -> None:
        """Return every claim of this epoch to waiting, and reset the failures of the study's chunks."""

    def shortage(self) -> str | None:
        """Why there is no room for more rows, as a sentence; None where there is room."""

    def hold(self, epoch: int, reason: str, *, returned: bool) -> None:
        """Pause every study of this dispatcher or of none that is queued or running, with the reason, until `let_go`.

        With ``returned`` every claim of this epoch goes back to waiting, too.
        """

    def let_go(self, epoch: int) -> None:
        """Queue again every study that `hold` paused and nobody has changed since."""

    def settle(self, epoch: int, number: int, summary: Mapping[str, Any] | None = None) -> StudyState:
        """End a study without open claims: as cancelled when that was requested, otherwise as finished or failed.

        A study with rounds ends by itself only with the ``summary`` of them; without one its state stays.
        """

    def rounds_done(self, number: int) -> list[range] | None:
        """The cases of every round of a study that needs its next one; None where it needs none now.

        It needs one when it is queued or running, chooses its own cases, and all its cases have their rows.
        """

    def round_rows(self, number: int, study: Study, cases: range, results: Sequence[str]) -> Rows:
        """The rows of one round."""

    def append_round(
        self, epoch: int, number: int, study: Study, first: int, summary: Mapping[str, Any]
    ) -> list[Chunk] | None:
        """Give a study its next round: the cases of ``study`` from number ``first`` on, as waiting chunks.

        ``summary`` is what the rows before them show. None, and no change, where the study does not need that round:
        it was held, cancelled or deleted, or it has the round already.
        """


class Fate(StrEnum):
    """Outcome of the run of a chunk."""

    DONE = "done"
    CRASHED = "crashed"
    TIMED_OUT = "timed_out"
    STOPPED = "stopped"


@dataclass(frozen=True, slots=True)
class Outcome:
    """The end of one submitted chunk.

    ``result`` and the ``host`` that computed it are given when the fate is DONE; otherwise ``detail`` explains it.
    ``seconds`` is how long a worker had it, in elapsed time; 0 where none took it.
    """

    ticket: int
    fate: Fate
    result: ChunkResult | None = None
    detail: str = ""
    host: str = ""
    seconds: float = 0.0


class Executor(Protocol):
    """Runs chunks somewhere. One outcome for every ticket, in any order."""

    @property
    def capacity(self) -> int:
        """Useful number of chunks in flight."""

    @property
    def shortage(self) -> str | None:
        """Why nothing can be run at present, as a sentence; None where chunks can run or the cause is short-lived."""

    def ready(self, study: Study) -> bool:
        """Whether the kernel of ``study`` is loaded; otherwise starts loading it and returns immediately.

        Raises KernelError when it could not be compiled; the next call tries again.
        """

    def submit(self, ticket: int, study: Study, chunk: Chunk) -> None:
        """Start a chunk of a study that is `ready`; returns at once."""

    def wait(self, timeout: float) -> list[Outcome]:
        """Available outcomes; waits at most ``timeout`` s for the first, and returns [] when there is none."""

    def stop(self, ticket: int) -> None:
        """Stop a chunk, running or not; its outcome is STOPPED unless it has just finished."""

    def at_work(self) -> Mapping[int, float]:
        """How long workers have had the chunks that are not back yet, in s by ticket, without those in a queue."""

    def report(self) -> ExecutorReport:
        """The workers as they are now; asks nobody."""

    def close(self) -> None:
        """Stop everything and end all processes."""


class News(Protocol):
    """Notifications of changes in the store by any process."""

    def wait(self, timeout: float) -> bool:
        """Whether something has or may have changed since the last call; waits at most ``timeout`` s."""

    def close(self) -> None:
        """Stop listening."""


class Clock(Protocol):
    """Source of time, replaced in tests."""

    def now(self) -> datetime:
        """The current time, aware, UTC."""

    def monotonic(self) -> float:
        """Seconds on a clock that never goes back."""
