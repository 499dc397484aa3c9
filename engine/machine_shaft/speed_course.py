"""The steady speed of a machine with loads that follow it, for a given drive (docs/theory-machine-shaft.md).

T' = c A + B(phi, omega), omega^2 = 2 T/I, has two unknowns: the energy T_0 at the angle 0, and the factor c on the
torque that is balanced (A is 1 where that is a constant). They follow from a periodic T and the required mean speed.
"""

from dataclasses import dataclass
from dataclasses import fields as fields_of

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine import elementary
from sprag_study.engine.machine_shaft.columns import Columns
from sprag_study.engine.machine_shaft.machine import Fields, Machine
from sprag_study.engine.machine_shaft.operations import SpeedLaw
from sprag_study.engine.machine_shaft.panels import Panels
from sprag_study.engine.machine_shaft.spec import MachineSpec
from sprag_study.engine.machine_shaft.start import Shape, Stop, least_mean_speed, start_energy

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Bools = NDArray[np.bool_]

_MAX_ITERATIONS = 60
#: Largest relative change of the energy in the last step of a solution.
_ACCURACY = 1e-11
#: Panels on which the load changes by more than this share of the energy are halved.
_STIFF = 0.5


def follows_speed(machine: Machine) -> bool:
    """Whether the motion depends on loads that follow the speed: a balance may put a constant in their place."""
    spec = machine.spec
    return machine.follows_speed and not (spec.balance == "constant" and spec.balance_side == "operation")


@dataclass(frozen=True, slots=True)
class SpeedCourse:
    """The speed over the cycle.

    Attributes
    ----------
    omega : array, shape (cases, panels, nodes)
        In rad/s; the machine's ``pace`` where there is none.
    slope : array of that shape
        Derivative of the loads that follow the speed by the kinetic energy, in N*m/J.
    stopped, lost : arrays of bool, shape (cases,)
        Where the shaft would stop; where no solution was found for another reason.
    stiff : array of bool, shape (cases, panels)
        Panels that are too long for the load.
    """

    omega: Floats
    slope: Floats
    stopped: Bools
    lost: Bools
    stiff: Bools


class _Course:
    """One block of cases on their panels: the linear equation of an iteration."""

    def __init__(self, spec: MachineSpec, panels: Panels, cycle: float, fields: Fields) -> None:
        self.spec, self.panels, self.cycle, self.fields = spec, panels, cycle, fields
        self.found = spec.balance_side == "operation" and spec.balance == "scale"
        rest = fields.resistance - fields.operation if self.found else fields.resistance
        self.constant = rest + fields.drive if self.found or spec.balance == "refuse" else rest
        self.one = np.ones(fields.inertia.shape)

    def take(self, rows: Integers) -> "_Course":
        own = Fields(*(getattr(self.fields, field.name)[rows] for field in fields_of(self.fields)))
        return _Course(self.spec, self.panels.take(rows), self.cycle, own)

    def integrated(self, slope: Floats, defect: Floats) -> Floats:
        """e of e' = slope (e + defect), e(0) = 0, panel after panel with an integrating factor; added to ``defect``."""
        panels = self.panels
        power = panels.within(slope)
        growth, growths = elementary.exp(power.nodes), elementary.exp(power.ends)
        own = panels.within(slope * defect / growth)
        before: Floats = np.zeros(power.ends.shape)
        for panel in range(before.shape[1] - 1):
            before[:, panel + 1] = growths[:, panel] * (before[:, panel] + own.ends[:, panel])
        return np.asarray(defect + growth * (before[..., None] + own.nodes))

    def step(
        self, law: tuple[Floats, Floats], energy: Floats, omega: Floats, wanted: Floats
    ) -> tuple[Floats, Bools, Floats]:
        """The next energy, whether it lets the shaft turn, and the slope of the load by the energy.

        Parameters
        ----------
        law : pair of arrays
            Torque of the loads that follow the speed and its derivative by the speed, at the last speed.
        energy, omega : arrays, shape (cases, panels, nodes)
            The last ones.
        wanted : array, shape (cases,)
            Mean speed in rad/s.
        """
        panels, kind = self.panels, self.spec.mean_speed_is
        torque, slope = law[0], law[1] / (self.fields.inertia * omega)
        if self.found:
            # Of the operations, those that do not follow the speed stay as they are.
            unknown, known = self.fields.operation + torque, self.constant
            work = panels.integral(unknown)
            factor = np.where(work != 0.0, -panels.integral(known) / np.where(work != 0.0, work, 1.0), 1.0)
            slope = factor[:, None, None] * slope
        else:
            scaled = self.spec.balance == "scale"
            unknown, known = self.fields.drive if scaled else self.one, self.constant + torque
        # T = T_0 U + c V + W, all linear; c makes it periodic.
        u = panels.running(slope * self.integrated(slope, self.one))
        w_defect = self.integrated(slope, panels.running(known)[0] - energy)
        w = panels.running(known + slope * w_defect)
        grown, work = 1.0 + u[0], w[0]
        if self.spec.balance != "refuse":
            v = panels.running(unknown + slope * self.integrated(slope, panels.running(unknown)[0]))
            by_start, by_work = u[1][:, -1] / v[1][:, -1], w[1][:, -1] / v[1][:, -1]
            grown, work = grown - by_start[:, None, None] * v[0], work - by_work[:, None, None] * v[0]
        # Divided by U, the equation is that of a machine without such loads.
        shape = Shape(panels, self.cycle, self.fields.inertia / grown, work / grown)
        stop = Stop.of(shape)
        least = least_mean_speed(shape, stop, kind, known + unknown)
        turns = wanted > least
        start = -1.001 * stop.work
        rows = np.nonzero(turns)[0]
        if rows.size:
            start[rows] = start_energy(shape.take(rows), stop.take(rows), kind, wanted[rows])
        return start[:, None, None] * grown + work, np.asarray(turns), slope


def speed_course(machine: Machine, columns: Columns, panels: Panels, fields: Fields, law: SpeedLaw) -> SpeedCourse:
    """The speed of the steady motion at the required mean speed.

    Each iteration solves the equation that is linear about the last energy. Its residual is integrated by the panels'
    own rule, so that the work of the last speed is closed to rounding.

    Parameters
    ----------
    machine : Machine
    columns : Columns
        Its numbers.
    panels : Panels
    fields : Fields
        At the nodes, without the torques of ``law``.
    law : SpeedLaw
        Of the loads that follow the speed, at the nodes.
    """
    whole = _Course(machine.spec, panels, machine.cycle, fields)
    pace = np.broadcast_to(machine.pace, fields.inertia.shape)
    energy = np.array(0.5 * fields.inertia * np.square(pace))
    wanted = columns.row("mean_speed")
    turning, done = np.zeros(len(wanted), dtype=np.bool_), np.zeros(len(wanted), dtype=np.bool_)
    slopes, previous = np.zeros(energy.shape), np.full(len(wanted), np.inf)
    active = np.arange(len(wanted))
    for _ in range(_MAX_ITERATIONS):
        if not active.size:
            break
        with np.errstate(all="ignore"):
            omega = np.sqrt(2.0 * energy / fields.inertia)
            at = tuple(part[active] for part in law(omega))
            own, last = whole.take(active), energy[active]
            found, turning[active], slopes[active] = own.step((at[0], at[1]), last, omega[active], wanted[active])
            kept = np.maximum(found, 0.1 * last)
            change = own.panels.largest(kept - last) / own.panels.largest(kept)
        change = np.where(np.isfinite(kept).all(axis=(1, 2)), change, np.nan)
        energy[active] = np.where(np.isnan(change)[:, None, None], last, kept)
        # A small change that no longer decreases is rounding.
        near = (change < 1e-15) | ((change < _ACCURACY) & (change >= 0.5 * previous[active]))
        previous[active] = change
        done[active] = near
        active = active[~(near | np.isnan(change))]
    with np.errstate(all="ignore"):
        stiff = np.abs(slopes).max(axis=2) * panels.half > _STIFF
        omega = np.where(done[:, None, None], np.sqrt(2.0 * energy / fields.inertia), pace)
    stopped = ~turning & ~np.isnan(previous)
    return SpeedCourse(omega, slopes, stopped, ~done & ~stopped, np.asarray(stiff & ~done[:, None]))
