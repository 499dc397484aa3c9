"""A machine on panels that resolve it, for transients: inertia, torques and steady cycles at the nodes."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.polynomial import chebyshev, legendre
from numpy.typing import NDArray

from sprag_study.engine import elementary
from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.machine_shaft.balance import balanced
from sprag_study.engine.machine_shaft.columns import Columns
from sprag_study.engine.machine_shaft.machine import Fields, Machine
from sprag_study.engine.machine_shaft.motor import characteristic, limit_cycle
from sprag_study.engine.machine_shaft.operations import SpeedLaw
from sprag_study.engine.machine_shaft.panels import COEFFICIENTS, NODES, Panels, apply
from sprag_study.engine.machine_shaft.simulate import Solved, attempts, settle
from sprag_study.engine.machine_shaft.spec import MachineSpec, MeanSpeed
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


def cycle_of(panels: Panels, inertia: Floats, start: Floats, work: Floats, kind: MeanSpeed) -> Cycle:
    """The cycle of an energy ``start`` (1,) at the angle 0 and the ``work`` since then at the nodes."""
    shape = Shape(panels, float(panels.cuts[0, -1]), inertia, work)
    mean = float(mean_speed(shape, kind, start)[0][0])
    square = panels.extremes(shape.squares(start))
    spread = float(np.sqrt(square.highest[0]) - np.sqrt(max(square.lowest[0], 0.0)))
    # Of a shaft that turns evenly, rounding errors are left.
    return Cycle(start[:, None, None] + work, mean, spread / mean if spread > 1e-12 * mean else 0.0)


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
        self._factor = 1.0
        if follows_speed(self.machine):
            law = self.machine.speed_law(panels.angles)
            if model.balance == "scale" and model.balance_side == "operation":
                self._factor = float(own.factor[0])
            speeds = np.broadcast_to(self.machine.pace, panels.angles.shape) if omega is None else omega
            # The operations without those that follow the speed.
            self._operation = self._operation - self._factor * law(speeds)[0]
            self._law = scaled(law, self._factor)
        self.motor = self.machine.train.motor(row.under("drive.motor.")) if model.balance == "motor" else {}

    def fixed(self, load: float) -> Floats:
        """Torque at the nodes that does not follow the speed, with a factor on the operations."""
        return self.drive + self.passive + load * self._operation

    def law_at(self, angles: Floats, load: float) -> SpeedLaw | None:
        """The loads that follow the speed at other angles (1, panels, nodes), with a factor on the operations."""
        return None if self._law is None else scaled(self.machine.speed_law(angles), load * self._factor)

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
        return cycle_of(panels, inertia, start, work, self.model.mean_speed_is)

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


def _speeds(solved: Solved, panels: Panels) -> Floats | None:
    """Speeds of the case at the nodes of other panels; None where no torque follows the speed."""
    if solved.omega is None or not np.isfinite(solved.decomposition.start[0]):
        return None
    own, angles = solved.decomposition.panels, panels.angles.ravel()
    found = own.at_rows(solved.omega, np.zeros(len(angles), dtype=np.int64), own.locate(0, angles))
    return np.ascontiguousarray(found.reshape(panels.angles.shape))


def solved_case(model: MachineSpec, row: Columns) -> tuple[Solved | None, Ending]:
    """The case on panels that resolve it, and its ending; without them where its fields are not resolved."""
    if not np.isnan(Machine(model, row).unassembled()[0]):
        return None, Ending.CANNOT_ASSEMBLE
    with np.errstate(all="ignore"):
        *_, (_, solved) = attempts(model, row)
        settle(model, row, solved)
    ending = ENDINGS[int(solved.endings[0])]
    if ending in {Ending.NEGATIVE_INERTIA, Ending.QUADRATURE_NOT_REACHED, Ending.NEAR_SINGULAR}:
        return None, ending
    return solved, ending


def bench_on(model: MachineSpec, row: Columns, solved: Solved, cuts: Floats) -> Bench:
    """The machine of a solved case on panels with other ``cuts``, (1, panels + 1)."""
    panels = Panels(cuts)
    return Bench(model, row, panels, float(solved.decomposition.start[0]), _speeds(solved, panels))


def bench_of(model: MachineSpec, row: Columns) -> tuple[Bench | None, Ending]:
    """The machine on the panels of its case, and the ending of that; without one where there is no drive for it."""
    solved, ending = solved_case(model, row)
    if solved is None or (model.balance != "motor" and ending not in {Ending.OK, Ending.UNSTABLE}):
        return None, ending
    return bench_on(model, row, solved, np.unique(solved.decomposition.panels.cuts[0])[None, :]), ending
