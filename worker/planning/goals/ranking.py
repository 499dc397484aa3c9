"""Ranks of designs: fronts of domination with Deb's rules for limits, and crowding.

Source: K. Deb, A. Pratap, S. Agarwal, T. Meyarivan, "A fast and elitist multiobjective genetic algorithm: NSGA-II",
IEEE Transactions on Evolutionary Computation 6 (2002) 182-197. Fronts of two goals come from one sorted pass, those of
more by efficient non-dominated sorting (X. Zhang et al., IEEE Transactions on Evolutionary Computation 19 (2015)).
"""

from __future__ import annotations

from bisect import bisect_right
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from sprag_study.worker.planning.goals.scores import Scores

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def fronts(goals: Floats) -> Ints:
    """Front of each design: 0 where none dominates it, and so on.

    Parameters
    ----------
    goals : array, shape (designs, goals)
        All to be minimised, none NaN.

    Returns
    -------
    int64 array, shape (designs,)
    """
    count = goals.shape[1]
    if count == 0 or not len(goals):
        return np.zeros(len(goals), dtype=np.int64)
    if count == 1:
        return np.unique(goals[:, 0], return_inverse=True)[1].astype(np.int64)
    return _fronts_of_two(goals) if count == 2 else _fronts_of_many(goals)


def undominated(front: Floats, goals: Floats) -> Floats:
    """The goals of a front, shape (m, goals), and of further designs that nothing among both dominates.

    Of designs with equal goals one is kept. Cheaper than `fronts` of all where few designs meet a long front.
    """
    for own in goals[fronts(goals) == 0]:
        if not (front <= own).all(axis=1).any():
            front = np.concatenate([front[~(own <= front).all(axis=1)], own[None]])
    return front


def _fronts_of_two(goals: Floats) -> Ints:
    """In the order of the first goal, a front dominates a design if its last member's second goal is not larger."""
    order = np.lexsort((goals[:, 1], goals[:, 0]))
    found = np.empty(len(goals), dtype=np.int64)
    lasts: list[float] = []
    before, front = (np.nan, np.nan), 0
    for design, first, second in zip(order.tolist(), *goals[order].T.tolist(), strict=True):
        if (first, second) != before:
            front = bisect_right(lasts, second)
            lasts[front : front + 1] = [second]
            before = (first, second)
        found[design] = front
    return found


def _fronts_of_many(goals: Floats) -> Ints:
    """In lexicographic order nothing dominates what comes before: find the first front without a dominating member."""
    order = np.lexsort(goals.T[::-1])
    found = np.empty(len(goals), dtype=np.int64)
    members: list[Floats] = []
    counts: list[int] = []
    for design in order.tolist():
        own = goals[design]
        low, high = 0, len(members)
        while low < high:
            middle = (low + high) // 2
            if _dominated(members[middle][: counts[middle]], own):
                low = middle + 1
            else:
                high = middle
        if low == len(members):
            members.append(np.empty((16, goals.shape[1])))
            counts.append(0)
        elif counts[low] == len(members[low]):
            members[low] = np.concatenate([members[low], np.empty_like(members[low])])
        members[low][counts[low]] = own
        counts[low] += 1
        found[design] = low
    return found


def _dominated(members: Floats, own: Floats) -> bool:
    not_worse = (members <= own).all(axis=1)
    return bool((not_worse & (members < own).any(axis=1)).any())


def ranks(scores: Scores) -> Ints:
    """Rank of each design by Deb's rules, shape (designs,).

    Designs within their limits come first, in fronts; then the others, those of less violation before those of more;
    failed ones last.
    """
    feasible = scores.feasible
    found = np.empty(len(scores), dtype=np.int64)
    found[feasible] = fronts(scores.goals[feasible])
    first = int(found[feasible].max()) + 1 if feasible.any() else 0
    found[~feasible] = first + np.unique(scores.violation[~feasible], return_inverse=True)[1]
    return found


def crowding(values: Floats) -> Floats:
    """Crowding distances of the designs of one front, shape (designs,): larger where neighbours are far.

    Parameters
    ----------
    values : array, shape (designs, goals)
        Columns with values that are missing, or all equal, do not count.
    """
    return _Crowd(values).distance


def spread(values: Floats, count: int) -> tuple[Ints, Floats]:
    """Choose ``count`` designs of one front: the most crowded is left out, one at a time.

    Removal one at a time keeps one of several close designs, where Deb's original rule drops them all (S. Kukkonen,
    K. Deb, "Improved pruning of non-dominated solutions based on crowding distance", CEC 2006).

    Parameters
    ----------
    values : array, shape (designs, goals)
    count : int
        At most the number of designs.

    Returns
    -------
    chosen : int64 array, shape (count,)
        Ascending.
    distance : array, shape (count,)
        Their crowding distances.
    """
    crowd = _Crowd(values)
    for _ in range(len(values) - count):
        crowd.remove(int(np.argmin(np.where(crowd.removed, np.inf, crowd.distance))))
    chosen = np.flatnonzero(~crowd.removed)
    return chosen, crowd.distance[chosen]


class _Crowd:
    """Crowding distances, kept current while designs are removed."""

    def __init__(self, values: Floats) -> None:
        count = len(values)
        self.distance = np.full(count, np.inf) if count <= 2 else np.zeros(count)
        self.removed = np.zeros(count, dtype=np.bool_)
        #: For each goal that counts: scaled values and neighbours below and above, -1 where there is none.
        self._columns: list[tuple[list[float], list[int], list[int]]] = []
        for column in values.T if count > 2 else ():
            order = np.argsort(column, kind="stable")
            span = column[order[-1]] - column[order[0]]
            if not 0.0 < span < np.inf:
                continue
            below, above = np.full(count, -1), np.full(count, -1)
            below[order[1:]], above[order[:-1]] = order[:-1], order[1:]
            gap = np.full(count, np.inf)
            gap[order[1:-1]] = (column[order[2:]] - column[order[:-2]]) / span
            self.distance += gap
            self._columns.append(((column / span).tolist(), below.tolist(), above.tolist()))

    def remove(self, design: int) -> None:
        """Leave a design out."""
        self.removed[design] = True
        for _, below, above in self._columns:
            low, high = below[design], above[design]
            if low >= 0:
                above[low] = high
            if high >= 0:
                below[high] = low
        for _, below, above in self._columns:
            for neighbour in (below[design], above[design]):
                if neighbour >= 0:
                    self.distance[neighbour] = self._distance(neighbour)

    def _distance(self, design: int) -> float:
        total = 0.0
        for scaled, below, above in self._columns:
            low, high = below[design], above[design]
            total += scaled[high] - scaled[low] if low >= 0 and high >= 0 else float("inf")
        return total
