"""A machine on panels that resolve it, for transients: inertia, torques and steady cycles at the nodes."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.polynomial import chebyshev, legendre
from numpy.typing import NDArray

from sprag_study.engine import elementary
from sprag_study.engine.machine_shaft.balance import balanced
from sprag_study.engine.machine_shaft.columns import Columns
from sprag_study.engine.machine_shaft.machine import Fields, Machine
from sprag_study.engine.machine_shaft.motor import characteristic, limit_cycle
from sprag_study.engine.machine_shaft.operations import SpeedLaw
from sprag_study.engine.machine_shaft.panels import COEFFICIENTS, NODES, Panels, apply
from sprag_study.engine.machine_shaft.spec import MachineSpec
from sprag_study.engine.machine_shaft.speed_course import follows_speed
from sprag_study.engine.machine_shaft.start import Shape, mean_speed
from sprag_study.engine.quadrature import product

Floats = NDArray[np.float64]


@cache
def _to_chebyshev() -> Floats:
    """Matrix from values at the nodes of a panel to the Chebyshev series of the polynomial through them."""
    places = _places(NODES)
    to_values = legendre.legvander(places, NODES - 1)
    return np.ascontiguousarray(product(_to_series(places), to_values, COEFFICIENTS))


def _places(count: int) -> Floats:
    """Chebyshev's nodes."""
    return elementary.cos((np.arange(count) + 0.5) * np.pi / count)


#: Terms of the load over the speed.
_TERMS = (4, 8, 16, 32, 64)


def _to_series(places: Floats) -> Floats:
    """Matrix from values at Chebyshev's nodes to the coefficients of the series."""
    count = len(places)
    twice = np.where(np.arange(count) == 0, 1.0, 2.0)[:, None]
    return np.asarray(chebyshev.chebvander(places, count - 1).T * twice / count)


def scaled(law: SpeedLaw, factor: float) -> SpeedLaw:
    """A load that follows the speed, times a factor."""

    def product_of(omega: Floats) -> tuple[Floats, Floats]:
        torque, slope = law(omega)
        return factor * torque, factor * slope

    return product_of


@dataclass(frozen=True, slots=True)
class Cycle:
    """A steady cycle: its energy at the nodes, shape (1, panels, nodes), its mean speed and irregularity."""

    energy: Floats
    mean: float
    irregularity: float


class Bench:
    """A machine with torques and inertia at the nodes of panels, and its steady cycles."""

    def __init__(self, model: MachineSpec, row: Columns, panels: Panels, start: float, omega: Floats | None) -> None:
        self.model, self.row, self.panels, self.start = model, row, panels, start
        self.machine = Machine(model, row)
        self.cycle = self.machine.cycle
        self.fields: Fields = self.machine.fields(panels.angles, omega)
        with np.errstate(all="ignore"):
            own = balanced(
                model.balance, model.balance_side, panels, self.cycle, self.fields.drive, self.fields.resistance,
                self.fields.operation,
            )  # fmt: skip
        self.drive, self.passive = own.drive, self.fields.resistance - self.fields.operation
        self._steady = own.resistance - self.passive
        self._operation = self._steady
        self._law: SpeedLaw | None = None
        if follows_speed(self.machine):
            law, factor = self.machine.speed_law(panels.angles), 1.0
            if model.balance == "scale" and model.balance_side == "operation":
                factor = float(own.factor[0])
            speeds = np.broadcast_to(self.machine.pace, panels.angles.shape) if omega is None else omega
            # The operations without those that follow the speed.
            self._operation = self._operation - factor * law(speeds)[0]
            self._law = scaled(law, factor)
        self.motor = self.machine.train.motor(row.under("drive.motor.")) if model.balance == "motor" else {}

    def resistance(self, load: float, fastest: float = 1.0) -> list[Floats]:
        """Resisting torque at the nodes with a factor on the operations: Chebyshev series over 0 .. ``fastest``.

        One term where nothing follows the speed; none where the load is not smooth in the speed.
        """
        fixed = self.passive + load * self._operation
        if self._law is None:
            return [fixed]
        for terms in _TERMS:
            z = _places(terms)
            with np.errstate(all="ignore"):
                values = [load * self._law(np.full(fixed.shape, 0.5 * fastest * (1.0 + own)))[0] for own in z]
            to_series = _to_series(z)
            rows = [np.asarray(sum(w * v for w, v in zip(row, values, strict=True))) for row in to_series]
            sizes = np.array([np.abs(row).max() for row in rows])
            if np.all(sizes[-2:] <= 1e-13 * sizes.max()):
                kept = max(int(np.max(np.nonzero(sizes > 1e-15 * sizes.max())[0], initial=0)) + 1, 2)
                return [fixed + rows[0], *rows[1:kept]]
        return []

    def steady(self, load: float) -> Cycle | None:
        """The steady cycle: of a motor with this load, else of the case itself; None where there is none."""
        panels, inertia, start, drive = self.panels, self.fields.inertia, np.array([self.start]), self.drive
        # Without a motor the cycle is that of the case.
        resistance = self.passive + (load * self._operation if self.motor else self._steady)
        if self.motor and self.model.drive.motor:
            with np.errstate(all="ignore"):
                law = None if self._law is None else scaled(self._law, load)
                found = limit_cycle(
                    characteristic(self.model.drive), self.motor, panels, self.cycle, inertia, resistance, law
                )
            if found.stalled[0] or found.overrun[0] or found.stability.unstable[0]:
                return None
            start, drive, resistance = found.start, found.drive, found.resistance
        if not np.isfinite(start[0]):
            return None
        work = panels.running(drive + resistance)[0]
        shape = Shape(panels, self.cycle, inertia, work)
        mean = float(mean_speed(shape, self.model.mean_speed_is, start)[0][0])
        square = panels.extremes(shape.squares(start))
        spread = float(np.sqrt(square.highest[0]) - np.sqrt(max(square.lowest[0], 0.0)))
        # Of a shaft that turns evenly, rounding errors are left.
        return Cycle(start[:, None, None] + work, mean, spread / mean if spread > 1e-12 * mean else 0.0)

    def fastest(self, *cycles: Cycle | None) -> float:
        """A speed in rad/s above all of a transient: half above the motor without load and the cycles."""
        speeds = [float(self.machine.pace[0, 0, 0])]
        for cycle in cycles:
            if cycle is not None:
                speeds.append(float(np.sqrt(2.0 * cycle.energy / self.fields.inertia).max()))
        return 1.5 * max(speeds)

    def table(self, *values: Floats) -> Floats:
        """Chebyshev series over the angle in each panel, shape (panels, len(values), terms)."""
        return np.ascontiguousarray(np.stack([apply(_to_chebyshev(), part)[0] for part in values], axis=1))

    def at(self, values: Floats, angles: Floats) -> Floats:
        """Values at angles 0 .. cycle, shape (m,)."""
        return self.panels.at_rows(values, np.zeros(len(angles), dtype=np.int64), self.panels.locate(0, angles))
