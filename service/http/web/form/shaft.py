"""The machine of a machine-shaft study as blocks of fields: drive, flywheel, stages, mechanisms with operations.

Which fields a block has follows from the choices made so far. The name of a field is the JSON Pointer of its value in
the spec; a field of ``shape`` decides what other fields there are.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

from sprag.service.http.web.form.entries import count_in
from sprag.service.http.web.form.fields import Choice, Field, Groups, described, field_for
from sprag.service.languages import ENGLISH, N_, _, current
from sprag.service.reading.reader import Reading
from sprag.service.reading.wording import words
from sprag.service.spec.described import Described
from sprag.service.spec.machine.shaft import MEAN_SPEED_IS, read_shaft
from sprag.service.spec.machine.shaft_drive import BALANCE, BALANCE_SIDE, FLYWHEEL, MOTOR, STAGE
from sprag.service.spec.machine.shaft_parts import (
    INDICATOR_OVER,
    INTERPOLATION,
    MECHANISM_CHOICES,
    OPERATION_CHOICES,
    PHI_C,
    RECORDED_AT,
    numbers_of,
    numbers_under,
)
from sprag.service.spec.report import Report
from sprag.worker import models
from sprag.worker.models import Parameter, machine_shaft

_PART: Final = re.compile(r"parts\.(\d+)\.")
_GROUPS: Final = (
    ("drive.flywheel.", N_("Flywheel")), ("drive.motor.", N_("Motor")), ("drive.stages.", N_("Stages")),
    ("drive.", N_("Drive")),
    ("mechanism.", N_("Mechanism")), ("operation.", N_("Operation")), ("constants.", N_("Constants")),
)  # fmt: skip
#: How the driving torque is given, and the fields of each way.
DRIVE: Final = "drive_is"
_DRIVES: Final = (
    ("found", N_("the constant torque that balances the operation")), ("value", N_("a constant torque")),
    ("formula", N_("a formula of the angle")), ("csv", N_("a table over the angle")),
)  # fmt: skip
CONSTANTS: Final = "/base/constants"
_CONSTANTS_HELP: Final = N_("one a line: name = value")
_MOTORS: Final = {"kloss": N_("an induction motor (Kloss)"), "linear": N_("a motor with a linear characteristic"),
                  "table": N_("a motor with a measured characteristic")}  # fmt: skip
_FORMULA_HELP: Final = N_("of phi in rad, such as 40*sin(2*phi)^2; of an operation also of t in s, x and omega")
_CSV_HELP: Final = N_("two columns, with units in their headings")
_STEPS_HELP: Final = N_("one step a line: from; to; value")
_NO_CHOICE: Final = (("none", N_("none")),)
_OPERATIONS: Final = (
    *_NO_CHOICE, ("value", N_("constant")), ("steps", N_("steps")), ("formula", N_("formula")), ("csv", N_("table")),
    ("gas", N_("gas in a compressor")), ("indicator", N_("indicator diagram")),
)  # fmt: skip
#: Numbers that a mechanism of two masses, or a four-bar with the weight of its ram only, does not use.
_BY_MASSES: Final = ("rod_inertia", "coupler_inertia")


@dataclass(frozen=True, slots=True)
class Entry:
    """A field with its control: a line, a select, or ``lines`` of text.

    ``shape`` marks a select that decides about other fields; one that is ``own`` to the form is no part of the spec.
    """

    field: Field
    shape: bool = False
    own: bool = False
    lines: int = 0

    @property
    def name(self) -> str:
        """The field's name."""
        return self.field.name

    @property
    def is_parameter(self) -> bool:
        """Whether it is a number of the machine."""
        return bool(self.field.mark)


@dataclass(frozen=True, slots=True)
class Block:
    """Fields under one heading; ``drop`` names the list of rows and the row that a button removes."""

    title: str
    entries: tuple[Entry, ...]
    drop: tuple[str, int] | None = None


def is_shaft(values: Mapping[str, str]) -> bool:
    """Whether the form describes a machine shaft, not a vibration drive."""
    return values.get("model") == models.MACHINE_SHAFT


def several(values: Mapping[str, str]) -> bool:
    """Whether the machine is a list of parts."""
    return parts_of(values) > 0


def parts_of(values: Mapping[str, str]) -> int:
    """Number of parts of a machine that is a list of them, else 0."""
    return count_in(values, "parts", 0, 0, machine_shaft.MAX_PARTS)


def stages_of(values: Mapping[str, str]) -> int:
    """Number of stages between motor and main shaft."""
    return count_in(values, "stages", 0, 0, machine_shaft.MAX_STAGES)


def owners(values: Mapping[str, str]) -> list[str]:
    """JSON Pointers of what has a mechanism and an operation: the base, or each of its parts."""
    return [f"/base/parts/{index}" for index in range(parts_of(values))] or ["/base"]


def blocks(values: Mapping[str, str]) -> list[Block]:
    """The blocks of the machine in their order."""
    found = [Block(N_("Machine"), tuple(_machine(values))), Block(N_("Drive"), tuple(_drive(values)))]
    for index in range(stages_of(values)):
        found.append(Block(_("Stage {number}", number=index + 1), tuple(_stage(values, index)), ("stages", index)))
    for index, owner in enumerate(owners(values)):
        part = index + 1 if several(values) else 0
        titles = [_of_part(part, title) for title in ("Mechanism", "Operation")]
        found.append(Block(titles[0], tuple(_mechanism(values, owner)), ("parts", index) if part else None))
        found.append(Block(titles[1], tuple(_operation(values, owner))))
    return found


def _parameter(entry: Parameter, pointer: str) -> Entry:
    path = pointer.removeprefix("/base").removeprefix("/").replace("/", ".")
    return Entry(field_for(entry, f"{path}.{entry.path.rpartition('.')[2]}".removeprefix(".")))


def _numbers(prefix: str, pointer: str, without: Iterable[str] = (), only: Iterable[str] | None = None) -> list[Entry]:
    entries = numbers_under(prefix)
    names = [name for name in entries if name not in without and (only is None or name in only)]
    return [_parameter(entries[name], pointer) for name in names]


def _select(name: str, label: str, choices: Iterable[tuple[str, str]], help: str = "", *, own: bool = False) -> Entry:
    field = Field(name, label, "", "", "", help, "", False, "", "", tuple(choices))
    return Entry(field, shape=own, own=own)


def _described(entry: Described, pointer: str, *, shape: bool = False) -> Entry:
    choices = tuple((value, words(label) if label == value else label) for value, label in entry.choices)
    if entry.default is not None:
        choices = tuple(sorted(choices, key=lambda pair: pair[0] != entry.default))
    return Entry(replace(_select(f"{pointer}/{entry.name}", words(entry.name), choices, entry.help).field), shape=shape)


def _text(name: str, label: str, help: str, lines: int, example: str) -> Entry:
    return Entry(Field(name, label, "", "", "", help, "", True, "", example), lines=lines)


def _machine(values: Mapping[str, str]) -> list[Entry]:
    most = max(machine_shaft.REVOLUTIONS)
    turns = _("revolutions until everything repeats, 1 to {most}", most=most)
    cycle = Field("/base/cycle", N_("Cycle"), "", "", "", turns, "", False,
                  N_("1 revolution"), "2 revolutions")  # fmt: skip
    top = numbers_under("")
    names = [name for name in ("mean_speed", "wanted_irregularity", "friction_torque", "gravity") if name in top]
    if values.get(DRIVE) in MOTOR.values:
        names.remove("mean_speed")
    return [
        *(_parameter(top[name], "/base") for name in names if name == "mean_speed"),
        _described(MEAN_SPEED_IS, "/base"),
        Entry(cycle),
        *(_parameter(top[name], "/base") for name in names if name != "mean_speed"),
        Entry(
            replace(described(PHI_C, "/base"), label=N_("Reference angle"), symbol="phi_c", default=N_("by default"))
        ),
        Entry(
            Field(CONSTANTS, N_("Constants of formulas"), "", "", "", _CONSTANTS_HELP, "", False, "", "k = 40"), lines=2
        ),
    ]


def _drive(values: Mapping[str, str]) -> list[Entry]:
    motors = tuple((kind, _MOTORS.get(kind, f"{kind} motor")) for kind in MOTOR.values)
    found = _numbers("drive.", "/base/drive", only=("inertia",))
    found.append(_select(DRIVE, N_("Driving torque"), (*_DRIVES, *motors), N_("or the motor that gives it"), own=True))
    way = values.get(DRIVE, "found")
    if way in MOTOR.values:
        own = numbers_of({"balance": "motor", "drive": {"motor": way}}, "drive.motor.")
        found += _diagram("/base/drive/motor", "csv", "speed [rpm],torque [N*m]") if way == "table" else []
        found += _numbers("drive.motor.", "/base/drive/motor", only=own)
    if way == "value":
        found += _numbers("drive.", "/base/drive", only=("torque",))
    if way in {"formula", "csv"}:
        found += _diagram("/base/drive/torque", way, "angle [deg],torque [N*m]")
        found += _numbers("drive.", "/base/drive", only=("scale",))
    if way in {"value", "formula", "csv"}:
        balance = _described(BALANCE, "/base").field
        kept = tuple(pair for pair in balance.choices if pair[0] != "motor")
        found.append(Entry(replace(balance, choices=(("", N_("by default")), *kept))))
        found.append(_described(BALANCE_SIDE, "/base"))
    shapes = (*_NO_CHOICE, *((kind, words(kind)) for kind in FLYWHEEL.values))
    found.append(
        _select("/base/drive/flywheel", N_("Flywheel"), shapes, N_("on the main shaft, by its dimensions"), own=True)
    )
    if values.get("/base/drive/flywheel", "none") != "none":
        found += _numbers("drive.flywheel.", "/base/drive/flywheel")
    return found


def _stage(values: Mapping[str, str], index: int) -> list[Entry]:
    pointer = f"/base/drive/stages/{index}"
    kind = values.get(f"{pointer}/kind") or STAGE.values[0]
    own = numbers_of({"drive": {"stages": [kind]}}, "drive.stages.0.")
    return [_described(STAGE, pointer, shape=True), *_numbers("drive.stages.K.", pointer, only=own)]


def _mechanism(values: Mapping[str, str], owner: str) -> list[Entry]:
    pointer = f"{owner}/mechanism"
    kinds = (*_NO_CHOICE, *((kind, words(kind)) for kind in MECHANISM_CHOICES),
             ("formula", N_("inertia as a formula")), ("csv", N_("inertia as a table")))  # fmt: skip
    found = [] if owner == "/base" else [_parameter(numbers_under("parts.N.")["crank_angle"], owner)]
    found.append(_select(pointer, N_("Mechanism"), kinds, "", own=True))
    kind = values.get(pointer, "none")
    if kind in {"formula", "csv"}:
        return found + _diagram(pointer, kind, "angle [deg],inertia [kg*m^2]")
    if kind not in MECHANISM_CHOICES:
        return found
    place = f"{pointer}/{kind}"
    unused = _BY_MASSES if values.get(f"{place}/bodies") == "two_mass" else ()
    if kind == "four_bar" and values.get(f"{place}/weights", "ram") != "all":
        unused = (*unused, "inclination")
    found += [_described(entry, place, shape=name in {"weights", "bodies"})
              for name, entry in MECHANISM_CHOICES[kind].items()]  # fmt: skip
    return found + _numbers(f"mechanism.{kind}.", place, without=unused)


def _operation(values: Mapping[str, str], owner: str) -> list[Entry]:
    pointer = f"{owner}/operation"
    form = values.get(pointer, "none")
    found = [_select(pointer, N_("Resistance"), _OPERATIONS, "", own=True)]
    if form == "none":
        return found
    if form == "gas":
        found += _numbers("operation.gas.", f"{pointer}/gas")
    elif form == "indicator":
        own = f"{pointer}/indicator"
        found.append(_described(INDICATOR_OVER, own, shape=True))
        if values.get(f"{own}/over") == "time":
            found.append(_parameter(RECORDED_AT, own))
        found += _numbers("operation.indicator.", own)
        found += _diagram(own, "csv", "angle [deg],pressure [bar]")
    else:
        over = values.get(f"{pointer}/over", "angle")
        found += [_described(entry, pointer, shape=name == "over")
                  for name, entry in OPERATION_CHOICES.items() if name != "during" or over == "stroke"]  # fmt: skip
        if over == "time":
            found.append(_parameter(RECORDED_AT, pointer))
        if form == "value":
            found += _numbers("operation.", pointer, only=("value",))
        elif form == "steps":
            found.append(_text(f"{pointer}/steps", N_("Steps"), _STEPS_HELP, 3, "120 deg; 180 deg; 20 kN"))
        else:
            found += _diagram(pointer, form, "angle [deg],force [kN]")
    return found + _numbers("operation.", pointer, only=("scale", "efficiency"))


def _diagram(pointer: str, form: str, example: str) -> list[Entry]:
    """The field of a formula, or those of a table."""
    if form == "formula":
        return [_text(f"{pointer}/formula", N_("Formula"), _FORMULA_HELP, 2, "40*sin(2*phi)^2")]
    table = _text(f"{pointer}/csv", N_("Table"), _CSV_HELP, 5, f"{example}\n0,0\n180,20\n360,0")
    return [table, _described(INTERPOLATION, pointer)]


def part_of(path: str) -> tuple[int, str]:
    """Number of the part that ``path`` belongs to, from 1, and the path within it; 0 for the machine itself."""
    found = _PART.match(path)
    return (0, path) if found is None else (int(found[1]) + 1, path[found.end() :])


def group_of(path: str) -> str:
    """Heading under which a number stands."""
    part, own = part_of(path)
    title = next((title for prefix, title in _GROUPS if own.startswith(prefix)), N_("Machine"))
    return _of_part(part, title)


def _of_part(part: int, title: str) -> str:
    """A heading in the language of the page; of a part, with its number from 1."""
    return _("Part {number}: {label}", number=part, label=_(title).lower()) if part else _(title)


def shaft_paths(base: Mapping[str, Any]) -> Groups:
    """The parameters of a machine that can vary, by group; none while its structure cannot be read."""
    groups: dict[str, list[Choice]] = {}
    for path, entry in read_shaft(Report(), base).parameters.items():
        own = re.sub(r"^(mechanism\.\w+|operation(\.gas|\.indicator)?|drive|constants)\.", "", part_of(path)[1])
        label = words(own) if current() == ENGLISH else Reading(models.MACHINE_SHAFT).caption(path)
        groups.setdefault(group_of(path), []).append(Choice(path, label, entry.unit))
    return list(groups.items())
