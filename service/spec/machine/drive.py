"""The vibration drive of a spec (`base`): every parameter by its flat path, and the paths that axes can vary."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Final

from sprag_study.sentences import Amount, Sentence, plural
from sprag_study.service.languages import N_
from sprag_study.service.reading.texts import did_you_mean
from sprag_study.service.spec.described import Field, Listed, Record
from sprag_study.service.spec.machine.clutch import CLUTCH, Clutch, read_clutch
from sprag_study.service.spec.machine.machine import Machine
from sprag_study.service.spec.machine.measured_base import MEASURED_BASE, read_measured_base
from sprag_study.service.spec.machine.shaft_tables import read_csv_rows
from sprag_study.service.spec.node import Node
from sprag_study.service.spec.schema.quantity import QUANTITY, required_of
from sprag_study.worker.models import (
    HARMONIC_FACTOR,
    HARMONIC_PARAMETERS,
    HARMONICS,
    LOAD_FACTOR,
    LOAD_TABLE,
    LOAD_TABLE_SPEED,
    LOAD_TABLE_TORQUE,
    MAX_COEFFICIENTS,
    MAX_HARMONICS,
    MAX_LOAD_ROWS,
    MAX_PENDULUMS,
    ONLY_GIVEN,
    VIBRATION_DRIVE,
    Parameter,
    parameter_catalogue,
)
from sprag_study.worker.models.parameters import placed
from sprag_study.worker.models.vocabulary import ordinal

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sprag_study.worker.models import ClutchFit

#: Field of the base that a service replaces by the initial values that go on from the end of a case.
START: Final = "start"
_PENDULUMS: Final = "pendulums"
_SHAFT: Final = "shaft"
_LOAD_FIELD: Final = "load_table"
_EXCITATION: Final = "excitation"
_HARMONICS_FIELD: Final = "harmonics"
_MEASURED_FIELD: Final = "measured"
#: A start from the end of a case of a study of the same service.
START_AT: Final = Record(
    {
        "study": {"type": "string", "description": "id of the study"},
        "case": {"type": "integer", "minimum": 0, "description": "number of the case"},
        "start": {"type": "integer", "minimum": 0, "description": "of a case with many starts: which of them"},
    },
    "begin in the state in which a case of another study ends; the service replaces it by initial values",
    required=("study", "case"),
)
_ROWS: Final = Listed(
    "rows", 2, MAX_LOAD_ROWS, "rows of speed (rad/s) and load torque (N*m), straight lines between them",
    item={"type": "array", "minItems": 2, "maxItems": 2, "items": QUANTITY},
)  # fmt: skip
#: A load over the speed of the shaft.
LOAD: Final = Record(
    {
        "table": _ROWS,
        "csv": {
            "type": "string",
            "description": "speed and load torque as the text of a CSV file, headings with units in brackets",
        },
    },
    "load torque over the speed of the shaft, beside the other loads; at its ends it holds beyond them",
    either=("table", "csv"),
)
_HARMONIC_ROWS: Final = Listed(
    "rows", 1, MAX_HARMONICS, "rows of order, amplitude along x (m), phase along x (rad), amplitude along y (m), phase "
    "along y (rad)",
    item={"type": "array", "minItems": 5, "maxItems": 5, "items": QUANTITY},
)  # fmt: skip
#: Harmonics of the base vibration.
OVERTONES: Final = Record(
    {
        "table": _HARMONIC_ROWS,
        "csv": {
            "type": "string",
            "description": "order, amplitude and phase along x, amplitude and phase along y as the text of a CSV file, "
            "headings with units in brackets",
        },
    },
    "harmonics beside the vibration: d_K cos(m_K nu t + alpha_K) along x, b_K sin(m_K nu t + beta_K) along y",
    either=("table", "csv"),
)
_WHERE_STARTS = "submission to that service, or `sprag run --db` with its database"
_PENDULUM_PATH = re.compile(r"pendulums\.([0-9]{1,9})\.(.+)")
_CLUTCH_PATH = re.compile(r"(?:pendulums\.[0-9]{1,9}\.)?clutch\.(.+)")


def _catalogue() -> list[Parameter]:
    """The parameters of a drive without those of its clutch, the table of its load, and its harmonics."""
    return [
        entry
        for entry in parameter_catalogue(VIBRATION_DRIVE)
        if not entry.path.startswith(("clutch.", LOAD_TABLE, HARMONICS))
    ]


def drive_record() -> Record:
    """The base: numbers, objects of them, the list of pendulums, and the clutch."""
    fields: dict[str, Field] = {}
    required: list[str] = []
    catalogue = _catalogue()
    tables: dict[str, dict[str, Field]] = {
        _SHAFT: {_LOAD_FIELD: LOAD},
        _EXCITATION: {_HARMONICS_FIELD: OVERTONES, _MEASURED_FIELD: MEASURED_BASE},
    }
    for name in dict.fromkeys(entry.path.split(".")[0] for entry in catalogue):
        entries = {entry.path.split(".")[-1]: entry for entry in catalogue if entry.path.split(".")[0] == name}
        needed = required_of(entries)
        required += [name] if needed else []
        clutch: dict[str, Field] = {"clutch": CLUTCH} if name == _PENDULUMS else {}
        record = Record({**entries, **clutch, **tables.get(name, {})}, required=needed)
        fields[name] = Listed("pendulums", 1, MAX_PENDULUMS, item=record) if clutch else entries.get(name, record)
    whole = {**fields, "clutch": CLUTCH, START: START_AT}
    return Record(whole, "the machine that every case begins from", required)


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
        if path.startswith(LOAD_TABLE.removesuffix(".")):
            return Sentence("a load that is given as a table is not varied row by row: vary {path}", path=LOAD_FACTOR)
        if path.startswith(HARMONICS.removesuffix(".")):
            return Sentence("harmonics are not varied one by one: vary {path}", path=HARMONIC_FACTOR)
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


def read_drive(base: Node) -> Drive:
    """Read the machine of a spec; faults are recorded."""
    machine, record = Drive(), drive_record()
    if not record.read(base):
        _assume_everything(machine)
        return machine
    if START in base:
        base[START].refuse(
            "not-used", "refers to a study of a service, which replaces it by initial values", allowed=_WHERE_STARTS
        )
    for name, section in record.fields.items():
        if isinstance(section, Listed):
            _read_pendulums(base[name], section, machine)
        elif isinstance(section, Record) and name != START:
            _read_section(base[name], section, name, machine)
            if name == _SHAFT:
                _read_load(base[name][_LOAD_FIELD], machine)
            if name == _EXCITATION:
                _read_harmonics(base[name][_HARMONICS_FIELD], machine)
                _read_measured(base[name], machine)
        elif isinstance(section, Parameter):
            number = base[name].otherwise(section.default).number(section)
            machine.values.update({} if number is None else {name: number})
            machine.parameters[name] = section
    if machine.pendulums is None:
        _assume_everything(machine)
    _read_clutches(base, machine)
    return machine


def _read_section(node: Node, section: Record, prefix: str, machine: Drive) -> None:
    """Read an object of numbers, placed under ``prefix``."""
    parameters = {name: placed(e, f"{prefix}.{name}") for name, e in section.fields.items() if isinstance(e, Parameter)}
    machine.parameters.update({entry.path: entry for entry in parameters.values()})
    if node.value is None and not prefix.startswith(f"{_PENDULUMS}."):
        names = ", ".join(section.required)
        node.refuse("required", Sentence("is required, with at least {names}", names=names), allowed="an object")
        return
    # A null in the list is an invalid pendulum, not a missing section.
    if not section.read(node if node.value is not None else node.holding("null")):
        return
    for name, entry in parameters.items():
        number = node[name].number_or_default(entry)
        if number is None or (name in ONLY_GIVEN and name not in node):
            continue
        if name == "initial_clutch" and not number.is_integer():
            node[name].refuse("invalid-choice", "is not the number of a state", allowed=entry.help)
        machine.values[entry.path] = number


def _read_load(node: Node, machine: Drive) -> None:
    """Read the table of the load, placed under ``LOAD_TABLE``."""
    form = node.one_of(LOAD.either) if node.given and LOAD.read(node) else None
    if form is None:
        return
    own, columns = node[form], (LOAD_TABLE_SPEED, LOAD_TABLE_TORQUE)
    named = [replace(entry, path=entry.path.rpartition(".")[2]) for entry in columns]
    rows = read_csv_rows(own, *named) if form == "csv" else _ROWS.read_rows(own, *named)
    if not own.sound:
        return
    if len(rows) > MAX_LOAD_ROWS:
        message = plural("has {count} row", "has {count} rows", len(rows))
        allowed = Sentence("at most {high} rows", high=MAX_LOAD_ROWS)
        own.refuse("too-many", message, None, allowed=allowed)
    for k, ((before, _), (speed, _)) in enumerate(pairwise(rows), start=1):
        if not speed > before:
            message = Sentence("must have ascending speeds: row {row} does not follow the one before", row=k + 1)
            value, least = Amount(speed, "rad/s"), Sentence("more than {low}", low=Amount(before, "rad/s"))
            own.refuse("invalid-table", message, str(value), allowed=least)
            return
    for k, row in enumerate(rows):
        machine.values.update({f"{LOAD_TABLE}{k}.{entry.path}": v for entry, v in zip(named, row, strict=True)})


def _read_harmonics(node: Node, machine: Drive) -> None:
    """Read the harmonics of the base vibration, placed under ``HARMONICS``."""
    form = node.one_of(OVERTONES.either) if node.given and OVERTONES.read(node) else None
    if form is None:
        return
    own, named = node[form], [replace(entry, path=entry.path.rpartition(".")[2]) for entry in HARMONIC_PARAMETERS]
    rows = read_csv_rows(own, *named) if form == "csv" else _HARMONIC_ROWS.read_rows(own, *named)
    if not own.sound:
        return
    if len(rows) > MAX_HARMONICS:
        message = plural("has {count} row", "has {count} rows", len(rows))
        own.refuse("too-many", message, None, allowed=Sentence("at most {high} rows", high=MAX_HARMONICS))
        return
    orders = [row[0] for row in rows]
    for k, order in enumerate(orders):
        if not order.is_integer() or order in orders[:k]:
            message = Sentence("must have whole orders, each once: row {row} does not", row=k + 1)
            own.refuse("invalid-table", message, f"{order:g}", allowed=HARMONIC_PARAMETERS[0].help)
            return
    _take_harmonics(machine, rows)


def _take_harmonics(machine: Drive, rows: Iterable[Iterable[float]]) -> None:
    """Give a machine rows of harmonics in the order of `HARMONIC_PARAMETERS`."""
    for k, row in enumerate(rows):
        values = zip(HARMONIC_PARAMETERS, row, strict=True)
        machine.values.update({f"{HARMONICS}{k}.{entry.path.rpartition('.')[2]}": value for entry, value in values})


def _read_measured(excitation: Node, machine: Drive) -> None:
    """Read the measured motion of the base, and place the harmonics that stand for it under ``HARMONICS``."""
    node = excitation[_MEASURED_FIELD]
    if not node.given:
        return
    if excitation[_HARMONICS_FIELD].given:
        node.refuse(
            "conflict", "is given beside harmonics", None, allowed=N_("either harmonics or one measured period")
        )
        return
    _take_harmonics(machine, read_measured_base(node))


def _read_pendulums(node: Node, listed: Listed, machine: Drive) -> None:
    pendulums = listed.read(node)
    if pendulums is None or not isinstance(listed.item, Record):
        return
    machine.pendulums = len(pendulums)
    for index, pendulum in enumerate(pendulums):
        _read_section(pendulum, listed.item, f"{_PENDULUMS}.{index}", machine)


def _read_clutches(base: Node, machine: Drive) -> None:
    node, allowed = base["clutch"], N_("one clutch in `base`, or one in each pendulum")
    pendulums = base[_PENDULUMS].parts() if machine.pendulums is not None else []
    own = [index for index, pendulum in enumerate(pendulums) if "clutch" in pendulum]
    backlashes = [machine.values.get(f"{_PENDULUMS}.{index}.backlash") for index in range(len(pendulums))]
    if node.given:
        if own:
            message = Sentence(
                "is common to all pendulums, but pendulums {numbers} also have their own",
                numbers=", ".join(map(str, own)),
            )
            node.refuse("conflict", message, None, allowed=allowed)
        _add(machine, read_clutch(node, "clutch.", [value for value in backlashes if value is not None]))
    elif not own:
        node.refuse("required", "is required: coefficients, or measured data with an accuracy", allowed=allowed)
    for index, pendulum in enumerate(pendulums) if own else ():
        backlash = backlashes[index]
        if index in own:
            shared = [] if backlash is None else [backlash]
            _add(machine, read_clutch(pendulum["clutch"], f"{_PENDULUMS}.{index}.clutch.", shared))
        elif not node.given:
            message = Sentence("is required, since pendulum {number} has its own", number=ordinal(own[0]))
            pendulum["clutch"].refuse("required", message, allowed=allowed)


def _add(machine: Drive, clutch: Clutch | None) -> None:
    if clutch is not None:
        machine.clutches.append(clutch)
        machine.values.update(clutch.values)
        machine.parameters.update(clutch.parameters)


def _assume_everything(machine: Drive) -> None:
    """Let axes name any parameter a machine could have, so that an unreadable base causes no further faults there."""
    for entry in _catalogue():
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
