"""The settled motion of a case at once is what its results, its portrait and its end state are apart."""

from __future__ import annotations

import numpy as np
import pytest

from sprag_study.engine.endings import Ending
from sprag_study.engine.run import SettledRun
from sprag_study.engine.vibration_drive.portrait import settled_portrait
from sprag_study.engine.vibration_drive.regimes import Regime, settled_infos
from sprag_study.engine.vibration_drive.settle import settle
from sprag_study.engine.vibration_drive.start_states import end_state
from sprag_study.engine.vibration_drive.turn import SettledTurn, settled_turn
from tests.engine.vibration_drive.drive import Columns, drive

#: 25 Hz and 0.2 N*m: a motion of order 2, whose strobes are moved.
TWO = drive(excitation__frequency=25.0, shaft__load=0.2)


def _result(found: SettledTurn, name: str) -> float:
    return float(found.values[[info.name for info in settled_infos(1)].index(name)])


@pytest.mark.parametrize(("machine", "regime"), [(TWO, Regime.PERIODIC), (TWO | {"shaft.load": 0.0}, Regime.COASTING)])
def test_one_search_gives_results_orbit_and_state(machine: Columns, regime: Regime) -> None:
    found = settled_turn(machine, SettledRun(), 800)
    batch = settle(machine, SettledRun(), cases=1)
    np.testing.assert_array_equal(found.values, batch.values[0])
    assert (found.regime, found.ending) == (regime, Ending.OK)
    orbit = settled_portrait(machine, SettledRun()).orbit
    assert found.motion.times[-1] == pytest.approx(orbit.times[-1], rel=1e-15)
    assert found.motion.values[-1] == pytest.approx(orbit.values[-1], rel=1e-9, abs=1e-12)
    assert found.state == end_state(machine, SettledRun())


def test_the_state_goes_on_with_the_same_motion() -> None:
    found = settled_turn(TWO, SettledRun(), 100)
    assert found.state is not None
    after = settled_turn({**TWO, **found.state}, SettledRun(), 100)
    assert (after.regime, after.order) == (found.regime, found.order) == (Regime.PERIODIC, 2)
    assert _result(after, "shaft.speed.mean") == pytest.approx(_result(found, "shaft.speed.mean"), rel=1e-8)
    # The first strobes that are looked at are on the orbit.
    assert _result(after, "regime.settled_after") < _result(found, "regime.settled_after")


def test_a_motion_without_an_orbit_is_shown_for_four_periods() -> None:
    found = settled_turn(drive(excitation__frequency=31.5, shaft__load=0.04), SettledRun(at_most=100), 100)
    assert not found.regime.repeats
    assert (found.order, found.motion.times.size) == (0, 101)
    assert found.state is not None


def test_a_case_that_fails_has_no_motion() -> None:
    found = settled_turn(TWO, SettledRun(max_events_per_period=1), 100)
    assert found.ending is Ending.CHATTER
    assert (found.motion.times.size, found.state) == (0, None)
