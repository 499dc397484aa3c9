"""The search of a form, `goal` of the spec: variables, goals, limits, operating points."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final

from sprag_study.service.http.web.form.entries import (
    Faults,
    Values,
    list_of,
    plain,
    text_of,
    unclear,
)
from sprag_study.service.http.web.form.machine import model_name
from sprag_study.service.http.web.form.parts import PARTS, count_of
from sprag_study.service.http.web.form.rows import field_of_row, filled, items_of_part, values_of_part
from sprag_study.service.languages import _
from sprag_study.service.reading.numbers import in_language, parse_number
from sprag_study.service.reading.together import with_last_unit
from sprag_study.service.reading.units import exact_quantity
from sprag_study.service.spec.kinds.goal import GOAL
from sprag_study.worker import models

if TYPE_CHECKING:
    from sprag_study.service.reading.reader import Reading

#: What a search asks for in a form that was not about one.
GOAL_DEFAULTS: Final[Values] = {
    "vary": "1",
    "best": "1",
    "subject_to": "0",
    "at": "0",
    "/goal/vary/0/way": "from",
    "/goal/best/0/toward": "max",
    "/goal/population": GOAL.described["population"].default_text,
    "/goal/generations": GOAL.described["generations"].default_text,
    "/goal/over": "worst",
    "/goal/polish": "on",
}
_NUMBERS: Final = ("population", "generations", "seed")


def goal_of(values: Mapping[str, str], faults: Faults) -> dict[str, Any]:
    """The search that a form asks for; ``faults``, by field, get what cannot be expressed in a spec."""
    found: dict[str, Any] = {"vary": items_of_part(values, "vary")}
    parts = {name: items_of_part(values, name) for name in ("best", "subject_to")} | {"at": _points(values, faults)}
    found |= {name: part for name, part in parts.items() if part}
    if values.get("/goal/over", "worst") != "worst":
        found["over"] = values["/goal/over"]
    found |= {name: plain(text) for name in _NUMBERS if (text := values.get(f"/goal/{name}", "").strip())}
    return found | ({} if values.get("/goal/polish") == "on" else {"polish": False})


def with_shown_units(values: Values, reading: Reading) -> None:
    """Give each bare number of a limit the unit that the page shows beside the name of its result."""
    for row, unit in _limits(values):
        own = [name for name in ("value", "within") if values.get(f"{row}/{name}", "").strip()]
        texts = with_last_unit([values[f"{row}/{name}"] for name in own])
        if reading.unit(unit) == unit:
            continue
        for name, text in zip(own, texts, strict=True):
            # A percentage is a share of the value there.
            if parse_number(in_language(text)) is not None and not (name == "within" and unit == "1"):
                values[f"{row}/{name}"] = reading.typed(text, unit)


def with_own_units(values: Mapping[str, str], reading: Reading) -> Values:
    """A form whose limits are not taken in the shown units: those that are bare numbers in SI have their unit."""
    shown = dict(values)
    for row, unit in _limits(values):
        if reading.unit(unit) == unit:
            continue
        for name in ("value",) if unit == "1" else ("value", "within"):
            number = parse_number(in_language(values.get(f"{row}/{name}", "")))
            if number is not None and math.isfinite(number):
                shown[f"{row}/{name}"] = exact_quantity(number, unit, "%" if unit == "1" else unit)
    return shown


def _limits(values: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """The rows of limits on numbers, with the SI unit of their result."""
    units = {entry.name: entry.unit for entry in models.result_catalogue(model_name(values)) if entry.kind == "real"}
    for index in range(count_of(values, "subject_to")):
        row = f"{PARTS['subject_to'].pointer}/{index}"
        name = re.sub(r"\.\d+\.", ".N.", values.get(f"{row}/result", ""))
        if name in units:
            yield row, units[name]


def _points(values: Mapping[str, str], faults: Faults) -> list[dict[str, Any]]:
    """The operating points: the lists of the parameters, value by value."""
    columns: dict[str, list[Any]] = {}
    for index in filled(values, "at"):
        pointer = f"/goal/at/{index}"
        path, column = values.get(f"{pointer}/path", ""), list_of(values.get(f"{pointer}/values", ""))
        if not path or path in columns:
            faults[f"{pointer}/path"] = [_("is a parameter of the points already") if path else _("is required")]
        first = next(iter(columns.values()), column)
        if not column:
            faults[f"{pointer}/values"] = [_("is required; allowed: one value for each operating point")]
        elif unclear(column):
            faults[f"{pointer}/values"] = [
                _("could be one value or several; allowed: semicolons between values, or no blanks")
            ]
        elif len(column) != len(first):
            message = _(
                "must have as many values as the first parameter, {first}; got {count}; allowed: one value for each "
                "operating point",
                first=len(first),
                count=len(column),
            )
            faults[f"{pointer}/values"] = [message]
        columns.setdefault(path, column)
    return [dict(zip(columns, point, strict=True)) for point in zip(*columns.values(), strict=False)]


def field_of_goal(pointer: str, values: Mapping[str, str]) -> str:
    """The field beside which a fault at ``pointer`` of the spec, in or below `/goal`, is shown."""
    match = re.fullmatch(r"/goal/([a-z_]+)/(\d+)(?:/(.*))?", pointer)
    if match is None:
        return pointer if pointer.rpartition("/")[2] in {*PARTS, *GOAL.described} else "/goal"
    part, place = match[1], int(match[2])
    if part == "at":
        rows, rest = filled(values, part), (match[3] or "").partition("/")[0]
        # A row of the form is a parameter, with its values at all points.
        column = next((row for row in rows if values.get(f"/goal/at/{row}/path") == rest), rows[0] if rows else 0)
        return f"/goal/at/{column}/values"
    return field_of_row(part, place, match[3] or "", values)


def goal_values(found: Mapping[str, Any]) -> Values:
    """The form's values for `goal` of a spec; raises ValueError where the form cannot show it."""
    if not set(found) <= {"vary", "best", "subject_to", "at", "over", "polish", *_NUMBERS}:
        raise ValueError("the form has no fields for all of this search")
    values: Values = {"/goal/over": str(found.get("over", "worst"))}
    values |= {"/goal/polish": "on"} if found.get("polish", True) else {}
    values |= {f"/goal/{name}": text_of(found[name]) for name in _NUMBERS if name in found}
    for name in ("vary", "best", "subject_to"):
        values |= values_of_part(name, found.get(name, ()))
    points = found.get("at", ())
    for index, path in enumerate(points[0] if points else ()):
        row = {"path": path, "values": "; ".join(text_of(point[path]) for point in points)}
        values |= {f"/goal/at/{index}/{name}": text for name, text in row.items()}
    return values | {"at": str(len(points[0]) if points else 0)}
