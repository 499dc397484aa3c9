"""The curve shown first for a study: as its model suggests, or the nearest that is available."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import Name, Part
from sprag_study.service.faults import refused
from sprag_study.service.languages import N_
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.reader import Phrase, joined, plural
from sprag_study.service.results.curves import CurveQuery, Pairs
from sprag_study.service.results.listed_cases import (
    MOST_CURVES,
    cases_with,
    left_open,
    longest,
    open_axes,
    usual_machine,
)
from sprag_study.service.results.refined import curve_plan, families
from sprag_study.service.results.refined_maps import map_plan, squares
from sprag_study.service.results.selection import axis_name, held_text, listed, locate_axes, value_of
from sprag_study.worker import models
from sprag_study.worker.directions import SWEEP
from sprag_study.worker.models import NO_PARAMETERS
from sprag_study.worker.spread import DRIVE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.worker.study import Axis, Study

#: Of an axis with more values than `MOST_CURVES`, so many of these are drawn first.
_CHOSEN_CURVES: Final = 6
#: Values of an axis that a page lists; of more, one is typed.
MOST_CHOICES: Final = 200
#: Number of results shown first for a model that names no main ones.
_MOST_MAIN: Final = 10


def main_query(study: Study) -> CurveQuery | None:
    """What to draw for ``study``; None where its cases lie on no curves (`no_curves` says why).

    Axes that are not drawn are held at the base's value where they contain it, otherwise at their middle value, and the
    drives at the nominal one. There is a curve for each value of one axis; where all axes have many values, for some.
    Sweeps are drawn along their axis, in both directions. Refined curves are drawn with every result whose error was
    asked for, all of them.
    """
    plan = curve_plan(study)
    if plan is not None:
        return CurveQuery(plan.adaptive[0].paths[0], plan.results, tuple(families(plan)))
    varying = varying_axes(study)
    if not varying:
        return None
    shown = models.presentation_of(study)
    y = _drawn(study)
    along = [path for path in shown.along for axis in varying if path in axis.paths]
    if study.combine == "zip":
        return _listed_query(study, dict.fromkeys([*along, *(axis.paths[0] for axis in varying)]), y)
    x = study.sweep or (*along, varying[0].paths[0])[0]
    others = [axis for axis in varying if x not in axis.paths]
    few = [axis for axis in others if len(axis) <= MOST_CURVES]
    by = _told_apart(study, few or others)
    held = [axis for axis in others if by not in axis.paths]
    at = tuple((axis.paths[0], repr(usual_value(study, axis))) for axis in held)
    both = (SWEEP,) if study.sweep is not None and len(study.axes[-1]) > 1 else ()
    of = () if by is None else many_values(study, by)
    return CurveQuery(x, y if by is None and not both else y[:1], (*(() if by is None else (by,)), *both), at, of=of)


def _told_apart(study: Study, axes: Sequence[Axis]) -> str | None:
    """Path of the axis whose values are drawn as curves beside each other; None without axes."""
    named = (path for path in models.presentation_of(study).apart for axis in axes if path in axis.paths)
    return next(named, axes[0].paths[0] if axes else None)


def _listed_query(study: Study, paths: Iterable[str], y: tuple[str, ...]) -> CurveQuery | None:
    """Curves along the first of ``paths`` on which several of the listed cases are of one machine."""
    cases = cases_with(study, _nominal(study))
    positions = {path: position for path in paths if (position := study.axis_of(path)) is not None}
    x = next((path for path, position in positions.items() if longest(study, position, cases)[0] > 1), None)
    if x is None:  # each case is a machine of its own
        x = next(iter(positions))
        if longest(study, positions[x], cases)[1] > MOST_CURVES:
            return None
    by, at = _listed_rest(study, positions[x], cases)
    of = tuple(pair for path in by for pair in many_values(study, path, at=at)) if len(by) == 1 else ()
    return CurveQuery(x, y[:1] if by else y, by, at, of=of)


def _nominal(study: Study) -> dict[int, list[float]]:
    """The values of the axis of drives that curves show: the nominal one."""
    drives = study.axis_of(DRIVE)
    return {} if drives is None else {drives: [float(study.axes[drives].array.min())]}


def _listed_rest(study: Study, x: int, cases: NDArray[np.int64]) -> tuple[tuple[str, ...], Pairs]:
    """What distinguishes the curves of listed cases along axis ``x``, and what is held.

    All other axes distinguish the curves where these are few; otherwise one does, and the others are held.
    """
    left, few = left_open(study, x, (), cases)
    by = _told_apart(study, [study.axes[position] for position in left])
    if few or by is None:
        return tuple(study.axes[position].paths[0] for position in left), ()
    held = usual_machine(study, [position for position in left if by not in study.axes[position].paths], cases)
    together = np.intersect1d(cases, cases_with(study, {position: [value] for position, value in held.items()}))
    if not open_axes(study, together, {x}):
        return (), _pairs(study, usual_machine(study, left, together))
    return (by,), _pairs(study, held)


def listed_held(study: Study, x: int, by: Collection[int], fixed: Mapping[int, Sequence[float]]) -> Pairs:
    """Values of the axes of listed cases that are neither drawn nor ``fixed`` (SI), held where these are many."""
    cases = cases_with(study, {**_nominal(study), **fixed})
    left, few = left_open(study, x, by, cases)
    return () if few else _pairs(study, usual_machine(study, left, cases))


def _pairs(study: Study, held: Mapping[int, float]) -> Pairs:
    return tuple((study.axes[position].paths[0], repr(value)) for position, value in held.items())


def no_curves(study: Study) -> str:
    """Why there is nothing to draw along an axis: a sentence, not yet translated."""
    if not varying_axes(study):
        return N_("Nothing varies in this study, so there is no curve.")
    return N_("No two cases of this study differ in one parameter only, so there is no curve.")


def many_values(study: Study, path: str, most: int = _CHOSEN_CURVES, at: Pairs = ()) -> Pairs:
    """At most ``most`` values of an axis with many of them, for a family of curves: pairs as those of `CurveQuery.of`.

    Its first, its last, that at which it is held otherwise, and others evenly between; () for an axis with few values,
    which are all drawn. Of listed cases, the values of those that are ``at`` the held ones count.
    """
    axis = study.axis_with(path)
    values = axis.levels[0]
    if study.combine == "zip" and at:
        fixed = {axis: [study.axes[axis].value(index)] for axis, (_, index) in locate_axes(study, at).items()}
        values = np.unique(values[axis.levels[1][cases_with(study, {**_nominal(study), **fixed})]])
    if values.size <= MOST_CURVES:
        return ()
    if values.size <= most:
        return tuple((path, repr(value)) for value in values.tolist())
    places = np.linspace(0, values.size - 1, most).round().astype(int)
    usual = int(np.searchsorted(values, usual_value(study, axis)))
    places[np.argmin(np.abs(places[1:-1] - usual)) + 1] = usual
    return tuple((path, repr(value)) for value in values[np.unique(places)].tolist())


def completed(
    study: Study,
    x: str | None,
    y: tuple[str, ...],
    by: tuple[str, ...],
    at: Pairs,
    of: Pairs = (),
) -> CurveQuery:
    """The curves of these choices; without ``x`` or ``y`` as they are drawn first.

    Raises SelectionError where nothing varies that could be drawn.
    """
    if x and y:
        return CurveQuery(x, y, by, at, of=of)
    if x:
        return CurveQuery(x, drawn_results(study), by, at, of=of)
    main = main_query(study)
    if main is None:
        raise refused(
            "x", "not-an-axis",
            "no two cases of this study differ in one parameter only, so there is no curve"
            if varying_axes(study)
            else "nothing varies in this study, so there is no curve",
            allowed=listed(axis.paths[0] for axis in varying_axes(study)) or None,
        )  # fmt: skip
    taken = {study.axis_of(path) for path in (*by, *(path for path, _ in (*at, *of)))}
    families = by or tuple(path for path in main.by if study.axis_of(path) not in taken)
    return CurveQuery(
        main.x,
        y or main.y,
        families,
        (*at, *(pair for pair in main.at if study.axis_of(pair[0]) not in taken)),
        of=of or tuple(pair for pair in main.of if not by and pair[0] in families),
    )


def drawn_results(study: Study) -> tuple[str, ...]:
    """The results that are drawn unless others are asked for, also of a study in which nothing varies."""
    main = main_query(study)
    return _drawn(study) if main is None else main.y


def _drawn(study: Study) -> tuple[str, ...]:
    """The results that the model draws, of those that the study has; its first one where there is none."""
    known = models.results_by_name(study)
    return tuple(filter(known.__contains__, models.presentation_of(study).drawn)) or tuple(known)[:1]


def main_results(study: Study) -> tuple[str, ...]:
    """The main results according to the model, the first ones where it names none, and all quantities of the study."""
    known = [info.name for info in models.model_results(study)]
    main = tuple(filter(known.__contains__, models.presentation_of(study).main)) or tuple(known)[:_MOST_MAIN]
    return (*main, *(one.name for one in study.quantities))


def varying_axes(study: Study) -> list[Axis]:
    """The axes with more than one value; those of drives and of directions of a sweep are not among them."""
    return [axis for axis in study.axes if len(axis) > 1 and NO_PARAMETERS.isdisjoint(axis.paths)]


def usual_value(study: Study, axis: Axis) -> float:
    """The value of an axis that is meant where none is named: that nearest to the base's, of two the larger one.

    It is the middle one where the base has none, or one beyond the ends of the axis.
    Of the drives it is the nominal one, of the directions of a sweep up, where there are both.
    """
    base = 0.0 if not NO_PARAMETERS.isdisjoint(axis.paths) else study.base.get(axis.paths[0])
    values = np.sort(axis.array)
    if base is None or not values[0] <= base <= values[-1]:
        index = None if base is None else axis.index_of(base)
        return float(values[len(axis) // 2]) if index is None else axis.value(index)
    scale = max(abs(float(values[0])), abs(float(values[-1]))) or 1.0
    return float(min(values.tolist(), key=lambda value: (round(abs(value - base) / scale, 9), -value)))


def drawn_numbers(study: Study, query: CurveQuery) -> int:
    """How many numbers the curves of ``query`` have, at most."""
    mapped = map_plan(study)
    if study.combine == "zip":
        return study.cases * len(query.y) + (0 if mapped is None else squares(mapped) ** 2)
    of = Counter(path for path, _ in query.of)
    # A path that does not vary is refused where the curves are drawn.
    axes = [(path, axis) for path in (query.x, *query.by) for axis in study.axes if path in axis.paths]
    return math.prod(of[path] or len(axis) for path, axis in axes) * len(query.y)


def caption(study: Study, query: CurveQuery) -> Phrase:
    """A caption of the curves of ``query``: a sentence without its full stop."""
    some = Counter(path for path, _ in query.of)
    by = joined(", ", (_family(study, path, some[path]) for path in query.by))
    held = [held_text(study, path, value_of(path, value, unit_of(study, path))) for path, value in query.at]
    names = joined(", ", (Name(name, within=place > 0) for place, name in enumerate(query.y)))
    x = _within(study, query.x)
    first = (
        Phrase("{names} against {x}, a curve for each {by}", names=names, x=x, by=by)
        if by
        else Phrase("{names} against {x}", names=names, x=x)
    )
    return joined("; ", [first, *held])


def _family(study: Study, path: str, count: int) -> Part:
    """What tells curves apart: a parameter, or so many values of it."""
    name = _within(study, path)
    return plural("of {count} value of {name}", "of {count} values of {name}", count, name=name) if count else name


def _within(study: Study, path: str) -> Name:
    return Name(axis_name(study, path), within=True)
