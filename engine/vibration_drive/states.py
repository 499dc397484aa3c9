"""States of one lane's clutches and shaft: what is set when one is entered, and the laws that act in it."""

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.compile.jit import inlined, part
from sprag_study.engine.elementary.angles import cosine
from sprag_study.engine.taylor.straight import horner, integral, slope
from sprag_study.engine.vibration_drive.automaton import CLUTCH_THRESHOLD, Band, Clutch, Shaft, Threshold
from sprag_study.engine.vibration_drive.formulas import beyond
from sprag_study.engine.vibration_drive.layout import Layout
from sprag_study.engine.vibration_drive.parameters import MAX_LOAD_ROWS

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Edge of a band that is not watched.
NEVER = 1e300
#: Share of the speed in a row of the load's table by which that is passed when the line of the load changes.
PASSED = 1e-12

FREE, TAKE_UP, ENGAGED, BEYOND, LOCKED, START = (int(state) for state in Clutch)
HELD, ROTATING = int(Shaft.HELD), int(Shaft.ROTATING)
_W_LOW, _W_HIGH = int(Band.W_LOW), int(Band.W_HIGH)
_AT_DATA_END, _AT_FIRST, _BANDS = int(Threshold.DATA_END), int(Threshold.FIRST_COEFFICIENT), len(Band)
_IF_DAMPED = int(Threshold.ZERO_IF_DAMPED)

# Columns of a lane's integers. The first eight are the pendulums' clutch states.
SHAFT_STATE = 8
CASE = 9
PERIOD = 10
EVENT_PENDULUM = 11  # -2: no event in this step; -1: the shaft
EVENT_TARGET = 12
EVENT_SMOOTH = 13  # the event was located inside the step, not found violated at its start
NEXT_STOP = 14
EVENTS = 15
EVENTS_IN_PERIOD = 16
EVENTS_AT_ONCE = 17
SKIP_STEP = 18  # the skips below hold while the lane has made this many steps
LITERAL = 19
# Coefficients that vanish analytically at a transition but not numerically: leading orders that the root finder skips.
SKIP_SHAFT = 20
SKIP_W = 21  # eight columns
SKIP_U = 29  # eight columns
SKIP_T = 37  # eight columns: the band whose edge the torque is at, or 0
LANE_INTEGERS = 45

NO_EVENT = -2
OF_SHAFT = -1
# Targets of events of the shaft beside its states: the lines before and after that of the load's table.
SLOWER, FASTER = 2, 3


_horner, _slope, _integral, _beyond = part(horner), part(slope), part(integral), inlined(beyond)


@inlined
def _coefficients(W: Floats, first: int, count: int, lane: int) -> Floats:
    """The lane's elements of ``count`` workspace rows from ``first`` on."""
    return W[first : first + count, lane]


@part
def law(W: Floats, first: int, count: int, lane: int, u: float) -> float:
    """Clutch torque at windup ``u`` by the polynomial whose coefficients start at workspace row ``first``."""
    return float(_horner(_coefficients(W, first, count, lane), u))


@part
def law_slope(W: Floats, first: int, count: int, lane: int, u: float) -> float:
    """Derivative of ``law``."""
    return float(_slope(_coefficients(W, first, count, lane), u))


@part
def clutch_torque(W: Floats, lay: Layout, lane: int, i: int) -> float:
    """Torque of the clutch of pendulum ``i``, which is not locked, by what is in force at the lane's state."""
    base = lay.pendulums + i * lay.stride
    torque = law(W, base + lay.p_force, lay.coefficients, lane, W[base + lay.p_u, lane])
    if lay.drag == 1:
        torque += W[base + lay.p_rate, lane] * (W[base + lay.p_speed, lane] - W[lay.speed, lane])
    return float(torque)


@inlined
def total(W: Floats, lay: Layout, lane: int, g: Floats) -> None:
    """Write the series of the sum of the clutch torques into ``g`` (shape (order + 1,))."""
    for k in range(lay.order + 1):
        g[k] = 0.0
    for i in range(lay.n):
        first = lay.pendulums + i * lay.stride + lay.p_torque
        for k in range(lay.order + 1):
            g[k] += W[first + k, lane]


@inlined
def held_excess(W: Floats, lay: Layout, lane: int, g: Floats) -> None:
    """Like ``total``, less the changing load that holds the shaft."""
    total(W, lay, lane, g)
    if lay.ramped == 1:
        g[0] -= W[lay.load_factor, lane] * W[lay.held_load, lane]
        g[1] -= W[lay.load_slope, lane] * W[lay.held_load, lane] * W[lay.h, lane]


@part
def stored_energy(W: Floats, lay: Layout, lane: int, i: int, u: float) -> float:
    """Energy Pi(u) in the clutch of pendulum ``i`` at windup ``u >= 0``, including the linear part beyond the data."""
    base = lay.pendulums + i * lay.stride
    limit = W[base + lay.p_limit, lane]
    inside = min(u, limit)
    first = base + lay.p_law
    value = _integral(_coefficients(W, first, lay.coefficients, lane), inside)
    if u > limit:
        end = law(W, first, lay.coefficients, lane, limit)
        rate = law_slope(W, first, lay.coefficients, lane, limit)
        value += _beyond(end, rate, u - limit)
    return float(value)


@part
def watch_fall(W: Floats, lay: Layout, lane: int, i: int, fall: bool) -> None:
    """Let an engaged clutch under literal resets wait for w to fall through 0 (``fall``), or after that to rise through
    it.
    """
    first = lay.pendulums + i * lay.stride + lay.p_w_low
    W[first + _W_LOW, lane] = 0.0 if fall else -NEVER
    W[first + _W_HIGH, lane] = NEVER if fall else 0.0


@part
def set_clutch(W: Floats, Z: Ints, lay: Layout, lane: int, i: int, state: int) -> None:
    """Put the clutch of pendulum ``i`` into a state: its guards' bands, the law in force, the flags."""
    base = lay.pendulums + i * lay.stride
    source = Z[lane, i]
    Z[lane, i] = state
    for band in range(_BANDS):
        kind = CLUTCH_THRESHOLD[Z[lane, LITERAL], state, band]
        edge = -NEVER if band % 2 == 0 else NEVER
        if kind == _AT_DATA_END:
            edge = W[base + lay.p_limit, lane]
        elif kind == _AT_FIRST:
            edge = W[base + lay.p_law, lane]
        elif kind == _IF_DAMPED:
            if lay.drag == 1 and W[base + lay.p_clutch_damping, lane] > 0.0:
                edge = 0.0
        elif kind != 0:
            edge = 0.0
        W[base + lay.p_w_low + band, lane] = edge
    if Z[lane, LITERAL] == 1 and (ENGAGED <= state <= BEYOND):
        watch_fall(W, lay, lane, i, source != BEYOND)
    limit = W[base + lay.p_limit, lane]
    for k in range(lay.coefficients):
        value = 0.0
        if state == ENGAGED:
            value = W[base + lay.p_law + k, lane]
        elif state == BEYOND and k < 2:
            rate = law_slope(W, base + lay.p_law, lay.coefficients, lane, limit)
            value = rate
            if k == 0:
                value = law(W, base + lay.p_law, lay.coefficients, lane, limit) - rate * limit
        W[base + lay.p_force + k, lane] = value
    if lay.drag == 1:
        W[base + lay.p_rate, lane] = 0.0
        if state == FREE:
            W[base + lay.p_rate, lane] = W[base + lay.p_overrunning_damping, lane]
        elif ENGAGED <= state <= BEYOND:
            W[base + lay.p_rate, lane] = W[base + lay.p_clutch_damping, lane]
    W[base + lay.p_locked, lane] = 1.0 if state == LOCKED else 0.0
    W[base + lay.p_engaged, lane] = 1.0 if state >= ENGAGED else 0.0
    W[base + lay.p_beyond, lane] = 1.0 if state == BEYOND else 0.0
    driving = 0.0
    for j in range(lay.n):
        driving += W[lay.pendulums + j * lay.stride + lay.p_engaged, lane]
    W[lay.driven, lane] = 1.0 if driving > 0.0 else 0.0
    W[lay.driving_max, lane] = max(driving, W[lay.driving_max, lane])
    _set_mobility(W, Z, lay, lane)


@part
def count_event(W: Floats, Z: Ints, lay: Layout, lane: int) -> None:
    """Count a transition; those at t = 0 belong to the start."""
    if Z[lane, PERIOD] > 0 or W[lay.f, lane] > 0.0:
        Z[lane, EVENTS] += 1
        Z[lane, EVENTS_IN_PERIOD] += 1


@part
def load_at_rest(W: Floats, lay: Layout, lane: int) -> float:
    """Torque in N*m up to which the load, without a factor that changes, holds a shaft that stands."""
    load = W[lay.load, lane]
    if lay.curved == 1:
        load += W[lay.stribeck, lane] + W[lay.cyclic, lane] * cosine(W[lay.cycle, lane])
    if lay.tabled == 1:
        load += W[lay.table_torque, lane]
    return float(load)


@part
def is_held(W: Floats, lay: Layout, lane: int) -> bool:
    """Whether the shaft is held when it stands: without a load and a backstop nothing does.

    A load that begins at nothing holds the shaft until a clutch pushes.
    """
    dry = W[lay.load, lane]
    if lay.curved == 1:
        dry += W[lay.stribeck, lane]
    if lay.tabled == 1:
        dry += W[lay.table_torque, lane]
    return bool(dry > 0.0 or (lay.drag == 1 and W[lay.backstop, lane] > 0.0))


@part
def set_piece(W: Floats, Z: Ints, lay: Layout, lane: int, piece: int) -> None:
    """Put the load of the shaft on the line before row ``piece`` of its table: level, slope, and the speeds at which
    it is left.

    The torque does not jump at a row, so that it is passed a little later in either direction: a speed that stays there
    then brings no events without end.
    """
    first, last = lay.table_speed + piece - 1, lay.table_speed + piece
    W[lay.piece, lane] = piece
    W[lay.slope, lane] = 0.0
    W[lay.level, lane] = W[lay.table_torque + max(piece - 1, 0), lane]
    if 0 < piece < MAX_LOAD_ROWS and W[last, lane] < NEVER:
        before = W[lay.table_torque + piece - 1, lane]
        slope = (W[lay.table_torque + piece, lane] - before) / (W[last, lane] - W[first, lane])
        W[lay.slope, lane] = slope
        W[lay.level, lane] = before - slope * W[first, lane]
    W[lay.speed_high, lane] = NEVER
    if Z[lane, SHAFT_STATE] == HELD:
        return
    if piece < MAX_LOAD_ROWS and W[last, lane] < NEVER:
        W[lay.speed_high, lane] = W[last, lane] * (1.0 + PASSED)
    if piece > 0 and W[first, lane] > 0.0:
        W[lay.speed_low, lane] = W[first, lane] * (1.0 - PASSED)


@part
def set_shaft(W: Floats, Z: Ints, lay: Layout, lane: int, state: int) -> None:
    """Put the shaft into a state: its guard, its flag, its mobility."""
    load = load_at_rest(W, lay, lane)
    Z[lane, SHAFT_STATE] = state
    W[lay.rotating, lane] = 1.0 if state == ROTATING else 0.0
    W[lay.sum_high, lane] = load if state == HELD else NEVER
    if lay.ramped == 1:
        # Of a load that changes the guard itself has the load (`held_excess`).
        W[lay.held_load, lane] = load if state == HELD else 0.0
        W[lay.sum_high, lane] = 0.0 if state == HELD else NEVER
    # Torques that depend on speeds vanish at rest: without a dry load and a backstop a shaft stops only in the limit.
    W[lay.speed_low, lane] = 0.0 if state == ROTATING and is_held(W, lay, lane) else -NEVER
    if lay.tabled == 1:
        piece = 0
        while piece < MAX_LOAD_ROWS and W[lay.table_speed + piece, lane] <= W[lay.speed, lane]:
            piece += 1
        set_piece(W, Z, lay, lane, piece)
    _set_mobility(W, Z, lay, lane)


@part
def _set_mobility(W: Floats, Z: Ints, lay: Layout, lane: int) -> None:
    """1/(inertia of the shaft and of all pendulums locked to it), or 0 while the load holds it."""
    inertia = W[lay.inertia, lane]
    for i in range(lay.n):
        if Z[lane, i] == LOCKED:
            inertia += W[lay.pendulums + i * lay.stride + lay.p_inertia, lane]
    W[lay.mobility, lane] = 1.0 / inertia if Z[lane, SHAFT_STATE] == ROTATING else 0.0
