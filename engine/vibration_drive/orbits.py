"""Orbits of the strobe map: how far two strobes are apart, which orbit a run seems to approach, Newton's step to it.

All of it works on one case, in fixed order and without a library of linear algebra, so that a case's bits do not
depend on its batch. Distances are scaled: speeds by the case's largest speed at recent strobes, angles by that over nu.
"""

import math

import numpy as np
from numpy.typing import NDArray

from engine.jit import compiled, part
from engine.vibration_drive.automaton import Clutch, Shaft
from engine.vibration_drive.strobes import (
    ANGLE,
    CLUTCH,
    FALLS,
    PENDULUM_WIDTH,
    SHAFT,
    SHAFT_SPEED,
    SHAFT_WIDTH,
    SPEED,
    WINDUP,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_FREE, _LOCKED = float(Clutch.FREE), float(Clutch.LOCKED)
_ROTATING = float(Shaft.ROTATING)
#: Scaled distance at which rounding decides whether strobes come nearer.
_ARRIVED = 1e-9
#: Rises of the power of two in the power method that squares: beyond it nothing changes any more.
_SQUARINGS = 44


@part
def _same_states(a: Floats, b: Floats) -> bool:
    if a[SHAFT] != b[SHAFT]:
        return False
    for column in range(SHAFT_WIDTH, a.shape[0], PENDULUM_WIDTH):
        if a[column + CLUTCH] != b[column + CLUTCH] or a[column + FALLS] != b[column + FALLS]:
            return False
    return True


@part
def distance(a: Floats, b: Floats, unit: Floats) -> float:
    """Largest scaled difference of two strobes; infinite where the states of clutches or shaft differ.

    ``unit`` has a column for each of a strobe's: what counts as 1.
    """
    if not _same_states(a, b):
        return math.inf
    largest = abs(a[SHAFT_SPEED] - b[SHAFT_SPEED]) / unit[SHAFT_SPEED]
    for column in range(SHAFT_WIDTH, a.shape[0], PENDULUM_WIDTH):
        for k in (ANGLE, SPEED, WINDUP):
            if k == WINDUP and (a[column + CLUTCH] == _FREE or a[column + CLUTCH] == _LOCKED):
                continue
            largest = max(largest, abs(a[column + k] - b[column + k]) / unit[column + k])
    return float(largest)


@part
def _spread(a: Floats, b: Floats, unit: Floats) -> float:
    """Largest scaled difference of the speeds and angles of two strobes, whatever their states."""
    largest = abs(a[SHAFT_SPEED] - b[SHAFT_SPEED]) / unit[SHAFT_SPEED]
    for column in range(SHAFT_WIDTH, a.shape[0], PENDULUM_WIDTH):
        for k in (ANGLE, SPEED):
            largest = max(largest, abs(a[column + k] - b[column + k]) / unit[column + k])
    return float(largest)


@part
def _apart(strobes: Floats, last: int, length: int, order: int, unit: Floats, enough: float) -> float:
    """Largest distance of the ``length`` strobes up to ``last`` from those ``order`` periods before them, or some
    distance above ``enough``.
    """
    largest = 0.0
    for j in range(last, last - length, -1):
        largest = max(largest, distance(strobes[j], strobes[j - order], unit))
        if largest > enough:
            break
    return largest


@compiled
def find_units(strobes: Floats, recent: int, nu: Floats, steady_shaft: bool, units: Floats) -> None:
    """Write the scale of every column of the strobes of every case.

    Parameters
    ----------
    strobes : array, shape (cases, kept, columns)
    recent : int
        How many of the last ones count.
    nu : array, shape (cases,)
    steady_shaft : bool
        Whether the shaft's speed is left out.
    units : array, shape (cases, columns)
    """
    for case in range(strobes.shape[0]):
        speed = 1e-300
        for k in range(max(0, strobes.shape[1] - recent), strobes.shape[1]):
            row = strobes[case, k]
            if not steady_shaft:
                speed = max(speed, abs(row[SHAFT_SPEED]))
            for column in range(SHAFT_WIDTH, row.shape[0], PENDULUM_WIDTH):
                speed = max(speed, abs(row[column + SPEED]), abs(row[column + ANGLE]) * nu[case])
        unit = units[case]
        unit[:] = 1.0
        unit[SHAFT_SPEED] = speed
        for column in range(SHAFT_WIDTH, unit.shape[0], PENDULUM_WIDTH):
            unit[column + ANGLE] = unit[column + WINDUP] = speed / nu[case]
            unit[column + SPEED] = speed


@compiled
def find_candidates(strobes: Floats, units: Floats, near: float, window: int, max_order: int, found: Ints) -> None:
    """Write the least order of an orbit that each case seems to approach, or 0.

    A run approaches an orbit of order q if its last strobes (q of them, at least ``window``) are within ``near`` of
    those q periods before, and nearer than the strobes before them were: a run that leaves an unstable orbit moves ever
    faster.
    """
    for case in range(strobes.shape[0]):
        found[case] = 0
        last = strobes.shape[1] - 1
        for order in range(1, max_order + 1):
            length = max(order, window)
            if last + 1 < 2 * length + order:
                break
            now = _apart(strobes[case], last, length, order, units[case], near)
            if now > near:
                continue
            if now < _apart(strobes[case], last - length, length, order, units[case], now) or now < _ARRIVED:
                found[case] = order
                break


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
            _tie(starts[row])
            row += 1
    first[points.shape[0]] = row
    return row


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


#: Columns of what `newton` tells of a point: scaled residual, scaled step, multiplier, whether the states agree.
RESIDUAL, STEP, MULTIPLIER, AGREES = range(4)


@compiled
def newton(
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
    step = np.zeros(width)
    for k in range(points.shape[0]):
        n = list_free(points[k], steady_shaft, columns)
        moved[k] = points[k]
        told[k, RESIDUAL] = told[k, STEP] = told[k, MULTIPLIER] = math.inf
        agrees = True
        for row in range(first[k], first[k + 1]):
            agrees &= _same_states(points[k], ends[row])
        told[k, AGREES] = 1.0 if agrees else 0.0
        if not agrees:
            continue
        base = ends[first[k]]
        for i in range(n):
            for j in range(n):
                change = ends[first[k] + 1 + j, columns[i]] - base[columns[i]]
                jacobian[i, j] = change / (units[k, columns[i]] * size)
                matrix[i, j] = (1.0 if i == j else 0.0) - jacobian[i, j]
            step[i] = (base[columns[i]] - points[k, columns[i]]) / units[k, columns[i]]
        residual = 0.0
        for i in range(n):
            residual = max(residual, abs(step[i]))
        told[k, RESIDUAL] = residual
        told[k, MULTIPLIER] = spectral_radius(jacobian, n)
        if not _solve(matrix, step, n):
            continue
        largest = 0.0
        for i in range(n):
            largest = max(largest, abs(step[i]))
            moved[k, columns[i]] += step[i] * units[k, columns[i]]
        _tie(moved[k])
        told[k, STEP] = largest


@part
def list_free(start: Floats, steady_shaft: bool, columns: Ints) -> int:
    """Write the columns of a strobe that are free in its states; how many there are.

    A free clutch has no windup, a held shaft no speed; a locked clutch has neither windup nor a speed of its own.
    """
    count = 0
    if start[SHAFT] == _ROTATING and not steady_shaft:
        columns[count] = SHAFT_SPEED
        count += 1
    for column in range(SHAFT_WIDTH, start.shape[0], PENDULUM_WIDTH):
        columns[count] = column + ANGLE
        count += 1
        if start[column + CLUTCH] == _LOCKED:
            continue
        columns[count] = column + SPEED
        count += 1
        if start[column + CLUTCH] != _FREE:
            columns[count] = column + WINDUP
            count += 1
    return count


@part
def _tie(state: Floats) -> None:
    """Give every locked pendulum the shaft's speed."""
    for column in range(SHAFT_WIDTH, state.shape[0], PENDULUM_WIDTH):
        if state[column + CLUTCH] == _LOCKED:
            state[column + SPEED] = state[SHAFT_SPEED]


@compiled
def find_least(points: Floats, strobes: Floats, orders: Ints, units: Floats, same: float, least: Ints) -> None:
    """Write the least divisor of each order after which an orbit is back at its point already.

    Parameters
    ----------
    points : array, shape (orbits, columns)
    strobes : array, shape (orbits, strobes, columns)
        Of the run that begins at the point.
    orders : array, shape (orbits,)
    units : array, shape (orbits, columns)
    same : float
        Scaled distance below which strobes are the same.
    least : array, shape (orbits,)
    """
    for k in range(points.shape[0]):
        least[k] = orders[k]
        for order in range(1, orders[k]):
            if orders[k] % order == 0 and distance(points[k], strobes[k, order - 1], units[k]) < same:
                least[k] = order
                break


@compiled
def growth(
    base: Floats,
    other: Floats,
    units: Floats,
    start: float,
    most: float,
    grown: Floats,
    periods: Ints,
    direction: Floats,
) -> None:
    """Write how much disturbed runs have moved away from their bases: the logarithm of it, and in how many periods.

    Parameters
    ----------
    base, other : array, shape (cases, strobes, columns)
        Strobes of two runs that began ``start`` (scaled) apart.
    most : float
        Distance from which on the runs do not tell of small disturbances any more; what comes later is left out.
    grown : array, shape (cases,)
    periods : array, shape (cases,)
    direction : array, shape (cases, columns)
        Gets the scaled difference at the last strobe that counts, its largest component 1 in modulus; ones where none
        counts.
    """
    for case in range(base.shape[0]):
        grown[case] = 0.0
        periods[case] = 0
        direction[case] = 1.0
        for k in range(base.shape[1]):
            apart = _spread(base[case, k], other[case, k], units[case])
            if not 0.0 < apart < most:
                break
            grown[case] = math.log(apart / start)
            periods[case] = k + 1
            for column in range(base.shape[2]):
                difference = other[case, k, column] - base[case, k, column]
                direction[case, column] = difference / units[case, column] / apart


@compiled
def _disturb(starts: Floats, direction: Floats, units: Floats, size: float, out: Floats) -> None:
    columns = np.zeros(starts.shape[1], dtype=np.int64)
    for case in range(starts.shape[0]):
        out[case] = starts[case]
        for j in range(list_free(starts[case], False, columns)):
            column = columns[j]
            out[case, column] += size * direction[case, column] * units[case, column]
        _tie(out[case])


def disturbed(starts: Floats, direction: Floats, units: Floats, size: float) -> Floats:
    """States moved by ``size`` (scaled) along a direction, in the columns that are free."""
    out = np.empty_like(starts)
    _disturb(starts, direction, units, size, out)
    return out


@compiled
def distances(a: Floats, b: Floats, units: Floats, found: Floats) -> None:
    """Write the distance of each row of ``a`` to the row of ``b``."""
    for k in range(a.shape[0]):
        found[k] = distance(a[k], b[k], units[k])
