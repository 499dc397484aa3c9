"""Refined maps: one result over the two adaptive axes, at the middles of the squares of an even grid."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import Sentence
from sprag_study.service.faults import refused
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.results.curves import Fetch, Map, not_run
from sprag_study.service.results.refined import RefinedMap, refine_plan
from sprag_study.service.results.selection import LEFT_OPEN, axis_name, held_texts, listed, locate_axes, numeric_results
from sprag_study.worker import models
from sprag_study.worker.codes import PENDING
from sprag_study.worker.planning.refine import describe_maps
from sprag_study.worker.planning.refine_plan import RefinePlan
from sprag_study.worker.planning.rounds import Rows

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.worker.models import ResultInfo
    from sprag_study.worker.planning.refine import Map as Described
    from sprag_study.worker.study import Study

#: Squares along an axis, at most; more cannot be seen in a picture.
MOST_SQUARES: Final = 256
#: What stands in the place of an ending where a square is interpolated, and where it must not be.
INTERPOLATED, JUMP = "interpolated", "jump"


def map_plan(study: Study) -> RefinePlan | None:
    """The plan of a study that refines maps; None for any other."""
    return refine_plan(study, 2)


def squares(plan: RefinePlan) -> int:
    """Squares along each axis of a picture of a map."""
    return min(plan.finest, MOST_SQUARES)


def check_refined_map(
    study: Study, plan: RefinePlan, names: tuple[str, str, str], at: Sequence[tuple[str, str]]
) -> tuple[ResultInfo, tuple[int, int], dict[str, float]]:
    """The result, the adaptive axes drawn as x and y, and what is held, for a map of ``names`` (x, y, result).

    Raises SelectionError for what the plan does not refine, whichever cases it has chosen so far.
    """
    x, y, z = names
    (result,) = numeric_results(models.study_results(study), "z", (z,))
    sides = _sides(plan, x, y)
    if z not in plan.results:
        raise refused("z", "invalid-choice", "the map was not refined for this result", z, allowed=listed(plan.results))
    return result, sides, _fixed_values(study, plan, at)


def draw_refined_map(
    study: Study,
    plan: RefinePlan,
    names: tuple[str, str, str],
    at: Sequence[tuple[str, str]],
    fetch: Fetch,
) -> Map:
    """The map of ``names`` (x, y, result); raises SelectionError as `check_refined_map` does."""
    x, y, z = names
    result, sides, held = check_refined_map(study, plan, names, at)
    own, points = _described(study, plan, held, z, fetch)
    count = squares(plan)
    ends = [plan.adaptive[side] for side in sides]
    middles = [axis.low + (axis.high - axis.low) * (np.arange(count) + 0.5) / count for axis in ends]
    places = np.meshgrid(*middles)  # shape (y, x)
    values = own.at(z, *(places if sides == (0, 1) else places[::-1]))
    empty = PENDING if not len(own.cells) else JUMP
    endings = np.where(np.isnan(values), empty, INTERPOLATED).tolist()
    columns = [points[:, len(plan.fixed) + side] for side in sides]
    error = own.errors[z]
    known = RefinedMap(
        plan.asked(z),
        error,
        None if error is None else error * own.ranges[z],
        result.unit,
        own.jumps_share[z],
        own.passed,
        columns[0],
        columns[1],
        points[:, -2],
        points[:, -1].astype(int),
    )
    return Map(
        x,
        y,
        (unit_of(study, x), unit_of(study, y)),
        (axis_name(study, x), axis_name(study, y)),
        held_texts(study, held),
        tuple(middles[0].tolist()),
        tuple(middles[1].tolist()),
        held,
        {path: unit_of(study, path) for path in held},
        result,
        np.full(values.shape, -1, dtype=np.int64),
        values,
        endings,
        refined=known,
    )


def _fixed_values(study: Study, plan: RefinePlan, at: Sequence[tuple[str, str]]) -> dict[str, float]:
    """The values of the fixed axes by their first paths; SelectionError where one is not clear."""
    located = locate_axes(study, at)
    for path, _ in located.values():
        if any(path in own.paths for own in plan.adaptive):
            raise refused("at", "repeated", "the axis is drawn", path)
    given = {study.axes[axis].paths[0]: index for axis, (_, index) in located.items()}
    held: dict[str, float] = {}
    for own in plan.fixed:
        path = own.paths[0]
        if path not in given and len(own.values) > 1:
            message = Sentence(LEFT_OPEN, path=path)
            raise refused("at", "not-fixed", message, allowed=listed(own.values), unit=unit_of(study, path))
        axis = study.axis_of(path)
        held[path] = own.values[0] if axis is None or path not in given else study.axes[axis].value(given[path])
    return held


def _sides(plan: RefinePlan, x: str, y: str) -> tuple[int, int]:
    """Which adaptive axis is x, and which is y."""
    found = []
    for parameter, path in (("x", x), ("y", y)):
        side = next((place for place, axis in enumerate(plan.adaptive) if path in axis.paths), None)
        if side is None or side in found:
            raise refused(
                parameter, "not-an-axis", "a refined map is drawn over its two adaptive axes", path,
                allowed=listed(axis.paths[0] for axis in plan.adaptive),
            )  # fmt: skip
        found.append(side)
    return found[0], found[1]


def _described(
    study: Study, plan: RefinePlan, held: dict[str, float], z: str, fetch: Fetch
) -> tuple[Described, NDArray[np.float64]]:
    """What the planner says of the map, and its points: the plan's columns, the result, the case.

    A result that does not count (`models.usable`) is NaN, as it is for the planner.
    """
    every = study.points(range(study.cases))
    cases = np.flatnonzero(np.all(every[:, : len(plan.fixed)] == list(held.values()), axis=1)).astype(np.int64)
    columns = fetch(cases, plan.needed)
    endings = [ending or PENDING for ending in columns.endings]
    run = ~not_run(endings)
    ok = models.usable(study.model, columns.endings, columns.flags)
    values = {name: columns.values[name][run] for name in plan.needed}
    points = every[cases]
    number = int(plan.places(points[:1])[0][0])
    own = describe_maps(plan, Rows(points[run], ok[run], values))[number]
    known = np.where(ok[run], values[z], np.nan)
    return own, np.column_stack([points[run], known, cases[run]])
