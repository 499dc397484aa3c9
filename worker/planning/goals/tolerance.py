"""Violations that a search tolerates at first, so that it can approach thin feasible sets from both sides.

Designs whose violation is at most epsilon compete as if they were feasible. Epsilon starts as the violation that a
fifth of the first generation stays below, and falls to 0 (T. Takahama, S. Sakai, "Constrained optimization by
the epsilon constrained differential evolution with gradient-based mutation and feasible elites", CEC 2006).
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from sprag.worker.planning.goals.scores import Scores

#: Share of the first generation that is below the first epsilon; share of the generations in which epsilon falls, and
#: the power of its fall.
_TOLERATED, _UNTIL, _FALL = 0.2, 0.5, 4


class Tolerance:
    """Epsilon by generation."""

    def __init__(self, generations: int) -> None:
        self._until = max(1.0, _UNTIL * generations)
        self._first: float | None = None
        self._generation = 0

    def next(self, scores: Scores) -> float:
        """Epsilon of the next generation, whose scores are given."""
        if self._first is None:
            finite = np.sort(scores.violation[~scores.failed])
            place = min(int(_TOLERATED * len(scores)), len(finite) - 1)
            self._first = float(finite[place]) if len(finite) else 0.0
        left = max(0.0, 1.0 - self._generation / self._until)
        self._generation += 1
        return self._first * math.prod([left] * _FALL)


def tolerant(scores: Scores, epsilon: float) -> Scores:
    """The scores with violations of at most ``epsilon`` taken as 0 where the goals are there."""
    good = (scores.violation <= epsilon) & ~np.isnan(scores.goals).any(axis=1)
    return replace(scores, violation=np.where(good, 0.0, scores.violation))
