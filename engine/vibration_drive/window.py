"""Quantities recorded during a run: extrema and energies over the window, samples of a trajectory."""

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.compile.jit import inlined, part
from sprag_study.engine.elementary.angles import cosine
from sprag_study.engine.taylor.batch import HARD, KNOWN, RESULT, SLOTS, STATUS, slot_start, take
from sprag_study.engine.taylor.roots import RECIPROCAL, evaluate, largest
from sprag_study.engine.vibration_drive.automaton import Clutch
from sprag_study.engine.vibration_drive.layout import Layout, PendulumSample, ShaftSample
from sprag_study.engine.vibration_drive.states import NEVER, stored_energy, total

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_ENGAGED, _BEYOND = int(Clutch.ENGAGED), int(Clutch.BEYOND)
_SHAFT_SAMPLES, _PENDULUM_SAMPLES = len(ShaftSample), len(PendulumSample)
_TURN, _SHAFT_SPEED, _SHAFT_ACCELERATION, _SHAFT_TORQUE = map(int, ShaftSample)
_ANGLE, _SPEED, _ACCELERATION, _TORQUE, _WINDUP, _DRIVE = map(int, PendulumSample)


@inlined
def series(W: Floats, lay: Layout, lane: int, row: int, g: Floats) -> None:
    """Copy a stored series into ``g`` (shape (order + 1,)), in fractions of the planned step."""
    for k in range(lay.order + 1):
        g[k] = W[row + k, lane]


@inlined
def rate(W: Floats, lay: Layout, lane: int, row: int, g: Floats) -> None:
    """Like ``series``, but its time derivative; one order less, so the highest coefficient is zero."""
    per_h = 1.0 / W[lay.h, lane]
    for k in range(lay.order):
        g[k] = (k + 1) * per_h * W[row + k + 1, lane]
    g[lay.order] = 0.0


@inlined
def primitive(W: Floats, lay: Layout, lane: int, start: float, row: int, minus: int, g: Floats) -> None:
    """Like ``series``, but its time integral from the value ``start``; the series at row ``minus`` (if >= 0) is
    subtracted first.
    """
    h = W[lay.h, lane]
    g[0] = start
    for k in range(lay.order):
        value = W[row + k, lane]
        if minus >= 0:
            value -= W[minus + k, lane]
        g[k + 1] = h * value * RECIPROCAL[k + 1]


@part
def _power(W: Floats, lay: Layout, lane: int, g: Floats) -> None:
    """Like ``series``, but of the power of all clutches, cut off at the order."""
    total(W, lay, lane, g)
    for k in range(lay.order, -1, -1):
        value = 0.0
        for j in range(k + 1):
            value += g[j] * W[lay.speed + k - j, lane]
        g[k] = value


@part
def _useful_power(W: Floats, lay: Layout, lane: int, g: Floats) -> None:
    """Like ``series``, but of the power against the load, cut off at the order."""
    for k in range(lay.order + 1):
        g[k] = W[lay.curve + k, lane] + W[lay.generator, lane] * W[lay.speed + k, lane]
        for j in range(k + 1):
            g[k] += W[lay.quadratic, lane] * W[lay.speed + j, lane] * W[lay.speed + k - j, lane]
    g[0] += W[lay.load, lane]
    for k in range(lay.order, -1, -1):
        value = 0.0
        for j in range(k + 1):
            value += g[j] * W[lay.speed + k - j, lane]
        g[k] = value


@inlined
def _enter(
    W: Floats,
    lay: Layout,
    lane: int,
    row: int,
    block: int,
    sign: float,
    g: Floats,
    blocks: Floats,
    meta: Ints,
    used: int,
) -> int:
    """Put ``g`` on the list of polynomials whose largest value is wanted if it can exceed the extremum kept at ``row``.

    The extremum is a maximum for ``sign`` 1, a minimum for -1; ``block`` rows further stands by how much the step may
    exceed it. Returns the length of the list.
    """
    if W[row + block, lane] <= 0.0:
        return used
    x = W[lay.x, lane]
    start = slot_start(lay.order, used)
    power = sign
    for k in range(lay.order + 1):
        blocks[start + k * SLOTS] = g[k] * power
        power *= x
    blocks[start + (lay.order + KNOWN) * SLOTS] = sign * W[row, lane]
    meta[used, 0] = row
    meta[used, 1] = lane
    meta[used, 2] = int(sign)
    return used + 1


@inlined
def _exceeds(W: Floats, lane: int, first: int, last: int) -> bool:
    """Whether any of the excesses at rows ``first`` .. ``last`` is positive."""
    found = False
    for row in range(first, last + 1):
        found |= not W[row, lane] <= 0.0
    return found


@part
def collect_peaks(W: Floats, lay: Layout, lane: int, g: Floats, blocks: Floats, meta: Ints, used: int) -> int:
    """List every watched quantity of a lane that may exceed its extremum in the part of the step that is taken.

    The list holds the quantities' polynomials; nothing is sampled. Returns its length.
    """
    block = lay.x_speed_max - lay.speed_max
    if _exceeds(W, lane, lay.x_speed_max, lay.x_speed_min):
        series(W, lay, lane, lay.speed, g)
        used = _enter(W, lay, lane, lay.speed_max, block, 1.0, g, blocks, meta, used)
        used = _enter(W, lay, lane, lay.speed_min, block, -1.0, g, blocks, meta, used)
    if _exceeds(W, lane, lay.x_acc_max, lay.x_acc_max):
        rate(W, lay, lane, lay.speed, g)
        used = _enter(W, lay, lane, lay.acc_max, block, 1.0, g, blocks, meta, used)
    # The sum of a single torque has that torque's extremum.
    if lay.n > 1 and _exceeds(W, lane, lay.x_sum_max, lay.x_sum_max):
        total(W, lay, lane, g)
        used = _enter(W, lay, lane, lay.sum_max, block, 1.0, g, blocks, meta, used)
    if _exceeds(W, lane, lay.x_power_max, lay.x_power_max):
        _power(W, lay, lane, g)
        used = _enter(W, lay, lane, lay.power_max, block, 1.0, g, blocks, meta, used)
    if lay.curved == 1 and _exceeds(W, lane, lay.x_useful_max, lay.x_useful_max):
        _useful_power(W, lay, lane, g)
        used = _enter(W, lay, lane, lay.useful_max, block, 1.0, g, blocks, meta, used)
    block = lay.p_x_phi_max - lay.p_phi_max
    for i in range(lay.n):
        base = lay.pendulums + i * lay.stride
        speed = base + lay.p_speed
        if _exceeds(W, lane, base + lay.p_x_phi_max, base + lay.p_x_phi_min):
            primitive(W, lay, lane, W[base + lay.p_phi, lane], speed, -1, g)
            used = _enter(W, lay, lane, base + lay.p_phi_max, block, 1.0, g, blocks, meta, used)
            used = _enter(W, lay, lane, base + lay.p_phi_min, block, -1.0, g, blocks, meta, used)
        if _exceeds(W, lane, base + lay.p_x_speed_max, base + lay.p_x_speed_min):
            series(W, lay, lane, speed, g)
            used = _enter(W, lay, lane, base + lay.p_speed_max, block, 1.0, g, blocks, meta, used)
            used = _enter(W, lay, lane, base + lay.p_speed_min, block, -1.0, g, blocks, meta, used)
        if _exceeds(W, lane, base + lay.p_x_acc_max, base + lay.p_x_acc_min):
            rate(W, lay, lane, speed, g)
            used = _enter(W, lay, lane, base + lay.p_acc_max, block, 1.0, g, blocks, meta, used)
            used = _enter(W, lay, lane, base + lay.p_acc_min, block, -1.0, g, blocks, meta, used)
        if _exceeds(W, lane, base + lay.p_x_torque_max, base + lay.p_x_torque_max):
            series(W, lay, lane, base + lay.p_torque, g)
            used = _enter(W, lay, lane, base + lay.p_torque_max, block, 1.0, g, blocks, meta, used)
        # A free clutch has u <= 0 (it opens with w <= 0), so that only real windup can exceed the initial maximum 0.
        if _exceeds(W, lane, base + lay.p_x_u_max, base + lay.p_x_u_max):
            primitive(W, lay, lane, W[base + lay.p_u, lane], speed, lay.speed, g)
            used = _enter(W, lay, lane, base + lay.p_u_max, block, 1.0, g, blocks, meta, used)
    return used


@part
def settle_peaks(W: Floats, lay: Layout, g: Floats, stack: Floats, blocks: Floats, meta: Ints, used: int) -> None:
    """After the vector loops over the list: keep the new extrema."""
    for slot in range(used):
        start = slot_start(lay.order, slot)
        value = blocks[start + (lay.order + RESULT) * SLOTS]
        if blocks[start + (lay.order + STATUS) * SLOTS] == HARD:
            take(blocks, lay.order, slot, g)
            value = largest(g, lay.order, blocks[start + (lay.order + KNOWN) * SLOTS], stack)
        W[meta[slot, 0], meta[slot, 1]] = meta[slot, 2] * value


@part
def watch_extrema(W: Floats, lay: Layout, lane: int, active: bool) -> None:
    """Start the extrema of a lane afresh, or switch them off (then no step can exceed them)."""
    low = -NEVER if active else NEVER
    for row in (lay.speed_max, lay.acc_max, lay.sum_max, lay.power_max, lay.useful_max):
        W[row, lane] = low
    W[lay.speed_min, lane] = -low
    for i in range(lay.n):
        base = lay.pendulums + i * lay.stride
        for row in (lay.p_phi_max, lay.p_speed_max, lay.p_acc_max, lay.p_torque_max):
            W[base + row, lane] = low
        for row in (lay.p_phi_min, lay.p_speed_min, lay.p_acc_min):
            W[base + row, lane] = -low
        W[base + lay.p_u_max, lane] = 0.0 if active else NEVER


@part
def energy(W: Floats, Z: Ints, lay: Layout, lane: int) -> float:
    """Mechanical energy of a lane (docs/theory.md): pendulums, springs, weight, shaft and wound-up clutches."""
    speed = W[lay.speed, lane]
    total = 0.5 * W[lay.inertia, lane] * speed * speed
    for i in range(lay.n):
        base = lay.pendulums + i * lay.stride
        phi = W[base + lay.p_phi, lane]
        w = W[base + lay.p_speed, lane]
        weight = W[base + lay.p_ml, lane] * W[lay.gravity, lane] * cosine(phi)
        spring = 0.5 * W[base + lay.p_spring, lane] * phi * phi
        total += W[base + lay.p_inertia, lane] * (0.5 * w * w + weight + spring)
        if Z[lane, i] == _ENGAGED or Z[lane, i] == _BEYOND:
            total += stored_energy(W, lay, lane, i, W[base + lay.p_u, lane])
    return float(total)


@part
def sample(W: Floats, Z: Ints, lay: Layout, lane: int, x: float, g: Floats, out: Floats, states: Ints) -> None:
    """Write every variable at the fraction ``x`` of the step into ``out``.

    Columns: ``ShaftSample``, then ``PendulumSample`` of each pendulum. ``states`` gets the shaft's state and the
    clutches'.
    """
    primitive(W, lay, lane, W[lay.turn, lane], lay.speed, -1, g)
    out[_TURN] = evaluate(g, lay.order, x)
    series(W, lay, lane, lay.speed, g)
    out[_SHAFT_SPEED] = evaluate(g, lay.order, x)
    rate(W, lay, lane, lay.speed, g)
    out[_SHAFT_ACCELERATION] = evaluate(g, lay.order, x)
    total(W, lay, lane, g)
    out[_SHAFT_TORQUE] = evaluate(g, lay.order, x)
    states[0] = int(W[lay.rotating, lane])
    for i in range(lay.n):
        base = lay.pendulums + i * lay.stride
        speed = base + lay.p_speed
        column = _SHAFT_SAMPLES + _PENDULUM_SAMPLES * i
        primitive(W, lay, lane, W[base + lay.p_phi, lane], speed, -1, g)
        out[column + _ANGLE] = evaluate(g, lay.order, x)
        series(W, lay, lane, speed, g)
        out[column + _SPEED] = evaluate(g, lay.order, x)
        rate(W, lay, lane, speed, g)
        out[column + _ACCELERATION] = evaluate(g, lay.order, x)
        series(W, lay, lane, base + lay.p_torque, g)
        out[column + _TORQUE] = evaluate(g, lay.order, x)
        primitive(W, lay, lane, W[base + lay.p_u, lane], speed, lay.speed, g)
        out[column + _WINDUP] = evaluate(g, lay.order, x)
        series(W, lay, lane, base + lay.p_drive, g)
        out[column + _DRIVE] = evaluate(g, lay.order - 1, x)
        states[1 + i] = Z[lane, i]
