"""What makes an orbit count: its multiplier, equal states at the strobe, the least order. Each refuses what it must."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.workloads import W1
from sprag_study.engine.run import Run, SettledRun
from sprag_study.engine.vibration_drive import newton, orbits, search
from sprag_study.engine.vibration_drive.automaton import Clutch, Shaft
from sprag_study.engine.vibration_drive.cases import case_matrix
from sprag_study.engine.vibration_drive.kernel import kernel, lane_count, order_for
from sprag_study.engine.vibration_drive.strobes import (
    ANGLE,
    CLUTCH,
    FALLS,
    SHAFT,
    SHAFT_SPEED,
    SHAFT_WIDTH,
    SPEED,
    TURN,
    WINDUP,
    width,
)

ONE = np.zeros(1, dtype=np.int64)
#: A drive that stays near an unstable orbit of order 1 for a hundred periods, and settles to one of order 2.
DRIVE: dict[str, Any] = {
    **W1.columns(ONE),
    "excitation.frequency": 25.0,
    "excitation.amplitude_x": 2e-3,
    "excitation.amplitude_y": 2e-3,
    "shaft.load": 0.2,
}


def _search(periods: int) -> search.Search:
    """That drive after so many periods from rest."""
    module = kernel(1, 4, order_for(1e-9), lane_count())
    found = search.Search(module, case_matrix(DRIVE, Run(), 1), SettledRun())
    found.advance(ONE, periods, windowed=False)
    return found


def _certify(found: search.Search, order: int) -> search.Orbits:
    return found.certify(ONE, found.starts[ONE], np.array([order]), found.units(ONE))


def test_an_unstable_orbit_does_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    found = _search(60)
    assert not len(_certify(found, 1).cases)
    # Its multiplier alone speaks against it.
    monkeypatch.setattr(search, "STABLE", math.inf)
    orbit = _certify(found, 1)
    assert orbit.multipliers[0] == pytest.approx(1.0807, abs=1e-4)
    assert orbit.residuals[0] < search.RESIDUAL


def test_the_order_is_the_least(monkeypatch: pytest.MonkeyPatch) -> None:
    found = _search(400)
    once, twice = _certify(found, 2), _certify(found, 4)
    assert (once.least[0], twice.orders[0], twice.least[0]) == (2, 4, 2)
    assert twice.multipliers[0] == pytest.approx(once.multipliers[0] ** 2, abs=1e-6)

    def of_order_4(*arguments: Any) -> None:
        arguments[-1][:] = 4

    monkeypatch.setattr(orbits, "find_candidates", of_order_4)
    orbit = found.look(ONE)
    assert orbit.orders.tolist() == [2]
    assert orbit.multipliers[0] == pytest.approx(0.8192, abs=1e-4)


def _strobe() -> NDArray[np.float64]:
    """A state of one pendulum whose clutch transmits torque, shape (1, columns)."""
    row = np.zeros((1, width(1)))
    row[0, SHAFT_SPEED], row[0, TURN], row[0, SHAFT] = 20.0, 3.0, Shaft.ROTATING
    row[0, SHAFT_WIDTH + ANGLE], row[0, SHAFT_WIDTH + SPEED] = 0.1, 25.0
    row[0, SHAFT_WIDTH + WINDUP], row[0, SHAFT_WIDTH + CLUTCH] = 0.01, Clutch.ENGAGED
    return row


@pytest.mark.parametrize(
    ("column", "state"),
    [(SHAFT, Shaft.HELD), (SHAFT_WIDTH + CLUTCH, Clutch.FREE), (SHAFT_WIDTH + FALLS, 1.0)],
    ids=["shaft", "clutch", "literal reset"],
)
def test_strobes_of_other_states_are_not_the_same(column: int, state: float) -> None:
    one, other, apart = _strobe(), _strobe(), np.empty(1)
    units = np.ones_like(one)
    other[0, TURN] = 5.0  # the shaft's angle does not belong to its state
    orbits.distances(one, other, units, np.zeros((1, 1), dtype=np.bool_), apart)
    assert apart[0] == 0.0
    other[0, column] = state
    orbits.distances(one, other, units, np.zeros((1, 1), dtype=np.bool_), apart)
    assert apart[0] == math.inf
    # A derivative across a change of states tells nothing: no disturbed run may end in others.
    starts, first = np.empty((5, one.shape[1])), np.zeros(2, dtype=np.int64)
    assert newton.disturb(one, units, 1e-7, False, starts, first) == 5
    ends, moved, told = one + 0.5 * (starts - one), np.empty_like(one), np.empty((1, 4))
    tied = np.zeros((1, 1), dtype=np.bool_)
    newton.step(one, ends, first, units, 1e-7, False, tied, ONE[None], moved, told)
    assert told[0].tolist() == pytest.approx([0.0, 0.0, 0.5, 1.0])
    ends[3, column] = state
    newton.step(one, ends, first, units, 1e-7, False, tied, ONE[None], moved, told)
    assert told[0].tolist() == [math.inf, math.inf, math.inf, 0.0]


def test_an_orbit_far_from_the_run_does_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    found = _search(140)
    assert not len(_certify(found, 2).cases)
    monkeypatch.setattr(search, "AWAY", math.inf)
    assert _certify(found, 2).multipliers[0] == pytest.approx(0.8192, abs=1e-4)
