"""Balance of works, motors and their limit cycles."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sprag_study.engine.endings import Ending
from sprag_study.engine.machine_shaft.checked import check
from sprag_study.engine.machine_shaft.columns import Columns
from sprag_study.engine.machine_shaft.machine import Machine
from sprag_study.engine.machine_shaft.motor import motor_torque, steady_speed
from sprag_study.engine.machine_shaft.problems import UnbalancedWorkError
from sprag_study.engine.machine_shaft.spec import Drive, MachineSpec, Motor, OperationChoice
from sprag_study.engine.machine_shaft.trajectory import trajectory
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


@pytest.mark.parametrize(("motor", "inertia", "force"), [("linear", 0.7, 4e3), ("kloss", 15.0, 2e4)])
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


ENGINE = replace(
    PRESS, balance="scale", balance_side="operation", drive=Drive("formula", formula="100 + 40*cos(phi)"),
)  # fmt: skip


def test_an_operation_is_scaled_to_the_drive() -> None:
    """With the ram's weight, whose work over a cycle is zero, and which no factor belongs to."""
    numbers = PRESS_NUMBERS | {"mechanism.slider_crank.inclination": -math.pi / 2.0}
    got = one(ENGINE, numbers)
    # 20 kN over the last 60 degrees before the dead centre, against 100 N*m over a revolution.
    own = one(replace(PRESS, balance="constant"), numbers)
    assert got["balance.factor"] == pytest.approx(200.0 * math.pi / -own["work.resistance"], rel=1e-12)
    assert got["resisting_torque.mean"] == pytest.approx(-100.0, rel=1e-12)
    assert got["drive_torque.max"] == pytest.approx(140.0, rel=1e-12)
    assert got["balance.work"] < 1e-12
    same = one(replace(ENGINE, balance_side="drive", balance="refuse"),
               numbers | {"operation.scale": got["balance.factor"]})  # fmt: skip
    for name in ("irregularity", "energy.fluctuation", "s4.max", "required_inertia"):
        assert got[name] == pytest.approx(same[name], rel=1e-10, nan_ok=True)


def test_an_operation_is_made_constant() -> None:
    spec = replace(ENGINE, balance="constant")
    numbers = PRESS_NUMBERS | {"mechanism.slider_crank.inclination": -math.pi / 2.0}
    table = trajectory(spec, numbers, np.linspace(0.0, math.tau, 61))
    weight = trajectory(replace(PRESS, operation=OperationChoice()), {
        path: value for path, value in numbers.items() if not path.startswith("operation")
    }, table.times)  # fmt: skip
    column = table.names.index("resisting_torque")
    assert table.values[:, column] == pytest.approx(weight.values[:, column] - 100.0, abs=1e-9)
    got = one(spec, numbers)
    assert math.isnan(got["balance.factor"])
    assert got["balance.work"] < 1e-12


def test_what_no_factor_balances_is_named() -> None:
    numbers = PRESS_NUMBERS | {"operation.steps.0.value": -20e3}
    assert ending_of(ENGINE, numbers) is Ending.UNBALANCED_WORK
    with pytest.raises(UnbalancedWorkError, match="the operation drives instead of resisting"):
        check(ENGINE, numbers)
    with pytest.raises(UnbalancedWorkError, match=r"No factor on the operation .* no work over a cycle"):
        check(ENGINE, PRESS_NUMBERS | {"operation.scale": 0.0})
    with pytest.raises(UnbalancedWorkError, match=r"No factor on the operation .* no work over a cycle"):
        check(ENGINE, PRESS_NUMBERS | {"operation.scale": 0.0, "friction_torque": 5.0})
    with pytest.raises(UnbalancedWorkError, match="since the driving torque does no work"):
        check(replace(ENGINE, drive=Drive("formula", formula="50*sin(phi)")), PRESS_NUMBERS)
    with pytest.raises(UnbalancedWorkError, match=r"the friction of the shaft takes 942.478 J"):
        check(ENGINE, PRESS_NUMBERS | {"friction_torque": 150.0})
    with pytest.raises(UnbalancedWorkError, match="the driving torque brakes, too"):
        check(replace(ENGINE, balance_side="drive", drive=Drive("formula", formula="-50 + cos(phi)")), PRESS_NUMBERS)


def test_a_cycle_of_many_revolutions_has_the_closed_form() -> None:
    """One blow in eight revolutions: fluctuation E (1 - theta/(16 pi))."""
    spec = MachineSpec(cycle=8, operation=OperationChoice("torque", "steps", steps=1))
    work, width = 6e3, 0.5
    step = {"from": 40.0, "to": 40.0 + width, "value": work / width}
    got = one(spec, {"mean_speed": 30.0, "drive.inertia": 50.0} | {
        f"operation.steps.0.{name}": value for name, value in step.items()
    })  # fmt: skip
    assert got["energy.fluctuation"] == pytest.approx(work * (1.0 - width / (16.0 * math.pi)), rel=1e-11)
    assert got["work.drive"] == pytest.approx(work, rel=1e-12)


def test_losses_of_the_operation_and_of_the_shaft() -> None:
    """A load that resists over half a turn and drives over the other: 300 N*m and -100 N*m, lost both ways."""
    spec = MachineSpec(operation=OperationChoice("torque", "formula", formula="if(phi < pi, 300, -100)"))
    numbers = {"mean_speed": 10.0, "drive.inertia": 50.0, "operation.efficiency": 0.8, "friction_torque": 7.0}
    got = one(spec, numbers)
    assert got["drive_torque.mean"] == pytest.approx(0.5 * (300.0 / 0.8 - 100.0 * 0.8) + 7.0, rel=1e-12)
    found = replace(spec, balance="scale", balance_side="operation", drive=Drive("formula", formula="87 + cos(phi)"))
    # The operation carries what friction leaves of the drive's 87 N*m.
    assert one(found, numbers)["balance.factor"] == pytest.approx(80.0 / 147.5, rel=1e-12)
    assert one(spec, numbers | {"operation.efficiency": 1.0, "friction_torque": 0.0})[
        "drive_torque.mean"
    ] == pytest.approx(100.0, rel=1e-12)
