"""A number for each case, by which equal cases of other studies are found without looking at these studies.

Equal cases (equal parameters, equal `kin_hash`) have equal keys. Unequal ones have unequal keys nearly always: whoever
finds a key compares the cases themselves (`sprag_study.worker.reuse.shared_cases`).
"""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.worker.derived import blocks

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.worker.axis import Axis
    from sprag_study.worker.study import Study

    Keys = NDArray[np.int64]
    Words = NDArray[np.uint64]

#: Multipliers and shifts of the finalizer of SplitMix64 (Steele, Lea and Flood, 2014), which spreads every bit.
_FIRST: Final = (30, 0xBF58476D1CE4E5B9)
_SECOND: Final = (27, 0x94D049BB133111EB)
_LAST: Final = 31


def case_keys(study: Study, kin: str, first: int = 0) -> Keys:
    """The keys of the cases of a study of that `kin_hash` from number ``first`` on: int64 array, shape (cases,).

    A key is the sum (modulo 2^64) of a hash of each parameter and its value (SI), so it is the same on whatever axis a
    parameter is, or on none.
    """
    drawn = () if study.spread is None else study.spread.paths
    single = [path for path in study.base if path not in study.column_paths]
    start = sum(int(_mixed(np.array([study.base[path]]), kin, path)[0]) for path in single) % 2**64
    follows = [path for path in study.component_paths if path not in {*study.apart, *drawn}]
    along = [_along(axis, kin, {*drawn, *study.apart}) for axis in study.axes]
    keys = np.empty(study.cases, dtype=np.uint64)
    for block in blocks(study):
        total = np.full(len(block), start, dtype=np.uint64)
        for words, index in zip(along, study.indices(block), strict=True):
            total += words[index]
        if drawn or study.derive or follows:
            columns = study.columns(block)
            for path in (*follows, *drawn, *study.derive):
                total += _mixed(columns[path], kin, path)
        keys[block.start : block.stop] = total
    return keys[first:].view(np.int64)


def _along(axis: Axis, kin: str, apart: set[str]) -> Words:
    """What the parameters of an axis, except those ``apart``, add to the key at each of its values."""
    words = np.zeros(len(axis), dtype=np.uint64)
    for path in axis.paths:
        if path not in apart:
            words += _mixed(axis.array, kin, path)
    return words


def _mixed(values: NDArray[np.float64], kin: str, path: str) -> Words:
    """A hash of each value of a parameter; 0 and -0 are equal values."""
    seed = int.from_bytes(hashlib.sha256(f"{kin}\n{path}".encode()).digest()[:8], "little")
    words = np.ascontiguousarray(values + 0.0).view(np.uint64) + np.uint64(seed)
    for shift, factor in (_FIRST, _SECOND):
        words = (words ^ (words >> np.uint64(shift))) * np.uint64(factor)
    return words ^ (words >> np.uint64(_LAST))
