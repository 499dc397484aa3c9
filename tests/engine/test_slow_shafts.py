"""Heavy shafts that change their speed over thousands of periods: their motions are those that long runs come to."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.settled import heavy_shafts
from sprag_study.engine.run import Run, SettledRun, Span
from sprag_study.engine.vibration_drive import settle as settle_module
from sprag_study.engine.vibration_drive.irregular import variance_factors
from sprag_study.engine.vibration_drive.regimes import Regime, settled_infos
from sprag_study.engine.vibration_drive.settle import SettledBatch, settle
from sprag_study.engine.vibration_drive.simulate import simulate
from sprag_study.engine.vibration_drive.strobes import continued
from tests.engine.vibration_drive.reference_run import Drive

Floats = NDArray[np.float64]

#: Drives that come to orbits: their orders, and a number of periods after which runs have come to them.
SLOW, ORDERS, PERIODS = [40, 238, 259], [1, 2, 1], 20_000


def _some(chosen: list[int]) -> dict[str, Any]:
    columns = heavy_shafts(400, seed=38)
    return {path: value[chosen] if isinstance(value, np.ndarray) else value for path, value in columns.items()}


def _column(batch: SettledBatch, name: str) -> Floats:
    values: Floats = batch.values[:, [info.name for info in settled_infos(1)].index(name)]
    return values


def _without(
    monkeypatch: pytest.MonkeyPatch, columns: dict[str, Any], cases: int, settings: SettledRun | None = None
) -> SettledBatch:
    """What the search alone finds."""
    with monkeypatch.context() as patched:
        patched.setattr(settle_module, "_settle_slowly", lambda *arguments: None)
        return settle(columns, settings or SettledRun(), cases=cases)


def test_slow_shafts_come_to_the_orbits_of_long_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    columns = _some(SLOW)
    before, batch = _without(monkeypatch, columns, 3), settle(columns, SettledRun(), cases=3)
    assert (before.regimes == Regime.UNSETTLED).all()
    assert (batch.regimes == Regime.PERIODIC).all()
    np.testing.assert_array_equal(_column(batch, "regime.order"), ORDERS)
    run = Run(duration=Span(PERIODS), window=(Span(PERIODS - 2.0), Span(PERIODS)))
    long = simulate(columns, run, cases=3)
    for name in ("shaft.speed.mean", "shaft.speed.max", "torque.max", "pendulums.0.angle.amplitude", "efficiency"):
        place = [info.name for info in settled_infos(1)].index(name)
        np.testing.assert_allclose(batch.values[:, place], long.values[:, place], rtol=2e-8, err_msg=name)
    np.testing.assert_allclose(_column(batch, "torque.mean"), columns["shaft.load"], rtol=1e-9)
    # The speed is not yet near that of the orbit when the search ends, and its distance shrinks by the multiplier.
    assert (_column(batch, "regime.settled_after") > 2000.0).all()
    assert (_column(batch, "regime.multiplier") > 0.99).all()
    assert (batch.spent - before.spent <= 800).all()


def test_scipy_repeats_the_orbit_of_a_slow_shaft() -> None:
    columns = _some([259])
    orbit = settle(columns, SettledRun(), cases=1)
    # From its point the orbit is run on to the end of a period, where scipy begins.
    again = settle(columns, SettledRun(), cases=1, starts=continued(orbit.points))
    fraction, _, speed, _, _, angle, swing, _, clutch, _ = again.points[0].tolist()
    assert (fraction, clutch) == (1.0, 0.0)
    begin = {"shaft.initial_speed": speed, "pendulums.0.initial_angle": angle, "pendulums.0.initial_speed": swing}
    machine = Drive({path: float(np.ravel(value)[0]) for path, value in (columns | begin).items()}, literal=False)
    outcome = machine.run(1, (0, 1))
    np.testing.assert_allclose(outcome.values[0][[0, 1, machine.shaft]], [angle, swing, speed], rtol=1e-8)
    assert outcome.mean["torque.mean"] == pytest.approx(columns["shaft.load"][0], rel=1e-7)
    assert outcome.mean["shaft.speed.mean"] == pytest.approx(_column(orbit, "shaft.speed.mean")[0], rel=1e-9)


def test_a_shaft_that_rises_and_falls_for_long_has_a_mean_with_an_interval(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its clutch loses it at 7.1 rad/s, and it falls until it is driven again; the mean is that of 20,000 periods."""
    columns = _some([105])
    assert _without(monkeypatch, columns, 1).regimes[0] == Regime.UNSETTLED
    batch = settle(columns, SettledRun(), cases=1)
    assert batch.regimes[0] == Regime.IRREGULAR
    run = Run(duration=Span(24_000), window=(Span(4000), Span(24_000)))
    long = simulate(columns, run, cases=1).values[0, [info.name for info in settled_infos(1)].index("shaft.speed.mean")]
    width = _column(batch, "shaft.speed.mean.half_width")[0]
    assert abs(_column(batch, "shaft.speed.mean")[0] - long) < width < 0.05 * long


@pytest.mark.parametrize("max_period", [8, 20])
def test_exponents_are_those_of_a_search_for_longer_orbits(max_period: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Batches are longer than what is kept of a motion to find its short orbits."""
    columns = _some([105])
    for settled in (settle, lambda columns, run, cases: _without(monkeypatch, columns, cases, run)):
        exponents = [
            float(_column(settled(columns, SettledRun(max_period=most), cases=1), "regime.exponent")[0])
            for most in (max_period, 32)
        ]
        # The scales of the strobes follow from the last ones.
        assert exponents[0] == pytest.approx(exponents[1], rel=1e-2)


def test_a_heavy_shaft_that_runs_out_is_held(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing drives it as fast as it begins, and it stands after 12,000 periods."""
    columns = _some([11, 40]) | {"shaft.initial_speed": 20.0, "shaft.load": 3.0, "shaft.inertia": 20.0}
    assert (_column(_without(monkeypatch, columns, 2), "shaft.speed.mean") > 14.0).all()
    batch = settle(columns, SettledRun(), cases=2)
    assert (batch.regimes == Regime.HELD).all()
    assert (_column(batch, "shaft.speed.mean") == 0.0).all()
    run = Run(duration=Span(12_000), window=(Span(11_990), Span(12_000)))
    long = simulate(columns, run, cases=2).values[:, [info.name for info in settled_infos(1)].index("shaft.speed.max")]
    assert (long == 0.0).all()


def test_motions_that_the_search_finds_keep_their_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    chosen = [5, 40, 41, 42, 43, 61, 90, 105]
    columns = _some(chosen)
    before, after = _without(monkeypatch, columns, len(chosen)), settle(columns, SettledRun(), cases=len(chosen))
    known = before.regimes != Regime.UNSETTLED
    assert 0 < known.sum() < len(chosen)
    for name in ("values", "endings", "regimes", "points", "spent"):
        np.testing.assert_array_equal(getattr(before, name)[known], getattr(after, name)[known])
    assert (after.regimes[~known] != Regime.UNSETTLED).all()


def test_a_slow_shaft_has_the_same_bits_in_any_batch() -> None:
    together, alone = settle(_some([61, 259, 105]), SettledRun(), cases=3), settle(_some([259]), SettledRun(), cases=1)
    np.testing.assert_array_equal(together.values[1], alone.values[0])
    np.testing.assert_array_equal(together.points[1], alone.points[0])
    assert together.spent[1] == alone.spent[0]


def test_a_short_search_stays_unsettled() -> None:
    """Only a search with room for the means of irregular motion goes on."""
    batch = settle(_some([259]), SettledRun(at_most=400), cases=1)
    assert batch.regimes[0] == Regime.UNSETTLED
    assert batch.spent[0] < 500


def test_correlation_of_batches_widens_their_interval() -> None:
    """Geyer's initial positive sequence, against sums of numpy; batches in turns have a smaller variance."""
    drifting, turning = np.arange(20.0) + np.random.default_rng(5).normal(size=20), np.tile([1.0, -1.0], 10)
    factors = np.empty((1, 3))
    variance_factors(np.stack([drifting, turning, np.full(20, 0.1)], axis=1)[:, None, :], factors)
    apart = drifting - drifting.mean()
    lags = np.correlate(apart, apart, "full")[19:] / np.sum(apart**2)
    pairs = lags[::2] + lags[1::2]
    last = int(np.argmax(pairs <= 0.0))
    assert factors[0, 0] == pytest.approx(2.0 * pairs[:last].sum() - 1.0, rel=1e-12)
    assert factors[0, 0] > 3.0
    assert factors[0, 1] < 1.0
    assert factors[0, 2] == 1.0
