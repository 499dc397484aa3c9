"""What a search shows of itself while it runs, as plain JSON data."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker.planning.goals.hypervolume import MOST_GOALS, hypervolume
from sprag_study.worker.planning.goals.plan import GOAL
from sprag_study.worker.planning.goals.polish import MET
from sprag_study.worker.planning.goals.ranking import undominated
from sprag_study.worker.planning.goals.scores import misses, signs

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from sprag_study.worker.planning.goals.plan import GoalPlan
    from sprag_study.worker.planning.goals.scores import Scores

Floats = NDArray[np.float64]


def serve_derivatives(summaries: Sequence[Mapping[str, Any]]) -> list[bool]:
    """Which rounds of a search serve derivatives only, from the summaries that they were asked for with.

    Before summaries said it, that was the first round of the polish.
    """
    flags = [bool(summary.get("derivatives")) for summary in summaries]
    if not any(flags):
        polish = [place for place, summary in enumerate(summaries) if summary.get("phase") == "polish"]
        return [place in polish[:1] for place in range(len(summaries))]
    return flags


class Record:
    """Counts, best values and hypervolume, and what the polish has reached.

    The hypervolume is that of all designs of the search: survivors are spread evenly and may dominate less than before.
    The reference point of the hypervolume is the worst of each goal among the survivors of the first generation of
    which at least half are within the limits. Of fewer it would lie in a corner that later fronts do not reach, and
    the hypervolume would stay 0.
    """

    def __init__(self, plan: GoalPlan) -> None:
        self._plan = plan
        self._signs = signs(plan)
        self._counts = {"feasible": 0, "infeasible": 0, "failed": 0}
        self._generation = 0
        self._best = np.full(len(plan.best), np.nan)
        self._best_exact = self._best
        self._front = np.empty((0, len(plan.best)))
        self._volume: float | None = None
        self._reference: Floats | None = None
        self._polish: dict[str, int] | None = None
        self._finish = 0
        self._equalities = any(limit.polished for limit in plan.subject_to)

    def generation(self, new: Scores, survivors: Scores, number: int) -> None:
        """Take a generation: the scores of its new designs, and of the best so far; ``number`` of them are over."""
        self._count(new)
        self._generation = number
        goals = survivors.goals[survivors.feasible]
        if not len(goals):
            return
        self._best = goals.min(axis=0)
        if 2 <= len(self._signs) <= MOST_GOALS:
            self._front = undominated(self._front, new.goals[new.feasible])
            if self._reference is None and 2 * len(goals) >= self._plan.population:
                self._reference = goals.max(axis=0)
            if self._reference is not None:
                self._volume = hypervolume(self._front, self._reference)

    def differentiated(self, new: Scores, *, finishing: bool = False) -> None:
        """Take a round of the polish or the finish whose designs serve derivatives only: they count as no designs."""
        self._ended(new, 0, finishing)

    def polished(self, new: Scores, *, finishing: bool = False) -> None:
        """Take the new designs of a step of the polish or of the finish."""
        self._count(new)
        exact = (misses(self._plan, new.outputs) <= MET) & new.feasible
        if exact.any():
            self._best_exact = np.fmin(self._best_exact, new.goals[exact].min(axis=0))
        if finishing and new.feasible.any():
            self._best = np.fmin(self._best, new.goals[new.feasible].min(axis=0))
        self._ended(new, int(np.count_nonzero(exact)), finishing)

    def _ended(self, new: Scores, met: int, finishing: bool) -> None:
        """Count designs after the generations."""
        if finishing:
            self._finish += len(new)
        if self._equalities or not finishing:
            before = self._polish or {"designs": 0, "met": 0}
            designs = before["designs"] + (0 if finishing else len(new))
            self._polish = {"designs": designs, "met": before["met"] + met}

    def _count(self, scores: Scores) -> None:
        feasible, failed = int(np.count_nonzero(scores.feasible)), int(np.count_nonzero(scores.failed))
        self._counts["feasible"] += feasible
        self._counts["failed"] += failed
        self._counts["infeasible"] += len(scores) - feasible - failed

    def summary(self, phase: str, *, derivatives: bool = False, finishing: bool = False) -> dict[str, Any]:
        """What is known now.

        ``phase`` is "search", "polish" or "ended". ``best`` has the best value of each goal among the survivors within
        the limits, or once the polish has met the equalities, among the designs that meet them to 1e-6.
        ``hypervolume`` is what the designs dominate, up to ``reference`` (two or three goals). Goals have the units
        and signs of the results, and None where there is none. ``polish`` counts its designs, and those that meet the
        equalities to 1e-6, and ``finish`` the designs of the finish. ``derivatives``: whether the designs of the round
        to come serve derivatives only.
        """
        exact = self._polish is not None and self._polish["met"] > 0
        best = (self._best_exact if exact else self._best) * self._signs + 0.0  # no negative zero
        reference = None if self._reference is None else (self._reference * self._signs).tolist()
        return {
            "kind": GOAL,
            "phase": phase,
            "generation": self._generation,
            "generations": self._plan.generations,
            **self._counts,
            "best": [None if np.isnan(value) else value for value in best.tolist()],
            "hypervolume": self._volume,
            "reference": reference,
            "polish": None if self._polish is None else self._polish.copy(),
            **({"finish": self._finish} if finishing else {}),
            **({"derivatives": True} if derivatives else {}),
        }
