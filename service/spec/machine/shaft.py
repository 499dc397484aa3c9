"""The machine shaft of a spec (`base`): its structure, every number by its flat path, and the paths that axes can vary.

The machine as a whole is checked (`check_shaft`) once its parts could be read.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from sprag_study.sentences import Sentence
from sprag_study.service.languages import N_
from sprag_study.service.reading.texts import did_you_mean
from sprag_study.service.spec.described import Record, choice
from sprag_study.service.spec.lists import refuse_mixed
from sprag_study.service.spec.machine.machine import Machine
from sprag_study.service.spec.machine.part import read_numbers
from sprag_study.service.spec.machine.shaft_check import check_machine
from sprag_study.service.spec.machine.shaft_drive import BALANCE, BALANCE_SIDE, DRIVE, read_balance, read_drive
from sprag_study.service.spec.machine.shaft_numbers import numbers_under
from sprag_study.service.spec.machine.shaft_parts import (
    CONSTANTS,
    CYCLE,
    MECHANISM,
    OPERATION,
    PARTS,
    PHI_C,
    read_constants,
    read_cycle,
    read_mechanism,
    read_operation,
    read_parts,
)
from sprag_study.service.spec.node import Node
from sprag_study.service.spec.report import Report
from sprag_study.worker import models
from sprag_study.worker.models import machine_shaft
from sprag_study.worker.models.parameters import model_parameter

_MEAN_HELP: Final = "which mean of the speed the given mean speed and the irregularity refer to"
MEAN_SPEED_IS: Final = choice(
    "mean_speed_is", _MEAN_HELP, "midrange", "angle", "time", default="midrange", label=N_("Mean speed means"),
    called={
        "midrange": N_("middle of largest and smallest"), "angle": N_("mean over the angle"),
        "time": N_("mean over time"),
    },
)  # fmt: skip
SHAFT: Final = Record(
    {
        "cycle": CYCLE,
        "mean_speed": numbers_under("")["mean_speed"],
        "mean_speed_is": MEAN_SPEED_IS,
        "drive": DRIVE,
        "mechanism": MECHANISM,
        "operation": OPERATION,
        "parts": PARTS,
        "balance": BALANCE,
        "balance_side": BALANCE_SIDE,
        "phi_c": PHI_C,
        "constants": CONSTANTS,
        **numbers_under(""),
    },
    "the machine that every case begins from",
    required=("drive",),
)
_INDEXED = re.compile(
    r"(?:parts\.[0-9]{1,9}\.)?(operation\.steps|drive\.stages|mechanism\.linkage\.elements)\.([0-9]{1,9})\."
)
#: What is said about a step or a stage that there is not.
_NO_ITEM: Final = {
    "steps": N_("there is no step {number}: steps are numbered from 0 to {last}"),
    "stages": N_("there is no stage {number}: stages are numbered from 0 to {last}"),
    "elements": N_("there is no element {number}: elements are numbered from 0 to {last}"),
}
_PART: Final = re.compile(r"parts\.([0-9]{1,9})\.")


@dataclass
class ShaftMachine(Machine):
    """The base of a machine shaft, as far as it could be read.

    Attributes
    ----------
    places : "drive", "mechanism", "operation", "parts.0.mechanism" and so on -> JSON Pointer of its formula, its table,
        or the whole part
    """

    places: dict[str, str] = field(default_factory=dict)

    def assumed(self, path: str) -> bool:
        """Whether ``path`` may belong to a machine whose structure could not be read."""
        general = re.sub(r"^constants\..*", "constants.NAME", path)
        return self.structure is None and model_parameter(models.MACHINE_SHAFT, general) is not None

    def why_not(self, path: str) -> Sentence:
        """A sentence that explains why an axis cannot vary ``path``, and what it can vary."""
        structure = self.structure or {}
        several = structure.get("parts", ())
        part = _PART.match(path)
        if part and int(part[1]) >= len(several) > 0:
            return Sentence(
                "there is no part {number}: parts are numbered from 0 to {last}",
                number=part[1], last=str(len(several) - 1),
            )  # fmt: skip
        item = _INDEXED.match(path)
        if item and self.structure is not None:
            name = item[1].rpartition(".")[2]
            owner = several[int(part[1])] if part and several else structure
            counts = {
                "steps": int(owner["operation"]["steps"]), "stages": len(structure["drive"].get("stages", ())),
                "elements": len((owner["mechanism"].get("linkage") or {}).get("elements", ())),
            }  # fmt: skip
            if int(item[2]) >= counts[name] > 0:
                return Sentence(_NO_ITEM[name], number=item[2], last=str(counts[name] - 1))
        if path.startswith("constants.") and self.structure is not None:
            return Sentence("is not a constant of this machine{hint}", hint=did_you_mean(path, self.parameters))
        if model_parameter(models.MACHINE_SHAFT, path) is not None:
            hint = did_you_mean(path, self.parameters)
            return Sentence("is not a parameter of this machine, which has other parts{hint}", hint=hint)
        return super().why_not(path)


def read_shaft(base: Node) -> ShaftMachine:
    """Read the machine of a spec; faults are recorded."""
    machine = ShaftMachine()
    if not SHAFT.read(base):
        return machine
    structure = _read_structure(base, machine.places)
    if structure is None:
        return machine
    machine.structure = structure
    machine.parameters = machine_shaft.parameters_of(structure)
    _unused(base, structure)
    _refuse_mixed_steps(base, machine)
    read_numbers(base, machine)
    return machine


def _owners(base: Node) -> list[tuple[str, Node]]:
    """The base, and each of its parts with the beginning of its paths."""
    return [("", base), *((f"parts.{k}.", part) for k, part in enumerate(base["parts"].parts()))]


def _refuse_mixed_steps(base: Node, machine: Machine) -> None:
    """Record bare numbers in a column of steps beside quantities of another scale."""
    for prefix, owner in _owners(base):
        steps = owner["operation"]["steps"].parts()
        for names in (("from", "to"), ("value",)):
            entry = machine.parameters.get(f"{prefix}operation.steps.0.{names[0]}")
            if entry is not None:
                refuse_mixed([step[name] for step in steps for name in names if name in step], entry.unit)


def check_shaft(report: Report, machine: Machine) -> None:
    """Check the machine as a whole, all of whose parts could be read; faults are recorded in ``report``."""
    assert isinstance(machine, ShaftMachine)
    if machine.structure is not None:
        check_machine(report, machine.structure, machine.values, machine.places)


def _read_structure(base: Node, places: dict[str, str]) -> dict[str, Any] | None:
    """Read the structure as plain data; None, with the faults recorded, when some part could not be read."""
    drive = read_drive(base["drive"], places)
    mechanism = read_mechanism(base["mechanism"], places)
    operation = read_operation(base["operation"], places)
    cycle = read_cycle(base["cycle"])
    several = [] if base["parts"].value is None else read_parts(base["parts"], places, cycle)
    _refuse_both(base)
    constants = read_constants(base["constants"])
    balance, mean = read_balance(base, drive), MEAN_SPEED_IS.read(base)
    node = base["phi_c"]
    phi_c = None if node.value is None else PHI_C.read(base)
    parts = (drive, mechanism, operation, several, cycle, constants, balance, mean)
    if any(part is None for part in parts) or not node.sound:
        return None
    structure = {
        "cycle": cycle, "mean_speed_is": mean, "balance": balance, "drive": drive, "mechanism": mechanism,
        "operation": operation, "constants": constants, "phi_c": phi_c,
    }  # fmt: skip
    if base["balance_side"].value == "operation":
        structure["balance_side"] = "operation"
    return structure | {"parts": several} if several else structure


def _refuse_both(base: Node) -> None:
    """Record a mechanism or an operation beside a list of parts."""
    for name in ("mechanism", "operation"):
        if base["parts"].value is not None and base[name].value is not None:
            allowed = Sentence("{name} in each of the parts, or no parts", name=name)
            base[name].refuse("conflict", "cannot be given beside parts, which have their own", allowed=allowed)


def _unused(base: Node, structure: Mapping[str, Any]) -> None:
    """Record numbers that this machine does not use; they are certainly a mistake."""
    if structure["balance"] == "motor" and "mean_speed" in base:
        base["mean_speed"].refuse("not-used", "is not used with a motor: the speed is a result",
                                  allowed='no mean_speed, or another balance than "motor"')  # fmt: skip
    drive = base["drive"]
    if "scale" in drive and "drive.scale" not in machine_shaft.parameters_of(structure):
        drive["scale"].refuse("not-used", "scales a table or formula of the driving torque, but none is given")
    ratio = drive["flywheel"]["poisson_ratio"]
    if ratio.given and structure["drive"].get("flywheel") == "rim":
        text = Sentence("is not used: the stress of a rim does not depend on it")
        base.report.warn("no-effect", ratio.pointer, text)
    several = (structure, *structure.get("parts", ()))
    for (_, given), own in zip(_owners(base), several, strict=True):
        operation = given["operation"]
        if "sense" in operation and own["operation"]["quantity"] == "torque":
            sense = Sentence("is not used: a positive torque always resists; `sense` is for forces")
            base.report.warn("no-effect", operation["sense"].pointer, sense)
        if "during" in operation and own["operation"]["over"] == "angle":
            operation["during"].refuse("not-used", "selects strokes, but this diagram is over the angle",
                                       allowed='with `over` "stroke" only')  # fmt: skip
