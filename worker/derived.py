"""What the derived parameters of a study depend on, and the values that they and drawn parameters take."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.worker.models.formulas import needed, sources
from sprag_study.worker.models.parameters import parameter_of
from sprag_study.worker.spread import DRIVE

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from numpy.typing import NDArray

    from sprag_study.worker.study import Study

#: Cases that are evaluated at once.
_AT_ONCE: Final = 1 << 16


def involved(study: Study, paths: Iterable[str]) -> Study:
    """The study with only the axes on which the values of ``paths`` depend, and only the formulas that they need.

    Each combination of their values is one case of it.
    """
    paths = tuple(paths)
    roots = sources(study.derive, study.base, paths)
    roots |= {one.path for one in map(study.components_of, roots) if one is not None}
    spread = None if study.spread is None else study.spread.of(roots)
    if spread is not None:
        roots |= {DRIVE}
    axes = tuple(axis for axis in study.axes if not roots.isdisjoint(axis.paths))
    return replace(study, axes=axes, derive=needed(study.derive, study.base, paths), spread=spread, sweep=None)


def blocks(study: Study) -> Iterator[range]:
    """All cases of a study, many at a time."""
    return (range(first, min(first + _AT_ONCE, study.cases)) for first in range(0, study.cases, _AT_ONCE))


def refused_value(study: Study, cases: range) -> str:
    """A sentence about the first derived value of these cases that its parameter does not allow; "" if none.

    Only nominal drives count: drawn ones may fail.
    """
    values = study.columns(cases) if study.derive else {}
    for path in study.derive:
        entry = parameter_of(study, path)
        for case, value, drive in zip(cases, values[path].tolist(), _drives(values, len(cases)), strict=True):
            if drive == 0.0 and entry is not None and not entry.accepts(value):
                return f"case {case} would derive {path} = {value:.6g}, allowed is {entry.range_text()}"
    return ""


def _drives(values: Mapping[str, NDArray[np.float64]], count: int) -> list[float]:
    return values[DRIVE].tolist() if DRIVE in values else [0.0] * count


def distinct_values(study: Study, path: str) -> NDArray[np.float64]:
    """The distinct values (SI) of any parameter of a study, ascending."""
    varied = study.varied(path)
    if varied is not None:
        return np.unique(varied[1])
    if path not in study.column_paths:
        return np.array([study.base[path]])
    part = involved(study, [path])
    return np.unique(np.concatenate([np.unique(part.columns(cases)[path]) for cases in blocks(part)]))
