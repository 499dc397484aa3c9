"""The space of unknown parameters: unit coordinates that the fit works in, and the values that they stand for."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker.planning.goals.draws import exponential, logarithm

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.worker.planning.calibrate.plan import Unknown
    from sprag_study.worker.planning.goals.draws import Draws

Floats = NDArray[np.float64]


class Space:
    """Sets of parameters as points of the unit cube: ranges are mapped linearly, wide ones by their logarithm."""

    def __init__(self, unknown: Sequence[Unknown]) -> None:
        self._low = np.array([one.low for one in unknown])
        self._high = np.array([one.high for one in unknown])
        self._log = np.array([one.logarithmic for one in unknown])
        self._first = logarithm(np.where(self._log, self._low, 1.0))
        self._span = logarithm(np.where(self._log, self._high, 1.0)) - self._first
        self.dimensions = len(unknown)

    def values(self, places: Floats) -> Floats:
        """Values, SI, at coordinates in 0 .. 1; any shape whose last axis counts the parameters."""
        straight = self._low + (self._high - self._low) * places
        curved = exponential(self._first + self._span * places)
        values: Floats = np.clip(np.where(self._log, curved, straight), self._low, self._high)
        return values + 0.0  # not -0.0

    def slopes(self, places: Floats) -> Floats:
        """Derivatives of the values by the coordinates."""
        return np.where(self._log, self.values(places) * self._span, self._high - self._low)

    def coordinates(self, column: int, values: Floats) -> Floats:
        """The coordinates in 0 .. 1 at which one parameter has these values of its range."""
        low, high = self._low[column], self._high[column]
        if self._log[column]:
            share = (logarithm(values) - self._first[column]) / self._span[column]
        else:
            share = (values - low) / (high - low)
        places: Floats = np.clip(share, 0.0, 1.0)
        return places

    def scan(self, count: int, draws: Draws) -> Floats:
        """A Latin hypercube, shape (count, parameters)."""
        columns = [(draws.permutation(count) + draws.uniforms(count)) / count for _ in range(self.dimensions)]
        return np.stack(columns, axis=1)
