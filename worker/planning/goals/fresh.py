"""The end of a search about drives: its best designs are run with fresh drives, which it has not seen.

A search takes the design that is best over its drives, and so partly the one that fits these drives best: over them its
yield is too high, and its quantiles lie too far on the good side (the optimizer's curse: J. E. Smith, R. L. Winkler,
Management Science 52 (2006) 311-322). Drives that took no part in the choice show what the design is worth without that
bias (W.-K. Mak, D. P. Morton, R. K. Wood, Operations Research Letters 24 (1999) 47-56).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.worker.planning.goals.polish import MET
from sprag_study.worker.planning.goals.ranking import ranks
from sprag_study.worker.planning.goals.scores import judge

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.worker.planning.goals.plan import GoalPlan

#: The phase of a round of fresh drives.
FRESH: Final = "fresh"


def most_fresh(plan: GoalPlan) -> int:
    """How many designs are run with fresh drives at most."""
    exact = any(limit.polished for limit in plan.subject_to)
    return max(len(plan.best), 1) * (1 + exact) if plan.fresh else 0


def best_places(plan: GoalPlan, outputs: NDArray[np.float64]) -> NDArray[np.int64]:
    """Which designs are the best, ascending, each once; none where all have failed.

    Of the first front it is the best in each goal, the earlier one where two are equal; without a goal the first one.
    Where equalities are met to 1e-6, the best ones of these designs are among them, too.

    Parameters
    ----------
    plan : GoalPlan
    outputs : array, shape (designs, outputs)
        As of ``scores.outputs_of``.
    """
    places: set[int] = set()
    for equality in (None, MET) if any(limit.polished for limit in plan.subject_to) else (None,):
        scores = judge(plan, outputs, equality=equality)
        first = np.flatnonzero((ranks(scores) == 0) & ~scores.failed)
        if not len(first) or (equality is not None and not scores.feasible.any()):
            continue
        goals = scores.goals[first] if plan.best else np.zeros((len(first), 1))
        goals = np.where(np.isnan(goals), np.inf, goals)
        places.update(first[goals.argmin(axis=0)].tolist())
    return np.array(sorted(places), dtype=np.int64)
