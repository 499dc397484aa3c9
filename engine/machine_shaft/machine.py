"""A machine with its structure and numbers: inertia and torques at any angles, for a block of cases."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag.engine.machine_shaft.cams import Cam
from sprag.engine.machine_shaft.drive_train import Train
from sprag.engine.machine_shaft.expressions import RESERVED, Expression
from sprag.engine.machine_shaft.linkages import CrankShaper, FourBar, SliderCrank, Whitworth
from sprag.engine.machine_shaft.mechanisms import Mechanism, Motion
from sprag.engine.machine_shaft.operations import Operation, Stroke, every_revolution, formula_breaks
from sprag.engine.machine_shaft.parameters import parameters
from sprag.engine.machine_shaft.pieces import Formula, Part
from sprag.engine.machine_shaft.problems import ExpressionError, StructureError, TableError
from sprag.engine.machine_shaft.spec import LINKED, MAX_CONSTANTS, MAX_STEPS, REVOLUTIONS, MachineSpec, MechanismChoice
from sprag.engine.machine_shaft.tables import Curve, periodic

Floats = NDArray[np.float64]

_TURN = 2.0 * np.pi


class Columns:
    """Numbers of a block of cases.

    Attributes
    ----------
    cases : int
    values : dict
        Every parameter of the structure by path: shape (cases, 1, 1), or (1, 1, 1) where all cases share it.
    """

    def __init__(self, values: dict[str, Floats], cases: int) -> None:
        self.values, self.cases = values, cases

    @classmethod
    def of(cls, spec: MachineSpec, columns: Mapping[str, ArrayLike], cases: int) -> "Columns":
        """Columns with the defaults of the catalogue; ValueError where one is missing or unknown."""
        known = {parameter.path: parameter.default for parameter in parameters(spec)}
        unknown = sorted(set(columns) - set(known))
        if unknown:
            raise ValueError(f"unknown parameters of this machine: {', '.join(unknown)}")
        values = {}
        for path, default in known.items():
            given = columns.get(path, default)
            if given is None:
                raise ValueError(f"{path} is required")
            array = np.asarray(given, dtype=np.float64)
            if array.shape not in {(), (cases,)}:
                raise ValueError(f"{path} has the shape {array.shape}, not () or ({cases},)")
            values[path] = array.reshape(-1, 1, 1)
        return cls(values, cases)

    def take(self, rows: NDArray[np.int64] | slice) -> "Columns":
        """The same for some of the cases."""
        values = {path: value[rows] if len(value) == self.cases else value for path, value in self.values.items()}
        count = len(range(self.cases)[rows]) if isinstance(rows, slice) else len(rows)
        return Columns(values, count)

    def under(self, prefix: str) -> dict[str, Floats]:
        """Values of the paths that begin with ``prefix``, without it."""
        return {path[len(prefix) :]: value for path, value in self.values.items() if path.startswith(prefix)}

    def row(self, path: str) -> Floats:
        """One parameter, shape (cases,)."""
        return np.broadcast_to(self.values[path][:, 0, 0], (self.cases,))


def mechanism_of(choice: MechanismChoice) -> Mechanism | None:
    """The mechanism with dimensions, or None for none, a table or a formula."""
    if choice.kind == "slider_crank":
        return SliderCrank()
    if choice.kind == "four_bar":
        return FourBar()
    if choice.kind == "quick_return":
        return Whitworth() if choice.quick_return == "whitworth" else CrankShaper()
    return Cam(choice.rise, choice.fall) if choice.kind == "cam" else None


def _mechanism_curve(spec: MachineSpec) -> Curve | None:
    table = spec.mechanism.table
    if spec.mechanism.kind != "table" or table is None:
        return None
    for number, (row, following) in enumerate(pairwise(table.rows), start=1):
        if row[0] == following[0]:
            raise TableError(
                f"Rows {number} and {number + 1} of the inertia both have {row[0]:g} rad, with {row[1]:g} and "
                f"{following[1]:g} kg*m^2: only a torque may jump, not an inertia."
            )
    within_one = len(table.rows) > 0 and table.rows[-1][0] - table.rows[0][0] <= _TURN * (1.0 + 1e-9)
    return periodic(table, _TURN if within_one else _TURN * spec.cycle)


def _check_form(part: str, form: str, has_table: bool, has_formula: bool) -> None:
    if form == "table" and not has_table:
        raise StructureError(f"{part} needs a table, but none is given.")
    if form == "formula" and not has_formula:
        raise StructureError(f"{part} needs a formula, but none is given.")


def check_structure(spec: MachineSpec) -> None:
    """Refuse a structure that is not a valid machine.

    Raises
    ------
    StructureError, TableError, ExpressionError
        With a plain sentence.
    """
    operation, kind = spec.operation, spec.mechanism.kind
    if spec.phi_c is not None and spec.phi_c < 0:
        raise StructureError(f"phi_c counts the angles with T = T_mean from 0; it cannot be {spec.phi_c}.")
    if spec.cycle not in REVOLUTIONS:
        raise StructureError(f"A cycle has 1, 2 or 3 revolutions, not {spec.cycle}.")
    if spec.balance == "motor" and spec.drive.motor is None:
        raise StructureError('The balance "motor" needs a motor in the drive.')
    if not 0 <= operation.steps <= MAX_STEPS:
        raise StructureError(f"An operation has at most {MAX_STEPS} steps.")
    if len(spec.constants) > MAX_CONSTANTS:
        raise StructureError(f"A machine has at most {MAX_CONSTANTS} constants.")
    taken = sorted((RESERVED | {"phi", "x"}) & set(spec.constants))
    if taken:
        raise StructureError(f"A constant cannot be named {taken[0]}: that name has a meaning in formulas.")
    _check_form("The inertia of the mechanism", kind, spec.mechanism.table is not None, bool(spec.mechanism.formula))
    if spec.balance != "motor":
        _check_form("The driving torque", spec.drive.form, spec.drive.table is not None, bool(spec.drive.formula))
    if operation.quantity in {"torque", "force"}:
        _check_form("The operation", operation.form, operation.table is not None, bool(operation.formula))
    needs = operation.quantity in {"force", "gas"} or (operation.quantity == "torque" and operation.over == "stroke")
    if needs and kind not in LINKED:
        raise StructureError(
            "A force, a gas or a diagram over the stroke needs a mechanism with dimensions: slider_crank, four_bar, "
            "quick_return or cam."
        )
    # The parts are built once with arbitrary valid numbers, so that tables and formulas are read.
    columns = {p.path: p.default if p.default is not None else 1.0 for p in parameters(spec)}
    Machine(spec, Columns.of(spec, columns, 1))


@dataclass(frozen=True, slots=True)
class Fields:
    """Inertia and torques at angles, all of the shape (cases, panels, nodes).

    Attributes
    ----------
    inertia, slope : arrays
        I in kg*m^2 and dI/dphi.
    drive, resistance : arrays
        M_d as given and M_r in N*m; M_d is zero where it is still to be determined.
    """

    inertia: Floats
    slope: Floats
    drive: Floats
    resistance: Floats


class Jumps(NamedTuple):
    """Jumps of the inertia, one a case: the angle in rad, and the values there in kg*m^2; NaN where there is none."""

    angle: Floats
    before: Floats
    after: Floats


class Machine:
    """A structure with the numbers of a block of cases."""

    def __init__(self, spec: MachineSpec, columns: Columns) -> None:
        self.spec, self.columns = spec, columns
        self.cycle = _TURN * spec.cycle
        self.constants = columns.under("constants.")
        self.train = Train.of(spec.drive, columns.values)
        self.mechanism = mechanism_of(spec.mechanism)
        self.mechanism_values = columns.under(f"mechanism.{spec.mechanism.kind}.")
        names = ("phi", *spec.constants)
        self._inertia_curve = _mechanism_curve(spec)
        self._inertia_formula = (
            Expression(spec.mechanism.formula or "", names) if spec.mechanism.kind == "formula" else None
        )
        given = spec.balance != "motor"
        table, formula = spec.drive.table, spec.drive.formula
        self._drive_curve = (
            periodic(table, self.cycle) if given and spec.drive.form == "table" and table is not None else None
        )
        self._drive_formula = Expression(formula or "", names) if given and spec.drive.form == "formula" else None
        stroke = None if self.mechanism is None else Stroke.of(self.mechanism, self.mechanism_values)
        self._stroke = stroke
        self._operation = Operation(spec.operation, spec.cycle, columns.under("operation."), self.constants, stroke)

    def unassembled(self) -> Floats:
        """First angle at which the mechanism cannot be assembled, NaN where it always can; shape (cases,)."""
        if self.mechanism is None:
            return np.full(self.columns.cases, np.nan)
        return np.broadcast_to(self.mechanism.unassembled(self.mechanism_values), (self.columns.cases,))

    def broken_rule(self) -> str | None:
        """The condition that the dimensions of the first case violate; None where its links are merely too short."""
        return None if self.mechanism is None else self.mechanism.broken_rule(self.mechanism_values)

    def _environment(self, phi: Floats) -> dict[str, tuple[Floats, Floats | float]]:
        return {"phi": (phi, np.ones(1)), **{name: (value, 0.0) for name, value in self.constants.items()}}

    def breaks(self) -> list[Floats]:
        """Angles at which the quadrature is cut, arrays of shape (cases or 1, n); NaN is none."""
        revolutions = self.spec.cycle
        breaks = list(self._operation.breaks())
        if self._stroke is not None and self.mechanism is not None:
            own = [self._stroke.start, self._stroke.end, *self.mechanism.breaks(self.mechanism_values)]
            breaks += [every_revolution(angle, revolutions) for angle in own]
        if self._inertia_curve is not None:
            period = float(self._inertia_curve.knots[-1] - self._inertia_curve.knots[0])
            repeats = round(self.cycle / period)
            knots = np.mod(self._inertia_curve.knots, period)
            breaks.append(np.concatenate([knots + period * k for k in range(repeats)])[None, :])
        if self._drive_curve is not None:
            breaks.append(np.mod(self._drive_curve.knots, self.cycle)[None, :])
        for formula in (self._inertia_formula, self._drive_formula):
            if formula is not None:
                breaks += formula_breaks(formula, self._environment, revolutions)
        return breaks

    def formulas(self) -> list[Formula]:
        """The formulas of the fields, except a drive that balancing replaces."""
        own: list[tuple[Part, Expression | None]] = [
            ("inertia", self._inertia_formula),
            ("drive", None if self.spec.balance == "constant" else self._drive_formula),
            ("resistance", self._operation.expression),
        ]
        return [
            Formula(
                part, expression, {name: value for name, value in self.constants.items() if name in expression.used},
                self._stroke if "x" in expression.used else None,
            )
            for part, expression in own if expression is not None
        ]  # fmt: skip

    def _motion(self, phi: Floats) -> Motion | None:
        return None if self.mechanism is None else self.mechanism.motion(self.mechanism_values, phi)

    def _inertia(self, phi: Floats, motion: Motion | None) -> tuple[Floats, Floats]:
        if motion is not None:
            return motion.inertia, motion.inertia_slope
        if self._inertia_curve is not None:
            return self._inertia_curve(phi), self._inertia_curve.slope(phi)
        if self._inertia_formula is not None:
            value, slope = self._inertia_formula.evaluate(self._environment(phi))
            return np.asarray(value), np.asarray(slope)
        return np.zeros(1), np.zeros(1)

    def _drive(self, phi: Floats) -> Floats:
        values = self.columns.values
        if self.spec.balance == "motor":
            return np.zeros(1)
        if self.spec.drive.form == "constant":
            return self.train.at_shaft(values["drive.torque"])
        scale = values["drive.scale"]
        if self._drive_curve is not None:
            return self.train.at_shaft(np.asarray(scale * self._drive_curve(phi)))
        if self._drive_formula is None:
            raise AssertionError("a drive that is not constant has a table or a formula")
        return self.train.at_shaft(np.asarray(scale * self._drive_formula.evaluate(self._environment(phi))[0]))

    def _carried(self, motion: Motion | None) -> Floats:
        """Torque of the weight and the spring on the working part."""
        values, kind = self.columns.values, self.spec.mechanism.kind
        if motion is None or self.mechanism is None or self.mechanism.ram_mass is None:
            return np.zeros(1)
        own = self.mechanism_values
        force = own[self.mechanism.ram_mass] * values["gravity"] * np.sin(own["inclination"])
        if kind == "cam":
            force = force + own["spring_preload"] + own["spring_rate"] * motion.way
        return np.asarray(-force * motion.way_slope)

    def fields(self, phi: Floats) -> Fields:
        """Inertia and torques at ``phi``, shape (cases or 1, panels, nodes), none of it at a jump."""
        motion = self._motion(phi)
        inertia, slope = self._inertia(phi, motion)
        resistance = self._operation.torque(phi, None if motion is None else motion.way_slope) + self._carried(motion)
        shape = (self.columns.cases, *phi.shape[1:])
        parts = (inertia + self.train.inertia, slope, self._drive(phi), resistance)
        return Fields(*(np.ascontiguousarray(np.broadcast_to(part, shape)) for part in parts))

    def inertia_jumps(self) -> Jumps:
        """Where a formula of the inertia jumps first, within the cycle or from its end to its start."""
        jumps = Jumps(*(np.full(self.columns.cases, np.nan) for _ in range(3)))
        if self._inertia_formula is None:
            return jumps
        ends = np.array([[[0.0, self.cycle]]])
        exact = self.fields(ends).inertia
        angles = [np.zeros((1, 1))]
        angles += [np.sort(found, axis=1) for found in formula_breaks(self._inertia_formula, self._environment,
                                                                      self.spec.cycle)]  # fmt: skip
        for found in angles:
            for column in range(found.shape[1]):
                angle = found[:, column][:, None, None]
                closing = np.minimum(angle, self.cycle - angle) < 1e-6
                before, after = self._limits(np.where(closing, self.cycle, angle), np.where(closing, 0.0, angle))
                # Smooth parts are compared directly; a root has an infinite slope at a kink, but no jump.
                apart = np.abs(exact[..., :1] - exact[..., 1:]) > 1e-9 * np.abs(exact[..., :1])
                least = np.where(closing & apart, 1e-9, 1e-6)
                jump = np.abs(after - before) > least * np.maximum(np.abs(before), np.abs(after))
                first = (jump & ~np.isnan(angle))[:, 0, 0] & ~(jumps.angle <= angle[:, 0, 0])
                for kept, value in ((jumps.angle, angle), (jumps.before, before), (jumps.after, after)):
                    kept[first] = np.broadcast_to(value[:, 0, 0], first.shape)[first]
        return jumps

    def _limits(self, left: Floats, right: Floats) -> tuple[Floats, Floats]:
        """Inertia as the angle comes to ``left`` from below and to ``right`` from above; arrays (cases, 1, 1)."""
        near = 1e-12 * self.cycle
        with np.errstate(all="ignore"):
            below, above = self.fields(left - near), self.fields(right + near)
            return below.inertia + near * below.slope, above.inertia - near * above.slope

    def check_closed(self) -> None:
        """Refuse a formula of the inertia that jumps somewhere in the cycle (of the first case).

        Raises
        ------
        ExpressionError
        """
        angle, before, after = (float(values[0]) for values in self.inertia_jumps())
        if np.isnan(angle):
            return
        end = min(angle, self.cycle - angle) < 1e-6
        what = (
            f"The inertia does not close on itself: it begins with {after:.6g} kg*m^2 and ends, a cycle later, with "
            f"{before:.6g} kg*m^2"
            if end
            else f"The inertia jumps at {np.degrees(angle):.6g} deg from {before:.6g} to {after:.6g} kg*m^2"
        )
        raise ExpressionError(f"{what} (the drive's with it). Only a torque may jump.", None, "mechanism")

    def check_finite(self) -> None:
        """Refuse a formula whose value is not finite somewhere in the cycle (of the first case).

        Raises
        ------
        ExpressionError
        """
        phi = np.asarray((np.arange(720 * self.spec.cycle) + 0.5) * np.pi / 360.0, dtype=np.float64)[None, None, :]
        with np.errstate(all="ignore"):
            fields = self.fields(phi)
        for part, name, values in (
            ("mechanism", "inertia of the mechanism", fields.inertia), ("drive", "driving torque", fields.drive),
            ("operation", "torque of the operation", fields.resistance),
        ):  # fmt: skip
            wrong = ~np.isfinite(values[0, 0])
            if wrong.any():
                angle = float(np.degrees(phi[0, 0, int(np.argmax(wrong))]))
                raise ExpressionError(f"The {name} is not a finite number at {angle:.4g} deg.", None, part)
