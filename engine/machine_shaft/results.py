"""The results of a machine shaft: names, units, meaning (docs/theory-machine-shaft.md)."""

from sprag_study.engine.catalogue import ResultInfo
from sprag_study.engine.machine_shaft.spec import HARMONICS


def _squares() -> tuple[ResultInfo, ...]:
    meaning = {
        1: "S1 = 2 T_min/I, the share of the least energy",
        2: "S2 = 2 (T_mean - T_min)/I, the share of the mean energy above the least",
        3: "S3 = 2 A_d/I, the share of the drive's work since the angle phi_c",
        4: "S4 = 2 A_r/I, the share of the resistance's work since the angle phi_c",
    }
    return tuple(
        ResultInfo(f"s{k}.{end}", "rad^2/s^2", f"{word} value of {meaning[k]}")
        for k in meaning
        for end, word in (("max", "largest"), ("min", "smallest"), ("amplitude", "half the range of the"))
    )


def _harmonics(name: str, unit: str, what: str) -> tuple[ResultInfo, ...]:
    return tuple(
        ResultInfo(f"{name}.harmonics.{k}", unit, f"amplitude of the {what} {k} times a cycle")
        for k in range(1, HARMONICS + 1)
    )


_R = ResultInfo
MACHINE_RESULTS: tuple[ResultInfo, ...] = (
    _R("omega.mean", "rad/s", "mean speed of the shaft: the middle of its range, or its mean over angle or time"),
    _R("omega.max", "rad/s", "largest speed of the shaft"),
    _R("omega.min", "rad/s", "smallest speed of the shaft"),
    _R("omega.angle_at_max", "rad", "angle at which the speed is largest"),
    _R("omega.angle_at_min", "rad", "angle at which the speed is smallest"),
    _R("irregularity", "1", "coefficient of irregularity: (largest - smallest)/mean speed"),
    _R("energy.fluctuation", "J", "largest less smallest kinetic energy"),
    _R("energy.mean", "J", "mean kinetic energy over the angle"),
    _R("energy.min", "J", "smallest kinetic energy"),
    _R("drive_torque.mean", "N*m", "mean driving torque over the angle"),
    _R("power.mean", "W", "mean driving torque times the mean speed"),
    _R("acceleration.max", "rad/s^2", "largest angular acceleration"),
    *_squares(),
    _R("required_inertia", "kg*m^2", "inertia of the drive that gives the wanted irregularity at the same mean speed"),
    _R("acceleration.min", "rad/s^2", "smallest (most negative) angular acceleration"),
    _R("omega.start", "rad/s", "speed at the angle 0"),
    _R("omega.midrange", "rad/s", "half the sum of largest and smallest speed"),
    _R("omega.mean_angle", "rad/s", "mean of the speed over the angle"),
    _R("omega.mean_time", "rad/s", "mean of the speed over time"),
    _R("irregularity.midrange", "1", "difference of largest and smallest speed over half their sum"),
    _R("irregularity.angle", "1", "difference of largest and smallest speed over the mean over the angle"),
    _R("irregularity.time", "1", "difference of largest and smallest speed over the mean over time"),
    _R("energy.max", "J", "largest kinetic energy"),
    _R("energy.angle_at_max", "rad", "angle at which the kinetic energy is largest"),
    _R("energy.angle_at_min", "rad", "angle at which the kinetic energy is smallest"),
    _R("phi_c", "rad", "angle of the mean kinetic energy, from which the works of S3 and S4 are counted"),
    _R("phi_c.count", "1", "number of angles of the mean kinetic energy in a cycle", "count"),
    _R("inertia.mean", "kg*m^2", "mean reduced inertia over the angle"),
    _R("inertia.max", "kg*m^2", "largest reduced inertia"),
    _R("inertia.min", "kg*m^2", "smallest reduced inertia"),
    _R("drive_torque.max", "N*m", "largest driving torque"),
    _R("drive_torque.min", "N*m", "smallest driving torque"),
    _R("work.drive", "J", "work of the drive over a cycle"),
    _R("work.resistance", "J", "work of the resistance over a cycle"),
    _R("balance.work", "1", "residual work of a cycle / largest work within it"),
    _R("least_mean_speed", "rad/s", "mean speed at which the smallest speed would reach 0: none lower is feasible"),
    _R("assembly.angle", "rad", "first angle at which the mechanism cannot be assembled"),
    _R("inertia.drive", "kg*m^2", "inertia of the drive reduced to the main shaft (I')"),
    _R("inertia.mechanism.mean", "kg*m^2", "mean reduced inertia of the mechanism over the angle (I'')"),
    _R("motor.speed.mean", "rad/s", "mean speed of the motor's shaft"),
    _R("motor.torque.mean", "N*m", "mean torque of the motor over the angle, at its own shaft"),
    _R("motor.torque.max", "N*m", "largest torque of the motor, at its own shaft"),
    _R("motor.power.mean", "W", "mean torque of the motor times its mean speed"),
    _R("energy.coefficient", "1", "coefficient of fluctuation of energy: fluctuation / work of the drive over a cycle"),
    _R("work.drive.max", "J", "largest work of the drive since the angle phi_c (A_d)"),
    _R("work.drive.min", "J", "smallest (most negative) work of the drive since the angle phi_c"),
    _R("work.resistance.max", "J", "largest work of the resistance since the angle phi_c (A_r)"),
    _R("work.resistance.min", "J", "smallest (most negative) work of the resistance since the angle phi_c"),
    _R("omega_squared.amplitude", "rad^2/s^2", "half the range of the square of the speed"),
    *(_R(f"s{k}.share", "1", f"amplitude of S{k} / sum of the amplitudes of S1 to S4") for k in range(1, 5)),
    *_harmonics("omega", "rad/s", "speed's oscillation"),
    *_harmonics("torque", "N*m", "oscillation of the sum of driving and resisting torque"),
    _R("resisting_torque.mean", "N*m", "mean resisting torque over the angle, negative where it resists"),
    _R("balance.factor", "1", "factor on the driving torque or the operation that balances their works"),
    _R("required_inertia.energy", "kg*m^2", "inertia from the energy alone: fluctuation/(irregularity*speed^2)"),
    _R("flywheel.inertia", "kg*m^2", "inertia of the flywheel that is given by its dimensions"),
    _R("flywheel.speed", "m/s", "largest speed of the rim (at its mean diameter) or of the disc's edge"),
    _R("flywheel.stress", "Pa", "largest stress of the flywheel by its rotation"),
    _R("flywheel.margin", "1", "burst margin: speed at which the stress is the allowed one / largest speed"),
    _R("flywheel.required_mass", "kg", "mass of the flywheel at its diameter that gives the wanted irregularity"),
    _R("flywheel.required_diameter", "m", "diameter at which its mass or section gives the wanted irregularity"),
    _R("cycle.multiplier", "1", "factor by which a small deviation of the speed grows in a cycle: stable below 1"),
    _R("motor.torque.rms", "N*m", "root mean square of the motor's torque over time, by which it warms", generation=1),
    _R("motor.power.rms", "W", "root mean square of the motor's power over time", generation=1),
    _R("motor.torque.margin", "1", "thermal margin: rated torque of the motor / rms of its torque", generation=1),
    _R("torsion.natural_frequency", "rad/s", "lowest torsional natural frequency of the train", generation=2),
    _R("torsion.order", "1", "harmonic of the cycle that is nearest to a natural frequency of the train, of those that "
       "excite it", "count", generation=2),
    _R("torsion.margin", "1", "distance of that harmonic from the natural frequency / natural frequency", generation=2),
    _R("torsion.dynamic_factor", "1", "largest torque in a coupling / largest with a rigid train: the largest of all "
       "couplings", generation=2),
    _R("torsion.coupling", "1", "number of the coupling with the largest dynamic factor, counted from 1 at the motor",
       "count", generation=2),
    _R("torsion.torque.amplitude", "N*m", "half the range of the torque in a coupling: the largest of all couplings",
       generation=2),
    _R("torsion.reversals", "1", "number of couplings whose torque changes its sign", "count", generation=2),
)  # fmt: skip


def result_infos() -> tuple[ResultInfo, ...]:
    """Every result of a machine shaft, in the order of the engine's result columns."""
    return MACHINE_RESULTS
