"""Calibration: which parameters are unknown, and what was measured (`calibrate` of a spec)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from sprag_study.sentences import Sentence, plural
from sprag_study.service.spec.axes.axes import PATHS, check_paths
from sprag_study.service.spec.described import Described, Listed, Record, choice, named
from sprag_study.service.spec.fields import expanded
from sprag_study.service.spec.kinds.draft import Kind
from sprag_study.service.spec.kinds.fields import read_ends, read_path_of
from sprag_study.service.spec.kinds.measured_points import MeasuredTable, read_results, read_table
from sprag_study.service.spec.node import Node
from sprag_study.service.spec.schema.quantity import QUANTITY
from sprag_study.worker.errors import WrongPlanError
from sprag_study.worker.planning.calibrate.plan import (
    LOSSES,
    MOST_MEASURED,
    MOST_UNKNOWN,
    REFITS,
    CalibratePlan,
    Unknown,
)

if TYPE_CHECKING:
    from sprag_study.service.spec.kinds.draft import Draft, Finish

_CSV: Final = (
    "text of a CSV file: a column for each parameter that was set, for each measured result and, behind it, for its "
    "standard deviation (sigma); units in brackets"
)
_LOSS: Final = "how much a large residual counts: linear (least squares), or less with the others"
_REFITS: Final = "refits of the bootstrap, which gives the intervals; 0 for none"
_UNKNOWN: Final = Record({"path": PATHS, "from": QUANTITY, "to": QUANTITY}, required=("path", "from", "to"))
_MEASURED: Final = Record({"csv": {"type": "string", "description": _CSV}}, required=("csv",))
CALIBRATE: Final = Record(
    {
        "unknown": Listed("parameters", 1, MOST_UNKNOWN, "what is unknown, each between two values", item=_UNKNOWN),
        "measured": _MEASURED,
        **named(
            choice("loss", _LOSS, *LOSSES, default="linear"),
            Described("refits", "Refits", _REFITS, "whole", *REFITS, 200),
            Described("seed", "Seed", "seed of the random numbers", "whole", 0, 2**32 - 1, 1),
        ),
    },
    "measured points, and the parameters that they are to determine",
    required=("unknown", "measured"),
)


def _read(draft: Draft) -> Finish | None:
    node = draft.spec["calibrate"]
    if not CALIBRATE.read(node, null=False):
        return None
    unknown = _read_unknown(node)
    measured = node["measured"]
    table = read_table(measured["csv"]) if _MEASURED.read(measured) else None
    other = CALIBRATE.values(node)
    for index, one in enumerate(unknown or ()):
        for path in set(one.paths) & set(table.paths if table else ()):
            node["unknown"][index]["path"].refuse("conflict", "is a column of the measured points", path,
                                                  allowed="either unknown, or set in the measurement")  # fmt: skip
    if not node.sound or not unknown or table is None:
        return None
    columns = zip(table.paths, zip(*table.conditions, strict=True), strict=True)
    draft.vary([*((one.paths, (one.low, one.high)) for one in unknown), *(((path,), own) for path, own in columns)])

    def make_plan() -> None:
        draft.plan = _read_plan(measured["csv"], unknown, table, **other)

    return make_plan


#: The values of parameters from measured points.
CALIBRATION: Final = Kind({"calibrate": CALIBRATE}, _read)


def _read_unknown(calibrate: Node) -> tuple[Unknown, ...] | None:
    node = calibrate["unknown"]
    unknown: list[Unknown] = []
    for item in CALIBRATE.items(calibrate, "unknown"):
        if _UNKNOWN.read(item):
            path = item["path"]
            paths = read_path_of(path.holding(_expanded(path)))
            ends = None if paths is None else read_ends(item, paths, (item["from"], item["to"]))
            unknown += [] if paths is None or ends is None else [Unknown(paths, *ends)]
    if node.sound:
        check_paths(node.report, [one.paths for one in unknown], node.pointer)
    return tuple(unknown) if node.sound else None


def _expanded(node: Node) -> object:
    """The path or paths with every ``*`` replaced by the numbers that there are; unchanged where there are none."""
    path, known = node.value, node.machine.parameters
    items: list[Any] = path if isinstance(path, list) else [path]
    every = [expanded(item, known) if isinstance(item, str) and "*" in item else [item] for item in items]
    changed = all(every) and any(own != [item] for own, item in zip(every, items, strict=True))
    return [each for own in every for each in own] if changed else path


def _read_plan(
    node: Node, unknown: tuple[Unknown, ...], table: MeasuredTable, loss: Any, refits: int, seed: int
) -> dict[str, Any] | None:
    """The plan as plain JSON data; None, and the faults recorded, where the measured results are invalid."""
    measured = read_results(node, table)
    if measured is None:
        return None
    count, least = sum(len(one.values) for one in measured), len(unknown) + 1
    if not least <= count <= MOST_MEASURED:
        node.refuse(
            "out-of-range", plural("has {count} measured value", "has {count} measured values", count), count,
            allowed=Sentence(
                "{low} to {high}: more values than unknown parameters", low=str(least), high=MOST_MEASURED
            ),
        )  # fmt: skip
        return None
    try:
        return CalibratePlan(unknown, table.paths, table.conditions, measured, loss, refits, seed).to_json()
    except WrongPlanError as error:
        node.refuse("too-many", error.message, None, allowed="fewer different points or unknown parameters")
        return None
