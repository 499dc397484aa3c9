"""Means of the speed, the energy at the start that gives the required mean, and the least feasible mean."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine import elementary
from sprag_study.engine.machine_shaft.panels import Extremes, Panels, Points
from sprag_study.engine.machine_shaft.spec import MeanSpeed
from sprag_study.engine.quadrature import gauss

Floats = NDArray[np.float64]

_U, _U_WEIGHTS = gauss(24)
_ITERATIONS = 60


@dataclass(frozen=True, slots=True)
class Shape:
    """The data that, with the energy at the start, determine a mean of the speed.

    Attributes
    ----------
    panels : Panels
    cycle : float
        In rad.
    inertia : array, shape (cases, panels, NODES)
    work : array of that shape
        Work of all torques since the angle 0, in J.
    """

    panels: Panels
    cycle: float
    inertia: Floats
    work: Floats

    def squares(self, start: Floats) -> Floats:
        """omega^2 at the nodes for the energies ``start`` (cases,) at the angle 0; never negative."""
        return np.asarray(np.maximum(2.0 * (start[:, None, None] + self.work) / self.inertia, 0.0))

    def take(self, rows: NDArray[np.int64]) -> "Shape":
        """The same for some of the cases."""
        return Shape(self.panels.take(rows), self.cycle, self.inertia[rows], self.work[rows])


@dataclass(frozen=True, slots=True)
class Stop:
    """Where the shaft first stops as the energy at the start falls: ``-work`` (cases,) of it is left, at ``points``."""

    work: Floats
    points: Points

    @classmethod
    def of(cls, shape: Shape) -> "Stop":
        """The smallest work over the continuous cycle."""
        extremes = shape.panels.extremes(shape.work)
        # No work is done at the start of the cycle, regardless of the polynomial's rounding error.
        return cls(np.minimum(extremes.lowest, 0.0), extremes.at_lowest)

    def take(self, rows: NDArray[np.int64]) -> "Stop":
        """The same for some of the cases."""
        at = self.points
        return Stop(self.work[rows], Points(at.panel[rows], at.t[rows], at.angle[rows]))


def mean_speed(shape: Shape, kind: MeanSpeed, start: Floats) -> tuple[Floats, Floats]:
    """Mean speed for the energies ``start`` and its derivative by them, both (cases,)."""
    squares = shape.squares(start)
    if kind == "midrange":
        extremes = shape.panels.extremes(squares)
        return _midrange(shape, extremes)
    with np.errstate(divide="ignore", invalid="ignore"):
        omega = np.sqrt(squares)
        if kind == "angle":
            mean = shape.panels.integral(omega) / shape.cycle
            return mean, shape.panels.integral(1.0 / (shape.inertia * omega)) / shape.cycle
        time = shape.panels.integral(1.0 / omega)
        return shape.cycle / time, shape.cycle / np.square(time) * shape.panels.integral(
            1.0 / (shape.inertia * squares * omega)
        )


def _midrange(shape: Shape, extremes: Extremes) -> tuple[Floats, Floats]:
    total, slope = np.zeros(len(shape.work)), np.zeros(len(shape.work))
    for square, points in ((extremes.highest, extremes.at_highest), (extremes.lowest, extremes.at_lowest)):
        omega = np.sqrt(np.maximum(square, 0.0))
        total += 0.5 * omega
        with np.errstate(divide="ignore", invalid="ignore"):
            slope += 0.5 / (shape.panels.at(shape.inertia, points) * omega)
    return total, slope


def start_energy(shape: Shape, stop: Stop, kind: MeanSpeed, wanted: Floats) -> Floats:
    """Energy at the angle 0 in J that gives the mean speed ``wanted`` (cases,), which must be feasible.

    The square of each mean rises with the energy and nearly in proportion: Newton's method on it, kept within a
    bracket, whose lower end is the energy at which the shaft stops.
    """
    largest = shape.panels.largest(shape.inertia)
    low, high = -stop.work, 0.5 * largest * np.square(wanted) * (1.0 + 1e-6) - stop.work
    start = np.clip(0.5 * largest * np.square(wanted) - shape.panels.integral(shape.work) / shape.cycle, low, high)
    found = start.copy()
    active = np.arange(len(wanted))
    for _ in range(_ITERATIONS):
        if not active.size:
            break
        own = shape if len(active) == len(wanted) else shape.take(active)
        mean, slope = mean_speed(own, kind, start[active])
        error = np.square(mean) - np.square(wanted[active])
        low[active] = np.where(error <= 0.0, start[active], low[active])
        high[active] = np.where(error >= 0.0, start[active], high[active])
        with np.errstate(divide="ignore", invalid="ignore"):
            step = start[active] - error / (2.0 * mean * slope)
        # Where the shaft stops, the slope is infinite and the step is useless.
        inside = (step >= low[active]) & (step <= high[active]) & np.isfinite(slope)
        following = np.where(inside, step, 0.5 * (low[active] + high[active]))
        scale = np.abs(start[active]) + np.abs(stop.work[active])
        moved = np.abs(following - start[active])
        start[active] = following
        found[active] = following
        # Newton's next step would be the square of this one, unless the slope is nearly infinite.
        near = (moved <= 1e-9 * scale) & (np.abs(error) <= 1e-6 * np.square(wanted[active]))
        active = active[~near & (error != 0.0)]
    return found


def least_mean_speed(shape: Shape, stop: Stop, kind: MeanSpeed, torque: Floats) -> Floats:
    """Mean speed, shape (cases,), at which the smallest speed is 0; ``torque`` is that of drive and resistance.

    The mean over time is 0 there if no torque acts where the shaft stops, because the shaft then never leaves that
    angle.
    """
    squares = shape.squares(-stop.work)
    if kind == "midrange":
        return np.asarray(0.5 * np.sqrt(np.maximum(shape.panels.extremes(squares).highest, 0.0)))
    power = 0.5 if kind == "angle" else -0.5
    near, far = _near_stop(shape, stop)
    most = shape.panels.largest(torque)
    total = shape.panels.integral(
        np.where(far[..., None], elementary.power(np.where(far[..., None], squares, 1.0), power), 0.0)
    )
    for case, panel in zip(*np.nonzero(near), strict=True):
        total[case] += _singular(shape, stop, torque, most[case], int(case), int(panel), power)
    return np.asarray(total / shape.cycle if kind == "angle" else shape.cycle / total)


def _near_stop(shape: Shape, stop: Stop) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Panels closer to the angle at which the shaft stops than their length, and the other panels of nonzero length."""
    cuts = np.broadcast_to(shape.panels.cuts, (len(shape.work), shape.panels.cuts.shape[1]))
    angle = stop.points.angle[:, None]
    length = np.diff(cuts, axis=1)
    distance = np.full(length.shape, np.inf)
    for turn in (-shape.cycle, 0.0, shape.cycle):
        gap = np.maximum(np.maximum(cuts[:, :-1] - (angle + turn), angle + turn - cuts[:, 1:]), 0.0)
        distance = np.minimum(distance, gap)
    near = (distance < length) & (length > 0.0)
    return near, ~near & (length > 0.0)


def _singular(shape: Shape, stop: Stop, torque: Floats, most: float, case: int, panel: int, power: float) -> float:
    """Integral of (omega^2)^power over one panel near the angle at which the shaft stops.

    With the square root of the distance from that angle as the variable, both a kink (omega^2 rises in proportion)
    and a smooth minimum (in proportion to the square) are smooth.
    """
    row = 0 if len(shape.panels.cuts) == 1 else case
    left, right = shape.panels.cuts[row, panel], shape.panels.cuts[row, panel + 1]
    angle = stop.points.angle[case]
    angle += shape.cycle * np.round((0.5 * (left + right) - angle) / shape.cycle)

    def at(values: Floats, where: Floats) -> Floats:
        t = np.clip(2.0 * (where - left) / (right - left) - 1.0, -1.0, 1.0)
        points = Points(np.full(len(t), panel), t, where)
        return shape.panels.at_rows(values, np.full(len(t), case), points)

    total = 0.0
    for sign, first, last in ((-1.0, angle - right, angle - left), (1.0, left - angle, right - angle)):
        if last <= max(first, 0.0):
            continue
        touches = first <= 1e-12 * shape.cycle
        if power < 0.0 and touches:
            there = abs(float(at(torque, np.array([angle]))[0]))
            if there <= 1e-7 * most:
                return float("inf")
        low, high = np.sqrt(max(first, 0.0)), np.sqrt(last)
        u = 0.5 * (low + high) + 0.5 * (high - low) * _U
        where = angle + sign * np.square(u)
        squares = 2.0 * (at(shape.work, where) - stop.work[case]) / at(shape.inertia, where)
        squares = np.maximum(squares, 1e-16 * np.abs(squares).max())
        with np.errstate(divide="ignore"):
            total += float((elementary.power(squares, power) * u * (high - low) * _U_WEIGHTS).sum())
    return total
