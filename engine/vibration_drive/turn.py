"""The settled motion of one case with everything that a page shows of it at once: its results, one turn, and the state
from which it goes on.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.outcome import Trajectory
from sprag_study.engine.run import Run, SettledRun
from sprag_study.engine.vibration_drive.cases import case_matrix, scalars, with_lengths
from sprag_study.engine.vibration_drive.integration import integrate
from sprag_study.engine.vibration_drive.kernel import kernel_of
from sprag_study.engine.vibration_drive.regimes import Regime
from sprag_study.engine.vibration_drive.settle import settle
from sprag_study.engine.vibration_drive.simulate import sampled
from sprag_study.engine.vibration_drive.start_states import as_parameters
from sprag_study.engine.vibration_drive.strobes import BEGIN
from sprag_study.engine.vibration_drive.sweep import whole_periods

Floats = NDArray[np.float64]

#: Excitation periods that are sampled of a motion without an orbit.
_PERIODS = 4


@dataclass(frozen=True, slots=True)
class SettledTurn:
    """The settled motion of one case.

    Attributes
    ----------
    values : float64 array, shape (results,)
        In the order of ``settled_infos``; NaN where a value could not be computed.
    regime : Regime
    order : int
        Excitation periods in one turn of the orbit; 0 where there is none.
    motion : Trajectory
        One turn of the orbit, or some periods of a motion without one; its times count from the start of an
        excitation period. No points where the case did not end ok.
    state : dict or None
        Initial values (SI) that go on from the motion at the start of a period; None where the case did not end ok.
    ending : Ending
    sensitive : bool array, shape (1,), or None
        As of the ``SettledBatch``; None for a motion from a given state.
    """

    values: Floats
    regime: Regime
    order: int
    motion: Trajectory
    state: dict[str, float] | None
    ending: Ending
    sensitive: NDArray[np.bool_] | None


def settled_turn(
    columns: Mapping[str, ArrayLike], settings: SettledRun, points: int, start: Floats | None = None
) -> SettledTurn:
    """Find the settled motion of one case once, and sample it.

    Parameters
    ----------
    columns : mapping
        As for ``simulate``, scalars only.
    settings : SettledRun
    points : int
        Approximate number of samples, at least 16 for each period.
    start : array, shape (1, strobes.width(n)), optional
        As ``starts`` of ``settle``, at the start of a period.

    Raises
    ------
    ValueError
        If a required parameter is missing or the number of pendulums or coefficients is out of range.
    """
    values = scalars(columns)
    found = settle(values, settings, cases=1, starts=start, examine_starts=start is None)
    regime, ending, results = Regime(int(found.regimes[0])), ENDINGS[int(found.endings[0])], found.values[0]
    if ending is not Ending.OK:
        return SettledTurn(results, regime, 0, nothing(ending), None, ending, found.sensitive)
    order = int(found.orders[0]) if regime.repeats else 0
    periods = order or _PERIODS
    motion = turn(values, settings.run, found.points, periods, max(16, points // periods))
    rows, arrived = whole_periods(values, settings, found.points)
    state = as_parameters(rows[0]) if arrived[0] else None
    return SettledTurn(results, regime, order, motion, state, ending, found.sensitive)


def nothing(ending: Ending = Ending.OK) -> Trajectory:
    """A motion without points."""
    return Trajectory(np.empty(0), (), (), np.empty((0, 0)), {}, ending)


def turn(values: Mapping[str, float], run: Run, points: Floats, periods: int, each: int) -> Trajectory:
    """Whole periods of a motion from the state ``points`` (shape (1, columns)) on, ``each`` samples per period and the
    last moment. They begin with the first whole period.
    """
    begin = float(points[0, BEGIN])
    first = np.ceil(begin)
    matrix = with_lengths(
        case_matrix(values, run, 1), points[:, BEGIN], np.array([first + periods - begin]), windowed=False
    )
    times = np.arange(periods * each + 1) / each
    found = integrate(kernel_of(values, run.tolerance), matrix, run, starts=points, times=first + times)
    return sampled(values, matrix, found, times / values["excitation.frequency"])
