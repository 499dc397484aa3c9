"""The drive train between motor and main shaft, reduced to the main shaft.

A body of inertia J that turns at i times the speed of the main shaft counts as J i^2, a mass m that moves at v per
rad/s of it as m v^2: the kinetic energy is the same (K. J. Waldron, G. L. Kinzel, *Kinematics, Dynamics, and Design of
Machinery*). A torque passes a stage of the ratio u and the efficiency eta as u eta M from the motor, and as u M/eta
where the load drives the motor. A coupling is a stage of the ratio 1 and without losses here; how it twists is the
matter of ``torsion``.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.machine_shaft.flywheel import Flywheel
from sprag_study.engine.machine_shaft.panels import Panels
from sprag_study.engine.machine_shaft.spec import MOVING, Drive

Floats = NDArray[np.float64]

#: Numbers of motors that are torques and speeds.
_TORQUES, _SPEEDS = ("stall_torque", "breakdown_torque", "scale"), ("no_load_speed", "synchronous_speed", "unit_speed")


@dataclass(frozen=True, slots=True)
class Chain:
    """The bodies between which the couplings of a train lie, reduced to the main shaft, from the motor's on.

    All arrays have the shape (cases or 1, 1, 1).

    Attributes
    ----------
    inertias : tuple of arrays
        Of the drive in each body, in kg*m^2; the last one has the main shaft, without the mechanism.
    stiffness, damping : tuples of arrays
        Of each coupling: N*m/rad, reduced to the main shaft, and relative damping.
    ratios, efficiencies : tuples of arrays
        Speed of the shaft of each coupling over that of the main shaft, and efficiency of the stages behind it.
    """

    inertias: tuple[Floats, ...]
    stiffness: tuple[Floats, ...]
    damping: tuple[Floats, ...]
    ratios: tuple[Floats, ...]
    efficiencies: tuple[Floats, ...]

    @classmethod
    def of(
        cls, drive: Drive, values: Mapping[str, Floats], ratios: Sequence[Floats],
        parts: Sequence[tuple[int, Floats]],
    ) -> "Chain | None":  # fmt: skip
        """The chain of a ``drive``, None without couplings; ``parts`` are shafts with reduced inertias on them."""
        couplings = [index for index, kind in enumerate(drive.stages) if kind == "coupling"]
        if not couplings:
            return None
        inertias = [np.zeros((1, 1, 1)) for _ in range(len(couplings) + 1)]
        for shaft, inertia in parts:
            body = sum(index < shaft for index in couplings)
            inertias[body] = inertias[body] + inertia
        behind = [np.ones((1, 1, 1))]
        for index in reversed(range(len(drive.stages))):
            behind.append(behind[-1] * values.get(f"drive.stages.{index}.efficiency", 1.0))
        return cls(
            tuple(inertias),
            tuple(values[f"drive.stages.{index}.stiffness"] * np.square(ratios[index]) for index in couplings),
            tuple(values[f"drive.stages.{index}.relative_damping"] for index in couplings),
            tuple(ratios[index] for index in couplings),
            tuple(behind[len(drive.stages) - 1 - index] for index in couplings),
        )


@dataclass(frozen=True, slots=True)
class Train:
    """A drive train with the numbers of a block of cases; all arrays have the shape (cases or 1, 1, 1).

    Attributes
    ----------
    inertia : array
        I' in kg*m^2: all that turns in proportion to the main shaft, reduced to it.
    ratio, efficiency : arrays
        Speed of the motor's shaft over that of the main shaft; power at the main shaft over that at the motor.
    direct : bool
        Whether there are no stages: the motor's shaft is the main shaft.
    flywheel : Flywheel or None
        The one that is given by its dimensions; its inertia is part of I'.
    chain : Chain or None
        What the couplings join; None without couplings.
    """

    inertia: Floats
    ratio: Floats
    efficiency: Floats
    direct: bool
    flywheel: Flywheel | None = None
    chain: Chain | None = None

    @classmethod
    def of(cls, drive: Drive, values: Mapping[str, Floats]) -> "Train":
        """The train of ``drive`` with the ``values`` by path."""
        efficiency, ratios, last = np.ones((1, 1, 1)), _ratios(drive, values), len(drive.stages)
        # What turns with each shaft, reduced to the main shaft.
        parts, flywheel = [(last, values["drive.inertia"])], None
        if drive.flywheel:
            shaft = last if drive.flywheel_shaft is None else drive.flywheel_shaft
            flywheel = Flywheel.of(drive.flywheel, values, ratios[shaft])
            parts.append((shaft, flywheel.reduced_inertia))
        for index in reversed(range(last)):
            kind, prefix = drive.stages[index], f"drive.stages.{index}."
            own = {path.removeprefix(prefix): value for path, value in values.items() if path.startswith(prefix)}
            if kind not in MOVING:
                parts.append((index + 1, own["output_inertia"] * np.square(ratios[index + 1])))
                efficiency = efficiency * own.get("efficiency", 1.0)
            way = own["lead"] / (2.0 * math.pi) if kind == "screw_nut" else own.get("radius", 0.0)
            moved = own["inertia"] + own.get("mass", 0.0) * np.square(way)
            parts.append((index, moved * np.square(ratios[index])))
        if "drive.motor.inertia" in values:
            parts.append((0, values["drive.motor.inertia"] * np.square(ratios[0])))
        inertia = reduce(np.add, (own for _, own in parts))
        return cls(inertia, ratios[0], efficiency, not drive.stages, flywheel, Chain.of(drive, values, ratios, parts))

    def motor(self, values: Mapping[str, Floats]) -> dict[str, Floats]:
        """Numbers of a motor as it acts on the main shaft, with the efficiency of the train."""
        if self.direct:
            return dict(values)
        if "scale" in values:
            values = {**values, "unit_speed": np.ones((1, 1, 1))}
        factors = {**dict.fromkeys(_TORQUES, self.ratio), **dict.fromkeys(_SPEEDS, 1.0 / self.ratio)}
        return {name: value * factors.get(name, 1.0) for name, value in values.items()} | {
            "efficiency": self.efficiency
        }

    def results(self, panels: Panels, drive: Floats, known: Mapping[str, Floats]) -> dict[str, Floats]:
        """Results by name, each (cases,), from those ``known`` and the driving torque at the nodes."""
        cases = len(drive)
        inertia, ratio = (np.broadcast_to(value[:, 0, 0], (cases,)) for value in (self.inertia, self.ratio))
        most = known["drive_torque.max"]
        mean = known["drive_torque.mean"]
        if not self.direct:
            most = self.at_motor(most[:, None, None])[:, 0, 0]
            mean = panels.integral(self.at_motor(drive)) / panels.cuts[0, -1]
        speed = ratio * known["omega.mean"]
        return {
            "inertia.drive": inertia, "inertia.mechanism.mean": known["inertia.mean"] - inertia,
            "motor.speed.mean": speed, "motor.torque.mean": mean, "motor.torque.max": most,
            "motor.power.mean": mean * speed,
        }  # fmt: skip

    def heating(self, panels: Panels, drive: Floats, omega: Floats, rated: Floats) -> dict[str, Floats]:
        """By what the motor warms, each (cases,): root mean squares over time, and the thermal margin.

        The copper losses follow the square of the current, and that follows the torque: the constant torque that warms
        the motor as much is the square root of the mean of M^2 over time, with dt = dphi/omega (G. K. Dubey,
        *Fundamentals of Electrical Drives*, chapter 4; docs/theory-machine-shaft.md, "Rating of the motor").

        Parameters
        ----------
        panels : Panels
        drive, omega : arrays, shape (cases, panels, nodes)
            Driving torque in N*m and speed in rad/s of the main shaft.
        rated : array, shape (cases,)
            Rated torque of the motor in N*m; infinite where it is not known.
        """
        squares, time = np.square(self.at_motor(drive)), panels.integral(1.0 / omega)
        torque = np.sqrt(panels.integral(squares / omega) / time)
        power = np.broadcast_to(self.ratio[:, 0, 0], torque.shape) * np.sqrt(panels.integral(squares * omega) / time)
        return {"motor.torque.rms": torque, "motor.power.rms": power, "motor.torque.margin": rated / torque}

    def at_shaft(self, torque: Floats) -> Floats:
        """Torque on the main shaft of a ``torque`` of the motor."""
        if self.direct:
            return torque
        return np.asarray(self.ratio * torque * np.where(torque >= 0.0, self.efficiency, 1.0 / self.efficiency))

    def at_motor(self, torque: Floats) -> Floats:
        """Torque of the motor for a ``torque`` on the main shaft."""
        if self.direct:
            return torque
        return np.asarray(torque * np.where(torque >= 0.0, 1.0 / self.efficiency, self.efficiency) / self.ratio)


def _ratios(drive: Drive, values: Mapping[str, Floats]) -> list[Floats]:
    """Speed of each shaft over that of the main shaft, from the motor's to the main shaft, (cases or 1, 1, 1) each."""
    ratios = [np.ones((1, 1, 1))]
    for index in reversed(range(len(drive.stages))):
        ratios.append(ratios[-1] * values.get(f"drive.stages.{index}.ratio", 1.0))
    return ratios[::-1]
