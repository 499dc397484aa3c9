"""Studies that choose their own cases: what they can vary, and their first round."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag.sentences import Sentence
from sprag.service.spec.plan import calibrate, goal, refine
from sprag.worker import models
from sprag.worker.planning import planner_of
from sprag.worker.study import Axis, Study

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag.service.spec.node import Node
    from sprag.worker.spread import Spread

#: Fields of a spec by which a study chooses its own cases, with their descriptions.
FIELDS: Final = {"refine": refine.REFINE, "goal": goal.GOAL, "calibrate": calibrate.CALIBRATE}


@dataclass(frozen=True)
class Outline:
    """What a study can vary, as zipped axes with the ends of each range, and how its plan is read.

    The plan needs the results of the study, which are only known with its machine and its run. ``with_drives`` gives
    the outline with that many drawn drives of each case; None where cases have none.
    """

    axes: tuple[Axis, ...]
    plan: Callable[[], dict[str, Any] | None]
    with_drives: Callable[[int], Outline] | None = None


def chooses(found: Mapping[str, Any]) -> bool:
    """Whether a spec describes a study that chooses its own cases."""
    items = found.get("axes")
    adaptive = isinstance(items, list) and any(map(refine.is_adaptive, items))
    return adaptive or any(name in found for name in FIELDS)


def read_outline(spec: Node) -> Outline | None:
    """The outline of a study that `chooses` its cases; None, and the faults recorded, where it is invalid."""
    kind = next((name for name in FIELDS if name in spec), "refine")
    node = spec[kind]
    for name in ("exclude", "combine", *FIELDS, *(() if kind == "refine" else ("axes",))):
        other = spec[name]
        if name == kind or not other.given or (name == "combine" and other.value == "grid"):
            continue
        message = Sentence("cannot be combined with `{kind}`", kind=kind)
        other.refuse("conflict", message, allowed=Sentence("without `{field}`", field=name))
    outline = _refine(spec) if kind == "refine" else {"goal": _goal, "calibrate": _calibrate}[kind](node)
    return outline if node.sound else None


def _refine(spec: Node) -> Outline | None:
    axes = refine.read_refined_axes(spec)
    if axes is None:
        return None

    def plan() -> dict[str, Any] | None:
        read = refine.read_refine(spec["refine"], axes)
        return None if read is None else read.to_json()

    fixed, adaptive = axes
    ends = [*((axis.paths, axis.values) for axis in fixed), *((axis.paths, (axis.low, axis.high)) for axis in adaptive)]
    return Outline(_zipped(ends), plan)


def _goal(node: Node) -> Outline | None:
    if not goal.GOAL.read(node, null=False):
        return None
    variables = goal.read_variables(node)
    points = goal.read_points(node, variables)
    if variables is None or points is None:
        return None
    ends = [(tuple(v["paths"]), v.get("values") or (v["low"], v["high"])) for v in variables]
    ends += [((path,), [point[path] for point in points]) for path in (points[0] if points else ())]
    plan = partial(goal.read_goal, node, variables, points)
    outline = Outline(_zipped(ends), plan)
    return replace(outline, with_drives=lambda drives: replace(outline, plan=partial(plan, drives=drives)))


def _calibrate(node: Node) -> Outline | None:
    calibration = calibrate.read_calibration(node)
    if calibration is None:
        return None
    table = calibration.table
    ends: list[tuple[tuple[str, ...], Sequence[float]]] = [
        (one.paths, (one.low, one.high)) for one in calibration.unknown
    ]
    ends += [((path,), column) for path, column in zip(table.paths, zip(*table.conditions, strict=True), strict=True)]
    return Outline(_zipped(ends), partial(calibrate.read_plan, calibration))


def _zipped(ends: Sequence[tuple[tuple[str, ...], Sequence[float]]]) -> tuple[Axis, ...]:
    """Axes of one length with all these values; shorter lists begin again."""
    length = max((len(values) for _, values in ends), default=0)
    return tuple(Axis(paths, np.resize(np.asarray(values, dtype=np.float64), length)) for paths, values in ends)


def first_round(spec: Node, study: Study, outline: Outline, spread: Spread | None = None) -> Study:
    """``study`` with its plan, its tolerances and the cases of its first round; SpecError where the plan is invalid."""
    if spread is not None and outline.with_drives is not None:
        outline = outline.with_drives(spread.drives)
    spec.report.results = models.study_results(study)
    plan = outline.plan()
    spec.report.raise_if_any()
    assert plan is not None
    planner = planner_of(plan)
    points = planner.ask().points
    axes = tuple(Axis(paths, column) for paths, column in zip(planner.paths, points.T, strict=True))
    return replace(study, axes=axes, combine="zip", plan=plan, spread=spread)
