"""What is asked of a start-up of a vibration drive, and what it gives (docs/theory.md, "Start-up")."""

from dataclasses import dataclass

from sprag_study.engine.catalogue import ResultInfo
from sprag_study.engine.endings import Ending
from sprag_study.engine.outcome import Trajectory

#: Most excitation periods of a ramp, and of the motion after the ramps.
MOST_PERIODS = 20_000


@dataclass(frozen=True, slots=True)
class Ramps:
    """A start-up that is asked for.

    Attributes
    ----------
    frequency_time : float
        Time in s in which the frequency of the excitation rises linearly to its value; 0: it has it from the start.
    start_frequency : float
        Frequency at the start, Hz.
    load_time : float
        Time in s in which the load of the shaft rises linearly from nothing to its value; 0: it acts from the start.
    within : float
        Share of the settled mean speed by which a mean speed may differ from it that counts as settled.
    """

    frequency_time: float = 0.0
    start_frequency: float = 0.0
    load_time: float = 0.0
    within: float = 0.02


@dataclass(frozen=True, slots=True)
class StartUp:
    """A computed start-up.

    Attributes
    ----------
    reached : bool
        Whether the shaft came to its settled speed; otherwise results are of all that was computed.
    regime : str
        Regime of the motion after the ramps, by name; "" where the load swings with the angle of the shaft, or the case
        did not end ok.
    infos : tuple of ResultInfo
    results : dict
        By name; NaN for what does not exist. Empty where the case did not end ok.
    motion : Trajectory
        From the start until some time after the speed is settled.
    ending : Ending
    """

    reached: bool
    regime: str
    infos: tuple[ResultInfo, ...]
    results: dict[str, float]
    motion: Trajectory
    ending: Ending


_SHAFT = (
    ResultInfo("time", "s", "time from the start until the mean speed of the shaft stays at the settled one"),
    ResultInfo("duration", "s", "time from the start that the further results are about"),
    ResultInfo("speed.settled", "rad/s", "settled mean speed of the shaft"),
    ResultInfo("speed.max", "rad/s", "largest speed of the shaft on the way"),
    ResultInfo("turn", "rad", "turn of the shaft on the way"),
    ResultInfo("energy.input", "J", "energy that the exciter gives to the pendulums on the way"),
    ResultInfo("energy.useful", "J", "energy that goes to the load on the way"),
    ResultInfo("energy.loss", "J", "energy that damping takes on the way"),
    ResultInfo("energy.stored", "J", "gain of kinetic and potential energy on the way"),
    ResultInfo("energy.reset", "J", "energy lost in literal resets of clutches on the way"),
    ResultInfo("balance.energy", "1", "residual of the energy balance / largest of its terms"),
    ResultInfo("torque.max", "N*m", "largest torque of all clutches together on the way"),
    ResultInfo("torque.settled", "N*m", "largest torque of all clutches together in the settled motion"),
    ResultInfo("engagements", "1", "engagements of all clutches on the way"),
)


def start_up_infos(pendulums: int) -> tuple[ResultInfo, ...]:
    """The results of the start-up of a drive with that many pendulums."""
    infos = list(_SHAFT)
    for i in range(pendulums):
        own = f"pendulums.{i}"
        infos += [
            ResultInfo(f"{own}.torque.max", "N*m", "largest torque of the clutch on the way"),
            ResultInfo(f"{own}.windup.max", "rad", "largest windup of the clutch on the way"),
            ResultInfo(f"{own}.engagements", "1", "engagements of the clutch on the way"),
            ResultInfo(f"{own}.angle.max", "rad", "largest magnitude of the angle of the pendulum on the way"),
            ResultInfo(f"{own}.spring.torque.max", "N*m", "largest magnitude of the spring's torque on the way"),
        ]
    return tuple(infos)
