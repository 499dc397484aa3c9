"""The characteristic of a motor as measured: a table of its torque over its speed."""

import math
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.machine_shaft.problems import TableError, amount
from sprag_study.engine.machine_shaft.tables import Curve, Table, over_speed
from sprag_study.sentences import Sentence

Floats = NDArray[np.float64]

#: Speeds at which the falling branch is sampled for the first guess of a steady speed.
_SAMPLES = 513
#: Size of a torque, as a share of the largest, up to which it is rounding error.
_ROUNDING = 1e-11
#: From four values within a piece to the coefficients of its cubic.
_ROWS = [[105, -105, 63, -15], [-568, 1128, -744, 184], [960, -2496, 2112, -576], [-512, 1536, -1536, 512]]
_TO_POWERS = np.array(_ROWS, dtype=np.float64) / 48.0


class MotorTable:
    """Torque over speed, joined as any table; beyond its ends it goes on straight.

    Attributes
    ----------
    kinks : array, shape (n,)
        Speeds in rad/s of the rows at which its slope or one of the next two derivatives jumps.
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
        self.kinks = x[self._jumps() > _ROUNDING * np.abs(values).max()]

    def at(self, omega: Floats) -> tuple[Floats, Floats]:
        """Torque in N*m at speeds in rad/s, and its derivative by the speed."""
        low, high = self._ends
        inside = np.clip(omega, low, high)
        outside = np.where(omega < low, self._outside[0], self._outside[1])
        beyond = omega != inside
        return self._curve(inside) + outside * (omega - inside), np.where(beyond, outside, self._curve.slope(inside))

    def pieces(self) -> Floats:
        """Its cubic pieces, shape (m, 6): the end of each, the speed that it counts from, four coefficients."""
        x, u = self._curve.knots, np.array([0.125, 0.375, 0.625, 0.875])
        rows = [[x[0], x[0], float(self._curve(x[:1])[0]), self._outside[0], 0.0, 0.0]]
        for low, high in pairwise(x.tolist()):
            powers = [math.fsum(row * self._curve(low + (high - low) * u)) for row in _TO_POWERS]
            width = high - low
            widths = (1.0, width, width * width, width * width * width)
            rows.append([high, low, *(power / own for power, own in zip(powers, widths, strict=True))])
        rows.append([np.inf, x[-1], float(self._curve(x[-1:])[0]), self._outside[1], 0.0, 0.0])
        return np.array(rows)

    def _jumps(self) -> Floats:
        """By how much the pieces before and after each row disagree within their lengths, in N*m, shape (n,)."""
        pieces, widths = self.pieces(), np.diff(self._curve.knots)
        c1, c2, c3 = pieces[:-1, 3:].T
        u = np.append(0.0, widths)
        slope = np.abs(c1 + u * (2.0 * c2 + 3.0 * u * c3) - pieces[1:, 3])
        curvature, third = np.abs(c2 + 3.0 * u * c3 - pieces[1:, 4]), np.abs(c3 - pieces[1:, 5])
        # The straight ends count with the length of the piece beside them.
        length = np.maximum(np.append(widths[:1], widths), np.append(widths, widths[-1:]))
        return np.asarray(length * (slope + length * (curvature + length * third)))

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
        speed = amount(x[0], "rad/s")
        message = Sentence("The characteristic of a motor begins at the speed 0 or above, not at {speed}.", speed=speed)
        raise TableError(message, speed, Sentence("{low} or more in row 1", low=amount(0.0, "rad/s")))
    if not (y[-1] <= 0.0 < y[-2]) and not (y[-1] < y[-2] <= 0.0):
        last = amount(y[-1], "N*m")
        raise TableError(
            Sentence(
                "The characteristic of a motor ends beyond its speed without load, with a falling torque that is not "
                "positive: this one ends with {before} and {last}.",
                before=amount(y[-2]),
                last=last,
            ),
            last,
            Sentence(
                "at most {most} and less than {before} in the last row",
                most=amount(0.0, "N*m"),
                before=amount(y[-2], "N*m"),
            ),
        )
    if y.max() <= 0.0:
        message = Sentence("The characteristic of a motor has a positive torque at some speed.")
        most, low = amount(y.max(), "N*m"), amount(0.0, "N*m")
        raise TableError(message, Sentence("{most} at most", most=most), Sentence("a torque > {low}", low=low))
    return MotorTable(curve)
