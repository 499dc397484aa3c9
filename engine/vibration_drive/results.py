"""The characteristics of a vibration drive: names, units, meaning (docs/theory.md, "Characteristics")."""

import math
from collections.abc import Callable

from sprag_study.engine.catalogue import Kind, ResultInfo


def _shaft() -> tuple[ResultInfo, ...]:
    r = ResultInfo
    return (
        r("shaft.speed.mean", "rad/s", "mean speed of the output shaft over the window"),
        r("shaft.speed.max", "rad/s", "largest speed of the output shaft"),
        r("shaft.speed.min", "rad/s", "smallest speed of the output shaft"),
        r("shaft.irregularity", "1", "(largest - smallest)/mean speed of the output shaft"),
        r("shaft.turn", "rad", "turn of the output shaft during the window"),
        r("shaft.acceleration.max", "rad/s^2", "largest angular acceleration of the output shaft"),
        r("torque.mean", "N*m", "mean torque of all clutches on the shaft"),
        r("torque.max", "N*m", "largest torque of all clutches on the shaft"),
        r("power.useful.mean", "W", "mean power against the load torque, with its parts that rise with the speed"),
        r("power.useful.max", "W", "largest power against the load torque"),
        r("power.clutch.mean", "W", "mean power the clutches give to the shaft"),
        r("power.clutch.max", "W", "largest power the clutches give to the shaft"),
        r("power.input.mean", "W", "mean power the vibrating base puts into the pendulums"),
        r("power.loss.mean", "W", "mean power lost in the damping of the pendulums, of the shaft and of the clutches"),
        r("power.bearing.mean", "W", "mean power lost in the viscous damping of the shaft", generation=1),
        r("power.linear.mean", "W", "mean power against the part of the load that rises with the speed", generation=1),
        r(
            "power.quadratic.mean",
            "W",
            "mean power against the part of the load that rises with the square of the speed",
            generation=1,
        ),
        r(
            "power.stored.mean",
            "W",
            "mean rate at which the machine's own energy grows; near 0 once the motion is settled",
        ),
        r("efficiency", "1", "work against the load / work of the base, over the last whole periods of the window"),
        r("fraction.rotating", "1", "share of the window in which the shaft is not held"),
        r("fraction.held", "1", "share of the window in which the load holds the shaft"),
        r("fraction.driven", "1", "share of the window in which some clutch transmits torque"),
        r("clutches.driving_max", "1", "largest number of clutches transmitting torque at once", "count"),
        r("clutches.engagements_per_period", "1", "engagements of all clutches per excitation period"),
        r("runup.time", "s", "time from rest until the period-mean speed first reaches 95 % of its final value"),
        r("balance.energy", "1", "residual of the energy balance over the window / largest energy in it"),
        r("balance.momentum", "1", "residual of the shaft's momentum balance over the window / largest momentum in it"),
        r("reset.energy_lost", "J", "clutch energy dropped by literal resets during the window"),
        r("run.events", "1", "located transitions of clutches and shaft after t = 0, over the whole run", "count"),
        r("run.steps", "1", "integration steps of the whole run", "count"),
    )


def _pendulum(index: int) -> tuple[ResultInfo, ...]:
    def r(name: str, unit: str, description: str, kind: Kind = "real", generation: int = 0) -> ResultInfo:
        return ResultInfo(f"pendulums.{index}.{name}", unit, description, kind, generation=generation)

    return (
        r("angle.mean", "rad", "mean angle"),
        r("angle.max", "rad", "largest angle"),
        r("angle.min", "rad", "smallest angle"),
        r("angle.amplitude", "rad", "half the difference between largest and smallest angle"),
        r("speed.max", "rad/s", "largest angular speed"),
        r("speed.min", "rad/s", "smallest (most negative) angular speed"),
        r("acceleration.max", "rad/s^2", "largest angular acceleration"),
        r("acceleration.min", "rad/s^2", "smallest (most negative) angular acceleration"),
        r("torque.mean", "N*m", "mean torque of its clutch"),
        r("torque.max", "N*m", "largest torque of its clutch"),
        r("windup.max", "rad", "largest windup of its clutch"),
        r("fraction.engaged", "1", "share of the window in which its clutch transmits torque"),
        r("fraction.beyond_data", "1", "share of the window with windup beyond the measured data"),
        r("engagements", "1", "engagements of its clutch during the window", "count"),
        r("power.input", "W", "mean power the base puts into it"),
        r("power.loss", "W", "mean power lost in its damping"),
        r(
            "power.clutch_loss",
            "W",
            "mean power lost in the damping of its clutch, engaged and overrunning",
            generation=2,
        ),
    )


SHAFT_RESULTS: tuple[ResultInfo, ...] = _shaft()


#: Results of the shaft at a steady speed (rad/s) for a time (s), without a load: the speed is 0 where it stands still.
STEADY_SHAFT: dict[str, Callable[[float, float], float]] = {
    "shaft.speed.mean": lambda speed, _: speed,
    "shaft.speed.max": lambda speed, _: speed,
    "shaft.speed.min": lambda speed, _: speed,
    "shaft.irregularity": lambda speed, _: 0.0 if speed > 0.0 else math.nan,
    "shaft.turn": lambda speed, time: speed * time,
    "fraction.rotating": lambda speed, _: 1.0 if speed > 0.0 else 0.0,
    "fraction.held": lambda speed, _: 0.0 if speed > 0.0 else 1.0,
}


def result_infos(pendulums: int) -> tuple[ResultInfo, ...]:
    """Every result of a drive with ``pendulums`` pendulums, in the order of the engine's result columns."""
    infos = SHAFT_RESULTS
    for index in range(pendulums):
        infos += _pendulum(index)
    return infos


#: Results that belong to a run from its start.
OF_RUNS = frozenset({"runup.time", "run.steps", "run.events"})


def orbit_infos(pendulums: int) -> tuple[ResultInfo, ...]:
    """Every result of an orbit that no run has come to, such as those of a branch."""
    return tuple(info for info in result_infos(pendulums) if info.name not in OF_RUNS)
