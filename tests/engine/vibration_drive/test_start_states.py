"""Any state at a strobe can be given as parameters, and a case can go on from the end of another."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from benchmarks.workloads import W1
from sprag_study.engine.run import Run, SettledRun, Span
from sprag_study.engine.vibration_drive.automaton import Clutch, Shaft
from sprag_study.engine.vibration_drive.cases import case_matrix
from sprag_study.engine.vibration_drive.integration import integrate
from sprag_study.engine.vibration_drive.kernel import kernel_of
from sprag_study.engine.vibration_drive.settle import settle
from sprag_study.engine.vibration_drive.start_states import as_parameters, end_state
from sprag_study.engine.vibration_drive.strobes import TURN

COLUMNS: dict[str, Any] = {
    **W1.columns(np.array([0])),
    "excitation.frequency": 25.0,
    "excitation.amplitude_x": 2e-3,
    "excitation.amplitude_y": 2e-3,
    "shaft.load": 0.2,
}


def _strobes(columns: dict[str, Any], run: Run, starts: Any = None) -> Any:
    matrix = case_matrix(columns, run, 1)
    return integrate(kernel_of(columns, run.tolerance), matrix, run, starts=starts, strobes=3).strobes[0]


@pytest.mark.parametrize(
    ("state", "windup", "speed", "reset"),
    [
        (Clutch.FREE, 0.0, -5.0, "contact"),
        (Clutch.TAKE_UP, -0.002, 25.0, "contact"),
        (Clutch.ENGAGED, 0.01, 25.0, "contact"),
        (Clutch.ENGAGED, 0.01, 25.0, "literal"),
        (Clutch.ENGAGED, 0.01, 15.0, "literal"),
        (Clutch.LOCKED, 0.0, 20.0, "contact"),
    ],
)
def test_a_state_given_as_parameters_goes_on_like_the_state(
    state: Clutch, windup: float, speed: float, reset: Any
) -> None:
    run = Run(duration=Span(3.0), reset=reset)
    falls = float(reset == "literal" and speed > 20.0)
    own = [0.05, speed, -0.005 if state is Clutch.FREE else windup, float(state), falls]
    row = np.array([[1.0, 0.0, 20.0, 0.0, float(Shaft.ROTATING), *own]])
    given = {**COLUMNS, **as_parameters(row[0])}
    assert given["pendulums.0.initial_clutch"] == state
    np.testing.assert_array_equal(_strobes(given, run), _strobes(COLUMNS, run, row))
    if state in {Clutch.TAKE_UP, Clutch.ENGAGED}:
        as_free = {**given, "pendulums.0.initial_clutch": 0.0}
        assert not np.array_equal(_strobes(as_free, run), _strobes(given, run))


def test_a_case_goes_on_from_the_end_of_a_settled_one() -> None:
    state = end_state(COLUMNS, SettledRun())
    assert state is not None
    here, again = (settle({**COLUMNS, **more}, SettledRun(), cases=1) for more in ({}, state))
    np.testing.assert_allclose(again.values[0, 0], here.values[0, 0], rtol=1e-9)
    # From rest it passes an unstable orbit first.
    assert again.spent[0] < 0.5 * here.spent[0]


def test_a_case_goes_on_from_the_last_whole_period_of_a_timed_one() -> None:
    state = end_state(COLUMNS, Run(duration=Span(2.4)))
    assert state is not None
    three, one = _strobes(COLUMNS, Run(duration=Span(3.0))), _strobes({**COLUMNS, **state}, Run(duration=Span(1.0)))
    keep = np.arange(three.shape[1]) != TURN
    np.testing.assert_allclose(one[0, keep], three[2, keep], rtol=1e-12)


def test_there_is_no_end_of_a_case_that_fails() -> None:
    assert end_state({**COLUMNS, "pendulums.0.initial_speed": 1e30}, SettledRun()) is None
