"""Singular values to high relative accuracy, for matrices whose columns differ in size by many powers of ten."""

import math

import numpy as np
from numpy.typing import NDArray

_EPS = float(np.finfo(np.float64).eps)
_MAX_SWEEPS = 60  # a handful is usual; the process converges quadratically


def singular_values(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Singular values of a small real matrix, largest first, by one-sided Jacobi rotations.

    Columns u^k of angles around 1e-3 rad differ by twenty powers of ten, and the usual SVD would lose every singular
    value below 1e-16 of the largest one. One-sided Jacobi keeps a relative accuracy of about rounding times the
    condition number of the matrix with its columns scaled to unit length, however different those lengths are
    (J. Demmel and K. Veselic, "Jacobi's method is more accurate than QR", SIAM J. Matrix Anal. Appl. 13, 1992).

    Parameters
    ----------
    matrix : ndarray, shape (m, n)

    Returns
    -------
    ndarray, shape (n,)
    """
    columns = np.array(matrix, dtype=np.float64).T.copy()  # one row per column of the matrix
    for _ in range(_MAX_SWEEPS):
        columns = columns[np.argsort(-np.linalg.norm(columns, axis=1), kind="stable")]
        if not _sweep(columns):
            break
    return np.sort(np.linalg.norm(columns, axis=1))[::-1]


def _sweep(columns: NDArray[np.float64]) -> bool:
    """Make each pair of columns orthogonal once, in place; whether any pair was not already."""
    rotated = False
    for i in range(len(columns) - 1):
        for j in range(i + 1, len(columns)):
            a, b = columns[i].copy(), columns[j].copy()
            norm_a, norm_b, product = float(np.linalg.norm(a)), float(np.linalg.norm(b)), float(a @ b)
            if abs(product) <= 4.0 * _EPS * norm_a * norm_b:
                continue
            zeta = (norm_b - norm_a) * (norm_b + norm_a) / (2.0 * product)
            tangent = math.copysign(1.0, zeta) / (abs(zeta) + math.hypot(1.0, zeta))
            cosine = 1.0 / math.hypot(1.0, tangent)
            columns[i] = cosine * (a - tangent * b)
            columns[j] = cosine * (tangent * a + b)
            rotated = True
    return rotated
