"""Gauss-Legendre nodes and products of small matrices, with the same bits on every machine.

numpy leaves both to BLAS and LAPACK, which round as the processor and whoever built them would have it.
"""

import math
from decimal import Decimal, localcontext

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

_DIGITS, _STEPS = 40, 6


def gauss(count: int) -> tuple[Floats, Floats]:
    """Nodes on -1 .. 1, ascending, and weights of Gauss's quadrature, correctly rounded; each of shape (count,)."""
    nodes, weights = [], []
    with localcontext(prec=_DIGITS):
        for k in reversed(range(count)):
            x = Decimal(math.cos(math.pi * (k + 0.75) / (count + 0.5)))
            for _ in range(_STEPS):
                value, slope = _legendre(count, x)
                x -= value / slope
            slope = _legendre(count, x)[1]
            nodes.append(float(x))
            weights.append(float(2 / ((1 - x * x) * slope * slope)))
    return np.array(nodes), np.array(weights)


def _legendre(degree: int, x: Decimal) -> tuple[Decimal, Decimal]:
    """Legendre polynomial and its derivative at ``x`` within -1 .. 1."""
    before, value = Decimal(1), x
    for k in range(1, degree):
        before, value = value, ((2 * k + 1) * x * value - k * before) / (k + 1)
    return value, degree * (before - x * value) / (1 - x * x)


def product(first: ArrayLike, *others: ArrayLike) -> Floats:
    """Product of matrices from the left to the right, each sum correctly rounded."""
    result = np.asarray(first, dtype=np.float64)
    for other in others:
        columns = np.asarray(other, dtype=np.float64).T
        result = np.array([[math.fsum(row * column) for column in columns] for row in result])
    return result
