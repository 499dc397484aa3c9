"""States at the start of an excitation period as parameters, and that in which a case ends."""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.run import Run, SettledRun
from sprag_study.engine.vibration_drive.automaton import Clutch
from sprag_study.engine.vibration_drive.cases import case_matrix, default_of, pendulum_count, scalars, with_lengths
from sprag_study.engine.vibration_drive.integration import integrate
from sprag_study.engine.vibration_drive.kernel import kernel_of
from sprag_study.engine.vibration_drive.layout import OUT_ENDING
from sprag_study.engine.vibration_drive.settle import settle
from sprag_study.engine.vibration_drive.strobes import (
    ANGLE,
    CLUTCH,
    PENDULUM_WIDTH,
    SHAFT_SPEED,
    SHAFT_WIDTH,
    SPEED,
    TURN,
    WINDUP,
)
from sprag_study.engine.vibration_drive.sweep import whole_periods

Floats = NDArray[np.float64]


def as_parameters(row: Floats) -> dict[str, float]:
    """The initial values (SI) with which a case begins in the state ``row`` (shape (strobes.width(n),)).

    The row is one at the end of an excitation period.
    """
    values = {"shaft.initial_speed": float(row[SHAFT_SPEED])}
    for i in range((len(row) - SHAFT_WIDTH) // PENDULUM_WIDTH):
        own = row[SHAFT_WIDTH + i * PENDULUM_WIDTH :]
        values[f"pendulums.{i}.initial_angle"] = float(own[ANGLE])
        values[f"pendulums.{i}.initial_speed"] = float(own[SPEED])
        free = own[CLUTCH] == Clutch.FREE
        values[f"pendulums.{i}.initial_windup"] = 0.0 if free else float(own[WINDUP])
        values[f"pendulums.{i}.initial_clutch"] = float(own[CLUTCH])
    return values


def end_state(
    columns: Mapping[str, ArrayLike], settings: Run | SettledRun, start: Floats | None = None
) -> dict[str, float] | None:
    """The initial values (SI) that go on from the end of a case; None where it does not end ok.

    For a settled run a state of the settled motion; for a run of a given time that after its last whole period.

    Parameters
    ----------
    columns : mapping
        As for ``simulate``, scalars only.
    settings : Run or SettledRun
    start : array, shape (1, strobes.width(n)), optional
        The state from which a settled case starts, as ``starts`` of ``settle``.

    Raises
    ------
    ValueError
        If a required parameter is missing or the number of pendulums or coefficients is out of range.
    """
    values = scalars(columns)
    if isinstance(settings, SettledRun):
        found = settle(values, settings, cases=1, starts=start)
        if ENDINGS[int(found.endings[0])] is not Ending.OK:
            return None
        rows, arrived = whole_periods(values, settings, found.points)
        return as_parameters(rows[0]) if arrived[0] else None
    periods = np.floor(settings.duration.in_periods(values["excitation.frequency"]) * (1.0 + 1e-12))
    if periods < 1.0:
        n = pendulum_count(values)
        return {path: values.get(path, 0.0) for path in as_parameters(np.zeros(SHAFT_WIDTH + n * PENDULUM_WIDTH))}
    matrix = with_lengths(case_matrix(values, settings, 1), np.zeros(1), np.array([periods]), windowed=False)
    done = integrate(kernel_of(values, settings.tolerance), matrix, settings, strobes=1)
    if ENDINGS[int(done.sums[0, OUT_ENDING])] is not Ending.OK:
        return None
    row = done.strobes[0, 0]
    return as_parameters(row) | _later_phase(values, float(row[TURN]))


def _later_phase(values: Mapping[str, float], turn: float) -> dict[str, float]:
    """The phase of a cyclic load after a turn of the shaft in rad; nothing without such a load."""
    if not values.get("shaft.cyclic_load", 0.0) > 0.0:
        return {}
    cycles = values.get("shaft.load_cycles", default_of("shaft.load_cycles"))
    assert cycles is not None
    return {"shaft.load_phase": math.remainder(values.get("shaft.load_phase", 0.0) + cycles * turn, 2.0 * math.pi)}
