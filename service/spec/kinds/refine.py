"""Refinement: curves and maps along adaptive axes, accurate to within a given error (`refine` of a spec)."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from sprag_study.sentences import Amount, Sentence, plural
from sprag_study.service.languages import N_
from sprag_study.service.spec.axes.axes import ADAPTIVE, OF_BASE, axis_values, check_paths
from sprag_study.service.spec.axes.design import AXES
from sprag_study.service.spec.described import Described, Listed, Record
from sprag_study.service.spec.kinds.draft import Kind
from sprag_study.service.spec.kinds.fields import RESULT, read_ends, read_numeric_result, read_path_of, read_value
from sprag_study.service.spec.lists import read_list
from sprag_study.service.spec.shares import in_percent
from sprag_study.worker.errors import WrongPlanError
from sprag_study.worker.limits import MAX_PLANNED_CASES
from sprag_study.worker.models import regime_info
from sprag_study.worker.planning.refine_plan import SAME, AdaptiveAxis, ErrorBound, FixedAxis, RefinePlan

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.spec.kinds.draft import Draft, Finish
    from sprag_study.service.spec.node import Node
    from sprag_study.worker.models import ResultInfo

#: Largest error that can be asked for, and the smallest.
MIN_ERROR, MAX_ERROR = 1e-4, 0.2
MIN_FINEST, MAX_FINEST = 16, 4096
#: Values of each adaptive axis in the first round, unless they are given, for one adaptive axis and for two.
STARTS: Final = {1: 17, 2: 9}
_RESULTS: Final = "the results that must be accurate to within the error, or to within an error of their own"
_ERROR: Final = "largest error of straight lines between the points, relative to the range of the result"
_START: Final = (
    f"values of an adaptive axis in the first round, a power of 2 and 1; by default {STARTS[1]}, of a map {STARTS[2]}"
)
_FINEST: Final = "smallest interval, as a fraction of the axis, one over a power of 2"
_OF_RESULT: Final = (
    "largest error of this result: a share of its range with %, otherwise a value of the result, with or without a unit"
)
OF_RESULT: Final = Record(
    {"result": RESULT, "error": {"type": ["number", "string"], "description": _OF_RESULT, "examples": ["0.5 rad/s"]}},
    "a result with an error of its own",
    required=("result", "error"),
)
REFINE: Final = Record(
    {
        "results": Listed("results", 1, 16, _RESULTS, item={"anyOf": [RESULT, OF_RESULT.schema()]}),
        "error": Described(
            "error", "Error", _ERROR, "text", default="1 %",
            limits=f"{100.0 * MIN_ERROR:g} % to {100.0 * MAX_ERROR:g} %",
        ),
        "start": Described("start", "Values at first", _START, "whole", 3, 257),
        "finest": Described(
            "finest", "Finest step", _FINEST, "part", default="1/256", limits=f'"1/{MIN_FINEST}" to "1/{MAX_FINEST}"'
        ),
        "most": Described(
            "most", "Cases at most", "bound of the cases of all rounds", "whole", 2, MAX_PLANNED_CASES
        ),
    },
    "curves (one adaptive axis) or maps (two), refined until they are accurate to the given error",
    required=("results",),
)  # fmt: skip
#: Items of `axes` that refined studies do not take.
_OTHER: Final = ("sample", "points", "axes")

RefinedAxes = tuple[tuple[FixedAxis, ...], tuple[AdaptiveAxis, ...]]


def is_adaptive(item: object) -> bool:
    """Whether an item of `axes` is adaptive."""
    return isinstance(item, Mapping) and "adaptive" in item


def _read(draft: Draft) -> Finish | None:
    axes = _read_axes(draft.spec)
    if axes is None:
        return None
    fixed, adaptive = axes
    draft.vary([*((axis.paths, axis.values) for axis in fixed), *((a.paths, (a.low, a.high)) for a in adaptive)])

    def make_plan() -> None:
        plan = _read_plan(draft.spec["refine"], axes)
        draft.plan = None if plan is None else plan.to_json()

    return make_plan


#: Curves and maps of a given accuracy.
REFINEMENT: Final = Kind({"refine": REFINE}, _read)


def _read_axes(spec: Node) -> RefinedAxes | None:
    """The axes of a refined study: those with values, and one or two adaptive ones.

    None, and the faults recorded, where they are invalid.
    """
    node = spec["axes"]
    items = AXES.read(node)
    if items is None:
        return None
    axes = [_read_axis(item) for item in items]
    check_paths(node.report, [axis.paths if axis else () for axis in axes])
    count = sum(is_adaptive(item.value) for item in items)
    if count not in {1, 2} and not any(kind in item for item in items for kind in _OTHER):
        node.refuse(
            "exactly-one",
            plural("{count} axis is adaptive", "{count} axes are adaptive", count) if count else "no axis is adaptive",
            None, allowed='one axis with "adaptive": [from, to] for curves, two for a map',
        )  # fmt: skip
    fixed = tuple(axis for axis in axes if isinstance(axis, FixedAxis))
    return (fixed, tuple(axis for axis in axes if isinstance(axis, AdaptiveAxis))) if node.sound else None


def _read_axis(item: Node) -> FixedAxis | AdaptiveAxis | None:
    if is_adaptive(item.value):
        return _adaptive(item)
    other = next((kind for kind in _OTHER if kind in item), None)
    if other is not None:
        item[other].refuse("conflict", "cannot be combined with `refine`",
                           allowed="axes with a path and values, and adaptive ones")  # fmt: skip
        return None
    read = axis_values(item)
    return None if read is None else FixedAxis(read[0], tuple(read[1].tolist()))


def _adaptive(item: Node) -> AdaptiveAxis | None:
    ADAPTIVE.read(item)
    paths, node = read_path_of(item["path"]), item["adaptive"]
    if not isinstance(node.value, list) or len(node.value) != 2:
        node.refuse("wrong-type", "must be a list of two values",
                    allowed='a list of both ends, such as ["2 mm", "5 mm"]')  # fmt: skip
        return None
    if paths is None:
        return None
    ends = read_ends(node, paths, node.parts())
    included = _included(item, paths, *ends) if ends and "include" in item else ()
    return None if ends is None or included is None else AdaptiveAxis(paths, *ends, included)


def _included(item: Node, paths: tuple[str, ...], low: float, high: float) -> tuple[float, ...] | None:
    """The values that an axis includes (SI, ascending); None, and the faults recorded, where one is wrong."""
    nodes = ADAPTIVE.items(item, "include")
    parameters = [item.machine.parameters[path] for path in paths]
    unit = parameters[0].unit
    given = [node for node in nodes if node.value != OF_BASE]
    if not nodes or (given and read_list(given, unit, paths[0]) is None):
        return None
    values: list[float] = []
    for node in nodes:
        value = _of_base(node, paths) if node.value == OF_BASE else node.number_in(parameters)
        if value is None:
            continue
        ends = {"low": Amount(low, unit, 10), "high": Amount(high, unit, 10)}
        if not low <= value <= high:
            node.refuse("out-of-range", "is not between the ends of the axis", _shown(node, value),
                        allowed=Sentence("{low} to {high}", **ends), unit=unit)  # fmt: skip
        elif any(abs(value - other) <= SAME * (high - low) for other in values):
            node.refuse("repeated", "is named twice", _shown(node, value), allowed="each value once", unit=unit)
        values.append(value)
    return tuple(sorted(values)) if item.sound else None


def _of_base(node: Node, paths: tuple[str, ...]) -> float | None:
    """The value of an axis in `base`; None, and a fault recorded, where its paths have several there."""
    machine = node.machine
    values = {machine.values[path] for path in paths if path in machine.values}
    if len(values) > 1:
        node.refuse("conflict", "the paths of the axis have different values in `base`",
                    allowed=N_("a value of the axis"))  # fmt: skip
    return values.pop() if len(values) == 1 else None


def _shown(node: Node, value: float) -> object:
    """A value for a fault: as it was written, or the one in `base`."""
    return value if node.value == OF_BASE else node.value


def _read_plan(node: Node, axes: RefinedAxes) -> RefinePlan | None:
    """The plan of a refined study; None, and the faults recorded, where it is invalid.

    Parameters
    ----------
    node : the field `refine` of the spec, when the results of the study are known
    axes : as `_read_axes` gives them
    """
    if not REFINE.read(node):
        return None
    fixed, adaptive = axes
    infos, fields = node.report.results, REFINE.described
    results, errors = _read_results(REFINE.items(node, "results"))
    error = node["error"].otherwise(fields["error"].default).share(MIN_ERROR, MAX_ERROR)
    finest = _read_finest(node["finest"].otherwise(fields["finest"].default))
    start = fields["start"].read(node) if "start" in node else STARTS[len(adaptive)]
    most = fields["most"].read(node) if "most" in node else None
    if start is not None and not _power_of_two(start - 1):
        node["start"].refuse("out-of-range", "is not a power of 2 and 1", allowed="3, 5, 9, 17, 33, 65, 129, 257")
    elif start is not None and finest is not None and start > finest + 1:
        node["start"].refuse("out-of-range", "is finer than `finest`", start, allowed=f"<= {finest + 1}")
    if not node.sound or error is None or finest is None:
        return None
    widths = tuple(name for name in results if any(info.name == f"{name}.half_width" for info in infos))
    try:
        plan = RefinePlan(
            tuple(results), error, start, finest, adaptive, fixed, None, regime_info(infos) is not None, widths, errors
        )
    except WrongPlanError as wrong:
        node.refuse("too-many", wrong.message, None, allowed="fewer curves, results or intervals")
        return None
    named = plan.combinations * plan.included_points
    if most is not None and most < named:
        counted = plural("{count} case has an included value", "{count} cases have included values", named)
        node["most"].refuse("out-of-range", counted, allowed=f">= {named}")
        return None
    plan = replace(plan, most=most)
    if plan.most_cases > MAX_PLANNED_CASES:
        node["finest"].otherwise(fields["finest"].default).refuse(
            "too-many",
            plural("may need {count} case", "may need {count} cases", plan.most_cases),
            allowed=Sentence("at most {high}; `most` limits them", high=MAX_PLANNED_CASES),
        )
        return None
    return plan


def _read_results(items: Sequence[Node]) -> tuple[list[str], dict[str, ErrorBound]]:
    """Names of results that are numbers, each once, and the errors that some have; faults are recorded."""
    names: list[str] = []
    errors: dict[str, ErrorBound] = {}
    for item in items:
        of_result = isinstance(item.value, Mapping)
        if of_result and not OF_RESULT.read(item):
            continue
        named = item["result"] if of_result else item
        info = read_numeric_result(named)
        if info is not None and info.name in names:
            named.refuse("repeated", "is named twice", allowed="each result once")
        elif info is not None:
            names.append(info.name)
            bound = _read_bound(item["error"], info) if of_result else None
            errors |= {} if bound is None else {info.name: bound}
    return names, errors


def _read_bound(node: Node, info: ResultInfo) -> ErrorBound | None:
    """The error of one result: "2 %" of its range, or a value; None, and a fault recorded, where it is neither."""
    if not node.given:
        node.refuse("required", "is required", allowed='a value of the result, or a share of its range such as "2 %"')
        return None
    if in_percent(node.value) is not None:
        share = node.share(MIN_ERROR, MAX_ERROR)
        return None if share is None else ErrorBound(share)
    value = read_value(node, info, share=True)
    if value is not None and not (0.0 < value < math.inf):
        node.refuse("out-of-range", "is out of range", value, allowed="above 0")
        return None
    return None if value is None else ErrorBound(value, absolute=True)


def _read_finest(node: Node) -> int | None:
    """The number of intervals of the finest grid, from "1/256" or 256."""
    ends = {"low": f"1/{MIN_FINEST}", "high": f"1/{MAX_FINEST}"}
    allowed, value = Sentence('"{low}" to "{high}" of the axis, a power of 2', **ends), node.value
    match = re.fullmatch(r"\s*1\s*/\s*([0-9]{1,6})\s*", value) if isinstance(value, str) else None
    if isinstance(value, str) and match is None:
        node.refuse("not-a-number", "is not a part of the axis", allowed=allowed)
        return None
    if match and not MIN_FINEST <= int(match[1]) <= MAX_FINEST:
        node.refuse("out-of-range", "is out of range", allowed=allowed)
        return None
    whole = int(match[1]) if match else node.whole(MIN_FINEST, MAX_FINEST)
    if whole is not None and not _power_of_two(whole):
        node.refuse("out-of-range", "is not a power of 2", allowed=allowed)
        return None
    return whole


def _power_of_two(number: int) -> bool:
    return number > 0 and number & (number - 1) == 0
