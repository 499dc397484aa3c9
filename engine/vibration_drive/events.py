"""Events of one lane: finding the first one inside a step, and changing the state there (docs/theory.md)."""

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.compile.jit import inlined, part
from sprag_study.engine.taylor.batch import HARD, NONE, RESULT, SLOTS, STATUS, put, slot_start, take
from sprag_study.engine.taylor.roots import RECIPROCAL, first_root
from sprag_study.engine.vibration_drive.automaton import CLUTCH_TARGET, Band
from sprag_study.engine.vibration_drive.layout import Layout
from sprag_study.engine.vibration_drive.locking import ROUNDING, acceleration, decide, grazes, typical_speed
from sprag_study.engine.vibration_drive.states import (
    BEYOND,
    ENGAGED,
    EVENT_PENDULUM,
    EVENT_SMOOTH,
    EVENT_TARGET,
    FASTER,
    FREE,
    HELD,
    LANE_INTEGERS,
    LITERAL,
    LOCKED,
    NEVER,
    NO_EVENT,
    OF_SHAFT,
    ROTATING,
    SHAFT_STATE,
    SKIP_SHAFT,
    SKIP_STEP,
    SKIP_T,
    SKIP_U,
    SKIP_W,
    SLOWER,
    START,
    TAKE_UP,
    held_excess,
    is_held,
    set_clutch,
    set_piece,
    set_shaft,
    stored_energy,
    watch_fall,
)  # fmt: skip

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Angle in rad, and the same of speed over the excitation's rate, below which a motion about 0 is rounding.
_STILL = 1e-14

_BANDS = len(Band)


@inlined
def _guard(W: Floats, lay: Layout, lane: int, i: int, band: int, g: Floats) -> None:
    """Write the polynomial (in fractions of the step) that is positive while a guard of pendulum ``i`` holds."""
    base = lay.pendulums + i * lay.stride
    edge = W[base + lay.p_w_low + band, lane]
    sign = 1.0 if band % 2 == 0 else -1.0
    own = base + lay.p_speed
    if band // 2 == 0:
        for k in range(lay.order + 1):
            g[k] = sign * (W[own + k, lane] - W[lay.speed + k, lane])
    elif band // 2 == 1:
        g[0] = sign * W[base + lay.p_u, lane]
        step = sign * W[lay.h, lane]
        for k in range(lay.order):
            g[k + 1] = step * (W[own + k, lane] - W[lay.speed + k, lane]) * RECIPROCAL[k + 1]
    else:
        torque = base + lay.p_torque
        for k in range(lay.order + 1):
            g[k] = sign * W[torque + k, lane]
    g[0] -= sign * edge


@inlined
def _offer(W: Floats, Z: Ints, lay: Layout, lane: int, x: float, pendulum: int, target: int) -> None:
    """Record an event at the fraction ``x`` of a lane's step if it is the earliest so far; the step then ends there."""
    first = W[lay.x, lane]
    if Z[lane, EVENT_PENDULUM] == NO_EVENT and first == 1.0:
        first = 1.5
    if x < first:
        Z[lane, EVENT_PENDULUM] = pendulum
        Z[lane, EVENT_TARGET] = target
        Z[lane, EVENT_SMOOTH] = 1 if x > 0.0 else 0
        W[lay.x, lane] = x
        if x < 1.0:
            W[lay.at_stop, lane] = 0.0


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
    """Add a guard's polynomial to the list for the root search; returns the length of the list.

    Leading zeros are roots that have been handled. A polynomial that is not positive after them is an immediate event.
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
    """List the guards of a lane that its step may violate; returns the length of the list.

    Of simultaneous events the shaft's comes first, then that of the pendulum with the lowest index; the others are
    found violated at the start of the next step and follow immediately.
    """
    fresh = W[lay.steps, lane] == Z[lane, SKIP_STEP]
    shaft = Z[lane, SHAFT_STATE]
    # Clutches that overrun or take up their backlash never push: without a dry load their drag vanishes as an
    # interaction starts, and rounding would decide whether that frees the shaft.
    idle = lay.drag == 1 and shaft == HELD and not W[lay.driven, lane] > 0.0
    if lay.tabled == 1 and shaft == ROTATING and not W[lay.m_speed_high, lane] > 0.0:
        for k in range(lay.order + 1):
            g[k] = -W[lay.speed + k, lane]
        g[0] += W[lay.speed_high, lane]
        used = _enter(W, Z, lay, lane, OF_SHAFT, FASTER, g, blocks, meta, used)
    if not (idle or W[lay.m_sum_high if shaft == HELD else lay.m_speed_low, lane] > 0.0):
        slower = lay.tabled == 1 and shaft == ROTATING and W[lay.speed_low, lane] > 0.0
        if shaft == HELD:
            held_excess(W, lay, lane, g)
            for k in range(lay.order + 1):
                g[k] = -g[k]
            g[0] += W[lay.sum_high, lane]
        else:
            for k in range(lay.order + 1):
                g[k] = W[lay.speed + k, lane]
            if slower:
                g[0] -= W[lay.speed_low, lane]
            elif fresh:
                for k in range(Z[lane, SKIP_SHAFT]):
                    g[k] = 0.0
        target = SLOWER if slower else (ROTATING if shaft == HELD else HELD)
        used = _enter(W, Z, lay, lane, OF_SHAFT, target, g, blocks, meta, used)
    literal = Z[lane, LITERAL]
    for i in range(lay.n):
        state = Z[lane, i]
        for band in range(_BANDS):
            if W[lay.pendulums + i * lay.stride + lay.p_m_w_low + band, lane] > 0.0:
                continue
            _guard(W, lay, lane, i, band, g)
            if fresh and band // 2 < 2:
                for k in range(Z[lane, (SKIP_W if band // 2 == 0 else SKIP_U) + i]):
                    g[k] = 0.0
            elif fresh and Z[lane, SKIP_T + i] == band:
                g[0] = 0.0
            used = _enter(W, Z, lay, lane, i, CLUTCH_TARGET[literal, state, band], g, blocks, meta, used)
    return used


@part
def settle_guards(
    W: Floats, Z: Ints, lay: Layout, g: Floats, stack: Floats, blocks: Floats, meta: Ints, used: int
) -> None:
    """After the vector loops over the list: record each lane's first event."""
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
    base = lay.pendulums + i * lay.stride
    u = W[base + lay.p_u, lane]
    if Z[lane, i] >= ENGAGED:
        W[lay.energy_lost, lane] += stored_energy(W, lay, lane, i, u)
    # w = 0 by the crossing itself, unless the case began with a pendulum already faster than the shaft.
    speed = W[base + lay.p_speed, lane]
    shaft = W[lay.speed, lane]
    size = typical_speed(W, lay, lane, i)
    crossing = Z[lane, EVENT_SMOOTH] == 1 or abs(speed - shaft) <= ROUNDING * size
    if crossing:
        W[base + lay.p_speed, lane] = shaft
    backlash = W[base + lay.p_backlash, lane]
    if backlash > 0.0:
        W[base + lay.p_u, lane] = -backlash
        set_clutch(W, Z, lay, lane, i, TAKE_UP)
        return
    W[base + lay.p_u, lane] = 0.0
    if crossing and W[base + lay.p_law, lane] > 0.0:
        again = Z[lane, i] != FREE
        decide(W, Z, lay, lane, i, size, -1)
        again = again and Z[lane, i] != FREE
    else:
        again = True
        set_clutch(W, Z, lay, lane, i, ENGAGED)
    if again:
        W[base + lay.p_engagements, lane] += 1.0
    if Z[lane, LITERAL] == 1 and Z[lane, i] == ENGAGED:
        # The same applies beyond the data: w has just risen and must fall before it can rise again.
        watch_fall(W, lay, lane, i, True)


@part
def _at_rest(W: Floats, Z: Ints, lay: Layout, lane: int, i: int) -> bool:
    """Whether the motion of pendulum ``i`` is only rounding error about its equilibrium; it is then set to rest.

    Without horizontal vibration the upright position is an equilibrium. The rounding error there can have any size,
    1e-40 rad or 0, and a clutch's guards cannot distinguish such a pendulum from a moving one.
    """
    base = lay.pendulums + i * lay.stride
    phi, speed = base + lay.p_phi, base + lay.p_speed
    still = abs(W[phi, lane]) < _STILL and abs(W[speed, lane]) * W[lay.inverse_rate, lane] < _STILL
    driven = W[lay.vibration_x, lane] * W[base + lay.p_ml, lane] != 0.0
    if not still or Z[lane, i] == LOCKED or driven or (W[phi, lane] == 0.0 and W[speed, lane] == 0.0):
        return False
    W[phi, lane] = W[speed, lane] = 0.0
    return True


@part
def _break_away(W: Floats, Z: Ints, lay: Layout, lane: int) -> None:
    """Start the shaft without acceleration, so that it does not outrun a pendulum that stays at rest.

    Its torques balance the load up to the error of the preceding step.
    """
    Z[lane, SKIP_SHAFT] = 2
    for j in range(lay.n):
        if Z[lane, j] == FREE:
            _at_rest(W, Z, lay, lane, j)
            speed = W[lay.pendulums + j * lay.stride + lay.p_speed, lane]
            if speed == 0.0 and acceleration(W, lay, lane, j) == 0.0:
                Z[lane, SKIP_W + j] = 2


@part
def _unlock(W: Floats, Z: Ints, lay: Layout, lane: int, i: int, target: int) -> None:
    """Release the locked clutch ``i``, and decide all locked clutches together with it.

    Identical clutches reach the same edge simultaneously. Handled one after the other, they would leave each other
    steps of rounding size, in which the trend is lost.
    """
    size = typical_speed(W, lay, lane, i)
    if Z[lane, EVENT_SMOOTH] == 0 and Z[lane, SKIP_T + i] == 0 and decide(W, Z, lay, lane, i, size, -1):
        return
    decide(W, Z, lay, lane, i, size, target)


@part
def _drop_windup(W: Floats, lay: Layout, lane: int, i: int) -> None:
    """Count the energy of a damped clutch that opens wound up: its damping takes it while it unwinds by itself."""
    base = lay.pendulums + i * lay.stride
    if W[base + lay.p_clutch_damping, lane] > 0.0:
        W[base + lay.p_work_clutch, lane] += stored_energy(W, lay, lane, i, max(W[base + lay.p_u, lane], 0.0))


@part
def _transit_shaft(W: Floats, Z: Ints, lay: Layout, lane: int, target: int) -> None:
    """Carry out an event of the shaft."""
    if target >= SLOWER:
        W[lay.speed_low, lane] = 0.0 if is_held(W, lay, lane) else -NEVER
        set_piece(W, Z, lay, lane, int(W[lay.piece, lane]) + (1 if target == FASTER else -1))
        return
    Z[lane, SKIP_SHAFT] = 0
    W[lay.speed, lane] = 0.0
    for j in range(lay.n):
        # A locked pendulum stops with the shaft.
        if Z[lane, j] == LOCKED:
            W[lay.pendulums + j * lay.stride + lay.p_speed, lane] = 0.0
    set_shaft(W, Z, lay, lane, target)
    if target == ROTATING and Z[lane, EVENT_SMOOTH] == 1:
        _break_away(W, Z, lay, lane)


@part
def transit(W: Floats, Z: Ints, lay: Layout, lane: int) -> None:
    """Carry out the event that ended a lane's step: exact values at the crossing, then the new state.

    The skips tell the root finder which leading coefficients are zero by the nature of the crossing (a shaft that
    breaks away starts with no acceleration) so that their rounding errors cannot fire a guard.
    """
    i = Z[lane, EVENT_PENDULUM]
    target = Z[lane, EVENT_TARGET]
    smooth = Z[lane, EVENT_SMOOTH] == 1
    if W[lay.steps, lane] != Z[lane, SKIP_STEP]:
        Z[lane, SKIP_STEP] = int(W[lay.steps, lane])
        for k in range(SKIP_SHAFT, LANE_INTEGERS):
            Z[lane, k] = 0
    if i == OF_SHAFT:
        _transit_shaft(W, Z, lay, lane, target)
        return
    base = lay.pendulums + i * lay.stride
    source = Z[lane, i]
    asked = Z[lane, SKIP_W + i] > 0 or Z[lane, SKIP_U + i] > 0
    if source != target:
        Z[lane, SKIP_W + i] = 0
        Z[lane, SKIP_U + i] = 0
    if _at_rest(W, Z, lay, lane, i):
        # The guards are evaluated again with the exact w.
        return
    if target == START:
        _start(W, Z, lay, lane, i)
        return
    if source == target:
        W[base + lay.p_speed, lane] = W[lay.speed, lane]
        watch_fall(W, lay, lane, i, False)
        return
    if source == LOCKED:
        _unlock(W, Z, lay, lane, i, target)
        return
    if lay.drag == 1 and source >= ENGAGED and target == FREE:
        _drop_windup(W, lay, lane, i)
    if source == ENGAGED and target == FREE and not asked and grazes(W, lay, lane, i):
        W[base + lay.p_speed, lane] = W[lay.speed, lane]
        W[base + lay.p_u, lane] = 0.0
        decide(W, Z, lay, lane, i, typical_speed(W, lay, lane, i), -1)
        return
    if source == TAKE_UP and target == FREE:
        if smooth:
            W[base + lay.p_speed, lane] = W[lay.speed, lane]
    elif BEYOND in (source, target) and target != FREE:
        W[base + lay.p_u, lane] = W[base + lay.p_limit, lane]
    else:
        W[base + lay.p_u, lane] = 0.0
        if target == ENGAGED:
            W[base + lay.p_engagements, lane] += 1.0
    set_clutch(W, Z, lay, lane, i, target)
