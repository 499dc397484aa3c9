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
    from sprag_study.worker.planning.goals.plan import GoalPlan
    from sprag_study.worker.planning.goals.scores import Scores

Floats = NDArray[np.float64]


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

    def generation(self, new: Scores, survivors: Scores) -> None:
        """Take a generation: the scores of its new designs, and of the best so far."""
        self._count(new)
        self._generation += 1
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

    def differentiated(self, new: Scores) -> None:
        """Take the round of the polish whose designs serve derivatives only: they count as no designs of their own."""
        before = self._polish or {"designs": 0, "met": 0}
        self._polish = {**before, "designs": before["designs"] + len(new)}

    def polished(self, new: Scores) -> None:
        """Take the new designs of a step of the polish."""
        self._count(new)
        before = self._polish or {"designs": 0, "met": 0}
        exact = (misses(self._plan, new.outputs) <= MET) & new.feasible
        if exact.any():
            self._best_exact = np.fmin(self._best_exact, new.goals[exact].min(axis=0))
        met = int(np.count_nonzero(exact))
        self._polish = {"designs": before["designs"] + len(new), "met": before["met"] + met}

    def _count(self, scores: Scores) -> None:
        feasible, failed = int(np.count_nonzero(scores.feasible)), int(np.count_nonzero(scores.failed))
        self._counts["feasible"] += feasible
        self._counts["failed"] += failed
        self._counts["infeasible"] += len(scores) - feasible - failed

    def summary(self, phase: str) -> dict[str, Any]:
        """What is known now.

        ``phase`` is "search", "polish" or "ended". ``best`` has the best value of each goal among the survivors within
        the limits, or once the polish has met the equalities, among the designs that meet them to 1e-6.
        ``hypervolume`` is what the designs dominate, up to ``reference`` (two or three goals). Goals have the units
        and signs of the results, and None where there is none. ``polish`` counts its designs, and those that meet the
        equalities to 1e-6.
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
        }
