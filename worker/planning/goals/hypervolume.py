"""The hypervolume that designs dominate, up to a reference point."""

from __future__ import annotations

from bisect import bisect_right

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
    """What is dominated between the third goals of one design and the next, each time an area over the other two.

    The area grows with each design by what that one adds (N. Beume et al., "On the complexity of computing the
    hypervolume indicator", IEEE Transactions on Evolutionary Computation 13 (2009)).
    """
    ordered = goals[np.argsort(goals[:, 2], kind="stable")]
    right, top, last = reference.tolist()
    # The edge of the area: from left to right, each point lower than the one before it.
    across, down = [-np.inf, right], [top, -np.inf]
    total = area = 0.0
    heights = [*ordered[1:, 2].tolist(), last]
    for (x, y, z), above in zip(ordered.tolist(), heights, strict=True):
        place = bisect_right(across, x)
        floor = down[place - 1]
        if y < floor:
            end = place
            left = x
            while down[end] >= y:
                area += (across[end] - left) * (floor - y)
                left, floor = across[end], down[end]
                end += 1
            area += (across[end] - left) * (floor - y)
            # A point exactly below or above another replaces it.
            begin = place - 1 if across[place - 1] == x else place
            across[begin:end], down[begin:end] = [x], [y]
        total += area * (above - z)
    return total
