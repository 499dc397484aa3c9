"""Which cases of two studies are the same: equal parameters, equal run, same engine. Independent of the store.

A case needs no hash of its own, because its parameters follow from the study and its number. Studies that can share
cases have the same `kin_hash`; `shared_cases` finds the shared ones from the values of both studies' axes and of their
drawn and derived parameters: it is the values that count, not the formulas, and not the numbers of the drives.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag_study.worker import models
from sprag_study.worker.derived import distinct_values
from sprag_study.worker.study import Axis
from sprag_study.worker.sweeps import whole_lines

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from sprag_study.worker.study import Study

    Cases = NDArray[np.int64]
    Values = NDArray[np.float64]

#: Upper limit of the codes of cases, so that one more factor does not overflow.
_LARGEST_CODE: Final = 2**62


def kin_hash(study: Study, engine_version: str) -> str:
    """SHA-256 (hexadecimal) of what studies with a common case share: model, engine, run and set of parameters.

    It includes the structure of the machine, where the model has one, and the axis of a sweep with its values.
    """
    paths = _paths(study)
    shared: dict[str, Any] = {"engine": engine_version, "model": study.model, "run": study.run, "paths": paths}
    if study.structure is not None:
        shared["structure"] = study.structure
    if study.sweep is not None:
        # A case depends on all those before it in its line.
        axis = study.axis_of(study.sweep)
        assert axis is not None
        shared["sweep"] = [sorted(study.axes[axis].paths), np.sort(study.axes[axis].array).tolist()]
    text = json.dumps(
        shared,
        sort_keys=True,
        separators=(",", ":"),
        allow_nan=False,
    )
    return hashlib.sha256(text.encode("ascii")).hexdigest()


class Wanted:
    """The cases of a study, prepared for the search in many others."""

    def __init__(self, study: Study) -> None:
        self.study = study
        self._sorted: dict[str, tuple[Cases, Values]] = {}
        self._unique: dict[int | str, Values] = {}

    def values(self, path: str) -> Values:
        """The distinct values (SI) of a parameter, ascending."""
        if path not in self.study.column_paths:
            return np.array([self.study.base[path]])
        axis = None if path in _drawn(self.study) else self.study.axis_of(path)
        key = path if axis is None else axis
        if key not in self._unique:
            self._unique[key] = distinct_values(self.study, path)
        return self._unique[key]

    def may_share(self, spans: Values) -> NDArray[np.bool_]:
        """Which of many studies may share a case with this one, judged by their `span`.

        Parameters
        ----------
        spans : float64 array, shape (studies, 2, paths)

        Returns
        -------
        bool array, shape (studies,); False means that the study has none of the cases
        """
        left = np.arange(len(spans))
        for column, path in enumerate(_paths(self.study)):
            values = self.values(path)
            low, high = spans[left, 0, column], spans[left, 1, column]
            at = np.searchsorted(values, low)
            inside = at < values.size
            inside[inside] = values[at[inside]] <= high[inside]
            left = left[inside]
        found = np.zeros(len(spans), dtype=np.bool_)
        found[left] = True
        return found

    def cases_with(self, wanted: Sequence[tuple[str, Values]]) -> Cases:
        """The cases, ascending, whose value of each given path is among those given with it (ascending).

        The value of each path depends on one axis (`Study.varied`).
        """
        study = self.study
        if study.combine == "zip":
            return self._rows_with(wanted) if wanted else np.arange(study.cases, dtype=np.int64)
        cases = np.zeros(1, dtype=np.int64)
        kept_on = [np.ones(len(axis), dtype=np.bool_) for axis in study.axes]
        for path, values in wanted:
            position, array = _varied(study, path)
            kept_on[position] &= _places(values, array) >= 0
        for axis, kept in zip(study.axes, kept_on, strict=True):
            cases = (cases[:, None] * len(axis) + np.flatnonzero(kept)).reshape(-1)
        return cases

    def _rows_with(self, wanted: Sequence[tuple[str, Values]]) -> Cases:
        """The same for zipped axes: only the rows selected by the most restrictive axis are examined."""
        found: list[tuple[int, Cases, Cases, Cases]] = []
        for path, values in wanted:
            if path not in self._sorted:
                array = _varied(self.study, path)[1]
                order = np.argsort(array, kind="stable")
                self._sorted[path] = order, array[order]
            order, ascending = self._sorted[path]
            first, last = (np.searchsorted(ascending, values, side) for side in ("left", "right"))
            found.append((int((last - first).sum()), order, first, last))
        size, order, first, last = min(found, key=lambda item: item[0])
        starts = np.repeat(first - np.concatenate([[0], np.cumsum(last - first)[:-1]]), last - first)
        rows = np.sort(order[starts + np.arange(size)])
        for path, values in wanted:
            rows = rows[_places(values, _varied(self.study, path)[1][rows]) >= 0]
        return rows


def shared_cases(new: Study | Wanted, old: Study) -> tuple[Cases, Cases]:
    """Numbers of the cases of ``new`` that ``old`` also has, ascending, and their numbers there.

    Both must have the same `kin_hash`. Values are equal when they are equal doubles; cases of sweeps are the same where
    their directions are, too.
    """
    ours, theirs = new if isinstance(new, Wanted) else Wanted(new), Wanted(old)
    nothing = np.empty(0, dtype=np.int64)
    common: list[tuple[str, Values]] = []
    for path in _axis_pairs(ours.study, old):
        if ours.study.varied(path) is None and old.varied(path) is None:
            if ours.study.base[path] != old.base[path]:
                return nothing, nothing
            continue
        values = _common(ours.values(path), theirs.values(path))
        if not values.size:
            return nothing, nothing
        common.append((path, values))
    our_cases, their_cases = (_cases_with(side, common) for side in (ours, theirs))
    our_codes, their_codes = np.zeros_like(our_cases), np.zeros_like(their_cases)
    for path, values in common:
        our_codes = _coded(ours.study, path, values, our_cases, our_codes)
        their_codes = _coded(old, path, values, their_cases, their_codes)
        our_codes, their_codes = _shortened(our_codes, their_codes)
    for path in _derived(ours.study, old):
        our_values, their_values = _column(ours.study, path, our_cases), _column(old, path, their_cases)
        our_places, their_places = _numbered(our_values, their_values)
        count = 1 + max(our_places.max(initial=0), their_places.max(initial=0))
        our_codes, their_codes = _shortened(our_codes * count + our_places, their_codes * count + their_places)
    _, at_ours, at_theirs = np.intersect1d(our_codes, their_codes, return_indices=True)
    order = np.argsort(at_ours)
    return our_cases[at_ours[order]], their_cases[at_theirs[order]]


def span(study: Study) -> Values:
    """Least and largest value (SI) of every parameter of a study.

    Returns
    -------
    float64 array, shape (2, paths)
        The paths are sorted by name, which is the same order for all studies of a `kin_hash`.
    """
    spans = {path: (value, value) for path, value in study.base.items()}
    for axis in study.axes:
        if study.apart.isdisjoint(axis.paths):
            spans.update(dict.fromkeys(axis.paths, (float(axis.array.min()), float(axis.array.max()))))
    for path in (*_of_components(study), *study.derive, *_drawn(study)):
        values = distinct_values(study, path)
        spans[path] = (float(values[0]), float(values[-1]))
    return np.array([spans[path] for path in sorted(spans)], dtype=np.float64).reshape(-1, 2).T


def _paths(study: Study) -> list[str]:
    return sorted({*study.base, *study.axis_paths} - study.apart)


def _axis_pairs(new: Study, old: Study) -> list[str]:
    """One path for each pair of an axis (or the base) of one study and of the other; tied paths are compared once.

    Without those that either study derives, or changes along two axes.
    """
    found: dict[tuple[object, ...], str] = {}
    ours, theirs = _axes_of(new), _axes_of(old)
    apart = {*new.derive, *old.derive, *_crossed(new), *_crossed(old), *new.apart, *old.apart}
    single = {*_drawn(new), *_drawn(old), *_of_components(new), *_of_components(old)}
    for path in dict.fromkeys((*new.base, *new.axis_paths)):
        if path in apart:
            continue
        if path in single:
            found[(path,)] = path
            continue
        axes = (ours.get(path), theirs.get(path))
        # Parameters constant in both studies are compared individually, as are those that vary in one study only and
        # have another value here.
        constant = (axes[0] is None and new.base[path], axes[1] is None and old.base[path])
        found.setdefault((*axes, constant if None in axes else None), path)
    return list(found.values())


def _derived(new: Study, old: Study) -> list[str]:
    """The paths whose values are compared case by case: those that change along two axes, and derived ones.

    Equal formulas have equal values where all others are equal.
    """
    derived = set() if new.derive == old.derive else {*new.derive, *old.derive}
    return sorted({*derived, *_crossed(new), *_crossed(old)})


def _drawn(study: Study) -> tuple[str, ...]:
    """The paths with tolerances."""
    return () if study.spread is None else study.spread.paths


def _of_components(study: Study) -> list[str]:
    """The parameters that follow from the component on an axis."""
    return [path for path in study.component_paths if path not in study.apart]


def _crossed(study: Study) -> list[str]:
    """The paths whose values depend on their own axis and on the drive."""
    return [path for path in _drawn(study) if study.varied(path) is None]


def _varied(study: Study, path: str) -> tuple[int, Values]:
    """Position of the axis on which a parameter depends, and its value at each place there."""
    found = study.varied(path)
    assert found is not None
    return found


def _column(study: Study, path: str, cases: Cases) -> Values:
    """The values of any parameter in the given cases."""
    return study.columns(cases)[path] if path in study.column_paths else np.full(cases.size, study.base[path])


def _numbered(ours: Values | Cases, theirs: Values | Cases) -> tuple[Cases, Cases]:
    """Numbers for the distinct values of two arrays: equal values have equal numbers."""
    both = np.unique(np.concatenate([ours, theirs]), return_inverse=True)[1].reshape(-1).astype(np.int64)
    return both[: ours.size], both[ours.size :]


def _shortened(ours: Cases, theirs: Cases) -> tuple[Cases, Cases]:
    """The codes, replaced by short ones where a further factor could overflow."""
    if max(ours.max(initial=0), theirs.max(initial=0)) > _LARGEST_CODE // (3 * 10**7):
        return _numbered(ours, theirs)
    return ours, theirs


def _axes_of(study: Study) -> dict[str, int]:
    return {path: index for index, axis in enumerate(study.axes) for path in axis.paths}


def _common(some: Values, others: Values) -> Values:
    """Common values of two ascending arrays, ascending; the shorter is searched in the longer."""
    short, long = (some, others) if some.size <= others.size else (others, some)
    return short[_places(long, short) >= 0]


def _places(ascending: Values, values: Values) -> Cases:
    """Position of each value in a non-empty ascending array; -1 where it is missing."""
    place = np.searchsorted(ascending, values)
    place[place == ascending.size] = 0
    return np.where(ascending[place] == values, place, -1)


def _cases_with(side: Wanted, common: Sequence[tuple[str, Values]]) -> Cases:
    return side.cases_with([(path, values) for path, values in common if side.study.varied(path) is not None])


def _coded(study: Study, path: str, common: Values, cases: Cases, codes: Cases) -> Cases:
    """The codes of cases, extended by the position of their value of ``path`` among the common ones."""
    varied = study.varied(path)
    if varied is None:
        return codes * common.size  # the only value is the common one
    position, array = varied
    return codes * common.size + _places(common, array[_positions(study, position, cases)])


def _positions(study: Study, axis: int, cases: Cases) -> Cases:
    """Position on one axis of the given cases, without those on the others."""
    if study.combine == "zip":
        return cases
    inner = int(np.prod(study.shape[axis + 1 :], dtype=np.int64))
    return cases // inner % len(study.axes[axis])


def taken(study: Study, cases: Cases) -> Study:
    """A study of only these cases of ``study``, in this order, numbered from 0.

    Raises ValueError for cases of a sweep that are not whole lines.
    """
    if study.sweep is not None and not whole_lines(study, cases).all():
        raise ValueError("a part of a line cannot be run by itself")
    axes = tuple(Axis(axis.paths, axis.array[_positions(study, index, cases)]) for index, axis in enumerate(study.axes))
    return replace(study, axes=axes, combine="zip")


def no_cases(study: Study) -> models.ChunkResult:
    """The result of running no case of ``study``."""
    return models.ChunkResult(0, [], [], np.empty((0, len(models.model_results(study)))))
