"""Loads that follow the speed, against an integration by scipy and in closed form, with each balance and motor."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sprag_study.engine.endings import Ending
from sprag_study.engine.formulas.expressions import ExpressionError
from sprag_study.engine.machine_shaft.checked import check
from sprag_study.engine.machine_shaft.problems import InsufficientInertiaError, MotorStalledError, QuadratureError
from sprag_study.engine.machine_shaft.spec import Drive, MachineSpec, MechanismChoice, OperationChoice, PartChoice
from sprag_study.engine.machine_shaft.trajectory import trajectory
from tests.engine.machine_shaft.machines import ending_of, one

CRANK, MASS, INERTIA = 0.15, 40.0, 2.0
YOKE: dict[str, Any] = {
    "drive.inertia": INERTIA, "mechanism.scotch_yoke.crank": CRANK, "mechanism.scotch_yoke.yoke_mass": MASS,
}  # fmt: skip
MOTOR = {"drive.motor.no_load_speed": 22.0, "drive.motor.stall_torque": 300.0}
KLOSS = {
    "drive.motor.synchronous_speed": 22.0,
    "drive.motor.breakdown_torque": 120.0,
    "drive.motor.breakdown_slip": 0.1,
}
WAVE = "5 + 2*sin(phi)"


def machine(text: str, quantity: Any = "torque", **fields: Any) -> MachineSpec:
    operation = OperationChoice(quantity, "formula", formula=text)
    return MachineSpec(mechanism=MechanismChoice("scotch_yoke"), operation=operation, **fields)


def wave(phi: float) -> float:
    return 5.0 + 2.0 * math.sin(phi)


#: Structure of the balance, numbers, and the driving torque by the angle, the speed and the results.
BALANCES: tuple[tuple[dict[str, Any], dict[str, float], Any], ...] = (
    ({}, {"mean_speed": 20.0}, lambda phi, w, got: got["drive_torque.mean"]),
    ({"mean_speed_is": "time"}, {"mean_speed": 20.0}, lambda phi, w, got: got["drive_torque.mean"]),
    (
        {"balance": "scale", "drive": Drive("formula", formula=WAVE)},
        {"mean_speed": 20.0},
        lambda phi, w, got: got["balance.factor"] * wave(phi),
    ),
    (
        {"balance": "scale", "balance_side": "operation", "drive": Drive("formula", formula=WAVE)},
        {"mean_speed": 20.0},
        lambda phi, w, got: wave(phi),
    ),
    (
        {"balance": "motor", "drive": Drive(motor="linear")},
        MOTOR,
        lambda phi, w, got: 300.0 * (1.0 - w / 22.0),
    ),
    (
        {"balance": "motor", "drive": Drive(motor="kloss")},
        KLOSS,
        lambda phi, w, got: 240.0 / ((1.0 - w / 22.0) / 0.1 + 0.1 / (1.0 - w / 22.0)),
    ),
)  # fmt: skip
LOADS: tuple[tuple[str, Any, Any], ...] = (
    ("0.2*omega^2", "torque", lambda phi, w: 0.2 * w * w),
    ("1.5*omega*(1 + 0.8*sin(phi))", "torque", lambda phi, w: 1.5 * w * (1.0 + 0.8 * math.sin(phi))),
    (
        "600*x + 0.9*omega^2",
        "force",
        lambda phi, w: (300.0 * (1.0 - math.cos(phi)) + 0.9 * w * w) * CRANK * abs(math.sin(phi)),
    ),
)  # fmt: skip


@pytest.mark.parametrize(
    ("balance", "load"), [(b, k) for b in range(len(BALANCES)) for k in range(len(LOADS)) if (b + k) % 2 == 0]
)
def test_the_steady_motion_is_that_of_an_integration(balance: int, load: int) -> None:
    fields, numbers, drive = BALANCES[balance]
    text, quantity, resists = LOADS[load]
    spec = machine(text, quantity, **fields)
    got = one(spec, YOKE | numbers)
    factor = got["balance.factor"] if fields.get("balance_side") == "operation" else 1.0

    def inertia(phi: float) -> float:
        return INERTIA + MASS * (CRANK * math.sin(phi)) ** 2

    def rate(phi: float, energy: Any) -> list[float]:
        w = math.sqrt(2.0 * energy[0] / inertia(phi))
        return [drive(phi, w, got) - factor * resists(phi, w)]

    angles = np.array([0.3, 1.4, 2.9, 3.3, 5.0, 6.1])
    energy, found = 0.5 * INERTIA * got["omega.start"] ** 2, []
    for low, high in ((0.0, math.pi), (math.pi, 2.0 * math.pi)):
        inside = [*angles[(angles > low) & (angles < high)], high]
        own = solve_ivp(rate, (low, high), [energy], method="DOP853", rtol=1e-12, atol=1e-12, t_eval=inside)
        found += [math.sqrt(2.0 * e / inertia(phi)) for phi, e in zip(inside[:-1], own.y[0][:-1], strict=True)]
        energy = own.y[0][-1]
    # The last panel's end is the first one's start: the motion is periodic.
    assert energy == pytest.approx(0.5 * INERTIA * got["omega.start"] ** 2, rel=1e-9)
    table = trajectory(spec, YOKE | numbers, angles)
    assert table.values[:, table.names.index("omega")] == pytest.approx(found, rel=1e-9)
    wanted = [-factor * resists(phi, w) for phi, w in zip(angles, found, strict=True)]
    assert table.values[:, table.names.index("resisting_torque")] == pytest.approx(wanted, rel=1e-8)
    assert got["balance.work"] < 1e-10
    if "mean_speed" in numbers:
        assert got["omega.mean"] == pytest.approx(20.0, rel=1e-12)
        assert math.isnan(got["least_mean_speed"])


def test_a_viscous_load_alone_slows_the_shaft_in_closed_form() -> None:
    """I constant, M_d constant, M_r = -k omega: omega is constant; with M_r = -k omega (1 + a sin phi) to first order,
    I omega domega/dphi = -k omega a sin phi gives the amplitude k a/I."""
    spec = MachineSpec(operation=OperationChoice("torque", "formula", formula="2*omega"))
    got = one(spec, {"mean_speed": 30.0, "drive.inertia": 4.0})
    assert got["irregularity"] == pytest.approx(0.0, abs=1e-13)
    assert got["power.mean"] == pytest.approx(2.0 * 30.0**2, rel=1e-13)
    spec = MachineSpec(operation=OperationChoice("torque", "formula", formula="1e-4*omega*(1 + sin(phi))"))
    got = one(spec, {"mean_speed": 30.0, "drive.inertia": 4.0})
    assert got["omega.max"] - got["omega.min"] == pytest.approx(2.0 * 1e-4 / 4.0, rel=1e-3)


def test_parts_and_batches_have_the_same_numbers_as_one_machine_alone() -> None:
    """Two loads add up; a case's bits do not depend on the cases beside it."""
    text = "0.1*omega^2*(1 + 0.5*cos(phi))"
    part = PartChoice(MechanismChoice("scotch_yoke"), OperationChoice("torque", "formula", formula=text))
    numbers = {f"parts.{k}.{path}": value for k in range(2) for path, value in YOKE.items() if "mech" in path}
    both = one(MachineSpec(parts=(part, part)), numbers | {"mean_speed": 20.0, "drive.inertia": INERTIA})
    halves = {"mechanism.scotch_yoke.yoke_mass": 2.0 * MASS, "mean_speed": 20.0, "operation.scale": 2.0}
    alone = one(machine(text), YOKE | halves)
    assert both["irregularity"] == pytest.approx(alone["irregularity"], rel=1e-11)


def test_what_cannot_be_solved_is_refused_with_the_reason() -> None:
    heavy = machine("3*omega^2*(1 + sin(phi))")
    numbers = YOKE | {"mean_speed": 20.0, "drive.inertia": 0.05}
    assert ending_of(heavy, YOKE | {"mean_speed": 20.0}) is Ending.OK
    # A load that gives more the faster the shaft is, on a shaft without inertia to speak of.
    punched = machine("400*if(sin(phi) > 0.9, 1, 0) + 0.001*omega")
    assert ending_of(punched, numbers) is Ending.INERTIA_INSUFFICIENT
    with pytest.raises(InsufficientInertiaError) as refused:
        check(punched, numbers)
    assert refused.value.asked == 20.0
    assert math.isnan(refused.value.least_mean_speed)  # as the load follows the speed
    with pytest.raises(QuadratureError):
        check(machine("-500*omega*(1 + 0.01*sin(phi))"), YOKE | {"mean_speed": 20.0})
    with pytest.raises(ExpressionError) as unknown:
        check(MachineSpec(mechanism=MechanismChoice("formula", formula="1 + omega")), {"mean_speed": 1.0})
    assert unknown.value.position == 4


def test_a_constant_of_that_name_stays_what_it_was() -> None:
    spec = machine("2*omega", constants=("omega",))
    got = one(spec, YOKE | {"mean_speed": 20.0, "constants.omega": 5.0})
    assert got["drive_torque.mean"] == pytest.approx(10.0, rel=1e-13)


@pytest.mark.parametrize("jump", ["30*step(omega - 8)", "if(omega > 8, 30, 0)"])
def test_a_motor_that_a_jump_of_the_load_holds_is_not_said_to_stop(jump: str) -> None:
    """The motor has 20 N*m at 8 rad/s, the load 10 below and 40 above: the shaft keeps that speed."""
    motor = {"no_load_speed": 10.0, "stall_torque": 100.0}
    numbers = {"drive.inertia": 1.0} | {f"drive.motor.{name}": value for name, value in motor.items()}
    held = MachineSpec(
        drive=Drive(motor="linear"),
        balance="motor",
        operation=OperationChoice("torque", "formula", formula=f"10 + {jump}"),
    )
    run = solve_ivp(
        lambda _, omega: 100.0 * (1.0 - omega / 10.0) - 10.0 - 30.0 * (omega >= 8.0), (0.0, 5.0), [10.0], max_step=1e-3
    )
    assert run.y[0, -1] == pytest.approx(8.0, abs=0.05)
    assert ending_of(held, numbers) is Ending.MOTOR_STALLED
    with pytest.raises(MotorStalledError, match="holds it at a speed at which the torque of the load jumps"):
        check(held, numbers)
