"""Sweeps: every case starts from the settled motion of its neighbour."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.workloads import W1
from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.run import SettledRun
from sprag_study.engine.vibration_drive.engagements import tables_of
from sprag_study.engine.vibration_drive.examined import examined_settled
from sprag_study.engine.vibration_drive.portrait import settled_portrait
from sprag_study.engine.vibration_drive.regimes import Regime, settled_infos
from sprag_study.engine.vibration_drive.settle import SettledBatch, settle
from sprag_study.engine.vibration_drive.simulate import trajectory
from sprag_study.engine.vibration_drive.start_states import end_state
from sprag_study.engine.vibration_drive.strobes import ANGLE, BEGIN, FRACTION, SHAFT_SPEED, SHAFT_WIDTH, continued
from sprag_study.engine.vibration_drive.sweep import Begun, sweep, whole_periods

NAMES = [info.name for info in settled_infos(1)]
#: At 16.475 Hz the drive has two motions: one reached from below and from rest, the other from above.
FREQUENCIES = np.array([16.0, 16.475, 16.95, 17.425])
UP, DOWN = np.array([[0, 1, 2, 3]]), np.array([[3, 2, 1, 0]])


def _columns(frequencies: NDArray[np.float64], amplitude: float = 2e-3, load: float = 0.4) -> dict[str, Any]:
    return {
        **W1.columns(np.array([0])),
        "excitation.frequency": frequencies,
        "excitation.amplitude_x": amplitude,
        "excitation.amplitude_y": amplitude,
        "shaft.load": load,
    }


def _speeds(batch: SettledBatch) -> NDArray[np.float64]:
    return batch.values[:, NAMES.index("shaft.speed.mean")]


def _case(columns: dict[str, Any], case: int) -> dict[str, float]:
    return {path: float(np.asarray(column)[case]) if np.ndim(column) else column for path, column in columns.items()}


def test_the_direction_of_a_sweep_decides_between_two_motions() -> None:
    columns = _columns(FREQUENCIES)
    up, down = (sweep(columns, SettledRun(), lines) for lines in (UP, DOWN))
    rest = settle(columns, SettledRun(), cases=4)
    assert _speeds(up.batch)[1] == pytest.approx(0.3844941463, abs=1e-9)
    assert _speeds(down.batch)[1] == pytest.approx(0.5579460807, abs=1e-9)
    assert _speeds(rest)[1] == pytest.approx(0.3844941463, abs=1e-9)
    others = [0, 2, 3]
    np.testing.assert_allclose(_speeds(up.batch)[others], _speeds(down.batch)[others], rtol=1e-9)
    assert up.begun.tolist() == [Begun.FIRST, *[Begun.ON_ORBIT] * 3]
    assert down.begun.tolist() == [*[Begun.ON_ORBIT] * 3, Begun.FIRST]
    assert up.jumped.tolist() == [False, False, True, False]
    assert down.jumped.tolist() == [True, False, False, False]
    # The first of a line is a case from rest, to the bit.
    assert up.batch.values[0].tobytes() == rest.values[0].tobytes()


def test_a_case_continues_the_state_of_its_neighbour() -> None:
    found = sweep(_columns(FREQUENCIES), SettledRun(), DOWN)
    np.testing.assert_array_equal(found.starts[1], continued(found.batch.points[2:3])[0])
    again = settle(_columns(FREQUENCIES[1:2]), SettledRun(), cases=1, starts=found.starts[1:2])
    assert again.values.tobytes() == found.batch.values[1:2].tobytes()
    run_up = NAMES.index("runup.time")
    assert np.isfinite(found.batch.values[3, run_up])
    assert np.isnan(found.batch.values[:3, run_up]).all()


def test_a_narrowed_jump_is_that_of_a_finer_sweep_and_of_a_sweep_by_hand() -> None:
    steps, path = 16, "excitation.frequency"
    coarse = FREQUENCIES[:3]
    narrowed = np.union1d(coarse, np.linspace(coarse[0], coarse[1], steps + 1))
    down = np.arange(narrowed.size)[None, ::-1]
    found = sweep(_columns(narrowed), SettledRun(), down, path)
    (jump,) = np.flatnonzero(found.jumped)
    told = narrowed[jump : jump + 2]
    assert told[1] - told[0] == pytest.approx(0.475 / steps)
    # A sweep whose steps are so small everywhere jumps in the same one.
    every = np.union1d(np.linspace(coarse[0], coarse[1], steps + 1), np.linspace(coarse[1], coarse[2], steps + 1))
    finer = sweep(_columns(every), SettledRun(), np.arange(every.size)[None, ::-1], path)
    (same,) = np.flatnonzero(finer.jumped)
    assert every[same : same + 2].tolist() == told.tolist()
    # By hand: from the end of the case before the jump, through the same values.
    state = end_state(_case(_columns(narrowed), steps), SettledRun(), found.starts[steps : steps + 1])
    assert state is not None
    by_hand = sweep(_columns(narrowed[:steps]) | state, SettledRun(), down[:, 2:], path)
    others = [k for k, name in enumerate(NAMES) if not name.startswith(("runup", "regime.settled_after"))]
    assert by_hand.batch.values[:, others].tobytes() == found.batch.values[:steps, others].tobytes()
    assert np.flatnonzero(by_hand.jumped).tolist() == [jump]


def test_a_larger_step_after_smaller_ones_is_no_jump() -> None:
    # Between 20 and 20.6 Hz the motion does not jump; orbits a large step apart are far apart compared with those
    # of the small steps before.
    frequencies = np.array([*np.linspace(20.0, 20.05, 6), *np.linspace(20.2, 20.6, 3)])
    columns, up = _columns(frequencies), np.arange(frequencies.size)[None, :]
    assert not sweep(columns, SettledRun(), up, "excitation.frequency").jumped.any()
    assert sweep(columns, SettledRun(), up).jumped.any()


def test_a_line_has_the_same_bits_beside_others() -> None:
    both = sweep(_columns(np.tile(FREQUENCIES, 2)), SettledRun(), np.vstack([UP, 4 + DOWN]))
    for own, cases in ((UP, slice(4)), (DOWN, slice(4, 8))):
        alone = sweep(_columns(FREQUENCIES), SettledRun(), own)
        assert both.batch.values[cases].tobytes() == alone.batch.values.tobytes()
        assert both.batch.points[cases].tobytes() == alone.batch.points.tobytes()


def test_motion_engagements_and_portrait_of_a_start_are_those_of_its_row() -> None:
    columns, settings = _columns(FREQUENCIES), SettledRun()
    found = sweep(columns, settings, DOWN)
    own, start = _case(columns, 1), found.starts[1:2]
    period = 1.0 / FREQUENCIES[1]
    turned = trajectory(own, settings.run, np.array([0.0, 400.0 * period, 600.0 * period]), start)
    angle = turned.values[:, turned.names.index("shaft.angle")]
    assert (angle[2] - angle[1]) / (200.0 * period) == pytest.approx(0.5579460807, rel=1e-6)
    assert turned.values[0, turned.names.index("shaft.speed")] == pytest.approx(start[0, SHAFT_SPEED], abs=1e-12)
    means = tables_of(examined_settled(own, settings, start)).periods
    assert np.mean([mean.speed_mean for mean in means]) == pytest.approx(0.5579460807, abs=1e-7)
    portrait = settled_portrait(own, settings, start)
    assert portrait.order == found.batch.values[1, NAMES.index("regime.order")]
    # The first strobe is a period after the start, which is near the orbit.
    last, first = (portrait.strobes.values[row, portrait.strobes.names.index("pendulums.0.angle")] for row in (-1, 0))
    assert first == pytest.approx(last, abs=0.02)


def test_past_irregular_motion_a_line_goes_on_from_an_arbitrary_state() -> None:
    columns = _columns(np.array([34.525, 34.05]), 1e-3, 0.1)
    found = sweep(columns, SettledRun(), np.array([[0, 1]]))
    assert found.batch.regimes[0] == Regime.IRREGULAR
    assert found.begun.tolist() == [Begun.FIRST, Begun.ARBITRARY]
    assert not found.jumped.any()
    # The strobes of the search lie within the period; the next case begins with a whole one.
    assert found.batch.points[0, BEGIN] == 0.375
    starts, arrived = whole_periods(_case(columns, 0), SettledRun(), found.batch.points[:1])
    assert arrived.all()
    np.testing.assert_array_equal(found.starts[1:], starts)


def test_after_a_case_that_fails_a_line_begins_anew() -> None:
    columns = _columns(np.array([25.0, 25.0])) | {
        "excitation.amplitude_x": np.array([2e-3, 0.0]),
        "excitation.amplitude_y": np.array([2e-3, 0.0]),
    }
    settings = SettledRun(max_events_per_period=1)
    found = sweep(columns, settings, np.array([[0, 1]]))
    assert ENDINGS[found.batch.endings[0]] is Ending.CHATTER
    assert found.begun.tolist() == [Begun.FIRST, Begun.AGAIN]
    rest = settle(_case(columns, 1), settings, cases=1)
    assert found.batch.values[1].tobytes() == rest.values[0].tobytes()


def test_states_within_the_period_are_carried_on_to_its_end() -> None:
    columns, settings = _columns(np.array([25.0]), 2e-3, 0.2), SettledRun()
    at_end = settle(columns, settings, cases=1)
    order = int(at_end.values[0, NAMES.index("regime.order")])
    times = (np.arange(order) + 0.375) / 25.0
    inside = trajectory(_case(columns, 0), settings.run, times, continued(at_end.points))
    moved = continued(at_end.points)
    moved[:, FRACTION] = moved[:, BEGIN] = 0.375
    moved[0, SHAFT_SPEED] = inside.values[0, inside.names.index("shaft.speed")]
    for k, name in ((ANGLE, "angle"), (ANGLE + 1, "speed"), (ANGLE + 2, "windup")):
        moved[0, SHAFT_WIDTH + k] = inside.values[0, inside.names.index(f"pendulums.0.{name}")]
    free = inside.states["pendulums.0"][0] == "free" and inside.states["shaft"][0] == "rotating"
    assert free, "the test needs states that are given by the numbers alone"
    moved[0, SHAFT_WIDTH + 3] = 0.0
    moved[0, 4] = 1.0
    starts, arrived = whole_periods(columns, settings, moved)
    assert arrived.all()
    assert (starts[0, FRACTION], starts[0, BEGIN]) == (1.0, 0.0)
    again = settle(columns, settings, cases=1, starts=starts)
    np.testing.assert_allclose(_speeds(again), _speeds(at_end), rtol=1e-9)
    # A search that is given the state as it is has its strobes at the ends of the periods, too.
    direct = settle(columns, settings, cases=1, starts=continued(moved))
    assert direct.points[0, FRACTION] == 1.0
    np.testing.assert_allclose(_speeds(direct), _speeds(at_end), rtol=1e-9)


def test_starts_and_lines_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ValueError, match="starts must be finite numbers in the shape"):
        settle(_columns(FREQUENCIES), SettledRun(), cases=4, starts=np.zeros((3, 10)))
    with pytest.raises(ValueError, match="starts must be finite numbers in the shape"):
        settle(_columns(FREQUENCIES), SettledRun(), cases=4, starts=np.full((4, 10), np.nan))
    with pytest.raises(ValueError, match="every case exactly once"):
        sweep(_columns(FREQUENCIES), SettledRun(), np.array([[0, 1, 2, 2]]))
