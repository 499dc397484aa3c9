"""Balance of the work over a cycle, which steady motion requires to be zero."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sprag.engine.machine_shaft.panels import Panels
from sprag.engine.machine_shaft.spec import Balance

Floats = NDArray[np.float64]

#: Residual work, relative to the largest work within the cycle, that still counts as zero.
TOLERANCE = 1e-3


@dataclass(frozen=True, slots=True)
class Balanced:
    """A driving torque after balancing.

    Attributes
    ----------
    drive : array, shape (cases, panels, nodes)
        M_d in N*m.
    wrong : array of bool, shape (cases,)
        Where the works cannot be balanced in the requested way.
    drive_work, resistance_work : arrays, shape (cases,)
        Works over a cycle in J of the torques as given.
    """

    drive: Floats
    wrong: NDArray[np.bool_]
    drive_work: Floats
    resistance_work: Floats


def largest_work(panels: Panels, *torques: Floats) -> Floats:
    """Largest work, in J, that any of the torques has done at any angle since 0; shape (cases,)."""
    most = np.zeros(len(torques[0]))
    for torque in torques:
        running, ends = panels.running(torque)
        most = np.maximum(most, np.maximum(panels.largest(running), np.abs(ends).max(axis=1)))
    return most


def balanced(balance: Balance, panels: Panels, cycle: float, drive: Floats, resistance: Floats) -> Balanced:
    """Balance the works over a cycle by scaling the drive, making it constant, or not at all.

    "constant" replaces the given torque by M_d = -(1/cycle) * integral of M_r. "scale" multiplies M_d by the factor
    that makes the works opposite, which is impossible where they have the same sign or the drive does no work. "refuse"
    accepts the torques unchanged if the residual work is at most TOLERANCE of the largest work within the cycle.
    """
    drive_work, resistance_work = panels.integral(drive), panels.integral(resistance)
    none = np.zeros(len(drive), dtype=np.bool_)
    if balance == "constant":
        mean = -resistance_work / cycle
        return Balanced(mean[:, None, None] + 0.0 * drive, none, drive_work, resistance_work)
    if balance == "motor":
        return Balanced(drive, none, drive_work, resistance_work)
    largest = largest_work(panels, drive, resistance)
    within = np.abs(drive_work + resistance_work) <= TOLERANCE * largest
    if balance == "refuse":
        return Balanced(drive, ~within, drive_work, resistance_work)
    opposite = (drive_work * resistance_work < 0.0) & (np.abs(drive_work) > 1e-9 * largest)
    factor = np.where(opposite, -resistance_work / np.where(opposite, drive_work, 1.0), 1.0)
    return Balanced(factor[:, None, None] * drive, ~(opposite | within), drive_work, resistance_work)
