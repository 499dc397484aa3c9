"""Fields and lists of a spec that are not parameters, each described once for reader, JSON Schema and form."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, Literal, Union

from sprag_study.sentences import Sentence
from sprag_study.service.reading.numbers import WITHOUT_DOUBT, assumption, question, settle
from sprag_study.service.reading.part_names import LOADS_OF_SHAFTS, RUN_LABELS
from sprag_study.service.spec.lists import refuse_mixed
from sprag_study.service.spec.node import Node
from sprag_study.service.spec.schema.quantity import Schema, object_schema, one_of, quantity_schema
from sprag_study.worker.limits import (
    MAX_ORBIT_PERIODS,
    MAX_SETTLED,
    MAX_SETTLED_PERIODS,
    MAX_TOLERANCE,
    MIN_SETTLED,
    MIN_SETTLED_PERIODS,
    MIN_TOLERANCE,
)
from sprag_study.worker.models import MAX_COEFFICIENTS, SETTLED, Parameter

#: What is said about a list that is none, and what is allowed; the catalogue has these texts for the items of each.
NO_LIST: Final = "must be a list of {items}"
A_LIST: Final = "a list of {{low}} to {{high}} {items}{{note}}"
_IN_ONE_TEXT: Final[Schema] = {
    "type": "string",
    "minLength": 1,
    "description": "the values in one text, semicolons between them; a unit at the end holds for the bare numbers "
    "before it",
    "examples": ["0; 50; 100 N*mm"],
}


#: Texts that are read as plain numbers: those that pages print, such as 1·10⁻⁹.
_PRINTED: Final[Schema] = {"pattern": "[^\\x00-\\x7F]"}


@dataclass(frozen=True, slots=True)
class Described:
    """One field.

    Attributes
    ----------
    name, label, help : its name, its label in the form, and its meaning
    kind : "whole" and "number", from ``low`` to ``high``; "periods", a text with a whole number of periods; "time", a
        number of seconds or a text; "text", a number or a text within ``limits``; "part", a fraction as a text or the
        whole number under it; "flag"; "choice", one of ``choices``: values and their labels in the form
    default : what stands for a field that is not given; None where it is required or its absence means something
    """

    name: str
    label: str
    help: str
    kind: Literal["whole", "number", "periods", "time", "text", "part", "flag", "choice"]
    low: float = 0
    high: float = 0
    default: Any = None
    choices: tuple[tuple[str, str], ...] = ()
    limits: str = ""

    @property
    def default_text(self) -> str:
        """The default as a user would write it."""
        text = f"{self.default:g}".replace("e-0", "e-") if isinstance(self.default, float) else str(self.default)
        return f"{text} periods" if self.kind == "periods" else text

    @property
    def values(self) -> tuple[str, ...]:
        """What can be chosen."""
        return tuple(value for value, _ in self.choices)

    def read(self, owner: Node) -> Any:
        """Its value in the object ``owner``; None, and a fault recorded, when it is wrong or missing.

        Times are read where the frequencies of a study are known, texts beside their descriptions.
        """
        node = owner[self.name]
        if not node.given and self.default is not None:
            return self.default
        match self.kind:
            case "choice":
                return node.choice(self.values)
            case "flag":
                return node.flag()
            case "number":
                return node.plain(self.low, self.high)
            case "periods":
                return node.periods(int(self.low), int(self.high))
        return node.whole(int(self.low), int(self.high))

    def schema(self) -> dict[str, Any]:
        """Its JSON Schema."""
        schema: dict[str, Any] = {"description": self.help} if self.help else {}
        if self.kind == "periods":
            schema["description"] += f": {self.low:,} to {self.high:,}"
            return {"type": "string", "examples": [self.default_text], "default": self.default_text, **schema}
        if self.kind == "time":
            return {"type": ["number", "string"], "examples": ["60 periods", "2 s", 2.0], "minimum": 0, **schema}
        if self.kind in ("text", "part"):
            number = "number" if self.kind == "text" else "integer"
            return {"type": [number, "string"], "default": self.default, "description": f"{self.help}: {self.limits}"}
        if self.default is not None:
            schema["default"] = self.default
        if self.kind == "choice":
            return {"enum": list(self.values), **schema}
        if self.kind == "flag":
            return {"type": "boolean", **schema}
        kind = {"type": "integer"} if self.kind == "whole" else {"type": ["number", "string"], **_PRINTED}
        return {**kind, "minimum": self.low, "maximum": self.high, **schema}


@dataclass(frozen=True, slots=True)
class Listed:
    """A list of ``low`` to ``high`` ``items`` (what they are called); ``help`` says what it means.

    ``note`` is said to those who gave another thing, ``item`` describes each item, and ``text`` says that one text with
    all of them will do.
    """

    items: str
    low: int
    high: int
    help: str = ""
    note: str = ""
    item: Field = field(default_factory=dict)
    text: bool = False

    def read(self, node: Node) -> list[Node] | None:
        """The items, none where the list may be missing; None, and a fault recorded, unless it is such a list."""
        data = node.value
        if not node.given and not self.low:
            return []
        if isinstance(data, list) and self.low <= len(data) <= self.high:
            return node.parts()
        missing = data is None and self.low > 0
        node.refuse(
            "required" if missing else "wrong-type",
            "is required" if missing else Sentence(NO_LIST.format(items=self.items)),
            allowed=Sentence(A_LIST.format(items=self.items), low=self.low, high=self.high, note=Sentence(self.note)),
        )
        return None

    def read_records(self, node: Node) -> list[Node]:
        """The items, which are records; none, and the faults recorded, where one of them is not such an object."""
        items = self.read(node) or []
        well = [isinstance(self.item, Record | Variants) and self.item.read(item) for item in items]
        return items if all(well) else []

    def read_rows(self, node: Node, *columns: Parameter) -> list[list[float]]:
        """Rows with a number for each of ``columns``; those that are wrong are noted and left out."""
        given = self.read(node) or []
        rows: list[list[float]] = []
        for row, cells in zip(given, _settled(given), strict=True):
            if len(cells) != len(columns):
                two = len(columns) == 2
                row.refuse("wrong-type",
                           "must be a row of two numbers" if two
                           else Sentence("must be a row of {count} numbers", count=str(len(columns))),
                           allowed=f"[{', '.join(column.path for column in columns)}]")  # fmt: skip
                continue
            read = [cell.number(column) for cell, column in zip(cells, columns, strict=True)]
            rows.append([number for number in read if number is not None])
        full = [row.parts() for row in node.parts() if isinstance(row.value, list) and len(row.value) == len(columns)]
        mixed = [refuse_mixed([row[k] for row in full], column.unit) for k, column in enumerate(columns)]
        return [] if any(mixed) else [row for row in rows if len(row) == len(columns)]

    def schema(self) -> Schema:
        """Its JSON Schema."""
        schema: Schema = {"description": self.help} if self.help else {}
        least = {"minItems": self.low} if self.low else {}
        listed = {"type": "array", **least, "maxItems": self.high, "items": schema_of(self.item), **schema}
        return {"anyOf": [listed, _IN_ONE_TEXT]} if self.text else listed


#: What a record is made of; a plain dictionary is the JSON Schema of what is read in a way of its own.
Field = Union["Described", "Listed", "Record", "Variants", Parameter, Schema]


def schema_of(field: Field) -> Schema:
    """The JSON Schema of a field."""
    if isinstance(field, dict):
        return field
    return quantity_schema(field) if isinstance(field, Parameter) else field.schema()


@dataclass(frozen=True, slots=True)
class Record:
    """An object of a spec.

    Attributes
    ----------
    fields : its fields by name
    help : what it means
    required : the fields that it must have
    either : fields of which it must have exactly one
    some : fields of which it must have one or more
    """

    fields: Mapping[str, Field]
    help: str = ""
    required: Sequence[str] = ()
    either: Sequence[str] = ()
    some: Sequence[str] = ()

    @property
    def described(self) -> dict[str, Described]:
        """The fields that are read, and shown in the form, by their descriptions alone."""
        return {name: field for name, field in self.fields.items() if isinstance(field, Described)}

    @property
    def listed(self) -> dict[str, Listed]:
        """The fields that are lists."""
        return {name: field for name, field in self.fields.items() if isinstance(field, Listed)}

    def read(self, node: Node, *, null: bool = True) -> bool:
        """Whether ``node`` is an object, whose unknown fields are recorded; ``null`` stands for a missing one."""
        return node.has(tuple(self.fields), null=null)

    def items(self, node: Node, name: str) -> Sequence[Node]:
        """The items of the list ``name``; none, and a fault recorded, where it is invalid."""
        return self.listed[name].read(node[name]) or ()

    def values(self, node: Node) -> dict[str, Any]:
        """The values of the fields that are read by their descriptions alone; those of faulty ones are None."""
        return {name: field.read(node) for name, field in self.described.items()}

    def schema(self) -> Schema:
        """Its JSON Schema, in which it has no other fields."""
        properties = {name: schema_of(field) for name, field in self.fields.items()}
        schema = object_schema(properties, self.required, self.help)
        if self.some:
            schema["anyOf"] = [{"required": [name]} for name in self.some]
        return one_of(schema, self.either) if self.either else schema


@dataclass(frozen=True, slots=True)
class Variants:
    """A value that any of ``ways`` describes, or ``only`` one; an object of several kinds has the fields of all."""

    ways: Sequence[Field]
    help: str = ""
    only: bool = False

    def read(self, node: Node) -> bool:
        """Whether ``node`` is an object, whose fields that no kind has are recorded."""
        known = dict.fromkeys(name for way in self.ways if isinstance(way, Record) for name in way.fields)
        return node.has(tuple(known))

    def schema(self) -> Schema:
        """Its JSON Schema; that of a quantity where the first way is one."""
        described = {"description": self.help} if self.help else {}
        ways = [schema_of(way) for way in self.ways]
        if isinstance(self.ways[0], Parameter):
            return {**ways[0], "anyOf": [*ways[0]["anyOf"], *ways[1:]]}
        return {**described, "oneOf" if self.only else "anyOf": ways}


def below(field: Field, path: str) -> Field | None:
    """What describes the entry at a path of names, and of anything for an item of a list; None where nothing does."""
    found: Field | None = field
    for key in path.split("."):
        if isinstance(found, Listed):
            found = found.item
            continue
        ways = found.ways if isinstance(found, Variants) else [found]
        records = [way for way in ways if isinstance(way, Record) and key in way.fields]
        found = records[0].fields[key] if records else None
    return found


def _settled(rows: Sequence[Node]) -> list[list[Node]]:
    """The cells of a table, their texts with decimal points; no cells for a row that is not a list.

    Points that could separate thousands are decimal, as in every text of a spec, with a warning; beside decimal commas
    they are a fault.
    """
    cells = [row.parts() if isinstance(row.value, list) else [] for row in rows]
    written = [cell for row in cells for cell in row if isinstance(cell.value, str)]
    texts, doubt = settle([cell.value for cell in written])
    if doubt is not None:
        cell = written[doubt]
        if any(text != cell.value for cell, text in zip(written, texts, strict=True)):
            cell.refuse("ambiguous-point", question(cell.value), allowed=WITHOUT_DOUBT)
        else:
            cell.report.warn("ambiguous-point", cell.pointer, assumption(cell.value))
    for cell, text in zip(written, texts, strict=True):
        cell.value = text
    return cells


def choice(
    name: str,
    help: str,
    *values: str,
    default: str | None = None,
    label: str = "",
    called: Mapping[str, str] | None = None,
) -> Described:
    """A field that is one of ``values``, in which the form has no part but what it and some of them are ``called``."""
    choices = tuple((value, (called or {}).get(value, value)) for value in values)
    return Described(name, label, help, "choice", default=default, choices=choices)


def named(*fields: Described) -> dict[str, Described]:
    return {field.name: field for field in fields}


_READINGS: Final = (
    ("contact", "until the clutch lets go (contact)"), ("literal", "anew at each overtaking (literal)")
)  # fmt: skip
_UNTIL: Final = "run each case until its motion is settled, unless the run has a duration or a window"
_AT_MOST: Final = "excitation periods after which the search for the settled motion ends"
_MAX_PERIOD: Final = "largest number of excitation periods after which a settled motion may repeat"
_SETTLED: Final = "scaled distance from its orbit below which a run counts as settled"
_DURATION: Final = (
    "end of the run, which then lasts for a given time: a number is seconds, a text says periods or a unit of time"
)
_TOLERANCE: Final = "local relative error of the integration"
_RESET: Final = "whether an upward crossing while torque is transmitted restarts the windup (literal)"
_LOADS: Final = (
    "whether the results have the forces on table and bearing and the duty of the clutches, with margins to their "
    "ratings, too; each case takes longer"
)
_LOADS_OF_SHAFTS: Final = (
    "whether the results have stroke, speed, acceleration and force of the working parts, the forces in the joints "
    "and the torques in the couplings, too; each case takes longer"
)
_BACKLASH: Final = "whether the angles include the backlash, which is then subtracted"

#: Fields of a run until it is settled.
SETTLED_RUN: Final = named(
    Described(
        "until", RUN_LABELS["until"], _UNTIL, "choice", 0, 0, SETTLED, ((SETTLED, "until its motion is settled"),)
    ),
    Described("at_most", RUN_LABELS["at_most"], _AT_MOST, "periods", MIN_SETTLED_PERIODS, MAX_SETTLED_PERIODS, 1000),
    Described("settled", RUN_LABELS["settled"], _SETTLED, "number", MIN_SETTLED, MAX_SETTLED, 1e-8),
    Described("max_period", RUN_LABELS["max_period"], _MAX_PERIOD, "whole", 1, MAX_ORBIT_PERIODS, 32),
)
DURATION: Final = Described("duration", RUN_LABELS["duration"], _DURATION, "time", default="60 periods")
#: Fields of every run.
ANY_RUN: Final = named(
    Described("tolerance", RUN_LABELS["tolerance"], _TOLERANCE, "number", MIN_TOLERANCE, MAX_TOLERANCE, 1e-9),
    Described("reset", RUN_LABELS["reset"], _RESET, "choice", default="contact", choices=_READINGS),
    Described("loads", RUN_LABELS["loads"], _LOADS, "flag", default=False),
)
#: Fields of the run of a machine shaft.
SHAFT_RUN: Final = named(Described("loads", LOADS_OF_SHAFTS, _LOADS_OF_SHAFTS, "flag", default=False))
#: Options of the fit of measured clutch data, besides the accuracy.
FIT: Final = named(
    Described("max_degree", "Highest degree", "highest degree that is tried", "whole", 1, MAX_COEFFICIENTS - 1, 7),
    Described("through_origin", "", "no torque at zero windup (c_1 = 0)", "flag", default=True),
    Described("angles_include_backlash", "", _BACKLASH, "flag", default=False),
)
