"""Cases given one by one as the text of a CSV file: a header of parameters, with a unit where it is not SI."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from sprag.service.reading.catalogue import range_sentence
from sprag.service.reading.numbers import parse_number
from sprag.service.reading.texts import shorten_text
from sprag.service.reading.units import QuantityError, to_float
from sprag.service.spec.axes.axes import read_paths
from sprag.service.spec.axes.blocks import Block
from sprag.service.spec.csv_text import in_cell, read_csv, refuse_mixed_column
from sprag.service.spec.described import Record
from sprag.service.spec.node import Node, exact
from sprag.service.spec.table_text import CsvRow, heading_of
from sprag.worker.limits import MAX_AXIS_VALUES, MAX_COLUMNS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag.worker.models import Parameter

POINTS: Final = Record(
    {
        "points": {
            "type": "string",
            "description": "the text of a CSV file: a header of paths, each with its unit in brackets where it is not "
            "SI, then a line for each case",
            "examples": ["excitation.frequency [Hz],shaft.load [N*mm]\n25,100\n26,150\n"],
        }
    },
    "cases given one by one",
    required=("points",),
)


def read_points(item: Node) -> Block | None:
    """Read the block of cases of a CSV text; None, with the faults recorded, when it is invalid."""
    POINTS.read(item)
    node = item["points"]
    example = "a header of paths, then a line for each case"
    rows = read_csv(node, (MAX_AXIS_VALUES, MAX_COLUMNS), example)
    if rows is None:
        return None
    headings = [_read_heading(node, cell) for cell in rows[0].cells]
    known = [heading for heading in headings if heading is not None]
    if len(known) < len(headings):
        return None
    mixed = [
        refuse_mixed_column(node, rows[1:], (place, str(heading)), heading.parameter.unit)
        for place, heading in enumerate(known)
        if not heading.unit
    ]
    values = None if any(mixed) else _read_cells(node, rows[1:], known)
    if values is None:
        return None
    paths = tuple(heading.parameter.path for heading in known)
    if len(set(paths)) < len(paths):
        node.refuse("repeated", "names the same path twice", [shorten_text(path) for path in paths])
        return None
    lines = tuple(row.line for row in rows[1:])
    return Block(item.pointer, paths, len(lines), lambda: dict(zip(paths, values, strict=True)), lines)


class _Heading(NamedTuple):
    """The heading of a column; ``unit`` is "" where it gives none."""

    parameter: Parameter
    unit: str

    def __str__(self) -> str:
        return self.parameter.path + (f" [{self.unit}]" if self.unit else "")


def _read_heading(node: Node, cell: str) -> _Heading | None:
    heading = heading_of(cell)
    if heading is None:
        node.refuse("invalid-path", "has a heading that names no parameter", cell,
                    allowed="a path, its unit in brackets")  # fmt: skip
        return None
    name, unit = heading
    paths = read_paths(Node(node.report, node.pointer, name))
    return None if paths is None else _Heading(node.machine.parameters[paths[0]], unit)


def _read_cells(node: Node, rows: list[CsvRow], headings: list[_Heading]) -> list[NDArray[np.float64]] | None:
    columns = [np.empty(len(rows)) for _ in headings]
    before = node.report.found
    for number, (line, row) in enumerate(rows):
        for column, cell, heading in zip(columns, row, headings, strict=True):
            try:
                column[number] = _read_cell(cell.strip(), heading)
            except QuantityError as error:
                written = f"{cell.strip()} {heading.unit}" if heading.unit and _is_number(cell) else cell.strip()
                node.refuse(
                    error.code, in_cell(line, error.message, shorten_text(str(heading))), written,
                    allowed=range_sentence(heading.parameter), unit=heading.parameter.unit,
                )  # fmt: skip
        if node.report.full:
            break
    return None if node.report.found > before else [column + 0.0 for column in columns]


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
