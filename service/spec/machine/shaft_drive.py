"""The drive of a machine shaft in a spec: torque, motor and stages, and the balance of its work."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from sprag_study.sentences import Sentence
from sprag_study.service.spec.described import Described, Listed, Record, Variants, choice
from sprag_study.service.spec.machine.shaft_numbers import numbers_of, numbers_under, refuse_foreign
from sprag_study.service.spec.machine.shaft_parts import (
    ANGLE,
    INTERPOLATION,
    diagram_of,
    read_diagram,
    rows_of,
    value_in,
)
from sprag_study.service.spec.node import Node
from sprag_study.worker.models import Parameter, machine_shaft

BALANCE_SIDE: Final = choice(
    "balance_side", "which torque the balance makes constant or scales", "drive", "operation", default="drive"
)
_BALANCE_HELP: Final = (
    "what makes the work over a cycle zero; by default constant, refuse where a torque is given, motor where there is "
    "one"
)
BALANCE: Final = choice("balance", _BALANCE_HELP, "constant", "scale", "refuse", "motor")
MOTOR: Final = choice("kind", "kind of the motor", "linear", "kloss", "table")
#: The rows of a motor's table.
_SPEED: Final = Parameter("speed", "w", "rad/s", 0.0, 1e6, False, None, "speed of the motor")
FLYWHEEL: Final = choice(
    "kind", "shape of the flywheel: thin rim or solid disc by the mass, or ring: a rim by width and thickness",
    "rim", "disc", "ring",
)  # fmt: skip
_ON_SHAFT: Final = (
    "number of the shaft on which it sits: K is the input shaft of stage K, 0 the motor's; by default the main shaft"
)
FLYWHEEL_SHAFT: Final = Described("shaft", "", _ON_SHAFT, "whole", 0, machine_shaft.MAX_STAGES)
STAGE: Final = choice("kind", "kind of the stage", *machine_shaft.STAGE_KINDS)
_STAGE: Final = Record({"kind": STAGE, **numbers_under("drive.stages.K.")}, required=("kind",))
STAGES: Final = Listed(
    "stages", 1, machine_shaft.MAX_STAGES, "stages between motor and main shaft, motor first", item=_STAGE
)
_TABLE: Final = {**rows_of("speed (rad/s) and torque (N*m)"), "interpolation": INTERPOLATION}
_MOTOR: Final = Record(
    {"kind": MOTOR, **numbers_under("drive.motor."), **_TABLE},
    "a motor whose torque depends on its speed",
    required=("kind",),
)
_WHEEL: Final = numbers_under("drive.flywheel.")
_FLYWHEEL: Final = Record(
    {"kind": FLYWHEEL, FLYWHEEL_SHAFT.name: FLYWHEEL_SHAFT, **_WHEEL},
    "a flywheel given by its dimensions, on a shaft of the train",
    required=("kind", "diameter"),
)
_DIAGRAM: Final = Record(
    {
        **diagram_of("angle (rad) and torque (N*m)", "torque in N*m as a formula of phi (rad)"),
        "interpolation": INTERPOLATION,
    },
    "either a table or a formula",
)
_NUMBERS: Final = numbers_under("drive.")
DRIVE: Final = Record(
    {
        **_NUMBERS,
        "torque": Variants((_NUMBERS["torque"], _DIAGRAM)),
        "motor": _MOTOR,
        "stages": STAGES,
        "flywheel": _FLYWHEEL,
    },
    "what turns the shaft",
    some=("inertia", "stages", "flywheel"),
)


def read_balance(base: Node, drive: Mapping[str, Any] | None) -> str | None:
    """Read how the work over a cycle is made zero; by default a motor does it, and a given torque is kept."""
    motor = drive is not None and drive["motor"] is not None
    given, acts = "torque" in base["drive"], any(base[name].value is not None for name in ("operation", "parts"))
    side = BALANCE_SIDE.read(base)
    if side is None or (side == "operation" and not _has_drive(base, motor, given)):
        return None
    default = "motor" if motor else "refuse" if given else "constant"
    if side == "operation":
        default = "scale" if acts else "constant"
    node = base["balance"].otherwise(default)
    balance = node.choice(BALANCE.values)
    if balance is None or drive is None:
        return balance
    torque = base["drive"]["torque"]
    if balance == "motor" and not motor:
        base["drive"]["motor"].refuse("required", 'is required by the balance "motor"',
                                      allowed="a motor: linear, kloss or table")  # fmt: skip
    elif balance != "motor" and motor:
        node.refuse("conflict", "is not possible for a machine with a motor", allowed="'motor'")
    elif balance == "scale" and side == "operation" and not acts:
        base["operation"].refuse(
            "required", 'is required by the balance "scale" on its side, which multiplies it by a factor', None,
            allowed="an operation",
        )  # fmt: skip
    elif balance == "scale" and not given:
        torque.refuse("required", 'is required by the balance "scale", which multiplies it by a factor',
                      allowed="a torque, a table or a formula")  # fmt: skip
    return balance if node.sound else None


def _has_drive(base: Node, motor: bool, given: bool) -> bool:
    """Whether the drive is given, as a balance on the side of the operation needs; else a fault is recorded."""
    if motor:
        base["balance_side"].refuse("conflict", "is not possible with a motor: the speed follows from the load",
                                    allowed="'drive', or a torque instead of the motor")  # fmt: skip
    elif not given:
        base["drive"]["torque"].refuse("required", "is required where the operation is to be found",
                                       allowed="a torque, a table or a formula")  # fmt: skip
    return given and not motor


def read_drive(node: Node, places: dict[str, str]) -> dict[str, Any] | None:
    """Read the drive: the form of its torque, or its motor."""
    places["drive"] = node.pointer
    if not DRIVE.read(node):
        return None
    drive: dict[str, Any] = {"form": "constant", "table": None, "formula": None, "motor": None}
    if "stages" in node:
        drive["stages"] = _read_stages(node["stages"])
    if "flywheel" in node and drive.get("stages", ()) is not None:
        drive |= _read_flywheel(node["flywheel"], len(drive.get("stages", ())))
    if drive.get("stages", ()) is None or drive.get("flywheel", "") is None:
        return None
    torque = node["torque"]
    if "motor" in node:
        if torque.given:
            torque.refuse("conflict", "cannot be given with a motor, which sets the torque",
                          allowed="a torque or a motor")  # fmt: skip
            return None
        return _read_motor(node["motor"], drive, places)
    if not isinstance(torque.value, Mapping):
        return drive
    diagram = read_diagram(torque, ANGLE, value_in("N*m")) if _DIAGRAM.read(torque) else None
    if diagram is None:
        return None
    places["drive"] = torque["csv" if "csv" in torque else diagram["form"]].pointer
    return drive | diagram


def _read_flywheel(node: Node, stages: int) -> dict[str, Any]:
    """Read the shape of a flywheel, and its shaft where that is not the main shaft; None as shape with a fault."""
    shape = FLYWHEEL.read(node) if _FLYWHEEL.read(node) else None
    if shape is not None:
        numbers = numbers_of({"drive": {"flywheel": shape}}, "drive.flywheel.")
        fields = ("kind", FLYWHEEL_SHAFT.name, *numbers)
        refuse_foreign(node, fields, Sentence("a flywheel of the kind {kind}", kind=str(shape)))
    own = node[FLYWHEEL_SHAFT.name]
    shaft = FLYWHEEL_SHAFT.read(node) if shape is not None and own.value is not None else None
    if not own.sound:
        return {"flywheel": None}
    if shaft is not None and shaft > stages:
        text = Sentence("is no shaft of this train: {last} is its main shaft", last=str(stages))
        own.refuse("out-of-range", text, allowed=Sentence(">= {low} and <= {high}", low=0, high=stages))
        return {"flywheel": None}
    # What is on the main shaft has no number, so that studies from before there was one keep their hash.
    return {"flywheel": shape} | ({} if shaft in {None, stages} else {"flywheel_shaft": shaft})


def _read_stages(node: Node) -> list[str] | None:
    """Read the kinds of the stages between motor and main shaft."""
    kinds: list[str] = []
    for item in STAGES.read(node) or ():
        kind = STAGE.read(item) if _STAGE.read(item) else None
        if kind is not None:
            own = numbers_of({"drive": {"stages": [kind]}}, "drive.stages.0.")
            refuse_foreign(item, ("kind", *own), Sentence("a stage of the kind {kind}", kind=str(kind)))
            kinds.append(kind)
    return kinds if node.sound else None


def _read_motor(node: Node, drive: dict[str, Any], places: dict[str, str]) -> dict[str, Any] | None:
    kind = MOTOR.read(node) if _MOTOR.read(node) else None
    if kind is None:
        return None
    own = numbers_of({"balance": "motor", "drive": {"motor": kind}}, "drive.motor.")
    fields = ("kind", *own, *(_TABLE if kind == "table" else ()))
    refuse_foreign(node, fields, Sentence("a {kind} motor", kind=str(kind)))
    if kind != "table":
        return drive | {"motor": kind}
    form = node.one_of(("table", "csv"))
    diagram = None if form is None else read_diagram(node, _SPEED, value_in("N*m"))
    if form is None or diagram is None:
        return None
    places["drive"] = node[form].pointer
    return drive | {"motor": kind, "table": diagram["table"]}
