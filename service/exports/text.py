"""Rows as text: CSV for tables, JSON and JSON lines for programs. Rows do not depend on the batching of cases."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain
from typing import TYPE_CHECKING, Any, Final

from sprag_study.sentences import name_of
from sprag_study.service.exports.source import machine
from sprag_study.service.json_text import to_bytes
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.directions import value_columns
from sprag_study.service.spec.csv_text import escape

if TYPE_CHECKING:
    from sprag_study.service.answers import Value
    from sprag_study.service.answers.results import Case
    from sprag_study.service.exports.source import Source
    from sprag_study.service.reading.quantities import Units
    from sprag_study.service.storage.studies.records import CaseRow, RowBlock
    from sprag_study.worker.study import Study

#: A cell that decimal commas apply to.
DECIMAL_NUMBER: Final = re.compile(r"-?\d+\.\d+(?:e[+-]?\d+)?", re.IGNORECASE)


def row_json(row: CaseRow, parameters: dict[str, Value]) -> Case:
    """One case as JSON data; ``parameters`` are those on axes and derived ones, SI."""
    return {
        "case": row.case,
        "parameters": parameters,
        "ending": row.ending,
        "flags": list(row.flags),
        "results": row.results,
    }


def rows_json(study: Study, block: RowBlock) -> Iterator[Case]:
    """The cases of a block as `row_json` gives them."""
    columns = value_columns(study, block.cases)
    for index, row in enumerate(block.rows()):
        yield row_json(row, {path: column[index] for path, column in columns.items()})


def json_pieces(source: Source) -> Iterator[bytes]:
    """``{..., "axes": [...], "results": [...], "rows": [row, row, ...]}``, one row per line."""
    study = source.study
    head = {
        **source.about,
        "axes": [
            {"paths": list(axis.paths), "unit": unit_of(study, axis.paths[0]), "values": len(axis)}
            for axis in study.axes
        ],
        "results": [{"name": info.name, "unit": info.unit} for info in source.infos],
        **machine(source),
    }
    yield to_bytes(head)[:-1] + b',"rows":['
    separator = b"\n"
    for block in source.blocks:
        piece = [to_bytes(row) for row in rows_json(study, block)]
        if piece:
            yield separator + b",\n".join(piece)
            separator = b",\n"
    yield b"\n]}\n"


def json_lines_pieces(source: Source) -> Iterator[bytes]:
    """One flat object per line, with the names of the columns of `csv_pieces`; null for missing values."""
    study = source.study
    for block in source.blocks:
        columns = value_columns(study, block.cases)
        for index, row in enumerate(block.rows()):
            parameters = {path: column[index] for path, column in columns.items()}
            flat = {"case": row.case, **parameters, "ending": row.ending, "flags": list(row.flags), **row.results}
            yield to_bytes(flat) + b"\n"


def csv_pieces(source: Source) -> Iterator[bytes]:
    """Header ``case, axis paths, derived paths, ending, flags, result names``; empty cells for missing values.

    A column that is not in SI has its unit: ``shaft.speed.mean [rpm]``; with ``header`` "units" every one that has one.
    """
    paths = source.study.column_paths
    shown = source.in_units()
    every = source.header == "units"
    named = [_headed(path, source.unit(path), "1" if every else unit_of(source.study, path)) for path in paths]
    results = [
        _headed(own.name, own.unit, "1" if every else si.unit)
        for own, si in zip(shown.infos, source.infos, strict=True)
    ]
    yield csv_lines([["case", *named, "ending", "flags", *results]])
    for block in shown.blocks:
        columns = source.parameters(block.cases).values()
        parameters = zip(*columns, strict=True) if paths else iter(lambda: (), None)
        lines = (
            [row.case, *map(_cell, values), row.ending, ";".join(row.flags), *map(_cell, row.results.values())]
            for row, values in zip(block.rows(), parameters, strict=False)
        )
        yield csv_lines(lines)


def table_csv(header: Iterable[str], columns: Iterable[Iterable[object]]) -> bytes:
    """A small table given by its columns, as CSV with the same cells as `csv_pieces`."""
    rows = ([_cell(value) for value in row] for row in zip(*columns, strict=True))
    return typed_lines(chain([list(header)], rows))


def stacked(parts: Iterable[Mapping[str, Sequence[Any]]]) -> dict[str, list[Any]]:
    """The columns of tables below each other; a column that a table lacks is empty there."""
    columns: dict[str, list[Any]] = {}
    rows = 0
    for part in parts:
        count = len(next(iter(part.values())))
        for name in dict.fromkeys([*columns, *part]):
            columns.setdefault(name, [None] * rows).extend(part.get(name, [None] * count))
        rows += count
    return columns


def read_table(columns: Mapping[str, Sequence[Any]], si: Mapping[str, str], units: Units) -> bytes:
    """A small table as CSV in a reader's ``units``; ``si`` are those of its columns.

    A column whose numbers are not SI says so: ``shaft.speed.mean [rpm]``.
    """
    shown = {name: si.get(name, "1") for name in columns}
    header = [_headed(name, units.unit(unit), unit) for name, unit in shown.items()]
    return table_csv(header, [[_shown(value, unit, units) for value in columns[name]] for name, unit in shown.items()])


def _shown(value: Any, unit: str, units: Units) -> Any:
    """A cell in a reader's units; a number that stands for a component as its name."""
    name = name_of(value, unit) if isinstance(value, float) else None
    return units.cell(value, unit) if name is None else name


def _headed(name: str, unit: str, known: str) -> str:
    """The head of a column, with its unit where that is not the known one."""
    return name if unit in (known, "") else f"{name} [{unit}]"


def _cell(value: object) -> object:
    if value is None or value != value:  # noqa: PLR0124 - NaN
        return ""
    return escape(str(value)) if isinstance(value, str) else value


def csv_lines(rows: Iterable[Iterable[object]]) -> bytes:
    """The rows as lines of CSV, of numbers and of texts that cannot look like one."""
    buffer = io.StringIO()
    csv.writer(buffer, lineterminator="\n").writerows(rows)
    return buffer.getvalue().encode("utf-8")


def typed_lines(rows: Iterable[Sequence[object]]) -> bytes:
    """The rows as lines of CSV; a text that looks like a number has quotes, and so have the others of its row."""
    buffer = io.StringIO()
    plain = csv.writer(buffer, lineterminator="\n")
    quoted = csv.writer(buffer, lineterminator="\n", quoting=csv.QUOTE_NONNUMERIC)
    for row in rows:
        texts = any(isinstance(cell, str) and DECIMAL_NUMBER.fullmatch(cell) for cell in row)
        (quoted if texts else plain).writerow(row)
    return buffer.getvalue().encode("utf-8")
