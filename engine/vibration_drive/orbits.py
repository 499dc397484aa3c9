"""Orbits of the strobe map: how far two strobes are apart, and which orbit a run seems to approach.

All of it works on one case, in fixed order and without a library of linear algebra, so that a case's bits do not
depend on its batch. Distances are scaled: speeds by the case's largest speed at recent strobes, angles by that over nu.
A pendulum without a spring that has turned over is where it was: its angles may count without whole turns.
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
_TURN = 2.0 * math.pi


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
def whole_turns(angle: float) -> float:
    """The number of whole turns that is nearest to an angle in rad."""
    return math.floor(angle / _TURN + 0.5)


@part
def _count_turns(a: Floats, b: Floats, free: Flags, windings: Ints) -> bool:
    """Write the whole turns that pendulums without a spring have made from strobe ``b`` to ``a``; whether any has."""
    turned = False
    for i in range(windings.shape[0]):
        angle = SHAFT_WIDTH + i * PENDULUM_WIDTH + ANGLE
        windings[i] = int(whole_turns(a[angle] - b[angle])) if free[i] else 0
        turned |= windings[i] != 0
    return turned


@part
def distance(a: Floats, b: Floats, unit: Floats, windings: Ints) -> float:
    """Largest scaled difference of two strobes; infinite where the states of clutches or shaft differ.

    ``unit`` has a column for each of a strobe's: what counts as 1. ``windings`` are the whole turns that each pendulum
    has made from ``b`` to ``a``, which do not count.
    """
    if not same_states(a, b):
        return math.inf
    largest = abs(a[SHAFT_SPEED] - b[SHAFT_SPEED]) / unit[SHAFT_SPEED]
    for column in range(SHAFT_WIDTH, a.shape[0], PENDULUM_WIDTH):
        for k in (ANGLE, SPEED, WINDUP):
            if k == WINDUP and (a[column + CLUTCH] == _FREE or a[column + CLUTCH] == _LOCKED):
                continue
            apart = a[column + k] - b[column + k]
            if k == ANGLE:
                apart -= _TURN * windings[(column - SHAFT_WIDTH) // PENDULUM_WIDTH]
            largest = max(largest, abs(apart) / unit[column + k])
    return float(largest)


@part
def _spread(a: Floats, b: Floats, unit: Floats, windings: Ints) -> float:
    """Largest scaled difference of the speeds and angles of two strobes, whatever their states; ``windings`` are those
    of `distance`.
    """
    largest = abs(a[SHAFT_SPEED] - b[SHAFT_SPEED]) / unit[SHAFT_SPEED]
    for column in range(SHAFT_WIDTH, a.shape[0], PENDULUM_WIDTH):
        for k in (ANGLE, SPEED):
            apart = a[column + k] - b[column + k]
            if k == ANGLE:
                apart -= _TURN * windings[(column - SHAFT_WIDTH) // PENDULUM_WIDTH]
            largest = max(largest, abs(apart) / unit[column + k])
    return float(largest)


@part
def _apart(strobes: Floats, last: int, length: int, order: int, unit: Floats, windings: Ints, enough: float) -> float:
    """Largest distance of the ``length`` strobes up to ``last`` from those ``order`` periods before them, or some
    distance above ``enough``.
    """
    largest = 0.0
    for j in range(last, last - length, -1):
        largest = max(largest, distance(strobes[j], strobes[j - order], unit, windings))
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
    strobes: Floats, cases: Ints, count: int, recent: int, nu: Floats, steady_shaft: bool, free: Flags, units: Floats
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
    free : array, shape (cases, pendulums)
        Pendulums whose angles count without whole turns.
    units : array, shape (cases, columns)
    """
    for case in range(cases.shape[0]):
        speed = 1e-300
        for k in range(strobes.shape[1] - min(count, recent), strobes.shape[1]):
            row = strobes[cases[case], k]
            if not steady_shaft:
                speed = max(speed, abs(row[SHAFT_SPEED]))
            for column in range(SHAFT_WIDTH, row.shape[0], PENDULUM_WIDTH):
                angle = row[column + ANGLE]
                if free[case, (column - SHAFT_WIDTH) // PENDULUM_WIDTH]:
                    angle -= _TURN * whole_turns(angle)
                speed = max(speed, abs(row[column + SPEED]), abs(angle) * nu[case])
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
    free: Flags,
    windings: Ints,
    found: Ints,
) -> None:
    """Write the order of an orbit that each case seems to approach, or 0.

    A run approaches an orbit of order q if its last strobes (q of them, at least ``window``) are within ``near`` and
    ``shared``/q of those q periods before, and nearer than the strobes before them were: a run that leaves an unstable
    orbit moves ever faster. The least such order counts, unless strobes come much nearer after a longer one: beside an
    orbit whose period has doubled, strobes also nearly repeat after half of it. ``strobes``, ``cases`` and ``count``
    are as of `find_units`.

    A case with pendulums that are ``free`` (shape (cases, pendulums)) seems to approach an orbit along which one of
    them turns over; ``windings``, of this shape, gets the whole turns of each.
    """
    last = strobes.shape[1] - 1
    turns = np.zeros(free.shape[1], dtype=np.int64)
    for case in range(cases.shape[0]):
        found[case] = 0
        windings[case] = 0
        rotates = False
        for i in range(free.shape[1]):
            rotates |= free[case, i]
        own = strobes[cases[case]]
        best = math.inf
        for order in range(1, max_order + 1):
            length = max(order, window)
            if count < 2 * length + order:
                break
            if rotates and not _count_turns(own[last], own[last - order], free[case], turns):
                continue
            enough = min(near, shared / order, best)
            now = _apart(own, last, length, order, units[case], turns, enough)
            if now > enough:
                continue
            if now < _apart(own, last - length, length, order, units[case], turns, now) or now < _ARRIVED:
                found[case] = order
                windings[case] = turns
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
    free: Flags,
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
    free : array, shape (cases, pendulums)
        As of `find_units`.
    found : array, shape (cases,)
    """
    last = strobes.shape[1] - 1
    third = count // 3
    windings = np.zeros(free.shape[1], dtype=np.int64)
    for case in range(cases.shape[0]):
        own, order = strobes[cases[case]], orders[case]
        early = late = 0.0
        for k in range(third):
            at = turns[case, (order - 1 - k) % order]
            _count_turns(own[last - k], at, free[case], windings)
            newer = _spread(own[last - k], at, units[case], windings)
            before = k + 2 * third
            at = turns[case, (order - 1 - before) % order]
            _count_turns(own[last - before], at, free[case], windings)
            older = _spread(own[last - before], at, units[case], windings)
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
def find_least(
    points: Floats, strobes: Floats, orders: Ints, windings: Ints, units: Floats, same: float, least: Ints
) -> None:
    """Write the least divisor of each order after which an orbit is back at its point already.

    Parameters
    ----------
    points : array, shape (orbits, columns)
    strobes : array, shape (orbits, strobes, columns)
        Of the run that begins at the point.
    orders : array, shape (orbits,)
    windings : array, shape (orbits, pendulums)
        Whole turns of each pendulum in that many periods.
    units : array, shape (orbits, columns)
    same : float
        Scaled distance below which strobes are the same.
    least : array, shape (orbits,)
    """
    turns = np.zeros(windings.shape[1], dtype=np.int64)
    for k in range(points.shape[0]):
        least[k] = orders[k]
        for order in range(1, orders[k]):
            whole = orders[k] % order == 0
            for i in range(windings.shape[1]):
                whole &= windings[k, i] * order % orders[k] == 0
                turns[i] = windings[k, i] * order // orders[k]
            if whole and distance(strobes[k, order - 1], points[k], units[k], turns) < same:
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
    windings = np.zeros((base.shape[2] - SHAFT_WIDTH) // PENDULUM_WIDTH, dtype=np.int64)
    for case in range(base.shape[0]):
        grown[case] = 0.0
        periods[case] = 0
        direction[case] = 1.0
        for k in range(base.shape[1]):
            apart = _spread(base[case, k], other[case, k], units[case], windings)
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
def distances(a: Floats, b: Floats, units: Floats, free: Flags, found: Floats) -> None:
    """Write the distance of each row of ``a`` to the row of ``b``, where pendulums are ``free`` (shape (rows,
    pendulums)) without whole turns.
    """
    windings = np.zeros(free.shape[1], dtype=np.int64)
    for k in range(a.shape[0]):
        _count_turns(a[k], b[k], free[k], windings)
        found[k] = distance(a[k], b[k], units[k], windings)


@compiled
def without_turns(strobes: Floats, free: Flags) -> None:
    """Take whole turns from angles, in place, so that they are between -pi and pi.

    Parameters
    ----------
    strobes : array, shape (cases, strobes, columns)
    free : array, shape (cases, pendulums)
        The pendulums whose angles these are.
    """
    for case in range(strobes.shape[0]):
        for i in range(free.shape[1]):
            angle = SHAFT_WIDTH + i * PENDULUM_WIDTH + ANGLE
            for k in range(strobes.shape[1] if free[case, i] else 0):
                strobes[case, k, angle] -= _TURN * whole_turns(strobes[case, k, angle])
