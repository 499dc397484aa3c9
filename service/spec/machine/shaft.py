"""The machine shaft of a spec (`base`): its structure, every number by its flat path, and the paths that axes can vary.

The machine as a whole is checked (`check_shaft`) once its parts could be read.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from sprag.service.spec.described import choice
from sprag.service.spec.fields import read_object
from sprag.service.spec.machine.machine import Machine, read_numbers
from sprag.service.spec.machine.shaft_check import check_machine
from sprag.service.spec.machine.shaft_drive import read_balance, read_drive
from sprag.service.spec.machine.shaft_parts import (
    PHI_C,
    read_constants,
    read_cycle,
    read_mechanism,
    read_operation,
)
from sprag.service.spec.report import Report, did_you_mean
from sprag.worker import models
from sprag.worker.models import machine_shaft
from sprag.worker.models.parameters import general_path

FIELDS: Final = (
    "cycle", "mean_speed", "mean_speed_is", "drive", "mechanism", "operation", "balance", "phi_c", "constants",
    "wanted_irregularity", "gravity",
)  # fmt: skip
_MEAN_HELP: Final = "which mean of the speed mean_speed and the irregularity refer to"
MEAN_SPEED_IS: Final = choice("mean_speed_is", _MEAN_HELP, "midrange", "angle", "time", default="midrange")
_INDEXED = re.compile(r"(operation\.steps|drive\.stages)\.([0-9]{1,9})\.")


@dataclass
class ShaftMachine(Machine):
    """The base of a machine shaft, as far as it could be read.

    Attributes
    ----------
    places : "drive", "mechanism", "operation" -> JSON Pointer of its formula, its table, or the whole part
    """

    places: dict[str, str] = field(default_factory=dict)

    def assumed(self, path: str) -> bool:
        """Whether ``path`` may belong to a machine whose structure could not be read."""
        return self.structure is None and any(
            entry.path in {general_path(path), re.sub(r"^constants\..*", "constants.NAME", path)}
            for entry in models.parameter_catalogue(models.MACHINE_SHAFT)
        )

    def why_not(self, path: str) -> str:
        """A sentence that explains why an axis cannot vary ``path``, and what it can vary."""
        item = _INDEXED.match(path)
        if item and self.structure is not None:
            part = item[1].rpartition(".")[2]
            counts = {
                "steps": int(self.structure["operation"]["steps"]),
                "stages": len(self.structure["drive"].get("stages", ())),
            }
            if int(item[2]) >= counts[part] > 0:
                return f"there is no {part[:-1]} {item[2]}: {part} are numbered from 0 to {counts[part] - 1}"
        if path.startswith("constants.") and self.structure is not None:
            return "is not a constant of this machine" + did_you_mean(path, self.parameters)
        catalogue = {entry.path for entry in models.parameter_catalogue(models.MACHINE_SHAFT)}
        if general_path(path) in catalogue:
            return "is not a parameter of this machine, which has other parts" + did_you_mean(path, self.parameters)
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
    read_numbers(report, found, machine)
    return machine


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
    cycle = read_cycle(report, found.get("cycle", 1))
    constants = read_constants(report, found.get("constants", {}))
    balance = read_balance(report, found, drive)
    mean = MEAN_SPEED_IS.read(report, "/base", found)
    before = report.found
    phi_c = None if found.get("phi_c") is None else PHI_C.read(report, "/base", found)
    parts = (drive, mechanism, operation, cycle, constants, balance, mean)
    if any(part is None for part in parts) or report.found > before:
        return None
    return {
        "cycle": cycle, "mean_speed_is": mean, "balance": balance, "drive": drive, "mechanism": mechanism,
        "operation": operation, "constants": constants, "phi_c": phi_c,
    }  # fmt: skip


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
    operation = found.get("operation")
    if isinstance(operation, Mapping) and structure["operation"]["over"] == "angle" and "during" in operation:
        report.fault("/base/operation/during", "not-used", "selects strokes, but this diagram is over the angle",
                       operation["during"], allowed='with `over` "stroke" only')  # fmt: skip
