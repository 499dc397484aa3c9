"""Tables as text, as instruments and spreadsheets write them: lines of units, decimal commas and decimal points."""

from __future__ import annotations

import itertools
import re
from typing import TYPE_CHECKING, Final, NamedTuple

from sprag_study.service.reading.numbers import settle, settled
from sprag_study.service.reading.units import QuantityError, measure
from sprag_study.service.table_rows import MAX_HEADING, CsvRow, heading_of

if TYPE_CHECKING:
    from collections.abc import Collection

    from sprag_study.service.table_rows import Split

#: What stands between the numbers of a cell, and between a number and its unit.
_BETWEEN: Final = re.compile(r"(,\s+|[;\s]+)")
_IN_BRACKETS: Final = re.compile(r"[\[\(]\s*(.*?)\s*[\]\)]")
#: What stands for a unit in a line of units where a column has none.
_NO_UNIT: Final = frozenset({"", "-", "--", "1"})


class Doubt(NamedTuple):
    """A cell whose point could be decimal or separate thousands, and its line.

    ``likely`` says that it is decimal in all likelihood: commas separate the columns, so no comma is decimal.
    """

    line: int
    text: str
    likely: bool


def with_units(rows: list[CsvRow]) -> list[CsvRow]:
    """The rows with a second line of units, such as ``deg;bar``, put in brackets into the headings."""
    if len(rows) < 2 or len(rows[0].cells) != len(rows[1].cells):
        return rows
    cells = [cell.strip() for cell in rows[1].cells]
    units = [own[1] if (own := _IN_BRACKETS.fullmatch(cell)) else cell for cell in cells]
    given = [unit for unit in units if unit not in _NO_UNIT]
    if not given or not all(map(_is_unit, given)):
        return rows
    if any(len(cell) > MAX_HEADING for cell in rows[0].cells):
        return rows
    headings = [heading_of(cell) for cell in rows[0].cells]
    if any(heading is None or heading[1] not in {"", unit} for heading, unit in zip(headings, units, strict=True)):
        return rows
    made = [
        f"{heading[0]} [{unit}]" if heading and unit not in _NO_UNIT else cell
        for cell, heading, unit in zip(rows[0].cells, headings, units, strict=True)
    ]
    return [CsvRow(rows[0].line, made), *rows[2:]]


def _is_unit(text: str) -> bool:
    try:
        measure(text)
    except QuantityError:
        return text == "%"
    return True


def settled_table(table: Split, texts: Collection[int] = ()) -> tuple[list[CsvRow], Doubt | None]:
    """The rows with decimal points, except for the columns ``texts``, and the first cell whose point is in doubt.

    A cell may have several numbers, such as the coefficients of a clutch.
    """
    pieces = [[] if i in texts else _pieces(cell) for row in table.rows for i, cell in enumerate(row.cells)]
    lines = [row.line for row in table.rows for _ in row.cells]
    numbers = [part for cell in pieces for part in cell]
    made, place = settle(numbers, decimal=table.separator == ";")
    doubt = None
    if place is not None:
        line = next(itertools.islice((n for n, cell in zip(lines, pieces, strict=True) for _ in cell), place, None))
        doubt = Doubt(line, numbers[place], table.separator == "," and not table.quoted)
    if made == numbers:
        return list(table.rows), doubt
    parts, cells = iter(made), iter(pieces)
    rows = []
    for row in table.rows:
        own = list(itertools.islice(cells, len(row.cells)))
        taken = [[*itertools.islice(parts, len(cell))] for cell in own]
        rows.append(CsvRow(row.line, [_joined(*one) for one in zip(row.cells, own, taken, strict=True)]))
    return rows, doubt


def _pieces(cell: str) -> list[str]:
    return _BETWEEN.split(cell) if any(sign in cell for sign in " ;\t\n") else [cell]


def _joined(text: str, pieces: list[str], made: list[str]) -> str:
    """A cell with its numbers as the table settles them; several that say so themselves stay as they are written."""
    if len(made) == 1:
        return made[0]
    return text if settled(pieces) == made else "".join(made)
