"""Slow shafts: the speed at which the mean torque over a period equals what resists, with the pendulums slaved to it.

A heavy shaft changes its speed over thousands of excitation periods, while its pendulums follow within tens of them.
Its speed is therefore moved in steps, in the direction in which it changes by itself. After each step a short run shows
the order of the pendulums' motion and the pull on the shaft, the change of its speed per period. Where the pull
vanishes, Newton's method certifies the orbit. Every decision about a case follows from that case alone.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.compile.jit import compiled, part
from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.vibration_drive.automaton import Shaft
from sprag_study.engine.vibration_drive.cases import Column, with_lengths
from sprag_study.engine.vibration_drive.integration import integrate
from sprag_study.engine.vibration_drive.layout import OUT_ENDING, OUT_STEPS
from sprag_study.engine.vibration_drive.orbits import distance, find_units, same_states, tie
from sprag_study.engine.vibration_drive.search import NEAR, SHARED, WINDOW, Orbits, Search, joined
from sprag_study.engine.vibration_drive.strobes import (
    ANGLE,
    BEGIN,
    PENDULUM_WIDTH,
    SHAFT,
    SHAFT_SPEED,
    SHAFT_WIDTH,
    SPEED,
    TURN,
    WINDUP,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Periods of the run after each step: a multiple of most low orders, so that its end has the phase of its beginning.
_PERIODS = 24
#: Runs that a case takes at most in a march.
_MOST_RUNS = 20
#: Periods over which the pull is measured, rounded down to whole turns of the motion.
_OVER = 8
#: Steps of the speed as shares of its scale: the first, the least that is shortened no more, and the largest.
_FIRST, _LEAST, _LARGEST = 0.05, 0.003, 0.15
#: The largest step where the pull is within this share of the expected one, as that of a shaft that nothing drives.
_EXACT, _FARTHEST = 0.01, 0.45
#: The first step is at most so many periods of the pull: before it nothing is known of how the pull changes.
_AHEAD = 200.0
#: By how much a step may grow after a good one, and shrink after another.
_GROWS, _SHRINKS = 2.0, 0.4
#: How far a pull may be from the expected one, relative to the larger of it and the one before; without a slope, up to
#: this factor of the one before, with its sign.
_AS_EXPECTED, _WITHOUT_SLOPE = 0.25, 1.5
#: Scaled distance from the expected end at which Newton's method begins, and how often it may fail.
_CLOSE, _ATTEMPTS = 0.01, 4
#: No step takes more than this share of the speed away.
_SLOWER = 0.5
_ROTATING = float(Shaft.ROTATING)
_OK = ENDINGS.index(Ending.OK)

#: Columns of a case's state: scale of speeds, pull, order, pull and order before the last step, the next step (rad/s),
#: largest step as share of the scale, sign of the first pull, failed attempts, whether the last run goes on.
UNIT, PULL, ORDER, PULL_BEFORE, ORDER_BEFORE, MOVE, SHARE, SENSE, FAILED, WAITS = range(10)
_WIDTH = 10
#: What `steer` says of a case: it goes on, Newton's method should begin, it leaves.
GOES, TRIES, LEAVES = range(3)


@part
def _order(strobes: Floats, unit: Floats, max_order: int) -> int:
    """Least order after which the last strobes of a run repeat, up to the slow change; 0: none."""
    last = strobes.shape[0] - 1
    unwound = np.zeros((strobes.shape[1] - SHAFT_WIDTH) // PENDULUM_WIDTH, dtype=np.int64)
    for order in range(1, max_order + 1):
        length = max(order, WINDOW)
        if length + order > strobes.shape[0]:
            break
        apart = 0.0
        for j in range(length):
            apart = max(apart, distance(strobes[last - j], strobes[last - j - order], unit, unwound))
        if apart <= min(NEAR, SHARED / order):
            return order
    return 0


@part
def _pull(strobes: Floats, order: int) -> float:
    """Change of the shaft's speed per period at the end of a run, over whole turns of the motion."""
    over = order * max(1, _OVER // order)
    last = strobes.shape[0] - 1
    change: float = (strobes[last, SHAFT_SPEED] - strobes[last - over, SHAFT_SPEED]) / over
    return change


@part
def _slope(base: Floats, before: Floats, state: Floats) -> float:
    """Change of the pull with the speed between the last two points; 0 where there are none."""
    if state[ORDER_BEFORE] == 0.0 or base[SHAFT_SPEED] == before[SHAFT_SPEED]:
        return 0.0
    slope: float = (state[PULL] - state[PULL_BEFORE]) / (base[SHAFT_SPEED] - before[SHAFT_SPEED])
    return slope


@part
def _error(pull: float, end: float, base: Floats, before: Floats, state: Floats) -> float:
    """How far a pull is from what the points before let expect at the speed ``end``, relative to the larger pull;
    infinite where it cannot belong to the same motion.
    """
    if state[ORDER_BEFORE] == 0.0:
        same = pull * state[PULL] > 0.0 and abs(pull) <= _WITHOUT_SLOPE * abs(state[PULL])
        return _AS_EXPECTED if same else math.inf
    expected = state[PULL] + _slope(base, before, state) * (end - base[SHAFT_SPEED])
    error: float = abs(pull - expected) / max(abs(pull), abs(state[PULL]), 1e-300)
    return error


@part
def _plan(base: Floats, before: Floats, state: Floats) -> int:
    """Decide on the next step from a point; whether Newton's method should begin there."""
    slope = _slope(base, before, state)
    reach = _AHEAD * abs(state[PULL]) if slope == 0.0 else math.inf
    if slope < 0.0:
        reach = abs(state[PULL] / slope)
    move = math.copysign(min(state[SHARE] * state[UNIT], reach), state[PULL])
    state[MOVE] = max(move, -_SLOWER * base[SHAFT_SPEED])
    return TRIES if slope < 0.0 and reach <= _CLOSE * state[UNIT] else GOES


@part
def _keep(base: Floats, before: Floats, state: Floats, end: Floats, unit: float, order: int, pull: float) -> None:
    """Take the end of a run as the next point."""
    before[:] = base
    state[PULL_BEFORE], state[ORDER_BEFORE] = state[PULL], state[ORDER]
    base[:] = end
    base[TURN] = 0.0
    state[UNIT], state[PULL], state[ORDER] = unit, pull, order


@part
def _steer(strobes: Floats, unit: Floats, max_order: int, base: Floats, before: Floats, state: Floats) -> int:
    end = strobes[strobes.shape[0] - 1]
    if end[SHAFT] != _ROTATING:
        return LEAVES
    order = _order(strobes, unit, max_order)
    if state[ORDER] == 0.0:
        pull = _pull(strobes, max(order, 1))
        _keep(base, before, state, end, unit[SHAFT_SPEED], order, pull)
        state[SHARE], state[SENSE] = _FIRST, math.copysign(1.0, pull)
        return LEAVES if order == 0 else _plan(base, before, state)
    if order == 0 and state[WAITS] == 0.0:
        # The pendulums may still be on their way from the motion at the last point to that at this one.
        state[WAITS] = 1.0
        return GOES
    state[WAITS] = 0.0
    pull = _pull(strobes, max(order, 1))
    error = _error(pull, end[SHAFT_SPEED], base, before, state)
    good = order > 0 and error <= _AS_EXPECTED
    if not good and abs(state[MOVE]) > _LEAST * state[UNIT]:
        state[MOVE] *= _SHRINKS
        state[SHARE] = abs(state[MOVE]) / state[UNIT]
        return GOES
    turned = pull * state[SENSE] < 0.0
    _keep(base, before, state, end, unit[SHAFT_SPEED], order, pull)
    if order == 0:
        return LEAVES
    if good:
        state[SHARE] = min(_LARGEST if error > _EXACT else _FARTHEST, _GROWS * state[SHARE])
        return _plan(base, before, state)
    if turned:
        # The pull vanishes within the least step: there is an orbit here, or the pendulums' motion ends.
        state[FAILED] = _ATTEMPTS
        return TRIES
    # The pendulums' motion has changed into another one, of which nothing is known yet.
    state[ORDER_BEFORE], state[SHARE] = 0.0, _FIRST
    return _plan(base, before, state)


@compiled
def go_back(bases: Floats, before: Floats, states: Floats) -> None:
    """Take back the last step of cases whose pull it has turned and whose orbit is not certified, for a shorter one."""
    for k in range(bases.shape[0]):
        state = states[k]
        state[FAILED] += 1.0
        if state[PULL] * state[SENSE] < 0.0:
            width = abs(bases[k, SHAFT_SPEED] - before[k, SHAFT_SPEED])
            bases[k] = before[k]
            state[PULL], state[ORDER], state[ORDER_BEFORE] = state[PULL_BEFORE], state[ORDER_BEFORE], 0.0
            state[MOVE] = math.copysign(_SHRINKS * width, state[SENSE])
            state[SHARE] = _SHRINKS * width / state[UNIT]


@compiled
def steer(
    strobes: Floats, units: Floats, max_order: int, bases: Floats, before: Floats, states: Floats, says: Ints
) -> None:
    """Judge the run of each case after a step of its speed, and decide on the next step.

    Parameters
    ----------
    strobes : array, shape (cases, periods, columns)
    units : array, shape (cases, columns)
        Scales of the strobes' columns.
    max_order : int
    bases, before : array, shape (cases, columns)
        Strobes at the last point and at the one before; are replaced where a step counts.
    states : array, shape (cases, 10)
        Columns named above.
    says : array, shape (cases,)
        Gets ``GOES``, ``TRIES`` or ``LEAVES``.
    """
    for k in range(strobes.shape[0]):
        says[k] = _steer(strobes[k], units[k], max_order, bases[k], before[k], states[k])


@compiled
def begin(bases: Floats, before: Floats, ends: Floats, states: Floats, rows: Floats) -> None:
    """Write the states with which cases begin: their last points with the speed moved, or the ends of runs that go on.

    The pendulums are moved along as they changed between the last two points, where these have the same phase of the
    same motion.
    """
    for k in range(bases.shape[0]):
        base, earlier, state, row = bases[k], before[k], states[k], rows[k]
        if state[WAITS] == 1.0:
            row[:] = ends[k]
            row[TURN] = 0.0
            continue
        row[:] = base
        row[SHAFT_SPEED] += state[MOVE]
        tie(row)
        order = int(state[ORDER])
        width = base[SHAFT_SPEED] - earlier[SHAFT_SPEED]
        if order == 0 or _PERIODS % order != 0 or state[ORDER_BEFORE] != state[ORDER] or width == 0.0:
            continue
        if not same_states(base, earlier):
            continue
        for column in range(SHAFT_WIDTH, row.shape[0], PENDULUM_WIDTH):
            for c in (ANGLE, SPEED, WINDUP):
                row[column + c] += state[MOVE] / width * (base[column + c] - earlier[column + c])
        tie(row)


@dataclass(slots=True)
class _Marches:
    """Speeds of slow shafts on their way; all arrays have a row for each of ``cases``.

    ``bases`` and ``before`` are the strobes at the last point and at the one before, ``ends`` those of the last run.
    """

    search: Search
    cases: Ints
    bases: Floats = field(init=False)
    before: Floats = field(init=False)
    ends: Floats = field(init=False)
    states: Floats = field(init=False)
    certified: list[Orbits] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.bases = self.search.starts[self.cases].copy()
        self.before, self.ends = self.bases.copy(), self.bases.copy()
        self.states = np.zeros((len(self.cases), _WIDTH))

    def go_on(self, active: Ints) -> Ints:
        """One run of some of the rows, and what follows from it; the rows that go on."""
        search, cases = self.search, self.cases[active]
        bases, before, states = self.bases[active], self.before[active], self.states[active]
        rows = np.empty_like(bases)
        begin(bases, before, self.ends[active], states, rows)
        periods = np.full(len(active), float(_PERIODS))
        matrix = with_lengths(search.matrix[cases], rows[:, BEGIN], periods, windowed=False)
        done = integrate(search.kernel, matrix, search.run, starts=rows, strobes=_PERIODS)
        search.spent[cases] += _PERIODS
        search.pay(cases, done.sums[:, OUT_STEPS])
        ran = done.sums[:, OUT_ENDING] == _OK
        active, cases, bases, before, states = active[ran], cases[ran], bases[ran], before[ran], states[ran]
        strobes, nu = done.strobes[ran], search.matrix[cases, Column.NU]
        units = np.empty_like(bases)
        unwound = np.zeros((len(active), search.kernel.LAYOUT.n), dtype=np.bool_)
        find_units(strobes, np.arange(len(active)), _PERIODS, _PERIODS, nu, False, unwound, units)
        says = np.empty(len(active), dtype=np.int64)
        steer(strobes, units, search.settings.max_period, bases, before, states, says)
        tries = np.flatnonzero(says == TRIES)
        says[tries] = self._try(cases[tries], bases, before, states, units, tries)
        self.bases[active], self.before[active], self.states[active] = bases, before, states
        self.ends[active] = strobes[:, -1]
        left: Ints = active[says != LEAVES]
        return left

    def _try(self, cases: Ints, bases: Floats, before: Floats, states: Floats, units: Floats, tries: Ints) -> Ints:
        """Newton's method from the points of the rows ``tries``; what is said of their cases then."""
        says = np.full(len(tries), LEAVES, dtype=np.int64)
        if not len(tries):
            return says
        orders = states[tries, ORDER].astype(np.int64)
        orbits = self.search.certify(cases, bases[tries], orders, units[tries], slaved=True)
        self.certified.append(self.search.of_least_order(orbits, slaved=True))
        failed = np.flatnonzero(~np.isin(cases, orbits.cases))
        for k in failed:
            row = slice(tries[k], tries[k] + 1)
            go_back(bases[row], before[row], states[row])
            says[k] = LEAVES if states[tries[k], FAILED] >= _ATTEMPTS else GOES
        return says


def march(search: Search, cases: Ints) -> tuple[Orbits, Floats]:
    """Bring the speeds of slow shafts to where they do not change any more.

    Parameters
    ----------
    search : Search
        Its runs, budgets and counts of periods are used; its cases stay where they are.
    cases : array, shape (cases,)

    Returns
    -------
    orbits : Orbits
        Those that are certified.
    points : array, shape (cases, columns)
        States to which the cases came.
    """
    marches = _Marches(search, cases)
    active = np.flatnonzero(marches.bases[:, SHAFT] == _ROTATING)
    for _ in range(_MOST_RUNS):
        if not len(active):
            break
        active = marches.go_on(active)
    return joined(marches.certified, search), marches.bases
