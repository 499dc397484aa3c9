"""The characteristic of a motor as measured: a table of its torque over its speed."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from sprag.engine.machine_shaft.problems import TableError
from sprag.engine.machine_shaft.tables import Curve, Table, over_speed

Floats = NDArray[np.float64]

#: Speeds at which the falling branch is sampled for the first guess of a steady speed.
_SAMPLES = 513


class MotorTable:
    """Torque over speed, joined as any table; beyond its ends it goes on straight.

    Attributes
    ----------
    free : float
        Speed without load in rad/s: the last at which the torque passes zero.
    """

    def __init__(self, curve: Curve) -> None:
        self._curve = curve
        x = curve.knots
        self._ends = np.array([x[0], x[-1]])
        values = curve(x)
        slopes = np.diff(values) / np.diff(x)
        self._outside = np.array([slopes[0], slopes[-1]])
        peak = int(len(values) - 1 - np.argmax(values[::-1]))
        self._speeds = np.linspace(x[peak], x[-1], _SAMPLES)[::-1]
        self._torques = np.maximum.accumulate(curve(self._speeds))
        self.free = float(np.interp(0.0, self._torques, self._speeds))

    def at(self, omega: Floats) -> tuple[Floats, Floats]:
        """Torque in N*m at speeds in rad/s, and its derivative by the speed."""
        low, high = self._ends
        inside = np.clip(omega, low, high)
        outside = np.where(omega < low, self._outside[0], self._outside[1])
        beyond = omega != inside
        return self._curve(inside) + outside * (omega - inside), np.where(beyond, outside, self._curve.slope(inside))

    def speed_for(self, torque: Floats) -> Floats:
        """Speed on the falling branch, in rad/s, for a torque; that of the largest torque where it cannot give it."""
        return np.asarray(np.interp(torque, self._torques, self._speeds))


@cache
def motor_table(table: Table) -> MotorTable:
    """The characteristic of a table of speed (rad/s) and torque (N*m).

    Raises
    ------
    TableError
        If the speeds do not ascend from 0 or more, or the last row is not the end of a falling branch at which the
        motor has no torque or brakes.
    """
    curve = over_speed(table)
    x, y = np.array(table.rows, dtype=np.float64).T
    if x[0] < 0.0:
        raise TableError(f"The characteristic of a motor begins at the speed 0 or above, not at {x[0]:g} rad/s.")
    if not (y[-1] <= 0.0 < y[-2]) and not (y[-1] < y[-2] <= 0.0):
        raise TableError(
            f"The characteristic of a motor ends beyond its speed without load, with a falling torque that is not "
            f"positive: this one ends with {y[-2]:g} and {y[-1]:g} N*m."
        )
    if y.max() <= 0.0:
        raise TableError("The characteristic of a motor has a positive torque at some speed.")
    return MotorTable(curve)
