"""Coarse to fine: the order in which the cases of a study with a deadline are run.

The first pass takes the two ends of every axis, the next one also the middles, and so on: pass ``p`` takes the values
whose rank (position among the sorted values of the axis) is ``floor(j (n - 1) / 2^p)`` for some ``j = 0 .. 2^p``. The
values of one pass are contained in those of the next, are evenly spaced and always include the ends. A pass is the
complete grid of its values, so the finished part at a deadline is a usable, coarser study. (The one-dimensional order
is that of bisection: the radical inverse of van der Corput, 1935, without its permutation within a pass.)

Chunks of such a study are ranges of *positions* in this order. For a grid only the axes are tabulated: the cases that a
pass adds form boxes, one for each axis that is the first with a new value, and a position in a box is a mixed-radix
number, like a case number in the grid. Cases listed one by one (a zip) are sorted by the first pass that contains all
their values; within a pass they keep their given order, which for samples covers the ranges.

Of a study with tolerances the passes of the nominal drive come first. Then come the drives at all places together, in
passes that double their number: every pass ends with complete ribbons of the first 1, 2, 4, 8, .. drives, and a number
that is a power of two is what Sobol draws are balanced for.

The cases of a swept study are run line by line instead (`sprag_study.worker.sweeps`), with or without a deadline.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from sprag_study.sentences import Sentence, plural
from sprag_study.worker.sweeps import LineOrder

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.worker.study import Study

    Numbers = NDArray[np.int64]


class Order(Protocol):
    """A one-to-one relation between positions (when a case is run) and case numbers, both 0 .. cases - 1.

    Attributes
    ----------
    passes : tuple of int
        The positions before each entry form a complete, coarser study; ascending, the last is the number of cases.
        Empty for an order without coarser studies.
    """

    @property
    def passes(self) -> tuple[int, ...]: ...

    def cases(self, positions: Numbers) -> Numbers:
        """Numbers of the cases at those positions, shape (m,)."""

    def positions(self, cases: Numbers) -> Numbers:
        """Positions of the cases of those numbers, shape (m,)."""

    def values(self, passes: int) -> tuple[int, ...]:
        """Number of values of each axis in the first ``passes`` passes; () where cases are listed."""


@dataclass(frozen=True, slots=True)
class Coverage:
    """The complete part of a study: ``complete`` of ``total`` passes, ``cases`` cases, a grid of so many ``values``.

    ``values`` has a number for each axis, none where the cases are listed.
    """

    complete: int
    total: int
    cases: int
    values: tuple[int, ...]

    def __str__(self) -> str:
        return str(self.sentence)

    @property
    def sentence(self) -> Sentence:
        """What is complete."""
        if not self.complete:
            return Sentence("no pass of {total} is complete", total=self.total)
        if self.values:
            values = " x ".join(map(str, self.values))
            return Sentence(
                "pass {complete} of {total} is complete, a grid of {values} values",
                complete=self.complete,
                total=self.total,
                values=values,
            )
        return plural(
            "pass {complete} of {total} is complete, {count} cases",
            "pass {complete} of {total} is complete, {count} cases",
            self.cases,
            complete=self.complete,
            total=self.total,
        )


def coverage(order: Order, reached: int) -> Coverage:
    """The coverage when every position before ``reached`` is done."""
    complete = sum(size <= reached for size in order.passes)
    cases = order.passes[complete - 1] if complete else 0
    return Coverage(complete, len(order.passes), cases, order.values(complete) if complete else ())


def levels(count: int) -> Numbers:
    """First pass that takes each of ``count`` ranks, int64 array of shape (count,)."""
    found = np.full(count, -1, dtype=np.int64)
    level = 0
    while count and (found < 0).any():
        ranks = np.arange(2**level + 1, dtype=np.int64) * (count - 1) >> level
        new = ranks[found[ranks] < 0]
        found[new] = level
        level += 1
    return found


def levels_of(values: NDArray[np.float64]) -> Numbers:
    """First pass that takes each of the values (shape (m,), repetitions allowed), by their rank among all of them."""
    different, rank = np.unique(values, return_inverse=True)
    return levels(different.size)[rank.reshape(-1)]


def order_of(study: Study) -> Order:
    """The order of ``study``, coarse to fine; of a swept one, line by line."""
    if study.sweep is not None:
        return LineOrder(study)
    if study.combine == "grid" and study.axes:
        return GridOrder(_levels(study))
    own = _levels(study)
    return ListOrder(np.max(own, axis=0) if own else np.zeros(study.cases, dtype=np.int64))


def _levels(study: Study) -> list[Numbers]:
    """First pass that takes each value of each axis."""
    if study.spread is None:
        return [levels_of(axis.array) for axis in study.axes]
    *places, drives = study.axes
    own = [levels_of(axis.array) for axis in places]
    first = 1 + max((int(one.max()) for one in own), default=0)
    return [*own, _levels_of_drives(drives.array, first)]


def _levels_of_drives(drives: NDArray[np.float64], first: int) -> Numbers:
    """First pass that takes each drive: 0 the nominal one, then from ``first`` the drives 1, 2, 3 to 4, 5 to 8 ..

    Passes without any drive are left out.
    """
    numbers = drives.astype(np.int64)
    doublings = np.frexp(np.maximum(numbers - 0.5, 0.25))[1]  # 0 for drive 1, 1 for drive 2, 2 for 3 and 4, ..
    rank = np.unique(doublings[numbers > 0], return_inverse=True)[1].reshape(-1)
    found = np.zeros(numbers.size, dtype=np.int64)
    found[numbers > 0] = first + rank
    return found


class ListOrder:
    """Listed cases, sorted by level (shape (cases,)), in the given order within a level."""

    def __init__(self, level: Numbers) -> None:
        self._case = np.argsort(level, kind="stable").astype(np.int64)
        self._position = np.empty_like(self._case)
        self._position[self._case] = np.arange(level.size)
        self.passes = tuple(np.cumsum(np.unique(level, return_counts=True)[1]).tolist())

    def values(self, passes: int) -> tuple[int, ...]:  # noqa: ARG002 - as of every order
        """(): there are no axes."""
        return ()

    def cases(self, positions: Numbers) -> Numbers:
        """Numbers of the cases at those positions."""
        return self._case[positions]

    def positions(self, cases: Numbers) -> Numbers:
        """Positions of the cases of those numbers."""
        return self._position[cases]


@dataclass(frozen=True, slots=True)
class _Box:
    """Cases whose positions on every axis (sorted by level) lie in ``low`` .. ``low + size - 1``; the last varies
    fastest.
    """

    start: int
    low: tuple[int, ...]
    size: tuple[int, ...]


class GridOrder:
    """Every combination of the values of axes, whose levels are given: one array of shape (values,) for each axis."""

    def __init__(self, level: list[Numbers]) -> None:
        self._shape = tuple(one.size for one in level)
        #: For each axis: position of its values when sorted by level, and the inverse.
        self._value = [np.argsort(one, kind="stable").astype(np.int64) for one in level]
        self._place = [np.argsort(value, kind="stable").astype(np.int64) for value in self._value]
        self._level = level
        self._boxes: list[_Box] = []
        #: Index of the box by pass and first axis with a new value.
        self._box_of: dict[tuple[int, int], int] = {}
        ends = [self._cut(one) for one in range(1 + max(int(one.max()) for one in level))]
        self._starts = np.array([box.start for box in self._boxes], dtype=np.int64)
        self.passes = tuple(ends)

    def _cut(self, level: int) -> int:
        """Append the boxes of a pass; returns the number of cases up to its end."""
        before = tuple(int((one < level).sum()) for one in self._level)
        until = tuple(int((one <= level).sum()) for one in self._level)
        start = math.prod(before)
        for axis in range(len(self._level)):
            size = (*before[:axis], until[axis] - before[axis], *until[axis + 1 :])
            if not math.prod(size):
                continue
            low = (*(0 for _ in before[:axis]), before[axis], *(0 for _ in before[axis + 1 :]))
            self._box_of[level, axis] = len(self._boxes)
            self._boxes.append(_Box(start, low, size))
            start += math.prod(size)
        return start

    def values(self, passes: int) -> tuple[int, ...]:
        """Number of values of each axis in the first ``passes`` passes."""
        return tuple(int((one < passes).sum()) for one in self._level)

    def cases(self, positions: Numbers) -> Numbers:
        """Numbers of the cases at those positions."""
        positions = np.asarray(positions, dtype=np.int64)
        found = np.empty_like(positions)
        which = np.searchsorted(self._starts, positions, side="right") - 1
        for index in np.unique(which).tolist():
            box, here = self._boxes[index], which == index
            places = np.unravel_index(positions[here] - box.start, box.size)
            own = [value[low + place] for value, low, place in zip(self._value, box.low, places, strict=True)]
            found[here] = np.ravel_multi_index(own, self._shape)
        return found

    def positions(self, cases: Numbers) -> Numbers:
        """Positions of the cases of those numbers."""
        cases = np.asarray(cases, dtype=np.int64)
        own = np.unravel_index(cases, self._shape)
        level = np.array([one[index] for one, index in zip(self._level, own, strict=True)])
        last = level.max(axis=0)
        axis = (level == last).argmax(axis=0)
        found = np.empty_like(cases)
        code = last * len(self._level) + axis
        for one in np.unique(code).tolist():
            box, here = self._boxes[self._box_of[divmod(one, len(self._level))]], code == one
            places = [place[index[here]] - low for place, index, low in zip(self._place, own, box.low, strict=True)]
            found[here] = box.start + np.ravel_multi_index(places, box.size)
        return found
