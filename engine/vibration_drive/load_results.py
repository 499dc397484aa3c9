"""The results of forces and duty that rows have where a study asks for them: names, units, meaning."""

from sprag_study.engine.catalogue import ResultInfo
from sprag_study.engine.vibration_drive.force_results import force_infos

_TABLE = (
    "table.force_x.min", "table.force_x.max", "table.force_x.rms", "table.force_y.min", "table.force_y.max",
    "table.force_y.rms", "table.force.max", "table.force.rms", "excitation.power_x.mean", "excitation.power_x.max",
    "excitation.power_y.mean", "excitation.power_y.max", "bearing.load.mean", "bearing.load.max", "bearing.load.rms",
    "bearing.equivalent_load", "bearing.rating_life.revolutions", "bearing.rating_life.time", "balance.force",
)  # fmt: skip
_PENDULUM = ("force.max", "force.rms", "spring.force.min", "spring.force.max")
#: Unit and meaning by the field of a `ClutchDuty`.
_DUTY = {
    "engagements_per_hour": ("1", "engagements of its clutch per hour"),
    "torque_max": ("N*m", "largest torque that its clutch transmits"),
    "torque_rate_max": ("N*m/s", "largest rate of that torque in magnitude, between its jumps"),
    "torque_jump_max": ("N*m", "largest jump of that torque"),
    "impact_speed_max": ("rad/s", "largest relative speed of pendulum and shaft at the start of an engagement"),
    "overrunning_speed_max": ("rad/s", "largest speed at which its clutch overruns"),
    "windup_min": ("rad", "smallest windup of its clutch while it transmits torque"),
    "cycles_per_hour": ("1", "cycles of the torque of its clutch per hour, by rainflow counting"),
    "torque_equivalent": (
        "N*m",
        "torque that does the same damage to its clutch when it is reached from zero once in each engagement",
    ),
    "torque_margin": ("1", "rated torque of its clutch / largest torque"),
    "frequency_margin": ("1", "rated frequency of the engagements of its clutch / engagements per time"),
    "speed_margin": ("1", "rated overrunning speed of its clutch / largest overrunning speed"),
}


def duty_name(pendulum: int, field: str) -> str:
    """The name of the result with that field of the `ClutchDuty` of a pendulum's clutch."""
    return f"pendulums.{pendulum}.duty.{field}"


def duty_fields() -> tuple[str, ...]:
    """The fields of a `ClutchDuty` that are results."""
    return tuple(_DUTY)


def load_infos(pendulums: int) -> tuple[ResultInfo, ...]:
    """Every result of forces and duty of a drive with ``pendulums`` pendulums, in the order of the columns of `loads`.

    Of irregular motion they are those of the periods that were examined, without an interval.
    """
    of_forces = {info.name: info for info in force_infos(pendulums)}
    infos = [of_forces[name] for name in _TABLE]
    for i in range(pendulums):
        infos += [of_forces[f"pendulums.{i}.{name}"] for name in _PENDULUM]
        infos += [ResultInfo(duty_name(i, field), unit, text) for field, (unit, text) in _DUTY.items()]
    return tuple(infos)
