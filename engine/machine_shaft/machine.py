"""A machine with its structure and numbers: inertia and torques at any angles, for a block of cases."""

from dataclasses import dataclass, replace
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.formulas.expressions import RESERVED, Expression, ExpressionError
from sprag_study.engine.machine_shaft.columns import Columns
from sprag_study.engine.machine_shaft.drive_train import Train
from sprag_study.engine.machine_shaft.elements import MAX_ELEMENTS, LinkageChoice, element_faults
from sprag_study.engine.machine_shaft.mechanisms import RodMechanism
from sprag_study.engine.machine_shaft.motor import characteristic, free_speed
from sprag_study.engine.machine_shaft.operations import SpeedLaw, formula_breaks
from sprag_study.engine.machine_shaft.parameters import parameters
from sprag_study.engine.machine_shaft.parts import Jumps, ShaftPart, mechanism_of
from sprag_study.engine.machine_shaft.pieces import Formula
from sprag_study.engine.machine_shaft.problems import StructureError, amount
from sprag_study.engine.machine_shaft.spec import (
    LINKED,
    MAX_CONSTANTS,
    MAX_PARTS,
    MAX_STEPS,
    REVOLUTIONS,
    MachineSpec,
    PartChoice,
)
from sprag_study.engine.machine_shaft.tables import periodic
from sprag_study.sentences import Amount, Sentence

Floats = NDArray[np.float64]

_TURN = 2.0 * np.pi


_DRIVE = Sentence("The driving torque")
_INERTIA = Sentence("The inertia of the mechanism")


def _check_form(part: Sentence, form: str, has_table: bool, has_formula: bool) -> None:
    if form == "table" and not has_table:
        raise StructureError(Sentence("{part} needs a table, but none is given.", part=part))
    if form == "formula" and not has_formula:
        raise StructureError(Sentence("{part} needs a formula, but none is given.", part=part))


def check_structure(spec: MachineSpec) -> None:
    """Refuse a structure that is not a valid machine.

    Raises
    ------
    StructureError, TableError, ExpressionError
        With a plain sentence.
    """
    if spec.phi_c is not None and spec.phi_c < 0:
        raise StructureError(
            Sentence("phi_c counts the angles with T = T_mean from 0; it cannot be {given}.", given=str(spec.phi_c))
        )
    if spec.cycle not in REVOLUTIONS:
        raise StructureError(
            Sentence("A cycle has 1 to {most} revolutions, not {given}.", most=max(REVOLUTIONS), given=str(spec.cycle))
        )
    if spec.balance == "motor" and spec.balance_side == "operation":
        raise StructureError(
            Sentence("With a motor the speed follows from the operation, which is not to be found then.")
        )
    if spec.balance == "motor" and spec.drive.motor is None:
        raise StructureError(Sentence('The balance "motor" needs a motor in the drive.'))
    if spec.balance == "motor" and spec.drive.motor == "table":
        if spec.drive.table is None:
            raise StructureError(Sentence("A motor of the kind table needs a table of its torque over its speed."))
        characteristic(spec.drive)
    shaft, stages = spec.drive.flywheel_shaft, len(spec.drive.stages)
    if shaft is not None and not 0 <= shaft <= stages:
        raise StructureError(
            Sentence(
                "The flywheel cannot sit on the shaft {given}: shafts are numbered from 0, the motor's, to {last}, the "
                "main shaft.",
                given=str(shaft),
                last=str(stages),
            )
        )
    if len(spec.constants) > MAX_CONSTANTS:
        raise StructureError(Sentence("A machine has at most {most} constants.", most=MAX_CONSTANTS))
    taken = sorted((RESERVED | {"phi", "x"}) & set(spec.constants))
    if taken:
        raise StructureError(
            Sentence("A constant cannot be named {name}: that name has a meaning in formulas.", name=taken[0])
        )
    if spec.balance != "motor":
        _check_form(_DRIVE, spec.drive.form, spec.drive.table is not None, bool(spec.drive.formula))
    if len(spec.parts) > MAX_PARTS:
        raise StructureError(
            Sentence("A machine has at most {most} parts, not {given}.", most=MAX_PARTS, given=str(len(spec.parts)))
        )
    if spec.parts and (spec.mechanism.kind != "none" or spec.operation.quantity != "none"):
        raise StructureError(
            Sentence("A machine has either parts or a mechanism and an operation of its own, not both.")
        )
    for _, part in spec.every_part():
        _check_shaft(part, spec.cycle)
        _check_part(part)
    # The parts are built once with arbitrary valid numbers, so that tables and formulas are read.
    columns = {p.path: p.default if p.default is not None else 1.0 for p in parameters(spec)}
    machine = Machine(spec, Columns.of(spec, columns, 1))
    if spec.balance == "motor" and any(part.uses_time for part in machine.parts):
        raise StructureError(
            Sentence(
                "The formula of an operation uses t, the time in which the shaft comes to phi at its mean speed; with "
                "a motor that speed is not known before. Give the operation over phi."
            )
        )


def _check_shaft(part: PartChoice, cycle: int) -> None:
    turns = part.turns_in(cycle)
    if turns not in REVOLUTIONS:
        raise StructureError(
            Sentence(
                "A part turns 1 to {most} times in a cycle, not {given} times.", most=max(REVOLUTIONS), given=str(turns)
            )
        )
    if part.cycle is not None and (part.cycle < 1 or turns % part.cycle):
        raise StructureError(
            Sentence(
                "A part that turns {turns} times in a cycle of the machine cannot repeat itself every {given} turns.",
                turns=str(turns),
                given=str(part.cycle),
            )
        )


def _check_part(part: PartChoice) -> None:
    mechanism, operation = part.mechanism, part.operation
    if not 0 <= operation.steps <= MAX_STEPS:
        raise StructureError(Sentence("An operation has at most {most} steps.", most=MAX_STEPS))
    rods = mechanism.weights == "all" or mechanism.bodies == "two_mass"
    if rods and not isinstance(mechanism_of(mechanism), RodMechanism):
        raise StructureError(
            Sentence("The weights of all bodies and two masses need a mechanism with a rod or a coupler.")
        )
    has_formula = bool(mechanism.formula)
    _check_form(_INERTIA, mechanism.kind, mechanism.table is not None, has_formula)
    if operation.quantity in {"torque", "force", "pressure"}:
        _check_form(Sentence("The operation"), operation.form, operation.table is not None, bool(operation.formula))
    if operation.efficiency_is == "work" and operation.form == "formula" and operation.quantity in {"torque", "force"}:
        raise StructureError(
            Sentence(
                'An efficiency as share of the work of a cycle (efficiency_is "work") is not possible for a formula.'
            )
        )
    if mechanism.kind == "linkage":
        _check_linkage(mechanism.linkage)
    needs = operation.quantity in {"force", "gas", "pressure"} or (
        operation.quantity == "torque" and operation.over == "stroke"
    )
    if needs and mechanism.kind not in LINKED:
        raise StructureError(
            Sentence(
                "A force, a gas or a diagram over the stroke needs a mechanism with dimensions, such as a slider_crank."
            )
        )
    if needs and mechanism.linkage is not None and not mechanism.linkage.working:
        raise StructureError(
            Sentence(
                "A force, a gas or a diagram over the stroke needs the working part of the linkage: `working` names "
                "its joint."
            )
        )


def _check_linkage(linkage: LinkageChoice | None) -> None:
    if linkage is None:
        raise StructureError(Sentence("A linkage needs its elements, but none are given."))
    if len(linkage.elements) > MAX_ELEMENTS:
        raise StructureError(Sentence("A linkage has at most {most} elements.", most=MAX_ELEMENTS))
    fault = next(element_faults(linkage), None)
    if fault is not None:
        place = fault.field if fault.element is None else f"elements.{fault.element}.{fault.field}"
        why = fault.message
        raise StructureError(
            Sentence("{place} of the linkage, {value}, {why}.", place=place, value=fault.value, why=why)
        )


@dataclass(frozen=True, slots=True)
class Fields:
    """Inertia and torques at angles, all of the shape (cases, panels, nodes).

    Attributes
    ----------
    inertia, slope : arrays
        I in kg*m^2 and dI/dphi.
    drive, resistance : arrays
        M_d and M_r as given, in N*m; M_d is zero where it is still to be determined.
    operation : array
        The part of M_r that operations have, without weights and springs.
    """

    inertia: Floats
    slope: Floats
    drive: Floats
    resistance: Floats
    operation: Floats

    def less(self, torque: Floats) -> "Fields":
        """The same without a ``torque`` of the operations."""
        return replace(self, resistance=self.resistance - torque, operation=self.operation - torque)


class Machine:
    """A structure with the numbers of a block of cases.

    Attributes
    ----------
    parts : tuple of ShaftPart
        Its mechanisms with their operations; exactly one unless the structure lists several.
    pace : array, shape (cases or 1, 1, 1)
        A speed of the shaft in rad/s of the right size: the required mean speed, or that of the motor without load.
    """

    def __init__(self, spec: MachineSpec, columns: Columns) -> None:
        self.spec, self.columns = spec, columns
        self.cycle = _TURN * spec.cycle
        self.constants = columns.under("constants.")
        self.train = Train.of(spec.drive, columns.values)
        given = spec.balance != "motor"
        self.pace = columns.values["mean_speed"] if given else free_speed(spec.drive, columns.values) / self.train.ratio
        self.parts = tuple(
            ShaftPart(part, prefix, spec.cycle, columns, self.pace) for prefix, part in spec.every_part()
        )
        table, formula = spec.drive.table, spec.drive.formula
        self._drive_curve = (
            periodic(table, self.cycle) if given and spec.drive.form == "table" and table is not None else None
        )
        names = ("phi", *spec.constants)
        self._drive_formula = Expression(formula or "", names) if given and spec.drive.form == "formula" else None

    def unassembled(self) -> Floats:
        """First angle at which a mechanism cannot be assembled, NaN where all always can; shape (cases,)."""
        return reduce(np.fmin, (part.unassembled() for part in self.parts))

    def broken_rule(self) -> tuple[str, Sentence | None]:
        """Of the first case, the prefix of the first part that cannot be assembled, and the condition it violates.

        The condition is None where the links are merely too short.
        """
        angles = [float(part.unassembled()[0]) for part in self.parts]
        part = self.parts[0 if np.isnan(angles).all() else int(np.nanargmin(angles))]
        return part.prefix, part.broken_rule()

    def _environment(self, phi: Floats) -> dict[str, tuple[Floats, Floats | float]]:
        return {"phi": (phi, np.ones(1)), **{name: (value, 0.0) for name, value in self.constants.items()}}

    def breaks(self) -> list[Floats]:
        """Angles at which the quadrature is cut, arrays of shape (cases or 1, n); NaN is none."""
        breaks = [angles for part in self.parts for angles in part.breaks()]
        if self._drive_curve is not None:
            breaks.append(np.mod(self._drive_curve.knots, self.cycle)[None, :])
        if self._drive_formula is not None:
            breaks += formula_breaks(self._drive_formula, self._environment, self.spec.cycle)
        return breaks

    def given_breaks(self) -> list[Floats]:
        """Those of ``breaks`` that the rows of tables and the ends of steps give."""
        breaks = [angles for part in self.parts for angles in part.given_breaks()]
        if self._drive_curve is not None:
            breaks.append(np.mod(self._drive_curve.knots, self.cycle)[None, :])
        return breaks

    def formulas(self) -> list[Formula]:
        """The formulas of the fields, except of torques that balancing replaces."""
        own = [formula for part in self.parts for formula in part.formulas()]
        replaced = self.spec.balance_side if self.spec.balance == "constant" else None
        if replaced == "operation":
            own = [formula for formula in own if formula.part != "resistance"]
        drive = None if replaced == "drive" else self._drive_formula
        if drive is not None:
            used = {name: value for name, value in self.constants.items() if name in drive.used}
            own.append(Formula("drive", drive, used))
        return own

    @property
    def motor(self) -> dict[str, Floats]:
        """Numbers of the motor as it acts on the main shaft."""
        return self.train.motor(self.columns.under("drive.motor."))

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

    @property
    def follows_speed(self) -> bool:
        """Whether the torque of an operation follows the speed: whether its formula uses ``omega``."""
        return any(part.follows_speed for part in self.parts)

    def speed_law(self, phi: Floats) -> SpeedLaw:
        """The sum of the torques of the operations that follow the speed, at ``phi`` (cases or 1, panels, nodes).

        Of one case, it takes any number of speeds along the first axis.
        """
        laws = [part.speed_law(phi) for part in self.parts if part.follows_speed]
        shape = (self.columns.cases, *phi.shape[1:])

        def law(omega: Floats) -> tuple[Floats, Floats]:
            torque, slope = (reduce(np.add, same) for same in zip(*(own(omega) for own in laws), strict=True))
            whole = np.broadcast_shapes(shape, omega.shape)
            return np.broadcast_to(torque, whole), np.broadcast_to(slope, whole)

        return law

    def fields(self, phi: Floats, omega: Floats | None = None) -> Fields:
        """Inertia and torques, none of it at a jump.

        Parameters
        ----------
        phi : array, shape (cases or 1, panels, nodes)
            In rad.
        omega : array of that shape, optional
            Speeds there in rad/s, for operations that follow the speed; by default ``pace``.
        """
        own = [part.fields(phi, omega) for part in self.parts]
        inertia, slope, resistance, operation = (reduce(np.add, same) for same in zip(*own, strict=True))
        shape = (self.columns.cases, *phi.shape[1:])
        resistance = resistance - self.columns.values["friction_torque"]
        fields = (inertia + self.train.inertia, slope, self._drive(phi), resistance, operation)
        return Fields(*(np.ascontiguousarray(np.broadcast_to(field, shape)) for field in fields))

    def inertia_jumps(self) -> list[Jumps]:
        """Where a formula of the inertia of each part jumps first in the part's own cycle."""
        return [part.inertia_jumps(self.train.inertia) for part in self.parts]

    def check_closed(self) -> None:
        """Refuse a formula of the inertia that jumps somewhere in the cycle (of the first case).

        Raises
        ------
        ExpressionError
        """
        for part, jumps in zip(self.parts, self.inertia_jumps(), strict=True):
            angle, before, after = (float(values[0]) for values in jumps)
            if np.isnan(angle):
                continue
            end = min(angle, part.cycle - angle) < 1e-6
            message = (
                Sentence(
                    "The inertia does not close on itself: it begins with {after} and ends, a cycle later, with "
                    "{before} (the drive's with it). Only a torque may jump.",
                    after=amount(after, "kg*m^2"),
                    before=amount(before, "kg*m^2"),
                )
                if end
                else Sentence(
                    "The inertia jumps at {angle} from {before} to {after} (the drive's with it). Only a torque may "
                    "jump.",
                    angle=amount(np.degrees(angle), "deg"),
                    before=amount(before),
                    after=amount(after, "kg*m^2"),
                )
            )
            raise ExpressionError(message, None, f"{part.prefix}mechanism")

    def check_finite(self) -> None:
        """Refuse a formula whose value is not finite somewhere in the cycle (of the first case).

        Raises
        ------
        ExpressionError
        """
        phi = np.asarray((np.arange(720 * self.spec.cycle) + 0.5) * np.pi / 360.0, dtype=np.float64)[None, None, :]
        courses: list[tuple[str, Sentence, Floats]] = []
        with np.errstate(all="ignore"):
            for part in self.parts:
                own = part.fields(phi)
                courses.append((f"{part.prefix}mechanism", _INERTIA, own.inertia))
                courses.append((f"{part.prefix}operation", Sentence("The torque of the operation"), own.resistance))
            courses.append(("drive", _DRIVE, self._drive(phi)))
        for place, name, values in courses:
            wrong = ~np.isfinite(np.broadcast_to(values, (self.columns.cases, 1, phi.size))[0, 0])
            if wrong.any():
                angle = Amount(float(np.degrees(phi[0, 0, int(np.argmax(wrong))])), "deg", 4)
                message = Sentence("{part} is not a finite number at {angle}.", part=name, angle=angle)
                raise ExpressionError(message, None, place)
