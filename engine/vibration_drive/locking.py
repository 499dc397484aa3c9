"""Clutches that lock: delta = 0 and c_1 > 0 at the start of interaction (MODEL.md A2, Filippov's choice)."""

import math

import numpy as np
from numpy.typing import NDArray

from engine.jit import part
from engine.vibration_drive.layout import Layout
from engine.vibration_drive.states import ENGAGED, FREE, LOCKED, ROTATING, SHAFT_STATE, law, set_clutch

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
def lock_together(W: Floats, Z: Ints, lay: Layout, lane: int, i: int, size: float) -> bool:
    """Lock clutch ``i`` together with all others that touch at the same time, if the torques of all allow it.

    Where two clutches each lock and release in turn, the motion slides on both surfaces at once; deciding one by one
    would chatter for ever. The shared acceleration follows from locking all of them; every torque must come out between
    0 and its c_1. Returns False, with nothing changed, if no other touches or the torques forbid it.
    """
    lanes = lay.lanes
    others = 0
    push = -W[lay.load * lanes + lane]
    inertia = W[lay.inertia * lanes + lane]
    for j in range(lay.n):
        base = lay.pendulums + j * lay.stride
        touching = j == i or (Z[lane, j] != LOCKED and _touches(W, Z, lay, lane, j, size))
        if touching or Z[lane, j] == LOCKED:
            others += 1 if touching and j != i else 0
            moved = W[(base + lay.p_inertia) * lanes + lane]
            inertia += moved
            push += moved * acceleration(W, lay, lane, j)
        elif Z[lane, j] >= ENGAGED:
            push += law(W, base + lay.p_force, lay.coefficients, lanes, lane, W[(base + lay.p_u) * lanes + lane])
    if others == 0:
        return False
    shared = push / inertia if Z[lane, SHAFT_STATE] == ROTATING or push > 0.0 else 0.0
    for j in range(lay.n):
        base = lay.pendulums + j * lay.stride
        if j == i or Z[lane, j] == LOCKED or _touches(W, Z, lay, lane, j, size):
            torque = W[(base + lay.p_inertia) * lanes + lane] * (acceleration(W, lay, lane, j) - shared)
            share = torque / W[(base + lay.p_law) * lanes + lane]
            if not EDGE <= share <= 1.0 - EDGE:
                return False
    for j in range(lay.n):
        base = lay.pendulums + j * lay.stride
        if Z[lane, j] != LOCKED and (j == i or _touches(W, Z, lay, lane, j, size)):
            if Z[lane, j] == FREE:
                W[(base + lay.p_engagements) * lanes + lane] += 1.0
            W[(base + lay.p_speed) * lanes + lane] = W[lay.speed * lanes + lane]
            W[(base + lay.p_u) * lanes + lane] = 0.0
            set_clutch(W, Z, lay, lane, j, LOCKED)
    return True
