"""States of a lane at the strobes, one excitation period apart: loading a case from one, and recording one.

A strobe is one row of numbers: the part of the excitation period at which strobes are taken, the part at which a case
that begins with this row does so (the same, but for a case that moves its strobes), the shaft's speed, turn and state,
and for each pendulum its angle, speed and windup, the state of its clutch, and whether that clutch, under literal
resets, waits for the relative speed to fall through zero. These determine the subsequent motion (docs/theory.md,
"Settled motion").
"""

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.compile.jit import part
from sprag_study.engine.vibration_drive.layout import Layout
from sprag_study.engine.vibration_drive.states import (
    BEYOND,
    ENGAGED,
    FREE,
    LITERAL,
    NEVER,
    SHAFT_STATE,
    set_clutch,
    set_shaft,
    watch_fall,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Columns of a strobe: of the shaft, then of each pendulum in turn.
FRACTION, BEGIN, SHAFT_SPEED, TURN, SHAFT = range(5)
SHAFT_WIDTH = 5
ANGLE, SPEED, WINDUP, CLUTCH, FALLS = range(5)
PENDULUM_WIDTH = 5
#: The shaft's state in a row that gives none: the case begins at t = 0 with the initial values among its parameters.
NOT_GIVEN = -1.0


def width(pendulums: int) -> int:
    """Columns of a strobe."""
    return SHAFT_WIDTH + PENDULUM_WIDTH * pendulums


def from_rest(cases: int, pendulums: int) -> Floats:
    """Rows with which every case begins at its parameters' initial values, with strobes at the ends of the periods."""
    rows = np.zeros((cases, width(pendulums)))
    rows[:, FRACTION] = 1.0
    rows[:, SHAFT] = NOT_GIVEN
    return rows


def continued(points: Floats) -> Floats:
    """Rows with which cases begin at these states, with strobes at the ends of the periods and the turn at 0.

    The cases may have other parameters than those that the states come from: angles, speeds, windups, the states of
    clutches and shaft and the part of the excitation period are kept.

    Parameters
    ----------
    points : array, shape (cases, columns)
        Strobes, such as ``SettledBatch.points``.
    """
    rows = points.copy()
    rows[:, FRACTION] = 1.0
    rows[:, TURN] = 0.0
    return rows


def in_order(recorded: Floats, periods: Ints) -> Floats:
    """The last strobes of each case, the newest last, from the kernel's ring buffer.

    Parameters
    ----------
    recorded : array, shape (cases, kept, columns)
    periods : array, shape (cases,)
        Whole periods for which each case was run.

    Returns
    -------
    array, shape (cases, kept, columns)
        Where a case has fewer strobes, the first rows are those of `from_rest`, which differ from every strobe.
    """
    cases, kept, columns = recorded.shape
    number = periods[:, None] - kept + np.arange(kept)
    rows: Floats = recorded[np.arange(cases)[:, None], number % kept]
    rows[number < 0] = from_rest(1, (columns - SHAFT_WIDTH) // PENDULUM_WIDTH)[0]
    return rows


@part
def begin_at(W: Floats, Z: Ints, lay: Layout, lane: int, start: Floats) -> None:
    """Put a lane, whose case has just been loaded, into the state of a strobe."""
    W[lay.f, lane] = start[BEGIN]
    if start[SHAFT] == NOT_GIVEN:
        return
    W[lay.speed, lane] = start[SHAFT_SPEED]
    for i in range(lay.n):
        base = lay.pendulums + i * lay.stride
        column = SHAFT_WIDTH + i * PENDULUM_WIDTH
        W[base + lay.p_phi, lane] = start[column + ANGLE]
        W[base + lay.p_speed, lane] = start[column + SPEED]
        W[base + lay.p_u, lane] = start[column + WINDUP]
        state = int(start[column + CLUTCH])
        set_clutch(W, Z, lay, lane, i, state)
        if Z[lane, LITERAL] == 1 and ENGAGED <= state <= BEYOND:
            watch_fall(W, lay, lane, i, start[column + FALLS] == 1.0)
    set_shaft(W, Z, lay, lane, int(start[SHAFT]))


@part
def note(W: Floats, Z: Ints, lay: Layout, lane: int, fraction: float, out: Floats) -> None:
    """Write a lane's state into the row ``out``."""
    out[FRACTION] = fraction
    out[BEGIN] = fraction if fraction < 1.0 else 0.0
    out[SHAFT_SPEED] = W[lay.speed, lane]
    out[TURN] = W[lay.turn, lane]
    out[SHAFT] = Z[lane, SHAFT_STATE]
    for i in range(lay.n):
        base = lay.pendulums + i * lay.stride
        column = SHAFT_WIDTH + i * PENDULUM_WIDTH
        state = Z[lane, i]
        out[column + ANGLE] = W[base + lay.p_phi, lane]
        out[column + SPEED] = W[base + lay.p_speed, lane]
        # The windup of a free clutch is irrelevant: the next interaction starts anew.
        out[column + WINDUP] = -W[base + lay.p_backlash, lane]
        if state != FREE:
            out[column + WINDUP] = W[base + lay.p_u, lane]
        out[column + CLUTCH] = state
        waits = ENGAGED <= state <= BEYOND and W[base + lay.p_w_high, lane] == NEVER
        out[column + FALLS] = 1.0 if Z[lane, LITERAL] == 1 and waits else 0.0
