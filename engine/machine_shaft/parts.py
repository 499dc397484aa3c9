"""A mechanism on the main shaft with its operation, at its crank angle: its inertia and its torques on the shaft.

A machine has one such part or several. The angle of a part is that of the shaft, times the ratio of its own shaft,
plus its crank angle, counted over its cycle: the mechanism stands at that angle, and the diagram of the operation is
read at it.
"""

from collections.abc import Mapping
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine import elementary
from sprag_study.engine.formulas.expressions import MEAN_SPEED, Expression
from sprag_study.engine.machine_shaft.bearings import JointForces, joint_forces
from sprag_study.engine.machine_shaft.cams import Cam
from sprag_study.engine.machine_shaft.columns import Columns
from sprag_study.engine.machine_shaft.four_bars import FourBar, ParallelCrank
from sprag_study.engine.machine_shaft.joints import Reactions, reactions
from sprag_study.engine.machine_shaft.linkages import CrankShaper, ScotchYoke, SliderCrank, Whitworth
from sprag_study.engine.machine_shaft.linked_rams import DragLink, Toggle
from sprag_study.engine.machine_shaft.mechanisms import Mechanism, Motion, RodMechanism, Values
from sprag_study.engine.machine_shaft.operations import Operation, SpeedLaw, every_revolution, formula_breaks
from sprag_study.engine.machine_shaft.panels import Panels
from sprag_study.engine.machine_shaft.pieces import Formula
from sprag_study.engine.machine_shaft.planar import PlanarLinkage
from sprag_study.engine.machine_shaft.problems import TableError, amount
from sprag_study.engine.machine_shaft.spec import MechanismChoice, MechanismKind, PartChoice
from sprag_study.engine.machine_shaft.strokes import Stroke
from sprag_study.engine.machine_shaft.tables import Curve, periodic
from sprag_study.sentences import Sentence

Floats = NDArray[np.float64]

_TURN = 2.0 * np.pi
#: Panels per revolution over which the mean torque of an operation is taken, beside its own cuts.
_LOSS_PANELS = 64


#: Mechanisms without choices of their own.
_PLAIN: Mapping[MechanismKind, type[Mechanism]] = {
    "slider_crank": SliderCrank,
    "scotch_yoke": ScotchYoke,
    "four_bar": FourBar,
    "parallel_crank": ParallelCrank,
    "drag_link": DragLink,
    "toggle": Toggle,
}


def mechanism_of(choice: MechanismChoice) -> Mechanism | None:
    """The mechanism with dimensions, or None for none, a table or a formula."""
    if choice.kind == "quick_return":
        return Whitworth() if choice.quick_return == "whitworth" else CrankShaper()
    if choice.kind == "cam":
        return Cam(choice.rise, choice.fall)
    if choice.linkage is not None:
        return PlanarLinkage(choice.linkage)
    plain = _PLAIN.get(choice.kind)
    return None if plain is None else plain()


def _inertia_curve(choice: MechanismChoice, revolutions: int) -> Curve | None:
    table = choice.table
    if choice.kind != "table" or table is None:
        return None
    for number, (row, following) in enumerate(pairwise(table.rows), start=1):
        if row[0] == following[0]:
            angle, second = amount(row[0], "rad"), str(number + 1)
            message = Sentence(
                "Rows {first} and {second} of the inertia both have {angle}, with {before} and {after}: only a torque "
                "may jump, not an inertia.",
                first=str(number),
                second=second,
                angle=angle,
                before=amount(row[1]),
                after=amount(following[1], "kg*m^2"),
            )
            raise TableError(message, angle, Sentence("more than {low} in row {row}", low=angle, row=second))
    within_one = len(table.rows) > 0 and table.rows[-1][0] - table.rows[0][0] <= _TURN * (1.0 + 1e-9)
    return periodic(table, _TURN if within_one else _TURN * revolutions)


def _two_masses(values: Values) -> dict[str, Floats]:
    """Inertias m s (L - s) of rod and coupler about their centres, which are those of two masses on their pins."""
    found = {}
    for name in {"rod", "coupler"} & set(values):
        centre = values[f"{name}_centre"]
        found[f"{name}_inertia"] = np.asarray(values[f"{name}_mass"] * centre * (values[name] - centre))
    return found


class PartFields(NamedTuple):
    """A part at angles of the shaft; arrays that broadcast to (cases, panels, nodes).

    Attributes
    ----------
    inertia, slope : arrays
        I'' in kg*m^2 and dI''/dphi.
    resistance : array
        Torque of the operation, the weight and the spring on the shaft in N*m, negative where it resists.
    operation : array
        Torque of the operation alone.
    """

    inertia: Floats
    slope: Floats
    resistance: Floats
    operation: Floats


class Jumps(NamedTuple):
    """Jumps of the inertia, one a case: the angle in rad, and the values there in kg*m^2; NaN where there is none."""

    angle: Floats
    before: Floats
    after: Floats

    @classmethod
    def none(cls, cases: int) -> "Jumps":
        """No jump in any of the cases."""
        return cls(*(np.full(cases, np.nan) for _ in range(3)))


class ShaftPart:
    """A mechanism with its operation, and the numbers of a block of cases.

    Parameters
    ----------
    choice : PartChoice
    prefix : str
        Of the paths of its numbers: ``parts.0.``, or empty for the only one of a machine.
    revolutions : int
        Of a cycle of the main shaft.
    columns : Columns
        Of the machine.
    pace : array, shape (cases or 1, 1, 1)
        Speed of the main shaft in rad/s for formulas where no other is given.

    Attributes
    ----------
    cycle : float
        Angle in rad of the part's shaft after which the part repeats itself.
    ratio : float
        Speed of the part's shaft over that of the main shaft.
    """

    def __init__(self, choice: PartChoice, prefix: str, revolutions: int, columns: Columns, pace: Floats) -> None:
        self.choice, self.prefix, self.cases = choice, prefix, columns.cases
        self.ratio = choice.turns_in(revolutions) / revolutions
        self._revolutions = choice.cycle_in(revolutions)
        self._repeats, self.cycle = choice.turns_in(revolutions) // self._revolutions, _TURN * self._revolutions
        self._ahead = columns.values[f"{prefix}crank_angle"] if prefix else None
        self._gravity, self._constants = columns.values["gravity"], columns.under("constants.")
        self.mechanism = mechanism_of(choice.mechanism)
        self.values = columns.under(f"{prefix}mechanism.{choice.mechanism.kind}.")
        if choice.mechanism.bodies == "two_mass":
            self.values |= _two_masses(self.values)
        if self.mechanism is not None:
            self.values |= self.mechanism.prepared(self.values)
        self._curve = _inertia_curve(choice.mechanism, revolutions)
        names, text = ("phi", *self._constants), choice.mechanism.formula or ""
        self.inertia_formula = Expression(text, names) if choice.mechanism.kind == "formula" else None
        self._stroke = None if self.mechanism is None else Stroke.of(self.mechanism, self.values)
        own = columns.under(f"{prefix}operation.")
        self._pace = self.ratio * pace
        self._operation = Operation(choice.operation, self._revolutions, own, self._constants, self._stroke, self._pace)

    def own_angle(self, phi: Floats) -> Floats:
        """Angle of the part, 0 .. cycle, at angles of the shaft."""
        return phi if self._ahead is None else np.asarray(np.mod(self.ratio * phi + self._ahead, self.cycle))

    def shaft_angle(self, own: Floats) -> Floats:
        """Angles of the shaft in its cycle at angles of the part (cases or 1, n): all at which the part stands so."""
        if self._ahead is None:
            return own
        back, whole = own - self._ahead[:, 0, :], self.cycle * self._repeats
        every = [np.mod(back + self.cycle * k if k else back, whole) / self.ratio for k in range(self._repeats)]
        return np.concatenate(every, axis=1)

    def unassembled(self) -> Floats:
        """First angle of the shaft at which the mechanism cannot be assembled, (cases,); NaN where it always can."""
        if self.mechanism is None:
            return np.full(self.cases, np.nan)
        return np.broadcast_to(self.mechanism.unassembled(self.values, self._ahead) / self.ratio, (self.cases,))

    def broken_rule(self) -> Sentence | None:
        """The condition that the dimensions of the first case violate; None where its links are merely too short."""
        return None if self.mechanism is None else self.mechanism.broken_rule(self.values)

    def _environment(self, own: Floats) -> dict[str, tuple[Floats, Floats | float]]:
        return {"phi": (own, np.ones(1)), **{name: (value, 0.0) for name, value in self._constants.items()}}

    def _torque_breaks(self) -> list[Floats]:
        """Angles of the part at which its torque has a kink or a jump, (cases or 1, n); NaN is none."""
        breaks = list(self._operation.breaks)
        if self._stroke is not None and self.mechanism is not None:
            own = [self._stroke.start, self._stroke.end, *self.mechanism.breaks(self.values)]
            breaks += [every_revolution(angle, self._revolutions) for angle in own]
        return breaks

    @cached_property
    def _even_loss(self) -> Floats:
        """Torque in N*m that the losses of the operation's work take at every angle, shape (cases, 1, 1)."""
        count = _LOSS_PANELS * self._revolutions
        panels = Panels.over(self.cycle, self._torque_breaks(), count, self._operation.given_breaks())
        motion = None if self.mechanism is None else self.mechanism.motion(self.values, panels.angles)
        torque = self._operation.lossless(panels.angles, None if motion is None else motion.way_slope)
        shaped = np.ascontiguousarray(np.broadcast_to(torque, (self.cases, *panels.angles.shape[1:])))
        return self._operation.even_loss(panels.integral(shaped)[:, None, None] / self.cycle)

    def breaks(self) -> list[Floats]:
        """Angles of the shaft at which inertia or torque has a kink or a jump, (cases or 1, n); NaN is none."""
        breaks = self._torque_breaks()
        if self._curve is not None:
            period = float(self._curve.knots[-1] - self._curve.knots[0])
            repeats = round(self.cycle / period)
            knots = np.mod(self._curve.knots, period)
            breaks.append(np.concatenate([knots + period * k for k in range(repeats)])[None, :])
        if self.inertia_formula is not None:
            breaks += formula_breaks(self.inertia_formula, self._environment, self._revolutions)
        if self._ahead is None:
            return breaks
        # A formula need not repeat itself: the end of the part's own cycle is a cut, too.
        return [self.shaft_angle(angles) for angles in (*breaks, np.zeros((1, 1)))]

    @property
    def turned(self) -> bool:
        """Whether its angle is not that of the shaft."""
        return self._ahead is not None

    def given_breaks(self) -> list[Floats]:
        """Angles of the shaft that are given for its operation, (cases or 1, n); NaN is none."""
        return [
            angles if self._ahead is None else self.shaft_angle(angles) for angles in self._operation.given_breaks()
        ]

    def formulas(self) -> list[Formula]:
        """The formulas of its inertia and its resistance."""
        own = (("inertia", self.inertia_formula), ("resistance", self._operation.expression))
        known = {"omega": self._pace, MEAN_SPEED: self._pace} | self._constants
        return [
            Formula(
                "inertia" if field == "inertia" else "resistance", expression,
                {name: value for name, value in known.items() if name in expression.used},
                self._stroke if "x" in expression.used else None, self._ahead, self.cycle, self.ratio,
            )
            for field, expression in own if expression is not None
        ]  # fmt: skip

    def motion(self, phi: Floats) -> Motion | None:
        """The mechanism at angles of the main shaft, reduced to it; None for one without dimensions."""
        own = self._own_motion(phi)
        if own is None or self.ratio == 1.0:
            return own
        square = self.ratio * self.ratio
        return Motion(
            square * own.inertia, square * self.ratio * own.inertia_slope, own.way, self.ratio * own.way_slope
        )

    def _own_motion(self, phi: Floats) -> Motion | None:
        """The mechanism at angles of the main shaft, by the angle of its own shaft; None for one without dimensions."""
        return None if self.mechanism is None else self.mechanism.motion(self.values, self.own_angle(phi))

    @property
    def follows_speed(self) -> bool:
        """Whether the formula of its operation uses the speed of its shaft, ``omega``."""
        return self._operation.follows_speed

    @property
    def uses_time(self) -> bool:
        """Whether the formula of its operation uses ``t``."""
        return self._operation.uses_time

    @property
    def loses(self) -> bool:
        """Whether power is lost on the way to the operation, so that its torque has a kink where its sign changes."""
        return self._operation.loses

    @property
    def switch_count(self) -> int:
        """Number of switches of the formula of the operation."""
        return self._operation.expression.switch_count if self._operation.expression is not None else 0

    def switch(self, index: int, phi: Floats, omega: Floats) -> Floats:
        """A switch of an operation that follows the speed: a value whose sign changes where its formula has a kink.

        ``phi`` are angles of the main shaft, and ``omega`` its speeds there in rad/s, both of shape (cases, panels,
        nodes).
        """
        return self._operation.switch(index, self.own_angle(phi), self.ratio * omega)

    def speed_law(self, phi: Floats) -> SpeedLaw:
        """The torque of an operation that follows the speed, at angles of the shaft (cases or 1, panels, nodes)."""
        motion = self._own_motion(phi)
        own = self._operation.speed_law(self.own_angle(phi), None if motion is None else motion.way_slope)
        if self.ratio == 1.0:
            return own

        def law(omega: Floats) -> tuple[Floats, Floats]:
            torque, slope = own(self.ratio * omega)
            return self.ratio * torque, self.ratio * self.ratio * slope

        return law

    def fields(self, phi: Floats, omega: Floats | None = None) -> PartFields:
        """Inertia and torque at angles of the shaft, none of them at a jump.

        Parameters
        ----------
        phi : array, shape (cases or 1, panels, nodes)
            In rad.
        omega : array of that shape, optional
            Speeds of the main shaft there in rad/s, for an operation that follows the speed; by default ``pace``.
        """
        own = self.own_angle(phi)
        motion = None if self.mechanism is None else self.mechanism.motion(self.values, own)
        inertia, slope = self._inertia(own, motion)
        way_slope = None if motion is None else motion.way_slope
        if omega is not None and self.follows_speed:
            torque = self._operation.speed_law(own, way_slope)(self.ratio * omega)[0]
        else:
            torque = self._operation.torque(own, way_slope)
            if self._operation.loses_evenly:
                torque = torque - self._even_loss
        resistance = torque + self._carried(own, motion)
        if self.ratio == 1.0:
            return PartFields(inertia, slope, resistance, torque)
        square = self.ratio * self.ratio
        return PartFields(square * inertia, square * self.ratio * slope, self.ratio * resistance, self.ratio * torque)

    def joint_forces(
        self, phi: Floats, squares: Floats, acceleration: Floats, omega: Floats | None, factor: float | Floats
    ) -> JointForces:
        """Forces in the joints of a slider-crank at angles of the shaft, with a ``factor`` on its operation.

        ``squares`` (rad^2/s^2) and ``acceleration`` (rad/s^2) are omega^2 and the acceleration of the shaft there; the
        other parameters are as in ``fields``.
        """
        own, motion = self.own_angle(phi), self._own_motion(phi)
        assert motion is not None
        push = self.push(phi, motion.way_slope, omega, factor)
        squares, acceleration = self.ratio * self.ratio * squares, self.ratio * acceleration
        rods = self._gravity if self.choice.mechanism.weights == "all" else 0.0 * self._gravity
        return joint_forces(self.values, own, squares, acceleration, push, self._gravity, rods)

    def push(self, phi: Floats, way_slope: Floats, omega: Floats | None, factor: float | Floats) -> Floats:
        """Force of the operation on the working part along its forward stroke in N; parameters as of ``joint_forces``.

        ``way_slope`` is that of ``motion``, of which the sign counts.
        """
        own = None if omega is None else self.ratio * omega
        return factor * self._operation.push(self.own_angle(phi), way_slope, own)

    @property
    def works(self) -> bool:
        """Whether its mechanism has a working part: a linkage may have none."""
        linkage = self.choice.mechanism.linkage
        return self.mechanism is not None and (linkage is None or bool(linkage.working))

    @property
    def stroke(self) -> Stroke | None:
        """The strokes of its mechanism; None for one without dimensions."""
        return self._stroke

    def reactions(
        self, phi: Floats, squares: Floats, acceleration: Floats, omega: Floats | None, factor: float | Floats
    ) -> Reactions:
        """Forces in the joints of a planar linkage; the parameters are those of ``joint_forces``."""
        own, motion = self.own_angle(phi), self._own_motion(phi)
        assert motion is not None
        assert isinstance(self.mechanism, PlanarLinkage)
        push = self.push(phi, motion.way_slope, omega, factor)
        squares, acceleration = self.ratio * self.ratio * squares, self.ratio * acceleration
        return reactions(self.mechanism, self.values, own, squares, acceleration, push, self._gravity)

    def _inertia(self, own: Floats, motion: Motion | None) -> tuple[Floats, Floats]:
        if motion is not None:
            return motion.inertia, motion.inertia_slope
        if self._curve is not None:
            return self._curve(own), self._curve.slope(own)
        if self.inertia_formula is not None:
            value, slope = self.inertia_formula.evaluate(self._environment(own))
            return np.asarray(value), np.asarray(slope)
        return np.zeros(1), np.zeros(1)

    def _carried(self, own_angle: Floats, motion: Motion | None) -> Floats:
        """Torque of the weights and of the spring on the working part."""
        every = self.choice.mechanism.weights == "all" or self.choice.mechanism.kind == "linkage"
        if every and isinstance(self.mechanism, RodMechanism):
            return np.asarray(-self._gravity * self.mechanism.lift(self.values, own_angle))
        if motion is None or self.mechanism is None or self.mechanism.ram_mass is None:
            return np.zeros(1)
        own = self.values
        force = own[self.mechanism.ram_mass] * self._gravity * elementary.sin(own["inclination"])
        if self.choice.mechanism.kind == "cam":
            force = force + own["spring_preload"] + own["spring_rate"] * motion.way
        return np.asarray(-force * motion.way_slope)

    def inertia_jumps(self, beside: Floats) -> Jumps:
        """Where a formula of the inertia jumps first, within the cycle or from its end to its start.

        Parameters
        ----------
        beside : array, shape (cases or 1, 1, 1)
            Inertia in kg*m^2 that is added to that of the part.
        """
        jumps = Jumps.none(self.cases)
        if self.inertia_formula is None:
            return jumps
        ends = np.array([[[0.0, self.cycle]]])
        square = self.ratio * self.ratio
        exact = square * self._inertia(ends, None)[0] + beside + np.zeros_like(ends)  # a constant formula has one value
        angles = [np.zeros((1, 1))]
        angles += [np.sort(found, axis=1)
                   for found in formula_breaks(self.inertia_formula, self._environment, self._revolutions)]  # fmt: skip
        for found in angles:
            for column in range(found.shape[1]):
                angle = found[:, column][:, None, None]
                closing = np.minimum(angle, self.cycle - angle) < 1e-6
                left, right = np.where(closing, self.cycle, angle), np.where(closing, 0.0, angle)
                before, after = self._limits(left, right, beside)
                # Smooth parts are compared directly; a root has an infinite slope at a kink, but no jump.
                apart = np.abs(exact[..., :1] - exact[..., 1:]) > 1e-9 * np.abs(exact[..., :1])
                least = np.where(closing & apart, 1e-9, 1e-6)
                jump = np.abs(after - before) > least * np.maximum(np.abs(before), np.abs(after))
                first = (jump & ~np.isnan(angle))[:, 0, 0] & ~(jumps.angle <= angle[:, 0, 0])
                for kept, value in ((jumps.angle, angle), (jumps.before, before), (jumps.after, after)):
                    kept[first] = np.broadcast_to(value[:, 0, 0], first.shape)[first]
        return jumps

    def _limits(self, left: Floats, right: Floats, beside: Floats) -> tuple[Floats, Floats]:
        """Inertia as the part's angle comes to ``left`` from below and to ``right`` from above; all (cases, 1, 1)."""
        near = 1e-12 * self.cycle
        with np.errstate(all="ignore"):
            (below, rise), (above, fall) = self._inertia(left - near, None), self._inertia(right + near, None)
            square = self.ratio * self.ratio
            return (square * below + beside) + square * near * rise, (square * above + beside) - square * near * fall
