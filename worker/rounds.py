"""The next round of a study that chooses its own cases: from the rows in the store to waiting chunks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from cachetools import LRUCache

from sprag_study.worker.derived import refused_value
from sprag_study.worker.planning import planner_of

if TYPE_CHECKING:
    from sprag_study.worker.planning.rounds import Planner, Step
    from sprag_study.worker.ports import Chunk, Store
    from sprag_study.worker.study import Study

#: Studies whose planners are kept, so that the rows of a round are read once.
_KEPT = 16


class PlanError(Exception):
    """The next round cannot be planned; the message states why."""


@dataclass(frozen=True, slots=True)
class Appended:
    """A study with the cases of its new round, and their chunks."""

    study: Study
    chunks: list[Chunk]


@dataclass(slots=True)
class _Kept:
    planner: Planner
    rounds: int = 0


class Rounds:
    """Plans the rounds of studies.

    A planner is only kept to save reading: one that is made anew and told all rounds asks for the same cases.
    """

    def __init__(self, store: Store) -> None:
        self._store = store
        self._planners: LRUCache[int, _Kept] = LRUCache(_KEPT)

    def advance(self, epoch: int, number: int, study: Study) -> Appended | None:
        """Append the next round of a study whose cases all have their rows, or end it where there is none.

        None where there is no new round. Raises PlanError, and EpochLostError and StoreFullError as the store does.
        """
        done = self._store.rounds_done(number)
        if done is None:
            return None
        step = self._next(number, study, done)
        if not len(step.points):
            self._store.settle(epoch, number, step.summary)
            return None
        grown = study.with_points(step.points)
        if refused := refused_value(grown, range(study.cases, grown.cases)):
            raise PlanError(f"the next round cannot be run: {refused}")
        chunks = self._store.append_round(epoch, number, grown, study.cases, step.summary)
        return None if chunks is None else Appended(grown, chunks)

    def forget(self, number: int) -> None:
        """Drop the planner of a study, whose rows may change from now on."""
        self._planners.pop(number, None)

    def _next(self, number: int, study: Study, done: list[range]) -> Step:
        if study.plan is None:
            raise PlanError("the study has no plan")
        try:
            current = self._planners.get(number)
            if current is None or current.rounds > len(done):
                current = self._planners[number] = _Kept(planner_of(study.plan))
            for cases in done[current.rounds :]:
                current.planner.tell(self._store.round_rows(number, study, cases, current.planner.results))
                current.rounds += 1
            return current.planner.ask()
        except (ArithmeticError, LookupError, MemoryError, TypeError, ValueError) as error:
            self.forget(number)
            raise PlanError(f"the next round cannot be planned: {type(error).__name__}: {error}") from error
