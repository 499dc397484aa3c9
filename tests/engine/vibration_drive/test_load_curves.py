"""Loads that are no polynomials of the speed (docs/theory.md, "The load"): Stribeck's, and those with the angle."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from sprag_study.engine.endings import Ending
from sprag_study.engine.run import Reset, Run, SettledRun, Span
from sprag_study.engine.vibration_drive.parameters import CURVE
from sprag_study.engine.vibration_drive.regimes import Regime, settled_infos
from sprag_study.engine.vibration_drive.settle import settle
from sprag_study.engine.vibration_drive.simulate import trajectory
from sprag_study.engine.vibration_drive.start_states import end_state
from sprag_study.engine.vibration_drive.transients import simulate_judged
from tests.engine.odd_drives import odd_drive
from tests.engine.vibration_drive.drive import Columns, Results, batch_of, column, drive, one, pendulum, periods
from tests.engine.vibration_drive.test_against_scipy import compare
from tests.engine.vibration_drive.test_balances import random_machines
from tests.engine.vibration_drive.test_drag import J_E, damped, running_down


def bent(pendulums: int, seed: int, cases: int) -> list[Columns]:
    """Random machines whose loads fall with the speed, or swing with the angle of the shaft, or both."""
    draw = np.random.default_rng(seed)
    machines = damped(pendulums, seed, cases)
    for number, columns in enumerate(machines):
        if (seed + number) % 3 != 1:
            columns |= {
                "shaft.stribeck_load": draw.uniform(0.01, 0.3),
                "shaft.stribeck_speed": 10.0 ** draw.uniform(-1.0, 1.5),
            }
        if (seed + number) % 3 != 2:
            columns |= {
                "shaft.cyclic_load": draw.choice([draw.uniform(0.1, 1.0), 1.0]),
                "shaft.load_cycles": draw.integers(1, 60),
                "shaft.load_phase": draw.uniform(-7.0, 7.0),
            }
    return machines


def table(*rows: tuple[float, float]) -> Columns:
    """A load that is given as a table over the speed."""
    named = [{"speed": speed, "torque": torque} for speed, torque in rows]
    return {f"shaft.load_table.{k}.{name}": value for k, row in enumerate(named) for name, value in row.items()}


def tabled(pendulums: int, seed: int, cases: int) -> list[Columns]:
    """Random machines whose loads are tables over the speed, beside other loads or alone."""
    draw = np.random.default_rng(seed)
    machines = damped(pendulums, seed, cases)
    for number, columns in enumerate(machines):
        speeds = np.sort(draw.uniform(0.0, 40.0, draw.integers(1, 7)))
        speeds[0] *= draw.choice([0.0, 1.0])
        torques = draw.uniform(0.0, 0.3, speeds.size) * draw.choice([1.0, 1.0, 0.0], speeds.size)
        columns.update(table(*zip(speeds.tolist(), torques.tolist(), strict=True)))
        if (seed + number) % 3 == 0:
            columns |= {"shaft.stribeck_load": 0.1, "shaft.stribeck_speed": 2.0}
    return machines


@pytest.mark.parametrize("number", range(3))
def test_an_independent_integrator_agrees_on_tables(number: int) -> None:
    (columns,) = tabled(1, 500 + number, 1)
    if not compare(columns, "literal" if number == 2 else "contact", 1e-9):
        pytest.skip("too sensitive to conclude anything")


@pytest.mark.parametrize("number", range(6))
def test_an_independent_integrator_agrees(number: int) -> None:
    (columns,) = bent(1, 500 + number, 1)
    if not compare(columns, "literal" if number % 6 == 5 else "contact", 1e-9):
        pytest.skip("too sensitive to conclude anything")


@pytest.mark.parametrize("reset", ["contact", "literal"])
def test_balances_close(reset: Reset) -> None:
    cases = bent(1, 21, 60)
    results = Results(batch_of([{**dict.fromkeys(_NOTHING, 0.0), **_ORDINARY, **case} for case in cases]),
                      periods(12.35, 4.0, 12.35, reset=reset), len(cases))  # fmt: skip
    assert set(results.endings) == {Ending.OK}
    assert results["balance.energy"].max() < 1e-8
    assert results["balance.momentum"].max() < 1e-8
    polynomial = results["power.linear.mean"] + results["power.quadratic.mean"]
    polynomial += np.array([case["shaft.load"] for case in cases]) * results["shaft.speed.mean"]
    assert (np.abs(results["power.useful.mean"] - polynomial) > 0.01 * results["power.useful.mean"]).sum() > 20


_NOTHING = ("shaft.stribeck_load", "shaft.cyclic_load", "shaft.load_phase")
_ORDINARY = {"shaft.stribeck_speed": 1.0, "shaft.load_cycles": 1.0}


def test_terms_that_are_zero_change_no_bit() -> None:
    cases = random_machines(1, 12, 24)
    run = periods(12.0, 4.0, 12.0)
    zero = dict.fromkeys((f"shaft.{name}" for name in CURVE), 0.0) | _ORDINARY
    given = Results(batch_of(cases) | zero, run, len(cases))
    np.testing.assert_array_equal(given.values, Results(batch_of(cases), run, len(cases)).values)


def test_odd_drives_run_to_the_end() -> None:
    """Exact equilibria, copies and clutches that lock, against loads that fall and swing."""
    draw = np.random.default_rng(9)
    cases = [odd_drive(draw, 1) for _ in range(60)]
    for columns in cases:
        columns["shaft.stribeck_load"] = draw.choice([0.0, 10.0 ** draw.uniform(-3.0, 0.0)])
        columns["shaft.stribeck_speed"] = 10.0 ** draw.uniform(-3.0, 1.0)
        columns["shaft.cyclic_load"] = draw.choice([0.0, 0.5, 1.0])
        columns["shaft.load_cycles"] = draw.choice([1.0, 7.0])
        columns["shaft.load_phase"] = draw.choice([0.0, math.pi])
    results = Results(batch_of(cases), periods(30.0, 20.0, 30.0), len(cases))
    assert set(results.endings) == {Ending.OK}
    moving = results["power.input.mean"] > 1e-6
    assert moving.sum() > 20
    assert results["balance.energy"][moving].max() < 1e-6
    assert results["balance.momentum"][moving].max() < 1e-6


# A shaft that runs down by itself.


def test_stribeck_run_down() -> None:
    """exp(omega/omega_s) falls in proportion to the time."""
    torque, scale = 0.06, 8.0
    stop = J_E * scale / torque * (math.exp(30.0 / scale) - 1.0)
    times = np.linspace(0.0, 1.2 * stop, 61)
    columns = running_down(**{"shaft.stribeck_load": torque, "shaft.stribeck_speed": scale})
    path = trajectory(columns, Run(duration=Span(1.3 * stop, "s")), times)
    left = np.maximum(math.exp(30.0 / scale) - torque * times / (J_E * scale), 1.0)
    np.testing.assert_allclose(column(path, "shaft.speed"), scale * np.log(left), rtol=1e-8, atol=1e-8)
    assert set(np.array(path.states["shaft"])[times > stop]) == {"held"}
    row = one(columns, Run(duration=Span(1.3 * stop, "s"), window=(Span(0.0, "s"), Span(1.2 * stop, "s"))))
    assert row["fraction.held"] == pytest.approx(0.2 / 1.2, rel=1e-8)
    assert row["power.useful.mean"] * 1.2 * stop == pytest.approx(0.5 * J_E * 900.0, rel=1e-9)
    # The power M_s omega exp(-omega/omega_s) is largest at omega_s, which is passed.
    assert row["power.useful.max"] == pytest.approx(torque * scale / math.e, rel=1e-9)


@pytest.mark.parametrize("scale", [1.0, 0.01, 1e-3, 1e-6])
def test_a_load_that_acts_at_the_end_of_a_run_down_only(scale: float) -> None:
    """Beside a dry load w + omega_s ln(1 + (M_s/M_c) exp(-w/omega_s)) falls in proportion to the time."""
    dry, torque = 0.06, 0.3
    stop = J_E / dry * (30.0 - scale * math.log((1.0 + torque / dry) / (1.0 + torque / dry * math.exp(-30.0 / scale))))
    columns = running_down(**{"shaft.load": dry, "shaft.stribeck_load": torque, "shaft.stribeck_speed": scale})
    row = one(columns, Run(duration=Span(1.5 * stop, "s"), window=(Span(0.0, "s"), Span(1.5 * stop, "s"))))
    assert 1.5 * (1.0 - row["fraction.held"]) == pytest.approx(1.0, rel=1e-10)


def test_run_down_along_a_table() -> None:
    """On a line t_1 + s (omega - omega_1) the shaft takes (J/s) ln(T_0/T) from torque T_0 to T, and J/T a speed where
    the torque is constant; the torque at the ends of the table holds beyond them.
    """
    rows = ((5.0, 0.02), (10.0, 0.05), (20.0, 0.01))
    columns = running_down(**table(*rows))
    lasts = [J_E / 0.01 * 10.0]  # from 30 to 20 rad/s
    for (low, first), (high, second) in itertools.pairwise(rows):
        lasts.append(J_E * (high - low) / (second - first) * math.log(second / first))
    lasts.append(J_E / 0.02 * 5.0)
    stop = sum(lasts)
    row = one(columns, Run(duration=Span(1.5 * stop, "s"), window=(Span(0.0, "s"), Span(1.5 * stop, "s"))))
    assert 1.5 * (1.0 - row["fraction.held"]) == pytest.approx(1.0, rel=1e-11)
    assert row["power.useful.mean"] * 1.5 * stop == pytest.approx(0.5 * J_E * 900.0, rel=1e-11)
    # (0.09 - 0.004 omega) omega, on the line that falls, is largest within it.
    assert row["power.useful.max"] == pytest.approx(0.09**2 / (4.0 * 0.004), rel=1e-11)
    assert row["run.events"] == 1.0  # it stops
    path = trajectory(columns, Run(duration=Span(1.5 * stop, "s")), np.linspace(0.0, 1.5 * stop, 101))
    speed = column(path, "shaft.speed")
    np.testing.assert_allclose(
        column(path, "power.useful"), speed * np.interp(speed, *zip(*rows, strict=True)), rtol=1e-12, atol=1e-15
    )


def test_tables_are_the_lines_that_they_are_on() -> None:
    """A table of a constant, and one of a line, are the loads that have terms of their own."""
    constant, line = (
        table(*((speed, torque(speed)) for speed in (0.0, 5.0, 7.0, 300.0)))
        for torque in (lambda speed: 0.2, lambda speed: 0.1 + 0.02 * speed)
    )
    cases = [drive(1, shaft__load=0.05) | constant | {"shaft.load_factor": 0.5},
             drive(1, shaft__load=0.0) | line | {"shaft.load_factor": 1.0}]  # fmt: skip
    same = [drive(1, shaft__load=0.15), drive(1, shaft__load=0.1, shaft__linear_load=0.02)]
    run = periods(30.0, 15.0, 30.0)
    for given, meant in zip(cases, same, strict=True):
        row, other = one(given, run), one(meant, run)
        for name in ("shaft.speed.mean", "power.useful.mean", "torque.max", "power.useful.max", "efficiency"):
            assert row[name] == pytest.approx(other[name], rel=1e-9), name
        assert max(row["balance.energy"], row["balance.momentum"]) < 1e-10
    settled = settle(batch_of(cases), SettledRun(), cases=2)
    plain = settle(batch_of([{"shaft.linear_load": 0.0} | case for case in same]), SettledRun(), cases=2)
    assert settled.regimes.tolist() == plain.regimes.tolist() == [Regime.PERIODIC] * 2
    np.testing.assert_allclose(settled.values[:, 0], plain.values[:, 0], rtol=1e-8)


def test_run_down_against_a_cyclic_load() -> None:
    """The work against the load up to an angle is what the shaft has lost."""
    load, share, cycles, phase = 0.05, 0.8, 3.0, 0.4
    columns = running_down(**{
        "shaft.load": load, "shaft.cyclic_load": share, "shaft.load_cycles": cycles, "shaft.load_phase": phase,
    })  # fmt: skip
    path = trajectory(columns, Run(duration=Span(2.0, "s")), np.linspace(0.0, 2.0, 201))
    angle, speed = column(path, "shaft.angle"), column(path, "shaft.speed")
    work = load * (angle + share / cycles * (np.sin(cycles * angle + phase) - math.sin(phase)))
    np.testing.assert_allclose(0.5 * J_E * (900.0 - speed**2), work, rtol=1e-9)
    assert (speed[-1], path.states["shaft"][-1]) == (0.0, "held")
    at = load * (1.0 + share * np.cos(cycles * angle + phase))
    np.testing.assert_allclose(column(path, "power.useful"), at * speed, rtol=1e-12, atol=1e-15)


# A load at rest.


@pytest.mark.parametrize("path", ["shaft.stribeck_load", "shaft.cyclic_load"])
def test_a_load_holds_what_it_has_at_rest(path: str) -> None:
    run = periods(40.0, 0.0, 40.0)
    held = drive(1, shaft__load=100.0)
    most = one(held, run)["torque.max"]
    for share, state in ((1.0 + 1e-6, 1.0), (1.0 - 1e-6, 0.0)):
        # Half of what is needed comes from the constant load.
        part = 0.5 * most * share if path == "shaft.stribeck_load" else 1.0
        row = one(held | {"shaft.load": 0.5 * most * share, path: part}, run)
        assert (row["fraction.held"] == 1.0) == bool(state)


# Settled motion, and motion without one.


def test_settled_motion_against_a_stribeck_load() -> None:
    cases = [
        drive(1, shaft__load=load, shaft__stribeck_load=s, shaft__stribeck_speed=w)
        for load, s, w in ((0.1, 0.1, 2.0), (0.0, 0.2, 10.0), (0.2, 0.05, 0.3))
    ]
    settled = settle(batch_of(cases), SettledRun(), cases=len(cases))
    names = [info.name for info in settled_infos(1)]
    long = Results(batch_of(cases), periods(2000.0, 1520.0, 2000.0), len(cases))
    assert settled.regimes.tolist() == [Regime.PERIODIC] * len(cases)
    for name in ("shaft.speed.mean", "power.useful.mean", "power.useful.max", "efficiency"):
        np.testing.assert_allclose(settled.values[:, names.index(name)], long[name], rtol=1e-8, err_msg=name)


def test_a_drive_may_run_on_against_a_load_from_which_it_cannot_start() -> None:
    columns = drive(1, shaft__load=0.05, shaft__stribeck_load=3.0, shaft__stribeck_speed=1.0)
    both = settle(batch_of([columns | {"shaft.initial_speed": speed} for speed in (0.0, 15.0)]), SettledRun(), cases=2)
    names = [info.name for info in settled_infos(1)]
    speeds = both.values[:, names.index("shaft.speed.mean")]
    assert speeds[0] == 0.0
    assert both.regimes[1] == Regime.PERIODIC
    # The load has all but vanished at this speed: the drive runs as without it.
    alone = settle(columns | {"shaft.stribeck_load": 0.0}, SettledRun(), cases=1)
    assert speeds[1] == pytest.approx(alone.values[0, names.index("shaft.speed.mean")], rel=1e-3)


def test_a_load_that_swings_with_the_angle_has_no_settled_motion() -> None:
    columns = drive(1, shaft__cyclic_load=0.5)
    with pytest.raises(ValueError, match="swings with the angle"):
        settle(columns, SettledRun(), cases=1)
    both = batch_of([columns, drive(1, shaft__cyclic_load=0.0)])
    judged = simulate_judged(both, periods(4.0, 2.0, 4.0), cases=2)
    assert judged.off.tolist() == [False, True]
    assert judged.spent[0] == 0.0


def test_a_start_goes_on_with_the_cycle_of_the_load() -> None:
    columns = drive(1, shaft__cyclic_load=0.9, shaft__load_cycles=5.0, **pendulum(0))
    first = periods(6.0, 0.0, 6.0)
    further = end_state(columns, first)
    assert further is not None
    whole = one(columns, periods(12.0, 6.0, 12.0))
    rest = one(columns | further, first)
    for name in ("shaft.speed.mean", "power.useful.mean", "torque.max"):
        assert rest[name] == pytest.approx(whole[name], rel=1e-7), name
