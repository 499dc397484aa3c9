"""Tables that a spec contains as the text of a CSV file: headings with units, then rows of as many cells."""

from __future__ import annotations

import csv
import io
import re
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from sprag.service.spec.report import Report

#: "shaft.load", "shaft.load [N*mm]", "shaft.load (N*mm)"
HEADING: Final = re.compile(r"\s*([^\s\[\(]+)\s*(?:[\[\(]\s*([^\]\)]+?)\s*[\]\)])?\s*")


class CsvRow(NamedTuple):
    """The cells of a row, and the number of the line in which it ends, from 1."""

    line: int
    cells: list[str]


def read_csv(report: Report, where: str, text: object, most: tuple[int, int], example: str) -> list[CsvRow] | None:
    """The non-empty rows, the headings first, all of the same length; None, and the faults recorded, where invalid.

    ``most`` rows under the headings and columns are allowed. ``example`` says what the text is, for its absence.
    """
    if not isinstance(text, str):
        message = "is required" if text is None else "must be the text of a CSV file"
        report.fault(where, "required" if text is None else "wrong-type", message, text, allowed=example)
        return None
    try:
        rows = _rows(text.removeprefix("\ufeff"))
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
    for row in rows[1:]:
        if len(row.cells) != columns:
            hint = "; with decimal commas, columns are separated by semicolons" if len(row.cells) > columns else ""
            message = f"line {row.line} has {len(row.cells)} cells"
            report.fault(where, "unequal-lengths", message, allowed=f"{columns} cells{hint}")
        if report.full:
            break
    return None if report.found > before else rows


def _rows(text: str) -> list[CsvRow]:
    """The non-empty rows. The header's separator (comma, semicolon or tab) applies to the whole text.

    Lines may end with LF, CRLF or CR.
    """
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    header = text.lstrip().partition("\n")[0]
    delimiter = next((sign for sign in ",;\t" if sign in header), ",")
    reader = csv.reader(io.StringIO(text), delimiter=delimiter, strict=True)
    return [CsvRow(reader.line_num, cells) for cells in reader if any(map(str.strip, cells))]
