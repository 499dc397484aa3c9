"""Calibration: which parameters are unknown, and what was measured (`calibrate` of a spec)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from sprag.sentences import Sentence, plural
from sprag.service.spec.axes.axes import check_paths
from sprag.service.spec.described import Described, Listed, choice, named
from sprag.service.spec.draws.tolerances import expanded
from sprag.service.spec.fields import read_object
from sprag.service.spec.plan.fields import read_ends, read_path_of
from sprag.service.spec.plan.measured_points import MeasuredTable, read_results, read_table
from sprag.service.spec.report import Report, join
from sprag.worker.planning.calibrate.plan import LOSSES, MOST_MEASURED, MOST_UNKNOWN, REFITS, CalibratePlan, Unknown

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag.service.spec.machine.machine import Machine
    from sprag.worker.models import ResultInfo

UNKNOWN: Final = Listed("parameters", 1, MOST_UNKNOWN, "what is unknown, each between two values")
LOSS: Final = choice(
    "loss",
    "how much a large residual counts: linear (least squares), or less with the others",
    *LOSSES,
    default="linear",
)
OTHER: Final = named(
    LOSS,
    Described(
        "refits", "Refits", "refits of the bootstrap, which gives the intervals; 0 for none", "whole", *REFITS, 200
    ),
    Described("seed", "Seed", "seed of the random numbers", "whole", 0, 2**32 - 1, 1),
)
CSV_HELP: Final = (
    "text of a CSV file: a column for each parameter that was set, for each measured result and, behind it, for its "
    "standard deviation (sigma); units in brackets"
)
FIELDS: Final = ("unknown", "measured", *OTHER)


@dataclass(frozen=True)
class Calibration:
    """What a spec says of a calibration, as far as it can be read without the results of the study."""

    unknown: tuple[Unknown, ...]
    table: MeasuredTable
    loss: Any
    refits: int
    seed: int


def read_calibration(report: Report, data: object, machine: Machine) -> Calibration | None:
    """The field `calibrate`; None, and the faults recorded, where it is invalid."""
    found = read_object(report, "/calibrate", data, FIELDS, given=True)
    if found is None:
        return None
    before = report.found
    unknown = _read_unknown(report, found.get("unknown"), machine)
    measured = read_object(report, "/calibrate/measured", found.get("measured"), ("csv",))
    table = None if measured is None else read_table(report, "/calibrate/measured/csv", measured.get("csv"), machine)
    other = {name: field.read(report, "/calibrate", found) for name, field in OTHER.items()}
    for index, one in enumerate(unknown or ()):
        for path in set(one.paths) & set(table.paths if table else ()):
            report.fault(
                join("/calibrate/unknown", index, "path"), "conflict", "is a column of the measured points", path,
                allowed="either unknown, or set in the measurement",
            )  # fmt: skip
    return None if report.found > before or not unknown or table is None else Calibration(unknown, table, **other)


def _read_unknown(report: Report, data: object, machine: Machine) -> tuple[Unknown, ...] | None:
    items = UNKNOWN.read(report, "/calibrate/unknown", data)
    if items is None:
        return None
    before = report.found
    found: list[Unknown] = []
    for index, item in enumerate(items):
        where = join("/calibrate/unknown", index)
        fields = read_object(report, where, item, ("path", "from", "to"))
        if fields is None:
            continue
        paths = read_path_of(report, where, _expanded(fields.get("path"), machine), machine)
        ends = [(join(where, name), fields.get(name)) for name in ("from", "to")]
        read = None if paths is None else read_ends(report, where, paths, ends, machine)
        found += [] if paths is None or read is None else [Unknown(paths, *read)]
    if report.found == before:
        check_paths(report, [one.paths for one in found], "/calibrate/unknown")
    return None if report.found > before else tuple(found)


def _expanded(path: object, machine: Machine) -> object:
    """The path or paths with every ``*`` replaced by the numbers that there are; unchanged where there are none."""
    items: list[Any] = path if isinstance(path, list) else [path]
    found = [expanded(item, machine.parameters) if isinstance(item, str) and "*" in item else [item] for item in items]
    changed = all(found) and any(own != [item] for own, item in zip(found, items, strict=True))
    return [each for own in found for each in own] if changed else path


def read_plan(report: Report, infos: Sequence[ResultInfo], calibration: Calibration) -> dict[str, Any] | None:
    """The plan as plain JSON data; None, and the faults recorded, where the measured results are invalid."""
    where, table = "/calibrate/measured/csv", calibration.table
    measured = read_results(report, where, table, infos)
    if measured is None:
        return None
    count, least = sum(len(one.values) for one in measured), len(calibration.unknown) + 1
    if not least <= count <= MOST_MEASURED:
        report.fault(
            where, "out-of-range",
            plural("has {count} measured value", "has {count} measured values", count), count,
            allowed=Sentence(
                "{low} to {high}: more values than unknown parameters", low=str(least), high=MOST_MEASURED
            ),
        )  # fmt: skip
        return None
    try:
        return CalibratePlan(
            calibration.unknown, table.paths, table.conditions, measured,
            calibration.loss, calibration.refits, calibration.seed,
        ).to_json()  # fmt: skip
    except ValueError as error:
        report.fault(where, "too-many", str(error), allowed="fewer different points or unknown parameters")
        return None
