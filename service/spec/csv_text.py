"""Tables that a spec contains as the text of a CSV file: headings with units, then rows of as many cells.

Numbers may have decimal commas: always where semicolons separate the columns, otherwise where no comma is ambiguous.
"""

from __future__ import annotations

import csv
import math
import re
from dataclasses import replace
from typing import TYPE_CHECKING, Final, NamedTuple

from sprag_study.sentences import Sentence, joined, plural
from sprag_study.service.faults import Fault
from sprag_study.service.languages import N_
from sprag_study.service.reading.catalogue import range_sentence
from sprag_study.service.reading.limits import at_most
from sprag_study.service.reading.numbers import WITHOUT_DOUBT, assumption, of_line, parse_number, question
from sprag_study.service.reading.texts import shorten_text
from sprag_study.service.reading.together import AMBIGUOUS_UNIT, questions
from sprag_study.service.reading.units import QuantityError, to_float
from sprag_study.service.spec.node import exact
from sprag_study.service.spec.table_text import settled_table, with_units
from sprag_study.service.table_rows import MAX_HEADING, CsvRow, Split, split

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from sprag_study.service.spec.node import Node
    from sprag_study.worker.models import Parameter

#: Beginnings of text that a spreadsheet would interpret as a formula.
_FORMULA_STARTS: Final = ("=", "+", "-", "@", "\t", "\r")
#: What Python says of quotes that are not closed, and of signs behind them.
_OF_CSV: Final = (
    N_("unexpected end of data"), N_("',' expected after '\"'"), N_("';' expected after '\"'"),
    N_("'\t' expected after '\"'"),
)  # fmt: skip
#: A unit behind a number. Of most cells there is none, and reading one as a quantity takes longer.
_WITH_UNIT: Final = re.compile(r"[0-9.]\s*(?:[^\W\d_eE]|[eE](?![-+0-9])|[^\w\s.,;+-])")


#: The part of a message that is about the first of several lines; lines that it lists, and the sign for others.
_FIRST: Final = "first"
_LISTED: Final = 3
_MORE: Final = ", …"


def escape(text: str) -> str:
    """Escape text that a spreadsheet would interpret as a formula with an apostrophe; `unescape` is the inverse."""
    return "'" + text if text.lstrip("'").startswith(_FORMULA_STARTS) else text


def unescape(text: str) -> str:
    """The text that `escape` was given."""
    return text[1:] if text.startswith("'") and text.lstrip("'").startswith(_FORMULA_STARTS) else text


def read_csv(node: Node, most: tuple[int, int], example: str, texts: Collection[str] = ()) -> list[CsvRow] | None:
    """The non-empty rows, the headings first, all of the same length, with decimal points for decimal commas.

    None, and the faults recorded, where invalid. ``most`` rows under the headings and columns are allowed. ``example``
    says what the text is, for its absence. Cells under the headings ``texts`` stay as they are written.
    """
    text = node.value
    if not isinstance(text, str):
        node.mistake("must be the text of a CSV file", allowed=example)
        return None
    try:
        table = split(text)
    except csv.Error as error:
        node.refuse("unreadable", not_csv(error), None)
        return None
    rows = with_units(table.rows)
    if not rows:
        node.refuse("out-of-range", "is empty", None, allowed=example)
        return None
    columns = len(rows[0].cells)
    if not 2 <= len(rows) <= most[0] + 1 or not 1 <= columns <= most[1]:
        size = {"lines": str(len(rows) - 1), "columns": str(columns)}
        under = Sentence("has {lines} lines of {columns} columns under its headings", **size)
        node.refuse(
            "out-of-range",
            "has no lines under its headings" if len(rows) == 1 else under,
            None,
            allowed=Sentence("1 to {lines} lines of 1 to {columns} columns", lines=most[0], columns=most[1]),
        )
        return None
    before = node.report.found
    for place, cell in enumerate(rows[0].cells, 1):
        if len(cell) > MAX_HEADING:
            message = plural(
                "the heading of column {place} has {count} character",
                "the heading of column {place} has {count} characters",
                len(cell), place=str(place),
            )  # fmt: skip
            node.refuse("out-of-range", message, None, allowed=at_most(MAX_HEADING))
    uneven = [row for row in rows[1:] if len(row.cells) != columns]
    if uneven:
        line, cells = uneven[0]
        message = plural("line {line} has {count} cell", "line {line} has {count} cells", len(cells), line=str(line))
        for row in uneven[1:]:
            message = with_further(message, row.line)
        allowed = plural("{count} cell", "{count} cells", columns)
        if any(len(row.cells) > columns for row in uneven):
            hint = Sentence("with decimal commas, columns are separated by semicolons")
            allowed = joined("; ", (allowed, hint))
        node.refuse("unequal-lengths", message, None, allowed=allowed)
    return None if node.report.found > before else _settled(node, table._replace(rows=rows), texts)


def not_csv(error: csv.Error) -> Sentence:
    """The message about a text whose quotes are not closed."""
    return Sentence("is not CSV: {error}", error=Sentence(str(error)))


def in_cell(line: int, message: str, column: str = "") -> Sentence:
    """A message about a line of a table, or about a cell of it."""
    if not isinstance(message, Sentence):
        message = Sentence(message)  # within another sentence it is translated too
    if not column:
        return Sentence("line {line}: {message}", line=str(line), message=message)
    return Sentence("line {line}, column {column}: {message}", line=str(line), column=column, message=message)


def has_units(text: str) -> bool:
    """Whether a cell, or a line of one that follows the headings of a table, has a unit behind a number."""
    return _WITH_UNIT.search(text) is not None


class Column(NamedTuple):
    """A column: its name, its unit ("" where it gives none) and its place."""

    name: str
    unit: str
    place: int

    def __str__(self) -> str:
        return self.name + (f" [{self.unit}]" if self.unit else "")

    def cell(self, row: CsvRow) -> str:
        """What a row has in this column."""
        return row.cells[self.place].strip()

    def quantity(self, cell: str) -> str | float:
        """A cell as a quantity: a number in the unit of the column (SI where there is none), or a text with its own."""
        if not cell:
            raise QuantityError("empty", "is empty")
        number = parse_number(cell)
        return cell if number is None else f"{cell} {self.unit}" if self.unit else number


def read_columns(node: Node, rows: Sequence[CsvRow], columns: Sequence[tuple[Column, Parameter]]) -> list[list[float]]:
    """The values (SI) of each parameter; fewer, or NaN, where they are invalid: faults are recorded line by line."""
    values: list[list[float]] = [[] for _ in columns]
    mixed = [not own.unit and refuse_mixed_column(node, rows, own, parameter.unit) for own, parameter in columns]
    for row in () if any(mixed) else rows:
        for read, (column, parameter) in zip(values, columns, strict=True):
            try:
                read.append(to_float(exact(column.quantity(column.cell(row)), parameter)) + 0.0)
            except QuantityError as error:
                refuse_cell(node, row, column, error, range_sentence(parameter), parameter.unit)
                read.append(math.nan)
    return values


def refuse_cell(node: Node, row: CsvRow, column: Column, error: QuantityError, allowed: str, unit: str) -> None:
    """Record a fault of a cell, which is shown with the unit of its column."""
    cell = column.cell(row)
    written = f"{cell} {column.unit}" if column.unit and parse_number(cell) is not None else cell
    refuse_in(node, row.line, shorten_text(str(column)), Fault(None, error.code, error.message, written, allowed, unit))


def refuse_in(node: Node, line: int, column: str, fault: Fault) -> None:
    """Record a fault of a cell of the table ``node``; a further one of its column and code with the first."""
    report = node.report
    for place, known in enumerate(report.faults):
        parts = _first(known.message).parts
        alike = "line" in parts and parts.get("column", "") == column
        if alike and (known.where, known.code) == (node.pointer, fault.code):
            report.found += 1
            report.faults[place] = replace(known, message=with_further(known.message, line))
            return
    node.refuse(fault.code, in_cell(line, fault.message, column), fault.value, allowed=fault.allowed, unit=fault.unit)


def with_further(message: str, line: int) -> Sentence:
    """A message about a cell or a line, and that a further ``line`` has the same fault."""
    known = message.parts if isinstance(message, Sentence) and _FIRST in message.parts else {}
    count, lines = int(str(known.get("count", 0))) + 1, str(known.get("lines", ""))
    listed = (
        str(line) if not lines else f"{lines}, {line}" if count <= _LISTED else f"{lines.removesuffix(_MORE)}{_MORE}"
    )
    return plural("{first} (and {count} further like it, in line {lines})",
                  "{first} (and {count} further like it, in the lines {lines})",
                  count, first=_first(message), lines=listed)  # fmt: skip


def _first(message: str) -> Sentence:
    """A message without what it says about further lines."""
    sentence = message if isinstance(message, Sentence) else Sentence(message)
    first = sentence.parts.get(_FIRST, sentence)
    return first if isinstance(first, Sentence) else sentence


def refuse_mixed_column(node: Node, rows: Sequence[CsvRow], column: Column, unit: str) -> bool:
    """Record a fault where bare numbers of a column stand beside quantities in units of another scale.

    The heading has no unit, so that a bare number would be in ``unit`` (SI). It is the value of the fault, because a
    unit in it is the answer for all cells.
    """
    cells = [column.cell(row) for row in rows]
    if not any(map(has_units, cells)):
        return False
    values = list(dict.fromkeys(cells))
    asked = next(iter(questions(values, [unit] * len(values))), None)
    if asked is None:
        return False
    line, heading = rows[cells.index(values[asked.place])].line, column.name
    allowed = Sentence("a unit in the heading, as in {heading} [{unit}], or in each cell", heading=heading, unit=unit)
    node.refuse(AMBIGUOUS_UNIT, in_cell(line, asked.message, heading), heading, allowed=allowed, unit=unit)
    return True


def _settled(node: Node, table: Split, texts: Collection[str]) -> list[CsvRow] | None:
    """The rows with decimal points; None, and a fault recorded, where points could separate thousands."""
    kept = {place for place, heading in enumerate(table.rows[0].cells) if heading.strip() in texts}
    rows, doubt = settled_table(table._replace(rows=table.rows[1:]), kept)
    if doubt is not None and not doubt.likely:
        node.refuse("ambiguous-point", in_cell(doubt.line, question(doubt.text)), doubt.text, allowed=WITHOUT_DOUBT)
        return None
    if doubt is not None:
        node.report.warn("ambiguous-point", node.pointer, of_line(doubt.line, assumption(doubt.text)))
    return [table.rows[0], *rows]
