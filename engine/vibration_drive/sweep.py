"""Sweeps: lines of cases, each of which starts from the settled motion of the case before it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.run import SettledRun
from sprag_study.engine.vibration_drive.cases import Column, case_matrix, of_cases, pendulum_count, with_lengths
from sprag_study.engine.vibration_drive.integration import integrate
from sprag_study.engine.vibration_drive.kernel import kernel_of
from sprag_study.engine.vibration_drive.layout import OUT_ENDING
from sprag_study.engine.vibration_drive.orbits import without_turns
from sprag_study.engine.vibration_drive.regimes import Regime, settled_infos
from sprag_study.engine.vibration_drive.settle import SettledBatch, settle
from sprag_study.engine.vibration_drive.strobes import (
    ANGLE,
    BEGIN,
    PENDULUM_WIDTH,
    SHAFT_SPEED,
    SHAFT_WIDTH,
    SPEED,
    continued,
    from_rest,
    width,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]

_OK = ENDINGS.index(Ending.OK)
#: Orbits are apart where they are so many times as far from each other as those around them in the line (the median of
#: so many pairs to either side), as they are and in proportion to the steps, and at least this far (scaled); without
#: any others around, the last number.
_TIMES, _AROUND, _LEAST, _ALONE = 4.0, 3, 0.02, 0.2


def _within_a_turn(apart: Floats) -> Floats:
    """Differences of angles up to whole turns, without them."""
    rest = np.remainder(apart, 2.0 * math.pi)
    return np.asarray(np.minimum(rest, 2.0 * math.pi - rest))


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
    jumped : bool array, shape (cases,)
        Whether a case's motion does not continue that of the case before it: regime or order differ, or the orbits are
        much further apart than those of the neighbours.
    """

    batch: SettledBatch
    begun: NDArray[np.int8]
    starts: Floats
    jumped: Flags


def sweep(columns: Mapping[str, ArrayLike], settings: SettledRun, lines: Ints, along: str | None = None) -> Sweep:
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
    along : str, optional
        The column that is swept. Without it the steps count as equal where jumps are told from steep parts.

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
        own = of_cases(columns, cases)
        if before is not None:
            starts[cases], begun[cases] = _after(columns, settings, batch, before)
        found = settle(own, settings, cases=len(cases), starts=starts[cases])
        batch.values[cases], batch.endings[cases], batch.regimes[cases] = found.values, found.endings, found.regimes
        batch.points[cases], batch.spent[cases] = found.points, found.spent
        before = cases
    at = np.arange(lines.shape[1])[None, :] if along is None else np.asarray(columns[along], dtype=np.float64)[lines]
    steps = np.ones(count)
    steps[lines[:, 1:]] = np.abs(np.diff(at))
    return Sweep(batch, begun, starts, _jumped(columns, settings, batch, starts, begun, lines, steps))


def _after(
    columns: Mapping[str, ArrayLike], settings: SettledRun, batch: SettledBatch, cases: Ints
) -> tuple[Floats, NDArray[np.int8]]:
    """The starts of the cases that follow ``cases``, and how they begin."""
    starts = from_rest(len(cases), pendulum_count(columns))
    ok = batch.endings[cases] == _OK
    starts[ok], arrived = whole_periods(of_cases(columns, cases[ok]), settings, batch.points[cases[ok]])
    ok[ok] = arrived
    starts[~ok] = from_rest(1, pendulum_count(columns))
    begun = np.where(batch.repeats[cases], Begun.ON_ORBIT, Begun.ARBITRARY)
    return starts, np.where(ok, begun, Begun.AGAIN).astype(np.int8)


def whole_periods(columns: Mapping[str, ArrayLike], settings: SettledRun, points: Floats) -> tuple[Floats, Flags]:
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
        matrix = case_matrix(of_cases(columns, moved), settings.run, len(moved))
        matrix = with_lengths(matrix, begin, 1.0 - begin, windowed=False)
        module = kernel_of(columns, settings.tolerance)
        done = integrate(module, matrix, settings.fine, starts=starts[moved], strobes=1)
        starts[moved] = continued(done.strobes[:, 0])
        arrived[moved] = done.sums[:, OUT_ENDING] == _OK
    return starts, arrived


def _jumped(
    columns: Mapping[str, ArrayLike],
    settings: SettledRun,
    batch: SettledBatch,
    starts: Floats,
    begun: NDArray[np.int8],
    lines: Ints,
    steps: Floats,
) -> Flags:
    """Which cases do not continue the motion of the case before them, so many ``steps`` away."""
    order = batch.orders
    # Without a load a drive coasts, as the limit of a vanishing load.
    kind = np.where(batch.regimes == Regime.COASTING, Regime.PERIODIC, batch.regimes)
    found = np.zeros(len(starts), dtype=np.bool_)
    known = (begun == Begun.ON_ORBIT) | (begun == Begun.ARBITRARY)
    before = np.arange(len(starts))
    before[lines[:, 1:]] = lines[:, :-1]
    windings = batch.windings
    same = (kind == kind[before]) & (order == order[before]) & np.all(windings == windings[before], axis=1)
    found[known & (batch.endings == _OK) & ~same] = True
    compared = np.flatnonzero(known & same & (order > 0))
    apart = np.full(len(starts), np.nan)
    if len(compared):
        apart[compared] = _apart(columns, settings, batch, starts[compared], compared, before[compared])
    for line in lines:
        for place, case in enumerate(line.tolist()):
            if not math.isnan(apart[case]):
                near = np.delete(line[max(0, place - _AROUND) : place + _AROUND + 1], min(place, _AROUND))
                found[case] = apart[case] > _usual(apart, steps, case, near[~np.isnan(apart[near])])
    return found


def _usual(apart: Floats, steps: Floats, case: int, near: Ints) -> float:
    """How far apart the orbits of a case and the one before it may be, from the cases ``near`` it in the line."""
    if not near.size:
        return _ALONE
    around = max(np.median(apart[near]), np.median(apart[near] / steps[near]) * steps[case])
    return max(_LEAST, _TIMES * float(around))


def _apart(
    columns: Mapping[str, ArrayLike],
    settings: SettledRun,
    batch: SettledBatch,
    starts: Floats,
    cases: Ints,
    before: Ints,
) -> Floats:
    """Largest scaled difference between the ``starts`` of some cases, on the orbits of those ``before``, and their own
    orbits at the nearest phase. Pendulums that turn over have made the same whole turns on both.
    """
    points, order, turns_over = batch.points, batch.orders, batch.windings != 0
    own = np.union1d(cases, before)
    begin = points[own, BEGIN]
    matrix = case_matrix(of_cases(columns, own), settings.run, len(own))
    matrix = with_lengths(matrix, begin, order[own] - begin + (begin > 0.0), windowed=False)
    module, most = kernel_of(columns, settings.tolerance), int(order[own].max()) + 1
    orbits = integrate(module, matrix, settings.run, starts=continued(points[own]), strobes=most).strobes
    without_turns(orbits, turns_over[own])
    angles = np.arange(SHAFT_WIDTH + ANGLE, points.shape[1], PENDULUM_WIDTH)
    speeds = np.append(angles + SPEED - ANGLE, SHAFT_SPEED)
    # Strobes after a turn are NaN.
    top = np.nanmax(np.abs(orbits[:, :, speeds]), axis=(1, 2), initial=1e-300)
    top = np.maximum(top, np.nanmax(np.abs(orbits[:, :, angles]), axis=(1, 2)) * matrix[:, Column.NU])
    here, there = np.searchsorted(own, cases), np.searchsorted(own, before)
    scale = np.maximum(top[here], top[there])[:, None]
    off = np.abs(orbits[here] - starts[:, None, :])
    off[:, :, angles] = np.where(turns_over[cases, None, :], _within_a_turn(off[:, :, angles]), off[:, :, angles])
    far = np.maximum(off[:, :, speeds].max(axis=2), off[:, :, angles].max(axis=2) * matrix[here, None, Column.NU])
    return np.asarray(np.nanmin(far / scale, axis=1))
