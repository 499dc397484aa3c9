"""Rows as a spreadsheet: a sheet of typed cells with a row of units under the names, and a sheet of inputs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import xlsxwriter
from xlsxwriter.worksheet import Worksheet

from sprag.service.results.directions import value_columns
from sprag.service.results.exports.inputs import inputs, run_inputs
from sprag.service.results.exports.source import given_texts
from sprag.service.results.exports.spool import spooled
from sprag.service.spec.catalogue import unit_of

if TYPE_CHECKING:
    from sprag.service.results.exports.source import Source
    from sprag.service.storage.records import RowBlock

#: Rows of a sheet, including those of names and units; further cases continue on another sheet.
SHEET_ROWS: Final = 1_048_576
_HEAD_ROWS: Final = 2
_LONGEST_TEXT: Final = 32_767


class _ExactSheet(Worksheet):  # type: ignore[misc]
    """A sheet whose numbers have all their digits: the library writes 16, and a double may need 17."""

    def _xml_number_element(self, number: float, attributes: Any = ()) -> None:
        cell = "".join(f' {key}="{value}"' for key, value in attributes)
        self.fh.write(f"<c{cell}><v>{number!r}</v></c>")


def xlsx_pieces(source: Source) -> Iterator[bytes]:
    """The workbook in pieces. It is first written to disk row by row, to limit memory."""
    return spooled(partial(_write, source))


def _write(source: Source, folder: Path, sheet_rows: int = SHEET_ROWS) -> Path:
    path = folder / "results.xlsx"
    options = {"constant_memory": True, "tmpdir": str(folder), "use_zip64": True, "strings_to_urls": False}
    with xlsxwriter.Workbook(str(path), options) as book:
        title = book.add_format({"bold": True, "bottom": 1})
        unit = book.add_format({"italic": True, "font_color": "#666666"})
        _cases(book, source, title, unit, sheet_rows)
        _inputs(book, source, title)
    return path


def _cases(book: Any, source: Source, title: Any, unit: Any, sheet_rows: int) -> None:
    study = source.study
    names = ["case", *study.column_paths, "ending", "flags", *(info.name for info in source.infos)]
    units = ["", *(unit_of(study, path) for path in study.column_paths), "", "", *(i.unit for i in source.infos)]
    number, sheet, row = 0, None, sheet_rows
    for block in source.blocks:
        for cells in _rows(source, block):
            if row >= sheet_rows:
                number += 1
                sheet, row = _sheet(book, number, names, units, title, unit), _HEAD_ROWS
            _write_row(sheet, row, cells)
            row += 1
    if sheet is None:
        _sheet(book, 1, names, units, title, unit)


def _sheet(book: Any, number: int, names: list[str], units: list[str], title: Any, unit: Any) -> Any:
    sheet = book.add_worksheet("cases" if number == 1 else f"cases {number}", _ExactSheet)
    sheet.freeze_panes(_HEAD_ROWS, 1)
    sheet.set_column(0, len(names) - 1, 14)
    for column, name in enumerate(names):
        sheet.write_string(0, column, name, title)
    for column, text in enumerate(units):
        sheet.write_string(1, column, text, unit)
    return sheet


def _rows(source: Source, block: RowBlock) -> Iterator[list[Any]]:
    parameters = value_columns(source.study, block.cases).values()
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


def _write_row(sheet: Any, row: int, cells: list[Any]) -> None:
    """Write texts as texts, never as formulas, and numbers as numbers; missing numbers stay empty."""
    for column, cell in enumerate(cells):
        if isinstance(cell, str):
            if cell:
                sheet.write_string(row, column, cell)
        elif not math.isnan(cell):
            sheet.write_number(row, column, cell)


def _inputs(book: Any, source: Source, title: Any) -> None:
    sheet = book.add_worksheet("inputs", _ExactSheet)
    sheet.set_column(0, 0, 36)
    sheet.set_column(1, 2, 18)
    sheet.set_column(3, 3, 40)
    row = 0

    def line(*cells: object, style: Any = None) -> None:
        nonlocal row
        for column, cell in enumerate(cells):
            if isinstance(cell, float | int):
                sheet.write_number(row, column, cell, style)
            elif cell is not None:
                sheet.write_string(row, column, str(cell)[:_LONGEST_TEXT], style)
        row += 1

    line("study", style=title)
    for name, value in source.about.items():
        line(name, value)
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
