"""Tables as text, as instruments and spreadsheets write them: rows of cells, with decimal points.

Columns are separated by tabs, semicolons or commas, a comma also with blanks behind it, so that ``0,5, 1,25`` has two
cells. A first line ``sep=;`` names the separator. Cells may be in double quotes, and columns that are empty from the
first line to the last are left out, and so are comments (``#``) above the headings.
"""

from __future__ import annotations

import codecs
import csv
import io
import itertools
import re
from typing import TYPE_CHECKING, Final, NamedTuple

from sprag_study.service.reading.numbers import settle, settled
from sprag_study.service.reading.units import QuantityError, measure

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

#: Separators of columns; one is a comma with blanks behind it, between numbers with decimal commas.
SEPARATORS: Final = ("\t", ";", ", ", ",")
#: Characters of a heading, at most: the time that reading one takes grows faster than its length.
MAX_HEADING: Final = 200
_NAMED: Final = re.compile(r'\s*"?sep=([,;\t|])"?[,;\t|]*[^\S\n]*(?:\n|$)', re.IGNORECASE)
_CYRILLIC_WORD: Final = re.compile(r"(?<![^\W\d_])[\u0400-\u04ff]{2,}(?![^\W\d_])")
_BEGINS_WITH_NUMBER: Final = re.compile(r'\s*"?[+\-\u2212]?[.,]?[0-9]')
_QUOTED: Final = re.compile(r'"[^"]*"')
#: A heading: a name and, in brackets, a unit. Names may have blanks.
_HEADING: Final = re.compile(r"\s*+([^\[\(]*[^\[\(\s])\s*+(?:[\[\(]\s*+([^\]\)]+?)\s*[\]\)]\s*+)?")
#: What stands between the numbers of a cell, and between a number and its unit.
_BETWEEN: Final = re.compile(r"(,\s+|[;\s]+)")
_IN_BRACKETS: Final = re.compile(r"[\[\(]\s*(.*?)\s*[\]\)]")
#: What stands for a unit in a line of units where a column has none.
_NO_UNIT: Final = frozenset({"", "-", "--", "1"})


class CsvRow(NamedTuple):
    """The cells of a row, and the number of the line in which it ends, from 1."""

    line: int
    cells: list[str]


class Split(NamedTuple):
    """The non-empty rows of a table, as written, the sign between its columns, "" without any, and whether cells are
    quoted.
    """

    rows: list[CsvRow]
    separator: str
    quoted: bool = False


class Doubt(NamedTuple):
    """A cell whose point could be decimal or separate thousands, and its line.

    ``likely`` says that it is decimal in all likelihood: commas separate the columns, so no comma is decimal.
    """

    line: int
    text: str
    likely: bool


def decoded(data: bytes) -> str:
    """The text of a file: in UTF-8, in UTF-16 with a byte order mark, or in a code page of Windows.

    That is 1252, where degrees and accented letters are, or 1251 where whole words are Cyrillic.

    Raises
    ------
    UnicodeDecodeError
        When it is no text in any of them.
    """
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return data.decode("utf-16")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        cyrillic = _CYRILLIC_WORD.search(data.decode("cp1251", "replace"))
        if b"\0" in data:
            raise
        return data.decode("cp1251" if cyrillic else "cp1252")


def lines_of(text: str) -> str:
    """``text`` without a byte order mark, its lines, which may end with LF, CRLF or CR, ended by LF."""
    return text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")


def split(text: str, separators: Sequence[str] = SEPARATORS) -> Split:
    """The rows of a table. One separator, under which all rows have as many cells, applies to the whole text.

    Where there is none, it is the first of ``separators`` that the first line has.

    Raises
    ------
    csv.Error
        When quotes are not closed.
    """
    text = _without_comments(lines_of(text))
    named = _NAMED.match(text)
    if named is not None:
        before = "\n" * max(named[0].count("\n"), 1)
        return _even(_rows(before + text[named.end() :], named[1]), named[1], '"' in text)
    quoted = '"' in text
    first = _QUOTED.sub("", text.lstrip().partition("\n")[0])
    present = [sign for sign in separators if sign in first and not (sign == ", " and quoted)]
    for sign in present if len(present) > 1 else ():
        rows = _rows(text, sign)
        if len(rows[0].cells) > 1 and len({len(row.cells) for row in rows}) == 1 and not _halved(rows, sign):
            return _even(rows, sign, quoted)
    sign = next((sign for sign in present if sign != ", "), "")
    return _even(_rows(text, sign or separators[-1]), sign, quoted)


def _without_comments(text: str) -> str:
    """A table without the comments (``#``) above it, whose lines are empty then.

    The last one is the line of headings where numbers follow it.
    """
    lines = text.split("\n")
    first = next((at for at, line in enumerate(lines) if line.strip() and not line.lstrip().startswith("#")), None)
    if not first:
        return text
    comments = [at for at in range(first) if lines[at].strip()]
    if comments and _BEGINS_WITH_NUMBER.match(lines[first]):
        comments.pop()
    for at in comments:
        lines[at] = ""
    return "\n".join(lines)


def _halved(rows: Sequence[CsvRow], sign: str) -> bool:
    """Whether ``sign`` separates only some columns: ``0,5,<tab>2`` at the tab, ``a, b,c`` at the comma with a blank."""
    if sign == ", ":
        return any("," in cell and re.search(r"[^\W\d]", cell) is not None for cell in rows[0].cells)
    return any(cell.rstrip().endswith((",", ";")) for row in rows for cell in row.cells)


def _rows(text: str, sign: str) -> list[CsvRow]:
    if '"' not in text:
        between = re.compile(r",\s+" if sign == ", " else re.escape(sign))
        lines = (CsvRow(number, between.split(line)) for number, line in enumerate(text.split("\n"), 1))
        return [row for row in lines if any(map(str.strip, row.cells))]
    reader = csv.reader(io.StringIO(text), delimiter=sign, strict=True, skipinitialspace=True)
    return [CsvRow(reader.line_num, cells) for cells in reader if any(map(str.strip, cells))]


def _even(rows: list[CsvRow], separator: str, quoted: bool) -> Split:
    """The table without columns that are empty in every row."""
    width = max((len(row.cells) for row in rows), default=0)
    full = [place for place in range(width) if any(row.cells[place : place + 1] > [""] for row in rows)]
    if len(full) < width and {len(row.cells) for row in rows} == {width}:
        rows = [CsvRow(row.line, [row.cells[place] for place in full]) for row in rows]
    return Split(rows, separator, quoted)


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


def heading_of(cell: str) -> tuple[str, str] | None:
    """The name of a heading and its unit in brackets, "" where it has none; None where it is neither."""
    found = _HEADING.fullmatch(cell)
    return None if found is None else (found[1], found[2] or "")


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
