"""Orbits that runs approach slowly: they are found, and their results are as exact as others."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.settled import deviations, random_drives
from benchmarks.workloads import W2
from sprag_study.engine.run import Run, SettledRun, Span
from sprag_study.engine.vibration_drive import orbits
from sprag_study.engine.vibration_drive.automaton import Shaft
from sprag_study.engine.vibration_drive.cases import case_matrix, pendulum_count, with_lengths
from sprag_study.engine.vibration_drive.characteristics import characteristics
from sprag_study.engine.vibration_drive.integration import integrate
from sprag_study.engine.vibration_drive.kernel import kernel_of
from sprag_study.engine.vibration_drive.regimes import Regime, settled_infos
from sprag_study.engine.vibration_drive.results import result_infos
from sprag_study.engine.vibration_drive.settle import SettledBatch, settle
from sprag_study.engine.vibration_drive.simulate import simulate
from sprag_study.engine.vibration_drive.strobes import BEGIN, SHAFT, SHAFT_SPEED, width

Floats = NDArray[np.float64]


def _some(columns: dict[str, Any], chosen: list[int]) -> dict[str, Any]:
    return {path: value[chosen] if isinstance(value, np.ndarray) else value for path, value in columns.items()}


def _drives(pendulums: int, chosen: list[int]) -> dict[str, Any]:
    return _some(random_drives(300, pendulums, seed=pendulums), chosen)


def _column(batch: SettledBatch, pendulums: int, name: str) -> Floats:
    values: Floats = batch.values[:, [info.name for info in settled_infos(pendulums)].index(name)]
    return values


@pytest.mark.parametrize(
    ("columns", "order", "speed"),
    [
        # The multiplier is near -1: strobes repeat after two periods, but the orbit is of order 1, and not yet near.
        (_drives(1, [113]), 1, 14.397358057193),
        (_drives(1, [236]), 1, 2.5050213976507),
        (_drives(1, [213]), 5, 0.12488784812071),
        # The period has doubled by little: strobes also nearly repeat after half of it.
        (_drives(2, [18]), 4, 49.748840496903),
        (W2.columns(np.array([315])), 2, 94.914361948503),
    ],
    ids=["turning", "turning fast", "order 5", "doubled twice", "doubled"],
)
def test_a_motion_that_settles_slowly_is_found(columns: dict[str, Any], order: int, speed: float) -> None:
    """The speeds are those after 20,000 periods."""
    batch, n = settle(columns, SettledRun(), cases=1), pendulum_count(columns)
    assert Regime(int(batch.regimes[0])) is Regime.PERIODIC
    assert _column(batch, n, "regime.order")[0] == order
    assert _column(batch, n, "shaft.speed.mean")[0] == pytest.approx(speed, rel=1e-9)


@pytest.mark.parametrize("columns", [W2.columns(np.array([377])), _drives(2, [64])], ids=["slow", "small losses"])
def test_results_are_those_of_a_long_run_with_smaller_steps(columns: dict[str, Any]) -> None:
    """Where errors of a turn are amplified, and where the steps of the turn alone are too long."""
    batch, n, fine = settle(columns, SettledRun(), cases=1), pendulum_count(columns), Run(tolerance=1e-13)
    order = _column(batch, n, "regime.order")
    module, matrix, begin = kernel_of(columns, 1e-9), case_matrix(columns, fine, 1), batch.points[:, BEGIN]
    lengths = with_lengths(matrix, begin, np.array([3000.0]), windowed=False)
    ends = integrate(module, lengths, fine, starts=batch.points, strobes=1).strobes[:, -1]
    lengths = with_lengths(matrix, begin, order, windowed=True)
    sums = integrate(module, lengths, fine, starts=np.ascontiguousarray(ends)).sums
    off, names = deviations(batch.values, characteristics(module.LAYOUT, lengths, sums), n)
    assert off.max() < 0.2, names[int(off.argmax())]


def test_an_unloaded_shaft_that_rises_ever_more_slowly_has_its_limit_as_speed_from_rest() -> None:
    """It misses its limit by A/k^2 after k periods, and no pendulum drives it beyond."""
    columns = _some(random_drives(300, 1, seed=4) | {"shaft.load": 0.0}, [2, 156])
    batch = settle(columns, SettledRun(), cases=2)
    limit = _column(batch, 1, "shaft.speed.from_rest")
    np.testing.assert_array_equal(limit, _column(batch, 1, "shaft.speed.mean"))
    last = [info.name for info in result_infos(1)].index("shaft.speed.mean")

    def short(periods: float) -> Floats:
        run = Run(duration=Span(periods), window=(Span(periods - 1.0), Span(periods)))
        gap: Floats = limit - simulate(columns, run, cases=2).values[:, last]
        return gap

    first, second = short(2000.0), short(4000.0)
    assert (second > 0.0).all()
    assert (first < 1e-5 * limit).all()
    np.testing.assert_allclose(first / second, 4.0, rtol=0.15)


def _strobes(speeds: Floats) -> Floats:
    """Strobes of one drive, shape (1, strobes, columns), that differ in the shaft's speed only."""
    rows = np.zeros((1, len(speeds), width(1)))
    rows[:, :, SHAFT] = Shaft.ROTATING
    rows[0, :, SHAFT_SPEED] = speeds
    return rows


@pytest.mark.parametrize(
    ("shift", "shrink", "order"),
    [(0.004, 0.97, 2), (0.0, 0.97, 1), (0.004, 1.03, 0), (0.02, 0.97, 2)],
    ids=["doubled", "single", "leaving", "far"],
)
def test_the_candidate_is_the_order_after_which_strobes_repeat(shift: float, shrink: float, order: int) -> None:
    k = np.arange(97)
    speeds = 1.0 + shift * (-1.0) ** k + 1e-3 * shrink**k / max(1.0, shrink**96)
    found, one = np.zeros(1, dtype=np.int64), np.zeros(1, dtype=np.int64)
    free, windings = np.zeros((1, 1), dtype=np.bool_), np.zeros((1, 1), dtype=np.int64)
    orbits.find_candidates(_strobes(speeds), one, 97, np.ones((1, width(1))), 0.01, 0.05, 6, 32, free, windings, found)
    assert found[0] == order


@pytest.mark.parametrize(
    ("shrink", "approaches"), [(0.99, True), (0.996, True), (0.9965, True), (0.998, False), (1.0, False), (1.01, False)]
)
def test_a_run_approaches_an_orbit_at_half_the_rate_of_its_multiplier_at_least(shrink: float, approaches: bool) -> None:
    k = np.arange(97)
    speeds = 1.0 + 0.1 * (-1.0) ** k + 0.02 * shrink**k
    turn = _strobes(1.0 + 0.1 * (-1.0) ** np.array([97, 98]))
    found, one = np.zeros(1, dtype=np.bool_), np.zeros(1, dtype=np.int64)
    multiplier = 0.994**2
    orbits.find_approaching(
        _strobes(speeds), one, 97, turn, np.array([2]), np.ones((1, width(1))), np.array([multiplier]),
        np.zeros((1, 1), dtype=np.bool_), found,
    )  # fmt: skip
    assert found[0] == approaches
    assert math.sqrt(multiplier) == pytest.approx(0.994)


def test_an_orbit_that_a_run_does_not_come_nearer_to_does_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(orbits, "find_approaching", lambda *arguments: None)
    batch = settle(_drives(1, [113]), SettledRun(), cases=1)
    assert Regime(int(batch.regimes[0])) in {Regime.UNSETTLED, Regime.IRREGULAR}
