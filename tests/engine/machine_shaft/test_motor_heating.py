"""What a motor warms by: closed forms, an independent integrator over time, and a worked example of a textbook."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.machine_shaft.simulate import simulate
from sprag_study.engine.machine_shaft.spec import Drive, MachineSpec, OperationChoice
from sprag_study.engine.machine_shaft.tables import Table
from tests.engine.machine_shaft.machines import NAMES, one

TURN = 2.0 * math.pi
HEATING = ("motor.torque.rms", "motor.power.rms", "motor.torque.margin")


def driven(rows: tuple[tuple[float, float], ...], **numbers: float) -> dict[str, float]:
    """Results of a shaft with a driving torque by shares of the turn, against a constant load."""
    table = Table(tuple((TURN * share, torque) for share, torque in rows), "linear")
    spec = MachineSpec(balance_side="operation", drive=Drive("table", table=table))
    return one(spec, {"mean_speed": 10.0, "drive.inertia": 1e12} | numbers)


def test_two_torques_at_constant_speed() -> None:
    """120 N*m for a quarter of the time and 40 N*m braking for the rest."""
    got = driven(((0.0, 120.0), (0.25, 120.0), (0.25, -40.0), (1.0, -40.0), (1.0, 120.0)))
    whole = math.sqrt(0.25 * 120.0**2 + 0.75 * 40.0**2)
    assert got["motor.torque.rms"] == pytest.approx(whole, rel=1e-9)
    assert got["motor.power.rms"] == pytest.approx(10.0 * whole, rel=1e-9)
    assert got["motor.torque.mean"] == pytest.approx(0.0, abs=1e-10)


def test_three_torques_by_the_time_in_which_they_act() -> None:
    """Under a constant load the square of the speed is linear in the angle, so times and powers are closed forms."""
    levels = ((0.25, 90.0), (0.5, -10.0), (0.25, 20.0))
    rows = ((0.0, 90.0), (0.25, 90.0), (0.25, -10.0), (0.75, -10.0), (0.75, 20.0), (1.0, 20.0), (1.0, 90.0))
    got = driven(rows, **{"drive.inertia": 2.0})
    load = got["resisting_torque.mean"]
    assert load == pytest.approx(-22.5)
    now, time, squares, powers = got["omega.start"], 0.0, 0.0, 0.0
    for share, torque in levels:
        after = math.sqrt(now**2 + (torque + load) * share * TURN)
        step = 2.0 * share * TURN / (now + after)
        time, squares = time + step, squares + step * torque**2
        powers += torque**2 * share * TURN * 2.0 / 3.0 * (now**2 + now * after + after**2) / (now + after)
        now = after
    assert got["motor.torque.rms"] == pytest.approx(math.sqrt(squares / time), rel=1e-12)
    assert got["motor.power.rms"] == pytest.approx(math.sqrt(powers / time), rel=1e-12)
    over_angle = math.sqrt(sum(share * torque**2 for share, torque in levels))
    assert abs(got["motor.torque.rms"] / over_angle - 1.0) > 0.02


def test_a_motor_behind_a_gear_against_an_integrator_over_time() -> None:
    numbers = {
        "drive.motor.synchronous_speed": 150.0, "drive.motor.breakdown_torque": 60.0, "drive.motor.breakdown_slip": 0.2,
        "drive.motor.rated_torque": 30.0, "drive.inertia": 0.8, "drive.stages.0.ratio": 5.0,
        "drive.stages.0.efficiency": 0.9,
    }  # fmt: skip
    load = OperationChoice("torque", "formula", formula="90 + 110*sin(phi)")
    spec = MachineSpec(balance="motor", drive=Drive(motor="kloss", stages=("gear",)), operation=load)
    got = one(spec, numbers)

    def torque(omega: float) -> float:
        slip = 1.0 - 5.0 * omega / 150.0
        return 2.0 * 60.0 / (slip / 0.2 + 0.2 / slip)

    def rates(_: float, state: NDArray[Any]) -> list[float]:
        phi, omega = float(state[0]), float(state[1])
        own = torque(omega)
        passed = 5.0 * own * (0.9 if own >= 0.0 else 1.0 / 0.9)
        return [omega, (passed - 90.0 - 110.0 * math.sin(phi)) / 0.8, own**2, (5.0 * omega * own) ** 2]

    def turned(_: float, state: NDArray[Any]) -> float:
        return float(state[0]) - TURN

    turned.terminal = True  # type: ignore[attr-defined]
    run = solve_ivp(
        rates, (0.0, 1.0), [0.0, got["omega.start"], 0.0, 0.0], "DOP853", events=turned, rtol=1e-12, atol=1e-12
    )
    (end,), (time,) = run.y_events[0], run.t_events[0]
    assert end[1] == pytest.approx(got["omega.start"], rel=1e-9)
    assert got["irregularity"] > 0.05
    assert got["motor.torque.rms"] == pytest.approx(math.sqrt(end[2] / time), rel=1e-9)
    assert got["motor.power.rms"] == pytest.approx(math.sqrt(end[3] / time), rel=1e-9)
    assert got["motor.torque.margin"] == pytest.approx(30.0 / math.sqrt(end[2] / time), rel=1e-9)
    assert got["motor.torque.rms"] > got["motor.torque.mean"]
    del numbers["drive.motor.rated_torque"]
    unrated = one(spec, numbers)
    assert math.isnan(unrated.pop("motor.torque.margin"))
    assert unrated == {name: pytest.approx(got[name], rel=0, abs=0, nan_ok=True) for name in unrated}


def test_a_constant_speed_drive_with_regeneration() -> None:
    """Power up to 400 kW in 5 min, 500 kW for 5 min, 400 kW returned for 4 min, 2 min idle: a motor of 367 kW.

    G. K. Dubey, *Fundamentals of Electrical Drives*, chapter 4. A minute of the example is a second here.
    """
    speed = TURN / 16.0
    powers = ((0, 0), (5, 400e3), (5, 500e3), (10, 500e3), (10, -400e3), (14, -400e3), (14, 0), (16, 0))
    got = driven(tuple((time / 16.0, power / speed) for time, power in powers), mean_speed=speed)
    assert got["motor.power.rms"] == pytest.approx(367e3, abs=500.0)
    assert got["motor.torque.rms"] * speed == pytest.approx(got["motor.power.rms"], rel=1e-4)


def test_no_heating_without_a_motion() -> None:
    stalled = MachineSpec(balance="motor", drive=Drive(motor="linear"), operation=OperationChoice("torque", "constant"))
    numbers = {
        "drive.inertia": 1.0, "drive.motor.no_load_speed": 10.0, "drive.motor.stall_torque": 5.0,
        "drive.motor.rated_torque": 4.0, "operation.value": 6.0,
    }  # fmt: skip
    light = MachineSpec(operation=OperationChoice("torque", "formula", formula="100*sin(phi)"))
    for spec, own, ending in (
        (stalled, numbers, Ending.MOTOR_STALLED),
        (light, {"mean_speed": 1.0, "drive.inertia": 1e-3}, Ending.INERTIA_INSUFFICIENT),
    ):
        batch = simulate(spec, own, cases=1)
        assert ENDINGS[batch.endings[0]] is ending
        values = dict(zip(NAMES, batch.values[0], strict=True))
        assert np.isnan([values[name] for name in HEATING]).all()
