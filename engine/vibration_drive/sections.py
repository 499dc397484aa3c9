"""Strobes of settled motions at one phase of the excitation: points of bifurcation diagrams and Poincare sections."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.run import SettledRun
from sprag_study.engine.vibration_drive.cases import case_matrix, turns_freely, with_lengths
from sprag_study.engine.vibration_drive.integration import integrate
from sprag_study.engine.vibration_drive.kernel import kernel_of
from sprag_study.engine.vibration_drive.layout import OUT_ENDING
from sprag_study.engine.vibration_drive.orbits import without_turns
from sprag_study.engine.vibration_drive.settle import settle
from sprag_study.engine.vibration_drive.strobes import ANGLE, BEGIN, FRACTION, PENDULUM_WIDTH, SHAFT_WIDTH, in_order

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Phases are rounded to a multiple of this part of the period, which is exact in binary.
GRID = 1.0 / 4096.0
_OK = ENDINGS.index(Ending.OK)
_TURN = 2.0 * math.pi


@dataclass(frozen=True, slots=True)
class Sections:
    """Strobes of the settled motions of a batch.

    Attributes
    ----------
    regimes : int8 array, shape (cases,)
        Members of ``Regime``.
    orders : int array, shape (cases,)
        Excitation periods in one turn of the orbit; 0 where there is none.
    strobes : array, shape (cases, count, strobes.width(n))
        Of a periodic motion those of one turn, if there are as many, then NaN; NaN where a case did not end ok. Angles
        of a pendulum without a spring that turns over are between -pi and pi.
    """

    regimes: NDArray[np.int8]
    orders: NDArray[np.int64]
    strobes: Floats


def sections(
    columns: Mapping[str, ArrayLike],
    settings: SettledRun,
    *,
    cases: int,
    phase: float,
    count: int,
    starts: Floats | None = None,
) -> Sections:
    """Settle each case, and record its strobes at a phase of the excitation.

    Parameters
    ----------
    columns, settings, cases, starts :
        As for ``settle``.
    phase : float
        Part of the excitation period, 0 .. 1, rounded to a multiple of ``GRID``; 0 and 1 are its end.
    count : int
        Strobes of each case, one in each period after the search.

    Raises
    ------
    ValueError
        As ``settle``.
    """
    found = settle(columns, settings, cases=cases, starts=starts)
    orders = found.orders
    strobes = np.full((cases, count, found.points.shape[1]), np.nan)
    kept = np.flatnonzero(found.endings == _OK)
    if len(kept):
        strobes[kept] = _strobes(columns, settings, found.points, kept, phase, count)
    for case in np.flatnonzero((orders > 0) & (orders < count)).tolist():
        strobes[case, orders[case] :] = np.nan
    _leave_out_turns(case_matrix(columns, settings.run, cases), found.windings, strobes)
    return Sections(found.regimes, orders, strobes)


def _leave_out_turns(matrix: Floats, windings: Ints, strobes: Floats) -> None:
    """Take whole turns from the angles of the pendulums without a spring that turn over, in place."""
    angles = strobes[:, :, SHAFT_WIDTH + ANGLE :: PENDULUM_WIDTH]
    apart = np.fmax.reduce(angles, axis=1) - np.fmin.reduce(angles, axis=1)
    without_turns(strobes, turns_freely(matrix, windings.shape[1]) & ((windings != 0) | (apart > _TURN)))


def _strobes(
    columns: Mapping[str, ArrayLike], settings: SettledRun, points: Floats, kept: NDArray[np.int64], phase: float,
    count: int,
) -> Floats:  # fmt: skip
    """Strobes of some cases from their settled states on, shape (kept, count, columns)."""
    place = round(phase / GRID) * GRID % 1.0
    rows = points[kept].copy()
    rows[:, FRACTION] = place if place > 0.0 else 1.0
    begin = rows[:, BEGIN]
    # A strobe lies between the start and the first whole period, too.
    passed = count + (place > begin).astype(np.int64)
    matrix = case_matrix(columns, settings.run, len(points))[kept]
    matrix = with_lengths(matrix, begin, count + place - begin, windowed=False)
    done = integrate(kernel_of(columns, settings.tolerance), matrix, settings.run, starts=rows, strobes=count)
    strobes = in_order(done.strobes, passed)
    strobes[done.sums[:, OUT_ENDING] != _OK] = np.nan
    return strobes
