"""Linear algebra of many small systems at once, by sums and products in a fixed order (see `goals.linear`).

The first axis counts the systems, which do not influence each other.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

#: A pivot below this, relative to its diagonal element, is taken as that much.
_LEAST_PIVOT = 1e-15


def total(terms: Floats) -> Floats:
    """The sum over the second axis, term after term."""
    result = np.zeros((terms.shape[0], *terms.shape[2:]))
    for k in range(terms.shape[1]):
        result += terms[:, k]
    return result


def normal(derivatives: Floats, weights: Floats) -> Floats:
    """J' W J, shape (systems, p, p), of J (systems, n, p) and the diagonal of W (systems, n)."""
    weighted = derivatives * weights[:, :, None]
    result = np.zeros((len(derivatives), derivatives.shape[2], derivatives.shape[2]))
    for k in range(derivatives.shape[1]):
        result += weighted[:, k, :, None] * derivatives[:, k, None, :]
    return result


def solved(matrices: Floats, right: Floats) -> Floats:
    """Solutions, shape (systems, p), of symmetric positive definite systems, by their Cholesky factors."""
    p = matrices.shape[1]
    rest, x = matrices.copy(), right.copy()
    factor = np.zeros_like(rest)
    diagonal = np.maximum(np.diagonal(matrices, axis1=1, axis2=2), 1e-300)
    for j in range(p):
        pivot = np.sqrt(np.maximum(rest[:, j, j], _LEAST_PIVOT * diagonal[:, j]))
        factor[:, j:, j] = rest[:, j:, j] / pivot[:, None]
        factor[:, j, j] = pivot
        rest[:, j:, j:] -= factor[:, j:, j, None] * factor[:, None, j:, j]
    for j in range(p):
        x[:, j] /= factor[:, j, j]
        x[:, j + 1 :] -= factor[:, j + 1 :, j] * x[:, j, None]
    for j in reversed(range(p)):
        x[:, j] /= factor[:, j, j]
        x[:, :j] -= factor[:, j, :j] * x[:, j, None]
    return x


def bounded_steps(matrices: Floats, gradients: Floats, places: Floats) -> Floats:
    """Steps d that minimise g'd + d'Ad/2 with places + d within 0 .. 1, shape (systems, p).

    Coordinates that would leave are put on their bounds, one set after another, and the rest is solved again.
    """
    free = ~(((places <= 0.0) & (gradients > 0.0)) | ((places >= 1.0) & (gradients < 0.0)))
    steps = np.zeros_like(places)
    for _ in range(places.shape[1] + 1):
        fixed = np.where(free, 0.0, steps)
        right = -(gradients + total(np.swapaxes(matrices * fixed[:, None, :], 1, 2)))
        both = free[:, :, None] & free[:, None, :]
        system = np.where(both, matrices, np.where(np.eye(places.shape[1], dtype=np.bool_), 1.0, 0.0))
        steps = np.where(free, solved(system, np.where(free, right, 0.0)), fixed)
        aims = places + steps
        outside = free & ((aims < 0.0) | (aims > 1.0))
        if not outside.any():
            break
        steps = np.where(outside, np.clip(aims, 0.0, 1.0) - places, steps)
        free &= ~outside
    return steps
