"""The structure of a machine: everything except its numbers, which are given as columns by path in a spec."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Literal, get_args

from sprag_study.engine.machine_shaft.cams import CamLaw
from sprag_study.engine.machine_shaft.elements import LinkageChoice
from sprag_study.engine.machine_shaft.tables import Interpolation, Table

MeanSpeed = Literal["midrange", "angle", "time"]
Balance = Literal["scale", "constant", "refuse", "motor"]
BalanceSide = Literal["drive", "operation"]
Motor = Literal["linear", "kloss", "table"]
Flywheel = Literal["rim", "disc", "ring"]
Stage = Literal["gear", "belt", "chain", "worm", "screw_nut", "rack", "coupling"]
MechanismKind = Literal[
    "none", "table", "formula", "slider_crank", "scotch_yoke", "four_bar", "parallel_crank",
    "quick_return", "drag_link", "toggle", "cam", "linkage",
]  # fmt: skip
Weights = Literal["ram", "all"]
Bodies = Literal["full", "two_mass"]
QuickReturn = Literal["whitworth", "crank_shaper"]
Form = Literal["constant", "table", "formula", "steps"]
Quantity = Literal["none", "torque", "force", "gas", "pressure"]
Over = Literal["angle", "stroke"]
During = Literal["forward", "return", "both"]
Sense = Literal["resisting", "fixed"]
EfficiencyIs = Literal["power", "work"]

#: Mechanisms with dimensions: those whose working part a force can act on.
LINKED: frozenset[str] = frozenset(get_args(MechanismKind)) - {"none", "table", "formula"}
#: Stages that move a mass beside the shaft on which they sit.
MOVING: frozenset[str] = frozenset({"screw_nut", "rack"})
MAX_STAGES = 16
MAX_STEPS = 32
#: Harmonics of the cycle whose amplitudes are results.
HARMONICS = 6
MAX_CONSTANTS = 32
MAX_PARTS = 16
REVOLUTIONS = tuple(range(1, 61))


@dataclass(frozen=True, slots=True)
class Drive:
    """The driving torque: ``drive.torque`` (constant), or a table or formula over the angle, or a motor.

    ``table`` is also that of a motor of the kind "table": its torque (N*m) over its speed (rad/s).
    ``stages`` are the kinds of the stages between motor and main shaft, motor first; the torque is then the motor's.
    ``flywheel`` is the shape of one that is given by its dimensions; it sits on the main shaft, or on the input shaft
    of the stage with the number ``flywheel_shaft``.
    """

    form: Literal["constant", "table", "formula"] = "constant"
    table: Table | None = None
    formula: str | None = None
    motor: Motor | None = None
    stages: tuple[Stage, ...] = ()
    flywheel: Flywheel | None = None
    flywheel_shaft: int | None = None


@dataclass(frozen=True, slots=True)
class MechanismChoice:
    """Which mechanism; ``table`` and ``formula`` give I''(phi) in kg*m^2.

    A table of at most one revolution repeats every revolution. ``linkage`` are the links of the kind "linkage".
    ``weights`` "all" adds those of rods, couplers, blocks
    and trays to that of the ram; ``bodies`` "two_mass" replaces rods and couplers by masses on their two pins.
    """

    kind: MechanismKind = "none"
    table: Table | None = None
    formula: str | None = None
    quick_return: QuickReturn = "crank_shaper"
    rise: CamLaw = "cycloidal"
    fall: CamLaw = "cycloidal"
    weights: Weights = "ram"
    bodies: Bodies = "full"
    linkage: LinkageChoice | None = None


@dataclass(frozen=True, slots=True)
class OperationChoice:
    """The resistance of the operation.

    Attributes
    ----------
    quantity : {"none", "torque", "force", "gas", "pressure"}
        Torque on the shaft (N*m, positive where it resists), force on the mechanism's working part (N), a gas
        compressed by it, or the pressure of a gas on it as a table (Pa; over the stroke its rows go to and fro).
    form : {"constant", "table", "formula", "steps"}
        How a torque or force is given.
    over : {"angle", "stroke"}
        Against the shaft's angle (rad, over the whole cycle), or the completed fraction 0 .. 1 of the stroke, measured
        from the start of the forward stroke.
    during : {"forward", "return", "both"}
        The strokes in which a diagram over the stroke holds.
    sense : {"resisting", "fixed"}
        A positive force is against the motion in either direction, or always against the forward stroke.
    steps : int
        Number of steps.
    efficiency_is : {"power", "work"}
        Whether the efficiency is the share of the power that passes at each angle, in either direction, or of the work
        of a cycle.
    """

    quantity: Quantity = "none"
    form: Form = "constant"
    over: Over = "angle"
    during: During = "forward"
    sense: Sense = "resisting"
    table: Table | None = None
    formula: str | None = None
    steps: int = 0
    efficiency_is: EfficiencyIs = "power"


@dataclass(frozen=True, slots=True)
class PartChoice:
    """A mechanism with its operation, one of several on a main shaft or on shafts geared to it.

    Its angle is ``i*phi + parts.N.crank_angle``, counted over its own cycle, for the mechanism and the operation alike;
    i is the speed of its shaft over that of the main shaft.

    Attributes
    ----------
    mechanism : MechanismChoice
    operation : OperationChoice
    turns : int, optional
        Revolutions of its shaft in a cycle of the machine, 1 to 60; by default those of the main shaft.
    cycle : int, optional
        Revolutions of its shaft after which it repeats itself, a divisor of ``turns``; by default all of them.
    """

    mechanism: MechanismChoice = field(default_factory=MechanismChoice)
    operation: OperationChoice = field(default_factory=OperationChoice)
    turns: int | None = None
    cycle: int | None = None

    def turns_in(self, cycle: int) -> int:
        """Revolutions of its shaft in a ``cycle`` of the main shaft."""
        return cycle if self.turns is None else self.turns

    def cycle_in(self, cycle: int) -> int:
        """Revolutions of its shaft after which it repeats itself, in a ``cycle`` of the main shaft."""
        return self.turns_in(cycle) if self.cycle is None else self.cycle


@dataclass(frozen=True, slots=True)
class MachineSpec:
    """A machine's structure.

    Attributes
    ----------
    cycle : int
        Revolutions of a cycle, 1 to 60.
    mean_speed_is : {"midrange", "angle", "time"}
        Which mean of the speed the required mean speed and the irregularity refer to.
    balance : {"scale", "constant", "refuse", "motor"}
        How the work over a cycle is made zero.
    balance_side : {"drive", "operation"}
        Which torque "constant" replaces and "scale" multiplies: the drive's, or that of all operations.
    drive : Drive
    mechanism, operation :
        Those of a machine without ``parts``.
    parts : tuple of PartChoice
        Several mechanisms, each with its operation, at its crank angle and on its shaft; 1 to 16, or none.
    constants : tuple of str
        Names used in its formulas besides ``phi`` (and ``x``, the fraction of the stroke); given as ``constants.NAME``.
    phi_c : int, optional
        The angle, among those with T = T_mean, from which S3 and S4 count; by default the first at which T rises.
    """

    cycle: int = 1
    mean_speed_is: MeanSpeed = "midrange"
    balance: Balance = "constant"
    drive: Drive = field(default_factory=Drive)
    mechanism: MechanismChoice = field(default_factory=MechanismChoice)
    operation: OperationChoice = field(default_factory=OperationChoice)
    constants: tuple[str, ...] = ()
    phi_c: int | None = None
    balance_side: BalanceSide = "drive"
    parts: tuple[PartChoice, ...] = ()

    def every_part(self) -> tuple[tuple[str, PartChoice], ...]:
        """The mechanisms with their operations, each with the prefix of its paths: ``parts.0.``, or none for one."""
        if not self.parts:
            return (("", PartChoice(self.mechanism, self.operation)),)
        return tuple((f"parts.{k}.", part) for k, part in enumerate(self.parts))

    def to_json(self) -> dict[str, Any]:
        """Plain data that ``from_json`` reads."""
        data = asdict(self)
        data["constants"] = list(self.constants)
        data["drive"]["stages"] = list(self.drive.stages)
        parts = data.pop("parts")
        if parts:
            data["parts"] = list(parts)
        for own in (data, *parts):
            for name in _TABLED & set(own):
                table = own[name]["table"]
                if table is not None:
                    table["rows"] = [list(row) for row in table["rows"]]
        mechanisms = (self.mechanism, *(part.mechanism for part in self.parts))
        for own, mechanism in zip((data, *parts), mechanisms, strict=True):
            linkage = mechanism.linkage
            own["mechanism"]["linkage"] = None if linkage is None else linkage.to_json()
        return data

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> "MachineSpec":
        """The spec of ``to_json``'s data; TypeError where a field is unknown."""
        fields = _choices(data)
        fields["constants"] = tuple(fields.get("constants", ()))
        fields["parts"] = tuple(PartChoice(**_choices(part)) for part in fields.get("parts", ()))
        return cls(**fields)


_CHOICES = {"drive": Drive, "mechanism": MechanismChoice, "operation": OperationChoice}
_TABLED = frozenset(_CHOICES)


def _choices(data: Mapping[str, Any]) -> dict[str, Any]:
    """The fields of ``data`` with drive, mechanism and operation as what they are."""
    fields = dict(data)
    for name, choice in _CHOICES.items():
        if name in fields:
            own = dict(fields[name])
            if own.get("table") is not None:
                own["table"] = _table(own["table"])
            if "stages" in own:
                own["stages"] = tuple(own["stages"])
            if own.get("linkage") is not None:
                own["linkage"] = LinkageChoice.from_json(own["linkage"])
            fields[name] = choice(**own)
    return fields


def _table(data: Mapping[str, Any]) -> Table:
    interpolation: Interpolation = data.get("interpolation", "smooth")
    return Table(tuple((float(x), float(y)) for x, y in data["rows"]), interpolation)
