"""Measured points as the text of a CSV file: parameters that were set, results that were measured, their scatter."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from sprag_study.sentences import Sentence, Typed
from sprag_study.service.languages import N_
from sprag_study.service.reading.catalogue import result_of
from sprag_study.service.reading.limits import number_in
from sprag_study.service.reading.numbers import parse_number
from sprag_study.service.reading.texts import did_you_mean, shorten_text
from sprag_study.service.reading.units import QuantityError, parse_quantity
from sprag_study.service.spec.csv_text import Column, read_columns, read_csv, refuse_cell, refuse_mixed_column
from sprag_study.service.spec.node import Node
from sprag_study.service.table_rows import CsvRow, heading_of
from sprag_study.worker.planning.calibrate.plan import MOST_MEASURED, Measured

if TYPE_CHECKING:
    from collections.abc import Sequence


#: Heading of a column of standard deviations.
SIGMA: Final = "sigma"
#: Columns at most.
MOST_COLUMNS: Final = 32
_EXAMPLE: Final = N_("as in shaft.load [N*m],shaft.speed.mean [rad/s],sigma")


@dataclass(frozen=True)
class MeasuredTable:
    """A table whose conditions are read; its results are read when they are known.

    Attributes
    ----------
    paths : tuple of str
        The parameters that were set.
    conditions : tuple of tuples of float
        Their values, SI, each condition once.
    at : tuple of int
        The condition of each row.
    rows : tuple of CsvRow
    results : tuple of (Column, Column or None)
        Columns of results, each with that of its standard deviation.
    """

    paths: tuple[str, ...]
    conditions: tuple[tuple[float, ...], ...]
    at: tuple[int, ...]
    rows: tuple[CsvRow, ...]
    results: tuple[tuple[Column, Column | None], ...]


def read_table(node: Node) -> MeasuredTable | None:
    """Read headings and conditions; None, and the faults recorded, where they are invalid."""
    machine = node.machine
    example = Sentence("headings, then a line for each point, {example}", example=Sentence(_EXAMPLE))
    rows = read_csv(node, (MOST_MEASURED, MOST_COLUMNS), example)
    if rows is None:
        return None
    columns = _read_headings(node, rows[0])
    paths = [column for column in columns if column.name in machine.parameters]
    others = [column for column in columns if column.name not in machine.parameters]
    for column in paths:
        if column.name in machine.derive:
            node.refuse(
                "conflict", "has a column of a derived parameter", column.name, allowed="no formula in `derive`"
            )
    results = _paired(node, others)
    if not node.sound:
        return None
    before = node.report.found
    fits = [_check_unit(node, column, machine.parameters[column.name].unit) for column in paths]
    if not all(fits):
        return None
    values = read_columns(node, rows[1:], [(column, machine.parameters[column.name]) for column in paths])
    if node.report.found > before:
        return None
    points = list(zip(*values, strict=True)) if values else [()] * (len(rows) - 1)
    conditions = tuple(dict.fromkeys(points))
    place = {point: index for index, point in enumerate(conditions)}
    return MeasuredTable(
        tuple(column.name for column in paths),
        conditions,
        tuple(place[point] for point in points),
        tuple(rows[1:]),
        results,
    )


def _read_headings(node: Node, row: CsvRow) -> list[Column]:
    columns: list[Column] = []
    for place, cell in enumerate(row.cells):
        heading = heading_of(cell)
        if heading is None:
            node.refuse("invalid-path", "has a heading without a name", cell, allowed=_EXAMPLE)
            continue
        column = Column(*heading, place)
        if column.name != SIGMA and any(other.name == column.name for other in columns):
            node.refuse("repeated", "names the same column twice", column.name, allowed="each once")
        columns.append(column)
    return columns


def _paired(node: Node, columns: Sequence[Column]) -> tuple[tuple[Column, Column | None], ...]:
    """Columns of results with those of their deviations: each holds for the results before it that have none yet."""
    pairs: list[tuple[Column, Column | None]] = []
    for column in columns:
        if column.name != SIGMA:
            pairs.append((column, None))
        elif any(own is None for _, own in pairs):
            pairs = [(result, own or column) for result, own in pairs]
        else:
            node.refuse(
                "not-used",
                "has a column sigma with no result before it",
                str(column),
                allowed="a column of a result, then that of its standard deviation",
            )
    if not pairs:
        node.refuse("required", "has no column of a result", None, allowed=_EXAMPLE)
    return tuple(pairs)


def _check_unit(node: Node, column: Column, unit: str) -> bool:
    """Whether the unit of a heading fits; a fault recorded, once for the whole column, where it does not."""
    try:
        _number("1", column, unit)
    except QuantityError as error:
        message = Sentence("column {column}: {message}", column=shorten_text(str(column)), message=error.message)
        node.refuse(error.code, message, column.unit, unit=unit)
        return False
    return True


def read_results(node: Node, table: MeasuredTable) -> tuple[Measured, ...] | None:
    """The measured results in SI; None, and the faults recorded, where they are invalid.

    Empty cells of a result were not measured.
    """
    before, infos = node.report.found, node.report.results
    measured: list[Measured] = []
    for column, sigma in table.results:
        info = result_of(infos, column.name)
        if info is None or info.kind == "category":
            known = did_you_mean(column.name, [*(one.name for one in infos), SIGMA])
            message = Sentence("has a column that is neither a parameter nor a result{hint}", hint=known)
            if info is None:
                node.refuse("unknown-name", message, column.name, allowed=_EXAMPLE)
            else:
                node.refuse("not-numeric", "has a column of a category", column.name, allowed="a number")
            continue
        if not _check_unit(node, column, info.unit):
            continue
        if not column.unit and refuse_mixed_column(node, table.rows, column, info.unit):
            continue
        rows = [(row, at) for row, at in zip(table.rows, table.at, strict=True) if column.cell(row)]
        values = [_value(node, row, column, info.unit) for row, _ in rows]
        if not rows:
            node.refuse(
                "empty",
                Sentence("has no value in the column {column}", column=str(column)),
                None,
                allowed="a number",
            )
        deviations: list[float] = []
        if sigma is not None and not (sigma.unit or column.unit):
            refuse_mixed_column(node, table.rows, sigma, info.unit)
        if sigma is not None:
            pairs = zip(rows, values, strict=True)
            deviations = [_deviation(node, row, sigma, value, (column.unit, info.unit)) for (row, _), value in pairs]
        measured.append(Measured(info.name, tuple(at for _, at in rows), tuple(values), tuple(deviations)))
    return None if node.report.found > before else tuple(measured)


def _value(node: Node, row: CsvRow, column: Column, unit: str) -> float:
    try:
        return _number(column.cell(row), column, unit) + 0.0
    except QuantityError as error:
        refuse_cell(node, row, column, error, number_in(unit), unit)
        return math.nan


def _deviation(node: Node, row: CsvRow, column: Column, value: float, units: tuple[str, str]) -> float:
    """The standard deviation of a value: a quantity, or a share of the value.

    A number without a unit is in that of the column of its result, ``units[0]``, or else in SI, ``units[1]``.
    """
    written, unit = units
    cell = column.cell(row)
    share = re.fullmatch(r"(.*?)\s*%", f"{cell} {column.unit}" if parse_number(cell) is not None else cell)
    try:
        if share is not None:
            number = parse_number(share[1])
            if number is None:
                raise QuantityError("not-a-number", "is not a number")
            deviation = abs(value) * number / 100.0
        else:
            deviation = parse_quantity(column._replace(unit=column.unit or written).quantity(cell), unit)
        if not 0.0 < deviation < math.inf and math.isfinite(value):
            raise QuantityError("out-of-range", "is not a standard deviation greater than 0")
        return deviation
    except QuantityError as error:
        such = Sentence("greater than 0, in {unit}, or as a share [%] of the value", unit=Typed(unit))
        refuse_cell(node, row, column, error, such, unit)
        return math.nan


def _number(cell: str, column: Column, unit: str) -> float:
    """A cell in SI; a number of no unit may be in percent."""
    if unit == "1" and (share := re.fullmatch(r"(.*?)\s*%", f"{cell} {column.unit}" if column.unit else cell)):
        return parse_quantity(column._replace(unit="").quantity(share[1]), unit) / 100.0
    return parse_quantity(column.quantity(cell), unit)
