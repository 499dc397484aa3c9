"""Newton's method for orbits of the strobe map: disturbed runs, the step, the largest multiplier.

It works on one case at a time, in fixed order and without a library of linear algebra, so that a case's bits do not
depend on its batch.
"""

import math

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.compile.jit import compiled, part
from sprag_study.engine.elementary.powers import exponential, logarithm
from sprag_study.engine.vibration_drive.orbits import list_free, same_states, tie
from sprag_study.engine.vibration_drive.strobes import ANGLE, PENDULUM_WIDTH, SHAFT_WIDTH, WINDUP

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]

#: Squarings in the power method, after which the result no longer changes.
_SQUARINGS = 44
#: Columns of the report of `step` about a point: scaled residual, scaled step, multiplier, whether the states agree.
RESIDUAL, STEP, MULTIPLIER, AGREES = range(4)
_TURN = 2.0 * math.pi


@compiled
def disturb(points: Floats, units: Floats, size: float, steady_shaft: bool, starts: Floats, first: Ints) -> int:
    """Fill ``starts`` with each point and the points disturbed by ``size`` (scaled) in each free column.

    ``first`` (shape (points + 1,)) gets the index of each point's first row, and the number of rows, which is returned.
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
        log_norm += share * logarithm(norm)
        for i in range(n):
            for j in range(n):
                power[i, j] /= norm
        for i in range(n):
            square[i] = 0.0
            for k in range(n):
                for j in range(n):
                    square[i, j] += power[i, k] * power[k, j]
        power, square = square, power
        share *= 0.5
    return exponential(log_norm)


@part
def _place(columns: Ints, n: int, column: int) -> int:
    """Position of a column among the first ``n``; -1 where it is missing."""
    for k in range(n):
        if columns[k] == column:
            return k
    return -1


@part
def _tie_windups(jacobian: Floats, move: Floats, columns: Ints, n: int, tied: Flags) -> int:
    """Let windups of tied clutches move with their angles, and locked pendulums not at all; returns the remaining
    columns.

    The angle of a tied clutch's pendulum and its windup differ by a constant. Another constant gives another orbit, not
    a disturbance that must decay.
    """
    for i in range(tied.shape[0]):
        if not tied[i]:
            continue
        base = SHAFT_WIDTH + i * PENDULUM_WIDTH
        gone = _place(columns, n, base + WINDUP)
        angle = _place(columns, n, base + ANGLE)
        if gone >= 0:
            for row in range(n):
                jacobian[row, angle] += jacobian[row, gone]
        else:
            gone = angle
        n -= 1
        for row in range(gone, n):
            columns[row], move[row] = columns[row + 1], move[row + 1]
            for column in range(n + 1):
                jacobian[row, column] = jacobian[row + 1, column]
        for column in range(gone, n):
            for row in range(n):
                jacobian[row, column] = jacobian[row, column + 1]
    return n


@compiled
def step(
    points: Floats,
    ends: Floats,
    first: Ints,
    units: Floats,
    size: float,
    steady_shaft: bool,
    tied: Flags,
    windings: Ints,
    moved: Floats,
    told: Floats,
) -> None:
    """Newton's step for fixed points of the iterated strobe map, up to whole turns of the pendulums.

    Parameters
    ----------
    points : array, shape (points, columns)
    ends : array, shape (rows, columns)
        End states of the rows of `disturb`.
    first, units, size, steady_shaft :
        As of `disturb`.
    tied : array, shape (points, pendulums)
        Clutches that stay as they are between pendulum and a held shaft (`characteristics.tied_clutches`).
    windings : array, shape (points, pendulums)
        Whole turns that each pendulum makes from a point to its end state.
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
            apart = base[columns[i]] - points[k, columns[i]]
            if columns[i] >= SHAFT_WIDTH and (columns[i] - SHAFT_WIDTH) % PENDULUM_WIDTH == ANGLE:
                apart -= _TURN * windings[k, (columns[i] - SHAFT_WIDTH) // PENDULUM_WIDTH]
            move[i] = apart / units[k, columns[i]]
        residual = 0.0
        for i in range(n):
            residual = max(residual, abs(move[i]))
        told[k, RESIDUAL] = residual
        n = _tie_windups(jacobian, move, columns, n, tied[k])
        told[k, MULTIPLIER] = spectral_radius(jacobian, n)
        for i in range(n):
            for j in range(n):
                matrix[i, j] = (1.0 if i == j else 0.0) - jacobian[i, j]
        if not _solve(matrix, move, n):
            continue
        largest = 0.0
        for i in range(n):
            largest = max(largest, abs(move[i]))
            moved[k, columns[i]] += move[i] * units[k, columns[i]]
        for i in range(tied.shape[1]):
            base = SHAFT_WIDTH + i * PENDULUM_WIDTH
            if tied[k, i]:
                moved[k, base + WINDUP] += moved[k, base + ANGLE] - points[k, base + ANGLE]
        tie(moved[k])
        told[k, STEP] = largest
