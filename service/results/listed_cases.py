"""Curves through listed cases (points, samples, zips, unions): a curve is of one machine.

Where the cases of a study are listed one by one, every column that varies is an axis: cases that differ in another
column than the one that is drawn along are of different machines, and stand on different curves.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.worker.models import NO_PARAMETERS

if TYPE_CHECKING:
    from sprag_study.worker.arrays import Ints
    from sprag_study.worker.study import Study

#: Curves that can be distinguished by colour. Of more machines, some are chosen, or asked for.
MOST_CURVES: Final = 8


def open_axes(study: Study, cases: Ints, named: Collection[int]) -> list[int]:
    """Positions of the axes without a role (``named``) in which the cases differ, drives and directions excepted."""
    found = []
    for position, axis in enumerate(study.axes):
        if position not in named and NO_PARAMETERS.isdisjoint(axis.paths):
            places = axis.levels[1][cases]
            if places.size and (places != places[0]).any():
                found.append(position)
    return found


def cases_with(study: Study, values: Mapping[int, Sequence[float]]) -> Ints:
    """The cases that have one of these values (SI, of the axis) on each of these axes, ascending."""
    chosen = np.ones(study.cases, dtype=np.bool_)
    for position, wanted in values.items():
        axis = study.axes[position]
        places = [place for place in map(axis.place_of, wanted) if place is not None]
        chosen &= np.isin(axis.levels[1], places)
    return np.flatnonzero(chosen).astype(np.int64)


def machines(study: Study, axes: Iterable[int], cases: Ints) -> Ints:
    """Numbers from 0 that are equal where cases are equal on all of ``axes``, ascending with their values."""
    member = np.zeros(cases.size, dtype=np.int64)
    count = 1
    for position in axes:
        if count == cases.size:
            break
        values, places = study.axes[position].levels
        _, member = np.unique(member * values.size + places[cases], return_inverse=True)
        member = member.reshape(-1)
        count = int(member.max(initial=-1)) + 1
    return member.astype(np.int64)


def left_open(study: Study, x: int, by: Collection[int], cases: Ints) -> tuple[list[int], bool]:
    """The axes without a role in which the cases differ, and whether a curve for each combination is few of them.

    ``x`` is the axis along the curves, and ``by`` those that distinguish curves already. Few are at most `MOST_CURVES`,
    and where there are more curves already, no more than these.
    """
    left = open_axes(study, cases, {x, *by})
    before, after = (int(machines(study, axes, cases).max(initial=0)) + 1 for axes in (by, [*by, *left]))
    return left, after <= max(before, MOST_CURVES)


def longest(study: Study, x: int, cases: Ints) -> tuple[int, int]:
    """Of curves along axis ``x``: the largest number of cases on one, and the number of curves."""
    member = machines(study, open_axes(study, cases, {x}), cases)
    counts = np.bincount(member) if member.size else np.zeros(1, dtype=np.int64)
    return int(counts.max()), int(counts.size)


def usual_machine(study: Study, axes: Sequence[int], cases: Ints) -> dict[int, float]:
    """Values (SI) of several axes that occur together: the base's where they do, otherwise those of most cases."""
    if not axes:
        return {}
    base = {position: study.base.get(study.axes[position].paths[0]) for position in axes}
    if all(value is not None and study.axes[i].index_of(value) is not None for i, value in base.items()):
        known = {position: value for position, value in base.items() if value is not None}
        if np.isin(cases_with(study, {i: [value] for i, value in known.items()}), cases).any():
            return known
    member = machines(study, axes, cases)
    counts = np.bincount(member)
    most = np.flatnonzero(counts == counts.max())
    case = cases[np.argmax(member == most[most.size // 2])]
    return {position: study.axes[position].value(int(case)) for position in axes}
