"""Clutches that lock: delta = 0 and c_1 > 0 at the start of interaction (docs/theory.md, "The automaton")."""

import math

import numpy as np
from numpy.typing import NDArray

from engine.compile.jit import part
from engine.vibration_drive.layout import Layout
from engine.vibration_drive.states import (
    ENGAGED,
    FREE,
    LOCKED,
    ROTATING,
    SHAFT_STATE,
    SKIP_U,
    SKIP_W,
    law,
    set_clutch,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Relative speed and windup, against the pendulum's own motion, below which another clutch is about to lock too.
_TOUCHING = 1e-9
#: A lock torque this near to 0 or c_1 (as a share of c_1) is at the edge: rounding must not lock what has just opened.
EDGE = 1e-10


@part
def acceleration(W: Floats, lay: Layout, lane: int, i: int) -> float:
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


@part
def lock_share(W: Floats, Z: Ints, lay: Layout, lane: int, i: int) -> float:
    """Torque that would keep w = 0 at clutch ``i``, as a share of its c_1, when interaction starts with delta = 0.

    Above 1 the clutch winds up, below 0 it opens, between it locks. If the torque then breaks the held shaft away, what
    counts is the torque with the shaft already moving.
    """
    lanes = lay.lanes
    base = lay.pendulums + i * lay.stride
    first = W[(base + lay.p_law) * lanes + lane]
    own = W[(base + lay.p_inertia) * lanes + lane]
    needed = own * acceleration(W, lay, lane, i)
    push = -W[lay.load * lanes + lane]
    inertia = W[lay.inertia * lanes + lane]
    for j in range(lay.n):
        if j == i:
            continue
        other = lay.pendulums + j * lay.stride
        if Z[lane, j] == LOCKED:
            moved = W[(other + lay.p_inertia) * lanes + lane]
            inertia += moved
            push += moved * acceleration(W, lay, lane, j)
        elif Z[lane, j] >= ENGAGED:
            push += law(W, other + lay.p_force, lay.coefficients, lanes, lane, W[(other + lay.p_u) * lanes + lane])
    if Z[lane, SHAFT_STATE] == ROTATING or push + min(needed, first) > 0.0:
        needed -= own * (push + needed) / (inertia + own)
    return float(needed / first)


@part
def _touches(W: Floats, Z: Ints, lay: Layout, lane: int, j: int, size: float) -> bool:
    """Whether clutch ``j``, not locked, is at w = 0 and u = 0 to rounding and could lock; ``size``: a typical speed."""
    lanes = lay.lanes
    base = lay.pendulums + j * lay.stride
    if W[(base + lay.p_backlash) * lanes + lane] > 0.0 or not W[(base + lay.p_law) * lanes + lane] > 0.0:
        return False
    near = _TOUCHING * size
    w = W[(base + lay.p_speed) * lanes + lane] - W[lay.speed * lanes + lane]
    u = W[(base + lay.p_u) * lanes + lane]
    wound = Z[lane, j] == ENGAGED and abs(u) <= near * W[lay.inverse_rate * lanes + lane]
    return bool(abs(w) <= near and (Z[lane, j] == FREE or wound))


@part
def _in_contact(W: Floats, Z: Ints, lay: Layout, lane: int, i: int, j: int, size: float) -> bool:
    """Whether what clutch ``j`` does is decided together with clutch ``i``, whose interaction starts."""
    return bool(j == i or Z[lane, j] == LOCKED or _touches(W, Z, lay, lane, j, size))


@part
def _excess(W: Floats, Z: Ints, lay: Layout, lane: int, i: int, size: float, push: float, rate: float) -> float:
    """Torque that is left over if the shaft's acceleration is ``rate``; rises with it.

    A clutch in contact then has the torque that keeps w = 0, but at least 0 and at most its c_1.
    """
    lanes = lay.lanes
    left = W[lay.inertia * lanes + lane] * rate - push
    for j in range(lay.n):
        if _in_contact(W, Z, lay, lane, i, j, size):
            base = lay.pendulums + j * lay.stride
            own = W[(base + lay.p_inertia) * lanes + lane]
            torque = own * (acceleration(W, lay, lane, j) - rate)
            left -= min(max(torque, 0.0), W[(base + lay.p_law) * lanes + lane])
    return float(left)


@part
def shared_acceleration(W: Floats, Z: Ints, lay: Layout, lane: int, i: int, size: float) -> float:
    """Acceleration of the shaft that is consistent with every clutch in contact when interaction of ``i`` starts.

    Each of them opens (torque 0), locks (between) or winds up (c_1) as the shaft leaves it behind, keeps it or is left
    behind: a linear complementarity problem. Its torques fall as the shaft's acceleration rises, so that acceleration
    is the one root of a piecewise linear function, whose corners are where a clutch just opens or just winds up.
    """
    lanes = lay.lanes
    push = -W[lay.load * lanes + lane]
    for j in range(lay.n):
        if not _in_contact(W, Z, lay, lane, i, j, size) and Z[lane, j] >= ENGAGED:
            base = lay.pendulums + j * lay.stride
            push += law(W, base + lay.p_force, lay.coefficients, lanes, lane, W[(base + lay.p_u) * lanes + lane])
    if Z[lane, SHAFT_STATE] != ROTATING and _excess(W, Z, lay, lane, i, size, push, 0.0) >= 0.0:
        return 0.0
    low, high = -math.inf, math.inf
    for j in range(lay.n):
        if _in_contact(W, Z, lay, lane, i, j, size):
            base = lay.pendulums + j * lay.stride
            opens = acceleration(W, lay, lane, j)
            winds = opens - W[(base + lay.p_law) * lanes + lane] / W[(base + lay.p_inertia) * lanes + lane]
            for corner in (winds, opens):
                if _excess(W, Z, lay, lane, i, size, push, corner) <= 0.0:
                    low = max(low, corner)
                else:
                    high = min(high, corner)
    inertia = W[lay.inertia * lanes + lane]
    for j in range(lay.n):
        if _in_contact(W, Z, lay, lane, i, j, size):
            base = lay.pendulums + j * lay.stride
            own = W[(base + lay.p_inertia) * lanes + lane]
            first = W[(base + lay.p_law) * lanes + lane]
            opens = acceleration(W, lay, lane, j)
            if opens - first / own >= high:
                push += first
            elif opens > low:
                inertia += own
                push += own * opens
    return float(push / inertia)


@part
def share_at(W: Floats, lay: Layout, lane: int, j: int, rate: float) -> float:
    """Torque that keeps w = 0 at clutch ``j`` while the shaft's acceleration is ``rate``, as a share of its c_1."""
    base = lay.pendulums + j * lay.stride
    own = W[(base + lay.p_inertia) * lay.lanes + lane]
    return float(own * (acceleration(W, lay, lane, j) - rate) / W[(base + lay.p_law) * lay.lanes + lane])


@part
def others_in_contact(W: Floats, Z: Ints, lay: Layout, lane: int, i: int, size: float) -> bool:
    """Whether another clutch is locked, or at w = 0 and u = 0 too, when interaction of ``i`` starts."""
    others = 0
    for j in range(lay.n):
        if j != i and _in_contact(W, Z, lay, lane, i, j, size):
            others += 1
    return others > 0


@part
def settle_others(W: Floats, Z: Ints, lay: Layout, lane: int, i: int, size: float, rate: float) -> None:
    """Put every other clutch in contact into the state that goes with the shaft's acceleration ``rate``.

    At the edge of two states a clutch keeps the one it has: its guards tell the trend.
    """
    lanes = lay.lanes
    for j in range(lay.n):
        if j == i or not _in_contact(W, Z, lay, lane, i, j, size):
            continue
        source = Z[lane, j]
        share = share_at(W, lay, lane, j, rate)
        state = FREE if share < 0.0 else (ENGAGED if share > 1.0 else LOCKED)
        opening, winding = abs(share) < EDGE, abs(share - 1.0) < EDGE
        if state == source or (opening and source != ENGAGED) or (winding and source != FREE):
            continue
        if winding:
            state = ENGAGED
            Z[lane, SKIP_U + j] = 3
        elif opening:
            state = FREE
            Z[lane, SKIP_W + j] = 2
        if source == FREE:
            W[(lay.pendulums + j * lay.stride + lay.p_engagements) * lanes + lane] += 1.0
        W[(lay.pendulums + j * lay.stride + lay.p_speed) * lanes + lane] = W[lay.speed * lanes + lane]
        W[(lay.pendulums + j * lay.stride + lay.p_u) * lanes + lane] = 0.0
        set_clutch(W, Z, lay, lane, j, state)
