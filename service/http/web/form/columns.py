"""Columns of a spreadsheet, pasted into the form: an axis for each, which go together value by value."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from typing import Final

from sprag_study.service.http.web.form.entries import Faults, Values
from sprag_study.service.http.web.form.fields import Groups
from sprag_study.service.http.web.form.parts import count_of, drop
from sprag_study.service.http.web.form.spec import PARTS
from sprag_study.service.languages import ENGLISH, current, gettext
from sprag_study.service.reading.numbers import WITHOUT_DOUBT, is_ambiguous, parse_number, question, settled
from sprag_study.service.reading.texts import did_you_mean
from sprag_study.service.reading.wording import words
from sprag_study.service.spec.table_text import settled_table, with_units
from sprag_study.service.table_rows import MAX_HEADING, heading_of, split

#: The field into which columns are pasted.
COLUMNS: Final = "/columns"
_MOST_ROWS: Final = 2_000
#: Commas are decimal in cells of a spreadsheet, which puts tabs between them.
_SEPARATORS: Final = ("\t", ";")
_AXES: Final = PARTS["axes"]


def take_columns(values: Values, choices: Groups) -> Faults:
    """Replace the axes by the pasted columns, and empty the field; the faults, by field, where that is not possible.

    A first line without numbers names the parameters, by their paths or labels, with a unit in brackets where it is not
    the one beside the parameter. Without it the columns are values of the axes that there are, in their order.
    """
    try:
        table = split(values.get(COLUMNS, ""), _SEPARATORS)
    except csv.Error as error:
        return {COLUMNS: [gettext("is no table: {error}", error=error)]}
    if not table.rows:
        return {COLUMNS: [gettext("has no columns; paste cells of a spreadsheet, with a line of headings")]}
    named = all(map(_is_name, table.rows[0].cells))
    lines = with_units(table.rows) if named else table.rows
    rows = lines[named:]
    width = len(table.rows[0].cells)
    if not rows or len(rows) > _MOST_ROWS or width > _AXES.most:
        message = gettext(
            "has {lines} lines of {columns} columns; allowed: 1 to {most} lines of 1 to {widest} columns under the "
            "headings",
            lines=f"{len(rows):,}",
            columns=width,
            most=f"{_MOST_ROWS:,}",
            widest=_AXES.most,
        )
        return {COLUMNS: [message]}
    uneven = next((row.line for row in rows if len(row.cells) != width), None)
    if uneven is not None:
        message = gettext(
            "line {line} has another number of cells than the first one; allowed: {width}", line=uneven, width=width
        )
        return {COLUMNS: [message]}
    rows, doubt = settled_table(table._replace(rows=rows))
    if doubt is not None:
        return {COLUMNS: [f"line {doubt.line}, {doubt.text}: {question(doubt.text)}; allowed: {WITHOUT_DOUBT}"]}
    columns = list(zip(*(row.cells for row in rows), strict=True))
    if not named:
        return _into_axes(values, columns)
    found = [_named(heading.strip(), choices) for heading in lines[0].cells]
    faults = [fault for _, _, fault in found if fault]
    if faults:
        return {COLUMNS: faults}
    drop(values, f"{_AXES.pointer}/")
    values["axes"] = str(width)
    for index, ((path, unit, _), column) in enumerate(zip(found, columns, strict=True)):
        _fill(values, index, column, unit)
        values[f"{_AXES.pointer}/{index}/path"] = path
    _finish(values, width)
    return {}


def _into_axes(values: Values, columns: list[tuple[str, ...]]) -> Faults:
    """Columns without headings as the values of the axes that there are."""
    paths = [values.get(f"{_AXES.pointer}/{index}/path", "") for index in range(count_of(values, "axes"))]
    if len(paths) != len(columns) or not all(paths):
        message = gettext(
            "has {columns} columns without headings; allowed: a column for each of the {axes} axes, whose parameters "
            "are chosen, or headings such as shaft.load [N*m]",
            columns=len(columns),
            axes=len(paths),
        )
        return {COLUMNS: [message]}
    for index, column in enumerate(columns):
        _fill(values, index, column, "")
    _finish(values, len(columns))
    return {}


def _fill(values: Values, index: int, column: tuple[str, ...], unit: str) -> None:
    pointer = f"{_AXES.pointer}/{index}"
    # A decimal comma that stayed in a cell with a unit would prove that the points of the others separate thousands.
    cells = [settled([cell.strip()])[0] for cell in column]
    cells = [f"{cell} {unit}" if unit and _is_bare(cell) else cell for cell in cells]
    values[f"{pointer}/values"] = "; ".join(cells)


def _finish(values: Values, columns: int) -> None:
    if columns > 1:
        values["/combine"] = "zip"
    values[COLUMNS] = ""


def _is_bare(cell: str) -> bool:
    """Whether a cell is a number without a unit, also one whose comma the list of values has yet to settle."""
    return parse_number(cell.replace(",", ".") if is_ambiguous(cell) else cell) is not None


def _is_name(cell: str) -> bool:
    cell = cell.strip()
    return bool(re.match(r"[^\W\d]", cell)) and parse_number(cell) is None and not is_ambiguous(cell)


def _named(heading: str, choices: Groups) -> tuple[str, str, str]:
    """Path and unit of a column, and the fault of its heading."""
    if len(heading) > MAX_HEADING:
        message = gettext(
            "has a heading of {count} characters; allowed: at most {most}",
            count=f"{len(heading):,}",
            most=MAX_HEADING,
        )
        return "", "", message
    known: Mapping[str, str] = {
        name.lower(): choice.path
        for _, group in choices
        for choice in group
        for name in (words(choice.path), choice.path, choice.label)
    }
    name, unit = heading_of(heading) or ("", "")
    if name.lower() in known:
        return known[name.lower()], unit, ""
    paths = [choice.path for _, group in choices for choice in group]
    message = gettext(
        "'{heading}' names no parameter{hint}; allowed: a path, its unit in brackets",
        heading=heading,
        hint=did_you_mean(heading, paths) if current() == ENGLISH else "",
    )
    return "", "", message
