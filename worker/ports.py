"""What the dispatcher needs from the world: a store, an executor, a clock. Values only; no database, no pool."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, ClassVar, Protocol

if TYPE_CHECKING:
    from collections.abc import Sequence
    from datetime import datetime

    import numpy as np
    from numpy.typing import NDArray

    from sprag.worker.models import ChunkResult
    from sprag.worker.states import StudyState
    from sprag.worker.study import Study


@dataclass(frozen=True, slots=True)
class Chunk:
    """Consecutive cases of one study, the unit of claim and commit.

    They are consecutive in the order in which the study is run: by their numbers, or coarse to fine
    (`sprag.worker.order`).
    ``study`` is the study's number in order of submission. ``failures`` counts how often these cases, as one chunk,
    took their process down or ran out of time.
    """

    study: int
    first: int
    count: int
    failures: int = 0

    @property
    def last(self) -> int:
        """Number of the last case."""
        return self.first + self.count - 1


@dataclass(frozen=True, slots=True)
class Known:
    """What is known of the cases of a chunk: which have to be run, and whose rows other studies have already.

    Attributes
    ----------
    missing : int64 array
        The cases of the chunk that have to be run, ascending.
    cases, studies, there : int64 arrays of one length
        The others, ascending; the number of the study that has each, and its case there.
    """

    missing: NDArray[np.int64]
    cases: NDArray[np.int64]
    studies: NDArray[np.int64]
    there: NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class ActiveStudy:
    """A study that has not come to its end, as the dispatcher's poll sees it.

    Higher ``priority`` goes first. ``waits_for_room`` tells a paused study that goes on when there is room, ``goes_on``
    one that goes on by itself for whatever it waits. No chunk is to be started after ``finish_by``.
    """

    number: int
    id: str
    state: StudyState
    priority: int = 0
    waits_for_room: bool = False
    finish_by: datetime | None = None
    goes_on: bool = False


class StoreError(Exception):
    """The store refuses; the message is one plain sentence for a user, ``code`` says the kind and is stable."""

    code: str = "unavailable"


class StoreFullError(StoreError):
    """The store takes nothing more at present: no room, or its disk fails. It may be over later."""


class EpochLostError(StoreError):
    """Another dispatcher has taken over: this one must give up by itself and commit nothing more."""


class ExecutorError(Exception):
    """The executor cannot run anything any more; the message is one plain sentence for a user."""

    code: ClassVar[str] = "unavailable"


class KernelError(Exception):
    """The kernel of a study cannot be had; the message says why."""


class Store(Protocol):
    """The dispatcher's side of the database. Every write is one short transaction that first checks the epoch.

    A method that takes ``epoch`` raises EpochLostError, and changes nothing, when the epoch is no longer the latest.
    Any method may raise StoreFullError, and has changed nothing then.
    """

    def take_over(self, owner: str) -> int:
        """Raise the epoch, return every claim of an older one to waiting, and give the new epoch."""

    def heartbeat(self, epoch: int) -> None:
        """Note that the dispatcher is alive. Raises alarms when missing, never decides ownership."""

    def active_studies(self) -> list[ActiveStudy]:
        """Studies that have not ended, those of the highest priority first, then in order of submission.

        Without those that `time_is_over` held.
        """

    def study_of(self, number: int) -> Study:
        """The study to compute."""

    def open_chunks(self, number: int) -> list[Chunk]:
        """Chunks of a study that are not done, in the order in which they are to be run."""

    def claim(self, epoch: int, chunks: Sequence[Chunk]) -> list[Chunk]:
        """Claim waiting chunks of studies that are queued or running and in time; gives those that were got."""

    def known(self, study: Study, chunk: Chunk) -> Known | None:
        """Which cases of a chunk of ``study`` have to be run, and which others have.

        None where all have to be and they are those numbered ``chunk.first`` to ``chunk.last``.
        """

    def commit(self, epoch: int, chunk: Chunk, result: ChunkResult, known: Known | None = None) -> bool:
        """Insert the rows of a claimed chunk and mark it done. False, and no change, when it is not claimed by us.

        With ``known`` the result is that of the missing cases only, and the other rows are copied; where one of them is
        gone, the chunk is returned to waiting instead (False).
        """

    def release(self, epoch: int) -> None:
        """Return every claim of this epoch to waiting: the dispatcher ends."""

    def put_back(self, epoch: int, chunk: Chunk, detail: str) -> None:
        """Return a claimed chunk to waiting, with ``chunk.failures`` as its new count and what happened to it."""

    def split(self, epoch: int, chunk: Chunk, parts: Sequence[Chunk], detail: str) -> None:
        """Replace a claimed chunk by waiting parts that cover the same cases."""

    def quarantine(self, epoch: int, chunk: Chunk, ending: str, detail: str) -> None:
        """Give every case of a claimed chunk ``ending`` without results and mark the chunk done."""

    def note(self, epoch: int, number: int, reason: str | None) -> None:
        """Say why a queued or running study does not go on; None takes the note away."""

    def fault(self, epoch: int, number: int, reason: str) -> None:
        """Hold the study with a reason and return its claims to waiting."""

    def time_is_over(self, epoch: int, number: int) -> None:
        """Hold a study that is queued, running or would go on by itself, at its deadline; nothing is in flight."""

    def begin_again(self, epoch: int, number: int) -> None:
        """Return every claim of this epoch to waiting, and take all blame from the study's chunks."""

    def shortage(self) -> str | None:
        """Why there is no room for more rows, as a sentence; None where there is."""

    def hold(self, epoch: int, reason: str, *, returned: bool) -> None:
        """Pause every study that is queued or running, with the reason, until `let_go`.

        With ``returned`` every claim of this epoch goes back to waiting, too.
        """

    def let_go(self, epoch: int) -> None:
        """Queue again every study that `hold` paused and nobody has touched since."""

    def settle(self, epoch: int, number: int) -> StudyState:
        """Bring a study without open claims to its end: cancelled when that was asked for, else finished or failed."""


class Fate(StrEnum):
    """How the run of a chunk came out."""

    DONE = "done"
    CRASHED = "crashed"
    TIMED_OUT = "timed_out"
    STOPPED = "stopped"


@dataclass(frozen=True, slots=True)
class Outcome:
    """The end of one submitted chunk; ``result`` is there when the fate is DONE, else ``detail`` says what happened."""

    ticket: int
    fate: Fate
    result: ChunkResult | None = None
    detail: str = ""


class Executor(Protocol):
    """Runs chunks somewhere. One outcome for every ticket, in any order."""

    @property
    def capacity(self) -> int:
        """Number of chunks worth having in flight at once."""

    @property
    def shortage(self) -> str | None:
        """Why nothing can be run at present, as a sentence; None where chunks can be, or where it will not last."""

    def ready(self, study: Study) -> bool:
        """Whether the kernel of ``study`` is loaded; begins to load it where it is not, and returns at once.

        Raises KernelError when it could not be compiled; the next call tries again.
        """

    def submit(self, ticket: int, study: Study, chunk: Chunk) -> None:
        """Start a chunk of a study that is `ready`; returns at once."""

    def wait(self, timeout: float) -> list[Outcome]:
        """Outcomes that have come in; waits for the first at most ``timeout`` s, gives [] when none came."""

    def stop(self, ticket: int) -> None:
        """Stop a chunk, running or not; its outcome is STOPPED unless it was just through."""

    def close(self) -> None:
        """Stop everything and leave no process behind."""


class News(Protocol):
    """Tells of changes in the store as soon as they are made, wherever that is."""

    def wait(self, timeout: float) -> bool:
        """Whether something has changed since the last call, or may have; waits for it at most ``timeout`` s."""

    def close(self) -> None:
        """Stop listening."""


class Clock(Protocol):
    """Time, so that tests can hold it still."""

    def now(self) -> datetime:
        """The present moment, aware, UTC."""

    def monotonic(self) -> float:
        """Seconds on a clock that never goes back."""
