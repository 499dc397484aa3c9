"""Arrays in stored JSON texts: short ones as numbers, long ones as the base64 text of their bytes."""

from __future__ import annotations

import base64
from typing import TYPE_CHECKING, cast

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

#: Longer arrays are stored as the bytes of their doubles: a million of them as decimals take half a second to read.
_MOST_DECIMALS = 1000


def packed(values: NDArray[np.float64]) -> list[float] | str:
    """The values for a JSON text: as numbers, or many as the base64 text of their bytes (float64, little-endian)."""
    if values.size <= _MOST_DECIMALS:
        return cast("list[float]", values.tolist())
    return base64.b64encode(values.astype("<f8").tobytes()).decode("ascii")


def unpacked(stored: Sequence[float] | str) -> Sequence[float] | NDArray[np.float64]:
    """The values that `packed` wrote."""
    if not isinstance(stored, str):
        return stored
    return np.frombuffer(base64.b64decode(stored, validate=True), dtype="<f8")
