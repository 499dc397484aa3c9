"""The cases of each point of curves and maps, and their results, exactly as stored.

`select` determines the drawn cases from the study alone and refuses ambiguous requests; `draw` and `draw_map` then
fetch the results of these cases only. The HTTP interface and the command line both use them.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import Sentence
from sprag_study.service.faults import ParameterFault, SelectionError, refused
from sprag_study.service.languages import N_
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.results.curves import Curve, CurveQuery, Curves, Fetch, Map, Pairs, Selection, not_run
from sprag_study.service.results.listed_cases import cases_with, left_open, machines
from sprag_study.service.results.refined import Line, families, plan_along, refined_curves
from sprag_study.service.results.refined_maps import draw_refined_map, map_plan
from sprag_study.service.results.regimes import kind_columns, kinds_of
from sprag_study.service.results.selection import (
    LEFT_OPEN,
    Fixed,
    axis_name,
    held_texts,
    listed,
    locate_axes,
    locate_values,
    numeric_results,
    require_axis,
    with_nominal,
)
from sprag_study.service.results.sweeps import jumps_of_line, swept_along
from sprag_study.worker import models
from sprag_study.worker.codes import PENDING
from sprag_study.worker.directions import SWEEP
from sprag_study.worker.limits import MAX_CURVE_VALUES

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.service.storage.store import Store
    from sprag_study.worker.models import ResultInfo
    from sprag_study.worker.planning.refine import Curve as Refined
    from sprag_study.worker.study import Study

#: No chosen values of axes: curves for all of them.
NOTHING: Final[Mapping[int, Sequence[int]]] = MappingProxyType({})


def select(study: Study, query: CurveQuery) -> Selection:
    """Select the cases of the curves of ``query``.

    Of refined curves, a fixed axis without a role is one of ``by``, and so is the direction of a sweep. Curves are
    those of the nominal drive, unless the query gives the drives another role.

    Raises
    ------
    SelectionError
        For an unknown path or result, a value that is not on its axis, an open axis, or too many numbers. Axes of
        listed cases that are left open distinguish curves, too, where these are few.
    """
    infos = models.study_results(study)
    results = numeric_results(infos, "y", query.y)
    x_axis = require_axis(study, "x", query.x)
    fixed = locate_axes(study, query.at)
    plan = plan_along(study, query.x)
    by_axes = {path: require_axis(study, "by", path) for path in dict.fromkeys(query.by)}
    only = locate_values(study, query.of)
    # What some values are chosen of distinguishes curves.
    by_axes |= {study.axes[axis].paths[0]: axis for axis in only if axis not in by_axes.values()}
    # Every combination of the fixed axes is a curve of its own.
    for path in () if plan is None else families(plan):
        axis = require_axis(study, "by", path)
        if axis not in {x_axis, *by_axes.values(), *fixed}:
            by_axes[path] = axis
    if study.sweep is not None and SWEEP not in {query.x, *by_axes} and (last := len(study.axes) - 1) not in fixed:
        by_axes |= {SWEEP: last} if len(study.axes[last]) > 1 else {}
    _no_axis_twice({query.x: x_axis}, "by", by_axes, fixed)
    fixed = with_nominal(study, fixed, {x_axis, *by_axes.values()})
    chooser = _listed_lines if study.combine == "zip" else _grid_lines
    x_values, lines = chooser(study, x_axis, by_axes, fixed, len(results), only=only)
    made = tuple(lines)
    units = {path: unit_of(study, path) for path in (query.x, *made[0].by, *made[0].at)}
    names = {path: axis_name(study, path) for path in (query.x, *made[0].by)}
    held, regime = held_texts(study, made[0].at), models.regime_info(infos)
    return Selection(
        study.model, query.x, units, names, held, x_values, results, made, regime, plan, swept_along(study, query.x)
    )


def draw(selection: Selection, fetch: Fetch) -> Curves:
    """Fetch the results of the selected cases in one query."""
    names = [info.name for info in selection.results]
    needed = list(
        dict.fromkeys([*_with_kinds(names, selection.regime), *(selection.plan.needed if selection.plan else ())])
    )
    columns = fetch(np.concatenate([line.cases for line in selection.lines]), needed)
    endings = [ending or PENDING for ending in columns.endings]
    regimes, orders = kinds_of(columns.values, selection.regime)
    usable = models.usable_each(selection.model, columns.endings, columns.flags, names)
    refined: list[Refined] | None = None
    if selection.plan is not None:
        refined = refined_curves(selection.model, selection.plan, selection.lines, ~not_run(endings), columns)
    curves, start = [], 0
    for place, line in enumerate(selection.lines):
        part = slice(start, start + line.cases.size)
        y = {name: columns.values[name][part] for name in names}
        own = None if refined is None else refined[place]
        jumps = None
        if selection.swept and regimes and orders:
            jumps = jumps_of_line(line, columns.flags[part], regimes[part], orders[part])
        kinds = regimes and regimes[part], orders and orders[part]
        counts = {name: mask[part] for name, mask in usable.items()}
        curves.append(Curve(line, y, endings[part], *kinds, own, jumps, columns.flags[part] or None, counts))
        start = part.stop
    return Curves(selection, tuple(curves))


def _with_kinds(names: list[str], regime: ResultInfo | None) -> list[str]:
    """The results to fetch: ``names``, and those for the kind of motion."""
    return list(dict.fromkeys([*names, *kind_columns(regime)]))


def check_map(
    study: Study, x: str, y: str, z: str, at: Pairs
) -> tuple[ResultInfo, tuple[tuple[float, ...], Iterator[Line]]]:
    """The result and the rows of the map of a grid; SelectionError as of `select`."""
    (result,) = numeric_results(models.study_results(study), "z", (z,))
    if study.combine == "zip":
        raise refused("x", "not-a-grid", "a map needs a grid; the axes of this study are zipped")
    x_axis, y_axis = require_axis(study, "x", x), require_axis(study, "y", y)
    fixed = locate_axes(study, at)
    _no_axis_twice({x: x_axis}, "y", {y: y_axis}, fixed)
    fixed = with_nominal(study, fixed, {x_axis, y_axis})
    return result, _grid_lines(study, x_axis, {y: y_axis}, fixed, 1, way_out=LEFT_OPEN)


def draw_map(study: Study, x: str, y: str, z: str, at: Pairs, fetch: Fetch) -> Map:
    """One result over two axes of a grid, or of a refined map; raises SelectionError as `select` does."""
    plan = map_plan(study)
    if plan is not None:
        return draw_refined_map(study, plan, (x, y, z), at, fetch)
    result, (x_values, lines) = check_map(study, x, y, z, at)
    rows = list(lines)
    cases = np.stack([row.cases for row in rows])
    regime = models.regime_info(models.study_results(study))
    columns = fetch(cases.reshape(-1), _with_kinds([z], regime))
    endings = [ending or PENDING for ending in columns.endings]
    regimes, orders = kinds_of(columns.values, regime)
    width = len(x_values)
    starts = range(0, len(endings), width)
    return Map(
        x,
        y,
        (unit_of(study, x), unit_of(study, y)),
        (axis_name(study, x), axis_name(study, y)),
        held_texts(study, rows[0].at),
        x_values,
        tuple(row.by[y] for row in rows),
        rows[0].at,
        {path: unit_of(study, path) for path in rows[0].at},
        result,
        cases,
        columns.values[z].reshape(cases.shape),
        [endings[start : start + width] for start in starts],
        None if regimes is None else [regimes[start : start + width] for start in starts],
        None if orders is None else [orders[start : start + width] for start in starts],
        flags=[columns.flags[start : start + width] for start in starts] if columns.flags else None,
        usable=models.usable(study.model, columns.endings, columns.flags, z).reshape(cases.shape),
    )


def _no_axis_twice(x: dict[str, int], second: str, others: dict[str, int], fixed: Fixed) -> None:
    taken: dict[int, str] = {}
    uses = [("x", path, axis) for path, axis in x.items()] + [(second, path, axis) for path, axis in others.items()]
    uses += [("at", path, axis) for axis, (path, _) in fixed.items()]
    for parameter, path, axis in uses:
        if axis in taken:
            message = Sentence("the axis is already taken by {role}; one axis can have one role only", role=taken[axis])
            raise refused(parameter, "repeated", message, path)
        taken[axis] = f"{parameter}={path}"


def _check_size(points: int, results: int) -> None:
    if points * results > MAX_CURVE_VALUES:
        message = Sentence(
            "{points} points of {results} results are requested; select fewer with at=, or export the results",
            points=str(points), results=str(results),
        )  # fmt: skip
        raise refused("at", "too-many", message, allowed=most_numbers())


def most_numbers() -> Sentence:
    """How many numbers may be asked for at once."""
    return Sentence("<= {high} numbers", high=str(MAX_CURVE_VALUES))


def _grid_lines(
    study: Study,
    x_axis: int,
    by: dict[str, int],
    fixed: Fixed,
    results: int,
    way_out: str = N_("the axis {path} is left open: name it in by=, or give its value as at={path}=VALUE"),
    *,
    only: Mapping[int, Sequence[int]] = NOTHING,
) -> tuple[tuple[float, ...], Iterator[Line]]:
    axes = study.axes
    named = {x_axis, *by.values(), *fixed}
    faults = [
        ParameterFault(
            "at",
            "not-fixed",
            Sentence(way_out, path=axis.paths[0]),
            allowed=listed(axis.values),
            unit=unit_of(study, axis.paths[0]),
        )
        for position, axis in enumerate(axes)
        if position not in named and len(axis) > 1
    ]
    if faults:
        raise SelectionError(faults)
    orders = [only.get(i) or np.argsort(axes[i].array, kind="stable").tolist() for i in by.values()]
    _check_size(len(axes[x_axis]) * math.prod(map(len, orders)), results)

    strides = [math.prod(study.shape[i + 1 :]) for i in range(len(axes))]
    at = {path: axes[i].value(index) for i, (path, index) in fixed.items()}
    at |= {axes[i].paths[0]: axes[i].value(0) for i in range(len(axes)) if i not in named}
    origin = sum(index * strides[i] for i, (_, index) in fixed.items())
    x_order = np.argsort(axes[x_axis].array, kind="stable")
    x_values = tuple(axes[x_axis].array[x_order].tolist())

    def lines() -> Iterator[Line]:
        for indices in itertools.product(*orders):
            chosen = list(zip(by.items(), indices, strict=True))
            first = origin + sum(index * strides[i] for (_, i), index in chosen)
            values = {path: axes[i].value(index) for (path, i), index in chosen}
            yield Line(values, at, x_values, (first + x_order * strides[x_axis]).astype(np.int64))

    return x_values, lines()


def _listed_lines(
    study: Study,
    x_axis: int,
    by: dict[str, int],
    fixed: Fixed,
    results: int,
    *,
    only: Mapping[int, Sequence[int]] = NOTHING,
) -> tuple[tuple[float, ...], Iterator[Line]]:
    """Lines through listed cases: a line for each machine, its cases in order of x."""
    axes = study.axes
    wanted = {i: [axes[i].value(index)] for i, (_, index) in fixed.items()}
    wanted |= {i: [axes[i].value(index) for index in indices] for i, indices in only.items()}
    cases = cases_with(study, wanted)
    if cases.size == 0:
        raise refused(
            "at", "unknown-value", "no case has all these values together", listed(p for p, _ in fixed.values())
        )
    _check_size(cases.size, results)
    by = _with_open(study, x_axis, by, cases)
    at = {path: axes[i].value(index) for i, (path, index) in fixed.items()}
    x_all = axes[x_axis].array
    member = machines(study, by.values(), cases)
    order = np.lexsort((x_all[cases], member))
    parts = np.split(cases[order], np.cumsum(np.bincount(member))[:-1])

    def lines() -> Iterator[Line]:
        for part in parts:
            values = {path: axes[i].value(int(part[0])) for path, i in by.items()}
            yield Line(values, at, tuple(x_all[part].tolist()), part)

    return tuple(np.unique(x_all[cases]).tolist()), lines()


def _with_open(study: Study, x_axis: int, by: dict[str, int], cases: NDArray[np.int64]) -> dict[str, int]:
    """The axes that distinguish curves, with those that were left open where they add few curves or none."""
    left, few = left_open(study, x_axis, by.values(), cases)
    if not few:
        faults = []
        for axis in (study.axes[position] for position in left):
            path, values = axis.paths[0], np.unique(axis.array[cases]).tolist()
            message = Sentence(
                "of which {path} should the curve be? It has {count} values in these cases, and a curve is of one "
                "machine: give its value as at={path}=VALUE, or name it in by=",
                path=path, count=len(values),
            )  # fmt: skip
            faults.append(ParameterFault("at", "not-fixed", message, None, listed(values), unit_of(study, path)))
        raise SelectionError(faults)
    return by | {study.axes[position].paths[0]: position for position in left}


#: Further motions of each case that a picture marks.
_MOST_FURTHER: Final = 4


def stored_curves(store: Store, study_id: str, query: CurveQuery) -> Curves:
    """The curves of a study; raises StudyNotFoundError, and SelectionError as `select` does."""
    study = store.studies.study(study_id)
    selection = select(study, query)
    return draw(selection, partial(store.rows.for_cases, study_id, number=query.number))


def drawn_curves(store: Store, study_id: str, query: CurveQuery) -> Curves:
    """The same for a picture: with the other motions of cases that have several, where the most frequent are drawn."""
    curves, study = stored_curves(store, study_id, query), store.studies.study(study_id)
    further: list[Curve] = []
    if query.number == 0 and models.numbered_by(study.model, models.variant_of(study)) is not None:
        for number in range(1, _MOST_FURTHER + 1):
            found = stored_curves(store, study_id, replace(query, number=number)).curves
            known = [curve for curve in found if any(np.isfinite(y).any() for y in curve.y.values())]
            if not known:
                break
            further += known
    return replace(curves, further=tuple(further))


def stored_map(store: Store, study_id: str, query: CurveQuery) -> Map:
    """The map of the one result of ``query`` over its x and its one axis of by; raises as `stored_curves` does."""
    study = store.studies.study(study_id)
    fetch = partial(store.rows.for_cases, study_id, number=query.number)
    return draw_map(study, query.x, query.by[0], query.y[0], query.at, fetch)
