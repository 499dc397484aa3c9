"""What is asked of a transient and what it gives."""

from dataclasses import dataclass
from typing import Literal, get_args

from sprag_study.engine.outcome import Trajectory
from sprag_study.sentences import Sentence

Kind = Literal["run-up", "load-step", "coasting"]
#: How a transient can end; "no_motion" where there is none to begin with.
Outcome = Literal["reached", "stopped", "not_started", "not_reached", "too_stiff", "no_motion"]
#: The kinds in their order.
KINDS: tuple[Kind, ...] = get_args(Kind)
#: Name and unit of each column over time.
COLUMNS: tuple[tuple[str, str], ...] = (
    ("angle", "rad"), ("omega", "rad/s"), ("acceleration", "rad/s^2"), ("energy", "J"), ("inertia", "kg*m^2"),
    ("drive_torque", "N*m"), ("resisting_torque", "N*m"), ("power", "W"),
)  # fmt: skip
#: Name, unit and meaning of each result.
RESULTS: tuple[tuple[str, str, str], ...] = (
    ("time", "s", "time of the run-up, to the new steady cycle, or to standstill; empty where that is not reached"),
    ("duration", "s", "computed time"),
    ("turns", "1", "revolutions in the computed time"),
    ("omega.start", "rad/s", "speed at the start"),
    ("omega.end", "rad/s", "speed at the end"),
    ("omega.max", "rad/s", "largest speed"),
    ("omega.min", "rad/s", "smallest speed"),
    ("drive_torque.max", "N*m", "largest torque of the drive at the main shaft"),
    ("motor.torque.max", "N*m", "largest torque at the motor's shaft"),
    ("power.max", "W", "largest power of the drive"),
    ("work.drive", "J", "work of the drive"),
    ("work.resistance", "J", "work of operation, weights, springs and friction, negative where they resist"),
    ("work.slip", "J", "energy lost to the slip of an asynchronous motor, in its rotor"),
    ("energy.change", "J", "change of the kinetic energy"),
    ("balance.energy", "1", "energy that is missing from the balance, over the largest of works and energies"),
    ("before.omega.mean", "rad/s", "mean speed of the steady cycle before"),
    ("after.omega.mean", "rad/s", "mean speed of the steady cycle to which the shaft comes"),
    ("after.irregularity", "1", "irregularity of that cycle"),
)


@dataclass(frozen=True, slots=True)
class Course:
    """The transient that is asked for.

    Attributes
    ----------
    kind : {"run-up", "load-step", "coasting"}
    load : float
        Factor on the torque of all operations during the transient.
    angle : float
        Angle of the shaft (rad) at which it begins.
    torque : float, optional
        Constant torque (N*m) that runs up a machine without a motor, at the first shaft of its drive train.
    within : float
        Share of the first deviation of the speed from that of the steady cycle at the same angle, at which the cycle
        counts as reached.
    revolutions : float
        Most revolutions that are computed.
    """

    kind: Kind
    load: float = 1.0
    angle: float = 0.0
    torque: float | None = None
    within: float = 0.01
    revolutions: float = 1000.0


@dataclass(frozen=True, slots=True)
class Transient:
    """A computed transient.

    Attributes
    ----------
    outcome : str
        One of ``Outcome``.
    cause : Sentence
        About the end and its cause.
    results : dict
        By name, of ``RESULTS``; NaN for missing ones.
    motion : Trajectory
        Over time; its ending is that of the steady cycle of the case.
    """

    outcome: Outcome
    cause: Sentence
    results: dict[str, float]
    motion: Trajectory
