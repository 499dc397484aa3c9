"""Fields and lists of a spec that are not parameters, each described once for reader, JSON Schema and form."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

from sprag.sentences import Sentence
from sprag.service.reading.numbers import WITHOUT_DOUBT, assumption, question, settle
from sprag.service.reading.part_names import RUN_LABELS
from sprag.service.spec.fields import read_choice, read_flag, read_number, read_periods, read_plain, read_whole
from sprag.service.spec.lists import refuse_mixed
from sprag.service.spec.report import Report, join
from sprag.worker.limits import (
    MAX_ORBIT_PERIODS,
    MAX_SETTLED,
    MAX_SETTLED_PERIODS,
    MAX_TOLERANCE,
    MIN_SETTLED,
    MIN_SETTLED_PERIODS,
    MIN_TOLERANCE,
)
from sprag.worker.models import MAX_COEFFICIENTS, SETTLED, Parameter

#: What is said about a list that is none, and what is allowed; the catalogue has these texts for the items of each.
NO_LIST: Final = "must be a list of {items}"
A_LIST: Final = "a list of {{low}} to {{high}} {items}{{note}}"


@dataclass(frozen=True, slots=True)
class Described:
    """One field.

    Attributes
    ----------
    name, label, help : its name, its label in the form, and its meaning
    kind : "whole" and "number", from ``low`` to ``high``; "periods", a text with a whole number of periods; "time", a
        number of seconds or a text; "text", a number or a text within ``limits``; "flag"; "choice", one of ``choices``:
        values and their labels in the form
    default : what stands for a field that is not given; None where it is required or its absence means something
    """

    name: str
    label: str
    help: str
    kind: Literal["whole", "number", "periods", "time", "text", "flag", "choice"]
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

    def read(self, report: Report, pointer: str, found: Mapping[str, Any]) -> Any:
        """Its value in the object ``found`` at ``pointer``; None, and a problem noted, when it is wrong or missing.

        Times are read where the frequencies of a study are known, texts beside their descriptions.
        """
        given = self.name in found
        if not given and self.default is not None:
            return self.default
        where, value = join(pointer, self.name), found.get(self.name)
        match self.kind:
            case "choice":
                return read_choice(report, where, value, self.values, given=given)
            case "flag":
                return read_flag(report, where, value)
            case "number":
                return read_plain(report, where, value, self.low, self.high)
        read = read_periods if self.kind == "periods" else read_whole
        return read(report, where, value, int(self.low), int(self.high))

    def schema(self) -> dict[str, Any]:
        """Its JSON Schema."""
        schema: dict[str, Any] = {"description": self.help} if self.help else {}
        if self.kind == "periods":
            schema["description"] += f": {self.low:,} to {self.high:,}"
            return {"type": "string", "examples": [self.default_text], "default": self.default_text, **schema}
        if self.kind == "time":
            return {"type": ["number", "string"], "examples": ["60 periods", "2 s", 2.0], "minimum": 0, **schema}
        if self.kind == "text":
            return {"type": ["number", "string"], "default": self.default, "description": f"{self.help}: {self.limits}"}
        if self.default is not None:
            schema["default"] = self.default
        if self.kind == "choice":
            return {"enum": list(self.values), **schema}
        if self.kind == "flag":
            return {"type": "boolean", **schema}
        kind = "integer" if self.kind == "whole" else "number"
        return {"type": kind, "minimum": self.low, "maximum": self.high, **schema}


@dataclass(frozen=True, slots=True)
class Listed:
    """A list of ``low`` to ``high`` ``items`` (what they are called); ``help`` says what it means.

    ``note`` is said to those who gave another thing.
    """

    items: str
    low: int
    high: int
    help: str = ""
    note: str = ""

    def read(self, report: Report, pointer: str, data: object) -> list[Any] | None:
        """The list; None, and a fault noted, when it is not one or has too few or too many items."""
        if isinstance(data, list) and self.low <= len(data) <= self.high:
            return data
        missing = data is None and self.low > 0
        report.fault(
            pointer,
            "required" if missing else "wrong-type",
            "is required" if missing else Sentence(NO_LIST.format(items=self.items)),
            data,
            allowed=Sentence(
                A_LIST.format(items=self.items),
                low=self.low,
                high=self.high,
                note=Sentence(self.note),
            ),
        )
        return None

    def read_rows(self, report: Report, pointer: str, data: object, *columns: Parameter) -> list[list[float]]:
        """Rows with a number for each of ``columns``; those that are wrong are noted and left out."""
        allowed = f"[{', '.join(column.path for column in columns)}]"
        rows: list[list[float]] = []
        given = self.read(report, pointer, data) or []
        written = _settled(report, pointer, given)
        for index, row in enumerate(given):
            where = join(pointer, index)
            if not isinstance(row, list) or len(row) != len(columns):
                report.fault(where, "wrong-type", "must be a row of two numbers", row, allowed=allowed)
                continue
            read = [read_number(report, join(where, k), written[index][k], own) for k, own in enumerate(columns)]
            numbers = [number for number in read if number is not None]
            if len(numbers) == len(columns):
                rows.append(numbers)
        return rows if not self._mixed(report, pointer, data, columns) else []

    def _mixed(self, report: Report, pointer: str, data: object, columns: Sequence[Parameter]) -> bool:
        """Whether a column has bare numbers beside quantities of another scale; each is recorded as a fault."""
        rows = [(index, row) for index, row in enumerate(data if isinstance(data, list) else ())
                if isinstance(row, list) and len(row) == len(columns)]  # fmt: skip
        before = report.found
        for k, column in enumerate(columns):
            refuse_mixed(report, [(join(pointer, index, k), row[k]) for index, row in rows], column.unit)
        return report.found > before

    def schema(self, item: dict[str, Any]) -> dict[str, Any]:
        """Its JSON Schema, ``item`` being that of each item."""
        schema = {"description": self.help} if self.help else {}
        least = {"minItems": self.low} if self.low else {}
        return {"type": "array", **least, "maxItems": self.high, "items": item, **schema}


def _settled(report: Report, pointer: str, rows: list[Any]) -> list[list[Any]]:
    """The rows of a table, their texts with decimal points.

    Points that could separate thousands are decimal, as in every text of a spec, with a warning; beside decimal commas
    they are a fault.
    """
    places = [
        (i, k)
        for i, row in enumerate(rows)
        for k, cell in enumerate(row if isinstance(row, list) else ())
        if isinstance(cell, str)
    ]
    texts, doubt = settle([rows[i][k] for i, k in places])
    if doubt is not None:
        i, k = places[doubt]
        where, text = join(pointer, i, k), rows[i][k]
        if any(own != rows[i][k] for (i, k), own in zip(places, texts, strict=True)):
            report.fault(where, "ambiguous-point", question(text), text, allowed=WITHOUT_DOUBT)
        else:
            report.warn("ambiguous-point", where, assumption(text))
    made = [list(row) if isinstance(row, list) else [] for row in rows]
    for (i, k), text in zip(places, texts, strict=True):
        made[i][k] = text
    return made


def choice(name: str, help: str, *values: str, default: str | None = None) -> Described:
    """A field that is one of ``values``, in which the form has no part."""
    return Described(name, "", help, "choice", default=default, choices=tuple((value, value) for value in values))


def schemas(fields: dict[str, Described]) -> dict[str, Any]:
    """JSON Schemas by name."""
    return {name: field.schema() for name, field in fields.items()}


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
)
#: Options of the fit of measured clutch data, besides the accuracy.
FIT: Final = named(
    Described("max_degree", "Highest degree", "highest degree that is tried", "whole", 1, MAX_COEFFICIENTS - 1, 7),
    Described("through_origin", "", "no torque at zero windup (c_1 = 0)", "flag", default=True),
    Described("angles_include_backlash", "", _BACKLASH, "flag", default=False),
)
