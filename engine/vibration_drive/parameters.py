"""Parameters of a vibration drive: paths, SI units, ranges, defaults (docs/theory.md, "The machine")."""

import math
from collections.abc import Mapping
from dataclasses import replace

from sprag_study.engine.catalogue import IN_ANOTHER_UNIT, IN_DEGREES, IN_MM, IN_RPM, STANDARD_GRAVITY, Parameter
from sprag_study.engine.vibration_drive.automaton import Clutch
from sprag_study.sentences import Sentence

MAX_PENDULUMS = 8
MAX_COEFFICIENTS = 12
#: Most rows of a load that is given as a table.
MAX_LOAD_ROWS = 32


_INF = math.inf

#: States of clutches among the initial values.
START_STATES = frozenset({"initial_windup", "initial_clutch"})
#: Torques that depend on speeds: a drive in which any of them is given needs a kernel that has them.
DRAG = frozenset({"bearing_damping", "linear_load", "quadratic_load", "clutch_damping", "overrunning_damping"})
#: Loads that are no polynomials of the speed: a drive in which any of them is given needs a kernel that has them too.
CURVE = frozenset({"stribeck_load", "stribeck_speed", "cyclic_load", "load_cycles", "load_phase"})
#: Beginning of the paths of the rows of a load that is given as a table over the speed.
LOAD_TABLE = "shaft.load_table."
#: Factor of the torques of that table.
LOAD_FACTOR = "shaft.load_factor"
#: Beginning of the paths of the harmonics of the base vibration, each at its place in their list.
HARMONICS = "excitation.harmonics."
#: Factor of the amplitudes of all harmonics.
HARMONIC_FACTOR = "excitation.harmonic_factor"
#: Most harmonics of a base vibration, and the highest order of one.
MAX_HARMONICS, MAX_HARMONIC_ORDER = 16, 64
#: A load that swings with the angle of the shaft, for runs of a given time only.
CYCLIC = "shaft.cyclic_load"
#: A load that falls with the speed, and the speed at which it does.
STRIBECK, STRIBECK_AT = "shaft.stribeck_load", "shaft.stribeck_speed"
#: What bearings and freewheels may bear, and what their loads need beside the motion, which it does not change.
RATINGS = frozenset(
    {"rated_torque", "rated_frequency", "rated_speed", "fatigue_exponent"}
    | {"rotor_mass", "bearing_rating", "bearing_exponent", "bearing_share"}
)
#: What belongs to a load that is given as a table.
TABLE = frozenset({"load_factor"})
#: What belongs to a base vibration with harmonics.
HARMONIC = frozenset({"harmonic_factor"})
#: Parameters that a study has only where they are given: studies from before they existed keep their cases.
ONLY_GIVEN = START_STATES | DRAG | CURVE | TABLE | HARMONIC | RATINGS

_PARAMETERS = (
    Parameter("gravity", "g", "m/s^2", 0.0, 1e3, False, STANDARD_GRAVITY, "gravitational acceleration"),
    Parameter("excitation.frequency", "nu/2pi", "Hz", 0.0, 1e5, True, None, "frequency of the base vibration"),
    Parameter("excitation.amplitude_x", "d", "m", 0.0, 10.0, False, 0.0, "horizontal amplitude of the base"),
    Parameter("excitation.amplitude_y", "b", "m", 0.0, 10.0, False, 0.0, "vertical amplitude of the base"),
    Parameter("excitation.phase", "chi", "rad", -1e3, 1e3, False, 0.0, "phase of the vertical against the horizontal"),
    Parameter(
        HARMONIC_FACTOR,
        "k_h",
        "1",
        0.0,
        1e6,
        False,
        1.0,
        "factor of the amplitudes of all harmonics of the base",
    ),
    Parameter("pendulums.N.inertia", "J", "kg*m^2", 0.0, 1e6, True, None, "inertia about the axis"),
    Parameter("pendulums.N.mass", "M", "kg", 0.0, 1e6, False, None, "mass"),
    Parameter("pendulums.N.arm", "l", "m", -1e3, 1e3, False, None, "axis to centre of mass; negative: hangs down"),
    Parameter("pendulums.N.spring_rate", "c", "N/m", 0.0, 1e12, False, 0.0, "rate of the centring spring"),
    Parameter("pendulums.N.spring_arm", "a", "m", -1e3, 1e3, False, 0.0, "arm of the centring spring"),
    Parameter("pendulums.N.damping", "lambda", "N*m*s/rad", 0.0, 1e6, False, 0.0, "viscous damping"),
    Parameter("pendulums.N.backlash", "delta", "rad", 0.0, 1e3, False, 0.0, "backlash of the freewheel"),
    Parameter(
        "pendulums.N.clutch_damping",
        "lambda_k",
        "N*m*s/rad",
        0.0,
        1e6,
        False,
        0.0,
        "viscous damping of its freewheel while it transmits torque, parallel to the law of the clutch",
    ),
    Parameter(
        "pendulums.N.overrunning_damping",
        "lambda_o",
        "N*m*s/rad",
        0.0,
        1e6,
        False,
        0.0,
        "viscous drag of its freewheel while it overruns; where it is not 0, a backstop keeps the shaft from turning "
        "back",
    ),
    Parameter(
        "pendulums.N.rated_torque",
        "T_r",
        "N*m",
        0.0,
        1e9,
        True,
        _INF,
        "rating of its freewheel: largest torque that it may transmit",
    ),
    Parameter(
        "pendulums.N.rated_frequency",
        "f_r",
        "Hz",
        0.0,
        1e6,
        True,
        _INF,
        "rating of its freewheel: most engagements per time (indexing frequency)",
    ),
    Parameter(
        "pendulums.N.rated_speed",
        "omega_r",
        "rad/s",
        0.0,
        1e6,
        True,
        _INF,
        "rating of its freewheel: largest speed at which it may overrun",
    ),
    Parameter(
        "pendulums.N.fatigue_exponent",
        "m",
        "1",
        0.0,
        100.0,
        True,
        _INF,
        "exponent of the Wöhler curve of its freewheel, for the equivalent torque",
    ),
    Parameter("pendulums.N.initial_angle", "phi(0)", "rad", -1e3, 1e3, False, 0.0, "angle at t = 0"),
    Parameter("pendulums.N.initial_speed", "phi'(0)", "rad/s", -1e6, 1e6, False, 0.0, "angular speed at t = 0"),
    Parameter(
        "pendulums.N.initial_windup",
        "u(0)",
        "rad",
        -1e3,
        1e6,
        False,
        0.0,
        "windup of its clutch at t = 0; of no effect where the clutch is free",
    ),
    Parameter(
        "pendulums.N.initial_clutch",
        "",
        "1",
        0.0,
        float(Clutch.LOCKED),
        False,
        0.0,
        "state of its clutch at t = 0: "
        + ", ".join(
            f"{state.value} {state.name.lower().replace('_', ' ')}" for state in Clutch if state < Clutch.START
        ),
    ),
    Parameter("shaft.inertia", "J_e", "kg*m^2", 0.0, 1e6, True, None, "reduced inertia of the driven side"),
    Parameter("shaft.load", "M_c", "N*m", 0.0, 1e9, False, 0.0, "load torque, which resists rotation only"),
    Parameter(
        "shaft.bearing_damping",
        "lambda_e",
        "N*m*s/rad",
        0.0,
        1e6,
        False,
        0.0,
        "viscous damping of the shaft, as by its bearings",
    ),
    Parameter(
        "shaft.linear_load", "k_1", "N*m*s/rad", 0.0, 1e6, False, 0.0, "load torque per speed, as of a generator"
    ),
    Parameter(
        "shaft.quadratic_load",
        "k_2",
        "N*m*s^2/rad^2",
        0.0,
        1e6,
        False,
        0.0,
        "load torque per square of the speed, as of a fan or a pump",
    ),
    Parameter(
        STRIBECK,
        "M_s",
        "N*m",
        0.0,
        1e9,
        False,
        0.0,
        "load torque at rest beyond the load torque, which falls exponentially with the speed, as of friction",
    ),
    Parameter(
        STRIBECK_AT,
        "omega_s",
        "rad/s",
        0.0,
        1e6,
        True,
        1.0,
        "speed at which the Stribeck load has fallen to 1/e; required with such a load",
    ),
    Parameter(
        CYCLIC,
        "kappa",
        "1",
        0.0,
        1.0,
        False,
        0.0,
        "share of the load torque by which it swings with the angle of the shaft, as of a press or a cam; only in runs "
        "of a given time",
    ),
    Parameter("shaft.load_cycles", "m", "1", 0.0, 1e3, True, 1.0, "cycles of the cyclic load in a turn of the shaft"),
    Parameter("shaft.load_phase", "psi", "rad", -1e3, 1e3, False, 0.0, "phase of the cyclic load at t = 0"),
    Parameter(
        LOAD_FACTOR,
        "k_M",
        "1",
        0.0,
        1e6,
        False,
        1.0,
        "factor of the torques of a load that is given as a table over the speed",
    ),
    Parameter(
        "shaft.rotor_mass",
        "m_e",
        "kg",
        0.0,
        1e6,
        False,
        0.0,
        "mass of the shaft and of what is fixed to it, centred on its axis, for the forces on table and bearings",
    ),
    Parameter(
        "shaft.bearing_rating",
        "C",
        "N",
        0.0,
        1e12,
        True,
        _INF,
        "basic dynamic radial load rating of the bearing that carries most, for its life",
    ),
    Parameter(
        "shaft.bearing_exponent",
        "p",
        "1",
        1.0,
        10.0,
        False,
        3.0,
        "exponent of the life of the bearing: 3 for ball bearings, 10/3 for roller bearings",
    ),
    Parameter(
        "shaft.bearing_share",
        "s",
        "1",
        0.0,
        1.0,
        True,
        1.0,
        "part of the load of all bearings that the bearing carries which carries most",
    ),
    Parameter("shaft.initial_speed", "phi_e'(0)", "rad/s", 0.0, 1e6, False, 0.0, "shaft speed at t = 0"),
)

#: Largest plausible magnitude of a parameter by its last names, and the likely mistake beyond it.
_PLAUSIBLE: Mapping[str, tuple[float, Sentence]] = {
    "excitation.frequency": (1e3, Sentence("was it in rpm or rad/s?")),
    "excitation.amplitude_x": (0.1, IN_MM),
    "excitation.amplitude_y": (0.1, IN_MM),
    "excitation.phase": (2.0 * math.pi, IN_DEGREES),
    "inertia": (100.0, Sentence("was it in g*cm^2 or kg*mm^2?")),
    "mass": (1e3, Sentence("was it in g?")),
    "arm": (1.0, IN_MM),
    "spring_arm": (1.0, IN_MM),
    "spring_rate": (1e8, IN_ANOTHER_UNIT),
    "damping": (100.0, IN_ANOTHER_UNIT),
    "bearing_damping": (100.0, IN_ANOTHER_UNIT),
    "clutch_damping": (100.0, IN_ANOTHER_UNIT),
    "overrunning_damping": (100.0, IN_ANOTHER_UNIT),
    "load_phase": (2.0 * math.pi, IN_DEGREES),
    "stribeck_load": (1e4, Sentence("was it in N*mm?")),
    "stribeck_speed": (1e3, IN_RPM),
    "linear_load": (1e3, IN_ANOTHER_UNIT),
    "quadratic_load": (100.0, IN_ANOTHER_UNIT),
    "rated_torque": (1e5, Sentence("was it in N*mm?")),
    "rated_speed": (1e4, IN_RPM),
    "backlash": (0.1, IN_DEGREES),
    "initial_angle": (math.pi, IN_DEGREES),
    "initial_windup": (1.0, IN_DEGREES),
    "initial_speed": (1e3, IN_RPM),
    "load": (1e4, Sentence("was it in N*mm?")),
}


def _with_plausible(parameter: Parameter) -> Parameter:
    limit = _PLAUSIBLE.get(parameter.path) or _PLAUSIBLE.get(parameter.path.rpartition(".")[2])
    return parameter if limit is None else replace(parameter, plausible=limit[0], mistake=limit[1])


PARAMETERS: tuple[Parameter, ...] = tuple(map(_with_plausible, _PARAMETERS))

#: A row of a load that is given as a table; ``K`` counts from 0, and speeds ascend.
LOAD_TABLE_SPEED = Parameter(
    f"{LOAD_TABLE}K.speed", "omega_K", "rad/s", 0.0, 1e6, False, None, "speed of the shaft in a row of its load"
)
LOAD_TABLE_TORQUE = Parameter(
    f"{LOAD_TABLE}K.torque", "M_K", "N*m", 0.0, 1e9, False, None, "load torque in a row of its table over the speed"
)
#: One harmonic of the base vibration; ``K`` counts from 0.
HARMONIC_PARAMETERS = (
    Parameter(
        f"{HARMONICS}K.order",
        "m_K",
        "1",
        1.0,
        float(MAX_HARMONIC_ORDER),
        False,
        None,
        "order of a harmonic of the base: its frequency over that of the vibration, a whole number",
    ),
    Parameter(f"{HARMONICS}K.amplitude_x", "d_K", "m", 0.0, 10.0, False, 0.0, "horizontal amplitude of a harmonic"),
    Parameter(f"{HARMONICS}K.phase_x", "alpha_K", "rad", -1e3, 1e3, False, 0.0, "phase of a harmonic along x"),
    Parameter(f"{HARMONICS}K.amplitude_y", "b_K", "m", 0.0, 10.0, False, 0.0, "vertical amplitude of a harmonic"),
    Parameter(f"{HARMONICS}K.phase_y", "beta_K", "rad", -1e3, 1e3, False, 0.0, "phase of a harmonic along y"),
)
#: Coefficients of the clutch polynomial (docs/theory.md); ``K`` counts from 0, so K = 0 is c_1. Unit N*m/rad^K.
CLUTCH_COEFFICIENT = Parameter(
    "clutch.coefficients.K", "c_(K+1)", "N*m/rad^K", -1e30, 1e30, False, None, "clutch polynomial"
)
#: End of the measured data; beyond it the law goes on straight (state BEYOND). Infinite: no end.
CLUTCH_WINDUP_LIMIT = Parameter(
    "clutch.windup_limit", "u_end", "rad", 0.0, _INF, True, _INF, "largest windup the clutch law was measured to"
)
