"""The motion over a cycle, its decomposition into four signed squares of the speed, and the results from it.

With T the kinetic energy, A_d and A_r the works of drive and resistance since an angle phi_c at which T is its mean,

    omega^2 = 2 T/I = S1 + S2 + S3 + S4,
    S1 = 2 T_min/I,   S2 = 2 (T_mean - T_min)/I,   S3 = 2 A_d/I,   S4 = 2 A_r/I    (docs/theory-machine-shaft.md)
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.machine_shaft.fluctuation import energy_coefficient, harmonics, shares
from sprag_study.engine.machine_shaft.machine import Fields
from sprag_study.engine.machine_shaft.panels import Crossings, Extremes, Panels, Points
from sprag_study.engine.machine_shaft.start import Shape

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Work:
    """Running works since the angle 0 of one torque: at the nodes, and at the cuts (cases, panels + 1)."""

    torque: Floats
    nodes: Floats
    ends: Floats

    @classmethod
    def of(cls, panels: Panels, torque: Floats) -> "Work":
        """The work of ``torque`` at the nodes."""
        return cls(torque, *panels.running(torque))

    def largest(self, panels: Panels) -> Floats:
        """Largest size of the work, (cases,)."""
        return np.asarray(np.maximum(panels.largest(self.nodes), np.abs(self.ends).max(axis=1)))


class Decomposition:
    """The steady motion of a block of cases.

    Attributes
    ----------
    start : array, shape (cases,)
        Energy T_0 at the angle 0; NaN for a case without motion.
    squares : array, shape (cases, panels, nodes)
        omega^2 at the nodes.
    mean_energy, least_energy, largest_energy : arrays, shape (cases,)
    most_work : array, shape (cases,)
        Largest work, in J, that drive or resistance has done at any angle since 0.
    crossings : Crossings
        All angles at which T = T_mean.
    phi_c : Points
        The one from which works are counted, NaN where there is none.
    """

    def __init__(
        self, panels: Panels, cycle: float, fields: Fields, drive: Floats, resistance: Floats, start: Floats
    ) -> None:
        self.panels, self.cycle, self.fields, self.start = panels, cycle, fields, start
        self.drive, self.resistance = Work.of(panels, drive), Work.of(panels, resistance)
        self.total = Work.of(panels, drive + resistance)
        self.shape = Shape(panels, cycle, fields.inertia, self.total.nodes)
        self.squares = self.shape.squares(start)
        self.mean_work = panels.integral(self.total.nodes) / cycle
        self.work_extremes = panels.extremes(self.total.nodes)
        self.mean_energy = start + self.mean_work
        self.least_energy = start + self.work_extremes.lowest
        self.largest_energy = start + self.work_extremes.highest
        # Works that cancel at every angle leave rounding errors, whose angles are meaningless.
        self.most_work = np.maximum(self.drive.largest(panels), self.resistance.largest(panels))
        even = self.work_extremes.highest - self.work_extremes.lowest <= 1e-12 * self.most_work
        level = np.where(even, np.inf, self.mean_work)
        self.crossings = panels.crossings(self.total.torque, self.total.nodes, self.total.ends, level)

    @cached_property
    def square_extremes(self) -> Extremes:
        """Those of omega^2."""
        return self.panels.extremes(self.squares)

    def reference(self, chosen: int | None) -> tuple[Points, Floats]:
        """phi_c of every case and the number of candidates; by default the first at which T rises.

        Where T is always at its mean, phi_c is 0. Where the chosen angle does not exist, it is NaN.
        """
        cases = len(self.start)
        panel, t = np.zeros(cases, dtype=np.int64), np.full(cases, -1.0)
        angle, count = np.full(cases, np.nan), np.zeros(cases)
        c: Crossings = self.crossings
        order = np.lexsort((np.mod(c.angle, self.cycle), c.case))
        count[:] = np.bincount(c.case, minlength=cases)
        angle[count == 0] = 0.0
        wanted = order[c.upward[order]] if chosen is None else order
        first = np.searchsorted(c.case[wanted], np.arange(cases)) + (0 if chosen is None else chosen)
        rows = np.nonzero(first < np.searchsorted(c.case[wanted], np.arange(cases), side="right"))[0]
        k = wanted[first[rows]]
        panel[rows], t[rows], angle[rows] = c.panel[k], c.t[k], c.angle[k]
        return Points(panel, t, angle), count

    def works_since(self, points: Points) -> tuple[Floats, Floats]:
        """Works of drive and resistance at the nodes since ``points``, NaN where there is none."""
        lost = np.isnan(points.angle)
        parts = []
        for work in (self.drive, self.resistance):
            before = self.panels.running_at(work.torque, work.ends, points)
            parts.append(work.nodes - np.where(lost, np.nan, before)[:, None, None])
        return parts[0], parts[1]

    def acceleration(self) -> Floats:
        """Angular acceleration (M - omega^2 I'/2)/I at the nodes, in rad/s^2."""
        return np.asarray((self.total.torque - 0.5 * self.squares * self.fields.slope) / self.fields.inertia)


def characteristics(d: Decomposition, phi_c: int | None) -> dict[str, Floats]:
    """Results that follow from the motion alone, by name, each (cases,)."""
    panels, out = d.panels, {}
    with np.errstate(invalid="ignore", divide="ignore"):
        speed = d.square_extremes
        out["omega.max"], out["omega.min"] = np.sqrt(speed.highest), np.sqrt(np.maximum(speed.lowest, 0.0))
        out["omega.angle_at_max"] = wrapped(speed.at_highest.angle, d.cycle)
        out["omega.angle_at_min"] = wrapped(speed.at_lowest.angle, d.cycle)
        omega = np.sqrt(d.squares)
        out["omega.midrange"] = 0.5 * (out["omega.max"] + out["omega.min"])
        out["omega.mean_angle"] = panels.integral(omega) / d.cycle
        out["omega.mean_time"] = d.cycle / panels.integral(1.0 / omega)
        out["omega.start"] = np.sqrt(2.0 * d.start / panels.at(d.fields.inertia, panels.starts(len(d.start))))
        for kind, mean in (("midrange", "midrange"), ("angle", "mean_angle"), ("time", "mean_time")):
            out[f"irregularity.{kind}"] = (out["omega.max"] - out["omega.min"]) / out[f"omega.{mean}"]
        acceleration = panels.extremes(d.acceleration())
        out["acceleration.max"], out["acceleration.min"] = acceleration.highest, acceleration.lowest
        drive = panels.extremes(d.drive.torque)
        out["drive_torque.max"], out["drive_torque.min"] = drive.highest, drive.lowest
        out["drive_torque.mean"] = d.drive.ends[:, -1] / d.cycle
        out["energy.mean"], out["energy.min"], out["energy.max"] = d.mean_energy, d.least_energy, d.largest_energy
        out["energy.fluctuation"] = d.work_extremes.highest - d.work_extremes.lowest
        out["energy.angle_at_max"] = wrapped(d.work_extremes.at_highest.angle, d.cycle)
        out["energy.angle_at_min"] = wrapped(d.work_extremes.at_lowest.angle, d.cycle)
        _squares(d, phi_c, out)
        out |= shares(out)
        out["energy.coefficient"] = energy_coefficient(out["energy.fluctuation"], d.drive.ends[:, -1], d.most_work)
        out |= harmonics(panels, d.cycle, {"omega": omega, "torque": d.total.torque})
    return out


def wrapped(angle: Floats, cycle: float) -> Floats:
    """Angle in 0 .. cycle, the end of the cycle being 0."""
    turned = np.mod(angle, cycle)
    return np.where(cycle - turned <= 1e-9 * cycle, 0.0, turned)


def _squares(d: Decomposition, phi_c: int | None, out: dict[str, Floats]) -> None:
    points, out["phi_c.count"] = d.reference(phi_c)
    out["phi_c"] = wrapped(points.angle, d.cycle)
    inverse = 1.0 / d.fields.inertia
    extremes: Extremes = d.panels.extremes(inverse)
    out["inertia.max"], out["inertia.min"] = 1.0 / extremes.lowest, 1.0 / extremes.highest
    out["inertia.mean"] = d.panels.integral(d.fields.inertia) / d.cycle
    for name, energy in (("s1", d.least_energy), ("s2", d.mean_energy - d.least_energy)):
        out[f"{name}.max"], out[f"{name}.min"] = 2.0 * energy * extremes.highest, 2.0 * energy * extremes.lowest
    for name, part, work in zip(("s3", "s4"), ("drive", "resistance"), d.works_since(points), strict=True):
        for known, values in ((name, 2.0 * work * inverse), (f"work.{part}", work)):
            found = d.panels.extremes(values)
            out[f"{known}.max"], out[f"{known}.min"] = found.highest, found.lowest
    for name in ("s1", "s2", "s3", "s4"):
        out[f"{name}.amplitude"] = 0.5 * (out[f"{name}.max"] - out[f"{name}.min"])
