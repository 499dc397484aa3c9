"""Cases given one by one as the text of a CSV file: a header of parameters, with a unit where it is not SI."""

from __future__ import annotations

from typing import Final

import numpy as np

from sprag_study.service.reading.texts import shorten_text
from sprag_study.service.spec.axes.axes import read_paths
from sprag_study.service.spec.axes.blocks import Block
from sprag_study.service.spec.csv_text import Column, read_columns, read_csv
from sprag_study.service.spec.described import Record
from sprag_study.service.spec.node import Node
from sprag_study.service.table_rows import heading_of
from sprag_study.worker.limits import MAX_AXIS_VALUES, MAX_COLUMNS

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
    columns = [_read_heading(node, cell, place) for place, cell in enumerate(rows[0].cells)]
    known = [column for column in columns if column is not None]
    if len(known) < len(columns):
        return None
    parameters, paths = node.machine.parameters, tuple(column.name for column in known)
    read = read_columns(node, rows[1:], [(column, parameters[column.name]) for column in known])
    if not node.sound:
        return None
    if len(set(paths)) < len(paths):
        node.refuse("repeated", "names the same path twice", [shorten_text(path) for path in paths])
        return None
    values, lines = [np.array(column) for column in read], tuple(row.line for row in rows[1:])
    return Block(item.pointer, paths, len(lines), lambda: dict(zip(paths, values, strict=True)), lines)


def _read_heading(node: Node, cell: str, place: int) -> Column | None:
    heading = heading_of(cell)
    if heading is None:
        node.refuse("invalid-path", "has a heading that names no parameter", cell,
                    allowed="a path, its unit in brackets")  # fmt: skip
        return None
    named = read_paths(node.holding(heading[0]))
    return None if named is None else Column(*heading, place)
