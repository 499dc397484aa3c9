"""Refinement: curves and maps along adaptive axes, accurate to within a given error (`refine` of a spec)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

from sprag.sentences import Sentence, plural
from sprag.service.spec.axes.axes import AXES, axis_values, check_paths
from sprag.service.spec.described import Described, Listed
from sprag.service.spec.fields import read_object, read_whole
from sprag.service.spec.plan.fields import read_ends, read_path_of, read_results
from sprag.service.spec.report import Report, join
from sprag.service.spec.shares import read_share
from sprag.worker.limits import MAX_PLANNED_CASES
from sprag.worker.models import regime_info
from sprag.worker.planning.refine_plan import AdaptiveAxis, FixedAxis, RefinePlan

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag.service.spec.machine.machine import Machine
    from sprag.worker.models import ResultInfo

FIELDS: Final = ("results", "error", "start", "finest", "most")
#: Largest error that can be asked for, and the smallest.
MIN_ERROR, MAX_ERROR = 1e-4, 0.2
MIN_FINEST, MAX_FINEST = 16, 4096
RESULTS: Final = Listed("results", 1, 16, "the results that must be accurate to within the error")
#: Values of each adaptive axis in the first round, unless they are given, for one adaptive axis and for two.
STARTS: Final = {1: 17, 2: 9}
START: Final = Described(
    "start",
    "Values at first",
    f"values of an adaptive axis in the first round, a power of 2 and 1; by default {STARTS[1]}, of a map {STARTS[2]}",
    "whole",
    3,
    257,
)
MOST: Final = Described("most", "Cases at most", "bound of the cases of all rounds", "whole", 2, MAX_PLANNED_CASES)
#: Items of `axes` that refined studies do not take.
_OTHER: Final = ("sample", "points", "axes")
ERROR: Final = Described(
    "error",
    "Error",
    "largest error of straight lines between the points, relative to the range of the result",
    "text",
    default="1 %",
    limits=f"{100.0 * MIN_ERROR:g} % to {100.0 * MAX_ERROR:g} %",
)
FINEST: Final = Described(
    "finest",
    "Finest step",
    "smallest interval, as a fraction of the axis, one over a power of 2",
    "text",
    default="1/256",
    limits=f'"1/{MIN_FINEST}" to "1/{MAX_FINEST}"',
)


def is_adaptive(item: object) -> bool:
    """Whether an item of `axes` is adaptive."""
    return isinstance(item, Mapping) and "adaptive" in item


def read_refined_axes(
    report: Report, data: object, machine: Machine
) -> tuple[tuple[FixedAxis, ...], tuple[AdaptiveAxis, ...]] | None:
    """The axes of a refined study: those with values, and one or two adaptive ones.

    None, and the faults recorded, where they are invalid.
    """
    items = AXES.read(report, "/axes", data)
    if items is None:
        return None
    before = report.found
    fixed: list[FixedAxis] = []
    adaptive: list[AdaptiveAxis] = []
    every: list[tuple[str, ...]] = []
    for index, item in enumerate(items):
        where = join("/axes", index)
        if is_adaptive(item):
            axis = _adaptive(report, where, item, machine)
            adaptive += [axis] if axis else []
            every.append(axis.paths if axis else ())
            continue
        if other := next((kind for kind in _OTHER if isinstance(item, Mapping) and kind in item), None):
            report.fault(join(where, other), "conflict", "cannot be combined with `refine`", item[other],
                         allowed="axes with a path and values, and adaptive ones")  # fmt: skip
            every.append(())
            continue
        read = axis_values(report, where, item, machine)
        fixed += [FixedAxis(read[0], tuple(read[1].tolist()))] if read else []
        every.append(read[0] if read else ())
    check_paths(report, every)
    count = sum(map(is_adaptive, items))
    if count not in {1, 2} and not any(kind in item for item in items if isinstance(item, Mapping) for kind in _OTHER):
        report.fault(
            "/axes", "exactly-one",
            plural("{count} axis is adaptive", "{count} axes are adaptive", count) if count else "no axis is adaptive",
            allowed='one axis with "adaptive": [from, to] for curves, two for a map',
        )  # fmt: skip
    return None if report.found > before else (tuple(fixed), tuple(adaptive))


def _adaptive(report: Report, pointer: str, item: object, machine: Machine) -> AdaptiveAxis | None:
    found = read_object(report, pointer, item, ("path", "adaptive")) or {}
    paths = read_path_of(report, pointer, found.get("path"), machine)
    where, ends = join(pointer, "adaptive"), found.get("adaptive")
    if not isinstance(ends, list) or len(ends) != 2:
        report.fault(
            where, "wrong-type", "must be a list of two values", ends,
            allowed='a list of both ends, such as ["2 mm", "5 mm"]',
        )  # fmt: skip
        return None
    if paths is None:
        return None
    read = read_ends(report, where, paths, [(join(where, k), end) for k, end in enumerate(ends)], machine)
    return None if read is None else AdaptiveAxis(paths, *read)


def read_refine(
    report: Report,
    data: object,
    axes: tuple[tuple[FixedAxis, ...], tuple[AdaptiveAxis, ...]],
    infos: Sequence[ResultInfo],
) -> RefinePlan | None:
    """The plan of a refined study; None, and the faults recorded, where it is invalid.

    Parameters
    ----------
    data : the field `refine` of the spec
    axes : as `read_refined_axes` gives them
    infos : the results of the study
    """
    found = read_object(report, "/refine", data, FIELDS)
    if found is None:
        return None
    before = report.found
    names = RESULTS.read(report, "/refine/results", found.get("results")) or []
    results = read_results(report, "/refine/results", names, infos)
    error = read_share(report, "/refine/error", found.get("error", ERROR.default), MIN_ERROR, MAX_ERROR)
    finest = _read_finest(report, found.get("finest", FINEST.default))
    start = START.read(report, "/refine", found) if "start" in found else STARTS[len(axes[1])]
    most = MOST.read(report, "/refine", found) if "most" in found else None
    if start is not None and not _power_of_two(start - 1):
        report.fault(
            "/refine/start", "out-of-range", "is not a power of 2 and 1", start, allowed="3, 5, 9, 17, 33, 65, 129, 257"
        )
    elif start is not None and finest is not None and start > finest + 1:
        report.fault("/refine/start", "out-of-range", "is finer than `finest`", start, allowed=f"<= {finest + 1}")
    if report.found > before or error is None or finest is None:
        return None
    fixed, adaptive = axes
    widths = tuple(name for name in results if any(info.name == f"{name}.half_width" for info in infos))
    try:
        plan = RefinePlan(
            tuple(results), error, start, finest, adaptive, fixed, most, regime_info(infos) is not None, widths
        )
    except ValueError as fault:
        report.fault("/refine", "too-many", str(fault), allowed="fewer curves, results or intervals")
        return None
    if plan.most_cases > MAX_PLANNED_CASES:
        report.fault(
            "/refine/finest",
            "too-many",
            plural("may need {count} case", "may need {count} cases", plan.most_cases),
            found.get("finest", FINEST.default),
            allowed=Sentence("at most {high}; `most` limits them", high=MAX_PLANNED_CASES),
        )
        return None
    return plan


def _read_finest(report: Report, value: object) -> int | None:
    """The number of intervals of the finest grid, from "1/256" or 256."""
    ends = {"low": f"1/{MIN_FINEST}", "high": f"1/{MAX_FINEST}"}
    allowed = Sentence('"{low}" to "{high}" of the axis, a power of 2', **ends)
    match = re.fullmatch(r"\s*1\s*/\s*([0-9]{1,6})\s*", value) if isinstance(value, str) else None
    number = int(match[1]) if match else value
    if isinstance(value, str) and match is None:
        report.fault("/refine/finest", "not-a-number", "is not a part of the axis", value, allowed=allowed)
        return None
    if match and not MIN_FINEST <= int(match[1]) <= MAX_FINEST:
        report.fault("/refine/finest", "out-of-range", "is out of range", value, allowed=allowed)
        return None
    whole = read_whole(report, "/refine/finest", number, MIN_FINEST, MAX_FINEST)
    if whole is not None and not _power_of_two(whole):
        report.fault("/refine/finest", "out-of-range", "is not a power of 2", value, allowed=allowed)
        return None
    return whole


def _power_of_two(number: int) -> bool:
    return number > 0 and number & (number - 1) == 0
