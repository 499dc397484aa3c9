"""Torques that depend on speeds: the load's parts and the bearings' drag (docs/theory.md, "The load")."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sprag_study.engine.endings import Ending
from sprag_study.engine.run import Run, SettledRun, Span
from sprag_study.engine.vibration_drive.parameters import DRAG
from sprag_study.engine.vibration_drive.regimes import Regime, settled_infos
from sprag_study.engine.vibration_drive.settle import settle
from sprag_study.engine.vibration_drive.simulate import trajectory
from tests.engine.vibration_drive.drive import Columns, Results, batch_of, clutch, column, drive, one, pendulum, periods
from tests.engine.vibration_drive.test_against_scipy import compare
from tests.engine.vibration_drive.test_balances import random_machines

J_E = 2e-3


def resisted(pendulums: int, seed: int, cases: int) -> list[Columns]:
    """Random machines whose shafts are resisted by their speeds, some of them by nothing else."""
    draw = np.random.default_rng(seed)
    machines = random_machines(pendulums, seed, cases)
    for columns in machines:
        columns |= {
            "shaft.bearing_damping": draw.choice([0.0, draw.uniform(1e-4, 0.02)]),
            "shaft.linear_load": draw.choice([0.0, draw.uniform(1e-4, 0.02)]),
            "shaft.quadratic_load": draw.choice([0.0, draw.uniform(1e-6, 1e-3)]),
        }
    return machines


@pytest.mark.parametrize("number", range(20))
def test_an_independent_integrator_agrees(number: int) -> None:
    (columns,) = resisted(1 + number % 2, 300 + number, 1)
    compare(columns, "literal" if number % 5 == 4 else "contact", 1e-9)


@pytest.mark.parametrize("pendulums", [1, 2])
def test_balances_close(pendulums: int) -> None:
    cases = resisted(pendulums, 11, 40)
    results = Results(batch_of(cases), periods(12.35, 4.0, 12.35), len(cases))
    assert set(results.endings) == {Ending.OK}
    assert results["balance.energy"].max() < 1e-8
    assert results["balance.momentum"].max() < 1e-8
    assert results["power.quadratic.mean"].max() > 0.01 * results["power.input.mean"].max()
    lost = sum(results[f"pendulums.{i}.power.loss"] for i in range(pendulums)) + results["power.bearing.mean"]
    np.testing.assert_allclose(results["power.loss.mean"], lost, rtol=1e-14)


@pytest.mark.parametrize("pendulums", [1, 2])
def test_terms_that_are_zero_change_no_bit(pendulums: int) -> None:
    cases = random_machines(pendulums, 12, 24)
    run = periods(12.0, 4.0, 12.0)
    given = Results(batch_of(cases) | {f"shaft.{name}": 0.0 for name in DRAG}, run, len(cases))
    np.testing.assert_array_equal(given.values, Results(batch_of(cases), run, len(cases)).values)


# A shaft that runs down by itself.


def running_down(**changes: float) -> Columns:
    """A shaft at 30 rad/s beside a pendulum at rest whose clutch never engages."""
    columns = drive(1, excitation__amplitude_x=0.0, excitation__amplitude_y=0.0, shaft__inertia=J_E)
    return columns | {"shaft.initial_speed": 30.0, "shaft.load": 0.0, "pendulums.0.damping": 0.0, **changes}


@pytest.mark.parametrize("name", ["bearing_damping", "linear_load"])
def test_viscous_run_down(name: str) -> None:
    times = np.linspace(0.0, 2.0, 41)
    columns = running_down(**{f"shaft.{name}": 3e-3})
    path = trajectory(columns, Run(duration=Span(2.0, "s")), times)
    speed = 30.0 * np.exp(-1.5 * times)
    np.testing.assert_allclose(column(path, "shaft.speed"), speed, rtol=1e-9)
    power = column(path, "power.loss" if name == "bearing_damping" else "power.useful")
    np.testing.assert_allclose(power, 3e-3 * speed**2, rtol=1e-8)
    row = one(columns, Run(duration=Span(2.0, "s"), window=(Span(0.0, "s"), Span(2.0, "s"))))
    gone = 0.5 * J_E * (30.0**2 - speed[-1] ** 2) / 2.0
    assert row["power.loss.mean" if name == "bearing_damping" else "power.useful.mean"] == pytest.approx(gone, rel=1e-9)
    assert row["shaft.turn"] == pytest.approx((30.0 - speed[-1]) / 1.5, rel=1e-9)


def test_viscous_run_down_against_a_dry_load_stops() -> None:
    viscous, load = 3e-3, 0.02
    end = J_E / viscous * math.log(1.0 + viscous * 30.0 / load)
    row = one(
        running_down(**{"shaft.bearing_damping": viscous, "shaft.load": load}),
        Run(duration=Span(2.0, "s"), window=(Span(0.0, "s"), Span(2.0, "s"))),
    )
    assert row["fraction.rotating"] == pytest.approx(end / 2.0, rel=1e-9)
    turn = J_E / viscous * 30.0 - load / viscous * end
    assert row["shaft.turn"] == pytest.approx(turn, rel=1e-9)


def test_quadratic_run_down() -> None:
    times = np.linspace(0.0, 2.0, 41)
    alone = trajectory(running_down(**{"shaft.quadratic_load": 1e-4}), Run(duration=Span(2.0, "s")), times)
    np.testing.assert_allclose(column(alone, "shaft.speed"), 30.0 / (1.0 + 1e-4 * 30.0 / J_E * times), rtol=1e-9)
    load, k = 0.02, 1e-4
    row = one(
        running_down(**{"shaft.quadratic_load": k, "shaft.load": load}),
        Run(duration=Span(2.0, "s"), window=(Span(0.0, "s"), Span(2.0, "s"))),
    )
    end = J_E / math.sqrt(k * load) * math.atan(30.0 * math.sqrt(k / load))
    assert row["fraction.rotating"] == pytest.approx(end / 2.0, rel=1e-9)
    turn = J_E / (2.0 * k) * math.log(1.0 + k * 30.0**2 / load)
    assert row["shaft.turn"] == pytest.approx(turn, rel=1e-9)
    assert row["power.quadratic.mean"] * 2.0 == pytest.approx(0.5 * J_E * 900.0 - load * turn, rel=1e-9)


def test_a_locked_pendulum_runs_down_with_the_shaft() -> None:
    """Nothing else slows the pendulum down, so that its clutch, locked, drives the shaft for good."""
    columns = {
        "gravity": 0.0, "excitation.frequency": 20.0, "shaft.inertia": J_E, "shaft.initial_speed": 8.0,
        "shaft.bearing_damping": 2e-3, "shaft.quadratic_load": 1e-4, **clutch(50.0, 50.0),
        **pendulum(0, spring_rate=0.0, damping=0.0, backlash=0.0, initial_speed=8.0),
    }  # fmt: skip
    times = np.linspace(0.05, 1.0, 20)
    path = trajectory(columns, Run(duration=Span(1.0, "s")), times)
    assert set(path.states["pendulums.0"]) == {"locked"}
    # With s = b/(J + J_e): 1/speed = (1/8 + k/b) exp(s t) - k/b.
    slower = (1.0 / 8.0 + 0.05) * np.exp(2e-3 / (1e-3 + J_E) * times) - 0.05
    np.testing.assert_allclose(column(path, "shaft.speed"), 1.0 / slower, rtol=1e-9)
    np.testing.assert_array_equal(column(path, "pendulums.0.speed"), column(path, "shaft.speed"))


def test_settled_motion_without_a_dry_load() -> None:
    """The orbits, with the shaft turning all the time, are those of long runs."""
    cases = [
        drive(1, shaft__load=0.0, shaft__bearing_damping=b, shaft__linear_load=0.0, shaft__quadratic_load=k)
        for b, k in ((2e-3, 0.0), (0.0, 3e-4), (4e-3, 1e-4), (2e-2, 0.0))
    ]
    settled = settle(batch_of(cases), SettledRun(), cases=len(cases))
    names = [info.name for info in settled_infos(1)]
    long = Results(batch_of(cases), periods(4000.0, 3000.0, 4000.0), len(cases))
    assert settled.regimes.tolist() == [Regime.PERIODIC] * len(cases)
    for name in ("shaft.speed.mean", "power.useful.mean", "power.loss.mean", "efficiency"):
        np.testing.assert_allclose(settled.values[:, names.index(name)], long[name], rtol=1e-8)
    balance = settled.values[:, names.index("power.input.mean")]
    for name in ("power.loss.mean", "power.useful.mean"):
        balance = balance - settled.values[:, names.index(name)]
    np.testing.assert_allclose(balance, 0.0, atol=1e-8)
