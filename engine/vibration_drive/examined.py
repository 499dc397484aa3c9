"""The part of a case's motion in which its clutches are examined: the window of a run, or one turn of an orbit."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine.catalogue import ResultInfo
from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.run import Run, SettledRun
from sprag_study.engine.vibration_drive.cases import Column, case_matrix, pendulum_count, unloaded, with_lengths
from sprag_study.engine.vibration_drive.characteristics import characteristics
from sprag_study.engine.vibration_drive.integration import integrate
from sprag_study.engine.vibration_drive.kernel import Kernel, kernel_of
from sprag_study.engine.vibration_drive.layout import OUT_ENDING, PendulumSample, pendulum_samples
from sprag_study.engine.vibration_drive.pieces import Pieces
from sprag_study.engine.vibration_drive.regimes import Regime, settled_infos
from sprag_study.engine.vibration_drive.results import result_infos
from sprag_study.engine.vibration_drive.settle import SettledBatch, settle
from sprag_study.engine.vibration_drive.strobes import BEGIN, PENDULUM_WIDTH, SHAFT_WIDTH, WINDUP

Floats = NDArray[np.float64]

#: Most excitation periods that are examined: the last ones of a longer run.
MAX_PERIODS = 500
#: Initial capacity in steps per period.
_STEPS = 100


@dataclass(frozen=True, slots=True)
class Examined:
    """A part of a motion, by its steps.

    Attributes
    ----------
    start, end : float
        The part, in s. A turn of an orbit counts from the start of an excitation period.
    regime : str
        Name of the settled motion's regime; "" for a run of a given time.
    ending : Ending
    period : float
        The excitation's, in s.
    turn : int
        Excitation periods after which the motion repeats itself; 0 where it does not.
    begin, last : float
        Start and end of the recorded steps, in excitation periods.
    steps : Pieces or None
        Recorded steps: those of the run, or those of two turns of an orbit. None where the case does not end ok, and
        where no clutch transmits torque in the limit of a vanishing load.
    part : Pieces or None
        Those of the part.
    losses : float64 array, shape (n,)
        Mean power in W that the damping of each clutch takes.
    """

    start: float
    end: float
    regime: str
    ending: Ending
    period: float
    turn: int
    begin: float
    last: float
    steps: Pieces | None
    part: Pieces | None
    losses: Floats


def examined(columns: Mapping[str, ArrayLike], run: Run) -> Examined:
    """The window of a run; of one longer than ``MAX_PERIODS`` only its last periods.

    Parameters
    ----------
    columns : mapping
        As for ``simulate``, scalars only.
    run : Run

    Raises
    ------
    ValueError
        If a required parameter is missing or the number of pendulums or coefficients is out of range.
    """
    frequency = float(np.asarray(columns["excitation.frequency"]))
    last = run.duration.in_periods(frequency)
    since = _first_period(last)
    start, end = examined_window(run, frequency)
    module = kernel_of(columns, run.tolerance)
    matrix = case_matrix(columns, run, 1)
    record = read_steps(module, matrix, run, since, last - since)
    steps = record.steps.wound(record.of_pendulums(PendulumSample.WINDUP))
    losses = _losses(result_infos(module.LAYOUT.n), characteristics(module.LAYOUT, matrix, record.sums)[0])
    period = 1.0 / frequency
    ok = record.ending == Ending.OK
    return Examined(
        start * period, end * period, "", record.ending, period, 0, since, last, steps if ok else None,
        steps.between(start, end) if ok else None, losses,
    )  # fmt: skip


def examined_settled(columns: Mapping[str, ArrayLike], settings: SettledRun, start: Floats | None = None) -> Examined:
    """One turn of the settled motion; of irregular or unsettled motion, the ``settings.max_period`` periods after the
    search.

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
    return examined_motion(columns, settings, settle(columns, settings, cases=1, starts=start))


def examined_motion(columns: Mapping[str, ArrayLike], settings: SettledRun, settled: SettledBatch) -> Examined:
    """The settled motion of one case, which ``settle`` has given, as `examined_settled`."""
    regime, ending = Regime(int(settled.regimes[0])), ENDINGS[int(settled.endings[0])]
    period = 1.0 / float(np.asarray(columns["excitation.frequency"]))
    turn = int(settled.orders[0]) if regime.repeats else 0
    periods = turn or settings.max_period
    name = regime.name.lower()
    losses = _losses(settled_infos(pendulum_count(columns)), settled.values[0])
    free = bool(unloaded(case_matrix(columns, settings.run, 1), pendulum_count(columns))[0])
    nothing = Examined(0.0, periods * period, name, ending, period, turn, 0.0, periods, None, None, losses)
    if ending != Ending.OK or (free and regime in (Regime.COASTING, Regime.HELD)):
        return nothing  # in the limit of a vanishing load no clutch transmits torque
    run = settings.fine if turn else settings.run
    begin, length = float(settled.points[0, BEGIN]), float(2 * turn or periods)
    matrix = with_lengths(case_matrix(columns, run, 1), np.array([begin]), np.array([length]), windowed=False)
    module = kernel_of(columns, settings.tolerance)
    record = read_steps(module, matrix, run, 0.0, length + 1.0, starts=settled.points)
    if record.ending != Ending.OK:
        return replace(nothing, ending=record.ending)
    steps = record.steps.wound(settled.points[0, SHAFT_WIDTH + WINDUP :: PENDULUM_WIDTH])
    if turn:
        part = steps.between(begin, begin + turn)
        return Examined(0.0, turn * period, name, ending, period, turn, begin, begin + length, steps, part, losses)
    end = (begin + periods) * period
    return Examined(begin * period, end, name, ending, period, 0, begin, begin + length, steps, steps, losses)


def examined_window(run: Run, frequency: float) -> tuple[float, float]:
    """Start and end, in excitation periods at ``frequency`` (Hz), of the part of a run that is examined: its window, of
    a run longer than ``MAX_PERIODS`` within its last periods only.
    """
    last = run.duration.in_periods(frequency)
    start, end = run.window_in_periods(frequency)
    end = min(end, last)
    return min(max(start, _first_period(last)), end), end


def _first_period(last: float) -> float:
    """The first excitation period that is examined of a run of ``last`` periods."""
    return max(0.0, float(np.ceil(last)) - MAX_PERIODS)


@dataclass(frozen=True, slots=True)
class Record:
    """A run of one case, by its steps from a time on.

    Attributes
    ----------
    ending : Ending
    steps : Pieces
        Windups of clutches that are wound up at the first step count from there.
    sums : array, shape (1, columns)
        Of the whole run.
    sample : array, shape (columns,)
        Instantaneous values at that time.
    """

    ending: Ending
    steps: Pieces
    sums: Floats
    sample: Floats

    def of_pendulums(self, column: PendulumSample) -> Floats:
        """One of the instantaneous values of each pendulum, shape (n,)."""
        n = self.steps.states.shape[1]
        return np.array([self.sample[pendulum_samples(i)][column] for i in range(n)])


def read_steps(
    module: Kernel, matrix: Floats, run: Run, since: float, periods: float, starts: Floats | None = None
) -> Record:
    """The run of the one case of a matrix, by its steps from the time ``since`` on (in excitation periods).

    With ``starts`` the run begins there, and so do its steps.
    """
    room = int(_STEPS * (periods + 2.0))
    while True:
        done = integrate(module, matrix, run, starts=starts, times=np.array([since]), pieces=room, since=since)
        if np.isnan(done.pieces[-1, 0]):
            steps = Pieces.read(module.LAYOUT, done.pieces, float(matrix[0, Column.PERIOD]))
            return Record(ENDINGS[int(done.sums[0, OUT_ENDING])], steps, done.sums, done.samples[0])
        room *= 2


def _losses(infos: tuple[ResultInfo, ...], values: Floats) -> Floats:
    chosen = [info.name.startswith("pendulums.") and info.name.endswith(".power.clutch_loss") for info in infos]
    losses: Floats = values[np.flatnonzero(chosen)]
    return losses
