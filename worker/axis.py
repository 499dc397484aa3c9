"""An axis of a study: paths and their values in SI numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Two numbers closer than this (relative to the larger one) count as the same value of an axis.
SAME_VALUE = 1e-9


class Axis:
    """Values of one parameter, or of several tied ones. Immutable.

    Parameters
    ----------
    paths : tuple of str
        Flat spec paths that share the values, for instance ``("excitation.amplitude_x", "excitation.amplitude_y")``.
    values : sequence of float
        SI numbers, finite, in the user's order.

    Attributes
    ----------
    array : float64 array, shape (values,)
        The values, read-only. A million of them take 8 MB here and 40 MB as Python numbers.
    """

    def __init__(self, paths: tuple[str, ...], values: Sequence[float] | NDArray[np.float64]) -> None:
        array = np.array(values, dtype=np.float64)
        if not paths or not array.size:
            raise ValueError("an axis needs at least one path and one value")
        if not np.isfinite(array).all():
            raise ValueError(f"axis {paths[0]}: every value must be a finite number")
        array.flags.writeable = False
        self.paths = paths
        self.array = array

    @property
    def values(self) -> tuple[float, ...]:
        """All values as Python numbers, created at each call; `value` returns a single one."""
        return tuple(self.array.tolist())

    def value(self, index: int) -> float:
        """The value at a position."""
        return float(self.array[index])

    def __reduce__(self) -> tuple[type[Axis], tuple[Any, ...]]:
        return Axis, (self.paths, self.array)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Axis):
            return NotImplemented
        return self.paths == other.paths and np.array_equal(self.array, other.array)

    def __hash__(self) -> int:
        return hash((self.paths, self.array.tobytes()))

    def __repr__(self) -> str:
        return f"Axis({self.paths!r}, {len(self)} values)"

    def __len__(self) -> int:
        return int(self.array.size)

    @cached_property
    def levels(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """The different values, ascending, and for each of `values` its place among them; see `SAME_VALUE`."""
        order = np.argsort(self.array, kind="stable")
        ascending = self.array[order]
        larger = np.maximum(np.abs(ascending[1:]), np.abs(ascending[:-1]))
        new = np.append(True, np.diff(ascending) > SAME_VALUE * larger)
        places = np.empty(self.array.size, dtype=np.int64)
        places[order] = np.cumsum(new) - 1
        return ascending[new], places

    def place_of(self, value: float) -> int | None:
        """The place in `levels` of a value (SI); None when the axis does not have it."""
        index = self.index_of(value)
        return None if index is None else int(self.levels[1][index])

    def index_of(self, value: float) -> int | None:
        """Position of the value that equals ``value`` (SI) within `SAME_VALUE`; None when there is none."""
        if not math.isfinite(value):
            return None
        nearest = int(np.argmin(np.abs(self.array - value)))
        return nearest if math.isclose(float(self.array[nearest]), value, rel_tol=SAME_VALUE) else None
