"""Strobes of a section as points: their free columns, scaled.

A section is given by a strobe: its part of the period and its states of clutches and shaft.
"""

import math

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.compile.jit import compiled
from sprag_study.engine.vibration_drive.orbits import list_free, same_states, tie

Floats = NDArray[np.float64]


@compiled
def to_points(strobes: Floats, like: Floats, units: Floats, points: Floats) -> int:
    """Write the coordinates of strobes in the section of ``like``, and return their number.

    Parameters
    ----------
    strobes : array, shape (m, columns)
    like : array, shape (columns,)
    units : array, shape (columns,)
        What counts as 1 in each column.
    points : array, shape (m, columns)
        Gets the coordinates in its first columns; NaN where the states of a strobe are others.
    """
    columns = np.zeros(like.shape[0], dtype=np.int64)
    count = list_free(like, False, columns)
    for row in range(strobes.shape[0]):
        same = same_states(like, strobes[row])
        for j in range(count):
            points[row, j] = strobes[row, columns[j]] / units[columns[j]] if same else math.nan
    return count


@compiled
def to_strobes(points: Floats, like: Floats, units: Floats, strobes: Floats) -> None:
    """Write the strobes, shape (m, columns), of points of the section of ``like``, shape (m, coordinates)."""
    columns = np.zeros(like.shape[0], dtype=np.int64)
    count = list_free(like, False, columns)
    for row in range(points.shape[0]):
        strobes[row] = like
        for j in range(count):
            strobes[row, columns[j]] = points[row, j] * units[columns[j]]
        tie(strobes[row])
