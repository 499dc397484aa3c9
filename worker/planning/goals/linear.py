"""Small linear algebra by sums and products in a fixed order: LAPACK's bits depend on the processor."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def cholesky(matrix: Floats) -> Floats:
    """The lower triangular factor L of a symmetric positive definite matrix L L', shape (n, n).

    Raises
    ------
    ValueError
        If the matrix is not positive definite to rounding.
    """
    rest = matrix.copy()
    factor = np.zeros_like(rest)
    for j in range(len(rest)):
        pivot = float(rest[j, j])
        if not 0.0 < pivot < math.inf:
            raise ValueError("the matrix is not positive definite")
        factor[j:, j] = rest[j:, j] / math.sqrt(pivot)
        rest[j:, j:] -= factor[j:, j, None] * factor[None, j:, j]
    return factor


def lower_solved(factor: Floats, right: Floats) -> Floats:
    """The solution x, shape (n,), of a lower triangular system."""
    x = right.copy()
    for j in range(len(x)):
        x[j] /= factor[j, j]
        x[j + 1 :] -= factor[j + 1 :, j] * x[j]
    return x


def solved(matrix: Floats, right: Floats) -> Floats:
    """The solution x, shape (n,), of a symmetric positive definite system.

    Raises
    ------
    ValueError
        As of ``cholesky``.
    """
    return both_solved(cholesky(matrix), right)


def both_solved(factor: Floats, right: Floats) -> Floats:
    """The solution x, shape (n,), of the system L L'x = right with the lower triangular ``factor`` L."""
    x = lower_solved(factor, right)
    for j in reversed(range(len(x))):
        x[j] /= factor[j, j]
        x[:j] -= factor[j, :j] * x[j]
    return x


def weighted_sum(weights: Floats, rows: Floats) -> Floats:
    """The sum of ``rows``, shape (k, ...), times ``weights``, shape (k,), in the order of the rows."""
    total = np.zeros(rows.shape[1:])
    for weight, row in zip(weights.tolist(), rows, strict=True):
        total += weight * row
    return total


def summed(rows: Floats) -> Floats:
    """The sum of ``rows``, shape (k, ...) with at least one row, in their order: each adds to the sum before."""
    return np.asarray(np.add.accumulate(rows, axis=0)[-1])


def norm(vector: Floats) -> float:
    """Euclidean norm."""
    return math.sqrt(math.fsum((vector * vector).tolist()))
