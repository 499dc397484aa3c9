"""The stops of a lane: begin and end of the window, its whole periods, the end of the run."""

import math

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.compile.jit import part
from sprag_study.engine.vibration_drive import states as ev
from sprag_study.engine.vibration_drive.cases import STOPS, stop_column
from sprag_study.engine.vibration_drive.layout import OUT_SUMS, Layout
from sprag_study.engine.vibration_drive.window import energy, watch_extrema

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_STOPS = stop_column(0)


@part
def _zero_sums(W: Floats, lay: Layout, lane: int) -> None:
    for row in range(lay.sum_held, lay.work_clutch + 1):
        W[row, lane] = 0.0
    W[lay.energy_lost, lane] = 0.0
    W[lay.driving_max, lane] = 0.0
    for i in range(lay.n):
        base = lay.pendulums + i * lay.stride
        for row in range(lay.p_sum_phi, lay.p_engagements + 1):
            W[base + row, lane] = 0.0
        W[lay.driving_max, lane] += W[base + lay.p_engaged, lane]


@part
def _go_on_from_extrema(W: Floats, lay: Layout, lane: int, sums: Floats) -> None:
    """Take extrema that the row of sums holds already for those of the window: lesser ones are not looked for."""
    for row in range(lay.speed_max, lay.useful_max + 1):
        value = sums[OUT_SUMS + row - lay.sum_held]
        if not math.isnan(value):
            W[row, lane] = value
    first = OUT_SUMS + lay.energy_lost - lay.sum_held + 1
    for i in range(lay.n):
        base = lay.pendulums + i * lay.stride
        for row in range(lay.p_phi_max, lay.p_u_max + 1):
            value = sums[first + row - lay.p_sum_phi]
            if not math.isnan(value):
                W[base + row, lane] = value
        first += lay.p_u_max - lay.p_sum_phi + 1


@part
def _input_work(W: Floats, lay: Layout, lane: int) -> float:
    total = 0.0
    for i in range(lay.n):
        base = lay.pendulums + i * lay.stride
        moment = W[base + lay.p_ml, lane] * W[base + lay.p_inertia, lane]
        total += moment * W[base + lay.p_work_input, lane]
    return total


@part
def _pass_stop(W: Floats, Z: Ints, lay: Layout, lane: int, stop: int, sums: Floats) -> None:
    """Do what a stop asks: 0 starts the window, 1 its whole periods, 2 ends it (3, the end of the run, asks
    nothing).
    """
    if stop == 0:
        _zero_sums(W, lay, lane)
        watch_extrema(W, lay, lane, True)
        _go_on_from_extrema(W, lay, lane, sums)
        W[lay.turn_0, lane] = W[lay.turn, lane]
        W[lay.speed_0, lane] = W[lay.speed, lane]
        W[lay.energy_0, lane] = energy(W, Z, lay, lane)
    elif stop == 1:
        W[lay.turn_1, lane] = W[lay.turn, lane]
        W[lay.input_1, lane] = _input_work(W, lay, lane)
        W[lay.square_1, lane] = W[lay.speed_square, lane]
        W[lay.cube_1, lane] = W[lay.speed_cube, lane]
        W[lay.curve_1, lane] = W[lay.curve_work, lane]
    elif stop == 2:
        W[lay.turn_2, lane] = W[lay.turn, lane]
        W[lay.speed_2, lane] = W[lay.speed, lane]
        W[lay.energy_2, lane] = energy(W, Z, lay, lane)
        column = OUT_SUMS
        for row in range(lay.sum_held, lay.energy_lost + 1):
            sums[column] = W[row, lane]
            column += 1
        for i in range(lay.n):
            base = lay.pendulums + i * lay.stride
            for row in range(lay.p_sum_phi, lay.p_u_max + 1):
                sums[column] = W[base + row, lane]
                column += 1
        watch_extrema(W, lay, lane, False)


@part
def next_stop(W: Floats, Z: Ints, lay: Layout, lane: int, cases: Floats, strobe: float, sums: Floats) -> bool:
    """Pass every stop that is due, set the next one (at the latest the period's end); False when the run is over.

    ``strobe`` is the part of each period at which a step ends too.

    Stops are pairs (whole periods, fraction), so that a window given in periods is met exactly.
    """
    row = cases[Z[lane, ev.CASE]]
    f = W[lay.f, lane]
    period_end = strobe if f < strobe else 1.0
    while Z[lane, ev.NEXT_STOP] < STOPS:
        stop = Z[lane, ev.NEXT_STOP]
        whole = row[_STOPS + 2 * stop]
        fraction = row[_STOPS + 2 * stop + 1]
        if whole > Z[lane, ev.PERIOD]:
            break
        if whole == Z[lane, ev.PERIOD] and fraction > f:
            W[lay.f_stop, lane] = min(fraction, period_end)
            return True
        _pass_stop(W, Z, lay, lane, stop, sums)
        Z[lane, ev.NEXT_STOP] = stop + 1
    W[lay.f_stop, lane] = period_end
    return bool(Z[lane, ev.NEXT_STOP] < STOPS)
