"""Violations that a search tolerates at first, so that it can approach thin feasible sets from both sides.

Feasible sets are thin where there are equalities of real numbers. Designs that violate nothing but these, and them by
at most epsilon, compete as if they were feasible. Epsilon starts as the violation that a fifth of the first generation
stays below, and falls to 0 within a fixed number of generations: how many the search has in all changes none of its
designs (T. Takahama, S. Sakai, "Constrained optimization by the epsilon constrained differential evolution with
gradient-based mutation and feasible elites", CEC 2006). Inequalities bound sets with an inside: they are never
tolerated.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from sprag_study.worker.planning.goals.scores import Scores

#: Share of the first generation that is below the first epsilon, the generations in which epsilon falls, and the power
#: of its fall.
_TOLERATED, _UNTIL, _FALL = 0.2, 30, 4


class Tolerance:
    """Epsilon by generation."""

    def __init__(self) -> None:
        self._first: float | None = None
        self._generation = 0

    def next(self, scores: Scores) -> float:
        """Epsilon of the next generation, whose scores are given; 0 without equalities of real numbers."""
        if self._first is None:
            finite = np.sort(scores.equalities[~scores.failed])
            place = min(int(_TOLERATED * len(scores)), len(finite) - 1)
            self._first = float(finite[place]) if len(finite) else 0.0
        left = max(0.0, 1.0 - self._generation / _UNTIL)
        self._generation += 1
        return self._first * math.prod([left] * _FALL)


def tolerant(scores: Scores, epsilon: float) -> Scores:
    """The scores of which violations of equalities of at most ``epsilon`` are taken as 0 where the goals are there."""
    good = (scores.equalities <= epsilon) & ~scores.failed & ~np.isnan(scores.goals).any(axis=1)
    others = np.maximum(scores.violation - scores.equalities, 0.0)
    # Where there is nothing else, the difference is 0 exactly: the sums are of the same terms.
    return replace(scores, violation=np.where(good, others, scores.violation))
