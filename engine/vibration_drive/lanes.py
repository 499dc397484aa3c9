"""One lane between two steps: loading a case, budgets, output of the case's sums."""

import math

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.compile.jit import part
from sprag_study.engine.compile.ways import GROUP
from sprag_study.engine.elementary.angles import cosine, sine
from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.taylor.roots import evaluate
from sprag_study.engine.vibration_drive import states as ev
from sprag_study.engine.vibration_drive.advance import ANGLE_BOUND, SPEED_BOUND, STEP_FLOOR
from sprag_study.engine.vibration_drive.automaton import Clutch, Shaft
from sprag_study.engine.vibration_drive.bounds import TOO_LONG
from sprag_study.engine.vibration_drive.cases import (
    HARMONIC_COLUMNS,
    PENDULUM_COLUMNS,
    STOPS,
    TABLE_SPEEDS,
    TABLE_TORQUES,
    Column,
    HarmonicColumn,
    PendulumColumn,
    stop_column,
)
from sprag_study.engine.vibration_drive.events import collect_guards, transit
from sprag_study.engine.vibration_drive.layout import OUT_ENDING, OUT_EVENTS, OUT_RUNUP, OUT_STEPS, OUT_SUMS, Layout
from sprag_study.engine.vibration_drive.parameters import MAX_LOAD_ROWS
from sprag_study.engine.vibration_drive.states import count_event, is_held, law, set_clutch, set_shaft, watch_fall
from sprag_study.engine.vibration_drive.stops import next_stop
from sprag_study.engine.vibration_drive.strobes import FRACTION, begin_at, note
from sprag_study.engine.vibration_drive.window import primitive, sample, series, watch_extrema

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Transitions without any time passing that count as chatter.
MOST_AT_ONCE = 64
#: Halvings of a step after which a series that still misses its law is left to the step floor and the balances.
MOST_HALVINGS = 60
#: Share of the final period-mean speed that ends the run-up.
RUNUP_SHARE = 0.95

_FREE, _LOCKED = int(Clutch.FREE), int(Clutch.LOCKED)
_HELD, _ROTATING = int(Shaft.HELD), int(Shaft.ROTATING)
_OK = ENDINGS.index(Ending.OK)
_ACCURACY = ENDINGS.index(Ending.ACCURACY_NOT_REACHED)
_CHATTER = ENDINGS.index(Ending.CHATTER)
_STEP_BUDGET = ENDINGS.index(Ending.STEP_BUDGET)
_DIVERGED = ENDINGS.index(Ending.DIVERGED)
_RUNNING = -1

_NU, _PERIOD, _ACC_X, _ACC_Y = int(Column.NU), int(Column.PERIOD), int(Column.ACC_X), int(Column.ACC_Y)
_VIBRATION_X, _VIBRATION_Y = int(Column.VIBRATION_X), int(Column.VIBRATION_Y)
_HIGHEST_ORDER = int(Column.HIGHEST_ORDER)
_ORDER, _X_COS, _X_SIN = int(HarmonicColumn.ORDER), int(HarmonicColumn.X_COS), int(HarmonicColumn.X_SIN)
_Y_COS, _Y_SIN = int(HarmonicColumn.Y_COS), int(HarmonicColumn.Y_SIN)
_CHI, _GRAVITY, _LOAD, _INERTIA = int(Column.CHI), int(Column.GRAVITY), int(Column.LOAD), int(Column.INERTIA)
_BEARING, _LINEAR, _QUADRATIC = int(Column.BEARING), int(Column.LINEAR), int(Column.QUADRATIC)
_STRIBECK, _STRIBECK_RATE = int(Column.STRIBECK), int(Column.STRIBECK_RATE)
_CYCLIC, _CYCLES, _CYCLE = int(Column.CYCLIC), int(Column.CYCLES), int(Column.CYCLE)
_INVERSE_RATE, _SPEED, _MOST_STEPS = int(Column.INVERSE_RATE), int(Column.SPEED), int(Column.MOST_STEPS)
_TABLE_SPEEDS, _TABLE_TORQUES = int(TABLE_SPEEDS.start), int(TABLE_TORQUES.start)
_PHASE = int(Column.PHASE)
_FIRST_PENDULUM = stop_column(STOPS)
_P_COPIED = int(PendulumColumn.OVERRUNNING_DAMPING) + 1
_P_ANGLE, _P_SPEED = int(PendulumColumn.ANGLE), int(PendulumColumn.SPEED)
_P_WINDUP, _P_CLUTCH = int(PendulumColumn.WINDUP), int(PendulumColumn.CLUTCH)


@part
def _load_shaft(W: Floats, lay: Layout, lane: int, row: Floats) -> None:
    """Copy what a row of ``cases.case_matrix`` has of excitation and shaft."""
    W[lay.nu, lane] = row[_NU]
    W[lay.period, lane] = row[_PERIOD]
    W[lay.acc_x, lane] = row[_ACC_X]
    W[lay.acc_y, lane] = row[_ACC_Y]
    W[lay.cos_chi, lane] = cosine(row[_CHI])
    W[lay.sin_chi, lane] = sine(row[_CHI])
    W[lay.vibration_x, lane] = row[_VIBRATION_X]
    W[lay.vibration_y, lane] = row[_VIBRATION_Y]
    W[lay.highest_order, lane] = row[_HIGHEST_ORDER]
    for k in range(lay.harmonics):
        column = _FIRST_PENDULUM + lay.n * (PENDULUM_COLUMNS + lay.coefficients) + k * HARMONIC_COLUMNS
        W[lay.harmonic_order + k, lane] = row[column + _ORDER]
        W[lay.harmonic_x_cos + k, lane] = row[column + _X_COS]
        W[lay.harmonic_x_sin + k, lane] = row[column + _X_SIN]
        W[lay.harmonic_y_cos + k, lane] = row[column + _Y_COS]
        W[lay.harmonic_y_sin + k, lane] = row[column + _Y_SIN]
    W[lay.gravity, lane] = row[_GRAVITY]
    W[lay.load, lane] = row[_LOAD]
    W[lay.linear, lane] = row[_BEARING] + row[_LINEAR]
    W[lay.quadratic, lane] = row[_QUADRATIC]
    W[lay.generator, lane] = row[_LINEAR]
    W[lay.stribeck, lane] = row[_STRIBECK]
    W[lay.stribeck_rate, lane] = row[_STRIBECK_RATE]
    W[lay.cyclic, lane] = row[_CYCLIC]
    W[lay.cycles, lane] = row[_CYCLES]
    W[lay.cycle, lane] = row[_CYCLE]
    if lay.ramped == 1:
        for k in range(lay.held_load - lay.phase):
            W[lay.phase + k, lane] = row[_PHASE + k]
    if lay.tabled == 1:
        for k in range(MAX_LOAD_ROWS):
            W[lay.table_speed + k, lane] = row[_TABLE_SPEEDS + k]
            W[lay.table_torque + k, lane] = row[_TABLE_TORQUES + k]
    W[lay.inertia, lane] = row[_INERTIA]
    W[lay.inverse_rate, lane] = row[_INVERSE_RATE]
    W[lay.most_steps, lane] = row[_MOST_STEPS]
    W[lay.speed, lane] = row[_SPEED]


@part
def load_case(
    W: Floats, Z: Ints, lay: Layout, lane: int, case: int, cases: Floats, starts: Floats, literal: int
) -> None:
    """Put a case into a lane at t = 0 (docs/theory.md, "The automaton") or at the strobe in its row of ``starts``.

    ``cases`` has the columns of ``cases.case_matrix``.
    """
    row = cases[case]
    for k in range(lay.rows):
        W[k, lane] = 0.0
    for k in range(ev.LANE_INTEGERS):
        Z[lane, k] = 0
    Z[lane, ev.CASE] = case
    Z[lane, ev.LITERAL] = literal
    Z[lane, ev.EVENT_PENDULUM] = ev.NO_EVENT
    _load_shaft(W, lay, lane, row)
    for i in range(lay.n):
        base = lay.pendulums + i * lay.stride
        column = _FIRST_PENDULUM + i * (PENDULUM_COLUMNS + lay.coefficients)
        for k in range(_P_COPIED):
            W[base + lay.p_ml + k, lane] = row[column + k]
        if W[base + lay.p_overrunning_damping, lane] > 0.0:
            W[lay.backstop, lane] = 1.0
        W[base + lay.p_phi, lane] = row[column + _P_ANGLE]
        W[base + lay.p_speed, lane] = row[column + _P_SPEED]
        for k in range(lay.coefficients):
            W[base + lay.p_law + k, lane] = row[column + PENDULUM_COLUMNS + k]
        state = int(row[column + _P_CLUTCH])
        W[base + lay.p_u, lane] = -W[base + lay.p_backlash, lane]
        if state != _FREE:
            W[base + lay.p_u, lane] = row[column + _P_WINDUP]
        set_clutch(W, Z, lay, lane, i, state)
        if literal == 1 and ev.ENGAGED <= state <= ev.BEYOND:
            watch_fall(W, lay, lane, i, row[column + _P_SPEED] >= row[_SPEED])
    set_shaft(W, Z, lay, lane, _HELD if row[_SPEED] == 0.0 and is_held(W, lay, lane) else _ROTATING)
    begin_at(W, Z, lay, lane, starts[case])
    watch_extrema(W, lay, lane, False)


@part
def runup_periods(turns: Floats, periods: int) -> float:
    """Periods until the period-mean speed first reaches its share of the final one; NaN where the shaft does not turn.

    The period-mean speed at a time is the mean over the period that ends there, taken at whole periods and linearly
    between; it is 0 at the start. ``turns[k]`` is the shaft's turn after k periods.
    """
    if periods < 1:
        return math.nan
    wanted = RUNUP_SHARE * (turns[periods] - turns[periods - 1])
    if not wanted > 0.0:
        return math.nan
    before = 0.0
    for k in range(1, periods + 1):
        mean = turns[k] - turns[k - 1]
        if mean >= wanted:
            return float(k - 1 + (wanted - before) / (mean - before))
        before = mean
    return math.nan


@part
def _finish(
    W: Floats, Z: Ints, lay: Layout, lane: int, ending: int, cases: Floats, turns: Floats, sums: Floats
) -> None:
    case = Z[lane, ev.CASE]
    out = sums[case]
    out[OUT_ENDING] = ending
    out[OUT_STEPS] = W[lay.steps, lane]
    out[OUT_EVENTS] = Z[lane, ev.EVENTS]
    out[OUT_RUNUP] = math.nan
    if ending != _OK:
        out[OUT_SUMS:] = math.nan
    elif cases[case, _SPEED] == 0.0:
        out[OUT_RUNUP] = cases[case, _PERIOD] * runup_periods(turns[lane], Z[lane, ev.PERIOD])


@part
def _take_event(W: Floats, Z: Ints, lay: Layout, lane: int, h: float, most_events: int) -> int:
    """Carry out the event at the step's end and count it; the ending it causes, if any."""
    Z[lane, ev.EVENTS_AT_ONCE] = 0 if h > 0.0 else Z[lane, ev.EVENTS_AT_ONCE] + 1
    pendulum = Z[lane, ev.EVENT_PENDULUM]
    counts = Z[lane, ev.EVENT_TARGET] < ev.SLOWER
    if pendulum != ev.OF_SHAFT:
        counts = Z[lane, pendulum] != Z[lane, ev.EVENT_TARGET]
    locked = pendulum != ev.OF_SHAFT and Z[lane, pendulum] == _LOCKED
    transit(W, Z, lay, lane)
    # A lock may hold after all, where another one opens.
    if counts and not (locked and Z[lane, pendulum] == _LOCKED):
        count_event(W, Z, lay, lane)
    if Z[lane, ev.EVENTS_IN_PERIOD] > most_events or Z[lane, ev.EVENTS_AT_ONCE] > MOST_AT_ONCE:
        return _CHATTER
    return _RUNNING


@part
def _lost(W: Floats, lay: Layout, lane: int) -> int:
    """The abnormal ending a lane has reached after a step, or ``_RUNNING``."""
    if not abs(W[lay.speed, lane]) < SPEED_BOUND:
        return _DIVERGED
    for i in range(lay.n):
        base = lay.pendulums + i * lay.stride
        if not (abs(W[base + lay.p_phi, lane]) < ANGLE_BOUND and abs(W[base + lay.p_speed, lane]) < SPEED_BOUND):
            return _DIVERGED
    if W[lay.h_free, lane] < STEP_FLOOR * W[lay.period, lane]:
        return _ACCURACY
    return _STEP_BUDGET if W[lay.steps, lane] >= W[lay.most_steps, lane] else _RUNNING


@part
def settle(
    W: Floats,
    Z: Ints,
    lay: Layout,
    lane: int,
    cases: Floats,
    starts: Floats,
    strobes: Floats,
    turns: Floats,
    sums: Floats,
    most_events: int,
) -> bool:
    """After ``advance``: events, stops, budgets of a lane that needs attention. True while its case goes on."""
    h = W[lay.x, lane] * W[lay.h, lane]
    ending = _lost(W, lay, lane)
    event = Z[lane, ev.EVENT_PENDULUM] != ev.NO_EVENT
    at_stop = W[lay.at_stop, lane] == 1.0
    if at_stop:
        # The stop is met exactly, regardless of the rounding of the sum of steps. The step to it has no length where
        # an event came at the same time.
        W[lay.f, lane] = W[lay.f_stop, lane]
    if ending == _RUNNING and event:
        ending = _take_event(W, Z, lay, lane, h, most_events)
        Z[lane, ev.EVENT_PENDULUM] = ev.NO_EVENT
    if ending == _RUNNING and at_stop:
        case = Z[lane, ev.CASE]
        strobe = starts[case, FRACTION]
        at_strobe = W[lay.f, lane] == strobe
        if W[lay.f, lane] == 1.0:
            W[lay.f, lane] = 0.0
            Z[lane, ev.PERIOD] += 1
            Z[lane, ev.EVENTS_IN_PERIOD] = 0
            if Z[lane, ev.PERIOD] < turns.shape[1]:
                turns[lane, Z[lane, ev.PERIOD]] = W[lay.turn, lane]
        kept = strobes.shape[1]
        if at_strobe and kept > 0 and Z[lane, ev.PERIOD] > 0:
            note(W, Z, lay, lane, strobe, strobes[case, (Z[lane, ev.PERIOD] - 1) % kept])
        if not next_stop(W, Z, lay, lane, cases, strobe, sums[case]):
            ending = _OK
    if ending == _RUNNING:
        return True
    _finish(W, Z, lay, lane, ending, cases, turns, sums)
    return False


@part
def highest(mask: int) -> int:
    """Number of the highest bit that is set; -1 where none is."""
    bit = -1
    while mask != 0:
        mask >>= 1
        bit += 1
    return bit


@part
def pack(W: Floats, Z: Ints, lay: Layout, turns: Floats, busy: int, groups: int) -> int:
    """Move the lanes that have a case together where fewer groups of lanes hold them; the mask of lanes then.

    ``busy`` has bit k set where lane k has a case, all of them in the first ``groups`` groups.
    """
    left = busy
    count = 0
    while left != 0:
        left &= left - 1
        count += 1
    most = (count + GROUP - 1) // GROUP * GROUP
    if most == groups * GROUP:
        return busy
    free = 0
    for lane in range(most, groups * GROUP):
        if (busy >> lane) & 1 == 0:
            continue
        while (busy >> free) & 1 == 1:
            free += 1
        for row in range(lay.rows):
            W[row, free] = W[row, lane]
        for k in range(ev.LANE_INTEGERS):
            Z[free, k] = Z[lane, k]
        for k in range(min(turns.shape[1], Z[lane, ev.PERIOD] + 1)):
            turns[free, k] = turns[lane, k]
        busy ^= (1 << lane) | (1 << free)
    return busy


@part
def shorten(W: Floats, lay: Layout, lane: int, g: Floats) -> None:
    """Halve the part x of the step that is taken until the series of every clutch's torque meets its law there."""
    x = 1.0
    for i in range(lay.n):
        base = lay.pendulums + i * lay.stride
        if W[base + lay.p_locked, lane] > 0.5:
            continue
        for _ in range(MOST_HALVINGS):
            primitive(W, lay, lane, W[base + lay.p_u, lane], base + lay.p_speed, lay.speed, g)
            u = evaluate(g, lay.order, x)
            torque = law(W, base + lay.p_force, lay.coefficients, lane, u)
            if lay.drag == 1:
                for k in range(lay.order + 1):
                    g[k] = W[base + lay.p_speed + k, lane] - W[lay.speed + k, lane]
                torque += W[base + lay.p_rate, lane] * evaluate(g, lay.order, x)
            series(W, lay, lane, base + lay.p_torque, g)
            if abs(torque - evaluate(g, lay.order, x)) <= W[base + lay.p_allowed, lane]:
                break
            x *= 0.5
    if x < 1.0:
        W[lay.x, lane] = x
        W[lay.at_stop, lane] = 0.0


@part
def look_for_events(
    W: Floats, Z: Ints, lay: Layout, lane: int, g: Floats, blocks: Floats, meta: Ints, used: int
) -> int:
    """Examine a lane whose bounds cannot exclude an event: list its doubtful guards, return the length."""
    if W[lay.margin, lane] == TOO_LONG:
        shorten(W, lay, lane, g)
    return collect_guards(W, Z, lay, lane, g, blocks, meta, used)


@part
def record(
    W: Floats, Z: Ints, lay: Layout, lane: int, times: Floats, done: int, g: Floats, samples: Floats, states: Ints
) -> int:
    """Write the samples that fall into the lane's step, given sample times in excitation periods; how many are done
    then.
    """
    f = W[lay.f, lane]
    x_taken = W[lay.x, lane]
    at_stop = W[lay.at_stop, lane] == 1.0
    length = W[lay.h, lane] / W[lay.period, lane]
    while done < times.shape[0]:
        ahead = (times[done] - Z[lane, ev.PERIOD]) - f
        x = max(0.0, ahead / length)
        if at_stop and times[done] - Z[lane, ev.PERIOD] <= W[lay.f_stop, lane]:
            x = min(1.0, x)
        if x > x_taken or x_taken == 0.0:
            break
        sample(W, Z, lay, lane, x, g, samples[done], states[done])
        done += 1
    return done
