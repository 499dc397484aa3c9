"""Which cases of two studies are the same: equal parameters, equal run, one engine. No store here.

A case needs no hash of its own: its parameters follow from the study and its number. Studies whose cases could be the
same have the same `kin_hash`; which cases are, `shared_cases` finds from the values of both studies' axes.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from worker import kernels
from worker.study import Axis

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from worker.study import Study

    Cases = NDArray[np.int64]

#: Codes of cases stay below this, so that one more factor does not overflow.
_LARGEST_CODE: Final = 2**62


def kin_hash(study: Study, engine_version: str) -> str:
    """SHA-256 (hexadecimal) of what studies with a case in common share: model, engine, run and set of parameters.

    And the structure of the machine, where its model knows one.
    """
    paths = sorted({*study.base, *study.axis_paths})
    shared: dict[str, Any] = {"engine": engine_version, "model": study.model, "run": study.run, "paths": paths}
    if study.structure is not None:
        shared["structure"] = study.structure
    text = json.dumps(
        shared,
        sort_keys=True,
        separators=(",", ":"),
        allow_nan=False,
    )
    return hashlib.sha256(text.encode("ascii")).hexdigest()


def shared_cases(new: Study, old: Study) -> tuple[Cases, Cases]:
    """Numbers of the cases of ``new`` that ``old`` has too, ascending, and what their numbers are there.

    The two must be of one `kin_hash`. Values are the same when they are the same doubles.
    """
    nothing = np.empty(0, dtype=np.int64)
    pairs = _axis_pairs(new, old)
    common = [np.intersect1d(_values(new, path), _values(old, path)) for path in pairs]
    if not all(values.size for values in common):
        return nothing, nothing
    ours, ours_code = _all_cases(new)
    theirs, theirs_code = _all_cases(old)
    for path, values in zip(pairs, common, strict=True):
        ours, ours_code = _narrowed(new, path, values, ours, ours_code)
        theirs, theirs_code = _narrowed(old, path, values, theirs, theirs_code)
        if max(ours_code.max(initial=0), theirs_code.max(initial=0)) > _LARGEST_CODE // 10**7:
            both = np.unique(np.concatenate([ours_code, theirs_code]), return_inverse=True)[1].reshape(-1)
            ours_code, theirs_code = both[: ours.size], both[ours.size :]
    _, at_ours, at_theirs = np.intersect1d(ours_code, theirs_code, return_indices=True)
    order = np.argsort(at_ours)
    return ours[at_ours[order]], theirs[at_theirs[order]]


def _all_cases(study: Study) -> tuple[Cases, Cases]:
    return np.arange(study.cases, dtype=np.int64), np.zeros(study.cases, dtype=np.int64)


def _axis_pairs(new: Study, old: Study) -> list[str]:
    """A path for each pair of an axis (or the base) of one study and that of the other; tied paths need one look."""
    found: dict[tuple[int | None, int | None, object], str] = {}
    for path in dict.fromkeys((*new.base, *new.axis_paths)):
        axes = (new.axis_of(path), old.axis_of(path))
        # What varies in neither is looked at one by one, as is what varies in one only and is another number here.
        constant = (axes[0] is None and new.base[path], axes[1] is None and old.base[path])
        found.setdefault((*axes, constant if None in axes else None), path)
    return list(found.values())


def _values(study: Study, path: str) -> NDArray[np.float64]:
    axis = study.axis_of(path)
    return np.array([study.base[path]]) if axis is None else study.axes[axis].array


def _narrowed(study: Study, path: str, common: NDArray[np.float64], cases: Cases, code: Cases) -> tuple[Cases, Cases]:
    """The cases whose value of ``path`` is in ``common`` (ascending), their codes carried on by its place there."""
    position = study.axis_of(path)
    if position is None:
        return cases, code * common.size  # the one value is the one in common
    values = study.axes[position].array
    place = np.searchsorted(common, values)
    place[place == common.size] = 0
    place = np.where(common[place] == values, place, -1)
    at = place[_positions(study, position, cases)]
    kept = at >= 0
    return cases[kept], code[kept] * common.size + at[kept]


def _positions(study: Study, axis: int, cases: Cases) -> Cases:
    """Position on one axis of the given cases, without those on the others."""
    if study.combine == "zip":
        return cases
    inner = int(np.prod(study.shape[axis + 1 :], dtype=np.int64))
    return cases // inner % len(study.axes[axis])


def taken(study: Study, cases: Cases) -> Study:
    """A study of just these cases of ``study``, in this order, numbered from 0."""
    axes = tuple(
        Axis(axis.paths, tuple(axis.array[_positions(study, index, cases)].tolist()))
        for index, axis in enumerate(study.axes)
    )
    return replace(study, axes=axes, combine="zip")


def no_cases(study: Study) -> kernels.ChunkResult:
    """The result of running no case of ``study``."""
    return kernels.ChunkResult(0, [], [], np.empty((0, len(kernels.study_results(study)))))
