"""Events of one lane: finding the first one inside a step, and changing the state there (docs/theory.md)."""

import numpy as np
from numpy.typing import NDArray

from engine.compile.jit import inlined, part
from engine.taylor.batch import HARD, NONE, RESULT, SLOTS, STATUS, put, slot_start, take
from engine.taylor.roots import RECIPROCAL, first_root
from engine.vibration_drive.automaton import CLUTCH_TARGET, Band
from engine.vibration_drive.layout import Layout
from engine.vibration_drive.locking import (
    EDGE,
    acceleration,
    lock_share,
    others_in_contact,
    settle_others,
    share_at,
    shared_acceleration,
)
from engine.vibration_drive.states import (
    BEYOND,
    ENGAGED,
    EVENT_PENDULUM,
    EVENT_SMOOTH,
    EVENT_TARGET,
    FREE,
    HELD,
    LANE_INTEGERS,
    LITERAL,
    LOCKED,
    NO_EVENT,
    OF_SHAFT,
    ROTATING,
    SHAFT_STATE,
    SKIP_SHAFT,
    SKIP_STEP,
    SKIP_U,
    SKIP_W,
    START,
    TAKE_UP,
    set_clutch,
    set_shaft,
    stored_energy,
    total,
    watch_fall,
)  # fmt: skip

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Relative speed, against the pendulum's own motion, below which a start of interaction counts as a crossing of zero.
_ROUNDING = 1e-12
#: Angle in rad, and the same of speed over the excitation's rate, below which a motion about 0 is rounding.
_STILL = 1e-14

_BANDS = len(Band)


@inlined
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


@inlined
def _offer(W: Floats, Z: Ints, lay: Layout, lane: int, x: float, pendulum: int, target: int) -> None:
    """Note an event at the part ``x`` of a lane's step if it is the first so far; the part that is taken ends there."""
    first = W[lay.x * lay.lanes + lane]
    if Z[lane, EVENT_PENDULUM] == NO_EVENT and first == 1.0:
        first = 1.5
    if x < first:
        Z[lane, EVENT_PENDULUM] = pendulum
        Z[lane, EVENT_TARGET] = target
        Z[lane, EVENT_SMOOTH] = 1 if x > 0.0 else 0
        W[lay.x * lay.lanes + lane] = x
        if x < 1.0:
            W[lay.at_stop * lay.lanes + lane] = 0.0


@inlined
def _enter(
    W: Floats,
    Z: Ints,
    lay: Layout,
    lane: int,
    pendulum: int,
    target: int,
    g: Floats,
    blocks: Floats,
    meta: Ints,
    used: int,
) -> int:
    """Put a guard's polynomial on the list of those whose first root is wanted; the length of the list then.

    Leading zeros are roots that have been dealt with. What is not positive after them is an event at once.
    """
    first = 0
    while first <= lay.order and g[first] == 0.0:
        first += 1
    if first > lay.order:
        return used
    if not g[first] > 0.0:
        _offer(W, Z, lay, lane, 0.0, pendulum, target)
        return used
    if first > 0:
        for k in range(lay.order + 1):
            g[k] = g[k + first] if k + first <= lay.order else 0.0
    put(blocks, lay.order, used, g)
    meta[used, 0] = lane
    meta[used, 1] = pendulum
    meta[used, 2] = target
    return used + 1


@part
def collect_guards(W: Floats, Z: Ints, lay: Layout, lane: int, g: Floats, blocks: Floats, meta: Ints, used: int) -> int:
    """List the guards of a lane that its step may violate; the length of the list then.

    Of events at the same time the shaft's comes first, then the pendulum with the lowest index; the others are found
    violated at the start of the next step and follow at once.
    """
    lanes = lay.lanes
    fresh = W[lay.steps * lanes + lane] == Z[lane, SKIP_STEP]
    shaft = Z[lane, SHAFT_STATE]
    if not W[(lay.m_sum_high if shaft == HELD else lay.m_speed_low) * lanes + lane] > 0.0:
        if shaft == HELD:
            total(W, lay, lane, g)
            for k in range(lay.order + 1):
                g[k] = -g[k]
            g[0] += W[lay.sum_high * lanes + lane]
        else:
            for k in range(lay.order + 1):
                g[k] = W[(lay.speed + k) * lanes + lane]
            if fresh:
                for k in range(Z[lane, SKIP_SHAFT]):
                    g[k] = 0.0
        target = ROTATING if shaft == HELD else HELD
        used = _enter(W, Z, lay, lane, OF_SHAFT, target, g, blocks, meta, used)
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
            used = _enter(W, Z, lay, lane, i, CLUTCH_TARGET[literal, state, band], g, blocks, meta, used)
    return used


@part
def settle_guards(
    W: Floats, Z: Ints, lay: Layout, g: Floats, stack: Floats, blocks: Floats, meta: Ints, used: int
) -> None:
    """After the vector loops over the list: note each lane's first event."""
    for slot in range(used):
        start = slot_start(lay.order, slot)
        status = blocks[start + (lay.order + STATUS) * SLOTS]
        if status == NONE:
            continue
        x = blocks[start + (lay.order + RESULT) * SLOTS]
        if status == HARD:
            take(blocks, lay.order, slot, g)
            x = first_root(g, lay.order, stack)
        _offer(W, Z, lay, meta[slot, 0], x, meta[slot, 1], meta[slot, 2])


@part
def _start(W: Floats, Z: Ints, lay: Layout, lane: int, i: int) -> None:
    """Start of interaction (5): the relative turn counts from here."""
    lanes = lay.lanes
    base = lay.pendulums + i * lay.stride
    u = W[(base + lay.p_u) * lanes + lane]
    if Z[lane, i] >= ENGAGED:
        W[lay.energy_lost * lanes + lane] += stored_energy(W, lay, lane, i, u)
    # w = 0 by the crossing itself, unless the case began with a pendulum already faster than the shaft.
    speed = W[(base + lay.p_speed) * lanes + lane]
    shaft = W[lay.speed * lanes + lane]
    size = abs(speed) + abs(acceleration(W, lay, lane, i)) * W[lay.inverse_rate * lanes + lane]
    crossing = Z[lane, EVENT_SMOOTH] == 1 or abs(speed - shaft) <= _ROUNDING * size
    if crossing:
        W[(base + lay.p_speed) * lanes + lane] = shaft
    backlash = W[(base + lay.p_backlash) * lanes + lane]
    if backlash > 0.0:
        W[(base + lay.p_u) * lanes + lane] = -backlash
        set_clutch(W, Z, lay, lane, i, TAKE_UP)
        return
    W[(base + lay.p_u) * lanes + lane] = 0.0
    state = ENGAGED
    if crossing and W[(base + lay.p_law) * lanes + lane] > 0.0:
        if others_in_contact(W, Z, lay, lane, i, size):
            rate = shared_acceleration(W, Z, lay, lane, i, size)
            share = share_at(W, lay, lane, i, rate)
            settle_others(W, Z, lay, lane, i, size, rate)
        else:
            share = lock_share(W, Z, lay, lane, i)
        # At the edge the trend decides. At a step's start the series tell it: w'' has the sign of the torque's rate.
        bend = W[(base + lay.p_speed + 2) * lanes + lane] - W[(lay.speed + 2) * lanes + lane]
        if abs(share) <= EDGE and Z[lane, EVENT_SMOOTH] == 0 and bend > 0.0:
            state = LOCKED
        elif share < EDGE:
            state = FREE
            Z[lane, SKIP_W + i] = 2 if share > -EDGE else 0
        elif share <= 1.0 - EDGE:
            state = LOCKED
        elif share < 1.0 + EDGE:
            Z[lane, SKIP_W + i] = 2
            Z[lane, SKIP_U + i] = 3
    if state != FREE:
        W[(base + lay.p_engagements) * lanes + lane] += 1.0
    set_clutch(W, Z, lay, lane, i, state)
    if Z[lane, LITERAL] == 1 and state == ENGAGED:
        # From beyond the data too, w has just risen: it must fall before it can rise again.
        watch_fall(W, lay, lane, i, True)


@part
def _at_rest(W: Floats, Z: Ints, lay: Layout, lane: int, i: int) -> bool:
    """Whether the motion of pendulum ``i`` is nothing but rounding about its equilibrium; then it ends.

    Without horizontal vibration the upright position is an equilibrium. What rounding leaves there can have any size,
    1e-40 rad or 0, and the guards of a clutch cannot tell such a pendulum from one that moves.
    """
    lanes = lay.lanes
    base = lay.pendulums + i * lay.stride
    phi, speed = (base + lay.p_phi) * lanes + lane, (base + lay.p_speed) * lanes + lane
    still = abs(W[phi]) < _STILL and abs(W[speed]) * W[lay.inverse_rate * lanes + lane] < _STILL
    if not still or Z[lane, i] == LOCKED or W[lay.acc_x * lanes + lane] != 0.0 or (W[phi] == 0.0 and W[speed] == 0.0):
        return False
    W[phi] = W[speed] = 0.0
    return True


@part
def _let_go_too(W: Floats, Z: Ints, lay: Layout, lane: int, i: int, target: int) -> None:
    """Let the locked clutches go that come to the same edge at the same instant as clutch ``i``, as copies of it do.

    One after the other they would leave each other a step of rounding, in which nothing tells the trend any more.
    """
    lanes = lay.lanes
    for j in range(lay.n):
        base = lay.pendulums + j * lay.stride
        if j == i or Z[lane, j] != LOCKED:
            continue
        share = lock_share(W, Z, lay, lane, j)
        rate = W[(base + lay.p_torque + 1) * lanes + lane]
        winds = target == ENGAGED and abs(share - 1.0) < EDGE and rate > 0.0
        opens = target == FREE and abs(share) < EDGE and rate < 0.0
        if winds or opens:
            W[(base + lay.p_speed) * lanes + lane] = W[lay.speed * lanes + lane]
            W[(base + lay.p_u) * lanes + lane] = 0.0
            Z[lane, SKIP_W + j] = 2
            Z[lane, SKIP_U + j] = 3
            set_clutch(W, Z, lay, lane, j, target)


@part
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
            if Z[lane, j] == LOCKED:
                W[(lay.pendulums + j * lay.stride + lay.p_speed) * lanes + lane] = 0.0
        set_shaft(W, Z, lay, lane, target)
        if target == ROTATING and smooth:
            Z[lane, SKIP_SHAFT] = 2
        return
    base = lay.pendulums + i * lay.stride
    source = Z[lane, i]
    if source != target:
        Z[lane, SKIP_W + i] = 0
        Z[lane, SKIP_U + i] = 0
    if _at_rest(W, Z, lay, lane, i):
        # The guards are asked again now that w is what it would be without rounding.
        return
    if target == START:
        _start(W, Z, lay, lane, i)
        return
    if source == target:
        W[(base + lay.p_speed) * lanes + lane] = W[lay.speed * lanes + lane]
        watch_fall(W, lay, lane, i, False)
        return
    if source == LOCKED:
        W[(base + lay.p_speed) * lanes + lane] = W[lay.speed * lanes + lane]
        W[(base + lay.p_u) * lanes + lane] = 0.0
        if smooth:
            Z[lane, SKIP_W + i] = 2
            Z[lane, SKIP_U + i] = 3
        set_clutch(W, Z, lay, lane, i, target)
        _let_go_too(W, Z, lay, lane, i, target)
        return
    if source == TAKE_UP and target == FREE:
        if smooth:
            W[(base + lay.p_speed) * lanes + lane] = W[lay.speed * lanes + lane]
    elif BEYOND in (source, target):
        W[(base + lay.p_u) * lanes + lane] = W[(base + lay.p_limit) * lanes + lane]
    else:
        W[(base + lay.p_u) * lanes + lane] = 0.0
        if target == ENGAGED:
            W[(base + lay.p_engagements) * lanes + lane] += 1.0
    set_clutch(W, Z, lay, lane, i, target)
