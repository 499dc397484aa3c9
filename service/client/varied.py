"""What varies in the axes of a spec: lists of values, samples, points and groups of these."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any

from sprag_study.service.table_rows import heading_of, split


def paths_of(axis: Mapping[str, Any]) -> Iterator[str]:
    """The paths of an axis, of the ranges of a sample, of the headings of points, and of what a group has."""
    for part in (*axis.get("ranges", ()), *axis.get("axes", ())):
        yield from paths_of(part)
    if isinstance(points := axis.get("points"), str):
        with suppress(csv.Error):  # what reads the spec refuses it
            yield from [_path(cell) for row in split(points).rows[:1] for cell in row.cells]
    path = axis.get("path", [])
    yield from [path] if isinstance(path, str) else path


def without(axes: Sequence[Mapping[str, Any]], path: str) -> list[Any]:
    """The axes without a parameter; what it shares with others is theirs alone, and what is its alone is gone."""
    left = (axis if path not in paths_of(axis) else _less(axis, path) for axis in axes)
    return [axis for axis in left if any(paths_of(axis))]


def _less(axis: Mapping[str, Any], path: str) -> Mapping[str, Any]:
    """An axis that varies a parameter, without it."""
    for parts in ("ranges", "axes"):
        if parts in axis:
            return {**axis, parts: without(axis[parts], path)}
    if "points" in axis:
        return {**axis, "points": _points(axis["points"], path)}
    others = [other for other in paths_of(axis) if other != path]
    return {**axis, "path": others[0] if len(others) == 1 else others}


def _points(text: str, path: str) -> str:
    """The CSV text of cases without the column of a parameter."""
    table = split(text)
    kept = [place for place, cell in enumerate(table.rows[0].cells) if _path(cell) != path]
    made = io.StringIO()
    # A comma with a blank behind it stands between numbers with decimal commas.
    sign = ";" if table.separator == ", " else table.separator or ","
    if sign != ",":  # a single column has no sign that says it, and a bar is never looked for
        made.write(f"sep={sign}\n")
    csv.writer(made, delimiter=sign, lineterminator="\n").writerows([r.cells[k] for k in kept] for r in table.rows)
    return made.getvalue()


def _path(heading: str) -> str:
    named = heading_of(heading)
    return heading if named is None else named[0]
