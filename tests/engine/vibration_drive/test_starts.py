"""Coexisting motions: distinguished by their orbits at equal phase, with their shares."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.stats import binomtest

from benchmarks.workloads import W1
from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.run import SettledRun
from sprag_study.engine.vibration_drive import starts as module
from sprag_study.engine.vibration_drive.regimes import Regime
from sprag_study.engine.vibration_drive.same_motions import Motions
from sprag_study.engine.vibration_drive.start_results import started_infos
from sprag_study.engine.vibration_drive.starts import StartedBatch, basin, settle_starts, started_columns, wilson
from sprag_study.engine.vibration_drive.strobes import SHAFT_SPEED

NAMES = [info.name for info in started_infos(1)]
ANGLE = "pendulums.0.initial_angle"
#: An upright pendulum that its spring does not hold up falls to either side; nothing turns the shaft.
TWO_WELLS: dict[str, Any] = {
    **W1.columns(np.array([0])),
    "excitation.frequency": 10.0,
    "excitation.amplitude_x": 1e-3,
    "excitation.amplitude_y": 0.0,
    "pendulums.0.spring_rate": 20.0,
    "pendulums.0.backlash": 10.0,
    "shaft.load": 0.3,
    ANGLE: -0.4,
}
#: Settles to an orbit of two periods.
PERIOD_TWO = {
    **W1.columns(np.array([0])),
    "excitation.frequency": 25.0,
    "excitation.amplitude_x": 2e-3,
    "excitation.amplitude_y": 2e-3,
    "shaft.load": 0.2,
}


def _rows(batch: StartedBatch, case: int = 0) -> list[dict[str, float]]:
    rows = [batch.values[case], *batch.further_values[batch.further == case]]
    return [dict(zip(NAMES, row.tolist(), strict=True)) for row in rows]


def test_motions_of_one_mean_speed_are_told_apart() -> None:
    angles = np.array([0.2, 0.3, 0.5, -0.1])
    batch = settle_starts(TWO_WELLS, SettledRun(), {ANGLE: angles}, cases=1)
    first, second = _rows(batch)
    assert first["shaft.speed.mean"] == second["shaft.speed.mean"] == 0.0
    assert first["regime"] == second["regime"] == Regime.HELD
    assert first["pendulums.0.angle.mean"] == pytest.approx(-second["pendulums.0.angle.mean"], rel=1e-6)
    # The most frequent first: start 0 is the case's own, and falls to the other side.
    assert batch.members.tolist() == [[1, 0, 0, 0, 1]]
    assert [row["regime.number"] for row in (first, second)] == [0, 1]
    assert [row["regime.count"] for row in (first, second)] == [2, 2]
    assert [row["regime.share"] for row in (first, second)] == [0.6, 0.4]
    assert [row["regime.share.least"] for row in (first, second)] == [0.4, 0.4]
    assert [row["regime.start"] for row in (first, second)] == [1, 0]
    assert [row["starts.failed"] for row in (first, second)] == [0, 0]


def test_copies_of_an_orbit_a_period_apart_are_one_regime() -> None:
    starts = {"shaft.initial_speed": np.linspace(2.0, 30.0, 7)}
    batch = settle_starts(PERIOD_TWO, SettledRun(), starts, cases=1)
    (row,) = _rows(batch)
    assert row["regime.order"] == 2
    assert row["regime.share"] == 1.0
    spread = started_columns(PERIOD_TWO, starts, 8, 1)
    points = module.settle(spread, SettledRun(), cases=8).points
    # Some of them are at the other strobe of the orbit.
    assert np.ptp(points[:, SHAFT_SPEED]) > 0.1


def test_starts_without_an_orbit_are_run_longer_before_they_count_as_another_motion(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    starts = {"shaft.initial_speed": np.linspace(2.0, 30.0, 7)}
    drive = {**PERIOD_TWO, "shaft.load": 0.22}
    # After 160 periods two starts are on the orbit, after 640 four; the last ones take a thousand.
    arrived = [
        (module.settle(started_columns(drive, starts, 8, 1), SettledRun(at_most=periods), cases=8).regimes == 1).sum()
        for periods in (160, 640)
    ]
    assert arrived == [2, 4]
    batch = settle_starts(drive, SettledRun(at_most=160), starts, cases=1)
    (row,) = _rows(batch)
    assert (row["regime"], row["regime.order"], row["regime.share"]) == (Regime.PERIODIC, 2, 1.0)
    monkeypatch.setattr(module, "PERIODS_TOGETHER", 2000)
    apart = settle_starts(drive, SettledRun(at_most=160), starts, cases=1)
    assert apart.values.tobytes() == batch.values.tobytes()


def test_irregular_motions_are_distinguished_by_their_means() -> None:
    batch = settle_starts(W1.columns(np.array([385])), SettledRun(), {"shaft.initial_speed": [15.0]}, cases=1)
    rows = _rows(batch)
    assert [row["regime"] for row in rows] == [Regime.IRREGULAR] * 2
    assert [row["shaft.speed.mean"] for row in rows] == pytest.approx([6.202, 6.292], abs=0.01)


def test_orbits_that_repeat_for_ever_alike_are_one_whatever_their_orders() -> None:
    motions = Motions.__new__(Motions)
    a, b = [1.0, 0.1, 2.0], [1.5, 0.2, -2.0]
    sequences = ([a, b], [a], [b, a, b, a], [a, a], [a, b, b, a])
    motions.orders = np.array([len(sequence) for sequence in sequences])
    motions.strobes = np.array([(sequence * 4)[:4] for sequence in sequences])
    motions.kinds, motions.nu = np.full(5, Regime.PERIODIC), np.full(5, 100.0)
    motions.turns_over = np.zeros((5, 1), dtype=np.bool_)
    lanes = np.arange(5)
    assert motions._on_orbit(lanes, 0).tolist() == [True, False, True, False, False]
    assert motions._on_orbit(lanes, 1).tolist() == [False, True, False, True, False]


def test_rest_is_one_regime_whatever_its_order() -> None:
    still = {**TWO_WELLS, "excitation.amplitude_x": 0.0}
    batch = settle_starts(still, SettledRun(), {ANGLE: np.array([0.2, 0.3, 0.5, -0.1])}, cases=1)
    assert batch.members.tolist() == [[1, 0, 0, 0, 1]]


def test_starts_that_fail_belong_to_no_regime_and_count_in_the_shares() -> None:
    starts = {"pendulums.0.initial_speed": np.array([0.0, 1e30])}
    batch = settle_starts(TWO_WELLS, SettledRun(), starts, cases=1)
    (row,) = _rows(batch)
    assert batch.members.tolist() == [[0, 0, -1]]
    assert ENDINGS[batch.endings[0]] is Ending.OK
    assert row["regime.share"] == pytest.approx(2.0 / 3.0)
    ends = binomtest(2, 3).proportion_ci(method="wilson")
    assert (row["regime.share.low"], row["regime.share.high"]) == pytest.approx((ends.low, ends.high), abs=1e-12)
    assert row["starts.failed"] == 1


def test_a_case_is_the_same_in_any_batch(monkeypatch: pytest.MonkeyPatch) -> None:
    columns = {**TWO_WELLS, "shaft.load": np.array([0.1, 0.2, 0.3]), ANGLE: np.array([-0.4, 0.4, 0.1])}
    starts = {ANGLE: np.array([0.2, -0.3, 0.4]), "pendulums.0.initial_speed": np.array([0.0, 1.0, -1.0])}
    together = settle_starts(columns, SettledRun(), starts, cases=3)
    monkeypatch.setattr(module, "TOGETHER", 5)
    apart = settle_starts(columns, SettledRun(), starts, cases=3)
    for name in StartedBatch.__slots__:
        assert getattr(together, name).tobytes() == getattr(apart, name).tobytes(), name
    assert together.further.tolist() == [0, 1, 2]


@pytest.mark.parametrize(("reached", "starts"), [(0, 7), (3, 7), (7, 7), (12, 256), (256, 256)])
def test_shares_have_the_intervals_of_wilson(reached: int, starts: int) -> None:
    low, high = wilson(reached, starts)
    exact = binomtest(reached, starts).proportion_ci(method="wilson")
    assert (float(low), float(high)) == pytest.approx((exact.low, exact.high), abs=1e-12)
    assert low <= reached / starts <= high


def test_starts_of_different_numbers_are_refused() -> None:
    with pytest.raises(ValueError, match="same number"):
        settle_starts(TWO_WELLS, SettledRun(), {ANGLE: [0.1], "shaft.initial_speed": [1.0, 2.0]}, cases=1)


def test_a_basin_has_the_regime_of_every_start_of_its_grid() -> None:
    x, y = np.array([-0.4, 0.3]), np.array([-1.0, 0.0, 1.0])
    found = basin(TWO_WELLS, SettledRun(), (ANGLE, "pendulums.0.initial_speed"), x, y)
    # Slow starts fall to the side on which they begin.
    assert found.members[1].tolist() == [1 - found.members[1, 1], found.members[1, 1]]
    single = [
        settle_starts(TWO_WELLS, SettledRun(), {ANGLE: [angle], "pendulums.0.initial_speed": [speed]}, cases=1)
        for speed in y
        for angle in x
    ]
    # The case's own start, at -0.4 rad, beside each start of the grid.
    alike = [batch.members[0, 0] == batch.members[0, 1] for batch in single]
    assert (found.members == found.members[1, 0]).reshape(-1).tolist() == alike
    shares = found.values[:, found.names.index("regime.share")]
    assert shares.tolist() == [np.mean(found.members == k) for k in range(len(shares))]
