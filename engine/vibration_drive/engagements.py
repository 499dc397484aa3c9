"""The engagements of one case: every stretch in which a clutch transmits torque, and the periods of the run.

Starts and ends are the transitions that the integration has located; torques and work come from the polynomials of its
steps.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.outcome import Engagement, Engagements, PeriodMeans
from sprag_study.engine.run import Run, SettledRun
from sprag_study.engine.vibration_drive.automaton import Clutch
from sprag_study.engine.vibration_drive.cases import Column, case_matrix, pendulum_count, unloaded, with_lengths
from sprag_study.engine.vibration_drive.integration import integrate
from sprag_study.engine.vibration_drive.kernel import Kernel, kernel_of
from sprag_study.engine.vibration_drive.layout import OUT_ENDING
from sprag_study.engine.vibration_drive.pieces import Pieces, integrals, largest, products
from sprag_study.engine.vibration_drive.regimes import Regime
from sprag_study.engine.vibration_drive.settle import settle
from sprag_study.engine.vibration_drive.strobes import BEGIN

Floats = NDArray[np.float64]

#: Most excitation periods of a table: the last ones of a longer run.
MAX_PERIODS = 500
#: Initial capacity in steps per period.
_STEPS = 100
#: Part of a period by which an engagement at the strobe may be off in the next turn of an orbit.
_SAME = 1e-9


@dataclass(frozen=True, slots=True)
class _Stretch:
    """Steps ``first`` .. ``last`` in which the clutch of a pendulum transmits torque without a break."""

    clutch: int
    first: int
    last: int


def engagements(columns: Mapping[str, ArrayLike], run: Run) -> Engagements:
    """The engagements in the window of a run, and the means of the run's periods.

    Parameters
    ----------
    columns : mapping
        As for ``simulate``, scalars only.
    run : Run

    Returns
    -------
    Engagements
        For a run longer than ``MAX_PERIODS`` only the last periods; an engagement that the window cuts is given in
        part.

    Raises
    ------
    ValueError
        If a required parameter is missing or the number of pendulums or coefficients is out of range.
    """
    frequency = float(np.asarray(columns["excitation.frequency"]))
    last = run.duration.in_periods(frequency)
    start, end = run.window_in_periods(frequency)
    end = min(end, last)
    since = max(0.0, last - MAX_PERIODS)
    start = min(max(start, since), end)
    module = kernel_of(columns, run.tolerance)
    ending, pieces = read_steps(module, case_matrix(columns, run, 1), run, since, last - since)
    period = 1.0 / frequency
    if ending != Ending.OK:
        return Engagements(start * period, end * period, "", (), (), ending)
    window = pieces.between(start, end)
    rows = tuple(_table(window, period))
    return Engagements(start * period, end * period, "", rows, _periods(pieces, last, period), ending)


def settled_engagements(
    columns: Mapping[str, ArrayLike], settings: SettledRun, start: Floats | None = None
) -> Engagements:
    """The engagements in one turn of the settled motion, and the means of its periods.

    Times count from the start of an excitation period. An engagement that continues into the next turn is given
    completely and ends after the turn. For irregular or unsettled motion, the ``settings.max_period`` periods after the
    search are examined.

    Parameters
    ----------
    columns : mapping
        As for ``simulate``, scalars only.
    settings : SettledRun
    start : array, shape (1, strobes.width(n)), optional
        As ``starts`` of ``settle``; without it the case's own start.

    Raises
    ------
    ValueError
        If a required parameter is missing or the number of pendulums or coefficients is out of range.
    """
    found = settle(columns, settings, cases=1, starts=start)
    regime, ending = Regime(int(found.regimes[0])), ENDINGS[int(found.endings[0])]
    period = 1.0 / float(np.asarray(columns["excitation.frequency"]))
    repeats = regime.repeats
    turn = int(found.orders[0]) if repeats else settings.max_period
    name = regime.name.lower()
    free = bool(unloaded(case_matrix(columns, settings.run, 1), pendulum_count(columns))[0])
    if ending != Ending.OK or (free and regime in (Regime.COASTING, Regime.HELD)):
        # In the limit of a vanishing load no clutch transmits torque.
        return Engagements(0.0, turn * period, name, (), (), ending)
    run = settings.fine if repeats else settings.run
    begin, length = float(found.points[0, BEGIN]), float(2 * turn if repeats else turn)
    matrix = with_lengths(case_matrix(columns, run, 1), np.array([begin]), np.array([length]), windowed=False)
    module = kernel_of(columns, settings.tolerance)
    ending, pieces = read_steps(module, matrix, run, 0.0, length + 1.0, starts=found.points)
    if ending != Ending.OK:
        return Engagements(0.0, turn * period, name, (), (), ending)
    if not repeats:
        rows, means = _table(pieces, period), _periods(pieces, begin + length, period)
        return Engagements(begin * period, (begin + turn) * period, name, tuple(rows), means, ending)
    rows = _one_turn(pieces, begin, turn, period)
    means = _periods(pieces.between(np.ceil(begin), np.ceil(begin) + turn), begin + length, period)
    if begin > 0.0:  # the first whole period of the pieces is the second of the turn
        means = tuple(replace(mean, start=k * period) for k, mean in enumerate((*means[-1:], *means[:-1])))
    return Engagements(0.0, turn * period, name, tuple(rows), means, ending)


def read_steps(
    module: Kernel, matrix: Floats, run: Run, since: float, periods: float, starts: Floats | None = None
) -> tuple[Ending, Pieces]:
    """How the one case of a matrix ends, and its steps from the time ``since`` on (in excitation periods)."""
    room = int(_STEPS * (periods + 2.0))
    while True:
        done = integrate(module, matrix, run, starts=starts, pieces=room, since=since)
        if np.isnan(done.pieces[-1, 0]):
            ending = ENDINGS[int(done.sums[0, OUT_ENDING])]
            return ending, Pieces.read(module.LAYOUT, done.pieces, float(matrix[0, Column.PERIOD]))
        room *= 2


def _stretches(pieces: Pieces) -> list[_Stretch]:
    """Every stretch of every clutch. A literal reset begins a new one."""
    found = []
    for clutch in range(pieces.states.shape[1]):
        transmits = pieces.states[:, clutch] >= Clutch.ENGAGED
        begins = transmits.copy()
        begins[1:] &= ~transmits[:-1] | (pieces.counts[1:, clutch] > pieces.counts[:-1, clutch])
        ends = transmits.copy()
        ends[:-1] &= ~transmits[1:] | begins[1:]
        pairs = zip(np.flatnonzero(begins).tolist(), np.flatnonzero(ends).tolist(), strict=True)
        found += [_Stretch(clutch, first, last) for first, last in pairs]
    return found


def _table(pieces: Pieces, period: float) -> list[Engagement]:
    """Every engagement in the pieces."""
    if not len(pieces.length):
        return []
    peaks, on_shaft, of_pendulum = (np.empty_like(pieces.counts) for _ in range(3))
    for clutch in range(pieces.counts.shape[1]):
        torque = pieces.torques[:, clutch]
        peaks[:, clutch] = largest(torque)
        on_shaft[:, clutch] = integrals(products(torque, pieces.speed), pieces.length)
        of_pendulum[:, clutch] = integrals(products(torque, pieces.speeds[:, clutch]), pieces.length)
    rows = []
    for stretch in _stretches(pieces):
        clutch, steps = stretch.clutch, slice(stretch.first, stretch.last + 1)
        rows.append(
            Engagement(
                clutch,
                float(pieces.start[stretch.first]) * period,
                float(pieces.end[stretch.last]) * period,
                _order(pieces, stretch),
                float(np.max(peaks[steps, clutch])),
                float(np.sum(on_shaft[steps, clutch])),
                float(np.sum(of_pendulum[steps, clutch])),
                stretch.first > 0 and stretch.last < len(pieces.length) - 1,
            )
        )
    return sorted(rows, key=lambda row: (row.start, row.order, row.clutch))


def _order(pieces: Pieces, stretch: _Stretch) -> int:
    """How many clutches transmit torque when a stretch begins, its own included; of one instant the first go first."""
    others = pieces.states[stretch.first] >= Clutch.ENGAGED
    before = pieces.states[stretch.first - 1] >= Clutch.ENGAGED if stretch.first else np.zeros_like(others)
    others &= before | (np.arange(len(others)) < stretch.clutch)
    others[stretch.clutch] = False
    return 1 + int(np.sum(others))


def _one_turn(pieces: Pieces, begin: float, turn: int, period: float) -> list[Engagement]:
    """Every engagement that begins in one turn of an orbit, from the steps of two."""
    rows = []
    for row in _table(pieces, period):
        start = row.start / period
        if row.complete and begin + _SAME < start <= begin + turn + _SAME:
            back = turn * period if start >= turn else 0.0
            rows.append(replace(row, start=row.start - back, end=row.end - back))
    # A clutch that never lets go has neither start nor end.
    once = _table(pieces.between(begin, begin + turn), period)
    rows += [row for row in once if row.end - row.start >= (turn - _SAME) * period]
    return sorted(rows, key=lambda row: (row.start, row.order, row.clutch))


def _periods(pieces: Pieces, end: float, period: float) -> tuple[PeriodMeans, ...]:
    """The means of every whole excitation period before ``end`` of which all steps are there."""
    turned = integrals(pieces.speed, pieces.length)
    peaks = largest(pieces.speed)
    impulse = integrals(np.sum(pieces.torques, axis=1), pieces.length)
    found = []
    for whole in np.unique(pieces.whole).tolist():
        steps = pieces.whole == whole
        if whole + 1 <= end * (1.0 + 1e-12) and pieces.start[steps][0] == whole:
            found.append(
                PeriodMeans(
                    whole * period,
                    float(np.sum(turned[steps])) / period,
                    float(np.max(peaks[steps])),
                    float(np.sum(impulse[steps])) / period,
                )
            )
    return tuple(found)
