"""What a result is worth over the drives of a design: that of the nominal drive, a quantile, mean and deviation, or the
yield.

Drive 0 is nominal, the others are drawn; all designs have the same draws (common random numbers), so that designs are
compared with each other and not with chance. A drive without a usable result counts as one that reaches nothing: its
value is the worst one.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker.models.usable import against, half_width
from sprag_study.worker.planning.goals.linear import weighted_sum

if TYPE_CHECKING:
    from sprag_study.worker.planning.goals.plan import Goal, GoalPlan, Limit
    from sprag_study.worker.planning.rounds import Rows

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


def moments(values: Floats) -> tuple[Floats, Floats]:
    """Mean and standard deviation (n - 1) of a sample along the last axis; NaN where a value is missing.

    Sums are added in a fixed order, so that no processor adds them in another one.
    """
    count = values.shape[-1]
    drives = np.moveaxis(values, -1, 0)
    mean: Floats = weighted_sum(np.ones(count), drives) / count
    squares: Floats = weighted_sum(np.ones(count), (drives - mean) ** 2)
    return mean, np.sqrt(squares / max(count - 1, 1))


class Table:
    """The rows of whole designs, by design, operating point and drive.

    Attributes
    ----------
    ok : bool array, shape (designs, points, drives + 1)
    failed : bool array, shape (designs,)
        Whether a case failed that must not: the nominal drive where it is judged, or all drawn drives of a point.
    """

    def __init__(self, plan: GoalPlan, rows: Rows) -> None:
        self._plan, self._rows = plan, rows
        self._shape = (len(rows.points) // plan.cases_each, len(plan.at), 1 + plan.drives)
        self.ok: Flags = rows.ok.reshape(self._shape)
        self.failed: Flags = np.zeros(self._shape[0], dtype=np.bool_)
        if not all(item.robust for item in plan.items):
            self.failed |= ~np.all(self.ok[:, :, 0], axis=1)
        if plan.drives:
            self.failed |= ~np.all(np.any(self.ok[:, :, 1:], axis=2), axis=1)

    def values(self, item: Goal | Limit, limit: Limit | None = None) -> Floats:
        """What a goal or a limit is about, shape (designs, points); NaN where it is missing.

        A yield, which concerns all operating points together, is the same at each of them. With ``limit``, means of
        irregular motion are moved by their half widths to where it is hardest to meet.
        """
        if item.conditions:
            share = np.asarray(self._held(item.conditions).sum(axis=1) / self._plan.drives)
            return np.repeat(share[:, None], self._shape[1], axis=1)
        if item.statistic is not None:
            return self._statistic(item, limit)
        if item.quantile is None:
            nominal: Floats = self._results(item.result, limit)[:, :, 0]
            return nominal
        drawn = self.drawn(item, limit)
        # The least value that at least this share of the drives does not exceed: no arithmetic, so no rounding.
        place = max(math.ceil(item.quantile * self._plan.drives - 1e-9), 1) - 1
        value: Floats = np.sort(drawn, axis=2)[:, :, place].copy()
        value[~np.isfinite(value)] = np.nan
        return value

    def drawn(self, item: Goal | Limit, limit: Limit | None = None) -> Floats:
        """The result of a goal or a limit in each drawn drive, the worst where it is missing.

        Shape (designs, points, drives).
        """
        results = self._results(item.result, limit)[:, :, 1:]
        worst = -math.inf if item.upwards else math.inf
        return np.where(self.ok[:, :, 1:] & ~np.isnan(results), results, worst)

    def _statistic(self, item: Goal | Limit, limit: Limit | None) -> Floats:
        """Mean and deviation over the drawn drives, NaN where one lacks the result; with ``limit`` as of `values`."""
        results = self._results(item.result)[:, :, 1:]
        mean, deviation = moments(np.where(self.ok[:, :, 1:], results, np.nan))
        if item.statistic == "deviation":
            return deviation
        value: Floats = mean + item.deviations * deviation
        widths = self._rows.values.get(half_width(item.result))
        if limit is None or widths is None:
            return value
        wide = np.where(np.isfinite(widths), widths, 0.0).reshape(self._shape)[:, :, 1:]
        return against(limit.kind, limit.value, value, moments(wide)[0])

    def _results(self, name: str, limit: Limit | None = None) -> Floats:
        values = np.where(self._rows.ok & np.isfinite(self._rows.values[name]), self._rows.values[name], np.nan)
        if limit is not None:
            values = against(limit.kind, limit.value, values, self._rows.values.get(half_width(name)))
        return values.reshape(self._shape)

    def _held(self, conditions: tuple[Limit, ...]) -> Floats:
        """1 for each drawn drive that meets every condition at every operating point, shape (designs, drives)."""
        held: Flags = np.all(self.ok[:, :, 1:], axis=1)
        for condition in conditions:
            values = self._results(condition.result, condition)[:, :, 1:]
            held = held & np.all(condition.holds(values[:, list(condition.at)] if condition.at else values), axis=1)
        return np.asarray(held, dtype=np.float64)
