"""Sweeps: studies in which each case starts from the settled motion of its neighbour on one axis.

The cases with equal values on all other axes and the same direction are a *line*. A line is run in the order of the
swept values, ascending (up) or descending (down), and never split: every case needs the one before it. The direction
is an axis with the path `sprag_study.worker.directions.SWEEP`, the last one of the study.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sprag_study.worker.directions import DOWN

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.worker.study import Study

    Numbers = NDArray[np.int64]


def line_length(study: Study) -> int:
    """Cases that are run in one piece: those of a line of a swept grid, otherwise 1."""
    axis = None if study.sweep is None else study.axis_of(study.sweep)
    return 1 if axis is None else len(study.axes[axis])


def lines_of(study: Study, cases: Numbers) -> Numbers:
    """The lines among some cases of a swept study.

    Parameters
    ----------
    cases : case numbers, shape (m,)

    Returns
    -------
    int64 array, shape (lines, steps)
        Positions in ``cases``, each once: every row a line, in the order in which it is run.

    Raises
    ------
    ValueError
        When the cases are not whole lines.
    """
    assert study.sweep is not None
    if study.combine == "grid" and not whole_lines(study, cases).all():
        raise ValueError("a part of a line cannot be run by itself")
    swept = study.axis_of(study.sweep)
    columns = [axis.array[index] for axis, index in zip(study.axes, study.indices(cases), strict=True)]
    values = columns.pop(swept if swept is not None else 0)
    keys = np.stack(columns, axis=1)
    _, member = np.unique(keys, axis=0, return_inverse=True)
    member = member.reshape(-1)
    ordered = np.where(columns[-1] == DOWN, -values, values)
    counts = np.bincount(member)
    if counts.size and counts.min() < counts.max():
        raise ValueError("a part of a line cannot be run by itself")
    return np.lexsort((ordered, member)).astype(np.int64).reshape(counts.size, -1)


def line_to(study: Study, case: int) -> Numbers:
    """The cases of the line of one case of a grid, from its first to this one, in the order in which they are run."""
    order = LineOrder(study)
    last = int(order.positions(np.array([case]))[0])
    return order.cases(np.arange(last - last % order.unit, last + 1))


class LineOrder:
    """The order of the cases of a swept grid: line after line, each in its own direction.

    Lines are in the order of the case numbers of their first cases; there are no passes (`sprag_study.worker.order`).
    """

    passes: tuple[int, ...] = ()

    def __init__(self, study: Study) -> None:
        assert study.sweep is not None
        swept = study.axis_of(study.sweep)
        assert swept is not None
        shape = study.shape
        self._swept, self._steps = swept, shape[swept]
        self._others = (*shape[:swept], *shape[swept + 1 :])
        self._down = study.axes[-1].array == DOWN
        self._shape = shape
        self._ascending = np.argsort(study.axes[swept].array, kind="stable").astype(np.int64)
        self._rank = np.argsort(self._ascending, kind="stable").astype(np.int64)

    def values(self, passes: int) -> tuple[int, ...]:  # noqa: ARG002 - as of every order
        """(): there are no passes."""
        return ()

    def cases(self, positions: Numbers) -> Numbers:
        """Numbers of the cases at those positions."""
        line, step = np.divmod(np.asarray(positions, dtype=np.int64), self._steps)
        own = list(np.unravel_index(line, self._others))
        rank = np.where(self._down[own[-1]], self._steps - 1 - step, step)
        own.insert(self._swept, self._ascending[rank])
        return np.asarray(np.ravel_multi_index(own, self._shape), dtype=np.int64)

    def positions(self, cases: Numbers) -> Numbers:
        """Positions of the cases of those numbers."""
        own = list(np.unravel_index(np.asarray(cases, dtype=np.int64), self._shape))
        rank = self._rank[own.pop(self._swept)]
        step = np.where(self._down[own[-1]], self._steps - 1 - rank, rank)
        return np.asarray(np.ravel_multi_index(own, self._others) * self._steps + step, dtype=np.int64)

    @property
    def unit(self) -> int:
        """Cases of a line."""
        return self._steps

    def lines_at(self, positions: Numbers) -> Numbers:
        """Positions of all cases, ascending, of the lines of which some are given."""
        lines = np.unique(positions // self._steps)
        return np.asarray((lines[:, None] * self._steps + np.arange(self._steps)).reshape(-1), dtype=np.int64)


def whole_lines(study: Study, cases: Numbers) -> NDArray[np.bool_]:
    """Which of the given cases (each once) of a swept grid belong to lines of which all cases are given."""
    order = LineOrder(study)
    _, member, counts = np.unique(order.positions(cases) // order.unit, return_inverse=True, return_counts=True)
    return np.asarray(counts[member] == order.unit)
