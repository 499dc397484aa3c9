"""The machine shaft of a spec (`base`): its structure, every number by its flat path, and the paths that axes can vary.

The machine as a whole is checked (`check_shaft`) once its parts could be read.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from sprag.sentences import Sentence
from sprag.service.languages import N_
from sprag.service.reading.texts import did_you_mean
from sprag.service.spec.described import choice
from sprag.service.spec.fields import nodes, read_object
from sprag.service.spec.lists import refuse_mixed
from sprag.service.spec.machine.machine import Machine, read_numbers
from sprag.service.spec.machine.shaft_check import check_machine
from sprag.service.spec.machine.shaft_drive import read_balance, read_drive
from sprag.service.spec.machine.shaft_parts import (
    PHI_C,
    read_constants,
    read_cycle,
    read_mechanism,
    read_operation,
    read_parts,
)
from sprag.service.spec.node import Node
from sprag.service.spec.report import Report, join
from sprag.worker import models
from sprag.worker.models import machine_shaft
from sprag.worker.models.parameters import model_parameter

FIELDS: Final = (
    "cycle", "mean_speed", "mean_speed_is", "drive", "mechanism", "operation", "parts", "balance", "balance_side",
    "phi_c", "constants", "wanted_irregularity", "friction_torque", "gravity",
)  # fmt: skip
_MEAN_HELP: Final = "which mean of the speed the given mean speed and the irregularity refer to"
MEAN_SPEED_IS: Final = choice("mean_speed_is", _MEAN_HELP, "midrange", "angle", "time", default="midrange")
_INDEXED = re.compile(r"(?:parts\.[0-9]{1,9}\.)?(operation\.steps|drive\.stages)\.([0-9]{1,9})\.")
#: What is said about a step or a stage that there is not.
_NO_ITEM: Final = {
    "steps": N_("there is no step {number}: steps are numbered from 0 to {last}"),
    "stages": N_("there is no stage {number}: stages are numbered from 0 to {last}"),
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
            }  # fmt: skip
            if int(item[2]) >= counts[name] > 0:
                return Sentence(_NO_ITEM[name], number=item[2], last=str(counts[name] - 1))
        if path.startswith("constants.") and self.structure is not None:
            return Sentence("is not a constant of this machine{hint}", hint=did_you_mean(path, self.parameters))
        if model_parameter(models.MACHINE_SHAFT, path) is not None:
            hint = did_you_mean(path, self.parameters)
            return Sentence("is not a parameter of this machine, which has other parts{hint}", hint=hint)
        return super().why_not(path)


def read_shaft(report: Report, data: object) -> ShaftMachine:
    """Read the machine in ``data`` (the spec's `base`); faults are recorded in ``report``."""
    machine = ShaftMachine()
    found = read_object(report, "/base", data, FIELDS)
    if found is None:
        return machine
    structure = _read_structure(report, found, machine.places)
    if structure is None:
        return machine
    machine.structure = structure
    machine.parameters = machine_shaft.parameters_of(structure)
    _unused(report, found, structure)
    _refuse_mixed_steps(report, found, machine)
    read_numbers(report, found, machine)
    return machine


def _refuse_mixed_steps(report: Report, found: Mapping[str, Any], machine: Machine) -> None:
    """Record bare numbers in a column of steps beside quantities of another scale."""
    owners = [("/base", found), *((join("/base/parts", k), part) for k, part in enumerate(found.get("parts") or ()))]
    for pointer, owner in owners:
        operation = owner.get("operation")
        steps = operation.get("steps") if isinstance(operation, Mapping) else None
        where = join(pointer, "operation", "steps")
        prefix = where.removeprefix("/base/").replace("/", ".")
        for names in (("from", "to"), ("value",)):
            entry = machine.parameters.get(f"{prefix}.0.{names[0]}")
            column = [(join(where, k, name), step[name]) for k, step in enumerate(steps or ()) for name in names
                      if name in step]  # fmt: skip
            if entry is not None:
                refuse_mixed(nodes(report, column), entry.unit)


def check_shaft(report: Report, machine: Machine) -> None:
    """Check the machine as a whole, all of whose parts could be read; faults are recorded in ``report``."""
    assert isinstance(machine, ShaftMachine)
    if machine.structure is not None:
        check_machine(report, machine.structure, machine.values, machine.places)


def _read_structure(report: Report, found: Mapping[str, Any], places: dict[str, str]) -> dict[str, Any] | None:
    """Read the structure as plain data; None, with the faults recorded, when some part could not be read."""
    drive = read_drive(report, found.get("drive"), places)
    mechanism = read_mechanism(report, found.get("mechanism"), places)
    operation = read_operation(report, found.get("operation"), places)
    several = [] if found.get("parts") is None else read_parts(report, found["parts"], places)
    _refuse_both(report, found)
    cycle = read_cycle(report, found.get("cycle", 1))
    constants = read_constants(report, found.get("constants", {}))
    balance = read_balance(report, found, drive)
    mean = MEAN_SPEED_IS.read(Node(report, "/base", found))
    before = report.found
    phi_c = None if found.get("phi_c") is None else PHI_C.read(Node(report, "/base", found))
    parts = (drive, mechanism, operation, several, cycle, constants, balance, mean)
    if any(part is None for part in parts) or report.found > before:
        return None
    structure = {
        "cycle": cycle, "mean_speed_is": mean, "balance": balance, "drive": drive, "mechanism": mechanism,
        "operation": operation, "constants": constants, "phi_c": phi_c,
    }  # fmt: skip
    if found.get("balance_side") == "operation":
        structure["balance_side"] = "operation"
    return structure | {"parts": several} if several else structure


def _refuse_both(report: Report, found: Mapping[str, Any]) -> None:
    """Record a mechanism or an operation beside a list of parts."""
    for name in ("mechanism", "operation"):
        if found.get("parts") is not None and found.get(name) is not None:
            allowed = Sentence("{name} in each of the parts, or no parts", name=name)
            report.fault(f"/base/{name}", "conflict", "cannot be given beside parts, which have their own", found[name],
                         allowed=allowed)  # fmt: skip


def _unused(report: Report, found: Mapping[str, Any], structure: Mapping[str, Any]) -> None:
    """Record numbers that this machine does not use; they are certainly a mistake."""
    if structure["balance"] == "motor" and "mean_speed" in found:
        report.fault("/base/mean_speed", "not-used", "is not used with a motor: the speed is a result",
                       found["mean_speed"], allowed='no mean_speed, or another balance than "motor"')  # fmt: skip
    drive = found.get("drive")
    if isinstance(drive, Mapping) and "scale" in drive and "drive.scale" not in machine_shaft.parameters_of(structure):
        report.fault(
            "/base/drive/scale",
            "not-used",
            "scales a table or formula of the driving torque, but none is given",
            drive["scale"],
        )
    flywheel = drive.get("flywheel") if isinstance(drive, Mapping) else None
    if isinstance(flywheel, Mapping) and structure["drive"].get("flywheel") == "rim" and "poisson_ratio" in flywheel:
        report.warn(
            "no-effect",
            "/base/drive/flywheel/poisson_ratio",
            Sentence("is not used: the stress of a rim does not depend on it"),
        )
    owners = [("/base", found, structure)]
    several = zip(found.get("parts") or (), structure.get("parts", ()), strict=True)
    owners += [(f"/base/parts/{k}", given, own) for k, (given, own) in enumerate(several)]
    for pointer, given, own in owners:
        operation = given.get("operation")
        if isinstance(operation, Mapping) and own["operation"]["quantity"] == "torque" and "sense" in operation:
            sense = Sentence("is not used: a positive torque always resists; `sense` is for forces")
            report.warn("no-effect", f"{pointer}/operation/sense", sense)
        if isinstance(operation, Mapping) and own["operation"]["over"] == "angle" and "during" in operation:
            report.fault(
                f"{pointer}/operation/during", "not-used", "selects strokes, but this diagram is over the angle",
                operation["during"], allowed='with `over` "stroke" only',
            )  # fmt: skip
