"""Balance of works, motors and their limit cycles."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sprag.engine.endings import Ending
from sprag.engine.machine_shaft.columns import Columns
from sprag.engine.machine_shaft.machine import Machine
from sprag.engine.machine_shaft.motor import motor_torque, steady_speed
from sprag.engine.machine_shaft.spec import Drive, MachineSpec, Motor, OperationChoice
from sprag.engine.machine_shaft.trajectory import trajectory
from tests.engine.machine_shaft.machines import PRESS, PRESS_NUMBERS, ending_of, one

PLAIN = MachineSpec(balance="refuse", operation=OperationChoice("torque", "constant"))
NUMBERS: dict[str, Any] = {"mean_speed": 10.0, "drive.inertia": 2.0, "operation.value": 5.0}
MOTORS: dict[Motor, dict[str, float]] = {
    "linear": {"no_load_speed": 14.0, "stall_torque": 900.0},
    "kloss": {"synchronous_speed": 13.0, "breakdown_torque": 500.0, "breakdown_slip": 0.15},
}


def test_refuse_takes_a_thousandth() -> None:
    assert one(PLAIN, NUMBERS | {"drive.torque": 5.0045})["balance.work"] == pytest.approx(9e-4, rel=1e-2)
    assert ending_of(PLAIN, NUMBERS | {"drive.torque": 5.006}) is Ending.UNBALANCED_WORK
    assert ending_of(PLAIN, NUMBERS) is Ending.UNBALANCED_WORK


def test_scale() -> None:
    spec = replace(PLAIN, balance="scale")
    assert one(spec, NUMBERS | {"drive.torque": 1.0})["drive_torque.mean"] == pytest.approx(5.0, rel=1e-13)
    assert ending_of(spec, NUMBERS | {"drive.torque": -1.0}) is Ending.UNBALANCED_WORK
    assert ending_of(spec, NUMBERS) is Ending.UNBALANCED_WORK
    assert one(spec, {"mean_speed": 10.0, "drive.inertia": 2.0, "operation.value": 0.0})["irregularity"] < 1e-13
    swinging = replace(spec, drive=Drive("formula", formula="sin(phi)"))
    assert ending_of(swinging, NUMBERS) is Ending.UNBALANCED_WORK
    none = one(swinging, NUMBERS | {"operation.value": 0.0})
    assert none["energy.fluctuation"] == pytest.approx(2.0, rel=1e-12)


def test_constant_takes_the_place_of_what_was_given() -> None:
    spec = replace(PLAIN, balance="constant", drive=Drive("formula", formula="100*sin(phi)^2"))
    got = one(spec, NUMBERS)
    assert got["drive_torque.max"] == pytest.approx(5.0, rel=1e-13)
    assert got["drive_torque.min"] == pytest.approx(5.0, rel=1e-13)


@pytest.mark.parametrize("motor", ["linear", "kloss"])
def test_motor_slopes_and_steady_speeds(motor: Motor) -> None:
    values = {name: np.full((1, 1, 1), value) for name, value in MOTORS[motor].items()}
    omega = np.linspace(0.5, 16.0, 40)[None, None, :]
    step = 1e-5
    up, down = motor_torque(motor, values, omega + step)[0], motor_torque(motor, values, omega - step)[0]
    torque, slope = motor_torque(motor, values, omega)
    assert slope == pytest.approx((up - down) / (2 * step), rel=1e-6, abs=1e-6)
    asked = np.linspace(-300.0, 480.0, 20)[None, None, :]
    found = motor_torque(motor, values, steady_speed(motor, values, asked))[0]
    assert found == pytest.approx(asked, abs=1e-9)
    assert np.max(torque) <= 900.0


@pytest.mark.parametrize("motor", ["linear", "kloss"])
@pytest.mark.parametrize(("inertia", "force"), [(0.7, 4e3), (15.0, 2e4)])
def test_limit_cycle_is_what_marching_comes_to(motor: Motor, inertia: float, force: float) -> None:
    spec = replace(PRESS, balance="motor", drive=Drive(motor=motor))
    numbers = {path: value for path, value in PRESS_NUMBERS.items() if path != "mean_speed"}
    numbers |= {"drive.inertia": inertia, "operation.steps.0.value": force}
    numbers |= {f"drive.motor.{name}": value for name, value in MOTORS[motor].items()}
    machine = Machine(spec, Columns.of(spec, numbers, 1))
    values = {name: np.full((1, 1, 1), value) for name, value in MOTORS[motor].items()}

    def rate(phi: float, energy: Any) -> Any:
        fields = machine.fields(np.array([[[phi]]]))
        omega = np.sqrt(2.0 * energy.reshape(1, 1, 1) / fields.inertia)
        return motor_torque(motor, values, omega)[0].ravel() + fields.resistance[0, 0, 0]

    edges = [0.0, math.radians(120.0), math.pi, 2.0 * math.pi]
    got = one(spec, numbers)
    energy = np.array([0.5 * inertia * 13.0**2])
    table = trajectory(spec, numbers, edges)
    wanted = table.values[:, table.names.index("energy")]
    for _ in range(60):
        before, passed = energy, [energy[0]]
        for low, high in pairwise(edges):
            found = solve_ivp(rate, (low + 1e-13, high - 1e-13), energy, method="DOP853", rtol=1e-11, atol=1e-11)
            energy = found.y[:, -1]
            passed.append(energy[0])
        if abs(energy[0] / before[0] - 1.0) < 1e-11:
            break
    assert np.array(passed) == pytest.approx(wanted, rel=1e-8)
    assert got["balance.work"] < 1e-10
    assert got["drive_torque.max"] > got["drive_torque.mean"] > got["drive_torque.min"]
    assert math.isnan(got["least_mean_speed"])


def test_a_motor_that_is_too_weak_stalls() -> None:
    spec = replace(PLAIN, balance="motor", drive=Drive(motor="kloss"))
    numbers = {"drive.inertia": 2.0, "operation.value": 40.0} | {
        "drive.motor.synchronous_speed": 10.0, "drive.motor.breakdown_slip": 0.1,
    }  # fmt: skip
    assert ending_of(spec, numbers | {"drive.motor.breakdown_torque": 39.0}) is Ending.MOTOR_STALLED
    got = one(spec, numbers | {"drive.motor.breakdown_torque": 41.0})
    assert 9.0 < got["omega.mean"] < 10.0
    assert got["irregularity"] == pytest.approx(0.0, abs=1e-12)
    linear = replace(spec, drive=Drive(motor="linear"))
    motor = {"drive.inertia": 2.0, "drive.motor.no_load_speed": 10.0, "drive.motor.stall_torque": 30.0}
    assert ending_of(linear, motor | {"operation.value": 31.0}) is Ending.MOTOR_STALLED
    assert one(linear, motor | {"operation.value": 15.0})["omega.mean"] == pytest.approx(5.0, rel=1e-12)
