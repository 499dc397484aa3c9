"""Orbits of the strobe map: how far two strobes are apart, and which orbit a run seems to approach.

All of it works on one case, in fixed order and without a library of linear algebra, so that a case's bits do not
depend on its batch. Distances are scaled: speeds by the case's largest speed at recent strobes, angles by that over nu.
"""

import math

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.compile.jit import compiled, part
from sprag_study.engine.elementary.powers import exponential, logarithm
from sprag_study.engine.vibration_drive.automaton import Clutch, Shaft
from sprag_study.engine.vibration_drive.strobes import (
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
Flags = NDArray[np.bool_]

_FREE, _LOCKED = float(Clutch.FREE), float(Clutch.LOCKED)
_ROTATING = float(Shaft.ROTATING)
#: Scaled distance at which rounding decides whether strobes come nearer.
_ARRIVED = 1e-9
#: A longer order is tried instead of a shorter one if it repeats strobes this much better.
_BETTER = 0.03


@part
def same_states(a: Floats, b: Floats) -> bool:
    """Whether the clutches and the shaft are in the same states at two strobes."""
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
    if not same_states(a, b):
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
def keep_strobes(history: Floats, cases: Ints, strobes: Floats) -> None:
    """Put new strobes of some cases behind those that are there, whose oldest go.

    Parameters
    ----------
    history : array, shape (all cases, kept, columns)
    cases : array, shape (cases,)
        Rows of ``history``.
    strobes : array, shape (cases, new, columns)
    """
    kept, new = history.shape[1], strobes.shape[1]
    for k in range(cases.shape[0]):
        own = history[cases[k]]
        for row in range(kept):
            for column in range(history.shape[2]):
                later = row + new
                own[row, column] = own[later, column] if later < kept else strobes[k, later - kept, column]


@compiled
def find_units(
    strobes: Floats, cases: Ints, count: int, recent: int, nu: Floats, steady_shaft: bool, units: Floats
) -> None:
    """Write the scale of every column of the strobes of some cases.

    Parameters
    ----------
    strobes : array, shape (all cases, kept, columns)
    cases : array, shape (cases,)
        Rows of ``strobes``.
    count, recent : int
        How many of the kept strobes there are (the last ones), and how many of them count at most.
    nu : array, shape (cases,)
    steady_shaft : bool
        Whether the shaft's speed is left out.
    units : array, shape (cases, columns)
    """
    for case in range(cases.shape[0]):
        speed = 1e-300
        for k in range(strobes.shape[1] - min(count, recent), strobes.shape[1]):
            row = strobes[cases[case], k]
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
def find_candidates(
    strobes: Floats,
    cases: Ints,
    count: int,
    units: Floats,
    near: float,
    shared: float,
    window: int,
    max_order: int,
    found: Ints,
) -> None:
    """Write the order of an orbit that each case seems to approach, or 0.

    A run approaches an orbit of order q if its last strobes (q of them, at least ``window``) are within ``near`` and
    ``shared``/q of those q periods before, and nearer than the strobes before them were: a run that leaves an unstable
    orbit moves ever faster. The least such order counts, unless strobes come much nearer after a longer one: beside an
    orbit whose period has doubled, strobes also nearly repeat after half of it. ``strobes``, ``cases`` and ``count``
    are as of `find_units`.
    """
    last = strobes.shape[1] - 1
    for case in range(cases.shape[0]):
        found[case] = 0
        own = strobes[cases[case]]
        best = math.inf
        for order in range(1, max_order + 1):
            length = max(order, window)
            if count < 2 * length + order:
                break
            enough = min(near, shared / order, best)
            now = _apart(own, last, length, order, units[case], enough)
            if now > enough:
                continue
            if now < _apart(own, last - length, length, order, units[case], now) or now < _ARRIVED:
                found[case] = order
                best = _BETTER * now


@compiled
def find_approaching(
    strobes: Floats,
    cases: Ints,
    count: int,
    turns: Floats,
    orders: Ints,
    units: Floats,
    multipliers: Floats,
    found: Flags,
) -> None:
    """Write whether runs come nearer to their orbits, at no less than half the rate of the orbits' multipliers.

    The largest distances among the first and the last third of the kept strobes are compared, whatever the states:
    events may come close to the strobes.

    Parameters
    ----------
    strobes, cases, count :
        As of `find_units`.
    turns : array, shape (cases, periods, columns)
        Strobes of the turn that begins at the orbit's point nearest to the newest strobe.
    orders, multipliers : array, shape (cases,)
    units : array, shape (cases, columns)
    found : array, shape (cases,)
    """
    last = strobes.shape[1] - 1
    third = count // 3
    for case in range(cases.shape[0]):
        own, order = strobes[cases[case]], orders[case]
        early = late = 0.0
        for k in range(third):
            newer = _spread(own[last - k], turns[case, (order - 1 - k) % order], units[case])
            before = k + 2 * third
            older = _spread(own[last - before], turns[case, (order - 1 - before) % order], units[case])
            early, late = max(early, older), max(late, newer)
        rate = logarithm(multipliers[case]) / order if multipliers[case] > 0.0 else -math.inf
        found[case] = third > 0 and late < early * exponential(rate * third)


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
def tie(state: Floats) -> None:
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
            grown[case] = logarithm(apart / start)
            periods[case] = k + 1
            for column in range(base.shape[2]):
                difference = other[case, k, column] - base[case, k, column]
                direction[case, column] = difference / units[case, column] / apart


@compiled
def settling_periods(apart: Floats, orders: Ints, multipliers: Floats, settled: float, found: Floats) -> None:
    """Write in how many periods runs ``apart`` (scaled) from their orbits come within ``settled`` of them.

    Each turn, of ``orders`` periods, multiplies the distance by the multiplier. All arrays have shape (orbits,).
    """
    for k in range(apart.shape[0]):
        found[k] = 0.0
        if apart[k] > settled and 0.0 < multipliers[k] < 1.0:
            found[k] = orders[k] * logarithm(apart[k] / settled) / -logarithm(multipliers[k])


@compiled
def distances(a: Floats, b: Floats, units: Floats, found: Floats) -> None:
    """Write the distance of each row of ``a`` to the row of ``b``."""
    for k in range(a.shape[0]):
        found[k] = distance(a[k], b[k], units[k])
