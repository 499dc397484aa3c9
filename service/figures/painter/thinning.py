"""Thinning of a line without visible change: every bucket keeps its first, lowest, highest and last point."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


def thin(y: NDArray[np.float64], most: int) -> NDArray[np.int64]:
    """Select the points to draw.

    Parameters
    ----------
    y : float64 array, shape (m,)
        Values along the line; NaN is a gap, of which each bucket keeps one point.
    most : int
        At most this many points are kept (at least 5 for each of one bucket).

    Returns
    -------
    int64 array, ascending
        All positions when ``m <= most``. First and last point, and lowest and highest point of the whole line, are
        always among them.
    """
    if y.size <= most:
        return np.arange(y.size, dtype=np.int64)
    buckets = max(most // 5, 1)
    edges = np.linspace(0, y.size, buckets + 1).astype(np.int64)
    kept: list[int] = []
    missing = np.isnan(y)
    holed = bool(missing.any())
    lowest, highest = (np.nanargmin, np.nanargmax) if holed else (np.argmin, np.argmax)
    for start, stop in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        kept += [start, stop - 1]
        gaps = missing[start:stop]
        if holed and gaps.any():
            kept.append(start + int(np.argmax(gaps)))
        if not holed or not gaps.all():
            kept += [start + int(lowest(y[start:stop])), start + int(highest(y[start:stop]))]
    return np.unique(np.array(kept, dtype=np.int64))
