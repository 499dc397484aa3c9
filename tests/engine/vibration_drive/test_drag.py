"""Torques that depend on speeds: of load, bearings and clutches (docs/theory.md, "The load", "The clutches")."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import brentq

from sprag_study.engine.endings import Ending
from sprag_study.engine.run import Reset, Run, SettledRun, Span
from sprag_study.engine.vibration_drive.parameters import DRAG
from sprag_study.engine.vibration_drive.regimes import Regime, settled_infos
from sprag_study.engine.vibration_drive.results import STEADY_SHAFT, result_infos
from sprag_study.engine.vibration_drive.settle import settle
from sprag_study.engine.vibration_drive.simulate import trajectory
from sprag_study.engine.vibration_drive.strobes import SHAFT_SPEED
from sprag_study.engine.vibration_drive.transients import simulate_judged
from tests.engine.odd_drives import odd_drive
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


def damped(pendulums: int, seed: int, cases: int) -> list[Columns]:
    """Random machines of which clutches are damped while engaged, or drag while they overrun, or both."""
    draw = np.random.default_rng(seed)
    machines = resisted(pendulums, seed, cases)
    for columns in machines:
        for i in range(pendulums):
            columns[f"pendulums.{i}.clutch_damping"] = draw.choice(
                [0.0, draw.uniform(0.0, 0.1), draw.uniform(0.1, 1.0)]
            )
            columns[f"pendulums.{i}.overrunning_damping"] = draw.choice([0.0, draw.uniform(0.0, 5e-3)])
    return machines


def dragged(pendulums: int, seed: int, cases: int) -> list[Columns]:
    """Random machines whose clutches all drag while they overrun, so that each has a backstop."""
    draw = np.random.default_rng(seed)
    machines = damped(pendulums, seed, cases)
    for columns in machines:
        columns |= {f"pendulums.{i}.overrunning_damping": draw.uniform(1e-4, 5e-3) for i in range(pendulums)}
    return machines


@pytest.mark.parametrize("machines", [resisted, damped])
@pytest.mark.parametrize("number", range(5))
def test_an_independent_integrator_agrees(machines: Callable[..., list[Columns]], number: int) -> None:
    (columns,) = machines(1 + number % 2, 300 + number, 1)
    if not compare(columns, "literal" if number % 5 == 4 else "contact", 1e-9):
        pytest.skip("too sensitive to conclude anything")


@pytest.mark.parametrize("reset", ["contact", "literal"])
@pytest.mark.parametrize("machines", [resisted, damped])
@pytest.mark.parametrize("pendulums", [1, 2])
def test_balances_close(machines: Callable[..., list[Columns]], pendulums: int, reset: Reset) -> None:
    cases = machines(pendulums, 11, 40)
    results = Results(batch_of(cases), periods(12.35, 4.0, 12.35, reset=reset), len(cases))
    assert set(results.endings) == {Ending.OK}
    assert results["balance.energy"].max() < 1e-8
    assert results["balance.momentum"].max() < 1e-8
    assert results["power.quadratic.mean"].max() > 0.01 * results["power.input.mean"].max()
    lost = results["power.bearing.mean"].copy()
    for i in range(pendulums):
        lost += results[f"pendulums.{i}.power.loss"] + results[f"pendulums.{i}.power.clutch_loss"]
        assert (results[f"pendulums.{i}.power.clutch_loss"].max() > 0.0) == (machines is damped)
    np.testing.assert_allclose(results["power.loss.mean"], lost, rtol=1e-14)


def test_odd_drives_run_to_the_end() -> None:
    """Exact equilibria, copies and clutches that lock, with drag: no chatter of the backstop or of damped clutches."""
    draw = np.random.default_rng(4)
    cases = [odd_drive(draw, 2) for _ in range(60)]
    for columns in cases:
        columns["shaft.bearing_damping"] = draw.choice([0.0, 10.0 ** draw.uniform(-4.0, -1.0)])
        columns["shaft.quadratic_load"] = draw.choice([0.0, 10.0 ** draw.uniform(-5.0, -2.0)])
        damping = draw.choice([0.0, 10.0 ** draw.uniform(-3.0, 0.0)])
        drag = draw.choice([0.0, 10.0 ** draw.uniform(-4.0, -1.0)])
        for i in range(2):
            columns |= {f"pendulums.{i}.clutch_damping": damping, f"pendulums.{i}.overrunning_damping": drag}
    results = Results(batch_of(cases), periods(30.0, 20.0, 30.0), len(cases))
    assert set(results.endings) == {Ending.OK}
    moving = results["power.input.mean"] > 1e-6
    assert moving.sum() > 20
    assert results["balance.energy"][moving].max() < 1e-6
    assert results["balance.momentum"][moving].max() < 1e-6


@pytest.mark.parametrize("pendulums", [1, 2])
def test_terms_that_are_zero_change_no_bit(pendulums: int) -> None:
    cases = random_machines(pendulums, 12, 24)
    run = periods(12.0, 4.0, 12.0)
    shaft = {f"shaft.{name}": 0.0 for name in ("bearing_damping", "linear_load", "quadratic_load")}
    clutches = {
        f"pendulums.{i}.{name}": 0.0 for name in ("clutch_damping", "overrunning_damping") for i in range(pendulums)
    }
    assert {path.rpartition(".")[2] for path in (*shaft, *clutches)} == DRAG
    given = Results(batch_of(cases) | shaft | clutches, run, len(cases))
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


@pytest.mark.parametrize("pendulums", [1, 2])
def test_a_backstop_without_a_dry_load_is_the_limit_of_a_small_one(pendulums: int) -> None:
    """Drag that vanishes as an interaction starts does not free the shaft."""
    cases = [columns | {"shaft.load": load} for load in (0.0, 1e-9) for columns in dragged(pendulums, 21, 24)]
    settled = settle(batch_of(cases), SettledRun(), cases=len(cases))
    bare, loaded = np.split(settled.regimes, 2)
    np.testing.assert_array_equal(bare, loaded)
    assert set(bare.tolist()) >= {Regime.HELD, Regime.PERIODIC}
    names = [info.name for info in settled_infos(pendulums)]
    repeats = settled.repeats[: len(bare)]
    for name in ("regime.order", "clutches.engagements_per_period", "fraction.held"):
        without, with_load = np.split(settled.values[:, names.index(name)], 2)
        np.testing.assert_allclose(without[repeats], with_load[repeats], rtol=0.0, atol=1e-4, err_msg=name)


@pytest.mark.parametrize("speed", [0.0, 30.0])
def test_a_shaft_that_only_drag_resists_is_held_in_the_limit(speed: float) -> None:
    """No clutch winds up, so that the shaft stands on the orbit, whatever rounding leaves of its speed."""
    still = {"shaft.load": 0.0, "shaft.initial_speed": speed, "pendulums.0.backlash": 1.0}
    cases = [
        drive(1, **still, shaft__bearing_damping=bearing, shaft__linear_load=damping - bearing)
        for damping in np.geomspace(3e-4, 0.1, 10)
        for bearing in (0.0, damping)
    ]
    settled = settle(batch_of(cases), SettledRun(), cases=len(cases))
    assert settled.regimes.tolist() == [Regime.HELD] * len(cases)
    names = [info.name for info in settled_infos(1)]
    standing = {name: value(0.0, 1.0) for name, value in STEADY_SHAFT.items()}
    standing |= dict.fromkeys((
        "shaft.acceleration.max", "power.useful.mean", "power.useful.max", "power.clutch.mean", "power.clutch.max",
        "power.bearing.mean", "power.linear.mean", "power.quadratic.mean", "efficiency", "balance.momentum",
    ), 0.0)  # fmt: skip
    for name, expected in standing.items():
        np.testing.assert_array_equal(settled.values[:, names.index(name)], expected, err_msg=name)
    assert not settled.points[:, SHAFT_SPEED].any()


def test_a_window_in_which_drag_has_stopped_the_shaft_is_settled() -> None:
    """The window has what is left of the speed, the orbit a shaft that stands."""
    still = {"shaft.load": 0.0, "shaft.initial_speed": 30.0, "pendulums.0.backlash": 1.0}
    cases = [drive(1, **still, shaft__bearing_damping=damping) for damping in np.geomspace(0.01, 0.1, 6)]
    cases.append(drive(1, **still, shaft__bearing_damping=1e-3))
    judged = simulate_judged(batch_of(cases), periods(200.0, 160.0, 200.0), cases=len(cases))
    speed = judged.batch.values[:, [info.name for info in result_infos(1)].index("shaft.speed.mean")]
    assert (speed[:-1] > 0.0).all()
    assert judged.off.tolist() == [False] * 6 + [True]


def test_a_resisted_shaft_does_not_turn_back() -> None:
    """A decayed speed has a rounding error of either sign."""
    columns = drive(
        1, shaft__load=0.0, shaft__bearing_damping=0.05, shaft__initial_speed=-1e-30, **pendulum(0, backlash=1.0)
    )
    row = one(columns, periods(4.0, 1.0, 4.0))
    assert row["shaft.speed.min"] == row["shaft.speed.mean"] == row["shaft.speed.max"] == 0.0
    path = trajectory(columns, periods(4.0, 1.0, 4.0), [0.0, 1e-3])
    assert column(path, "shaft.speed").tolist() == [0.0, 0.0]


@pytest.mark.parametrize("share", [0.5, 3.0, 30.0])
def test_a_rectifier_with_a_resistive_load(share: float) -> None:
    """A heavy pendulum swings, a rigid clutch takes the shaft along, a generator on a resistor brakes it: a diode that
    feeds a capacitor and a resistor in parallel (O. H. Schade, Proceedings of the IRE 31, 1943), ``share`` = nu R C.
    """
    nu, top = 2.0 * math.pi * 20.0, 2.0
    columns = {
        "gravity": 0.0, "excitation.frequency": 20.0, "shaft.inertia": J_E, "shaft.load": 0.0, **clutch(1e3, 0.0),
        "shaft.linear_load": J_E * nu / share,
        **pendulum(0, inertia=1e5, mass=0.0, damping=0.0, backlash=0.0, spring_rate=1e5 * nu**2, spring_arm=1.0,
                   initial_angle=-top / nu),
    }  # fmt: skip
    # The clutch opens where the torque J_e omega' + k omega of the shaft is 0, and closes where its decay meets the
    # pendulum's speed again.
    opens = math.pi - math.atan(share)
    closes = brentq(lambda x: math.sin(x) - math.sin(opens) * math.exp(-(x + 2.0 * math.pi - opens) / share), 0.0, 1.5)
    free = math.exp(-(closes + 2.0 * math.pi - opens) / share)
    turn = math.cos(closes) - math.cos(opens) + math.sin(opens) * share * (1.0 - free)
    square = 0.5 * (opens - closes) - 0.25 * (math.sin(2.0 * opens) - math.sin(2.0 * closes))
    square += math.sin(opens) ** 2 * 0.5 * share * (1.0 - free**2)
    row = one(columns, periods(4.0, 1.0, 4.0))
    expected = {
        "shaft.speed.mean": top * turn / (2.0 * math.pi),
        "shaft.speed.max": top,
        "shaft.speed.min": top * math.sin(closes),
        "power.linear.mean": J_E * nu / share * top**2 * square / (2.0 * math.pi),
        "fraction.driven": (opens - closes) / (2.0 * math.pi),
    }
    assert {name: row[name] for name in expected} == pytest.approx(expected, rel=1e-6)


# Clutches with damping and drag, between a pendulum and a shaft that nothing else moves.


def free_pair(**changes: float) -> Columns:
    """A pendulum that turns freely with 6 rad/s beside a free shaft at rest."""
    return {
        "gravity": 0.0, "excitation.frequency": 20.0, "shaft.inertia": J_E, "shaft.load": 0.0, **clutch(0.0, 200.0),
        **pendulum(0, spring_rate=0.0, damping=0.0, backlash=0.0, initial_speed=6.0),
    } | changes  # fmt: skip


@pytest.mark.parametrize("damping", [0.02, 0.2, 0.6])
@pytest.mark.parametrize("backlash", [0.0, 0.01])
def test_restitution_of_a_damped_clutch(damping: float, backlash: float) -> None:
    """A linear dashpot beside a linear spring that must not pull (Schwager and Poeschel, 2007)."""
    together = 1e-3 * J_E / (1e-3 + J_E)
    rate, frequency = damping / (2.0 * together), math.sqrt(200.0 / together)
    share = rate / frequency
    assert share < 1.0
    slower = frequency * math.sqrt(1.0 - share**2)
    restitution = math.exp(-rate / slower * 2.0 * math.acos(share))
    columns = free_pair(**{"pendulums.0.clutch_damping": damping, "pendulums.0.backlash": backlash})
    row = one(columns, periods(1.0, 0.0, 1.0))
    assert row["shaft.speed.max"] == pytest.approx((1.0 + restitution) * 6.0 * 1e-3 / (1e-3 + J_E), rel=1e-9)
    assert row["pendulums.0.speed.min"] == pytest.approx(6.0 * (1e-3 - restitution * J_E) / (1e-3 + J_E), abs=1e-9)
    lost = 0.5 * together * 36.0 * (1.0 - restitution**2)
    assert row["pendulums.0.power.clutch_loss"] / 20.0 == pytest.approx(lost, rel=1e-9)
    engaged = 2.0 * math.acos(share) / slower
    assert row["pendulums.0.fraction.engaged"] / 20.0 == pytest.approx(engaged, rel=1e-9)
    assert row["balance.energy"] < 1e-9


def test_a_damped_clutch_does_not_pull() -> None:
    cases = damped(1, 31, 60)
    for case, columns in enumerate(cases[:10]):
        times = np.linspace(0.0, 12.0, 4001) / columns["excitation.frequency"]
        path = trajectory(columns, periods(12.0, 4.0, 12.0), times)
        states = np.array(path.states["pendulums.0"])
        torque = column(path, "pendulums.0.torque")
        assert torque[(states != "free")].min() > -1e-12, case
        assert torque[states == "free"].max(initial=0.0) <= 1e-12, case
        assert column(path, "shaft.speed").min() >= 0.0


def test_drag_of_an_overrunning_clutch_slows_the_shaft_and_takes_the_pendulum_along() -> None:
    drag = 1e-3
    columns = free_pair(**{
        "pendulums.0.initial_speed": 0.0, "shaft.initial_speed": 8.0, "pendulums.0.overrunning_damping": drag,
    })  # fmt: skip
    times = np.linspace(0.0, 2.0, 41)
    path = trajectory(columns, Run(duration=Span(2.0, "s")), times)
    relative = 8.0 * np.exp(-drag * (1.0 / 1e-3 + 1.0 / J_E) * times)
    np.testing.assert_allclose(column(path, "pendulums.0.speed"), (8.0 - relative) * J_E / (1e-3 + J_E), atol=1e-9)
    np.testing.assert_allclose(column(path, "shaft.speed") - column(path, "pendulums.0.speed"), relative, rtol=1e-8)
    np.testing.assert_allclose(column(path, "pendulums.0.torque"), -drag * relative, rtol=1e-8)
    np.testing.assert_allclose(column(path, "power.loss"), drag * relative**2, rtol=1e-8)


def test_a_backstop_holds_the_shaft_against_drag() -> None:
    columns = drive(1, shaft__load=0.0, **pendulum(0, overrunning_damping=5e-3, backlash=1.0))
    path = trajectory(columns, periods(20.0, 10.0, 20.0), np.linspace(0.0, 1.0, 2001))
    assert column(path, "pendulums.0.torque").min() < 0.0
    assert column(path, "shaft.speed").min() == 0.0
    assert "held" in path.states["shaft"]
    row = one(columns, periods(20.0, 10.0, 20.0))
    assert max(row["balance.energy"], row["balance.momentum"]) < 1e-9


def test_settled_motion_with_damped_clutches() -> None:
    cases = [
        drive(1, shaft__load=load, pendulums__0__clutch_damping=k, pendulums__0__overrunning_damping=o)
        for load, k, o in ((0.1, 0.02, 0.0), (0.1, 0.0, 1e-3), (0.0, 0.05, 1e-3), (0.3, 0.1, 5e-4))
    ]
    settled = settle(batch_of(cases), SettledRun(), cases=len(cases))
    names = [info.name for info in settled_infos(1)]
    long = Results(batch_of(cases), periods(4000.0, 3040.0, 4000.0), len(cases))
    assert settled.regimes.tolist() == [Regime.PERIODIC] * len(cases)
    for name in ("shaft.speed.mean", "power.useful.mean", "power.loss.mean", "pendulums.0.power.clutch_loss"):
        np.testing.assert_allclose(settled.values[:, names.index(name)], long[name], rtol=1e-8, err_msg=name)
