"""The motions to which long runs come, distinguished by their strobes alone: the reference of `benchmarks.starts`.

A run ends early where its motion cannot change any more: where the strobes of a turn agree to 1e-10 with those of the
turn before, and with those at least 1,000 periods earlier. A run near an unstable orbit leaves it within that time. All
other runs last for all periods.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.run import Run
from sprag_study.engine.vibration_drive.cases import Column, case_matrix, with_lengths
from sprag_study.engine.vibration_drive.integration import integrate
from sprag_study.engine.vibration_drive.kernel import kernel_of
from sprag_study.engine.vibration_drive.layout import OUT_ENDING
from sprag_study.engine.vibration_drive.strobes import ANGLE, SHAFT_SPEED, SHAFT_WIDTH, SPEED, TURN

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Periods of a part of a run, parts after which strobes are compared again, strobes kept of each, the highest order.
_PIECE, _PARTS, _KEPT, _HIGHEST = 200, 5, 64, 32
#: Scaled differences: of strobes that repeat, of those that do after a whole run, of one orbit from two starts.
_REPEATS, _REPEATS_AT_END, _SAME = 1e-10, 1e-8, 1e-5
#: Standard errors within which means of irregular motions are the same, and the least (scaled) that counts as one.
_ERRORS, _LEAST = 6.0, 1e-5
_OK = ENDINGS.index(Ending.OK)
#: What is compared of a strobe of a drive with one pendulum: both speeds, and the angle.
_COLUMNS = [SHAFT_SPEED, SHAFT_WIDTH + SPEED, SHAFT_WIDTH + ANGLE]


@dataclass(frozen=True)
class Motions:
    """The motions of one drive.

    Attributes
    ----------
    rows : list of dict
        Of each motion: its order (0: irregular), the mean speed of the shaft at its strobes, its starts, the largest
        distance (scaled) of one of them from the first, and the smallest one of the first from another motion.
    members : array, shape (starts,)
        The motion of each start; -1 where it did not end ok.
    """

    rows: list[dict[str, float]]
    members: Ints


def long_motions(columns: dict[str, Any], starts: int, periods: int) -> Motions:
    """The motions to which runs of that many periods come.

    Parameters
    ----------
    columns : mapping
        Columns of every start, as for ``simulate``: of one drive, with one pendulum that has a spring.
    starts, periods : int
    """
    run = Run()
    kernel, matrix = kernel_of(columns, run.tolerance), case_matrix(columns, run, starts)
    ok, orders = np.ones(starts, dtype=np.bool_), np.zeros(starts, dtype=np.int64)
    pieces = periods // _PIECE
    last = np.full((starts, _KEPT, len(_COLUMNS)), np.nan)
    means = np.full((starts, pieces, len(_COLUMNS)), np.nan)
    active, now, earlier = np.arange(starts), None, []
    for piece in range(pieces):
        lengths = with_lengths(
            matrix[active], np.zeros(len(active)), np.full(len(active), float(_PIECE)), windowed=False
        )
        done = integrate(kernel, lengths, run, starts=now, strobes=_PIECE)
        ok[active] = done.sums[:, OUT_ENDING] == _OK
        strobes = _scaled(done.strobes[:, :, _COLUMNS], float(matrix[0, Column.NU]))
        last[active], means[active, piece] = strobes[:, -_KEPT:], strobes.mean(axis=1)
        earlier.append(last.copy())
        if len(earlier) > _PARTS:
            orders[active] = _orders(last[active], earlier.pop(0)[active], _REPEATS)
        left = ok[active] & (orders[active] == 0)
        now, active = done.strobes[left, -1].copy(), active[left]
        now[:, TURN] = 0.0
        if not len(active):
            break
    if len(active):
        orders[active] = _orders(last[active], earlier[0][active], _REPEATS_AT_END)
    return _grouped(last, orders, ok, means[:, pieces // 2 :])


def _scaled(strobes: Floats, nu: float) -> Floats:
    """Strobes in which an angle counts as the speed that belongs to it."""
    strobes[:, :, -1] *= nu
    return strobes


def _unit(strobes: Floats) -> float:
    """The largest speed."""
    return max(float(np.abs(strobes).max()), 1e-6)


def _orders(last: Floats, earlier: Floats, limit: float) -> Ints:
    """Least order of each run; 0 where its strobes do not repeat. ``earlier`` was taken ``_PARTS`` pieces before."""
    found = np.zeros(len(last), dtype=np.int64)
    since = _PARTS * _PIECE
    units = np.maximum(np.abs(last).max(axis=(1, 2)), 1e-6)
    for order in range(_HIGHEST, 0, -1):
        turn = last[:, -order:]
        before = last[:, -2 * order : -order]
        ago = -(-since // order) * order - since
        long_before = earlier[:, _KEPT - ago - order : _KEPT - ago]
        apart = np.maximum(np.abs(turn - before), np.abs(turn - long_before)).max(axis=(1, 2))
        found[apart < limit * units] = order
    for order in range(_HIGHEST // 2, 0, -1):
        # Rounding errors decide whether one turn or several repeat within the limit first.
        apart = np.abs(last[:, -order:] - last[:, -2 * order : -order]).max(axis=(1, 2))
        found[(found % order == 0) & (found > 0) & (apart < _SAME * units)] = order
    return found


def _grouped(last: Floats, orders: Ints, ok: NDArray[np.bool_], means: Floats) -> Motions:
    """Runs that come to the same motion, each compared with the first run of a motion."""
    count = np.maximum((~np.isnan(means[:, :, 0])).sum(axis=1), 1)[:, None]
    middle = np.nansum(means, axis=1) / count
    error = np.sqrt(np.nansum((means - middle[:, None]) ** 2, axis=1)) / count
    members = np.full(len(last), -1, dtype=np.int64)
    rows: list[dict[str, float]] = []
    for order in np.unique(orders[ok]).tolist():
        left = np.flatnonzero(ok & (orders == order))
        while len(left):
            if order:
                apart, same = _from_orbit(last, left, int(order))
            else:
                apart, same = _from_means(last, left, middle, error)
            members[left[same]] = len(rows)
            speeds = last[left[0], -order:, 0] if order else means[left[0], :, 0]
            rows.append(
                {
                    "order": float(order),
                    "speed": float(np.mean(speeds)),
                    "starts": float(same.sum()),
                    "widest": float(apart[same].max()),
                    "nearest": float(apart[~same].min(initial=1e9)),
                }
            )
            left = left[~same]
    return Motions(rows, members)


def _from_orbit(last: Floats, runs: Ints, order: int) -> tuple[Floats, NDArray[np.bool_]]:
    """Distances of orbits from that of the first run, at the best of all shifts, and whether they are the same."""
    first = last[runs[0], -order:]
    turns = last[runs, -order:]
    shifts = [np.abs(np.roll(turns, shift, axis=1) - first).max(axis=(1, 2)) for shift in range(order)]
    apart = np.min(shifts, axis=0) / _unit(first)
    return apart, apart < _SAME


def _from_means(last: Floats, runs: Ints, middle: Floats, error: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Largest differences of the means of irregular runs from those of the first, and whether they are the same."""
    unit = _unit(last[runs[0]])
    apart = np.abs(middle[runs] - middle[runs[0]]) / unit
    errors = np.hypot(error[runs], error[runs[0]]) / unit
    same: NDArray[np.bool_] = (apart < _ERRORS * np.maximum(errors, _LEAST)).all(axis=1)
    return apart.max(axis=1), same
