"""Cases given one by one as the text of a CSV file: a header of parameters, with a unit where it is not SI."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from sprag.service.reading.catalogue import range_sentence
from sprag.service.reading.numbers import parse_number
from sprag.service.reading.texts import shorten_text
from sprag.service.reading.units import QuantityError, to_float
from sprag.service.spec.axes.axes import read_paths
from sprag.service.spec.axes.blocks import Block
from sprag.service.spec.csv_text import in_cell, read_csv, refuse_mixed_column
from sprag.service.spec.fields import exact, read_object
from sprag.service.spec.report import Report, join
from sprag.service.spec.table_text import CsvRow, heading_of
from sprag.worker.limits import MAX_AXIS_VALUES, MAX_COLUMNS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag.service.spec.machine.machine import Machine
    from sprag.worker.models import Parameter

FIELDS: Final = ("points",)


def read_points(report: Report, pointer: str, data: Mapping[str, Any], machine: Machine) -> Block | None:
    """Read the block of cases of a CSV text; None, with the faults recorded, when it is invalid."""
    found = read_object(report, pointer, data, FIELDS) or {}
    where, text = join(pointer, "points"), found.get("points")
    example = "a header of paths, then a line for each case"
    rows = read_csv(report, where, text, (MAX_AXIS_VALUES, MAX_COLUMNS), example)
    if rows is None:
        return None
    headings = [_read_heading(report, where, cell, machine) for cell in rows[0].cells]
    known = [heading for heading in headings if heading is not None]
    if len(known) < len(headings):
        return None
    mixed = [
        refuse_mixed_column(report, where, rows[1:], (place, str(heading)), heading.parameter.unit)
        for place, heading in enumerate(known)
        if not heading.unit
    ]
    values = None if any(mixed) else _read_cells(report, where, rows[1:], known)
    if values is None:
        return None
    paths = tuple(heading.parameter.path for heading in known)
    if len(set(paths)) < len(paths):
        report.fault(where, "repeated", "names the same path twice", [shorten_text(path) for path in paths])
        return None
    lines = tuple(row.line for row in rows[1:])
    return Block(pointer, paths, len(lines), lambda: dict(zip(paths, values, strict=True)), lines)


class _Heading(NamedTuple):
    """The heading of a column; ``unit`` is "" where it gives none."""

    parameter: Parameter
    unit: str

    def __str__(self) -> str:
        return self.parameter.path + (f" [{self.unit}]" if self.unit else "")


def _read_heading(report: Report, where: str, cell: str, machine: Machine) -> _Heading | None:
    heading = heading_of(cell)
    if heading is None:
        report.fault(
            where, "invalid-path", "has a heading that names no parameter", cell, allowed="a path, its unit in brackets"
        )
        return None
    name, unit = heading
    paths = read_paths(report, where, name, machine)
    return None if paths is None else _Heading(machine.parameters[paths[0]], unit)


def _read_cells(
    report: Report, where: str, rows: list[CsvRow], headings: list[_Heading]
) -> list[NDArray[np.float64]] | None:
    columns = [np.empty(len(rows)) for _ in headings]
    before = report.found
    for number, (line, row) in enumerate(rows):
        for column, cell, heading in zip(columns, row, headings, strict=True):
            try:
                column[number] = _read_cell(cell.strip(), heading)
            except QuantityError as error:
                written = f"{cell.strip()} {heading.unit}" if heading.unit and _is_number(cell) else cell.strip()
                report.fault(
                    where, error.code, in_cell(line, error.message, shorten_text(str(heading))), written,
                    allowed=range_sentence(heading.parameter), unit=heading.parameter.unit,
                )  # fmt: skip
        if report.full:
            break
    return None if report.found > before else [column + 0.0 for column in columns]


def _read_cell(cell: str, heading: _Heading) -> float:
    """Read a cell: a number in the unit of its column (SI where there is none), or a text with its own unit."""
    if not cell:
        raise QuantityError("empty", "is empty")
    number = parse_number(cell)
    if number is None:
        return to_float(exact(cell, heading.parameter))
    return to_float(exact(f"{cell} {heading.unit}" if heading.unit else number, heading.parameter))


def _is_number(cell: str) -> bool:
    return parse_number(cell) is not None
