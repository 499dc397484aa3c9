"""Rows of the lane workspace, shared by the generated kernel and the event code.

The workspace ``W`` is one float64 array of shape (rows, lanes); scalar code reads quantity ``row`` of a lane as
``W[row, lane]``, and lane loops see the same numbers as one flat array. Rows of pendulum i start at ``pendulums + i *
stride``; fields that begin with ``p_`` are offsets into that block.
"""

from enum import IntEnum
from typing import NamedTuple, cast

import numpy as np

from sprag_study.engine.vibration_drive.parameters import MAX_LOAD_ROWS

# Whole-run values of a case, in the first columns of its row of sums.
OUT_ENDING, OUT_STEPS, OUT_EVENTS, OUT_RUNUP, OUT_SUMS = 0, 1, 2, 3, 4


class ShaftSample(IntEnum):
    """Columns of a sample that are the shaft's; those of each pendulum follow."""

    TURN = 0
    SPEED = 1
    ACCELERATION = 2
    TORQUE = 3


class PendulumSample(IntEnum):
    """Columns of one pendulum in a sample; ``DRIVE`` is the acceleration of the base as it drives the pendulum."""

    ANGLE = 0
    SPEED = 1
    ACCELERATION = 2
    TORQUE = 3
    WINDUP = 4
    DRIVE = 5


def pendulum_samples(i: int) -> slice:
    """The columns of pendulum ``i`` in a sample."""
    first = len(ShaftSample) + i * len(PendulumSample)
    return slice(first, first + len(PendulumSample))


#: Rows of a lane whose excitation, or load, changes linearly in time; first those that a case gives, in their order.
RAMP = ("phase", "phase_rate", "phase_slope", "load_factor", "load_slope", "held_load")


class Layout(NamedTuple):
    """Sizes and row numbers. Compiled code gets them by ``as_record``."""

    n: int
    coefficients: int
    # whether torques act that depend on speeds (`parameters.DRAG`): 0 or 1
    drag: int
    # whether the load has terms that are no polynomial of the speed (`parameters.CURVE`): 0 or 1, with drag only
    curved: int
    # whether the load has a table over the speed (`parameters.LOAD_TABLE`): 0 or 1, with curved only
    tabled: int
    # whether excitation or load change linearly in time (docs/theory.md, "Start-up"): 0 or 1, with curved only
    ramped: int
    # harmonics of the base vibration that the kernel has room for
    harmonics: int
    order: int
    lanes: int
    rows: int
    pendulums: int
    stride: int
    # shaft: time within the excitation period, as a fraction of it; where the next step must stop; the period in s
    f: int
    f_stop: int
    period: int
    # parameters; acc_x, acc_y are the amplitudes of the base's acceleration, inverse_rate scales accelerations to
    # speeds, backstop is 1 where the shaft cannot be turned back, linear and
    # quadratic are the torques per speed and per square of it that resist the shaft, generator the useful part of
    # linear; stribeck is the load's torque that falls with the speed, as exp(-stribeck_rate speed), cyclic the
    # amplitude of that which swings with the shaft's angle, in so many cycles a turn
    nu: int
    acc_x: int
    acc_y: int
    cos_chi: int
    sin_chi: int
    # largest accelerations of the base in x and y, or more; the highest order of its harmonics, 1 without; of each
    # harmonic its order, and factors of cosine and sine of its phase in the acceleration, in x and in y
    vibration_x: int
    vibration_y: int
    highest_order: int
    harmonic_order: int
    harmonic_x_cos: int
    harmonic_x_sin: int
    harmonic_y_cos: int
    harmonic_y_sin: int
    gravity: int
    load: int
    backstop: int
    linear: int
    quadratic: int
    generator: int
    stribeck: int
    stribeck_rate: int
    cyclic: int
    cycles: int
    # where `ramped` says so: the phase of the excitation in turns, its angular frequency and the rate of that; the
    # factor on the load and the rate of that; the load without its factor that holds a shaft, 0 where the shaft rotates
    phase: int
    phase_rate: int
    phase_slope: int
    load_factor: int
    load_slope: int
    held_load: int
    # rows of the table of the load: MAX_LOAD_ROWS speeds and torques each, where `tabled` says so
    table_speed: int
    table_torque: int
    inertia: int
    inverse_rate: int
    most_steps: int
    # mode: 1/(inertia that turns with the shaft), 0 where it is held; flags; bands of the guards; the row of the load's
    # table before which the speed is, and the line level + slope * speed there
    mobility: int
    rotating: int
    driven: int
    sum_high: int
    speed_low: int
    speed_high: int
    piece: int
    level: int
    slope: int
    # step: size planned, size wanted by the tolerance, part of the planned step taken (x = 1 without an event), whether
    # it ends at f_stop, smallest distance of a guarded quantity to its band, largest excess over a known extremum,
    # whether anything but the next step has to happen, number of steps so far
    h: int
    h_free: int
    x: int
    at_stop: int
    margin: int
    excess: int
    attention: int
    steps: int
    # state (with speed[0]); cycle is where the cyclic load is in its cycle, from -pi to pi
    turn: int
    cycle: int
    # sums over the window; speed_square and speed_cube are integrals of powers of the shaft's speed, curve_impulse and
    # curve_work those of the terms of the load that are no polynomial, and of their power
    sum_held: int
    time_held: int
    time_rotating: int
    time_driven: int
    speed_square: int
    speed_cube: int
    curve_impulse: int
    curve_work: int
    work_clutch: int
    # extrema over the window
    speed_max: int
    speed_min: int
    acc_max: int
    sum_max: int
    power_max: int
    useful_max: int
    # marks: values at the window's start (0), at the start of its whole periods (1), at its end (2)
    turn_0: int
    turn_1: int
    turn_2: int
    speed_0: int
    speed_2: int
    energy_0: int
    energy_2: int
    input_1: int
    square_1: int
    cube_1: int
    curve_1: int
    driving_max: int
    energy_lost: int
    # excess of this step over each known extremum
    x_speed_max: int
    x_speed_min: int
    x_acc_max: int
    x_sum_max: int
    x_power_max: int
    x_useful_max: int
    # distance of this step to the shaft's guards
    m_sum_high: int
    m_speed_low: int
    m_speed_high: int
    # series of the shaft's speed, order + 1 coefficients, in fractions of the planned step, and where `curved` says so
    # that of the load's torque beside its polynomial
    speed: int
    curve: int
    # one pendulum
    p_ml: int
    p_spring: int
    p_damping: int
    p_inverse_inertia: int
    p_inertia: int
    p_backlash: int
    p_limit: int
    p_clutch_damping: int
    p_overrunning_damping: int
    # mode flags, and the bands in which relative speed, windup and torque must stay
    p_locked: int
    p_engaged: int
    p_beyond: int
    p_w_low: int
    p_w_high: int
    p_u_low: int
    p_u_high: int
    p_t_low: int
    p_t_high: int
    # state (with p_speed[0])
    p_phi: int
    p_u: int
    # sums, extrema
    p_sum_phi: int
    p_sum_torque: int
    p_work_input: int
    p_work_loss: int
    p_work_clutch: int
    p_time_engaged: int
    p_time_beyond: int
    p_engagements: int
    p_phi_max: int
    p_phi_min: int
    p_speed_max: int
    p_speed_min: int
    p_acc_max: int
    p_acc_min: int
    p_torque_max: int
    p_u_max: int
    # largest defect of the torque's series that the tolerance allows
    p_allowed: int
    # distances of this step to the guards, in the order of the bands; excess over the known extrema
    p_m_w_low: int
    p_m_w_high: int
    p_m_u_low: int
    p_m_u_high: int
    p_m_t_low: int
    p_m_t_high: int
    p_x_phi_max: int
    p_x_phi_min: int
    p_x_speed_max: int
    p_x_speed_min: int
    p_x_acc_max: int
    p_x_acc_min: int
    p_x_torque_max: int
    p_x_u_max: int
    # the clutch law and the law in force (zero where free, straight where beyond the data), and the damping in force
    p_law: int
    p_force: int
    p_rate: int
    # series: speed and torque (order + 1), drive by the base (order)
    p_speed: int
    p_torque: int
    p_drive: int


def _beside(*groups: str) -> None:
    """Raise ValueError where the fields of a group do not follow one another: code goes from one to the next."""
    for group in groups:
        names = group.split()
        first = Layout._fields.index(names[0])
        if Layout._fields[first : first + len(names)] != tuple(names):
            raise ValueError(f"rows of the layout that belong side by side are not: {group}")


_BANDS = "w_low {0}w_high {0}u_low {0}u_high {0}t_low {0}t_high"
_EXTREMA = "phi_max {0}phi_min {0}speed_max {0}speed_min {0}acc_max {0}acc_min {0}torque_max {0}u_max"
_SHAFT_EXTREMA = "speed_max {0}speed_min {0}acc_max {0}sum_max {0}power_max {0}useful_max"
_beside(
    # As the columns of a case (`PendulumColumn`) are copied.
    "p_ml p_spring p_damping p_inverse_inertia p_inertia p_backlash p_limit p_clutch_damping p_overrunning_damping",
    # Sums that begin at 0, those of the shaft and those of a pendulum.
    "sum_held time_held time_rotating time_driven speed_square speed_cube curve_impulse curve_work work_clutch",
    "p_sum_phi p_sum_torque p_work_input p_work_loss p_work_clutch p_time_engaged p_time_beyond p_engagements",
    # What is handed out at the end of a window, as far as characteristics reads it.
    "work_clutch speed_max speed_min acc_max sum_max power_max useful_max turn_0 turn_1 turn_2 speed_0 speed_2 "
    "energy_0 energy_2 input_1 square_1 cube_1 curve_1 driving_max energy_lost",
    "p_engagements p_phi_max p_phi_min p_speed_max p_speed_min p_acc_max p_acc_min p_torque_max p_u_max",
    # Guards in the order of `Band`, and what lies as far from its bounds or extrema as any other.
    f"p_{_BANDS.format('p_')}",
    f"p_m_{_BANDS.format('p_m_')}",
    f"p_{_EXTREMA.format('p_')}",
    f"p_x_{_EXTREMA.format('p_x_')}",
    _SHAFT_EXTREMA.format(""),
    f"x_{_SHAFT_EXTREMA.format('x_')}",
    "phase phase_rate phase_slope load_factor load_slope",
    "sum_high speed_low speed_high",
    "m_sum_high m_speed_low m_speed_high",
)


def make_layout(
    n: int,
    coefficients: int,
    order: int,
    lanes: int,
    *,
    drag: bool = False,
    curved: bool = False,
    tabled: bool = False,
    ramped: bool = False,
    harmonics: int = 0,
) -> Layout:
    """Lay out the rows for ``n`` pendulums, that many clutch coefficients, series of that order, and that many lanes.

    ``drag``: for torques that depend on speeds too; ``curved``: for a load that is no polynomial of the speed besides;
    ``tabled``: for one that is a table over it, and for all of these; ``ramped``: for an excitation and a load that
    change linearly in time, and for all but the table; ``harmonics``: with room for as many of the base.
    """
    curved = curved or tabled or ramped
    sizes = dict.fromkeys(("speed", "p_speed", "p_torque"), order + 1)
    sizes["curve"] = order + 1 if curved else 1
    sizes |= dict.fromkeys(RAMP, int(ramped))
    sizes |= dict.fromkeys(("table_speed", "table_torque"), MAX_LOAD_ROWS if tabled else 1)
    sizes |= dict.fromkeys((name for name in Layout._fields if name.startswith("harmonic_")), harmonics)
    sizes |= {"p_drive": order, "p_law": coefficients, "p_force": coefficients}
    names = Layout._fields[Layout._fields.index("stride") + 1 :]
    fields: dict[str, int] = {}
    shaft_rows = stride = 0
    for name in names:
        if name.startswith("p_"):
            fields[name] = stride
            stride += sizes.get(name, 1)
        else:
            fields[name] = shaft_rows
            shaft_rows += sizes.get(name, 1)
    terms = int(drag or curved), int(curved), int(tabled), int(ramped)
    return Layout(
        n, coefficients, *terms, harmonics, order, lanes, shaft_rows + n * stride, shaft_rows, stride, **fields
    )


def as_record(layout: Layout) -> Layout:
    """The layout as compiled code gets it: a numpy record with the same fields.

    A record is passed to a compiled function as one pointer, a tuple as a hundred numbers at every call.
    """
    dtype = np.dtype([(name, np.int64) for name in Layout._fields])
    return cast(Layout, np.array([tuple(layout)], dtype=dtype)[0])
