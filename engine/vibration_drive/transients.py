"""Runs of a given time, and whether their windows show the settled motion (docs/theory.md, "Runs of a given time").

Every decision about a case follows from that case alone, so its flag does not depend on the batch.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.outcome import Batch
from sprag_study.engine.run import Run, SettledRun
from sprag_study.engine.vibration_drive.cases import (
    STOPS,
    Column,
    case_matrix,
    load_at_rest,
    pendulum_count,
    stop_column,
    swings,
    unloaded,
)
from sprag_study.engine.vibration_drive.characteristics import characteristics
from sprag_study.engine.vibration_drive.integration import integrate
from sprag_study.engine.vibration_drive.kernel import kernel_of
from sprag_study.engine.vibration_drive.layout import OUT_ENDING
from sprag_study.engine.vibration_drive.results import result_infos
from sprag_study.engine.vibration_drive.search import ROUND, Search
from sprag_study.engine.vibration_drive.simulate import simulate
from sprag_study.engine.vibration_drive.strobes import SHAFT_SPEED, TURN, in_order

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]

#: Relative difference from the settled mean above which the mean over the window is off.
OFF = 0.01
#: Most excitation periods by which a run is continued: a factor on its own, and an absolute maximum.
TIMES, MOST = 6, 340
#: Amplitude in rad below which a pendulum does not swing, and turn in an excitation period below which a shaft stands.
_STILL = 1e-6
#: The first of them, before the rounds of `ROUND`.
_FIRST = 20
#: Last periods of these whose mean stands for the settled one where no orbit was found.
_MEAN_OVER = 160
_OK = ENDINGS.index(Ending.OK)


@dataclass(frozen=True, slots=True)
class JudgedBatch:
    """Results of runs of a given time.

    Attributes
    ----------
    batch : Batch
        As of ``simulate.simulate``.
    off : bool array, shape (cases,)
        Whether the motion in the window was not the settled one: its mean speed is off by more than ``OFF``, or, with
        the shaft held, the swing of a pendulum.
    spent : array, shape (cases,)
        Excitation periods computed for this beyond the run itself.
    """

    batch: Batch
    off: Flags
    spent: Floats


def simulate_judged(columns: Mapping[str, ArrayLike], run: Run, *, cases: int) -> JudgedBatch:
    """Run a batch of cases, and judge from their strobes whether they had settled.

    Each run is continued from its last strobe until the orbit that it approaches is found, for at most ``TIMES`` times
    its length and ``MOST`` periods. One whose load swings with the angle of the shaft has no such orbit and is not
    judged.

    Parameters
    ----------
    columns, run, cases :
        As of ``simulate.simulate``.

    Raises
    ------
    ValueError
        If a required parameter is missing or the number of pendulums or coefficients is out of range.
    """
    if cases == 0:
        return JudgedBatch(simulate(columns, run, cases=0), np.zeros(0, dtype=np.bool_), np.zeros(0))
    n = pendulum_count(columns)
    module = kernel_of(columns, run.tolerance)
    matrix = case_matrix(columns, run, cases)
    settings = SettledRun(
        at_most=MOST + ROUND,
        tolerance=run.tolerance,
        reset=run.reset,
        max_events_per_period=run.max_events_per_period,
    )
    swinging = swings(matrix)
    followed = matrix.copy()
    followed[swinging, Column.CYCLIC] = 0.0  # of cases that are not followed
    search = Search(module, followed, settings)
    kept = search.history.shape[1]
    done = integrate(module, matrix, run, strobes=kept)
    endings = done.sums[:, OUT_ENDING].astype(np.int8)
    values = characteristics(module.LAYOUT, matrix, done.sums)
    batch = Batch(values, endings)
    duration = np.sum(matrix[:, stop_column(STOPS - 1) : stop_column(STOPS)], axis=1)
    periods = np.floor(duration).astype(np.int64)
    ran = (endings == _OK) & ~swinging
    search.history[ran] = in_order(done.strobes[ran], periods[ran])
    search.starts[ran] = search.history[ran, -1]
    search.starts[:, TURN] = 0.0
    search.count = kept
    settled = _Settled(search, n, values)
    _follow(search, np.flatnonzero(ran), np.minimum(TIMES * duration, MOST), settled)
    return JudgedBatch(batch, ran & settled.off(values), search.spent)


class _Settled:
    """What is judged of the settled motions, as far as they are known, shape (cases, 1 + pendulums): mean speed of the
    shaft, amplitude of each pendulum.
    """

    def __init__(self, search: Search, pendulums: int, values: Floats) -> None:
        names = [info.name for info in result_infos(pendulums)]
        swings = (f"pendulums.{i}.angle.amplitude" for i in range(pendulums))
        self.columns = [names.index(name) for name in ("shaft.speed.mean", *swings)]
        self.seen = values[:, self.columns].copy()
        self._search = search

    def off(self, values: Floats) -> Flags:
        """Whether the windows show others."""
        own = values[:, self.columns]
        scale = np.abs(self.seen)
        scale[:, 1:] = np.maximum(scale[:, 1:], _STILL)
        off = np.abs(own - self.seen) > OFF * scale
        matrix = self._search.matrix
        # A shaft that only torques resist that depend on its speed stands in the limit.
        slows = (load_at_rest(matrix) == 0.0) & ~unloaded(matrix, self._search.kernel.LAYOUT.n)
        turn = np.maximum(own[:, 0], self.seen[:, 0]) * matrix[:, Column.PERIOD]
        held = turn <= np.where(slows, _STILL, 0.0)
        return np.where(held, np.any(off[:, 1:], axis=1), off[:, 0])

    def lost(self, cases: Ints) -> None:
        """Record cases whose continuation does not end ok: their windows do not show the later motion."""
        self.seen[cases] = np.inf

    def look(self, active: Ints) -> Ints:
        """Write the means of cases whose orbits are found; the others, with the means of their last periods."""
        search = self._search
        found = search.look(active)
        if len(found.cases):
            seen = search.over_one_turn(found)[:, self.columns]
            # A pendulum that turns over has no amplitude; a window without a whole turn does not show that it does.
            turns_over = np.isnan(seen[:, 1:])
            seen[:, 1:][turns_over] = np.maximum(self.seen[found.cases, 1:], math.pi)[turns_over]
            self.seen[found.cases] = seen
        active = active[~np.isin(active, found.cases)]
        if not len(active):
            return active
        last = int(search.periods[active[0]])
        if last:
            over = min(last, _MEAN_OVER)
            turned = np.add.reduce(search.turns[active, last - over : last], axis=1)
            self.seen[active, 0] = turned / (over * search.matrix[active, Column.PERIOD])
        speeds = search.history[active, -ROUND:, SHAFT_SPEED]
        # Without a load nothing slows down the shaft: its speed is settled once no clutch changes it.
        steady = unloaded(search.matrix[active], search.kernel.LAYOUT.n) & np.all(speeds == speeds[:, :1], axis=1)
        self.seen[active[steady], 0] = speeds[steady, 0]
        others: Ints = active[~steady]
        return others


def _follow(search: Search, active: Ints, most: Floats, settled: _Settled) -> None:
    """Continue cases, each for at most about its allowed number of periods, until their settled means are known."""
    active = settled.look(active)
    ran = 0
    while True:
        active = active[most[active] > ran]
        if not len(active):
            return
        length = ROUND if ran else _FIRST
        search.advance(active, length, windowed=False)
        ran += length
        ended = search.endings[active] != _OK
        settled.lost(active[ended])
        active = settled.look(active[~ended])
