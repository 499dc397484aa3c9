"""Cases given one by one as the text of a CSV file: a header of parameters, with a unit where it is not SI."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from service.spec_axes import read_paths
from service.spec_blocks import Block
from service.spec_fields import read_number, read_object
from service.spec_messages import Report, join, shorten_text
from worker.limits import MAX_AXES, MAX_AXIS_VALUES

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from service.spec_base import Machine
    from worker.kernels import Parameter

FIELDS: Final = ("points",)
#: "shaft.load", "shaft.load [N*mm]", "shaft.load (N*mm)"
_HEADING: Final = re.compile(r"\s*([^\s\[\(]+)\s*(?:[\[\(]\s*([^\]\)]+?)\s*[\]\)])?\s*")


def read_points(report: Report, pointer: str, data: Mapping[str, Any], machine: Machine) -> Block | None:
    """The block of cases in a CSV text; None, and problems noted, when something is wrong with it."""
    found = read_object(report, pointer, data, FIELDS) or {}
    where, text = join(pointer, "points"), found.get("points")
    if not isinstance(text, str):
        allowed = "a header of paths, then a line for each case"
        report.problem(where, "must be the text of a CSV file", text, allowed=allowed)
        return None
    try:
        rows = _rows(text.removeprefix("\ufeff"))
    except csv.Error as error:
        report.problem(where, f"is no CSV text: {error}")
        return None
    if len(rows) < 2 or not 1 <= len(rows[0]) <= MAX_AXES or len(rows) - 1 > MAX_AXIS_VALUES:
        report.problem(
            where, f"has {max(len(rows) - 1, 0)} lines of {len(rows[0]) if rows else 0} columns under its header",
            allowed=f"1 line or more of 1 to {MAX_AXES} columns",
        )  # fmt: skip
        return None
    headings = [_read_heading(report, where, cell, machine) for cell in rows[0]]
    known = [heading for heading in headings if heading is not None]
    if len(known) < len(headings):
        return None
    columns = _read_cells(report, where, rows[1:], known)
    if columns is None:
        return None
    paths = tuple(parameter.path for parameter, _ in known)
    if len(set(paths)) < len(paths):
        report.problem(where, "names the same path twice", [shorten_text(path) for path in paths])
        return None
    return Block(pointer, paths, len(rows) - 1, lambda: dict(zip(paths, columns, strict=True)))


def _rows(text: str) -> list[list[str]]:
    """Rows that are not empty. What the header is parted by, parts all of it: commas, or semicolons, or tabs."""
    header = text.lstrip().partition("\n")[0]
    delimiter = next((sign for sign in ",;\t" if sign in header), ",")
    return [row for row in csv.reader(io.StringIO(text), delimiter=delimiter, strict=True) if any(row)]


def _read_heading(report: Report, where: str, cell: str, machine: Machine) -> tuple[Parameter, str] | None:
    match = _HEADING.fullmatch(cell)
    if match is None:
        report.problem(where, "has a heading that names no parameter", cell, allowed="a path, its unit in brackets")
        return None
    paths = read_paths(report, where, match[1], machine)
    return None if paths is None else (machine.parameters[paths[0]], match[2] or "")


def _read_cells(
    report: Report, where: str, rows: list[list[str]], headings: list[tuple[Parameter, str]]
) -> list[NDArray[np.float64]] | None:
    columns = [np.empty(len(rows)) for _ in headings]
    before = report.found
    for number, row in enumerate(rows):
        if len(row) != len(headings):
            report.problem(where, f"line {number + 2} has {len(row)} cells", allowed=f"{len(headings)} cells")
            continue
        for column, cell, (parameter, unit) in zip(columns, row, headings, strict=True):
            value = _read_cell(report, f"{where} line {number + 2}", cell.strip(), parameter, unit)
            if value is not None:
                column[number] = value
        if report.full:
            break
    return None if report.found > before else [column + 0.0 for column in columns]


def _read_cell(report: Report, where: str, cell: str, parameter: Parameter, unit: str) -> float | None:
    """A cell: a number in the unit of its column (SI where there is none), or a text with a unit of its own."""
    try:
        number: object = float(cell)
    except ValueError:
        number = cell
    if isinstance(number, float) and unit:
        number = f"{cell} {unit}"
    return read_number(report, where, number, parameter)
