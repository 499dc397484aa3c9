"""Specs written in Python.

Made of the descriptions of the spec by ``python -m tests.service.client.generate``; do not edit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypedDict

from sprag_study.service.client.drafts import Quantity, known
from sprag_study.service.client.machines.studies import Studies


class DriveExcitationHarmonics(TypedDict, total=False):
    """Harmonics beside the vibration: d_K cos(m_K nu t + alpha_K) along x, b_K sin(m_K nu t + beta_K) along y.

    table : Rows of order, amplitude along x (m), phase along x (rad), amplitude along y (m), phase along y (rad).
    csv : Order, amplitude and phase along x, amplitude and phase along y as the text of a CSV file, headings with units
        in brackets.
    """

    table: Sequence[Sequence[Quantity]]
    csv: str


class DriveExcitationMeasured(TypedDict, total=False):
    """One period of the measured motion of the base, which is reduced to harmonics.

    table : Rows of angle (rad), x and y (m); or of time (s), of accelerations (m/s^2), as texts with their units.
    csv : Angle or time, and x, y or both, as displacements or accelerations, as the text of a CSV file, headings with
        units in brackets.
    period : Period of the measured motion, of rows with times or accelerations, s; > 0 s and <= 1e+06 s.
    accuracy : Rms residual at which the reduction to harmonics ends, as a share of the amplitude; > 0 and <= 1.
    """

    table: Sequence[Sequence[Quantity]]
    csv: str
    period: Quantity
    accuracy: Quantity


class DriveExcitation(TypedDict, total=False):
    """Fields of excitation.

    frequency : Frequency of the base vibration (nu/2pi), Hz; > 0 Hz and <= 100000 Hz.
    amplitude_x : Horizontal amplitude of the base (d), m; >= 0 m and <= 10 m.
    amplitude_y : Vertical amplitude of the base (b), m; >= 0 m and <= 10 m.
    phase : Phase of the vertical against the horizontal (chi), rad; >= -1000 rad and <= 1000 rad.
    harmonic_factor : Factor of the amplitudes of all harmonics of the base (k_h); >= 0 and <= 1e+06.
    harmonics : Harmonics beside the vibration: d_K cos(m_K nu t + alpha_K) along x, b_K sin(m_K nu t + beta_K) along y;
        fields table, csv.
    measured : One period of the measured motion of the base, which is reduced to harmonics; fields table, csv, period,
        accuracy.
    """

    frequency: Quantity
    amplitude_x: Quantity
    amplitude_y: Quantity
    phase: Quantity
    harmonic_factor: Quantity
    harmonics: DriveExcitationHarmonics
    measured: DriveExcitationMeasured


class DrivePendulum(TypedDict, total=False):
    """Fields of pendulum.

    inertia : Inertia about the axis (J), kg*m^2; > 0 kg*m^2 and <= 1e+06 kg*m^2.
    mass : Mass (M), kg; >= 0 kg and <= 1e+06 kg.
    arm : Axis to centre of mass; negative: hangs down (l), m; >= -1000 m and <= 1000 m.
    spring_rate : Rate of the centring spring (c), N/m; >= 0 N/m and <= 1e+12 N/m.
    spring_arm : Arm of the centring spring (a), m; >= -1000 m and <= 1000 m.
    damping : Viscous damping (lambda), N*m*s/rad; >= 0 N*m*s/rad and <= 1e+06 N*m*s/rad.
    backlash : Backlash of the freewheel (delta), rad; >= 0 rad and <= 1000 rad.
    clutch_damping : Viscous damping of its freewheel while it transmits torque, parallel to the law of the clutch
        (lambda_k), N*m*s/rad; >= 0 N*m*s/rad and <= 1e+06 N*m*s/rad.
    overrunning_damping : Viscous drag of its freewheel while it overruns; where it is not 0, a backstop keeps the shaft
        from turning back (lambda_o), N*m*s/rad; >= 0 N*m*s/rad and <= 1e+06 N*m*s/rad.
    rated_torque : Rating of its freewheel: largest torque that it may transmit (T_r), N*m; > 0 N*m and <= 1e+09 N*m.
    rated_frequency : Rating of its freewheel: most engagements per time (indexing frequency) (f_r), Hz; > 0 Hz and <=
        1e+06 Hz.
    rated_speed : Rating of its freewheel: largest speed at which it may overrun (omega_r), rad/s; > 0 rad/s and <=
        1e+06 rad/s.
    fatigue_exponent : Exponent of the Wöhler curve of its freewheel, for the equivalent torque (m); > 0 and <= 100.
    initial_angle : Angle at t = 0 (phi(0)), rad; >= -1000 rad and <= 1000 rad.
    initial_speed : Angular speed at t = 0 (phi'(0)), rad/s; >= -1e+06 rad/s and <= 1e+06 rad/s.
    initial_windup : Windup of its clutch at t = 0; of no effect where the clutch is free (u(0)), rad; >= -1000 rad and
        <= 1e+06 rad.
    initial_clutch : State of its clutch at t = 0: 0 free, 1 take up, 2 engaged, 3 beyond, 4 locked; >= 0 and <= 4.
    clutch : Torque of the freewheel clutch over its windup.
    """

    inertia: Quantity
    mass: Quantity
    arm: Quantity
    spring_rate: Quantity
    spring_arm: Quantity
    damping: Quantity
    backlash: Quantity
    clutch_damping: Quantity
    overrunning_damping: Quantity
    rated_torque: Quantity
    rated_frequency: Quantity
    rated_speed: Quantity
    fatigue_exponent: Quantity
    initial_angle: Quantity
    initial_speed: Quantity
    initial_windup: Quantity
    initial_clutch: Quantity
    clutch: Any


class DriveShaftLoadTable(TypedDict, total=False):
    """Load torque over the speed of the shaft, beside the other loads; at its ends it holds beyond them.

    table : Rows of speed (rad/s) and load torque (N*m), straight lines between them.
    csv : Speed and load torque as the text of a CSV file, headings with units in brackets.
    """

    table: Sequence[Sequence[Quantity]]
    csv: str


class DriveShaft(TypedDict, total=False):
    """Fields of shaft.

    inertia : Reduced inertia of the driven side (J_e), kg*m^2; > 0 kg*m^2 and <= 1e+06 kg*m^2.
    load : Load torque, which resists rotation only (M_c), N*m; >= 0 N*m and <= 1e+09 N*m.
    bearing_damping : Viscous damping of the shaft, as by its bearings (lambda_e), N*m*s/rad; >= 0 N*m*s/rad and <=
        1e+06 N*m*s/rad.
    linear_load : Load torque per speed, as of a generator (k_1), N*m*s/rad; >= 0 N*m*s/rad and <= 1e+06 N*m*s/rad.
    quadratic_load : Load torque per square of the speed, as of a fan or a pump (k_2), N*m*s^2/rad^2; >= 0 N*m*s^2/rad^2
        and <= 1e+06 N*m*s^2/rad^2.
    stribeck_load : Load torque at rest beyond the load torque, which falls exponentially with the speed, as of friction
        (M_s), N*m; >= 0 N*m and <= 1e+09 N*m.
    stribeck_speed : Speed at which the Stribeck load has fallen to 1/e; required with such a load (omega_s), rad/s; > 0
        rad/s and <= 1e+06 rad/s.
    cyclic_load : Share of the load torque by which it swings with the angle of the shaft, as of a press or a cam; only
        in runs of a given time (kappa); >= 0 and <= 1.
    load_cycles : Cycles of the cyclic load in a turn of the shaft (m); > 0 and <= 1000.
    load_phase : Phase of the cyclic load at t = 0 (psi), rad; >= -1000 rad and <= 1000 rad.
    load_factor : Factor of the torques of a load that is given as a table over the speed (k_M); >= 0 and <= 1e+06.
    rotor_mass : Mass of the shaft and of what is fixed to it, centred on its axis, for the forces on table and bearings
        (m_e), kg; >= 0 kg and <= 1e+06 kg.
    bearing_rating : Basic dynamic radial load rating of the bearing that carries most, for its life (C), N; > 0 N and
        <= 1e+12 N.
    bearing_exponent : Exponent of the life of the bearing: 3 for ball bearings, 10/3 for roller bearings (p); >= 1 and
        <= 10.
    bearing_share : Part of the load of all bearings that the bearing carries which carries most (s); > 0 and <= 1.
    initial_speed : Shaft speed at t = 0 (phi_e'(0)), rad/s; >= 0 rad/s and <= 1e+06 rad/s.
    load_table : Load torque over the speed of the shaft, beside the other loads; at its ends it holds beyond them;
        fields table, csv.
    """

    inertia: Quantity
    load: Quantity
    bearing_damping: Quantity
    linear_load: Quantity
    quadratic_load: Quantity
    stribeck_load: Quantity
    stribeck_speed: Quantity
    cyclic_load: Quantity
    load_cycles: Quantity
    load_phase: Quantity
    load_factor: Quantity
    rotor_mass: Quantity
    bearing_rating: Quantity
    bearing_exponent: Quantity
    bearing_share: Quantity
    initial_speed: Quantity
    load_table: DriveShaftLoadTable


class DriveStart(TypedDict, total=False):
    """Begin in the state in which a case of another study ends; the service replaces it by initial values.

    study : Id of the study.
    case : Number of the case.
    start : Of a case with many starts: which of them.
    """

    study: str
    case: int
    start: int


class DriveRun(TypedDict, total=False):
    """How long each case runs, what is evaluated, how accurately.

    until : Run each case until its motion is settled, unless the run has a duration or a window.
    at_most : Excitation periods after which the search for the settled motion ends: 100 to 100,000.
    settled : Scaled distance from its orbit below which a run counts as settled.
    max_period : Largest number of excitation periods after which a settled motion may repeat.
    duration : End of the run, which then lasts for a given time: a number is seconds, a text says periods or a unit of
        time.
    window : Part of the run that is evaluated, [start, end]; by default the last third.
    tolerance : Local relative error of the integration.
    reset : Whether an upward crossing while torque is transmitted restarts the windup (literal).
    loads : Whether the results have the forces on table and bearing and the duty of the clutches, with margins to their
        ratings, too; each case takes longer.
    """

    until: Literal["settled"]
    at_most: str
    settled: Quantity
    max_period: int
    duration: Quantity
    window: Sequence[Quantity]
    tolerance: Quantity
    reset: Literal["contact", "literal"]
    loads: bool


class Drive(Studies):
    """A study of the model vibration-drive, to be varied and run."""

    _model = "vibration-drive"
    _parameters = (
        "gravity",
        "excitation.frequency",
        "excitation.amplitude_x",
        "excitation.amplitude_y",
        "excitation.phase",
        "excitation.harmonic_factor",
        "excitation.measured.period",
        "excitation.measured.accuracy",
        "pendulums.*.inertia",
        "pendulums.*.mass",
        "pendulums.*.arm",
        "pendulums.*.spring_rate",
        "pendulums.*.spring_arm",
        "pendulums.*.damping",
        "pendulums.*.backlash",
        "pendulums.*.clutch_damping",
        "pendulums.*.overrunning_damping",
        "pendulums.*.rated_torque",
        "pendulums.*.rated_frequency",
        "pendulums.*.rated_speed",
        "pendulums.*.fatigue_exponent",
        "pendulums.*.initial_angle",
        "pendulums.*.initial_speed",
        "pendulums.*.initial_windup",
        "pendulums.*.initial_clutch",
        "pendulums.*.clutch.windup_limit",
        "pendulums.*.clutch.accuracy",
        "shaft.inertia",
        "shaft.load",
        "shaft.bearing_damping",
        "shaft.linear_load",
        "shaft.quadratic_load",
        "shaft.stribeck_load",
        "shaft.stribeck_speed",
        "shaft.cyclic_load",
        "shaft.load_cycles",
        "shaft.load_phase",
        "shaft.load_factor",
        "shaft.rotor_mass",
        "shaft.bearing_rating",
        "shaft.bearing_exponent",
        "shaft.bearing_share",
        "shaft.initial_speed",
        "clutch.windup_limit",
        "clutch.accuracy",
    )

    def __init__(
        self,
        *,
        excitation: DriveExcitation,
        pendulums: Sequence[DrivePendulum],
        shaft: DriveShaft,
        gravity: Quantity | None = None,
        clutch: Any | None = None,
        start: DriveStart | None = None,
        name: str | None = None,
        run: DriveRun | None = None,
        derive: Mapping[str, Any] | None = None,
    ) -> None:
        """A study of the model 'vibration-drive': the machine that every case begins from.

        Parameters
        ----------
        excitation : values
            Fields frequency, amplitude_x, amplitude_y, phase, harmonic_factor, harmonics, measured; needed: frequency.
        pendulums : values
            Fields inertia, mass, arm, spring_rate, spring_arm, damping, backlash, clutch_damping, overrunning_damping,
            rated_torque, rated_frequency, rated_speed, fatigue_exponent, initial_angle, initial_speed, initial_windup,
            initial_clutch, clutch; needed: inertia, mass, arm.
        shaft : values
            Fields inertia, load, bearing_damping, linear_load, quadratic_load, stribeck_load, stribeck_speed,
            cyclic_load, load_cycles, load_phase, load_factor, rotor_mass, bearing_rating, bearing_exponent,
            bearing_share, initial_speed, load_table; needed: inertia.
        gravity : number or text with a unit, optional
            Gravitational acceleration (g), m/s^2; >= 0 m/s^2 and <= 1000 m/s^2.
        clutch : values, optional
            Torque of the freewheel clutch over its windup.
        start : values, optional
            Begin in the state in which a case of another study ends; the service replaces it by initial values; fields
            study, case, start; needed: study, case.
        name : str, optional
            Name of the study.
        run : values, optional
            How long each case runs, what is evaluated, how accurately; fields until, at_most, settled, max_period,
            duration, window, tolerance, reset, loads.
        derive : values, optional
            Parameters that follow from others in every case, by path: formulas of other parameters, of numbers with
            their units and of functions; `*` stands for every pendulum or step.
        """
        super().__init__(
            base=known(
                gravity=gravity, excitation=excitation, pendulums=pendulums, shaft=shaft, clutch=clutch, start=start
            ),
            name=name,
            run=run,
            derive=derive,
        )
