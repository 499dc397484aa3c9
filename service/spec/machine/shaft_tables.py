"""Tables of a machine shaft that are given as the text of a CSV file: two columns with headings and units."""

from __future__ import annotations

import re
from typing import Final

from sprag_study.sentences import Sentence, Typed
from sprag_study.service.faults import Fault
from sprag_study.service.reading.catalogue import range_sentence
from sprag_study.service.reading.numbers import is_ambiguous, parse_number
from sprag_study.service.reading.units import AmbiguousCommaError, QuantityError, has_unit, parse_exact, to_float
from sprag_study.service.spec.csv_text import Column, read_csv, refuse_in, refuse_mixed_column
from sprag_study.service.spec.node import Node, exact
from sprag_study.service.table_rows import heading_of
from sprag_study.worker.models import Parameter, machine_shaft

#: The end of a heading that may be a unit: ``angle_deg``, ``angle deg``, ``angle / deg``.
_LAST_WORD: Final = re.compile(r"[\s_/]([^\s_/]+)$")


def read_csv_rows(node: Node, *columns: Parameter) -> list[list[float]]:
    """Rows with an SI number for each of ``columns``; faults, with their lines, are recorded.

    A heading is a name and, in brackets or as its last word, a unit, which is SI where there is none: ``angle
    [deg],torque_kNm``. A fraction may be in percent.
    """
    such = ",".join(f"{column.path} [{column.unit}]" for column in columns)
    example = Sentence("headings, then at least two lines, as in {headings}", headings=such)
    rows = read_csv(node, (machine_shaft.MAX_ROWS, len(columns)), example)
    if rows is None:
        return []
    headings = [heading_of(cell) for cell in rows[0].cells]
    if len(headings) != len(columns) or None in headings:
        node.refuse(
            "wrong-type",
            Sentence("must have {count} columns with headings", count=str(len(columns))),
            None,
            allowed=example,
        )
        return []
    if any(parse_number(cell.replace(",", ".")) is not None for cell in rows[0].cells):
        node.refuse(
            "wrong-type",
            "must begin with headings: its first line has a number, which would be lost",
            ", ".join(rows[0].cells),
            allowed=example,
        )
        return []
    units = [unit_of_heading(*(heading or ("", "")), column) for heading, column in zip(headings, columns, strict=True)]
    before = node.report.found
    for unit, column in zip(units, columns, strict=True):
        if column.unit == "1":
            if unit not in {"", "1", "%"}:
                message = Sentence(
                    "the heading of column {column} has a unit, but its numbers have none", column=column.path
                )
                node.refuse("wrong-unit", message, unit, allowed="no unit, or %")
            continue
        try:
            parse_exact(f"1 {unit}" if unit else 1, column.unit)
        except QuantityError as error:
            message = Sentence("the heading of column {column} {error}", column=column.path, error=error.message)
            node.refuse(error.code, message, unit, unit=column.unit)
    for place, (unit, column) in enumerate(zip(units, columns, strict=True)):
        if not unit:
            refuse_mixed_column(node, rows[1:], Column(rows[0].cells[place].strip(), "", place), column.unit)
    if node.report.found > before:
        return []
    found: list[list[float]] = []
    for row in rows[1:]:
        numbers = [
            _read_cell(node, row.line, cell, unit, column)
            for cell, unit, column in zip(row.cells, units, columns, strict=True)
        ]
        found.append([number for number in numbers if number is not None])
    return found


def unit_of_heading(name: str, unit: str, column: Parameter) -> str:
    """The unit of a heading: that in brackets, or else its last word where this is a unit of the column."""
    word = _LAST_WORD.search(name)
    if unit or word is None:
        return unit
    try:
        parse_exact(f"1 {word[1]}" if column.unit != "1" else 1, column.unit)
    except QuantityError:
        return ""
    return word[1] if column.unit != "1" or word[1] == "%" else ""


def _read_cell(node: Node, line: int, cell: str, unit: str, column: Parameter) -> float | None:
    text = cell.strip()
    try:
        value: object = text if has_unit(text) else f"{text} {unit}"
        if column.unit == "1" or not (unit or has_unit(text)):
            number = parse_number(text)
            if number is None and is_ambiguous(text):
                raise AmbiguousCommaError
            if number is None:
                raise QuantityError("wrong-type", "is not a number")
            value = number / 100 if unit == "%" else number
        return to_float(exact(value, column))
    except QuantityError as error:
        message = error.message
        if not unit and column.unit != "1":
            message = Sentence(
                "{error}; without a unit in the heading it is in {unit}",
                error=message, unit=Typed(column.unit),
            )  # fmt: skip
        fault = Fault(None, error.code, message, cell, range_sentence(column), column.unit)
        refuse_in(node, line, column.path, fault)
        return None
