"""Settled motions: against runs of 20,000 periods, closed forms, long runs and themselves in other batches."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.settled import NOT_COMPARED
from benchmarks.workloads import W1
from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.run import Run, SettledRun, Span
from sprag_study.engine.vibration_drive.cases import case_matrix, with_lengths
from sprag_study.engine.vibration_drive.characteristics import characteristics, combined
from sprag_study.engine.vibration_drive.integration import integrate
from sprag_study.engine.vibration_drive.kernel import kernel, lane_count, order_for
from sprag_study.engine.vibration_drive.no_load import limit_speed
from sprag_study.engine.vibration_drive.regimes import Regime, settled_infos
from sprag_study.engine.vibration_drive.results import result_infos
from sprag_study.engine.vibration_drive.settle import SettledBatch, settle
from sprag_study.engine.vibration_drive.simulate import simulate
from sprag_study.engine.vibration_drive.strobes import BEGIN, FRACTION

REFERENCE = Path(__file__).resolve().parents[1] / "data" / "reference" / "settled.json"


def _reference(group: str) -> list[dict[str, Any]]:
    cases: list[dict[str, Any]] = json.loads(REFERENCE.read_text(encoding="utf-8"))[group]
    return cases


def _columns(cases: list[dict[str, Any]]) -> dict[str, NDArray[np.float64]]:
    return {path: np.array([case["parameters"][path] for case in cases]) for path in cases[0]["parameters"]}


def _one(frequency: float, amplitude: float, load: float, **changes: float) -> dict[str, Any]:
    return {
        **W1.columns(np.array([0])),
        "excitation.frequency": frequency,
        "excitation.amplitude_x": amplitude,
        "excitation.amplitude_y": amplitude,
        "shaft.load": load,
        **{path.replace("__", "."): value for path, value in changes.items()},
    }


def _row(batch: SettledBatch, case: int = 0, pendulums: int = 1) -> dict[str, float]:
    names = [info.name for info in settled_infos(pendulums)]
    return dict(zip(names, batch.values[case].tolist(), strict=True))


def _settled(columns: dict[str, Any], **settings: Any) -> tuple[dict[str, float], Regime]:
    batch = settle(columns, SettledRun(**settings), cases=1)
    return _row(batch), Regime(int(batch.regimes[0]))


def test_a_run_past_an_unstable_orbit_tells_the_motion_it_goes_to() -> None:
    row, regime = _settled(_one(25.0, 2e-3, 0.2))
    assert regime is Regime.PERIODIC
    assert row["regime.order"] == 2
    assert row["shaft.speed.mean"] == pytest.approx(22.8350116679, abs=1e-9)
    assert row["torque.max"] == pytest.approx(4.0567750130, abs=1e-9)
    assert row["regime.multiplier"] == pytest.approx(0.8192, abs=1e-4)
    assert row["regime.settled_after"] > 60
    assert row["regime.residual"] < 1e-10
    assert row["balance.energy"] < 1e-9
    assert math.isnan(row["regime.exponent"])


def test_an_orbit_is_as_good_as_the_last_step_of_newtons_method() -> None:
    """Where the steps end with a residual just below the accepted one; over whole turns the torque carries the load."""
    chosen = np.array([216, 248, 249, 264])
    columns = W1.columns(chosen)
    batch = settle(columns, SettledRun(), cases=len(chosen))
    for case, load in enumerate(columns["shaft.load"]):  # type: ignore[arg-type]
        row = _row(batch, case)
        assert 1e-11 < row["regime.residual"] < 1e-10
        assert row["torque.mean"] == pytest.approx(load, rel=1e-10)


@pytest.mark.parametrize(("group", "pendulums", "every"), [("W1", 1, 1), ("R1", 1, 1), ("W2", 2, 1), ("R2", 2, 1)])
def test_settled_motions_equal_those_after_20000_periods(group: str, pendulums: int, every: int) -> None:
    cases = _reference(group)[::every]
    batch = settle(_columns(cases), SettledRun(), cases=len(cases))
    wanted = missed = inside = irregular = 0
    for k, case in enumerate(cases):
        if case["parameters"]["shaft.load"] == 0.0:
            continue
        row, regime = _row(batch, k, pendulums), Regime(int(batch.regimes[k]))
        if case["order"] is None or case["order"] > 32:
            assert regime in {Regime.IRREGULAR, Regime.UNSETTLED}, case["case"]
            if regime is Regime.IRREGULAR and case["order"] is None:
                irregular += 1
                off = abs(row["shaft.speed.mean"] - case["results"]["shaft.speed.mean"])
                inside += off <= row["shaft.speed.mean.half_width"]
            continue
        wanted += 1
        if regime not in {Regime.PERIODIC, Regime.HELD}:
            missed += 1
            continue
        assert row["regime.order"] == case["order"], case["case"]
        for name, value in case["results"].items():
            if name in row and name not in NOT_COMPARED and value is not None:
                assert row[name] == pytest.approx(value, rel=1e-9, abs=1e-12), (case["case"], name)
    assert missed <= 1
    assert missed <= 0.05 * wanted
    # One in twenty may miss its interval; which, any change of rounding decides.
    assert irregular - inside <= 1 + 0.1 * irregular


def test_without_a_load_the_speed_is_the_limit_of_a_vanishing_one() -> None:
    for frequency, amplitude in ((25.0, 2e-3), (35.0, 1.5e-3)):
        row, regime = _settled(_one(frequency, amplitude, 0.0))
        assert regime is Regime.COASTING
        assert row["shaft.speed.min"] == row["shaft.speed.max"] == row["shaft.speed.mean"]
        assert row["shaft.speed.from_rest"] > row["shaft.speed.mean"]
        small, regime = _settled(_one(frequency, amplitude, 5e-4, shaft__initial_speed=row["shaft.speed.mean"]))
        assert regime is Regime.PERIODIC
        assert small["shaft.speed.mean"] == pytest.approx(row["shaft.speed.mean"], rel=2e-3)


def test_the_speed_from_rest_is_that_after_20000_periods() -> None:
    cases = [case for group in ("R1",) for case in _reference(group) if case["parameters"]["shaft.load"] == 0.0]
    assert cases
    batch = settle(_columns(cases), SettledRun(), cases=len(cases))
    for k, case in enumerate(cases):
        assert _row(batch, k)["shaft.speed.from_rest"] == pytest.approx(case["results"]["shaft.speed.mean"], rel=1e-9)


@pytest.mark.parametrize("angle", [0.2, 1.0, 2.5])
def test_the_limit_speed_of_a_harmonic_pendulum_is_the_closed_form(angle: float) -> None:
    """phi' = V cos(nu t) drives at w = V cos theta with sin theta - theta cos theta = delta nu/(2 V)."""
    top, nu = 30.0, 150.0
    times = np.linspace(0.0, 2.0 * math.pi / nu, 4097)
    phase = nu * times
    motion = top / nu * np.sin(phase), top * np.cos(phase), -top * nu * np.sin(phase)
    backlash = 2.0 * top / nu * (math.sin(angle) - angle * math.cos(angle))
    found = limit_speed(times, *motion, backlash)
    if angle < math.pi / 2:
        assert found == pytest.approx(top * math.cos(angle), rel=1e-10)
    else:
        assert math.isnan(found)
    assert limit_speed(times, *motion, 0.0) == pytest.approx(top, rel=1e-12)


def test_the_multiplier_of_a_pendulum_that_never_engages_is_its_damping() -> None:
    row, regime = _settled(_one(25.0, 5e-4, 0.2, pendulums__0__backlash=10.0))
    assert regime is Regime.HELD
    assert row["shaft.speed.mean"] == 0.0
    assert row["regime.multiplier"] == pytest.approx(math.exp(-0.01 / 25.0 / (2.0 * 0.001)), abs=1e-6)


def test_a_pendulum_that_comes_to_rest_on_its_clutch_holds_the_shaft() -> None:
    """It leans on a clutch that never lets go: another windup is another rest, and does not make this one unstable."""
    moment, inertia, damping = 0.5 * 9.80665 * 0.03, 0.001, 0.5
    leaning = {
        "pendulums__0__spring_rate": 0.0, "pendulums__0__initial_angle": 0.3, "pendulums__0__damping": damping,
    }  # fmt: skip
    row, regime = _settled(_one(25.0, 0.0, 0.2, **leaning))
    assert regime is Regime.HELD
    assert row["regime.order"] == 1
    assert row["torque.mean"] == pytest.approx(moment * math.sin(row["pendulums.0.angle.mean"]), rel=1e-9)
    assert row["pendulums.0.angle.max"] - row["pendulums.0.angle.min"] < 1e-9
    assert row["regime.multiplier"] == pytest.approx(math.exp(-damping / 25.0 / (2.0 * inertia)), abs=1e-6)
    locks = {"pendulums__0__backlash": 0.0, "clutch__coefficients__0": 1.0}
    row, regime = _settled(_one(25.0, 0.0, 0.2, **leaning, **locks))
    assert regime is Regime.HELD
    assert row["regime.multiplier"] == row["shaft.speed.max"] == 0.0
    assert row["torque.max"] == pytest.approx(moment * math.sin(row["pendulums.0.angle.mean"]), rel=1e-9)


@pytest.mark.parametrize(
    "changes",
    [
        {"reset": "literal"},
        {"pendulums__0__backlash": 0.0, "clutch__coefficients__0": 0.3},
        {"pendulums__0__backlash": 0.0, "clutch__coefficients__0": 3.0},
        {"clutch__windup_limit": 0.01},
    ],
    ids=["literal", "locking", "locked", "beyond"],
)
@pytest.mark.parametrize("load", [0.05, 0.25])
def test_every_state_of_the_clutch_settles_as_a_long_run_does(changes: dict[str, Any], load: float) -> None:
    reset = changes.get("reset", "contact")
    columns = _one(27.0, 1.7e-3, load, **{key: value for key, value in changes.items() if key != "reset"})
    row, regime = _settled(columns, reset=reset)
    assert regime in {Regime.PERIODIC, Regime.HELD}
    order = row["regime.order"]
    run = Run(duration=Span(3000.0), window=(Span(3000.0 - order), Span(3000.0)), reset=reset, max_steps=10**8)
    long = dict(zip([i.name for i in result_infos(1)], simulate(columns, run, cases=1).values[0].tolist(), strict=True))
    for name in ("shaft.speed.mean", "shaft.speed.max", "torque.max", "power.input.mean", "reset.energy_lost"):
        assert row[name] == pytest.approx(long[name], rel=1e-9, abs=1e-12), name


def test_a_case_is_the_same_to_the_bit_in_every_batch() -> None:
    chosen = np.arange(0, 512, 7)
    whole = settle(W1.columns(chosen), SettledRun(), cases=len(chosen))
    turned = settle(W1.columns(chosen[::-1]), SettledRun(), cases=len(chosen))
    part = settle(W1.columns(chosen[5:19]), SettledRun(), cases=14)
    assert whole.values.tobytes() == np.ascontiguousarray(turned.values[::-1]).tobytes()
    assert whole.values[5:19].tobytes() == part.values.tobytes()
    assert whole.points[5:19].tobytes() == part.points.tobytes()


def test_a_run_goes_on_from_its_strobe_to_the_bit() -> None:
    columns = W1.columns(np.arange(0, 512, 13))
    cases = len(columns["shaft.load"])  # type: ignore[arg-type]
    run = Run()
    module = kernel(1, 4, order_for(run.tolerance), lane_count())
    matrix, nothing = case_matrix(columns, run, cases), np.zeros(cases)

    def go(periods: int, starts: NDArray[np.float64] | None) -> NDArray[np.float64]:
        lengths = with_lengths(matrix, nothing, np.full(cases, float(periods)), windowed=False)
        return integrate(module, lengths, run, starts=starts, strobes=periods).strobes

    whole, first = go(30, None), go(11, None)
    rest = go(19, np.ascontiguousarray(first[:, -1]))
    rest[:, :, 3] += first[:, -1:, 3]  # the turn counts from each start
    np.testing.assert_array_equal(np.delete(whole[:, 11:], 3, axis=2), np.delete(rest, 3, axis=2))
    np.testing.assert_allclose(whole[:, 11:, 3], rest[:, :, 3], rtol=1e-14)


def test_an_orbit_has_the_same_characteristics_from_any_of_its_strobes() -> None:
    batch = settle(_one(25.0, 2e-3, 0.2), SettledRun(), cases=1)
    run = Run()
    module = kernel(1, 4, order_for(run.tolerance), lane_count())
    matrix = case_matrix(_one(25.0, 2e-3, 0.2), run, 1)
    start = batch.points.copy()
    start[:, FRACTION] = 0.375
    moved = integrate(
        module, with_lengths(matrix, np.zeros(1), np.array([1.375]), windowed=False), run, starts=start, strobes=1
    ).strobes[:, 0]
    assert moved[0, BEGIN] == 0.375
    lengths = with_lengths(matrix, moved[:, BEGIN], np.array([2.0]), windowed=True)
    sums = integrate(module, lengths, run, starts=np.ascontiguousarray(moved), strobes=2).sums
    names = [info.name for info in result_infos(1)]
    row = _row(batch)
    for name, value in zip(names, characteristics(module.LAYOUT, lengths, sums)[0].tolist(), strict=True):
        if name not in NOT_COMPARED:
            assert value == pytest.approx(row[name], rel=1e-9, abs=1e-9), name


def test_windows_that_follow_each_other_add_up_to_one() -> None:
    columns = W1.columns(np.arange(0, 512, 13))
    cases = len(columns["shaft.load"])  # type: ignore[arg-type]
    run = Run()
    module = kernel(1, 4, order_for(run.tolerance), lane_count())
    matrix, nothing = case_matrix(columns, run, cases), np.zeros(cases)

    def lengths(periods: int) -> NDArray[np.float64]:
        return with_lengths(matrix, nothing, np.full(cases, float(periods)), windowed=True)

    first = integrate(module, lengths(5), run, strobes=5)
    second = integrate(module, lengths(7), run, starts=np.ascontiguousarray(first.strobes[:, -1]))
    starts = np.ascontiguousarray(first.strobes[:, -1])
    knowing = integrate(module, lengths(7), run, starts=starts, before=first.sums)
    added = combined(module.LAYOUT, [first.sums, second.sums])
    np.testing.assert_array_equal(combined(module.LAYOUT, [first.sums, knowing.sums]), added)
    whole = characteristics(module.LAYOUT, lengths(12), integrate(module, lengths(12), run).sums)
    added = characteristics(module.LAYOUT, lengths(12), added)
    for column, info in enumerate(result_infos(1)):
        if info.name not in {*NOT_COMPARED, "runup.time"}:
            np.testing.assert_allclose(added[:, column], whole[:, column], rtol=1e-10, atol=1e-10, err_msg=info.name)


def test_a_short_search_says_that_the_motion_is_unsettled() -> None:
    row, regime = _settled(_one(25.0, 2e-3, 0.2), at_most=100)
    assert regime is Regime.UNSETTLED
    assert row["shaft.speed.mean"] > 0.0
    assert math.isnan(row["shaft.speed.mean.half_width"])


def test_a_case_that_does_not_end_ok_has_no_regime() -> None:
    batch = settle(_one(25.0, 2e-3, 0.2), SettledRun(max_events_per_period=1), cases=1)
    assert ENDINGS[batch.endings[0]] is Ending.CHATTER
    assert Regime(int(batch.regimes[0])) is Regime.NONE
    assert np.isnan(batch.values).all()


def test_no_cases_are_no_results() -> None:
    batch = settle(_one(25.0, 2e-3, 0.2), SettledRun(), cases=0)
    assert batch.values.shape == (0, len(settled_infos(1)))
