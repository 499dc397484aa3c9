"""Conditions between and around the measured ones: where the fitted curve is drawn, and what might be measured next."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker.planning.calibrate.plan import CURVE

if TYPE_CHECKING:
    from sprag_study.worker.planning.calibrate.plan import CalibratePlan

Floats = NDArray[np.float64]

#: Curves at most, and how far a curve goes on beyond its measured ends, as a share of its length.
_CURVES, _BEYOND = 8, 0.1


def along(plan: CalibratePlan) -> int | None:
    """The condition along which the fit is drawn: the one with the most different values; None without conditions."""
    counts = [len(np.unique(column)) for column in plan.at.T]
    return max(range(len(counts)), key=counts.__getitem__) if counts else None


def groups(plan: CalibratePlan) -> tuple[Floats, NDArray[np.int64]]:
    """The curves: values of the other conditions, shape (curves, conditions - 1), and the curve of each condition."""
    x = along(plan)
    rest = np.delete(plan.at, [] if x is None else x, axis=1)
    if not rest.shape[1]:
        return np.zeros((1, 0)), np.zeros(len(rest), dtype=np.int64)
    values, which = np.unique(rest, axis=0, return_inverse=True)
    return values, which.reshape(-1).astype(np.int64)


def candidates(plan: CalibratePlan) -> Floats:
    """The conditions, shape (at most `CURVE`, paths_at), curve after curve, ascending; none without conditions.

    The curves with the most measured conditions are taken. Values beyond the measured ends keep their sign.
    """
    x = along(plan)
    if x is None:
        return np.zeros((0, 0))
    values, which = groups(plan)
    most = np.argsort(-np.bincount(which, minlength=len(values)), kind="stable")[:_CURVES]
    each = max(2, CURVE // len(most))
    parts = []
    for curve in np.sort(most).tolist():
        own = plan.at[which == curve, x]
        low, high = float(own.min()), float(own.max())
        beyond = _BEYOND * (high - low) or _BEYOND * abs(low) or _BEYOND * float(np.ptp(plan.at[:, x]))
        ends = [max(low - beyond, 0.5 * low) if low >= 0.0 else low - beyond, high + beyond]
        if high <= 0.0:
            ends[1] = min(ends[1], 0.5 * high)
        line = np.unique([ends[0] + (ends[1] - ends[0]) * k / (each - 1) for k in range(each)])
        parts.append(np.insert(np.tile(values[curve], (len(line), 1)), x, line, axis=1))
    return np.concatenate(parts) + 0.0
