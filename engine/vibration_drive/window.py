"""What is taken from a run besides its end: extrema and energies over the window, samples of a trajectory."""

import math

import numpy as np
from numpy.typing import NDArray

from engine.jit import compiled
from engine.taylor.roots import evaluate, largest
from engine.vibration_drive.automaton import Clutch
from engine.vibration_drive.events import NEVER, stored_energy
from engine.vibration_drive.layout import Layout

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_ENGAGED, _BEYOND = int(Clutch.ENGAGED), int(Clutch.BEYOND)


@compiled
def series(W: Floats, lay: Layout, lane: int, row: int, h: float, g: Floats) -> None:
    """Copy a stored series into ``g``, in fractions of a step of size ``h`` (shape (order + 1,))."""
    power = 1.0
    for k in range(lay.order + 1):
        g[k] = W[(row + k) * lay.lanes + lane] * power
        power *= h


@compiled
def rate(W: Floats, lay: Layout, lane: int, row: int, h: float, g: Floats) -> None:
    """Like ``series``, but its derivative; one order less, so the highest coefficient is zero."""
    power = 1.0
    for k in range(lay.order):
        g[k] = (k + 1) * W[(row + k + 1) * lay.lanes + lane] * power
        power *= h
    g[lay.order] = 0.0


@compiled
def primitive(W: Floats, lay: Layout, lane: int, start: float, row: int, minus: int, h: float, g: Floats) -> None:
    """Like ``series``, but its integral from the value ``start``; the series at row ``minus`` (if >= 0) is subtracted first."""
    g[0] = start
    power = h
    for k in range(lay.order):
        value = W[(row + k) * lay.lanes + lane]
        if minus >= 0:
            value -= W[(minus + k) * lay.lanes + lane]
        g[k + 1] = value * power / (k + 1)
        power *= h


@compiled
def _raise(W: Floats, lay: Layout, lane: int, row: int, g: Floats, stack: Floats) -> None:
    """Raise the maximum kept at ``row`` to the largest value of ``g`` on the step."""
    W[row * lay.lanes + lane] = largest(g, lay.order, W[row * lay.lanes + lane], stack)


@compiled
def _lower(W: Floats, lay: Layout, lane: int, row: int, g: Floats, stack: Floats) -> None:
    """Lower the minimum kept at ``row`` to the smallest value of ``g`` on the step; ``g`` changes sign."""
    for k in range(lay.order + 1):
        g[k] = -g[k]
    W[row * lay.lanes + lane] = -largest(g, lay.order, -W[row * lay.lanes + lane], stack)


@compiled
def update_extrema(W: Floats, lay: Layout, lane: int, g: Floats, stack: Floats) -> None:
    """Extrema of every watched quantity over the lane's step, by its polynomials (nothing is sampled)."""
    lanes = lay.lanes
    h = W[lay.h * lanes + lane]
    series(W, lay, lane, lay.speed, h, g)
    _raise(W, lay, lane, lay.speed_max, g, stack)
    _lower(W, lay, lane, lay.speed_min, g, stack)
    rate(W, lay, lane, lay.speed, h, g)
    _raise(W, lay, lane, lay.acc_max, g, stack)
    series(W, lay, lane, lay.sum, h, g)
    _raise(W, lay, lane, lay.sum_max, g, stack)
    power = 1.0
    for k in range(lay.order + 1):
        value = 0.0
        for j in range(k + 1):
            value += W[(lay.sum + j) * lanes + lane] * W[(lay.speed + k - j) * lanes + lane]
        g[k] = value * power
        power *= h
    _raise(W, lay, lane, lay.power_max, g, stack)
    for i in range(lay.n):
        base = lay.pendulums + i * lay.stride
        speed = base + lay.p_speed
        primitive(W, lay, lane, W[(base + lay.p_phi) * lanes + lane], speed, -1, h, g)
        _raise(W, lay, lane, base + lay.p_phi_max, g, stack)
        _lower(W, lay, lane, base + lay.p_phi_min, g, stack)
        series(W, lay, lane, speed, h, g)
        _raise(W, lay, lane, base + lay.p_speed_max, g, stack)
        _lower(W, lay, lane, base + lay.p_speed_min, g, stack)
        rate(W, lay, lane, speed, h, g)
        _raise(W, lay, lane, base + lay.p_acc_max, g, stack)
        _lower(W, lay, lane, base + lay.p_acc_min, g, stack)
        series(W, lay, lane, base + lay.p_torque, h, g)
        _raise(W, lay, lane, base + lay.p_torque_max, g, stack)
        # A free clutch has u <= 0 (it opens with w <= 0), so that only real windup can exceed the initial maximum 0.
        primitive(W, lay, lane, W[(base + lay.p_u) * lanes + lane], speed, lay.speed, h, g)
        _raise(W, lay, lane, base + lay.p_u_max, g, stack)


@compiled
def watch_extrema(W: Floats, lay: Layout, lane: int, active: bool) -> None:
    """Start the extrema of a lane afresh, or switch them off (then no step can exceed them)."""
    low = -NEVER if active else NEVER
    for row in (lay.speed_max, lay.acc_max, lay.sum_max, lay.power_max):
        W[row * lay.lanes + lane] = low
    W[lay.speed_min * lay.lanes + lane] = -low
    for i in range(lay.n):
        base = lay.pendulums + i * lay.stride
        for row in (lay.p_phi_max, lay.p_speed_max, lay.p_acc_max, lay.p_torque_max):
            W[(base + row) * lay.lanes + lane] = low
        for row in (lay.p_phi_min, lay.p_speed_min, lay.p_acc_min):
            W[(base + row) * lay.lanes + lane] = -low
        W[(base + lay.p_u_max) * lay.lanes + lane] = 0.0 if active else NEVER


@compiled
def energy(W: Floats, I: Ints, lay: Layout, lane: int) -> float:  # noqa: E741
    """Mechanical energy of a lane (MODEL.md A4): pendulums, springs, weight, shaft and wound-up clutches."""
    lanes = lay.lanes
    speed = W[lay.speed * lanes + lane]
    total = 0.5 * W[lay.inertia * lanes + lane] * speed * speed
    for i in range(lay.n):
        base = lay.pendulums + i * lay.stride
        phi = W[(base + lay.p_phi) * lanes + lane]
        w = W[(base + lay.p_speed) * lanes + lane]
        weight = W[(base + lay.p_ml) * lanes + lane] * W[lay.gravity * lanes + lane] * math.cos(phi)
        spring = 0.5 * W[(base + lay.p_spring) * lanes + lane] * phi * phi
        total += W[(base + lay.p_inertia) * lanes + lane] * (0.5 * w * w + weight + spring)
        if I[lane, i] == _ENGAGED or I[lane, i] == _BEYOND:
            total += stored_energy(W, lay, lane, i, W[(base + lay.p_u) * lanes + lane])
    return total


@compiled
def sample(W: Floats, I: Ints, lay: Layout, lane: int, x: float, g: Floats, out: Floats, states: Ints) -> None:  # noqa: E741
    """Write every variable at the fraction ``x`` of the step into ``out``.

    Columns: shaft turn, speed, acceleration, total torque; then per pendulum angle, speed, acceleration, clutch torque,
    windup, acceleration of the base as it drives the pendulum. ``states`` gets the shaft's state and the clutches'.
    """
    lanes = lay.lanes
    h = W[lay.h * lanes + lane]
    primitive(W, lay, lane, W[lay.turn * lanes + lane], lay.speed, -1, h, g)
    out[0] = evaluate(g, lay.order, x)
    series(W, lay, lane, lay.speed, h, g)
    out[1] = evaluate(g, lay.order, x)
    rate(W, lay, lane, lay.speed, h, g)
    out[2] = evaluate(g, lay.order, x)
    series(W, lay, lane, lay.sum, h, g)
    out[3] = evaluate(g, lay.order, x)
    states[0] = int(W[lay.rotating * lanes + lane])
    for i in range(lay.n):
        base = lay.pendulums + i * lay.stride
        speed = base + lay.p_speed
        column = 4 + 6 * i
        primitive(W, lay, lane, W[(base + lay.p_phi) * lanes + lane], speed, -1, h, g)
        out[column] = evaluate(g, lay.order, x)
        series(W, lay, lane, speed, h, g)
        out[column + 1] = evaluate(g, lay.order, x)
        rate(W, lay, lane, speed, h, g)
        out[column + 2] = evaluate(g, lay.order, x)
        series(W, lay, lane, base + lay.p_torque, h, g)
        out[column + 3] = evaluate(g, lay.order, x)
        primitive(W, lay, lane, W[(base + lay.p_u) * lanes + lane], speed, lay.speed, h, g)
        out[column + 4] = evaluate(g, lay.order, x)
        series(W, lay, lane, base + lay.p_drive, h, g)
        out[column + 5] = evaluate(g, lay.order - 1, x)
        states[1 + i] = I[lane, i]
