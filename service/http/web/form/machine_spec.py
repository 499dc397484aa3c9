"""The machine of a form as ``base`` of a spec, and back: the same fields there and back."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, Final

from sprag_study.service.faults import Fault
from sprag_study.service.http.web.form.element_lines import elements_of, lines_of
from sprag_study.service.http.web.form.entries import (
    Faults,
    Values,
    entries_of,
    items_of,
    plain,
    text_of,
)
from sprag_study.service.http.web.form.machine import BASE, Entry, entries, form_of, rows_of
from sprag_study.service.http.web.form.walk import Filled
from sprag_study.service.languages import N_, _, gettext
from sprag_study.service.reading.faults import allowed_text, fault_text
from sprag_study.service.reading.numbers import parse_number
from sprag_study.service.reading.part_names import lower_first
from sprag_study.service.reading.printed import could_be_several
from sprag_study.service.reading.together import with_last_unit
from sprag_study.service.reading.units import QuantityError, parse_quantity, split_typed
from sprag_study.service.reading.wording import unit_text
from sprag_study.service.spec.derive import formulas_of, with_values
from sprag_study.service.spec.fields import base_path, base_pointer
from sprag_study.service.spec.measured import MeasuredDataError, parse_measured
from sprag_study.service.spec.node import Node
from sprag_study.service.spec.report import Report, join
from sprag_study.worker.models.form import FormChoice, FormField

#: Beginning of a field with the formula of a derived parameter.
FORMULA: Final = "="
_STEP: Final = (N_("from"), N_("to"), N_("value"))
#: Headings and SI units of the columns of tables.
_COLUMNS: Final = {
    "angle": ("angle", "rad"), "stroke": ("fraction", "1"), "time": ("time", "s"), "speed": ("speed", "rad/s"),
    "force": ("force", "N"), "torque": ("torque", "N*m"), "inertia": ("inertia", "kg*m^2"),
    "pressure": ("pressure", "Pa"), "order": ("order", "1"),
    **{f"amplitude_{axis}": (f"amplitude {axis}", "m") for axis in "xy"},
    **{f"phase_{axis}": (f"phase {axis}", "rad") for axis in "xy"},
    **{f"displacement_{axis}": (axis, "m") for axis in "xy"},
    **{f"acceleration_{axis}": (axis, "m/s^2") for axis in "xy"},
}  # fmt: skip


class Machine:
    """The base of a spec, with the formulas of its numbers."""

    def entries(self, form: Filled) -> dict[str, Any]:
        """As of a `Member`."""
        base = base_of(form.values, form.faults)
        # What is wrong with an object is shown beside its first field, not beside a choice in it.
        every = sorted(entries(form.values), key=lambda entry: isinstance(entry.item, FormChoice))
        form.fields |= {entry.name: entry.name for entry in every}
        derive = _formulas(base)
        for path in derive:
            form.fields[join("/derive", path)] = form.field_of(base_pointer(path))
        return {"base": base, **({"derive": derive} if derive else {})}

    def show(self, item: Mapping[str, Any], form: Filled) -> set[str]:
        """As of a `Member`."""
        formulas = {path: f"{FORMULA} {text}" for path, text in formulas_of(item).items()}
        values_of_base(with_values(item["base"], formulas), form.values)
        return {"base", "derive"}


def _formulas(base: dict[str, Any]) -> dict[str, str]:
    """Take the formulas out of ``base``: they are texts that begin with an equals sign."""
    formulas: dict[str, str] = {}

    def take(place: Any, prefix: str) -> None:
        for key, value in list(place.items() if isinstance(place, dict) else enumerate(place)):
            if isinstance(value, dict | list):
                take(value, f"{prefix}{key}.")
            elif isinstance(value, str) and value.startswith(FORMULA):
                formulas[f"{prefix}{key}"] = value.removeprefix(FORMULA).strip()
                if isinstance(place, dict):
                    del place[key]
                else:
                    place[key] = None

    take(base, "")
    return formulas


def base_of(values: Mapping[str, str], faults: Faults) -> dict[str, Any]:
    """The base of a filled form; ``faults`` gets what cannot be expressed, by field."""
    base: dict[str, Any] = {}
    for entry in entries(values):
        if isinstance(entry.item, FormChoice):
            option = entry.option(values)
            if option.is_kind:
                _opened(base, f"{entry.place}/{option.at}/kind")["kind"] = option.value
            continue
        text = values.get(entry.name, "") or (entry.chosen(values) if entry.field.choices else "")
        name = entry.name.rpartition("/")[2]
        required = entry.field.required
        if text.strip() or entry.item.kind in {"tick", "measured"} or (required and entry.item.kind == "table"):
            _opened(base, entry.name)[name] = _read(entry, text, faults)
        elif required:
            _opened(base, entry.name)
    for rows in form_of(values).lists:
        count = rows_of(values, rows)
        if count:
            _opened(base, f"{BASE}/{rows.at}/{count - 1}/")
    return base


def _opened(base: dict[str, Any], pointer: str) -> dict[str, Any]:
    """The object in which the entry at ``pointer`` is, with the objects and rows around it."""
    place: Any = base
    for key, following in pairwise(pointer.removeprefix(f"{BASE}/").split("/")):
        if isinstance(place, list):
            place += [{} for _ in range(len(place), int(key) + 1)]
            place = place[int(key)]
        else:
            place = place.setdefault(key, [] if following.isdigit() else {})
    found: dict[str, Any] = place
    return found


def _read(entry: Entry, text: str, faults: Faults) -> Any:
    """The text of a field for the spec."""
    assert isinstance(entry.item, FormField)
    match entry.item.kind:
        case "tick":
            return text == "on"
        case "list":
            return _coefficients(entry.name, text, faults)
        case "measured":
            return _measured(entry.name, text, faults)
        case "constants":
            return _constants(entry.name, text, faults)
        case "steps":
            return _steps(text)
        case "elements":
            wrong: list[str] = []
            elements = elements_of(text, wrong)
            faults.update({entry.name: wrong} if wrong else {})
            return elements
        case "text" | "table":
            return text.strip()
    return text.strip() if entry.field.choices else plain(text)


def _coefficients(name: str, text: str, faults: Faults) -> list[Any]:
    # Blanks also separate numbers, where there is no unit among them.
    if could_be_several(text):
        faults[name] = [
            _("could be one coefficient or several; allowed: semicolons between coefficients, or no blanks")
        ]
    elif re.fullmatch(r"(?:[-+0-9.eE\s]|,[0-9])+", text):
        text = "; ".join(text.split())
    # Each coefficient has a unit of its own: that of the last one holds for no other.
    return entries_of(items_of(text))


def _measured(name: str, text: str, faults: Faults) -> list[list[float]] | None:
    if not text.strip():
        return None
    try:
        rows: list[list[float]] = parse_measured(text).rows.tolist()
    except MeasuredDataError as error:
        faults[name] = [_fault_text(fault) for fault in error.faults]
        return None
    return rows


def _fault_text(fault: Fault) -> str:
    """A fault of measured data as a sentence: the line, the fault, the value, what is allowed."""
    line = re.fullmatch(r"line (\d+)", fault.where or "")
    place = _("line {line}", line=line[1]) if line else _("the table")
    parts = [f"{place}: {lower_first(fault_text(fault))}"]
    if fault.value is not None:
        parts.append(gettext("got {value}", value=fault.value))
    if fault.allowed:
        parts.append(gettext("allowed: {allowed}", allowed=unit_text(allowed_text(fault.allowed))))
    return "; ".join(parts)


def _constants(name: str, text: str, faults: Faults) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for number, line in enumerate(text.splitlines(), start=1):
        key, equals, value = line.partition("=")
        if line.strip() and not equals:
            message = _(
                "line {number} has no equals sign; got {line}; allowed: lines such as k = 40",
                number=number,
                line=line.strip(),
            )
            faults.setdefault(name, []).append(message)
        elif line.strip():
            found[key.strip()] = plain(value)
    return found


def _steps(text: str) -> list[dict[str, Any]]:
    """The steps of an operation, one a line; a unit at the end of a column holds for the bare numbers above it."""
    rows = [[text.strip() for text in line.split(";")] for line in text.splitlines() if line.strip()]
    places = iter(with_last_unit([text for row in rows for text in row[:2]]))
    levels = iter(with_last_unit([text for row in rows for text in row[2:3]]))
    return [_step([*(next(places) for _ in row[:2]), *(next(levels) for _ in row[2:3]), *row[3:]]) for row in rows]


def _step(texts: list[str]) -> dict[str, Any]:
    """One step of an operation; what is missing is reported by the reader of the spec."""
    found = {name: plain(text) for name, text in zip(_STEP, texts, strict=False) if text}
    return found | ({"further": "; ".join(texts[3:])} if len(texts) > len(_STEP) else {})


def step_of(pointer: str) -> str:
    """What is at fault within a field of steps, for its message: ``step 2, from: ``; "" elsewhere."""
    found = re.fullmatch(r".*/steps/(\d+)(?:/(\w+))?", pointer)
    if found is None:
        return ""
    step = _("step {number}", number=int(found[1]) + 1)
    return f"{step}, {gettext(found[2])}: " if found[2] else f"{step}: "


def values_of_base(base: Mapping[str, Any], values: Values) -> None:
    """Add the form's values for a base to those of a form of its model; raises ValueError where it cannot show it."""
    for rows in form_of(values).lists:
        found = _at(base, f"{BASE}/{rows.at}")
        if isinstance(found, list):
            values[rows.name] = str(len(found))
    before: Values = {}
    while before != values:  # a choice decides about other fields
        before = dict(values)
        for entry in entries(before, hidden=True):
            text = _text(entry, base)
            if text is not None:
                values[entry.name] = text
    implied = {
        f"{entry.place}/{name}"
        for entry in entries(values)
        if isinstance(entry.item, FormChoice)
        for name, value in entry.option(values).implies.items()
        if _at(base, f"{entry.place}/{name}") == value
    }
    if not set(_leaves(base)) <= {*_leaves(base_of(values, {})), *implied}:
        raise ValueError("the form has no fields for all of this machine")


def _leaves(value: Any, pointer: str = BASE) -> Iterator[str]:
    """Pointers of what is no object and no row; a table of rows is that of its text."""
    rows = isinstance(value, list) and all(isinstance(item, Mapping) for item in value) and value
    if isinstance(value, Mapping) or rows:
        for key, item in value.items() if isinstance(value, Mapping) else enumerate(value):
            yield from _leaves(item, f"{pointer}/{key}")
    elif value is not None and value != []:
        yield re.sub("/table$", "/csv", pointer)


def _at(base: Any, pointer: str) -> Any:
    """The entry at a pointer of a base; None where it has none."""
    return Node(Report(), BASE, base).below(base_path(pointer)).value


def _text(entry: Entry, base: Mapping[str, Any]) -> str | None:
    """The text of a field for what a base has; None where it has nothing."""
    if isinstance(entry.item, FormChoice):
        chosen = entry.item.options[0].value
        for option in entry.item.options:
            at = f"{entry.place}/{option.at}" + ("/kind" if option.is_kind else "")
            value = _at(base, at) or (_at(base, re.sub("/csv$", "/table", at)) if option.at else None)
            if option.at and value is not None and (not option.is_kind or value == option.value):
                chosen = option.value
        return chosen
    value = _at(base, entry.name)
    match entry.item.kind:
        case "tick":
            on = entry.item.default == "on" if value is None else value
            return "on" if on else None
        case "table" if value is None:
            rows = _at(base, re.sub("/csv$", "/table", entry.name))
            names = [
                str(_at(base, f"{entry.place}/{name[1:]}") or "angle") if name.startswith("@") else name
                for name in entry.item.columns
            ]
            return None if rows is None else _table(names, rows, ",")
    if value is None:
        return None
    match entry.item.kind:
        case "list":
            return "; ".join(map(text_of, value))
        case "measured":
            return _table(("angle", "torque"), value, "\t")
        case "constants":
            return "\n".join(f"{name} = {text_of(item)}" for name, item in value.items())
        case "steps":
            return "\n".join("; ".join(text_of(step[name]) for name in _STEP) for step in value)
        case "elements":
            return lines_of(value)
    if isinstance(value, Mapping | list):
        raise ValueError("the form has no fields for all of this machine")
    return text_of(value)


def _table(names: Sequence[str], rows: Sequence[Sequence[Any]], separator: str) -> str:
    """Rows as a table: each column as it was typed where all of it has one unit, otherwise in SI."""
    columns = [_column(name, cells, separator) for name, cells in zip(names, zip(*rows, strict=True), strict=True)]
    return "\n".join(separator.join(cells) for cells in zip(*columns, strict=True))


def _column(name: str, cells: Sequence[Any], separator: str) -> list[str]:
    """Heading and numbers of a column of quantities, of the first of several names (``angle|time``) that fits them.

    Raises
    ------
    QuantityError
        If none fits.
    """
    first, _, further = name.partition("|")
    heading, si = _COLUMNS[first]
    try:
        numbers = [parse_quantity(cell, si) for cell in cells]
    except QuantityError:
        if further:
            return _column(further, cells, separator)
        raise
    units = {split_typed(cell)[1] if isinstance(cell, str) else "" for cell in cells}
    if si != "1" and len(units) == 1 and (unit := units.pop()):
        typed = [cell.strip().removesuffix(unit).strip() for cell in cells]
        # A sign that separates thousands could be read as the end of a cell.
        if all(parse_number(text) is not None and len(text.split()) == 1 and separator not in text for text in typed):
            return [f"{heading} [{unit}]", *typed]
    if si != "1":
        heading += f" [{si}]" if separator == "," else f"_{si.replace('*', '')}"
    return [heading, *map(repr, numbers)]
