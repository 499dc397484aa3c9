"""The multiplier of a cycle against long integrations by scipy and closed forms, and motions that do not last."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.machine_shaft.checked import check
from sprag_study.engine.machine_shaft.simulate import simulate
from sprag_study.engine.machine_shaft.spec import Drive, MachineSpec, MechanismChoice, OperationChoice
from sprag_study.engine.machine_shaft.tables import Table
from sprag_study.engine.machine_shaft.trajectory import trajectory
from sprag_study.engine.machine_shaft.transient_course import Course
from sprag_study.engine.machine_shaft.transients import transient
from tests.engine.machine_shaft.machines import NAMES, PRESS, PRESS_NUMBERS, one

TURN = 2.0 * math.pi
SHAFT = {"drive.inertia": 2.0, "mean_speed": 12.0}
LINEAR = {"drive.inertia": 2.0, "drive.motor.no_load_speed": 22.0, "drive.motor.stall_torque": 100.0}
KLOSS = {
    "drive.inertia": 2.0, "drive.motor.synchronous_speed": 22.0, "drive.motor.breakdown_torque": 120.0,
    "drive.motor.breakdown_slip": 0.1,
}  # fmt: skip
MACHINE: dict[str, Any] = {"mechanism.scotch_yoke.crank": 0.15, "mechanism.scotch_yoke.yoke_mass": 40.0}
Torque = Callable[[float, float], float]


def loaded(formula: str, **fields: Any) -> MachineSpec:
    return MachineSpec(operation=OperationChoice("torque", "formula", formula=formula), **fields)


def motor(kind: Any, formula: str, table: Table | None = None) -> MachineSpec:
    return loaded(formula, balance="motor", drive=Drive(motor=kind, table=table))


def case_of(spec: MachineSpec, numbers: dict[str, Any]) -> tuple[Ending, dict[str, float]]:
    batch = simulate(spec, numbers, cases=1)
    return ENDINGS[int(batch.endings[0])], dict(zip(NAMES, map(float, batch.values[0]), strict=True))


def inertia(phi: float) -> float:
    return 2.0 + 40.0 * (0.15 * math.sin(phi)) ** 2


def marched(energy: float, torque: Torque, turns: int = 1) -> float:
    """Energy at the angle 0 after so many turns, by scipy."""

    def rate(phi: float, y: Any) -> list[float]:
        return [torque(phi, math.sqrt(2.0 * y[0] / inertia(phi)))]

    cuts = np.linspace(0.0, TURN, 5)
    for _ in range(turns):
        for low, high in pairwise(cuts):
            energy = solve_ivp(rate, (low, high), [energy], method="DOP853", rtol=1e-13, atol=1e-13).y[0][-1]
    return float(energy)


def kloss(w: float) -> float:
    slip = 1.0 - w / 22.0
    return 24.0 * slip / (slip * slip + 0.01)


#: A machine, its numbers, the torque of its load, and that of its drive by the angle, the speed and the results.
FOLLOWING: tuple[tuple[MachineSpec, dict[str, Any], Torque, Any], ...] = (
    (loaded("0.2*omega^2"), SHAFT, lambda p, w: 0.2 * w * w, lambda p, w, got: got["drive_torque.mean"]),
    (
        loaded("1.5*omega*(1 + 0.8*sin(phi))", mean_speed_is="time"),
        SHAFT,
        lambda p, w: 1.5 * w * (1.0 + 0.8 * math.sin(p)),
        lambda p, w, got: got["drive_torque.mean"],
    ),
    (
        loaded("9 + 0.4*omega", balance="scale", drive=Drive("formula", formula="5 + 2*sin(phi)")),
        SHAFT,
        lambda p, w: 9.0 + 0.4 * w,
        lambda p, w, got: got["balance.factor"] * (5.0 + 2.0 * math.sin(p)),
    ),
    (
        motor("linear", "0.1*omega^2"),
        LINEAR,
        lambda p, w: 0.1 * w * w,
        lambda p, w, got: 100.0 * (1.0 - w / 22.0),
    ),
    (
        motor("kloss", "20 + 30*sin(phi)^2"),
        KLOSS,
        lambda p, w: 20.0 + 30.0 * math.sin(p) ** 2,
        lambda p, w, got: kloss(w),
    ),
)  # fmt: skip


def on_yoke(spec: MachineSpec) -> MachineSpec:
    """The machine with a mechanism whose inertia varies."""
    return MachineSpec(
        mechanism=MechanismChoice("scotch_yoke"), operation=spec.operation, balance=spec.balance,
        balance_side=spec.balance_side, drive=spec.drive, mean_speed_is=spec.mean_speed_is,
    )  # fmt: skip


@pytest.mark.parametrize("which", range(len(FOLLOWING)))
def test_the_multiplier_is_that_of_differences_of_runs(which: int) -> None:
    spec, numbers, load, drive = FOLLOWING[which]
    got = one(on_yoke(spec), MACHINE | numbers)
    start = 0.5 * inertia(0.0) * got["omega.start"] ** 2

    def torque(phi: float, w: float) -> float:
        return float(drive(phi, w, got) - load(phi, w))

    assert marched(start, torque) == pytest.approx(start, rel=1e-9)
    more, less = (marched(start * (1.0 + change), torque) for change in (1e-4, -1e-4))
    assert got["cycle.multiplier"] == pytest.approx((more - less) / (2e-4 * start), rel=1e-6)
    assert 0.0 < got["cycle.multiplier"] < 1.0
    # What is left of a deviation after three turns.
    more, less = (marched(start * (1.0 + change), torque, 3) for change in (1e-4, -1e-4))
    assert got["cycle.multiplier"] ** 3 == pytest.approx((more - less) / (2e-4 * start), rel=1e-6, abs=1e-9)


def test_the_scaled_operation_follows_the_speed_by_its_factor() -> None:
    spec = loaded(
        "3 + omega^2", balance="scale", balance_side="operation", drive=Drive("formula", formula="10 + phi*0")
    )
    got = one(on_yoke(spec), MACHINE | SHAFT)
    start, factor = 0.5 * inertia(0.0) * got["omega.start"] ** 2, got["balance.factor"]
    more, less = (
        marched(start * (1.0 + change), lambda p, w: 10.0 - factor * (3.0 + w * w)) for change in (1e-4, -1e-4)
    )
    assert got["cycle.multiplier"] == pytest.approx((more - less) / (2e-4 * start), rel=1e-6)


def test_closed_forms() -> None:
    # dT/dphi = D - k omega^2 = D - 2 k T/I decays as exp(-2 k phi/I); a linear motor at an even speed as its slope.
    assert one(loaded("0.2*omega^2"), SHAFT)["cycle.multiplier"] == pytest.approx(math.exp(-0.2 * TURN), rel=1e-12)
    twice = one(loaded("0.2*omega^2", cycle=2), SHAFT)["cycle.multiplier"]
    assert twice == pytest.approx(math.exp(-0.4 * TURN), rel=1e-12)
    got = one(motor("linear", "50"), LINEAR)
    assert got["omega.mean"] == pytest.approx(11.0, rel=1e-12)
    assert got["cycle.multiplier"] == pytest.approx(math.exp(-TURN * 100.0 / 22.0 / (2.0 * 11.0)), rel=1e-12)


@pytest.mark.parametrize("balance", ["constant", "scale", "refuse"])
def test_torques_that_do_not_follow_the_speed_let_any_speed_last(balance: Any) -> None:
    spec = loaded("5 + sin(phi)", balance=balance, drive=Drive("formula", formula="5 + cos(phi)"))
    assert one(spec, SHAFT)["cycle.multiplier"] == 1.0
    assert one(PRESS, PRESS_NUMBERS)["cycle.multiplier"] == 1.0
    # A constant load in the place of one that follows the speed does not follow it.
    found = loaded("omega^2", balance_side="operation", drive=Drive("formula", formula="5 + cos(phi)"))
    assert one(found, SHAFT)["cycle.multiplier"] == 1.0


def test_a_motion_that_runs_away_is_unstable() -> None:
    """A load of constant power: a little more speed leaves the shaft with less load."""
    spec = loaded("100/omega*(1 + 0.5*sin(phi))")
    ending, got = case_of(spec, SHAFT)
    assert ending is Ending.UNSTABLE
    drive = got["drive_torque.mean"]

    def torque(phi: float, w: float) -> float:
        return drive - 100.0 / w * (1.0 + 0.5 * math.sin(phi))

    def turned(energy: float, turns: int) -> float:
        for _ in range(turns):
            answer = solve_ivp(
                lambda p, y: [torque(p, math.sqrt(y[0]))],
                (0.0, TURN),
                [energy],
                method="DOP853",
                rtol=1e-13,
                atol=1e-13,
            )
            energy = float(answer.y[0][-1])
        return energy

    # The cycle, between a start from which the shaft gains speed and one from which it loses speed.
    low, high = 130.0, 160.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if turned(middle, 1) > middle else (middle, high)
    growth = (turned(low * (1.0 + 1e-5), 1) - turned(low * (1.0 - 1e-5), 1)) / (2e-5 * low)
    assert got["cycle.multiplier"] == pytest.approx(growth, rel=1e-6)
    assert math.sqrt(turned(low * 1.002, 40)) > 17.0
    # No result of the motion is left, those of the torques are.
    for name in ("omega.mean", "omega.max", "irregularity", "power.mean", "energy.mean", "acceleration.max"):
        assert math.isnan(got[name]), name
    assert got["inertia.mean"] == pytest.approx(2.0, rel=1e-12)
    assert trajectory(spec, SHAFT, [0.0]).ending is Ending.UNSTABLE
    assert check(spec, SHAFT) is Ending.UNSTABLE
    assert check(loaded("omega"), SHAFT) is Ending.OK


@pytest.mark.parametrize(
    ("spec", "numbers"),
    [
        (loaded("100/omega", balance="scale", drive=Drive("formula", formula="5 + sin(phi)")), SHAFT),
        (
            loaded(
                "100/omega", balance="scale", balance_side="operation", drive=Drive("formula", formula="5 + sin(phi)")
            ),
            SHAFT,
        ),
        (motor("linear", "300 - 20*omega"), LINEAR),
        (
            motor("table", "300 - 20*omega", Table(((0.0, 100.0), (22.0, 0.0), (30.0, -36.0)), "linear")),
            {"drive.inertia": 2.0},
        ),
    ],
    ids=["scaled drive", "scaled operation", "linear motor", "table"],
)
def test_every_drive_has_unstable_motions(spec: MachineSpec, numbers: dict[str, Any]) -> None:
    ending, got = case_of(spec, numbers)
    assert ending is Ending.UNSTABLE
    assert got["cycle.multiplier"] > 1.0
    assert math.isnan(got["irregularity"])
    # A load that rises with the speed beside it makes it stable, at nearly the same speed.
    more = f"{spec.operation.formula} + 30*(omega - {12.94 if spec.balance == 'motor' else 12.0})"
    rising = MachineSpec(
        operation=OperationChoice("torque", "formula", formula=more), balance=spec.balance,
        balance_side=spec.balance_side, drive=spec.drive,
    )  # fmt: skip
    ending, got = case_of(rising, numbers)
    assert ending is Ending.OK
    assert got["cycle.multiplier"] < 1.0


def test_a_motor_that_its_load_carries_away_is_overrun() -> None:
    """Its cycle is unstable too, but what becomes of the shaft is known: it runs away from its synchronous speed."""
    falling = motor("kloss", "300 - 15*omega")
    assert case_of(falling, KLOSS | {"drive.motor.breakdown_slip": 1.0})[0] is Ending.MOTOR_OVERRUN


def test_above_an_unstable_cycle_the_motor_finds_its_stable_one() -> None:
    """100 (1 - w/22) = P/w has two roots: the shaft comes to the faster one, from its speed without load."""
    for power in (200.0, 400.0, 540.0):
        fast = 11.0 + math.sqrt(121.0 - power * 22.0 / 100.0)
        got = one(motor("linear", f"{power}/omega"), LINEAR)
        assert got["omega.mean"] == pytest.approx(fast, rel=1e-9)
        slope = -100.0 / 22.0 + power / fast**2
        assert got["cycle.multiplier"] == pytest.approx(math.exp(TURN * slope / (2.0 * fast)), rel=1e-9)


def test_transients_of_an_unstable_motion() -> None:
    """A shaft cannot turn in it, so nothing coasts from it; a run-up passes it."""
    spec = loaded("100/omega")
    assert transient(spec, SHAFT, Course("coasting"), 2).motion.ending is Ending.UNSTABLE
    assert transient(spec, SHAFT, Course("coasting"), 2).outcome == "no_motion"
    spec = loaded("20 - omega")
    made = transient(spec, SHAFT, Course("run-up", torque=30.0, revolutions=20.0), 2)
    assert made.outcome == "not_reached"
    assert Ending.UNSTABLE.sentence in made.cause


@pytest.mark.parametrize("cases", [1, 5])
def test_the_multiplier_does_not_depend_on_the_other_cases(cases: int) -> None:
    spec = motor("linear", "300 - 20*omega + a")
    spec = MachineSpec(operation=spec.operation, balance="motor", drive=spec.drive, constants=("a",))
    values = np.linspace(0.0, 500.0, 2 * cases)
    batch = simulate(spec, LINEAR | {"constants.a": values}, cases=2 * cases)
    for case, value in enumerate(values):
        alone = simulate(spec, LINEAR | {"constants.a": value}, cases=1)
        assert alone.values[0].tobytes() == batch.values[case].tobytes()
        assert alone.endings[0] == batch.endings[case]
