"""Pendulums that turn over: exact and published solutions, random drives against scipy, and every view of them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import root

from benchmarks.rotating import missed, rotating_drives
from sprag_study.engine.continuation.follow import Range
from sprag_study.engine.continuation.problem import Kind
from sprag_study.engine.run import Run, SettledRun, Span
from sprag_study.engine.vibration_drive.branches import branch
from sprag_study.engine.vibration_drive.force_results import Bearing
from sprag_study.engine.vibration_drive.forces import settled_forces
from sprag_study.engine.vibration_drive.no_load import limit_speed
from sprag_study.engine.vibration_drive.portrait import settled_portrait
from sprag_study.engine.vibration_drive.regimes import Regime, settled_infos
from sprag_study.engine.vibration_drive.results import orbit_infos
from sprag_study.engine.vibration_drive.sections import sections
from sprag_study.engine.vibration_drive.settle import SettledBatch, settle
from sprag_study.engine.vibration_drive.starts import settle_starts, started_infos
from sprag_study.engine.vibration_drive.strobes import ANGLE, SHAFT_WIDTH
from sprag_study.engine.vibration_drive.sweep import sweep
from sprag_study.engine.vibration_drive.transients import simulate_judged
from tests.engine.vibration_drive.drive import clutch

Floats = NDArray[np.float64]

#: A pendulum without gravity on an axis that moves on a circle of radius d: it turns with the axis (Belyakov, 2011).
NU, D, MASS, ARM, INERTIA, DAMPING, STIFFNESS, SHAFT = 2.0 * math.pi * 25.0, 3e-3, 0.5, 0.03, 6e-4, 2e-3, 60.0, 4e-4
CIRCLE: dict[str, Any] = {
    "gravity": 0.0,
    "excitation.frequency": 25.0,
    "excitation.amplitude_x": D,
    "excitation.amplitude_y": D,
    "pendulums.0.inertia": INERTIA,
    "pendulums.0.mass": MASS,
    "pendulums.0.arm": ARM,
    "pendulums.0.damping": DAMPING,
    "pendulums.0.initial_speed": NU,
    "pendulums.0.initial_angle": -2.0,
    "shaft.inertia": SHAFT,
    "shaft.initial_speed": NU,
    **clutch(0.0, STIFFNESS),
}
#: The torque of the vibration at most, and the load at which the pendulum falls out of step.
LARGEST = MASS * ARM * D * NU**2
CAPACITY = LARGEST - DAMPING * NU


def _value(batch: SettledBatch, name: str, case: int = 0) -> float:
    pendulums = batch.windings.shape[1]
    return float(batch.values[case, [info.name for info in settled_infos(pendulums)].index(name)])


def test_a_pendulum_turns_with_an_axis_that_moves_on_a_circle() -> None:
    """Angle nu t + c, with cos c = -(load + lambda nu)/(M l d nu^2); all torques are constant."""
    load = 0.6 * CAPACITY
    batch = settle(CIRCLE | {"shaft.load": load}, SettledRun(), cases=1)
    assert Regime(int(batch.regimes[0])) is Regime.PERIODIC
    assert (batch.orders.tolist(), batch.windings.tolist()) == ([1], [[1]])
    phase = -math.acos(-(load + DAMPING * NU) / LARGEST)
    assert batch.points[0, SHAFT_WIDTH + ANGLE] == pytest.approx(phase, abs=1e-9)
    expected = {
        "shaft.speed.mean": NU, "shaft.speed.max": NU, "pendulums.0.speed.min": NU, "pendulums.0.torque.max": load,
        "pendulums.0.windup.max": load / STIFFNESS, "power.input.mean": (load + DAMPING * NU) * NU,
        "power.loss.mean": DAMPING * NU**2, "efficiency": load / (load + DAMPING * NU),
        "pendulums.0.fraction.engaged": 1.0,
    }  # fmt: skip
    for name, value in expected.items():
        assert _value(batch, name) == pytest.approx(value, rel=1e-9), name
    for name in ("mean", "max", "min", "amplitude"):
        assert math.isnan(_value(batch, f"pendulums.0.angle.{name}"))
    assert _value(batch, "balance.energy") < 1e-12
    # Small disturbances of angle, speed, windup and shaft speed.
    rates = np.array(
        [
            [0.0, 1.0, 0.0, 0.0],
            [LARGEST * math.sin(phase) / INERTIA, -DAMPING / INERTIA, -STIFFNESS / INERTIA, 0.0],
            [0.0, 1.0, 0.0, -1.0],
            [0.0, 0.0, STIFFNESS / SHAFT, 0.0],
        ]
    )
    multiplier = np.abs(np.linalg.eigvals(expm(rates / 25.0))).max()
    assert _value(batch, "regime.multiplier") == pytest.approx(multiplier, abs=1e-6)


def test_the_capacity_is_where_a_sweep_and_a_branch_say() -> None:
    loads = CAPACITY * np.array([0.6, 0.8, 0.9, 0.95, 0.98, 0.995, 0.9992, 1.0008, 1.002])
    steps = np.arange(len(loads))
    line = sweep({**CIRCLE, "shaft.load": loads}, SettledRun(), steps[None, :], "shaft.load")
    turns = line.batch.windings[:, 0]
    assert turns.tolist() == [1] * 7 + [0, 0]
    assert line.jumped.tolist() == [False] * 7 + [True, False]

    def machines(values: Floats) -> dict[str, Any]:
        return {**CIRCLE, "shaft.load": values}

    along = Range(0.5 * CAPACITY, 1.05 * CAPACITY, first=0.1, most=0.3)
    made = branch(machines, 0.6 * CAPACITY, SettledRun(), along, (0.0, np.inf))
    (fold,) = [special for special in made.specials if special.kind is Kind.FOLD]
    assert fold.parameter == pytest.approx(CAPACITY, rel=1e-7)
    names = [info.name for info in orbit_infos(1)]
    np.testing.assert_allclose(made.values[:, names.index("shaft.speed.mean")], NU, rtol=1e-9)
    assert np.isnan(made.values[:, names.index("pendulums.0.angle.amplitude")]).all()


def test_what_resists_by_the_speed_counts_at_the_speed_of_the_axis() -> None:
    """k_1 nu + k_2 nu^2 + lambda_e nu stand for the load."""
    share = 0.2 * CAPACITY
    resisting = {
        "shaft.linear_load": share / NU, "shaft.quadratic_load": share / NU**2, "shaft.bearing_damping": share / NU,
    }  # fmt: skip
    batch = settle(CIRCLE | resisting | {"shaft.load": 0.0}, SettledRun(), cases=1)
    assert batch.windings.tolist() == [[1]]
    assert _value(batch, "torque.mean") == pytest.approx(0.6 * CAPACITY, rel=1e-9)
    assert batch.points[0, SHAFT_WIDTH + ANGLE] == pytest.approx(-math.acos(-(0.6 * CAPACITY + DAMPING * NU) / LARGEST))


def test_without_a_load_the_shaft_coasts_at_the_speed_of_the_axis() -> None:
    batch = settle(CIRCLE, SettledRun(), cases=1)
    assert Regime(int(batch.regimes[0])) is Regime.COASTING
    assert batch.windings.tolist() == [[1]]
    assert _value(batch, "shaft.speed.mean") == pytest.approx(NU, rel=1e-9)


def test_the_limit_of_a_vanishing_load_of_a_pendulum_that_turns_over() -> None:
    """Speed 3 + sin t: a shaft of the speed w is behind for a part of the turn, or below 2 rad/s all the time."""
    times = np.linspace(0.0, 2.0 * math.pi, 4097)
    motion = times, 3.0 * times - np.cos(times), 3.0 + np.sin(times), np.cos(times)
    assert limit_speed(*motion, 0.0) == pytest.approx(4.0, rel=1e-9)
    # By integration over the part in which sin t > w - 3.
    w = 2.5
    begin, end = math.asin(w - 3.0), math.pi - math.asin(w - 3.0)
    covered = (3.0 - w) * (end - begin) - math.cos(end) + math.cos(begin)
    assert limit_speed(*motion, covered) == pytest.approx(w, rel=1e-9)
    assert limit_speed(*motion, 2.0 * math.pi + 0.1) == pytest.approx(2.0, rel=1e-6)


def test_rotating_orbits_are_those_of_scipy() -> None:
    """From the orbit's point an independent integrator comes back to it, up to the whole turns."""
    columns = rotating_drives(30, seed=5)
    batch = settle(columns, SettledRun(), cases=30)
    chosen = np.flatnonzero(np.any(batch.windings != 0, axis=1) & (batch.orders <= 4))
    assert len(chosen) >= 6
    for case in chosen.tolist():
        assert missed(columns, batch, case) < 1e-8, case


def _fold_of_rotation(h: float, omega: float, begin: Floats) -> float:
    """The least p with which theta'' + h theta' + (1 + p cos(omega t)) sin(theta) = 0 turns once in a period.

    Shooting by scipy from (theta, theta', p); at the fold the derivative of the image has the eigenvalue 1.
    """
    period = 2.0 * math.pi / omega

    def rates(t: float, y: Floats, p: float) -> list[float]:
        rise = 1.0 + p * math.cos(omega * t)
        pull = -rise * math.cos(y[0])
        return [
            y[1], -h * y[1] - rise * math.sin(y[0]),
            y[4], y[5], pull * y[2] - h * y[4], pull * y[3] - h * y[5],
        ]  # fmt: skip

    def missed(z: Floats) -> list[float]:
        y0 = [z[0], z[1], 1.0, 0.0, 0.0, 1.0]
        end = solve_ivp(rates, (0.0, period), y0, method="DOP853", rtol=1e-12, atol=1e-13, args=(z[2],)).y[:, -1]
        (a, b), (c, d) = end[2:4], end[4:6]
        return [end[0] - z[0] - 2.0 * math.pi, end[1] - z[1], (1.0 - a) * (1.0 - d) - b * c]

    solved = root(missed, begin, tol=1e-12)
    assert solved.success
    return float(solved.x[2])


def test_a_parametric_pendulum_falls_out_of_step_where_scipy_and_a_perturbation_say() -> None:
    """To first order at p = 2 h omega (Lenci, Pavlovskaia, Rega, Wiercigroch, 2008); the held shaft leaves the pendulum
    alone. It hangs, and turns against the shaft: theta = -phi.
    """
    h, omega, own = 0.1, 2.0, math.sqrt(9.80665 / 0.1)
    nu = omega * own

    def machines(p: Floats) -> dict[str, Any]:
        return {
            "excitation.frequency": nu / (2.0 * math.pi), "excitation.amplitude_y": p * 9.80665 / nu**2,
            # y'' = p g cos(nu t)
            "excitation.phase": -0.5 * math.pi, "pendulums.0.inertia": 0.01, "pendulums.0.mass": 1.0,
            "pendulums.0.arm": -0.1, "pendulums.0.damping": 0.01 * h * own, "pendulums.0.initial_speed": -nu,
            "pendulums.0.initial_angle": 1.0, "shaft.inertia": 1.0, "shaft.load": 1.0,
            **clutch(0.0, 10.0),
        }  # fmt: skip

    batch = settle(machines(np.array([1.0])), SettledRun(), cases=1)
    assert (Regime(int(batch.regimes[0])), batch.windings.tolist()) == (Regime.HELD, [[-1]])
    assert _value(batch, "power.input.mean") == pytest.approx(_value(batch, "power.loss.mean"), rel=1e-9)
    low = _fold_of_rotation(h, omega, np.array([-0.5 * math.pi, omega, 2.0 * h * omega]))
    assert low == pytest.approx(2.0 * h * omega, rel=0.1)
    steps = np.arange(8)
    p = np.array([1.0, 0.8, 0.65, 0.55, 0.5, 1.02, 1.001, 0.999])
    p[4:] = low * np.array([1.05, 1.01, 1.001, 0.999])
    line = sweep(machines(p), SettledRun(), steps[None, :])
    assert line.batch.windings[:, 0].tolist() == [-1] * 7 + [0]


def test_views_of_a_rotating_pendulum_are_without_whole_turns() -> None:
    case = CIRCLE | {"shaft.load": 0.6 * CAPACITY, "gravity": 9.80665, "excitation.amplitude_y": 0.8 * D}
    batch = settle(case, SettledRun(), cases=1)
    assert batch.windings.tolist() == [[1]]
    portrait = settled_portrait(case, SettledRun())
    angles = portrait.strobes.values[:, portrait.strobes.names.index("pendulums.0.angle")]
    assert np.abs(angles).max() <= math.pi
    assert angles[-1] == pytest.approx(batch.points[0, SHAFT_WIDTH + ANGLE], abs=1e-6)
    turn = portrait.orbit.values[:, portrait.orbit.names.index("pendulums.0.angle")]
    assert turn[-1] - turn[0] == pytest.approx(2.0 * math.pi, abs=1e-7)
    strobes = sections(case, SettledRun(), cases=1, phase=0.75, count=3).strobes[0, :, SHAFT_WIDTH + ANGLE]
    assert abs(strobes[0]) <= math.pi
    assert np.isnan(strobes[1:]).all()
    results = settled_forces(case, SettledRun(), Bearing(), 16).results
    assert results["table.force_y.mean"] == pytest.approx(-MASS * 9.80665, rel=1e-9)
    powers = results["excitation.power_x.mean"] + results["excitation.power_y.mean"]
    assert powers == pytest.approx(_value(batch, "power.input.mean"), rel=1e-9)
    assert results["pendulums.0.spring.force.max"] == 0.0
    # A run of a given time whose window shows the rotation is settled.
    run = Run(duration=Span(90), window=(Span(60), Span(90)))
    assert not simulate_judged(case, run, cases=1).off[0]


def test_starts_whole_turns_apart_make_one_regime() -> None:
    """Whole turns between starts do not count; the axis moves clockwise, so that the shaft is held."""
    clockwise = {"excitation.phase": math.pi, "pendulums.0.initial_speed": -NU, "pendulums.0.initial_angle": -1.4}
    line = CIRCLE | clockwise | {"shaft.load": 2.0, "shaft.initial_speed": 0.0}
    angles = np.array([-1.5, -1.5 + 2.0 * math.pi, -1.3 - 4.0 * math.pi])
    made = settle_starts(line, SettledRun(), {"pendulums.0.initial_angle": angles}, cases=1)
    names = [info.name for info in started_infos(1)]
    row = dict(zip(names, made.values[0].tolist(), strict=True))
    assert (row["regime.count"], row["regime.share"], row["pendulums.0.winding"]) == (1.0, 1.0, -1.0)
