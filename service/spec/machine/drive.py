"""The vibration drive of a spec (`base`): every parameter by its flat path, and the paths that axes can vary."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from sprag.sentences import Sentence
from sprag.service.reading.texts import did_you_mean
from sprag.service.spec.described import Listed
from sprag.service.spec.fields import read_number, read_object, read_parameters, values_of
from sprag.service.spec.machine.clutch import Clutch, read_clutch
from sprag.service.spec.machine.machine import Machine
from sprag.service.spec.node import Node
from sprag.service.spec.report import Report, join
from sprag.worker.models import (
    MAX_COEFFICIENTS,
    MAX_PENDULUMS,
    START_STATES,
    VIBRATION_DRIVE,
    Parameter,
    parameter_catalogue,
)
from sprag.worker.models.parameters import placed

if TYPE_CHECKING:
    from sprag.worker.models import ClutchFit

PENDULUMS = Listed("pendulums", 1, MAX_PENDULUMS)
#: Field of the base that a service replaces by the initial values that go on from the end of a case.
START = "start"
_WHERE_STARTS = "submission to that service, or `sprag run --db` with its database"
_PENDULUM_PATH = re.compile(r"pendulums\.([0-9]{1,9})\.(.+)")
_CLUTCH_PATH = re.compile(r"(?:pendulums\.[0-9]{1,9}\.)?clutch\.(.+)")


@dataclass
class Drive(Machine):
    """The base of a vibration drive, as far as it could be read.

    Attributes
    ----------
    pendulums : number of pendulums; None when it could not be read
    clutches : the common clutch of all pendulums, or one for each; only those that could be read
    """

    pendulums: int | None = None
    clutches: list[Clutch] = field(default_factory=list)

    @property
    def fits(self) -> dict[str, ClutchFit]:
        """JSON Pointer of each fitted clutch -> its fit."""
        return {clutch.pointer: clutch.fit for clutch in self.clutches if clutch.fit is not None}

    def assumed(self, path: str) -> bool:
        """Whether ``path`` may belong to a part of the base that could not be read."""
        return not self.clutches and assumed_clutch(path)

    def why_not(self, path: str) -> Sentence:
        """A sentence that explains why an axis cannot vary ``path``, and what it can vary."""
        inside = _PENDULUM_PATH.fullmatch(path)
        if inside and self.pendulums is not None and int(inside[1]) >= self.pendulums:
            return Sentence(
                "there is no pendulum {number}: pendulums are numbered from 0 to {last}",
                number=inside[1], last=str(self.pendulums - 1),
            )  # fmt: skip
        clutch_path = _CLUTCH_PATH.fullmatch(path)
        if clutch_path:
            return self._why_not_clutch(path, clutch_path[1])
        return super().why_not(path)

    def _why_not_clutch(self, path: str, rest: str) -> Sentence:
        prefix = path.removesuffix(rest)
        clutch = next((clutch for clutch in self.clutches if clutch.prefix == prefix), None)
        if clutch is None and self.clutches:
            if self.clutches[0].prefix == "clutch.":
                return Sentence(
                    "the clutch is common to all pendulums: its paths begin with 'clutch.', as in '{path}'",
                    path=f"clutch.{rest}",
                )
            return Sentence(
                "each pendulum has its own clutch: its paths begin as in '{path}'", path=f"pendulums.0.clutch.{rest}"
            )
        if clutch is not None and clutch.fit is not None:
            return Sentence("the clutch law comes from measured data and is not varied; give coefficients to vary it")
        if clutch is not None and rest.startswith("coefficients."):
            last = len(clutch.coefficients) - 1
            return Sentence(
                "the clutch has no such coefficient: they are numbered from 0 (c_1) to {last} (c_{index})",
                last=str(last), index=str(last + 1),
            )  # fmt: skip
        return Sentence("is not a numeric parameter of the clutch{hint}", hint=did_you_mean(path, self.parameters))


def read_drive(report: Report, data: object) -> Drive:
    """Read the machine in ``data`` (the spec's `base`); faults are recorded in ``report``."""
    machine = Drive()
    catalogue = [entry for entry in parameter_catalogue(VIBRATION_DRIVE) if not entry.path.startswith("clutch.")]
    sections = list(dict.fromkeys(entry.path.split(".")[0] for entry in catalogue))
    found = read_object(report, "/base", data, (*sections, "clutch", START))
    if found is None:
        _assume_everything(catalogue, machine)
        return machine
    if START in found:
        report.fault(
            f"/base/{START}",
            "not-used",
            "refers to a study of a service, which replaces it by initial values",
            found[START],
            allowed=_WHERE_STARTS,
        )
    for section in sections:
        entries = [entry for entry in catalogue if entry.path.split(".")[0] == section]
        pointer = join("/base", section)
        if section == "pendulums":
            _read_pendulums(report, pointer, found.get(section), entries, machine)
        elif entries[0].path == section:
            value = found.get(section, entries[0].default)
            number = read_number(report, pointer, value, entries[0])
            machine.values.update({} if number is None else {section: number})
            machine.parameters[section] = entries[0]
        else:
            _read_section(report, pointer, found.get(section), section, entries, machine)
    if machine.pendulums is None:
        _assume_everything(catalogue, machine)
    _read_clutches(report, found, machine)
    return machine


def _read_section(
    report: Report, pointer: str, data: object, prefix: str, entries: list[Parameter], machine: Drive
) -> None:
    """Read the object whose fields are the last names of ``entries``' paths, placed under ``prefix``."""
    parameters = {name: placed(entry, f"{prefix}.{name}") for entry in entries if (name := entry.path.split(".")[-1])}
    machine.parameters.update({entry.path: entry for entry in parameters.values()})
    names = (*parameters, "clutch") if prefix.startswith("pendulums.") else tuple(parameters)
    if data is None:
        required = [name for name, entry in parameters.items() if entry.default is None]
        report.fault(
            pointer,
            "required",
            Sentence("is required, with at least {names}", names=", ".join(required)),
            allowed="an object",
        )
        return
    found = read_object(report, pointer, data, names)
    if found is not None:
        values = read_parameters(report, pointer, found, parameters)
        for name, entry in parameters.items():
            if name in START_STATES and name not in found:
                del values[entry.path]
            elif name == "initial_clutch" and not values.get(entry.path, 0.0).is_integer():
                report.fault(
                    join(pointer, name), "invalid-choice", "is not the number of a state", found[name],
                    allowed=entry.help,
                )  # fmt: skip
        machine.values.update(values)


def _read_pendulums(report: Report, pointer: str, data: object, entries: list[Parameter], machine: Drive) -> None:
    listed = values_of(PENDULUMS.read(Node(report, pointer, data)))
    if listed is None:
        return
    machine.pendulums = len(listed)
    for index, pendulum in enumerate(listed):
        # A null in the list is an invalid pendulum, not a missing section.
        item = "null" if pendulum is None else pendulum
        _read_section(report, join(pointer, index), item, f"pendulums.{index}", entries, machine)


def _read_clutches(report: Report, base: Mapping[str, Any], machine: Drive) -> None:
    listed = base.get("pendulums")
    pendulums = listed if isinstance(listed, list) and machine.pendulums is not None else []
    own = [index for index, item in enumerate(pendulums) if isinstance(item, Mapping) and "clutch" in item]
    backlashes = [machine.values.get(f"pendulums.{index}.backlash") for index in range(len(pendulums))]
    known = [value for value in backlashes if value is not None]
    if "clutch" in base:
        if own:
            report.fault(
                "/base/clutch",
                "conflict",
                Sentence(
                    "is common to all pendulums, but pendulums {numbers} also have their own",
                    numbers=", ".join(map(str, own)),
                ),
                allowed="one clutch in `base`, or one in each pendulum",
            )
        _add(machine, read_clutch(report, "/base/clutch", base["clutch"], "clutch.", known))
    elif not own:
        report.fault(
            "/base/clutch",
            "required",
            "is required: coefficients, or measured data with an accuracy",
            allowed="one clutch in `base`, or one in each pendulum",
        )
    for index in range(len(pendulums)) if own else ():
        pointer = f"/base/pendulums/{index}/clutch"
        backlash = backlashes[index]
        if index in own:
            prefix = f"pendulums.{index}.clutch."
            shared = [] if backlash is None else [backlash]
            _add(machine, read_clutch(report, pointer, pendulums[index]["clutch"], prefix, shared))
        elif "clutch" not in base:
            report.fault(
                pointer,
                "required",
                Sentence("is required, since pendulum {number} has its own", number=str(own[0])),
                allowed="one clutch in `base`, or one in each pendulum",
            )


def _add(machine: Drive, clutch: Clutch | None) -> None:
    if clutch is not None:
        machine.clutches.append(clutch)
        machine.values.update(clutch.values)
        machine.parameters.update(clutch.parameters)


def _assume_everything(catalogue: list[Parameter], machine: Drive) -> None:
    """Let axes name any parameter a machine could have, so that an unreadable base causes no further faults there."""
    for entry in catalogue:
        for index in range(MAX_PENDULUMS if ".N." in entry.path else 1):
            path = entry.path.replace(".N.", f".{index}.")
            machine.parameters.setdefault(path, placed(entry, path))


def assumed_clutch(path: str) -> bool:
    """Whether ``path`` may belong to a clutch that could not be read."""
    match = _CLUTCH_PATH.fullmatch(path)
    if match is None:
        return False
    name, _, index = match[1].partition(".")
    if name == "coefficients":
        return index.isascii() and index.isdigit() and len(index) < 4 and int(index) < MAX_COEFFICIENTS
    return match[1] == "windup_limit"
