"""Parts of the engine's compiled code with an entry from Python, for the tests of polynomials."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.compile.jit import compiled
from sprag_study.engine.taylor import batch, roots

Floats = NDArray[np.float64]


@compiled
def first_root(g: Floats, degree: int, stack: Floats) -> float:
    """As ``roots.first_root``."""
    return roots.first_root(g, degree, stack)


@compiled
def largest(g: Floats, degree: int, known: float, stack: Floats) -> float:
    """As ``roots.largest``."""
    return roots.largest(g, degree, known, stack)


@compiled
def put(blocks: Floats, order: int, slot: int, g: Floats) -> None:
    """As ``batch.put``."""
    batch.put(blocks, order, slot, g)


@compiled
def take(blocks: Floats, order: int, slot: int, g: Floats) -> None:
    """As ``batch.take``."""
    batch.take(blocks, order, slot, g)


@compiled
def slot_start(order: int, slot: int) -> int:
    """As ``batch.slot_start``."""
    return batch.slot_start(order, slot)
