"""Clutches that lock: delta = 0 and c_1 > 0 (docs/theory.md, "Locking").

All clutches that meet, with w = 0 and u = 0 or locked, are decided together. Their torques follow from the shaft's
acceleration, the one root of a piecewise linear function; where this leaves a clutch at the edge between two states,
its trend follows from the shaft's rate of acceleration in the same way.
"""

import math

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.compile.jit import inlined, part
from sprag_study.engine.elementary.angles import cosine, sine
from sprag_study.engine.elementary.powers import exponential
from sprag_study.engine.vibration_drive.automaton import Band
from sprag_study.engine.vibration_drive.formulas import (
    base_series,
    drive,
    free_acceleration,
    harmonic_series,
    ramped_series,
    resistance,
)
from sprag_study.engine.vibration_drive.layout import Layout
from sprag_study.engine.vibration_drive.states import (
    ENGAGED,
    FREE,
    LOCKED,
    ROTATING,
    SHAFT_STATE,
    SKIP_T,
    SKIP_U,
    SKIP_W,
    clutch_torque,
    count_event,
    law_slope,
    set_clutch,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Speed difference and windup, relative to the pendulum's motion, below which another clutch also locks.
TOUCHING = 1e-9
#: The same for a clutch that reaches or leaves the shaft's speed: smaller values are rounding errors.
ROUNDING = 1e-12
#: A lock torque this near to 0 or c_1 is at the edge of two states, and its trend decides: as a share of c_1 or, where
#: these are smaller, of the torques that meet in the lock.
EDGE = 1e-10
#: Rounding error of a lock torque, as a share of the moments on its pendulum.
_TORQUE_ROUNDING = 1e-14

#: Between two steps the rows of a pendulum's distances to its guards hold what is decided: the torque of the clutch at
#: a shaft that does not accelerate, its bounds, whether it meets others, the lock torque, and how near to 0 or c_1 that
#: is at an edge.
_PULL, _LEAST, _MOST, _MEETS, _LOCK, _NEAR = range(6)

_T_LOW, _T_HIGH = int(Band.T_LOW), int(Band.T_HIGH)


_base_series, _drive, _free_acceleration = inlined(base_series), inlined(drive), inlined(free_acceleration)
_resistance, _harmonic_series = inlined(resistance), inlined(harmonic_series)
_ramped_series = inlined(ramped_series)


@part
def _ramped_base(W: Floats, lay: Layout, lane: int) -> tuple[tuple[float, float], tuple[float, float]]:
    """First two coefficients of the accelerations in x and y of a base whose frequency changes."""
    rate, slope = W[lay.phase_rate, lane], W[lay.phase_slope, lane]
    theta = 2.0 * math.pi * W[lay.phase, lane]
    per = 1.0 / (W[lay.nu, lane] * W[lay.nu, lane])
    b = W[lay.acc_y, lane] * per
    x, y = _ramped_series(
        W[lay.acc_x, lane] * per,
        0.0,
        b * W[lay.sin_chi, lane],
        b * W[lay.cos_chi, lane],
        (rate, slope),
        sine(theta),
        cosine(theta),
    )
    for j in range(lay.harmonics):
        order = W[lay.harmonic_order + j, lane]
        turns = order * W[lay.phase, lane]
        theta = 2.0 * math.pi * (turns - math.floor(turns))
        square = -per / max(order * order, 1.0)  # of no harmonic the order is 0
        further_x, further_y = _ramped_series(
            W[lay.harmonic_x_cos + j, lane] * square,
            W[lay.harmonic_x_sin + j, lane] * square,
            W[lay.harmonic_y_cos + j, lane] * square,
            W[lay.harmonic_y_sin + j, lane] * square,
            (order * rate, order * slope),
            sine(theta),
            cosine(theta),
        )
        x = (x[0] + further_x[0], x[1] + further_x[1])
        y = (y[0] + further_y[0], y[1] + further_y[1])
    return x, y


@part
def _coefficient(W: Floats, lay: Layout, lane: int, i: int, k: int, rate: float) -> float:
    """Coefficient ``k``, 0 or 1, of the acceleration of pendulum ``i`` without its clutch, from the lane's state on;
    its acceleration there is ``rate``.
    """
    base = lay.pendulums + i * lay.stride
    theta = 2.0 * math.pi * W[lay.f, lane]
    x, y = _base_series(
        W[lay.acc_x, lane],
        W[lay.acc_y, lane],
        W[lay.nu, lane],
        sine(theta),
        cosine(theta),
        W[lay.sin_chi, lane],
        W[lay.cos_chi, lane],
    )
    for j in range(lay.harmonics):
        order = W[lay.harmonic_order + j, lane]
        turns = order * W[lay.f, lane]
        theta = 2.0 * math.pi * (turns - math.floor(turns))
        further_x, further_y = _harmonic_series(
            W[lay.harmonic_x_cos + j, lane],
            W[lay.harmonic_x_sin + j, lane],
            W[lay.harmonic_y_cos + j, lane],
            W[lay.harmonic_y_sin + j, lane],
            order * W[lay.nu, lane],
            sine(theta),
            cosine(theta),
        )
        x = (x[0] + further_x[0], x[1] + further_x[1])
        y = (y[0] + further_y[0], y[1] + further_y[1])
    if lay.ramped == 1:
        x, y = _ramped_base(W, lay, lane)
    phi = (W[base + lay.p_phi, lane], W[base + lay.p_speed, lane])
    w = (phi[1], rate)
    s, c = sine(phi[0]), cosine(phi[0])
    sin, cos = (s, c * phi[1]), (c, -s * phi[1])
    ml = W[base + lay.p_ml, lane]
    acceleration = _free_acceleration(
        ml,
        ml * W[lay.gravity, lane],
        W[base + lay.p_spring, lane],
        W[base + lay.p_damping, lane],
        phi[k],
        w[k],
        sin[k],
        _drive(x, y, sin, cos, k),
    )
    return float(acceleration)


@part
def acceleration(W: Floats, lay: Layout, lane: int, i: int) -> float:
    """Acceleration of pendulum ``i`` without its clutch, at the lane's state."""
    return _coefficient(W, lay, lane, i, 0, 0.0)


@part
def _jerk(W: Floats, lay: Layout, lane: int, i: int, rate: float) -> float:
    """Rate of ``acceleration`` while the pendulum moves with the shaft, whose acceleration is ``rate``."""
    return _coefficient(W, lay, lane, i, 1, rate)


@part
def typical_speed(W: Floats, lay: Layout, lane: int, i: int) -> float:
    """Size of the motion of pendulum ``i`` at the lane's state, rad/s."""
    speed = W[lay.pendulums + i * lay.stride + lay.p_speed, lane]
    return float(abs(speed) + abs(acceleration(W, lay, lane, i)) * W[lay.inverse_rate, lane])


@part
def _moments(W: Floats, lay: Layout, lane: int, i: int) -> float:
    """Size in N*m of the moments on pendulum ``i`` without its clutch; they may cancel, and the base's may be 0 now."""
    base = lay.pendulums + i * lay.stride
    phi, w = W[base + lay.p_phi, lane], W[base + lay.p_speed, lane]
    vibration = W[lay.vibration_x, lane] + W[lay.vibration_y, lane]
    driven = abs(W[base + lay.p_ml, lane]) * (vibration + W[lay.gravity, lane] * abs(sine(phi)))
    restoring = W[base + lay.p_spring, lane] * abs(phi) + W[base + lay.p_damping, lane] * abs(w)
    return float(W[base + lay.p_inertia, lane] * (driven + restoring))


@part
def _edge_width(W: Floats, Z: Ints, lay: Layout, lane: int, i: int, push: float) -> float:
    """How near to 0 or c_1 the torque of the lock of pendulum ``i`` is at the edge of two states, in N*m.

    Where c_1 is far above the torques that meet, these decide: a torque that accelerates the shaft against ``push`` by
    as much as the moments on the pendulum can, at most those moments themselves.
    """
    base = lay.pendulums + i * lay.stride
    moments = _moments(W, lay, lane, i)
    meeting = moments
    if Z[lane, SHAFT_STATE] == ROTATING:
        inertia = W[lay.inertia, lane]
        meeting = min(moments * inertia / (inertia + W[base + lay.p_inertia, lane]) + abs(push), moments)
    width = max(EDGE * meeting, _TORQUE_ROUNDING * moments)
    return float(min(EDGE * W[base + lay.p_law, lane], width))


@part
def grazes(W: Floats, lay: Layout, lane: int, i: int) -> bool:
    """Whether clutch ``i``, about to open, could lock and has w = 0 but for rounding."""
    base = lay.pendulums + i * lay.stride
    if W[base + lay.p_backlash, lane] > 0.0 or not W[base + lay.p_law, lane] > 0.0:
        return False
    w = W[base + lay.p_speed, lane] - W[lay.speed, lane]
    return bool(abs(w) <= ROUNDING * typical_speed(W, lay, lane, i))


@part
def _meets(W: Floats, Z: Ints, lay: Layout, lane: int, j: int, size: float) -> bool:
    """Whether clutch ``j`` is locked, or at w = 0 and u = 0 to rounding and could lock; ``size``: a typical speed."""
    base = lay.pendulums + j * lay.stride
    if Z[lane, j] == LOCKED:
        return True
    if W[base + lay.p_backlash, lane] > 0.0 or not W[base + lay.p_law, lane] > 0.0:
        return False
    near = TOUCHING * size
    w = W[base + lay.p_speed, lane] - W[lay.speed, lane]
    u = W[base + lay.p_u, lane]
    wound = Z[lane, j] == ENGAGED and abs(u) <= near * W[lay.inverse_rate, lane]
    return bool(abs(w) <= near and (Z[lane, j] == FREE or wound))


@part
def _torque(W: Floats, lay: Layout, lane: int, j: int, rate: float) -> float:
    """Torque of a clutch, or its rate, while the shaft's acceleration, or its rate, is ``rate``."""
    base = lay.pendulums + j * lay.stride
    notes = base + lay.p_m_w_low
    free = W[notes + _PULL, lane] - W[base + lay.p_inertia, lane] * rate
    return float(min(max(free, W[notes + _LEAST, lane]), W[notes + _MOST, lane]))


@part
def _excess(W: Floats, lay: Layout, lane: int, push: float, rate: float) -> float:
    """Torque that is left over if the shaft's acceleration is ``rate``; rises with it."""
    left = W[lay.inertia, lane] * rate - push
    for j in range(lay.n):
        left -= _torque(W, lay, lane, j, rate)
    return float(left)


@part
def _consistent(W: Floats, lay: Layout, lane: int, push: float) -> float:
    """The shaft's acceleration, or its rate, at which nothing is left over of ``push`` and all torques.

    Its corners are where a clutch's torque comes to one of its bounds; between two of them the function is linear.
    """
    low, high = -math.inf, math.inf
    for j in range(lay.n):
        base = lay.pendulums + j * lay.stride
        notes = base + lay.p_m_w_low
        own = W[base + lay.p_inertia, lane]
        for bound in (_LEAST, _MOST):
            corner = (W[notes + _PULL, lane] - W[notes + bound, lane]) / own
            if abs(corner) < math.inf:
                if _excess(W, lay, lane, push, corner) <= 0.0:
                    low = max(low, corner)
                else:
                    high = min(high, corner)
    inertia = W[lay.inertia, lane]
    for j in range(lay.n):
        base = lay.pendulums + j * lay.stride
        notes = base + lay.p_m_w_low
        own = W[base + lay.p_inertia, lane]
        least, most = W[notes + _LEAST, lane], W[notes + _MOST, lane]
        if (W[notes + _PULL, lane] - most) / own >= high:
            push += most
        elif (W[notes + _PULL, lane] - least) / own <= low:
            push += least
        else:
            inertia += own
            push += W[notes + _PULL, lane]
    return float(push / inertia)


@part
def _falling(W: Floats, lay: Layout, lane: int) -> float:
    """Torque of the load in N*m that falls with the shaft's speed."""
    return float(W[lay.stribeck, lane] * exponential(-W[lay.stribeck_rate, lane] * W[lay.speed, lane]))


@part
def _load_torque(W: Floats, lay: Layout, lane: int) -> float:
    """Torque of the load in N*m that has a factor which changes, without that factor."""
    speed = W[lay.speed, lane]
    torque = W[lay.load, lane] + _resistance(W[lay.generator, lane], W[lay.quadratic, lane], speed, speed * speed)
    torque += _falling(W, lay, lane) + W[lay.cyclic, lane] * cosine(W[lay.cycle, lane])
    if lay.tabled == 1:
        torque += W[lay.level, lane] + W[lay.slope, lane] * speed
    return float(torque)


@part
def _load_rate(W: Floats, lay: Layout, lane: int, rate: float) -> float:
    """Rate of ``_load_torque`` in N*m/s, where the shaft's acceleration is ``rate``."""
    speed = W[lay.speed, lane]
    change = _resistance(W[lay.generator, lane], W[lay.quadratic, lane], rate, 2.0 * speed * rate)
    change -= W[lay.stribeck_rate, lane] * rate * _falling(W, lay, lane)
    change -= W[lay.cyclic, lane] * W[lay.cycles, lane] * speed * sine(W[lay.cycle, lane])
    if lay.tabled == 1:
        change += W[lay.slope, lane] * rate
    return float(change)


@part
def _shared_acceleration(W: Floats, Z: Ints, lay: Layout, lane: int, i: int, size: float) -> float:
    """Acceleration of the shaft that is consistent with all clutches that meet clutch ``i``; notes each one's lock
    torque and the width of its edges.

    Each clutch opens (torque 0), locks (between) or winds up (c_1) as the shaft outruns it, keeps pace or falls behind:
    a linear complementarity problem.
    """
    push = -W[lay.load, lane]
    if lay.drag == 1:
        speed = W[lay.speed, lane]
        push -= _resistance(W[lay.linear, lane], W[lay.quadratic, lane], speed, speed * speed)
    if lay.curved == 1:
        push -= _falling(W, lay, lane) + W[lay.cyclic, lane] * cosine(W[lay.cycle, lane])
    if lay.tabled == 1:
        push -= W[lay.level, lane] + W[lay.slope, lane] * W[lay.speed, lane]
    if lay.ramped == 1:
        push += (1.0 - W[lay.load_factor, lane]) * _load_torque(W, lay, lane)
    for j in range(lay.n):
        base = lay.pendulums + j * lay.stride
        notes = base + lay.p_m_w_low
        for k in range(_NEAR + 1):
            W[notes + k, lane] = 0.0
        if j == i or _meets(W, Z, lay, lane, j, size):
            W[notes + _MEETS, lane] = 1.0
            W[notes + _PULL, lane] = W[base + lay.p_inertia, lane] * acceleration(W, lay, lane, j)
            W[notes + _MOST, lane] = W[base + lay.p_law, lane]
        elif Z[lane, j] >= ENGAGED or lay.drag == 1:
            push += clutch_torque(W, lay, lane, j)
    rate = 0.0
    if Z[lane, SHAFT_STATE] == ROTATING or _excess(W, lay, lane, push, 0.0) < 0.0:
        rate = _consistent(W, lay, lane, push)
    for j in range(lay.n):
        base = lay.pendulums + j * lay.stride
        notes = base + lay.p_m_w_low
        if W[notes + _MEETS, lane] > 0.0:
            W[notes + _LOCK, lane] = W[notes + _PULL, lane] - W[base + lay.p_inertia, lane] * rate
            W[notes + _NEAR, lane] = _edge_width(W, Z, lay, lane, j, push)
    return rate


@part
def _shared_jerk(W: Floats, Z: Ints, lay: Layout, lane: int, rate: float) -> None:
    """Note the rate of each torque that meets, where the shaft's acceleration is ``rate``.

    A clutch at the edge of opening can only gain torque, one at the edge of winding up can only lose it.
    """
    push = 0.0
    if lay.drag == 1:
        push -= _resistance(W[lay.linear, lane], W[lay.quadratic, lane], rate, 2.0 * W[lay.speed, lane] * rate)
    if lay.curved == 1:
        push += W[lay.stribeck_rate, lane] * rate * _falling(W, lay, lane)
        swing = W[lay.cycles, lane] * W[lay.speed, lane]
        push += W[lay.cyclic, lane] * swing * sine(W[lay.cycle, lane])
    if lay.tabled == 1:
        push -= W[lay.slope, lane] * rate
    if lay.ramped == 1:
        push += (1.0 - W[lay.load_factor, lane]) * _load_rate(W, lay, lane, rate)
        push -= W[lay.load_slope, lane] * _load_torque(W, lay, lane)
    for j in range(lay.n):
        base = lay.pendulums + j * lay.stride
        notes = base + lay.p_m_w_low
        if W[notes + _MEETS, lane] > 0.0:
            torque, first, near = W[notes + _LOCK, lane], W[base + lay.p_law, lane], W[notes + _NEAR, lane]
            opening, winding = abs(torque) <= near, abs(torque - first) <= near
            beyond = not (opening or winding) and not 0.0 < torque < first
            W[notes + _PULL, lane] = W[base + lay.p_inertia, lane] * _jerk(W, lay, lane, j, rate)
            W[notes + _LEAST, lane] = 0.0 if opening or beyond else -math.inf
            W[notes + _MOST, lane] = 0.0 if winding or beyond else math.inf
        elif Z[lane, j] >= ENGAGED:
            w = W[base + lay.p_speed, lane] - W[lay.speed, lane]
            u = W[base + lay.p_u, lane]
            push += w * law_slope(W, base + lay.p_force, lay.coefficients, lane, u)
        if lay.drag == 1 and not W[notes + _MEETS, lane] > 0.0:
            swing = acceleration(W, lay, lane, j) - clutch_torque(W, lay, lane, j) / W[base + lay.p_inertia, lane]
            push += W[base + lay.p_rate, lane] * (swing - rate)
    jerk = 0.0
    if Z[lane, SHAFT_STATE] == ROTATING or rate > 0.0:
        jerk = _consistent(W, lay, lane, push)
    for j in range(lay.n):
        base = lay.pendulums + j * lay.stride
        W[base + lay.p_m_w_low + _PULL, lane] -= W[base + lay.p_inertia, lane] * jerk


@part
def _at_edge(W: Floats, lay: Layout, lane: int) -> bool:
    """Whether the lock torque of a clutch that meets others is at 0 or c_1."""
    count = 0
    for j in range(lay.n):
        base = lay.pendulums + j * lay.stride
        notes = base + lay.p_m_w_low
        torque, near = W[notes + _LOCK, lane], W[notes + _NEAR, lane]
        if W[notes + _MEETS, lane] > 0.0 and min(abs(torque), abs(torque - W[base + lay.p_law, lane])) <= near:
            count += 1
    return count > 0


@part
def _put(W: Floats, Z: Ints, lay: Layout, lane: int, j: int, state: int, edge: int) -> None:
    """Put a clutch that meets others into a state, with w = 0 and u = 0 exactly; ``edge``: band of its torque, or 0.

    The skips at the edge tell the guards which leading coefficients are zero there.
    """
    base = lay.pendulums + j * lay.stride
    if Z[lane, j] == FREE and state != FREE:
        W[base + lay.p_engagements, lane] += 1.0
    W[base + lay.p_speed, lane] = W[lay.speed, lane]
    W[base + lay.p_u, lane] = 0.0
    Z[lane, SKIP_W + j] = 2 if edge > 0 and state != LOCKED else 0
    Z[lane, SKIP_U + j] = 3 if edge > 0 and state == ENGAGED else 0
    Z[lane, SKIP_T + j] = edge if state == LOCKED else 0
    set_clutch(W, Z, lay, lane, j, state)


@part
def decide(W: Floats, Z: Ints, lay: Layout, lane: int, i: int, size: float, target: int) -> bool:
    """Put clutch ``i`` and all clutches that it meets into the only consistent combination of states.

    Parameters
    ----------
    size : float
        A typical speed of pendulum ``i``, rad/s, against which others are near.
    target : int
        The state that the torque of the locked clutch ``i`` just enters (FREE or ENGAGED); -1 where it is undecided.

    Returns
    -------
    bool
        Whether any state changed, or a clutch was found at the edge of two.
    """
    rate = _shared_acceleration(W, Z, lay, lane, i, size)
    own = lay.pendulums + i * lay.stride
    if target >= 0:
        # Its torque is at the edge up to the error of the preceding step, as are those of identical clutches.
        passed = W[own + lay.p_law, lane] if target == ENGAGED else 0.0
        error = abs(W[own + lay.p_m_w_low + _LOCK, lane] - passed)
        for j in range(lay.n):
            W[lay.pendulums + j * lay.stride + lay.p_m_w_low + _NEAR, lane] += error
        W[own + lay.p_m_w_low + _LOCK, lane] = passed
    if _at_edge(W, lay, lane):
        _shared_jerk(W, Z, lay, lane, rate)
    put = 0
    for j in range(lay.n):
        base = lay.pendulums + j * lay.stride
        notes = base + lay.p_m_w_low
        if not W[notes + _MEETS, lane] > 0.0:
            continue
        torque, trend, near = W[notes + _LOCK, lane], W[notes + _PULL, lane], W[notes + _NEAR, lane]
        first = W[base + lay.p_law, lane]
        state = FREE if torque < 0.0 else (ENGAGED if torque > first else LOCKED)
        edge = 0
        if abs(torque) <= near:
            edge = _T_LOW
            state = LOCKED if trend > 0.0 else FREE
        elif abs(torque - first) <= near:
            edge = _T_HIGH
            state = ENGAGED if trend > 0.0 else LOCKED
        if j == i and target >= 0:
            state = target
        if Z[lane, j] != state or edge > 0:
            put += 1
            if j != i and Z[lane, j] != state:
                count_event(W, Z, lay, lane)
            _put(W, Z, lay, lane, j, state, edge)
    return put > 0
