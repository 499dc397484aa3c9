"""Rows of cells in a text, as instruments and spreadsheets write them.

Columns are separated by tabs, semicolons or commas, a comma also with blanks behind it, so that ``0,5, 1,25`` has two
cells. A first line ``sep=;`` names the separator. Cells may be in double quotes, and columns that are empty from the
first line to the last are left out, and so are comments (``#``) above the headings.
"""

from __future__ import annotations

import codecs
import csv
import io
import re
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Sequence

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


def heading_of(cell: str) -> tuple[str, str] | None:
    """The name of a heading and its unit in brackets, "" where it has none; None where it is neither."""
    found = _HEADING.fullmatch(cell)
    return None if found is None else (found[1], found[2] or "")
