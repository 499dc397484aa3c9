"""The hypervolume that designs dominate, up to a reference point."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

#: Goals up to which it is computed: its cost grows exponentially with them.
MOST_GOALS = 3


def hypervolume(goals: Floats, reference: Floats) -> float:
    """Measure of what is dominated by at least one design and dominates the reference point.

    Parameters
    ----------
    goals : array, shape (designs, goals)
        All to be minimised; one to three goals.
    reference : array, shape (goals,)

    Raises
    ------
    ValueError
        If there are more than three goals.
    """
    if len(reference) > MOST_GOALS:
        raise ValueError(f"the hypervolume of {len(reference)} goals is not computed; at most {MOST_GOALS}")
    inside = goals[(goals < reference).all(axis=1)]
    if not len(inside):
        return 0.0
    if len(reference) == 1:
        return float(reference[0] - inside.min())
    return _area(inside, reference) if len(reference) == 2 else _volume(inside, reference)


def _area(goals: Floats, reference: Floats) -> float:
    ordered = goals[np.lexsort((goals[:, 1], goals[:, 0]))]
    floor = np.minimum.accumulate(ordered[:, 1])
    right = np.append(ordered[1:, 0], reference[0])
    return float(np.add.accumulate((right - ordered[:, 0]) * (reference[1] - floor))[-1])


def _volume(goals: Floats, reference: Floats) -> float:
    """The areas of the slices between the designs' third goals."""
    ordered = goals[np.argsort(goals[:, 2], kind="stable")]
    heights = np.append(ordered[1:, 2], reference[2]) - ordered[:, 2]
    total = 0.0
    for i, height in enumerate(heights.tolist()):
        if height > 0.0:
            total += height * _area(ordered[: i + 1, :2], reference[:2])
    return total
