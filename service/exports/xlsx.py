"""Rows as a spreadsheet: a table of typed cells with filters below a row of units, and a sheet of inputs."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Final

import xlsxwriter
from xlsxwriter.utility import xl_range
from xlsxwriter.worksheet import Worksheet

from sprag_study.service.exports.inputs import inputs, run_inputs
from sprag_study.service.exports.source import given_texts
from sprag_study.service.exports.spool import spooled

if TYPE_CHECKING:
    from sprag_study.service.exports.source import Source
    from sprag_study.service.storage.studies.records import RowBlock

#: Rows of a sheet, including those of units and names; further cases continue on another sheet.
SHEET_ROWS: Final = 1_048_576
_HEAD_ROWS: Final = 2
#: Most UTF-16 units of a text in a cell.
_LONGEST_TEXT: Final = 32_767
#: Widths in characters: of a number as spreadsheets show it at first, of the button of a filter, and the largest one.
_NUMBER, _BUTTON, _WIDEST = 12, 4, 60


class _ExactSheet(Worksheet):  # type: ignore[misc]
    """A sheet written row by row, whose numbers have all their digits: the library writes 16, and a double may need 17.

    Attributes
    ----------
    widths : characters of the longest text of each column
    """

    def _xml_number_element(self, number: float, attributes: Any = ()) -> None:
        cell = "".join(f' {key}="{value}"' for key, value in attributes)
        self.fh.write(f"<c{cell}><v>{number!r}</v></c>")

    def begin(self, columns: int) -> None:
        """Prepare for that many columns."""
        self.widths = [_NUMBER] * columns

    def write_cells(self, row: int, cells: Sequence[Any], style: Any = None) -> None:
        """Write texts as texts, never as formulas, and numbers as numbers; missing numbers stay empty."""
        for column, cell in enumerate(cells):
            if isinstance(cell, str):
                if cell:
                    self.write_string(row, column, cell, style)
                    self.widths[column] = max(self.widths[column], len(cell))
            elif cell is not None and not math.isnan(cell):
                self.write_number(row, column, cell, style)

    def fit(self) -> None:
        """Make each column as wide as its texts."""
        for column, width in enumerate(self.widths):
            self.set_column(column, column, min(width + 1, _WIDEST))

    def name_columns(self, row: int, names: Sequence[str], table: str) -> None:
        """Begin a table with filters, whose head is this row; `end_table` says where it ends.

        The library makes no tables of sheets that are written row by row, because it would write the head again, and it
        keeps every cell of a table. The head is written here, and the table is at first a single row.
        """
        self.constant_memory = False
        columns = [{"header": name} for name in names]
        options = {"name": table, "columns": columns, "style": "Table Style Light 1"}
        if self.add_table(row, 0, row + 1, len(names) - 1, options):
            raise ValueError(f"the columns of {table} do not make a table")  # two have one name
        del self.table[row]
        self.constant_memory = True
        self.write_cells(row, names)
        self.widths = [max(width, len(name) + _BUTTON) for width, name in zip(self.widths, names, strict=True)]

    def end_table(self, first: int, last: int) -> None:
        """The table has the rows from its head to the last one; without any it keeps an empty one."""
        (table,) = self.tables
        cells = xl_range(first, 0, max(last, first + 1), len(table["columns"]) - 1)
        table.update({"range": cells, "a_range": cells, "autofilter": cells})


def xlsx_pieces(source: Source, folder: Path | None = None) -> Iterator[bytes]:
    """The workbook in pieces. It is first written to disk row by row, to limit memory."""
    return spooled(partial(_write, source), folder)


class _Archive:
    """The file of a workbook. Once it is closed, it ignores what is written.

    On a full disk the library leaves its archive open, and the archive writes its end when it is collected.
    """

    def __init__(self, path: Path) -> None:
        self.file = path.open("wb")

    def write(self, data: Any) -> int:
        """The number of bytes that are taken."""
        return len(data) if self.file.closed else self.file.write(data)

    def tell(self) -> int:
        """The place of the next byte."""
        return 0 if self.file.closed else self.file.tell()

    def seek(self, place: int) -> int:
        """Go to that place."""
        return place if self.file.closed else self.file.seek(place)

    def flush(self) -> None:
        """Give the bytes to the system."""
        if not self.file.closed:
            self.file.flush()


def _write(source: Source, folder: Path, sheet_rows: int = SHEET_ROWS) -> Path:
    path = folder / "results.xlsx"
    options = {"constant_memory": True, "tmpdir": str(folder), "use_zip64": True, "strings_to_urls": False}
    archive = _Archive(path)
    book = xlsxwriter.Workbook(archive, options)
    try:
        unit = book.add_format({"italic": True, "font_color": "#666666"})
        _cases(book, source, unit, sheet_rows)
        _inputs(book, source, book.add_format({"bold": True, "bottom": 1}))
        book.close()
        archive.file.close()
    except BaseException:
        _abandon(book, archive.file)
        raise
    return path


def _abandon(book: Any, archive: IO[bytes]) -> None:
    """Close the files of a workbook that cannot be finished, which the library leaves open."""
    book.fileclosed = True
    with suppress(OSError):
        archive.close()
    for part in (book, *book.worksheets()):
        for file in (getattr(part, "fh", None), getattr(part, "row_data_fh", None)):
            with suppress(OSError, ValueError):  # what it holds back has no room
                if file is not None:
                    file.close()


def _cases(book: Any, source: Source, unit: Any, sheet_rows: int) -> None:
    study, source = source.study, source.in_units()
    names = ["case", *study.column_paths, "ending", "flags", *(info.name for info in source.infos)]
    units = ["", *(source.unit(path) for path in study.column_paths), "", "", *(i.unit for i in source.infos)]
    number, row = 1, _HEAD_ROWS
    sheet = _sheet(book, number, names, units, unit)
    for block in source.blocks:
        for cells in _rows(source, block):
            if row >= sheet_rows:
                _finish(sheet, row)
                number, row = number + 1, _HEAD_ROWS
                sheet = _sheet(book, number, names, units, unit)
            sheet.write_cells(row, cells)
            row += 1
    _finish(sheet, row)


def _sheet(book: Any, number: int, names: list[str], units: list[str], unit: Any) -> _ExactSheet:
    sheet: _ExactSheet = book.add_worksheet("cases" if number == 1 else f"cases {number}", _ExactSheet)
    sheet.begin(len(names))
    sheet.freeze_panes(_HEAD_ROWS, 1)
    sheet.write_cells(0, units, unit)
    sheet.name_columns(1, names, "cases" if number == 1 else f"cases_{number}")
    return sheet


def _finish(sheet: _ExactSheet, rows: int) -> None:
    sheet.end_table(_HEAD_ROWS - 1, rows - 1)
    sheet.fit()


def _rows(source: Source, block: RowBlock) -> Iterator[list[Any]]:
    parameters = source.parameters(block.cases).values()
    values = block.values.tolist()
    named = [index for index, info in enumerate(source.infos) if info.kind == "category"]
    for index, case in enumerate(block.cases.tolist()):
        for column in named:
            values[index][column] = source.infos[column].cell(values[index][column]) or ""
        yield [
            case,
            *(parameter[index] for parameter in parameters),
            block.endings[index],
            block.flags[index].replace(",", ";"),
            *values[index],
        ]


def _lines(cells: Sequence[float | int | str]) -> Iterator[list[float | int | str]]:
    """The cells of a line; texts that are too long for a cell go on below it, in lines that name it again."""
    texts = [text_pieces(cell) if isinstance(cell, str) else [cell] for cell in cells]
    for number in range(max(map(len, texts), default=1)):
        part: list[float | int | str] = [text[number] if number < len(text) else "" for text in texts]
        if number > 0 and not part[0]:
            part[0] = f"{cells[0]} (continued)"
        yield part


def text_pieces(text: str) -> list[str]:
    """A text in pieces that fit into a cell and joined are the text.

    They end with lines where these fit, otherwise after a separator, so that no number is cut.
    """
    pieces, rest = [], text
    while len(rest.encode("utf-16-le")) > 2 * _LONGEST_TEXT:
        most = rest[:_LONGEST_TEXT]
        most = most.encode("utf-16-le")[: 2 * _LONGEST_TEXT].decode("utf-16-le", "ignore")
        places = [most.rfind(mark) + 1 for mark in ("\n", ";", ",", "\t", " ")]
        end = next((place for place in places if place > 0), len(most))
        pieces.append(rest[:end])
        rest = rest[end:]
    return [*pieces, rest]


def _inputs(book: Any, source: Source, title: Any) -> None:
    sheet: _ExactSheet = book.add_worksheet("inputs", _ExactSheet)
    sheet.begin(5)
    row = 0

    def line(*cells: object, style: Any = None) -> None:
        nonlocal row
        values = [cell if isinstance(cell, float | int) else str(cell or "") for cell in cells]
        for part in _lines(values):
            sheet.write_cells(row, part, style)
            row += 1

    line("study", style=title)
    for name, value in source.about.items():
        for item in value if isinstance(value, list) else [value]:
            line(name, *(item.values() if isinstance(item, dict) else [item]))
    line()
    if run := run_inputs(source.study, source.spec):
        line("run", "", "", "", "origin", style=title)
        for item in run:
            line(item.path, item.value, "", "", item.origin)
        line()
    line("parameter", "value", "unit", "meaning", "origin", style=title)
    for item in inputs(source.study, source.spec):
        line(item.path, "varies" if item.varies else item.value, item.unit, item.description, item.origin)
    line()
    if texts := given_texts(source.spec):
        line("as given", "value", style=title)
        for name, text in texts.items():
            line(name, text)
        line()
    line("result", "", "unit", "meaning", style=title)
    for info in source.infos:
        line(info.name, "", info.unit, info.description)
    sheet.fit()
