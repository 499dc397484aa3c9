"""Balance of the work over a cycle, which steady motion requires to be zero."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.machine_shaft.panels import Panels
from sprag_study.engine.machine_shaft.spec import Balance, BalanceSide

Floats = NDArray[np.float64]

#: Residual work, relative to the largest work within the cycle, that still counts as zero.
TOLERANCE = 1e-3


@dataclass(frozen=True, slots=True)
class Balanced:
    """Torques after balancing.

    Attributes
    ----------
    drive, resistance : arrays, shape (cases, panels, nodes)
        M_d and M_r in N*m.
    factor : array, shape (cases,)
        On the drive or the operation; NaN where it was made constant.
    wrong : array of bool, shape (cases,)
        Where the works cannot be balanced in the requested way.
    drive_work, resistance_work : arrays, shape (cases,)
        Works over a cycle in J of the torques as given.
    """

    drive: Floats
    resistance: Floats
    factor: Floats
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


def balanced(
    balance: Balance,
    side: BalanceSide,
    panels: Panels,
    cycle: float,
    drive: Floats,
    resistance: Floats,
    operation: Floats,
) -> Balanced:
    """Balance the works over a cycle on one side: by scaling that torque, making it constant, or not at all.

    "constant" replaces the torque of the side (``drive``, or ``operation``, which is a part of ``resistance``) by the
    constant that makes the works opposite. "scale" multiplies it by the factor that does, which is impossible where
    the torque does no work or the factor is not positive. "refuse" accepts the torques unchanged if the residual work
    is at most TOLERANCE of the largest work within the cycle.
    """
    works = panels.integral(drive), panels.integral(resistance)
    none, one = np.zeros(len(drive), dtype=np.bool_), np.ones(len(drive))
    own = drive if side == "drive" else operation
    if balance == "motor":
        return Balanced(drive, resistance, one, none, *works)
    if balance == "constant":
        rest = resistance if side == "drive" else drive + (resistance - operation)
        mean = (-(works[1] if side == "drive" else panels.integral(rest)) / cycle)[:, None, None] + 0.0 * own
        lost = np.full(len(drive), np.nan)
        if side == "drive":
            return Balanced(mean, resistance, lost, none, *works)
        return Balanced(drive, mean + (resistance - operation), lost, none, *works)
    largest = largest_work(panels, drive, resistance)
    within = np.abs(works[0] + works[1]) <= TOLERANCE * largest
    if balance == "refuse":
        return Balanced(drive, resistance, one, ~within, *works)
    own_work = works[0] if side == "drive" else panels.integral(operation)
    rest_work = works[1] if side == "drive" else works[0] + panels.integral(resistance - operation)
    least = np.minimum(np.abs(own_work), np.abs(rest_work))
    opposite = (own_work * rest_work < 0.0) & (least > 1e-9 * largest)
    factor = np.where(opposite, -rest_work / np.where(opposite, own_work, 1.0), 1.0)
    wrong = ~(opposite | within)
    if side == "drive":
        return Balanced(factor[:, None, None] * drive, resistance, factor, wrong, *works)
    found = (resistance - operation) + factor[:, None, None] * operation
    return Balanced(drive, found, factor, wrong, *works)
