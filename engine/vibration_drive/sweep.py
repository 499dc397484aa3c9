"""Sweeps: lines of cases, each of which starts from the settled motion of the case before it."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag.engine.endings import ENDINGS, Ending
from sprag.engine.run import SettledRun
from sprag.engine.vibration_drive.cases import case_matrix, pendulum_count, with_lengths
from sprag.engine.vibration_drive.integration import integrate
from sprag.engine.vibration_drive.kernel import kernel_of
from sprag.engine.vibration_drive.layout import OUT_ENDING
from sprag.engine.vibration_drive.regimes import Regime, settled_infos
from sprag.engine.vibration_drive.settle import SettledBatch, settle
from sprag.engine.vibration_drive.strobes import BEGIN, continued, from_rest, width

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_OK = ENDINGS.index(Ending.OK)
_REPEATS = [int(regime) for regime in Regime if regime.repeats]


class Begun(IntEnum):
    """How a case of a sweep began."""

    #: At its own initial values: the first of its line.
    FIRST = 0
    #: On the orbit of the case before it.
    ON_ORBIT = 1
    #: At the last state of the case before it, whose motion is irregular or had not settled.
    ARBITRARY = 2
    #: At its own initial values, because the case before it did not end ok.
    AGAIN = 3


@dataclass(frozen=True, slots=True)
class Sweep:
    """Settled motions of the lines of a sweep.

    Attributes
    ----------
    batch : SettledBatch
        As of ``settle``, case by case.
    begun : int8 array, shape (cases,)
        Members of ``Begun``.
    starts : array, shape (cases, strobes.width(n))
        The state from which each case began, as ``settle`` takes it.
    """

    batch: SettledBatch
    begun: NDArray[np.int8]
    starts: Floats


def sweep(columns: Mapping[str, ArrayLike], settings: SettledRun, lines: Ints) -> Sweep:
    """Find the settled motions along lines: the first case of each from its own start, the others each from the
    settled motion of the case before it.

    A case begins, at the start of an excitation period, with the angles, speeds, windups and states of clutches and
    shaft that the case before it has there; the shaft's turn counts anew. After irregular motion, or one that had not
    settled, this is an arbitrary state of it. After a case that did not end ok the next one begins at its own initial
    values again. A line's numbers do not depend on the other lines.

    Parameters
    ----------
    columns : mapping
        As for ``simulate``, with arrays of shape (lines * steps,) where values vary.
    settings : SettledRun
    lines : int array, shape (lines, steps)
        The cases of each line in the order of the sweep; every case of the batch exactly once.

    Returns
    -------
    Sweep

    Raises
    ------
    ValueError
        If the lines do not have every case once, or as of ``settle``.
    """
    count = lines.size
    if not np.array_equal(np.sort(lines, axis=None), np.arange(count)):
        raise ValueError("the lines of a sweep must have every case exactly once")
    n = pendulum_count(columns)
    results, columns_of_state = len(settled_infos(n)), width(n)
    batch = SettledBatch(
        np.full((count, results), np.nan), np.full(count, _OK, dtype=np.int8), np.zeros(count, dtype=np.int8),
        np.full((count, columns_of_state), np.nan), np.zeros(count),
    )  # fmt: skip
    begun = np.full(count, Begun.FIRST, dtype=np.int8)
    starts = from_rest(count, n)
    before: Ints | None = None
    for cases in lines.T:
        own = _rows(columns, cases)
        if before is not None:
            starts[cases], begun[cases] = _after(columns, settings, batch, before)
        found = settle(own, settings, cases=len(cases), starts=starts[cases])
        batch.values[cases], batch.endings[cases], batch.regimes[cases] = found.values, found.endings, found.regimes
        batch.points[cases], batch.spent[cases] = found.points, found.spent
        before = cases
    return Sweep(batch, begun, starts)


def _rows(columns: Mapping[str, ArrayLike], cases: Ints) -> dict[str, ArrayLike]:
    """The columns of some cases."""
    return {path: value[cases] if (value := np.asarray(column)).ndim else column for path, column in columns.items()}


def _after(
    columns: Mapping[str, ArrayLike], settings: SettledRun, batch: SettledBatch, cases: Ints
) -> tuple[Floats, NDArray[np.int8]]:
    """The starts of the cases that follow ``cases``, and how they begin."""
    starts = from_rest(len(cases), pendulum_count(columns))
    ok = batch.endings[cases] == _OK
    starts[ok], arrived = whole_periods(_rows(columns, cases[ok]), settings, batch.points[cases[ok]])
    ok[ok] = arrived
    starts[~ok] = from_rest(1, pendulum_count(columns))
    begun = np.where(np.isin(batch.regimes[cases], _REPEATS), Begun.ON_ORBIT, Begun.ARBITRARY)
    return starts, np.where(ok, begun, Begun.AGAIN).astype(np.int8)


def whole_periods(
    columns: Mapping[str, ArrayLike], settings: SettledRun, points: Floats
) -> tuple[Floats, NDArray[np.bool_]]:
    """States at the ends of excitation periods, as ``settle`` takes them, from those at any strobes.

    Strobes within the period are carried on to its end.

    Parameters
    ----------
    columns : mapping
        As for ``simulate``.
    settings : SettledRun
    points : array, shape (cases, strobes.width(n))

    Returns
    -------
    starts : array, shape (cases, strobes.width(n))
    arrived : bool array, shape (cases,)
        Whether the rest of the period ended ok.
    """
    starts = continued(points)
    arrived = np.ones(len(points), dtype=np.bool_)
    moved = np.flatnonzero(starts[:, BEGIN] > 0.0)
    if len(moved):
        begin = starts[moved, BEGIN]
        matrix = case_matrix(_rows(columns, moved), settings.run, len(moved))
        matrix = with_lengths(matrix, begin, 1.0 - begin, windowed=False)
        module = kernel_of(columns, settings.tolerance)
        done = integrate(module, matrix, settings.fine, starts=starts[moved], strobes=1)
        starts[moved] = continued(done.strobes[:, 0])
        arrived[moved] = done.sums[:, OUT_ENDING] == _OK
    return starts, arrived
