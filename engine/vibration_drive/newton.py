"""Newton's method for orbits of the strobe map: disturbed runs, the step, the largest multiplier.

It works on one case at a time, in fixed order and without a library of linear algebra, so that a case's bits do not
depend on its batch.
"""

import math

import numpy as np
from numpy.typing import NDArray

from sprag.engine.compile.jit import compiled, part
from sprag.engine.vibration_drive.orbits import list_free, same_states, tie

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Rises of the power of two in the power method that squares: beyond it nothing changes any more.
_SQUARINGS = 44
#: Columns of what `step` tells of a point: scaled residual, scaled step, multiplier, whether the states agree.
RESIDUAL, STEP, MULTIPLIER, AGREES = range(4)


@compiled
def disturb(points: Floats, units: Floats, size: float, steady_shaft: bool, starts: Floats, first: Ints) -> int:
    """Fill ``starts`` with each point and the points disturbed by ``size`` (scaled) in each free column.

    ``first`` (shape (points + 1,)) gets the place of each point's first row, and the number of rows; gives that number.
    """
    columns = np.zeros(points.shape[1], dtype=np.int64)
    row = 0
    for k in range(points.shape[0]):
        first[k] = row
        starts[row] = points[k]
        row += 1
        for j in range(list_free(points[k], steady_shaft, columns)):
            starts[row] = points[k]
            starts[row, columns[j]] += size * units[k, columns[j]]
            tie(starts[row])
            row += 1
    first[points.shape[0]] = row
    return row


@compiled
def _disturb(starts: Floats, direction: Floats, units: Floats, size: float, out: Floats) -> None:
    columns = np.zeros(starts.shape[1], dtype=np.int64)
    for case in range(starts.shape[0]):
        out[case] = starts[case]
        for j in range(list_free(starts[case], False, columns)):
            column = columns[j]
            out[case, column] += size * direction[case, column] * units[case, column]
        tie(out[case])


def disturbed(starts: Floats, direction: Floats, units: Floats, size: float) -> Floats:
    """States moved by ``size`` (scaled) along a direction, in the columns that are free."""
    out = np.empty_like(starts)
    _disturb(starts, direction, units, size, out)
    return out


@part
def _solve(a: Floats, b: Floats, n: int) -> bool:
    """Solve ``a x = b`` in place by elimination with partial pivoting; False where ``a`` is singular."""
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(a[i, k]) > abs(a[pivot, k]):
                pivot = i
        if a[pivot, k] == 0.0:
            return False
        if pivot != k:
            for j in range(k, n):
                a[k, j], a[pivot, j] = a[pivot, j], a[k, j]
            b[k], b[pivot] = b[pivot], b[k]
        for i in range(k + 1, n):
            factor = a[i, k] / a[k, k]
            for j in range(k + 1, n):
                a[i, j] -= factor * a[k, j]
            b[i] -= factor * b[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            b[k] -= a[k, j] * b[j]
        b[k] /= a[k, k]
    return True


@part
def spectral_radius(a: Floats, n: int) -> float:
    """Largest modulus of the eigenvalues of the leading n x n part of ``a``: ||A^m||^(1/m) for m = 2^k.

    Each squaring's rounding error counts with 1/m, so the result is good to rounding; ``a`` is left as it was.
    """
    power = a[:n, :n].copy()
    square = np.empty((n, n))
    log_norm = 0.0
    share = 1.0
    for _ in range(_SQUARINGS):
        norm = 0.0
        for i in range(n):
            total = 0.0
            for j in range(n):
                total += abs(power[i, j])
            norm = max(norm, total)
        if norm == 0.0:
            return 0.0
        log_norm += share * math.log(norm)
        for i in range(n):
            for j in range(n):
                power[i, j] /= norm
        for i in range(n):
            for j in range(n):
                total = 0.0
                for k in range(n):
                    total += power[i, k] * power[k, j]
                square[i, j] = total
        power, square = square, power
        share *= 0.5
    return math.exp(log_norm)


@compiled
def step(
    points: Floats,
    ends: Floats,
    first: Ints,
    units: Floats,
    size: float,
    steady_shaft: bool,
    moved: Floats,
    told: Floats,
) -> None:
    """Newton's step for fixed points of the iterated strobe map.

    Parameters
    ----------
    points : array, shape (points, columns)
    ends : array, shape (rows, columns)
        Where the rows of `disturb` came to.
    first, units, size, steady_shaft :
        As of `disturb`.
    moved : array, shape (points, columns)
        Gets the points after the step.
    told : array, shape (points, 4)
        Gets the columns named above.
    """
    width = points.shape[1]
    columns = np.zeros(width, dtype=np.int64)
    jacobian = np.zeros((width, width))
    matrix = np.zeros((width, width))
    move = np.zeros(width)
    for k in range(points.shape[0]):
        n = list_free(points[k], steady_shaft, columns)
        moved[k] = points[k]
        told[k, RESIDUAL] = told[k, STEP] = told[k, MULTIPLIER] = math.inf
        agrees = True
        for row in range(first[k], first[k + 1]):
            agrees &= same_states(points[k], ends[row])
        told[k, AGREES] = 1.0 if agrees else 0.0
        if not agrees:
            continue
        base = ends[first[k]]
        for i in range(n):
            for j in range(n):
                change = ends[first[k] + 1 + j, columns[i]] - base[columns[i]]
                jacobian[i, j] = change / (units[k, columns[i]] * size)
                matrix[i, j] = (1.0 if i == j else 0.0) - jacobian[i, j]
            move[i] = (base[columns[i]] - points[k, columns[i]]) / units[k, columns[i]]
        residual = 0.0
        for i in range(n):
            residual = max(residual, abs(move[i]))
        told[k, RESIDUAL] = residual
        told[k, MULTIPLIER] = spectral_radius(jacobian, n)
        if not _solve(matrix, move, n):
            continue
        largest = 0.0
        for i in range(n):
            largest = max(largest, abs(move[i]))
            moved[k, columns[i]] += move[i] * units[k, columns[i]]
        tie(moved[k])
        told[k, STEP] = largest
