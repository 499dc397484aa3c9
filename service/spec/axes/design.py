"""What varies in a study: axes as a grid or side by side, and combinations that are expanded case by case.

A plain grid or zip of axes is kept. Samples, points, groups, unions and exclusions are combined here into one table, a
zip with one axis for each varied parameter.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import Sentence, plural
from sprag_study.service.reading.texts import quantity_text
from sprag_study.service.spec.axes.axes import ADAPTIVE, AXIS, check_paths, expand, read_axes, read_axis
from sprag_study.service.spec.axes.blocks import (
    Block,
    as_axes,
    block_columns,
    chosen,
    first_rows,
    one_after_another,
    product,
    side_by_side,
)
from sprag_study.service.spec.axes.exclude import kept, read_exclude
from sprag_study.service.spec.axes.points import POINTS, read_points
from sprag_study.service.spec.axes.sample import SAMPLE, read_sample
from sprag_study.service.spec.axes.values import any_count, count_text
from sprag_study.service.spec.component_axes import COMPONENT_AXIS
from sprag_study.service.spec.derive import layout
from sprag_study.service.spec.described import Listed, Record, Variants, choice
from sprag_study.service.spec.node import Node
from sprag_study.service.spec.report import Report
from sprag_study.worker.limits import MAX_AXES, MAX_AXIS_VALUES, MAX_COLUMNS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.service.spec.machine.machine import Machine
    from sprag_study.worker.study import Axis, Combine

_COMBINE_HELP: Final = (
    "grid: every combination of the axes (the first varies slowest); zip: the axes side by side; union: one after the "
    "other, what does not vary being as in the base, each case once"
)
COMBINE: Final = choice("combine", _COMBINE_HELP, "grid", "zip", "union", default="grid")
_IN_GROUP: Final = (AXIS, SAMPLE, POINTS, COMPONENT_AXIS)
#: Of a group, and of whatever is not a plain grid or zip.
_GROUPED: Final = Listed("axes", 1, MAX_AXES, item=Variants(_IN_GROUP))
_GROUP: Final = Record({"combine": COMBINE, "axes": _GROUPED}, "a group of axes", required=("axes",))
#: Anything that varies cases of a plain study.
ANYTHING: Final = Variants((*_IN_GROUP, _GROUP))
AXES: Final = Listed("axes", 0, MAX_AXES, "what varies from case to case", item=Variants((*ANYTHING.ways, ADAPTIVE)))


def read_design(spec: Node) -> tuple[tuple[Axis, ...] | None, Combine]:
    """Read the axes of the study and their combination from the spec's fields `axes`, `combine` and `exclude`.

    The axes are None when they are invalid; the faults are recorded.
    """
    report, machine = spec.report, spec.machine
    combine = COMBINE.read(spec)
    node = spec["axes"]
    items = node.parts() if isinstance(node.value, list) else ()
    plain = all(_kind(item.value) == "axis" for item in items)
    if plain and combine != "union" and "exclude" not in spec:
        chosen_combine: Combine = "zip" if combine == "zip" else "grid"
        listed = AXES.read(node)
        return None if listed is None else read_axes(node, listed, chosen_combine), chosen_combine
    conditions = read_exclude(spec["exclude"]) if "exclude" in spec else []
    block = _group(spec, combine)
    if block is None or report.faults or not _fits(report, block):
        return None, "zip"
    columns = block.make()
    if columns is None or report.faults:
        return None, "zip"
    if conditions:
        count = _length(columns)
        every = layout(machine, as_axes(columns), "zip").columns(range(count))
        columns = chosen(columns, kept(conditions, every, machine.values, count))
        return _as_axes(report, columns, machine, excluded=True), "zip"
    return _as_axes(report, columns, machine, block.lines), "zip"


def _as_axes(
    report: Report,
    columns: dict[str, NDArray[np.float64]],
    machine: Machine,
    lines: tuple[int, ...] = (),
    *,
    excluded: bool = False,
) -> tuple[Axis, ...] | None:
    count = _length(columns)
    if not count:
        report.fault(
            "/exclude" if excluded else "/axes",
            "empty",
            "every case is excluded" if excluded else "nothing varies",
            allowed="at least one case that is left",
        )
        return None
    first = first_rows(columns)
    if first.size < count:
        again = int(np.setdiff1d(np.arange(count), first)[0])
        alike = np.all([column == column[again] for column in columns.values()], axis=0)
        units = {path: machine.parameters[path].unit for path in columns}
        values = [f"{path} = {quantity_text(column[again], units[path])}" for path, column in columns.items()]
        before = int(np.flatnonzero(alike)[0])
        places = {"earlier": str(before), "later": str(again)}
        message = Sentence("cases {earlier} and {later}, counted from 0, are the same", **places)
        if lines:
            places = {"earlier": str(lines[before]), "later": str(lines[again])}
            message = Sentence("lines {earlier} and {later} are the same", **places)
        where = "/axes/0/points" if lines else "/axes"
        report.fault(where, "repeated", message, values, allowed="each combination of values once")
        return None
    return as_axes(columns)


def _length(columns: Mapping[str, NDArray[np.float64]]) -> int:
    return next(iter(columns.values())).size if columns else 0


def _kind(item: object) -> str:
    """The kind of an item of `axes`, recognised by the field that only this kind has."""
    if isinstance(item, Mapping):
        for kind, mark in (("sample", "sample"), ("points", "points"), ("group", "axes")):
            if mark in item:
                return kind
    return "axis"


def _group(group: Node, combine: str | None) -> Block | None:
    """The block of the list of axes, samples, points and (at the top) groups of a group, or of the whole spec."""
    node, top = group["axes"], not group.pointer
    listed = _GROUPED.read(node.otherwise([]) if top else node)
    if listed is None:
        return None
    read = [_item(item, combine, top=top) for item in listed]
    blocks = [block for block in read if block is not None]
    if len(blocks) < len(listed) or combine is None:
        return None
    if combine != "union":
        check_paths(group.report, [block.paths for block in blocks], node.pointer)
    counts = [block.count for block in blocks]
    if combine == "zip" and len(set(counts)) > 1:
        node.refuse(
            "unequal-lengths", "axes that are zipped must have equally many values",
            [count_text(number) for number in counts], allowed="axes of one length, or combine: 'grid'",
        )  # fmt: skip
        return None
    count = {"grid": math.prod(counts), "zip": counts[0], "union": sum(counts)}[combine]
    paths = tuple(dict.fromkeys(path for block in blocks for path in block.paths))
    lines = blocks[0].lines if top and len(blocks) == 1 else ()
    return Block(group.pointer, paths, count, partial(_make, node, blocks, combine), lines)


def _make(node: Node, blocks: list[Block], combine: str) -> dict[str, NDArray[np.float64]] | None:
    tables = block_columns(blocks)
    if tables is None:
        return None
    counts = [_length(columns) for columns in tables]
    if combine == "grid":
        return product(tables, counts)
    if combine == "zip" and len(set(counts)) > 1:  # a union inside had the same cases twice
        node.refuse("unequal-lengths", "axes that are zipped must have equally many different cases", counts)
        return None
    if combine == "zip":
        return side_by_side(tables)
    machine = node.machine
    # A missing limit is infinite, which cannot be stored as the value of the other cases.
    lacking = [path for path in dict.fromkeys(path for columns in tables for path in columns)
               if path not in machine.values and any(path not in columns for columns in tables)]  # fmt: skip
    for path in lacking:
        message = Sentence(
            "varies {path} in a part of the cases only, and `base` does not give it for the others", path=path
        )
        node.refuse("required", message, None, allowed="its value in `base` too")
    return None if lacking else one_after_another(tables, counts, machine.values)


def _item(item: Node, combine: str | None, *, top: bool) -> Block | None:
    kind = _kind(item.value)
    readers: dict[str, Callable[[Node], Block | None]] = {"sample": read_sample, "points": read_points}
    if kind in readers:
        return readers[kind](item)
    if kind == "axis":
        return _axis(item, "zip" if combine == "zip" else "grid")
    _GROUP.read(item)
    if not top:
        item.refuse("conflict", "is a group inside a group", None, allowed="an axis, a sample or points")
        return None
    inner = COMBINE.read(item)
    return _group(item, inner)


def _axis(item: Node, combine: Combine) -> Block | None:
    paths, plan = read_axis(item)
    if paths is None or plan is None:
        return None
    parameters = [item.machine.parameters[path] for path in paths]
    counts = Counter(paths)
    if max(counts.values()) > 1:
        item["path"].refuse("repeated", "names the same path twice", counts.most_common(1)[0][0])
        return None

    def make() -> dict[str, NDArray[np.float64]] | None:
        values = expand(plan, parameters, combine)
        return None if values is None else dict.fromkeys(paths, values)

    return Block(item.pointer, paths, plan.count, make)


def _fits(report: Report, block: Block) -> bool:
    """Whether the table is small enough: all its numbers are stored with the study."""
    if len(block.paths) > MAX_COLUMNS:
        message = plural(
            "{count} parameter varies", "{count} parameters vary", len(block.paths), count=str(len(block.paths))
        )
        allowed = plural("at most {count} parameter", "at most {count} parameters", MAX_COLUMNS)
        report.fault("/axes", "too-many", message, allowed=allowed)
        return False
    most = MAX_AXIS_VALUES // max(len(block.paths), 1)
    if block.count <= most:
        return True
    report.fault(
        "/axes",
        "too-many",
        Sentence(
            "needs a table of {cases} cases with {parameters} parameters each",
            cases=any_count(block.count),
            parameters=str(len(block.paths)),
        ),
        allowed=Sentence(
            "at most {numbers} numbers, here {cases} cases; a plain grid may have more",
            numbers=MAX_AXIS_VALUES,
            cases=most,
        ),
    )
    return False
