"""Events of one lane: finding the first one inside a step, and changing the state when it is reached (MODEL.md A2)."""

import math

import numpy as np
from numpy.typing import NDArray

from engine.jit import compiled
from engine.taylor.roots import RECIPROCAL, first_root
from engine.vibration_drive.automaton import CLUTCH_TARGET, CLUTCH_THRESHOLD, Band, Clutch, Shaft, Threshold
from engine.vibration_drive.layout import Layout

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Edge of a band that is not watched.
NEVER = 1e300
#: Relative speed, against the pendulum's own motion, below which a start of interaction counts as a crossing of zero.
_ROUNDING = 1e-12

_FREE, _TAKE_UP, _ENGAGED, _BEYOND, _LOCKED, _START = (int(state) for state in Clutch)
_HELD, _ROTATING = int(Shaft.HELD), int(Shaft.ROTATING)
_W_LOW, _W_HIGH = int(Band.W_LOW), int(Band.W_HIGH)
_AT_DATA_END, _AT_FIRST, _BANDS = int(Threshold.DATA_END), int(Threshold.FIRST_COEFFICIENT), len(Band)

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
# Coefficients that vanish analytically at a transition but not in rounding: leading orders the root finder passes over.
SKIP_SHAFT = 20
SKIP_W = 21  # eight columns
SKIP_U = 29  # eight columns
LANE_INTEGERS = 37

NO_EVENT = -2
OF_SHAFT = -1


@compiled
def law(W: Floats, first: int, count: int, lanes: int, lane: int, u: float) -> float:
    """Clutch torque at windup ``u`` by the polynomial whose coefficients start at workspace row ``first``."""
    value = 0.0
    for k in range(count - 1, -1, -1):
        value = value * u + W[(first + k) * lanes + lane]
    return value


@compiled
def law_slope(W: Floats, first: int, count: int, lanes: int, lane: int, u: float) -> float:
    """Derivative of ``law``."""
    value = 0.0
    for k in range(count - 1, 0, -1):
        value = value * u + k * W[(first + k) * lanes + lane]
    return value


@compiled
def stored_energy(W: Floats, lay: Layout, lane: int, i: int, u: float) -> float:
    """Energy Pi(u) in the clutch of pendulum ``i`` at windup ``u >= 0``, the straight part beyond the data included."""
    base = lay.pendulums + i * lay.stride
    limit = W[(base + lay.p_limit) * lay.lanes + lane]
    inside = min(u, limit)
    first = base + lay.p_law
    value = 0.0
    for k in range(lay.coefficients - 1, -1, -1):
        value = value * inside + W[(first + k) * lay.lanes + lane] / (k + 1)
    value *= inside
    if u > limit:
        end = law(W, first, lay.coefficients, lay.lanes, lane, limit)
        rate = law_slope(W, first, lay.coefficients, lay.lanes, lane, limit)
        value += (u - limit) * (end + 0.5 * rate * (u - limit))
    return float(value)


@compiled
def _guard(W: Floats, lay: Layout, lane: int, i: int, band: int, g: Floats) -> None:
    """Write the polynomial (in fractions of the step) that is positive while a guard of pendulum ``i`` holds."""
    lanes = lay.lanes
    base = lay.pendulums + i * lay.stride
    edge = W[(base + lay.p_w_low + band) * lanes + lane]
    sign = 1.0 if band % 2 == 0 else -1.0
    own = (base + lay.p_speed) * lanes + lane
    shaft = lay.speed * lanes + lane
    if band // 2 == 0:
        for k in range(lay.order + 1):
            g[k] = sign * (W[own + k * lanes] - W[shaft + k * lanes])
    elif band // 2 == 1:
        g[0] = sign * W[(base + lay.p_u) * lanes + lane]
        step = sign * W[lay.h * lanes + lane]
        for k in range(lay.order):
            g[k + 1] = step * (W[own + k * lanes] - W[shaft + k * lanes]) * RECIPROCAL[k + 1]
    else:
        torque = (base + lay.p_torque) * lanes + lane
        for k in range(lay.order + 1):
            g[k] = sign * W[torque + k * lanes]
    g[0] -= sign * edge


@compiled
def locate(W: Floats, Z: Ints, lay: Layout, lane: int, g: Floats, stack: Floats) -> None:
    """Find the first event of a lane in its step; if there is one, shorten the step to it and note what happens.

    Of events at the same time the shaft's comes first, then the pendulum with the lowest index; the others are found
    violated at the start of the next step and follow at once.
    """
    lanes = lay.lanes
    best = 1.5
    pendulum = NO_EVENT
    target = 0
    fresh = W[lay.steps * lanes + lane] == Z[lane, SKIP_STEP]
    shaft = Z[lane, SHAFT_STATE]
    if not W[(lay.m_sum_high if shaft == _HELD else lay.m_speed_low) * lanes + lane] > 0.0:
        first = (lay.sum if shaft == _HELD else lay.speed) * lanes + lane
        sign = -1.0 if shaft == _HELD else 1.0
        for k in range(lay.order + 1):
            g[k] = sign * W[first + k * lanes]
        if shaft == _HELD:
            g[0] += W[lay.sum_high * lanes + lane]
        elif fresh:
            for k in range(Z[lane, SKIP_SHAFT]):
                g[k] = 0.0
        x = first_root(g, lay.order, stack)
        if x < best:
            best, pendulum, target = x, OF_SHAFT, (_ROTATING if shaft == _HELD else _HELD)
    literal = Z[lane, LITERAL]
    for i in range(lay.n):
        state = Z[lane, i]
        for band in range(_BANDS):
            if W[(lay.pendulums + i * lay.stride + lay.p_m_w_low + band) * lanes + lane] > 0.0:
                continue
            _guard(W, lay, lane, i, band, g)
            if fresh and band // 2 < 2:
                for k in range(Z[lane, (SKIP_W if band // 2 == 0 else SKIP_U) + i]):
                    g[k] = 0.0
            x = first_root(g, lay.order, stack)
            if x < best:
                best, pendulum, target = x, i, CLUTCH_TARGET[literal, state, band]
    Z[lane, EVENT_PENDULUM] = pendulum
    if pendulum != NO_EVENT:
        Z[lane, EVENT_TARGET] = target
        Z[lane, EVENT_SMOOTH] = 1 if best > 0.0 else 0
        W[lay.x * lanes + lane] = best
        if best < 1.0:
            W[lay.at_stop * lanes + lane] = 0.0


@compiled
def _watch_fall(W: Floats, lay: Layout, lane: int, i: int, fall: bool) -> None:
    """Let an engaged clutch under literal resets wait for w to fall through 0 (``fall``), or after that to rise through
    it.
    """
    first = lay.pendulums + i * lay.stride + lay.p_w_low
    W[(first + _W_LOW) * lay.lanes + lane] = 0.0 if fall else -NEVER
    W[(first + _W_HIGH) * lay.lanes + lane] = NEVER if fall else 0.0


@compiled
def set_clutch(W: Floats, Z: Ints, lay: Layout, lane: int, i: int, state: int) -> None:
    """Put the clutch of pendulum ``i`` into a state: its guards' bands, the law in force, the flags."""
    lanes = lay.lanes
    base = lay.pendulums + i * lay.stride
    source = Z[lane, i]
    Z[lane, i] = state
    for band in range(_BANDS):
        kind = CLUTCH_THRESHOLD[Z[lane, LITERAL], state, band]
        edge = -NEVER if band % 2 == 0 else NEVER
        if kind == _AT_DATA_END:
            edge = W[(base + lay.p_limit) * lanes + lane]
        elif kind == _AT_FIRST:
            edge = W[(base + lay.p_law) * lanes + lane]
        elif kind != 0:
            edge = 0.0
        W[(base + lay.p_w_low + band) * lanes + lane] = edge
    if Z[lane, LITERAL] == 1 and (_ENGAGED <= state <= _BEYOND):
        _watch_fall(W, lay, lane, i, source != _BEYOND)
    limit = W[(base + lay.p_limit) * lanes + lane]
    for k in range(lay.coefficients):
        value = 0.0
        if state == _ENGAGED:
            value = W[(base + lay.p_law + k) * lanes + lane]
        elif state == _BEYOND and k < 2:
            rate = law_slope(W, base + lay.p_law, lay.coefficients, lanes, lane, limit)
            value = rate
            if k == 0:
                value = law(W, base + lay.p_law, lay.coefficients, lanes, lane, limit) - rate * limit
        W[(base + lay.p_force + k) * lanes + lane] = value
    W[(base + lay.p_locked) * lanes + lane] = 1.0 if state == _LOCKED else 0.0
    W[(base + lay.p_engaged) * lanes + lane] = 1.0 if state >= _ENGAGED else 0.0
    W[(base + lay.p_beyond) * lanes + lane] = 1.0 if state == _BEYOND else 0.0
    driving = 0.0
    for j in range(lay.n):
        driving += W[(lay.pendulums + j * lay.stride + lay.p_engaged) * lanes + lane]
    W[lay.driven * lanes + lane] = 1.0 if driving > 0.0 else 0.0
    W[lay.driving_max * lanes + lane] = max(driving, W[lay.driving_max * lanes + lane])
    _set_mobility(W, Z, lay, lane)


@compiled
def set_shaft(W: Floats, Z: Ints, lay: Layout, lane: int, state: int) -> None:
    """Put the shaft into a state: its guard, its flag, its mobility."""
    lanes = lay.lanes
    load = W[lay.load * lanes + lane]
    Z[lane, SHAFT_STATE] = state
    W[lay.rotating * lanes + lane] = 1.0 if state == _ROTATING else 0.0
    W[lay.sum_high * lanes + lane] = load if state == _HELD else NEVER
    # Without a load nothing slows the shaft, and it is never held.
    W[lay.speed_low * lanes + lane] = 0.0 if state == _ROTATING and load > 0.0 else -NEVER
    _set_mobility(W, Z, lay, lane)


@compiled
def _set_mobility(W: Floats, Z: Ints, lay: Layout, lane: int) -> None:
    """1/(inertia of the shaft and of all pendulums locked to it), or 0 while the load holds it."""
    lanes = lay.lanes
    inertia = W[lay.inertia * lanes + lane]
    for i in range(lay.n):
        if Z[lane, i] == _LOCKED:
            inertia += W[(lay.pendulums + i * lay.stride + lay.p_inertia) * lanes + lane]
    W[lay.mobility * lanes + lane] = 1.0 / inertia if Z[lane, SHAFT_STATE] == _ROTATING else 0.0


@compiled
def _acceleration(W: Floats, lay: Layout, lane: int, i: int) -> float:
    """Acceleration of pendulum ``i`` without its clutch, at the lane's state (equation (1))."""
    lanes = lay.lanes
    base = lay.pendulums + i * lay.stride
    phi = W[(base + lay.p_phi) * lanes + lane]
    theta = 2.0 * math.pi * W[lay.f * lanes + lane]
    x = -W[lay.acc_x * lanes + lane] * math.cos(theta)
    y = -W[lay.acc_y * lanes + lane] * (
        math.sin(theta) * W[lay.cos_chi * lanes + lane] + math.cos(theta) * W[lay.sin_chi * lanes + lane]
    )
    push = x * math.cos(phi) + (y + W[lay.gravity * lanes + lane]) * math.sin(phi)
    return float(
        W[(base + lay.p_ml) * lanes + lane] * push
        - W[(base + lay.p_spring) * lanes + lane] * phi
        - W[(base + lay.p_damping) * lanes + lane] * W[(base + lay.p_speed) * lanes + lane]
    )


@compiled
def lock_or_engage(W: Floats, Z: Ints, lay: Layout, lane: int, i: int) -> int:
    """State of clutch ``i`` at the start of interaction when delta = 0 and c_1 > 0 (Filippov's choice).

    The torque that would keep w = 0 decides: above c_1 the clutch winds up, below 0 it opens, between it locks. If the
    torque then breaks the held shaft away, what counts is the torque with the shaft already moving.
    """
    lanes = lay.lanes
    base = lay.pendulums + i * lay.stride
    first = W[(base + lay.p_law) * lanes + lane]
    own = W[(base + lay.p_inertia) * lanes + lane]
    needed = own * _acceleration(W, lay, lane, i)
    push = -W[lay.load * lanes + lane]
    inertia = W[lay.inertia * lanes + lane]
    for j in range(lay.n):
        if j == i:
            continue
        other = lay.pendulums + j * lay.stride
        if Z[lane, j] == _LOCKED:
            moved = W[(other + lay.p_inertia) * lanes + lane]
            inertia += moved
            push += moved * _acceleration(W, lay, lane, j)
        elif Z[lane, j] >= _ENGAGED:
            push += law(W, other + lay.p_force, lay.coefficients, lanes, lane, W[(other + lay.p_u) * lanes + lane])
    if Z[lane, SHAFT_STATE] == _ROTATING or push + min(needed, first) > 0.0:
        needed -= own * (push + needed) / (inertia + own)
    if needed > first:
        return _ENGAGED
    return _FREE if needed < 0.0 else _LOCKED


@compiled
def _start(W: Floats, Z: Ints, lay: Layout, lane: int, i: int) -> None:
    """Start of interaction (5): the relative turn counts from here."""
    lanes = lay.lanes
    base = lay.pendulums + i * lay.stride
    u = W[(base + lay.p_u) * lanes + lane]
    if Z[lane, i] >= _ENGAGED:
        W[lay.energy_lost * lanes + lane] += stored_energy(W, lay, lane, i, u)
    # w = 0 by the crossing itself, unless the case began with a pendulum already faster than the shaft.
    speed = W[(base + lay.p_speed) * lanes + lane]
    shaft = W[lay.speed * lanes + lane]
    size = abs(speed) + abs(_acceleration(W, lay, lane, i)) * W[lay.inverse_rate * lanes + lane]
    crossing = Z[lane, EVENT_SMOOTH] == 1 or abs(speed - shaft) <= _ROUNDING * size
    if crossing:
        W[(base + lay.p_speed) * lanes + lane] = shaft
    backlash = W[(base + lay.p_backlash) * lanes + lane]
    if backlash > 0.0:
        W[(base + lay.p_u) * lanes + lane] = -backlash
        set_clutch(W, Z, lay, lane, i, _TAKE_UP)
        return
    W[(base + lay.p_u) * lanes + lane] = 0.0
    state = _ENGAGED
    if crossing and W[(base + lay.p_law) * lanes + lane] > 0.0:
        state = lock_or_engage(W, Z, lay, lane, i)
    if state != _FREE:
        W[(base + lay.p_engagements) * lanes + lane] += 1.0
    set_clutch(W, Z, lay, lane, i, state)


@compiled
def transit(W: Floats, Z: Ints, lay: Layout, lane: int) -> None:
    """Carry out the event that ended a lane's step: exact values at the crossing, then the new state.

    The skips tell the root finder which leading coefficients are zero by the nature of the crossing (a shaft that
    breaks away starts with no acceleration) so that their rounding errors cannot fire a guard.
    """
    lanes = lay.lanes
    i = Z[lane, EVENT_PENDULUM]
    target = Z[lane, EVENT_TARGET]
    smooth = Z[lane, EVENT_SMOOTH] == 1
    if W[lay.steps * lanes + lane] != Z[lane, SKIP_STEP]:
        Z[lane, SKIP_STEP] = int(W[lay.steps * lanes + lane])
        for k in range(SKIP_SHAFT, LANE_INTEGERS):
            Z[lane, k] = 0
    if i == OF_SHAFT:
        Z[lane, SKIP_SHAFT] = 0
        W[lay.speed * lanes + lane] = 0.0
        for j in range(lay.n):
            # A locked pendulum stops with the shaft.
            if Z[lane, j] == _LOCKED:
                W[(lay.pendulums + j * lay.stride + lay.p_speed) * lanes + lane] = 0.0
        set_shaft(W, Z, lay, lane, target)
        if target == _ROTATING and smooth:
            Z[lane, SKIP_SHAFT] = 2
        return
    base = lay.pendulums + i * lay.stride
    source = Z[lane, i]
    Z[lane, SKIP_W + i] = 0
    Z[lane, SKIP_U + i] = 0
    if target == _START:
        _start(W, Z, lay, lane, i)
        return
    if source == target:
        W[(base + lay.p_speed) * lanes + lane] = W[lay.speed * lanes + lane]
        _watch_fall(W, lay, lane, i, False)
        return
    if source == _LOCKED:
        W[(base + lay.p_speed) * lanes + lane] = W[lay.speed * lanes + lane]
        W[(base + lay.p_u) * lanes + lane] = 0.0
        if smooth:
            Z[lane, SKIP_W + i] = 2
            Z[lane, SKIP_U + i] = 3
    elif source == _TAKE_UP and target == _FREE:
        if smooth:
            W[(base + lay.p_speed) * lanes + lane] = W[lay.speed * lanes + lane]
    elif _BEYOND in (source, target):
        W[(base + lay.p_u) * lanes + lane] = W[(base + lay.p_limit) * lanes + lane]
    else:
        W[(base + lay.p_u) * lanes + lane] = 0.0
        if target == _ENGAGED:
            W[(base + lay.p_engagements) * lanes + lane] += 1.0
    set_clutch(W, Z, lay, lane, i, target)
