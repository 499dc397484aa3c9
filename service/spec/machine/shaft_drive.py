"""The drive of a machine shaft in a spec: torque, motor and stages, and the balance of its work."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from sprag.sentences import Sentence
from sprag.service.spec.described import Listed, choice
from sprag.service.spec.fields import read_object, read_one, values_of
from sprag.service.spec.machine.shaft_parts import (
    ANGLE,
    numbers_of,
    numbers_under,
    read_diagram,
    refuse_foreign,
    value_in,
)
from sprag.service.spec.node import Node
from sprag.service.spec.report import Report, join
from sprag.worker.models import Parameter, machine_shaft

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
_OF_TABLE: Final = ("table", "csv", "interpolation")
FLYWHEEL: Final = choice("kind", "shape of the flywheel: a thin rim or a solid disc", "rim", "disc")
STAGE: Final = choice("kind", "kind of the stage", *machine_shaft.STAGE_KINDS)
STAGES: Final = Listed("stages", 1, machine_shaft.MAX_STAGES, "stages between motor and main shaft, motor first")


def read_balance(report: Report, found: Mapping[str, Any], drive: Mapping[str, Any] | None) -> str | None:
    """Read how the work over a cycle is made zero; by default a motor does it, and a given torque is kept."""
    motor = drive is not None and drive["motor"] is not None
    given = isinstance(found.get("drive"), Mapping) and "torque" in found["drive"]
    side = BALANCE_SIDE.read(Node(report, "/base", found))
    if side is None or (side == "operation" and not _has_drive(report, motor, given)):
        return None
    acts = found.get("operation") is not None or found.get("parts") is not None
    default = "motor" if motor else "refuse" if given else "constant"
    if side == "operation":
        default = "scale" if acts else "constant"
    balance: str | None = BALANCE.read(Node(report, "/base", {"balance": default, **found}))
    if balance is None or drive is None:
        return balance
    if balance == "motor" and not motor:
        report.fault(
            "/base/drive/motor",
            "required",
            'is required by the balance "motor"',
            allowed="a motor: linear, kloss or table",
        )
        return None
    if balance != "motor" and motor:
        report.fault(
            "/base/balance", "conflict", "is not possible for a machine with a motor", balance, allowed="'motor'"
        )
        return None
    if balance == "scale" and side == "operation" and not acts:
        report.fault(
            "/base/operation", "required",
            'is required by the balance "scale" on its side, which multiplies it by a factor', allowed="an operation",
        )  # fmt: skip
        return None
    if balance == "scale" and not given:
        report.fault(
            "/base/drive/torque",
            "required",
            'is required by the balance "scale", which multiplies it by a factor',
            allowed="a torque, a table or a formula",
        )
        return None
    return balance


def _has_drive(report: Report, motor: bool, given: bool) -> bool:
    """Whether the drive is given, as a balance on the side of the operation needs; else a fault is recorded."""
    if motor:
        report.fault("/base/balance_side", "conflict", "is not possible with a motor: the speed follows from the load",
                     "operation", allowed="'drive', or a torque instead of the motor")  # fmt: skip
    elif not given:
        report.fault("/base/drive/torque", "required", "is required where the operation is to be found",
                     allowed="a torque, a table or a formula")  # fmt: skip
    return given and not motor


def read_drive(report: Report, data: object, places: dict[str, str]) -> dict[str, Any] | None:
    """Read the drive: the form of its torque, or its motor."""
    places["drive"] = "/base/drive"
    found = read_object(report, "/base/drive", data, ("inertia", "torque", "scale", "motor", "stages", "flywheel"))
    if found is None:
        return None
    drive: dict[str, Any] = {"form": "constant", "table": None, "formula": None, "motor": None}
    if "stages" in found:
        stages = _read_stages(report, found["stages"])
        if stages is None:
            return None
        drive["stages"] = stages
    if "flywheel" in found:
        flywheel = read_object(
            report, "/base/drive/flywheel", found["flywheel"], ("kind", *numbers_under("drive.flywheel."))
        )
        kind = None if flywheel is None else FLYWHEEL.read(Node(report, "/base/drive/flywheel", flywheel))
        if kind is None:
            return None
        drive["flywheel"] = kind
    if "motor" in found:
        if "torque" in found:
            report.fault("/base/drive/torque", "conflict", "cannot be given with a motor, which sets the torque",
                           found["torque"], allowed="a torque or a motor")  # fmt: skip
            return None
        return _read_motor(report, found["motor"], drive, places)
    torque = found.get("torque")
    if not isinstance(torque, Mapping):
        return drive
    given = read_object(report, "/base/drive/torque", torque, ("table", "csv", "formula", "interpolation"))
    diagram = None if given is None else read_diagram(report, "/base/drive/torque", given, ANGLE, value_in("N*m"))
    if diagram is None:
        return None
    form = "csv" if "csv" in torque else diagram["form"]
    places["drive"] = f"/base/drive/torque/{form}"
    return drive | diagram


def _read_stages(report: Report, data: object) -> list[str] | None:
    """Read the kinds of the stages between motor and main shaft."""
    where = "/base/drive/stages"
    before = report.found
    kinds: list[str] = []
    for index, item in enumerate(values_of(STAGES.read(Node(report, where, data))) or ()):
        pointer = join(where, index)
        found = read_object(report, pointer, item, ("kind", *numbers_under("drive.stages.K.")))
        kind = None if found is None else STAGE.read(Node(report, pointer, found))
        if found is None or kind is None:
            continue
        own = numbers_of({"drive": {"stages": [kind]}}, "drive.stages.0.")
        refuse_foreign(report, pointer, found, ("kind", *own), Sentence("a stage of the kind {kind}", kind=str(kind)))
        kinds.append(kind)
    return None if report.found > before else kinds


def _read_motor(report: Report, data: object, drive: dict[str, Any], places: dict[str, str]) -> dict[str, Any] | None:
    pointer = "/base/drive/motor"
    found = read_object(report, pointer, data, ("kind", *numbers_under("drive.motor."), *_OF_TABLE))
    if found is None:
        return None
    kind = MOTOR.read(Node(report, pointer, found))
    if kind is None:
        return None
    own = numbers_of({"balance": "motor", "drive": {"motor": kind}}, "drive.motor.")
    fields = ("kind", *own, *(_OF_TABLE if kind == "table" else ()))
    refuse_foreign(report, pointer, found, fields, Sentence("a {kind} motor", kind=str(kind)))
    if kind != "table":
        return drive | {"motor": kind}
    form = read_one(report, pointer, found, ("table", "csv"))
    diagram = None if form is None else read_diagram(report, pointer, found, _SPEED, value_in("N*m"))
    if form is None or diagram is None:
        return None
    places["drive"] = join(pointer, form)
    return drive | {"motor": kind, "table": diagram["table"]}
