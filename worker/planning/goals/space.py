"""The space of designs: unit coordinates that searches work in, and the values and cases that they stand for."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from sprag_study.worker.planning.goals.plan import GoalPlan

Floats = NDArray[np.float64]


class Space:
    """Designs as points of the unit cube, one coordinate for each variable.

    A range is mapped linearly. The k values of a catalogue share the unit interval evenly: value j (from 0) has the
    coordinates from j / k to (j + 1) / k.

    Attributes
    ----------
    dimensions : int
    counts : int64 array, shape (dimensions,)
        Number of values of each catalogue, 0 for a range.
    size : int, optional
        Number of designs; None where there is a range.
    start : float64 array, shape (designs, dimensions)
        Coordinates of the known designs of the plan.
    """

    def __init__(self, plan: GoalPlan) -> None:
        self._vary = plan.vary
        self._low = np.array([one.low for one in plan.vary])
        self._high = np.array([one.high for one in plan.vary])
        self._at = _cases_of_a_design(plan, np.arange(1.0 + plan.drives))
        fresh = 1.0 + plan.drives + np.arange(float(plan.fresh))
        self._fresh = _cases_of_a_design(plan, fresh)[: fresh.size * len(plan.at)]
        self.dimensions = len(plan.vary)
        self.counts = np.array([len(one.values) for one in plan.vary], dtype=np.int64)
        self.size = math.prod(self.counts.tolist()) if self.counts.all() else None
        known = np.array(plan.start, dtype=np.float64).reshape(-1, self.dimensions)
        self.start = self._unit(known)
        #: Rounded coordinates would not give the numbers of a known design back.
        self._exact = dict(zip(keys(self.start), known, strict=True))

    def designs(self, coordinates: Floats) -> Floats:
        """Values of the variables, SI, shape (designs, dimensions), at coordinates of that shape in [0, 1]."""
        values: Floats = self._low + (self._high - self._low) * coordinates
        values = np.minimum(np.maximum(values, self._low), self._high)
        for i in np.flatnonzero(self.counts).tolist():
            values[:, i] = np.array(self._vary[i].values)[self.places(coordinates, i)]
        for i, key in enumerate(keys(coordinates) if self._exact else ()):
            values[i] = self._exact.get(key, values[i])
        return values + 0.0  # not -0.0

    def places(self, coordinates: Floats, variable: int) -> NDArray[np.int64]:
        """Which values of a catalogue the coordinates stand for, shape (designs,)."""
        count = int(self.counts[variable])
        return np.clip(np.floor(coordinates[:, variable] * count).astype(np.int64), 0, count - 1)

    def centred(self, coordinates: Floats) -> Floats:
        """The same designs, with catalogue coordinates in the middle of their values' shares."""
        middle = coordinates.copy()
        for i in np.flatnonzero(self.counts).tolist():
            middle[:, i] = (self.places(coordinates, i) + 0.5) / self.counts[i]
        return middle

    def cases(self, designs: Floats) -> Floats:
        """The cases of designs: those of a design are next to each other, one for each operating point and drive."""
        points = len(self._at)
        rows = np.repeat(designs, points, axis=0)
        return np.hstack([rows, np.tile(self._at.reshape(points, -1), (len(designs), 1))])

    def fresh_cases(self, designs: Floats) -> Floats:
        """The cases of designs with fresh drives, in the order of ``cases``."""
        points = len(self._fresh)
        return np.hstack([np.repeat(designs, points, axis=0), np.tile(self._fresh, (len(designs), 1))])

    def of_fresh_cases(self, cases: Floats) -> Floats | None:
        """The designs of whole sets of cases with fresh drives; None for any others."""
        designs = cases[:: max(len(self._fresh), 1), : self.dimensions]
        same = len(self._fresh) > 0 and np.array_equal(self.fresh_cases(designs), cases)
        return designs if same else None

    def coordinates(self, cases: Floats) -> tuple[Floats, Floats]:
        """The designs of whole sets of cases, and coordinates of them, both of shape (designs, dimensions).

        Raises
        ------
        ValueError
            If they are not cases of this plan.
        """
        designs = cases[:: len(self._at), : self.dimensions]
        if not np.array_equal(self.cases(designs), cases):
            raise ValueError("the cases do not have the operating points of this search")
        coordinates = self._unit(designs)
        inside = (coordinates >= 0.0) & (coordinates <= 1.0)
        if not inside.all():
            i = int(np.flatnonzero(~inside.all(axis=0))[0])
            value = designs[~inside[:, i], i][0]
            raise ValueError(f"{self._vary[i].paths[0]}: {value} is not a value of this search")
        return designs, coordinates

    def _unit(self, designs: Floats) -> Floats:
        """Coordinates of designs; NaN for what is no value of a catalogue."""
        coordinates = (designs - self._low) / np.where(self._high > self._low, self._high - self._low, 1.0)
        for i in np.flatnonzero(self.counts).tolist():
            values = np.array(self._vary[i].values)
            place = np.minimum(np.searchsorted(values, designs[:, i]), len(values) - 1)
            coordinates[:, i] = np.where(values[place] == designs[:, i], (place + 0.5) / len(values), np.nan)
        return np.asarray(coordinates)


def _cases_of_a_design(plan: GoalPlan, drives: Floats) -> Floats:
    """Operating point and drive of each case of a design with those drives, shape (cases, paths)."""
    points = np.array([[point[path] for path in plan.at_paths] for point in plan.at]).reshape(len(plan.at), -1)
    if not plan.drives:
        return points
    return np.column_stack([np.repeat(points, drives.size, axis=0), np.tile(drives, len(points))])


def keys(designs: Floats) -> list[bytes]:
    """What tells designs apart, one for each row."""
    return [row.tobytes() for row in np.ascontiguousarray(designs)]
