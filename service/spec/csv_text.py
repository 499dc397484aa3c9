"""Tables that a spec contains as the text of a CSV file: headings with units, then rows of as many cells.

Numbers may have decimal commas: always where semicolons separate the columns, otherwise where no comma is ambiguous.
"""

from __future__ import annotations

import csv
import io
import re
from typing import TYPE_CHECKING, Final, NamedTuple

from sprag.service.spec.numbers import settled_rows

if TYPE_CHECKING:
    from collections.abc import Collection

    from sprag.service.spec.report import Report

#: "shaft.load", "shaft.load [N*mm]", "shaft.load (N*mm)"
HEADING: Final = re.compile(r"\s*+([^\s\[\(]++)\s*+(?:[\[\(]\s*+([^\]\)]+?)\s*[\]\)]\s*+)?")
#: Characters of a heading, at most: the time that reading one takes grows faster than its length.
MAX_HEADING: Final = 200
#: Beginnings of text that a spreadsheet would interpret as a formula.
_FORMULA_STARTS: Final = ("=", "+", "-", "@", "\t", "\r")


class CsvRow(NamedTuple):
    """The cells of a row, and the number of the line in which it ends, from 1."""

    line: int
    cells: list[str]


def escape(text: str) -> str:
    """Escape text that a spreadsheet would interpret as a formula with an apostrophe; `unescape` is the inverse."""
    return "'" + text if text.lstrip("'").startswith(_FORMULA_STARTS) else text


def unescape(text: str) -> str:
    """The text that `escape` was given."""
    return text[1:] if text.startswith("'") and text.lstrip("'").startswith(_FORMULA_STARTS) else text


def read_csv(
    report: Report, where: str, text: object, most: tuple[int, int], example: str, texts: Collection[str] = ()
) -> list[CsvRow] | None:
    """The non-empty rows, the headings first, all of the same length, with decimal points for decimal commas.

    None, and the faults recorded, where invalid. ``most`` rows under the headings and columns are allowed. ``example``
    says what the text is, for its absence. Cells under the headings ``texts`` stay as they are written.
    """
    if not isinstance(text, str):
        message = "is required" if text is None else "must be the text of a CSV file"
        report.fault(where, "required" if text is None else "wrong-type", message, text, allowed=example)
        return None
    try:
        rows = _rows(text.removeprefix("\ufeff"), texts)
    except csv.Error as error:
        report.fault(where, "unreadable", f"is not CSV: {error}")
        return None
    columns = len(rows[0].cells) if rows else 0
    if not 2 <= len(rows) <= most[0] + 1 or not 1 <= columns <= most[1]:
        under = f"has {len(rows) - 1} lines of {columns} columns under its headings"
        report.fault(
            where, "out-of-range",
            "is empty" if not rows else "has no lines under its headings" if len(rows) == 1 else under,
            allowed=f"1 to {most[0]:,} lines of 1 to {most[1]:,} columns",
        )  # fmt: skip
        return None
    before = report.found
    for place, cell in enumerate(rows[0].cells, 1):
        if len(cell) > MAX_HEADING:
            message = f"the heading of column {place} has {len(cell):,} characters"
            report.fault(where, "out-of-range", message, allowed=f"at most {MAX_HEADING}")
    for row in rows[1:]:
        if len(row.cells) != columns:
            hint = "; with decimal commas, columns are separated by semicolons" if len(row.cells) > columns else ""
            message = f"line {row.line} has {len(row.cells)} cells"
            report.fault(where, "unequal-lengths", message, allowed=f"{columns} cells{hint}")
        if report.full:
            break
    return None if report.found > before else rows


def _rows(text: str, texts: Collection[str]) -> list[CsvRow]:
    """The non-empty rows. The header's separator (comma, semicolon or tab) applies to the whole text.

    Lines may end with LF, CRLF or CR.
    """
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    header = text.lstrip().partition("\n")[0]
    delimiter = next((sign for sign in ",;\t" if sign in header), ",")
    reader = csv.reader(io.StringIO(text), delimiter=delimiter, strict=True)
    rows = [CsvRow(reader.line_num, cells) for cells in reader if any(map(str.strip, cells))]
    if not rows or (delimiter == "," and '"' not in text):
        return rows
    kept = {place for place, heading in enumerate(rows[0].cells) if heading.strip() in texts}
    numbers = ([("" if i in kept else cell) for i, cell in enumerate(row.cells)] for row in rows[1:])
    below = settled_rows(numbers, decimal=delimiter == ";")
    return [
        rows[0],
        *(
            CsvRow(row.line, [row.cells[i] if i in kept else cell for i, cell in enumerate(cells)])
            for row, cells in zip(rows[1:], below, strict=True)
        ),
    ]
