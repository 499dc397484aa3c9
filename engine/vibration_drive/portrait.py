"""How one case approaches its motion: the states at its strobes, and its orbit."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.outcome import Portrait, Trajectory
from sprag_study.engine.run import Run, SettledRun
from sprag_study.engine.vibration_drive.automaton import Clutch
from sprag_study.engine.vibration_drive.cases import case_matrix, pendulum_count, scalars, with_lengths
from sprag_study.engine.vibration_drive.integration import integrate
from sprag_study.engine.vibration_drive.kernel import kernel_of
from sprag_study.engine.vibration_drive.layout import OUT_ENDING
from sprag_study.engine.vibration_drive.orbits import without_turns
from sprag_study.engine.vibration_drive.regimes import Regime, settled_infos
from sprag_study.engine.vibration_drive.settle import settle
from sprag_study.engine.vibration_drive.simulate import CLUTCH_NAMES, SHAFT_NAMES
from sprag_study.engine.vibration_drive.strobes import (
    ANGLE,
    CLUTCH,
    PENDULUM_WIDTH,
    SHAFT,
    SHAFT_SPEED,
    SHAFT_WIDTH,
    SPEED,
    WINDUP,
    in_order,
)
from sprag_study.engine.vibration_drive.turn import nothing, turn

Floats = NDArray[np.float64]

#: Most strobes that are returned: the last ones of a longer run.
MAX_STROBES = 1000
#: Strobes of a settled case at least, and turns of its orbit after it is settled.
_LEAST, _TURNS = 40, 2
#: Points of an orbit per period, and the approximate maximum for a whole orbit.
_POINTS, _ALL_POINTS, _LEAST_POINTS = 400, 6000, 40


def portrait(columns: Mapping[str, ArrayLike], run: Run) -> Portrait:
    """The strobes of a run of a given time; there is no orbit.

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
    values = scalars(columns)
    frequency = values["excitation.frequency"]
    periods = int(run.duration.in_periods(frequency) * (1.0 + 1e-12))
    ending, strobes = _strobes(values, run, periods)
    return Portrait("", 0, strobes, nothing(), 0, ending)


def settled_portrait(columns: Mapping[str, ArrayLike], settings: SettledRun, start: Floats | None = None) -> Portrait:
    """The strobes of a case from its start until it is settled, and one turn of its orbit.

    For irregular or unsettled motion the strobes of the whole search are returned, without an orbit.

    Parameters
    ----------
    columns : mapping
        As for ``simulate``, scalars only.
    settings : SettledRun
    start : array, shape (1, strobes.width(n)), optional
        As ``starts`` of ``settle``, at the start of a period.

    Raises
    ------
    ValueError
        If a required parameter is missing or the number of pendulums or coefficients is out of range.
    """
    values = scalars(columns)
    found = settle(values, settings, cases=1, starts=start)
    regime, ending = Regime(int(found.regimes[0])), ENDINGS[int(found.endings[0])]
    names = [info.name for info in settled_infos(pendulum_count(values))]
    row = dict(zip(names, found.values[0].tolist(), strict=True))
    order = int(found.orders[0])
    run = settings.run
    periods = settings.at_most
    if regime.repeats and row["regime.settled_after"] < periods:
        periods = min(periods, max(_LEAST, int(np.ceil(row["regime.settled_after"])) + _TURNS * order))
    _, strobes = _strobes(values, run, periods, start, found.windings != 0)
    if not order:
        return Portrait(regime.name.lower() if regime else "", 0, strobes, nothing(), 0, ending)
    each = max(_LEAST_POINTS, min(_POINTS, _ALL_POINTS // order))
    orbit = turn(values, run, found.points, order, each)
    return Portrait(regime.name.lower(), order, strobes, orbit, each, ending)


def _strobes(
    values: Mapping[str, float],
    run: Run,
    periods: int,
    start: Floats | None = None,
    turns_over: NDArray[np.bool_] | None = None,
) -> tuple[Ending, Trajectory]:
    """How the case ends, and its last strobes; angles of pendulums that turn over (shape (1, pendulums)) are between
    -pi and pi.
    """
    n = pendulum_count(values)
    matrix = with_lengths(case_matrix(values, run, 1), np.zeros(1), np.array([float(periods)]), windowed=False)
    kept = min(periods, MAX_STROBES)
    done = integrate(kernel_of(values, run.tolerance), matrix, run, starts=start, strobes=kept)
    ending = ENDINGS[int(done.sums[0, OUT_ENDING])]
    # A run that did not end ok has no more than its first strobes.
    last = in_order(done.strobes, np.array([periods])) if kept else done.strobes
    if turns_over is not None:
        without_turns(last, turns_over)
    rows = last[0]
    told = ~np.isnan(rows[:, SHAFT])
    rows, numbers = rows[told], np.arange(periods - kept, periods)[told]
    names, units, columns = ["shaft.speed"], ["rad/s"], [rows[:, SHAFT_SPEED]]
    states = {"shaft": [SHAFT_NAMES[int(state)] for state in rows[:, SHAFT]]}
    for i in range(n):
        own = rows[:, SHAFT_WIDTH + i * PENDULUM_WIDTH :]
        names += [f"pendulums.{i}.{name}" for name in ("angle", "speed", "windup")]
        units += ["rad", "rad/s", "rad"]
        windup = np.where(own[:, CLUTCH] >= Clutch.ENGAGED, own[:, WINDUP], 0.0)
        columns += [own[:, ANGLE], own[:, SPEED], windup]
        states[f"pendulums.{i}"] = [CLUTCH_NAMES[int(state)] for state in own[:, CLUTCH]]
    times = (numbers + 1) / values["excitation.frequency"]
    return ending, Trajectory(times, tuple(names), tuple(units), np.column_stack(columns), states, ending)
