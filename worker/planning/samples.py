"""The rows of a refinement on its finest grids: what is known where, ranges of the results."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.worker.models.usable import half_width
from sprag_study.worker.models.vibration_drive.settled import IRREGULAR
from sprag_study.worker.planning.goals.draws import logarithm
from sprag_study.worker.planning.refine_plan import MULTIPLIER, ORDER, REGIME, SETTLED_AFTER

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from sprag_study.worker.planning.refine_plan import RefinePlan
    from sprag_study.worker.planning.rounds import Rows

    Bools = NDArray[np.bool_]
    Floats = NDArray[np.float64]
    Ints = NDArray[np.int64]

#: A result that varies by less than this, relative to its size, is constant: settled results are not more exact.
_CONSTANT: Final = 1e-7
#: Code of a case without results; those of regimes are not negative.
FAILED: Final = -1.0
#: Multipliers of settled motions that count as these.
_LEAST, _MOST = 0.01, 0.99999


def settling(after: Floats, multiplier: Floats, order: Floats) -> Floats:
    """Logarithm of the settling time, in times that the distance shrinks by the factor e; NaN where nothing settles.

    ``after`` are periods until the motion is settled, ``multiplier`` is that of the distance from it in ``order``
    periods.
    """
    rate = -logarithm(np.clip(multiplier, _LEAST, _MOST)) / order
    return logarithm(np.maximum(after, 1.0) * rate)


class Samples:
    """Rows of all curves or maps of a plan.

    Attributes
    ----------
    known, ok, irregular : bool arrays, shape (combinations, places...)
        Where there is a row, whether it has results, and whether its motion is irregular; one dimension of places for
        each adaptive axis, as long as the plan's ``sizes``.
    values, widths : float64 arrays, shape (combinations, places..., results)
        Results (NaN where there is none) and their half widths (0 where there is none).
    regimes, orders : float64 arrays, shape (combinations, places...)
        Regime, or `FAILED`, and order; 0 in studies that are not settled.
    settling : float64 array, shape (combinations, places...)
        As of `settling`; NaN where nothing settles.
    multipliers : float64 array, shape (combinations, places...)
        Those of the settled motions; 0 where nothing settles.
    has_width : bool array, shape (results,)
        Whether irregular motions have a half width of the result.
    """

    def __init__(self, plan: RefinePlan) -> None:
        shape = (plan.combinations, *plan.sizes)
        self.plan = plan
        self.known = np.zeros(shape, dtype=bool)
        self.ok = np.zeros(shape, dtype=bool)
        self.irregular = np.zeros(shape, dtype=bool)
        self.values = np.full((*shape, len(plan.results)), np.nan)
        self.widths = np.zeros((*shape, len(plan.results)))
        self.regimes = np.zeros(shape)
        self.orders = np.zeros(shape)
        self.multipliers = np.zeros(shape)
        self.settling = np.full(shape, np.nan)
        self.has_width = np.array([name in plan.half_widths for name in plan.results])

    def add(self, rows: Rows) -> None:
        """Add rows, in any order and any number; ValueError for a point that is not of the plan."""
        combination, positions = self.plan.places(rows.points)
        self.put(combination, positions, rows.ok, rows.values)

    def put(self, combination: Ints, positions: Sequence[Ints], ok: Bools, values: Mapping[str, Floats]) -> None:
        """Add rows at places of the grids."""
        at: tuple[Ints, ...] = (combination, *positions)
        self.known[at] = True
        self.ok[at] = ok
        for k, name in enumerate(self.plan.results):
            self.values[..., k][at] = np.where(ok & np.isfinite(values[name]), values[name], np.nan)
            if name in self.plan.half_widths:
                width = values[half_width(name)]
                self.widths[..., k][at] = np.where(ok & np.isfinite(width), width, 0.0)
        if self.plan.regime:
            self.regimes[at] = np.nan_to_num(values[REGIME])
            self.orders[at] = np.nan_to_num(values[ORDER])
            self.multipliers[at] = np.where(ok, np.nan_to_num(values[MULTIPLIER]), 0.0)
            own = settling(values[SETTLED_AFTER], values[MULTIPLIER], values[ORDER])
            self.settling[at] = np.where(ok, own, np.nan)
        self.regimes[at] = np.where(ok, self.regimes[at], FAILED)
        self.orders[at] = np.where(ok, self.orders[at], 0.0)
        self.irregular[at] = ok & (self.regimes[at] == IRREGULAR) if self.plan.regime else False

    @property
    def codes(self) -> Floats:
        """One number for each kind of motion: equal where regime and order are."""
        return self.regimes * 1e6 + self.orders

    def misses(self, at: tuple[Ints, ...], expected: Floats, scales: Floats, beside: Floats) -> tuple[Floats, Floats]:
        """How far results are from what the points around them lead to, both of shape (points, results).

        The first are the distances relative to ``scales``, infinite where only one of both has a value; the second are
        those that more points make smaller. ``beside`` are the half widths of the points around.
        """
        values, error = self.values[at], self.plan.error
        with np.errstate(invalid="ignore"):
            raw = np.abs(values - expected) / scales
        raw = np.where(np.isfinite(values) | np.isfinite(expected), np.where(np.isfinite(raw), raw, np.inf), 0.0)
        # As at midpoints: a mean stops within two half widths, an extreme of irregular motion at once.
        width = np.maximum(self.widths[at], beside)
        scatter = np.where(self.has_width, raw * scales <= 2.0 * width, self.irregular[at][:, None])
        return raw, np.where(scatter, np.minimum(raw, error), raw)

    def ranges(self) -> Floats:
        """Range of each result over each curve or map, shape (combinations, results); 1 where there is no value."""
        flat = self.values.reshape(len(self.values), -1, self.values.shape[-1])
        present = np.isfinite(flat)
        low = np.where(present, flat, np.inf).min(axis=1)
        high = np.where(present, flat, -np.inf).max(axis=1)
        size = _CONSTANT * np.maximum(np.abs(low), np.abs(high))
        ranges = np.where(present.any(axis=1), np.maximum(high - low, size), 1.0)
        return np.where(ranges > 0.0, ranges, 1.0)

    def scales(self) -> Floats:
        """What differences are measured by, shape (combinations, results): the error of the plan is allowed of it.

        It is the range of a result, unless the result has an error of its own.
        """
        ranges, shares = self.measures()
        return ranges * (shares / self.plan.error)

    def measures(self) -> tuple[Floats, Floats]:
        """Range of each result, and the error it may have relative to it; both of shape (combinations, results)."""
        ranges, shares = self.ranges(), np.full((len(self.values), len(self.plan.results)), self.plan.error)
        for k, name in enumerate(self.plan.results):
            bound = self.plan.errors.get(name)
            if bound is not None:
                shares[:, k] = bound.value / (ranges[:, k] if bound.absolute else 1.0)
        return ranges, shares
