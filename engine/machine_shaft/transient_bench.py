"""A machine on panels that resolve it, for transients: inertia, torques and steady cycles at the nodes."""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev, legendre
from numpy.typing import NDArray

from sprag.engine.machine_shaft.balance import balanced
from sprag.engine.machine_shaft.columns import Columns
from sprag.engine.machine_shaft.machine import Fields, Machine
from sprag.engine.machine_shaft.motor import characteristic, limit_cycle
from sprag.engine.machine_shaft.panels import COEFFICIENTS, NODES, Panels, apply
from sprag.engine.machine_shaft.quadrature import product
from sprag.engine.machine_shaft.spec import MachineSpec
from sprag.engine.machine_shaft.start import Shape, mean_speed

Floats = NDArray[np.float64]

#: Chebyshev series of the polynomial through values at the nodes of a panel.
_PLACES = np.cos((np.arange(NODES) + 0.5) * np.pi / NODES)
_TO_CHEBYSHEV = np.ascontiguousarray(
    product(
        chebyshev.chebvander(_PLACES, NODES - 1).T * np.where(np.arange(NODES) == 0, 1.0, 2.0)[:, None] / NODES,
        legendre.legvander(_PLACES, NODES - 1),
        COEFFICIENTS,
    )
)


@dataclass(frozen=True, slots=True)
class Cycle:
    """A steady cycle: its energy at the nodes, shape (1, panels, nodes), its mean speed and irregularity."""

    energy: Floats
    mean: float
    irregularity: float


class Bench:
    """A machine with torques and inertia at the nodes of panels, and its steady cycles."""

    def __init__(self, model: MachineSpec, row: Columns, panels: Panels, start: float) -> None:
        self.model, self.row, self.panels, self.start = model, row, panels, start
        self.machine = Machine(model, row)
        self.cycle = self.machine.cycle
        self.fields: Fields = self.machine.fields(panels.angles)
        with np.errstate(all="ignore"):
            own = balanced(
                model.balance, model.balance_side, panels, self.cycle, self.fields.drive, self.fields.resistance,
                self.fields.operation,
            )  # fmt: skip
        self.drive, self.passive = own.drive, self.fields.resistance - self.fields.operation
        self._operation = own.resistance - self.passive
        self.motor = self.machine.train.motor(row.under("drive.motor.")) if model.balance == "motor" else {}

    def resistance(self, load: float) -> Floats:
        """Resisting torque at the nodes with a factor on the operations."""
        return self.passive + load * self._operation

    def steady(self, load: float) -> Cycle | None:
        """The steady cycle: of a motor with this load, else of the case itself; None where there is none."""
        panels, inertia, start, drive = self.panels, self.fields.inertia, np.array([self.start]), self.drive
        resistance = self.resistance(load if self.motor else 1.0)
        if self.motor and self.model.drive.motor:
            with np.errstate(all="ignore"):
                found = limit_cycle(
                    characteristic(self.model.drive), self.motor, panels, self.cycle, inertia, resistance
                )
            if found.stalled[0] or found.overrun[0]:
                return None
            start, drive = found.start, found.drive
        if not np.isfinite(start[0]):
            return None
        work = panels.running(drive + resistance)[0]
        shape = Shape(panels, self.cycle, inertia, work)
        mean = float(mean_speed(shape, self.model.mean_speed_is, start)[0][0])
        square = panels.extremes(shape.squares(start))
        spread = float(np.sqrt(square.highest[0]) - np.sqrt(max(square.lowest[0], 0.0)))
        # Of a shaft that turns evenly, rounding errors are left.
        return Cycle(start[:, None, None] + work, mean, spread / mean if spread > 1e-12 * mean else 0.0)

    def table(self, *values: Floats) -> Floats:
        """Chebyshev series over the angle in each panel, shape (panels, len(values), terms)."""
        return np.ascontiguousarray(np.stack([apply(_TO_CHEBYSHEV, part)[0] for part in values], axis=1))

    def at(self, values: Floats, angles: Floats) -> Floats:
        """Values at angles 0 .. cycle, shape (m,)."""
        return self.panels.at_rows(values, np.zeros(len(angles), dtype=np.int64), self.panels.locate(0, angles))
