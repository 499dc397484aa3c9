"""Transients against closed forms, the equation of motion integrated by scipy, and the balance of energy."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sprag_study.engine.endings import Ending
from sprag_study.engine.machine_shaft.columns import Columns
from sprag_study.engine.machine_shaft.machine import Machine
from sprag_study.engine.machine_shaft.motor import motor_torque
from sprag_study.engine.machine_shaft.spec import Drive, MachineSpec, MechanismChoice, OperationChoice
from sprag_study.engine.machine_shaft.tables import Table
from sprag_study.engine.machine_shaft.transient_course import COLUMNS, RESULTS, Course, Transient
from sprag_study.engine.machine_shaft.transients import transient
from tests.engine.machine_shaft.machines import PRESS, PRESS_NUMBERS

TURN = 2.0 * math.pi
LINEAR = MachineSpec(balance="motor", drive=Drive(motor="linear"))
LINEAR_NUMBERS = {"drive.inertia": 2.0, "drive.motor.no_load_speed": 100.0, "drive.motor.stall_torque": 50.0}
KLOSS = MachineSpec(balance="motor", drive=Drive(motor="kloss"))
KLOSS_NUMBERS = {
    "drive.inertia": 1.5, "drive.motor.synchronous_speed": 157.0, "drive.motor.breakdown_torque": 60.0,
    "drive.motor.breakdown_slip": 0.2,
}  # fmt: skip
#: The press behind a belt and an asynchronous motor, with friction.
BELTED = replace(PRESS, balance="motor", drive=Drive(motor="kloss", stages=("belt",)))
BELTED_NUMBERS = {
    **{name: value for name, value in PRESS_NUMBERS.items() if name != "mean_speed"}, "friction_torque": 3.0,
    "mechanism.slider_crank.inclination": 1.0, "operation.steps.0.value": 800.0, "drive.inertia": 5.0,
    "drive.stages.0.ratio": 3.0, "drive.stages.0.efficiency": 0.95, "drive.motor.synchronous_speed": 157.0,
    "drive.motor.breakdown_torque": 60.0, "drive.motor.breakdown_slip": 0.2,
}  # fmt: skip


def run(spec: MachineSpec, numbers: dict[str, Any], course: Course, points: int = 101) -> Transient:
    """A transient whose energy balance closes and whose table has every column."""
    made = transient(spec, numbers, course, points)
    assert made.results["balance.energy"] < 1e-12
    assert list(made.results) == [name for name, *_ in RESULTS]
    assert made.motion.values.shape == (points, len(COLUMNS))
    assert np.all(np.diff(made.motion.times) >= 0.0)
    return made


def column(made: Transient, name: str) -> np.ndarray[Any, Any]:
    return np.asarray(made.motion.values[:, made.motion.names.index(name)])


def test_a_linear_motor_runs_up_exponentially() -> None:
    made = run(LINEAR, LINEAR_NUMBERS, Course("run-up", angle=1.0, within=0.02))
    decay = 2.0 * 100.0 / 50.0
    assert made.outcome == "reached"
    assert made.results["time"] == pytest.approx(-decay * math.log(0.02), rel=1e-11)
    speeds = 100.0 * (1.0 - np.exp(-made.motion.times / decay))
    assert np.max(np.abs(column(made, "omega") - speeds)) < 1e-9
    t = made.results["time"]
    way = 100.0 * (t - decay * (1.0 - math.exp(-t / decay)))
    assert made.results["turns"] == pytest.approx(way / TURN, rel=1e-11)
    assert made.results["drive_torque.max"] == pytest.approx(50.0, rel=1e-11)
    assert made.results["power.max"] == pytest.approx(0.25 * 50.0 * 100.0, rel=1e-11)
    assert made.results["after.omega.mean"] == pytest.approx(100.0, rel=1e-11)
    assert made.results["after.irregularity"] == 0.0


def test_an_asynchronous_motor_loses_as_much_as_the_shaft_gains() -> None:
    """Unloaded, the slip heats the rotor by I w_s^2/2 in a run-up to the synchronous speed; the time is Kloss's."""
    made = run(KLOSS, KLOSS_NUMBERS, Course("run-up", within=0.01, revolutions=5000.0))
    whole = 0.5 * 1.5 * 157.0**2
    assert made.results["work.slip"] == pytest.approx(whole * (1.0 - 0.01**2), rel=1e-11)
    assert made.results["energy.change"] == pytest.approx(whole * 0.99**2, rel=1e-11)
    slip = (1.0 - 0.01**2) / (2.0 * 0.2) + 0.2 * math.log(1.0 / 0.01)
    assert made.results["time"] == pytest.approx(1.5 * 157.0 / (2.0 * 60.0) * slip, rel=1e-11)
    assert made.results["drive_torque.max"] == pytest.approx(60.0, rel=1e-9)


def test_a_constant_torque_runs_up_linearly() -> None:
    spec = MachineSpec(drive=Drive(stages=("gear",)))
    numbers = {
        "mean_speed": 30.0, "drive.inertia": 2.0, "friction_torque": 1.0, "drive.stages.0.ratio": 4.0,
        "drive.stages.0.efficiency": 0.8, "drive.stages.0.inertia": 0.125,
    }  # fmt: skip
    made = run(spec, numbers, Course("run-up", torque=2.0, within=0.0))
    accelerating = 2.0 * 4.0 * 0.8 - 1.0
    assert made.results["time"] == pytest.approx(4.0 * 30.0 / accelerating, rel=1e-11)
    assert made.results["omega.end"] == pytest.approx(30.0, rel=1e-11)
    assert made.results["motor.torque.max"] == pytest.approx(2.0, rel=1e-12)
    with pytest.raises(ValueError, match="needs a torque"):
        transient(spec, numbers, Course("run-up"), 10)


def test_coasting_under_constant_friction() -> None:
    made = run(LINEAR, LINEAR_NUMBERS | {"friction_torque": 4.0}, Course("coasting"))
    speed = 100.0 * (1.0 - 4.0 / 50.0)
    assert made.outcome == "stopped"
    assert made.results["time"] == pytest.approx(2.0 * speed / 4.0, rel=1e-11)
    assert made.results["turns"] == pytest.approx(0.5 * 2.0 * speed**2 / 4.0 / TURN, rel=1e-11)
    assert made.results["work.drive"] == 0.0
    assert column(made, "omega")[-1] == 0.0
    free = run(LINEAR, LINEAR_NUMBERS, Course("coasting", revolutions=10.0))
    assert free.outcome == "not_reached"
    assert math.isnan(free.results["time"])
    assert "nothing takes work" in free.cause


def test_a_load_step_of_a_linear_motor() -> None:
    spec = replace(LINEAR, operation=OperationChoice("torque"))
    made = run(spec, LINEAR_NUMBERS | {"operation.value": 5.0}, Course("load-step", load=3.0, within=0.05))
    before, after, decay = 90.0, 70.0, 4.0
    assert made.results["before.omega.mean"] == pytest.approx(before, rel=1e-11)
    assert made.results["after.omega.mean"] == pytest.approx(after, rel=1e-11)
    assert made.results["time"] == pytest.approx(-decay * math.log(0.05), rel=1e-10)
    speeds = after + (before - after) * np.exp(-made.motion.times / decay)
    assert np.max(np.abs(column(made, "omega") - speeds)) < 1e-9
    relief = run(spec, LINEAR_NUMBERS | {"operation.value": 5.0}, Course("load-step", load=0.0, within=0.05))
    assert relief.results["omega.end"] == pytest.approx(100.0 - 0.05 * 10.0, rel=1e-10)


def by_scipy(numbers: dict[str, Any], course: Course, speed: float, times: np.ndarray[Any, Any]) -> Any:
    """Angle and speed of the belted press at times, from one jump or kink of its torque to the next."""
    row = Columns.of(BELTED, numbers, 1)
    machine = Machine(BELTED, row)
    motor = {name: value[0, 0] for name, value in machine.train.motor(row.under("drive.motor.")).items()}
    cuts = np.unique([0.0, TURN, *(float(a) for cut in machine.breaks() for a in cut[0] if np.isfinite(a))])

    def solve(t: float, state: Any, low: float, high: float) -> Any:
        def slope(_time: float, y: Any) -> list[float]:
            phi = min(max(y[0], low + 1e-12), high - 1e-12)
            fields = machine.fields(np.array([[[phi % TURN]]]))
            drive = 0.0 if course.kind == "coasting" else motor_torque("kloss", motor, np.array([y[1]]))[0].item()
            load = (fields.resistance + (course.load - 1.0) * fields.operation).item()
            return [y[1], (drive + load - 0.5 * fields.slope.item() * y[1] ** 2) / fields.inertia.item()]

        def leaves(_time: float, y: Any) -> float:
            return float(y[0] - high)

        leaves.terminal = True  # type: ignore[attr-defined]
        return solve_ivp(
            slope, (t, times[-1]), state, method="DOP853", rtol=1e-13, atol=1e-13, events=leaves, dense_output=True
        )

    t, state, found = 0.0, np.array([course.angle, speed]), np.full((len(times), 2), np.nan)
    while times[-1] - t > 1e-9:
        turn = TURN * math.floor((state[0] + 1e-9) / TURN)
        high = turn + cuts[np.searchsorted(cuts, state[0] + 1e-9 - turn, side="right")]
        made = solve(t, state, state[0], high)
        inside = (times >= t) & (times <= made.t[-1])
        if inside.any():
            found[inside] = made.sol(times[inside]).T
        t, state = made.t[-1], made.y[:, -1]
    return found


@pytest.mark.parametrize(
    "course",
    [
        Course("run-up", within=0.75),
        Course("load-step", load=8.0, angle=0.7, within=0.9),
        Course("coasting", load=40.0, angle=0.3),
    ],
    ids=lambda course: course.kind,
)
def test_it_follows_the_equation_of_motion(course: Course) -> None:
    made = run(BELTED, BELTED_NUMBERS, course, 41)
    found = by_scipy(BELTED_NUMBERS, course, made.results["omega.start"], made.motion.times[:-1])
    assert np.max(np.abs(found[:, 0] - column(made, "angle")[:-1])) < 1e-8
    assert np.max(np.abs(found[:, 1] - column(made, "omega")[:-1])) < 1e-8 * made.results["omega.max"]


def test_the_steady_cycle_is_that_of_the_case() -> None:
    """The table at the end of a long run-up is the table of the cycle, and its largest speed is between the nodes."""
    made = run(BELTED, BELTED_NUMBERS, Course("run-up", within=1e-6), 4001)
    assert made.results["omega.max"] >= column(made, "omega").max() > 0.9999 * made.results["omega.max"]
    assert made.results["drive_torque.max"] == pytest.approx(3.0 * 0.95 * 60.0, rel=1e-9)
    power = column(made, "drive_torque") * column(made, "omega")
    assert np.array_equal(column(made, "power"), power)
    late = made.motion.times > made.motion.times[-1] - TURN / made.results["after.omega.mean"]
    spread = np.ptp(column(made, "omega")[late]) / made.results["after.omega.mean"]
    assert spread == pytest.approx(made.results["after.irregularity"], rel=1e-2)


def test_a_measured_motor_is_a_linear_one_where_it_is_straight() -> None:
    table = Table(((0.0, 50.0), (60.0, 20.0), (100.0, 0.0), (120.0, -10.0)), "linear")
    spec = MachineSpec(balance="motor", drive=Drive(motor="table", table=table, stages=("gear",)))
    numbers = {"drive.inertia": 8.0, "drive.stages.0.ratio": 2.0, "drive.stages.0.efficiency": 0.9}
    made = run(spec, numbers, Course("run-up", within=0.02))
    decay = 8.0 * 50.0 / (50.0 * 2.0 * 0.9)
    assert made.results["time"] == pytest.approx(-decay * math.log(0.02), rel=1e-10)
    speeds = 50.0 * (1.0 - np.exp(-made.motion.times / decay))
    assert np.max(np.abs(column(made, "omega") - speeds)) < 1e-8
    assert np.max(np.abs(column(made, "acceleration") - 50.0 / decay * np.exp(-made.motion.times / decay))) < 1e-7
    assert made.results["motor.torque.max"] == pytest.approx(50.0, rel=1e-10)
    direct = replace(spec, drive=Drive(motor="table", table=table))
    made = run(direct, {"drive.inertia": 8.0}, Course("run-up", within=0.02))
    assert made.results["time"] == pytest.approx(-8.0 * 100.0 / 50.0 * math.log(0.02), rel=1e-10)


def test_loads_that_follow_the_speed() -> None:
    """A viscous brake on a linear motor, and a fan that slows down the shaft by the angle, never quite to rest."""
    viscous = replace(LINEAR, operation=OperationChoice("torque", "formula", formula="0.125*omega"))
    made = run(viscous, LINEAR_NUMBERS, Course("load-step", load=3.0, within=0.1))
    before, after, decay = 50.0 / 0.625, 50.0 / 0.875, 2.0 / 0.875
    assert made.results["before.omega.mean"] == pytest.approx(before, rel=1e-10)
    assert made.results["after.omega.mean"] == pytest.approx(after, rel=1e-10)
    assert made.results["time"] == pytest.approx(-decay * math.log(0.1), rel=1e-9)
    speeds = after + (before - after) * np.exp(-made.motion.times / decay)
    assert np.max(np.abs(column(made, "omega") - speeds)) < 1e-8
    assert np.max(np.abs(column(made, "resisting_torque") + 0.375 * speeds)) < 1e-8
    fan = MachineSpec(operation=OperationChoice("torque", "formula", formula="0.01*omega^2"))
    slowed = run(fan, {"mean_speed": 30.0, "drive.inertia": 2.0}, Course("coasting", revolutions=20.0))
    speeds = 30.0 * np.exp(-0.01 / 2.0 * column(slowed, "angle"))
    assert np.max(np.abs(column(slowed, "omega") - speeds)) < 1e-8
    assert slowed.outcome == "not_reached"
    rough = replace(fan, operation=OperationChoice("torque", "formula", formula="max(omega, 20)"))
    refused = transient(rough, {"mean_speed": 30.0, "drive.inertia": 2.0}, Course("coasting"), 5)
    assert refused.outcome == "no_motion"
    assert "not smooth in the speed" in refused.cause


def test_each_stall_has_its_own_cause() -> None:
    weak = BELTED_NUMBERS | {"drive.motor.breakdown_slip": 0.01}
    start = run(BELTED, weak, Course("run-up", angle=0.5 * math.pi))
    assert (start.outcome, start.results["turns"]) == ("not_started", 0.0)
    assert "does not start: at 90 deg the torque of the drive at rest" in start.cause
    mean = run(BELTED, BELTED_NUMBERS, Course("load-step", load=1000.0))
    assert mean.outcome == "stopped"
    assert "the mean resisting torque" in mean.cause
    spent = run(BELTED, BELTED_NUMBERS, Course("run-up", load=20.0))
    assert spent.outcome == "stopped"
    assert "its energy is spent" in spent.cause
    assert math.isnan(spent.results["time"])


def test_a_drive_that_does_not_follow_the_speed_has_no_new_cycle() -> None:
    """A constant torque of 5 N*m accelerates the unloaded shaft, and loses against twice its load."""
    spec = MachineSpec(operation=OperationChoice("torque"))
    numbers = {"mean_speed": 30.0, "drive.inertia": 2.0, "operation.value": 5.0}
    freed = run(spec, numbers, Course("load-step", load=0.0, revolutions=10.0))
    assert freed.outcome == "not_reached"
    assert "does not follow the speed" in freed.cause
    assert math.isnan(freed.results["after.omega.mean"])
    time = freed.results["duration"]
    assert freed.results["omega.end"] == pytest.approx(30.0 + 2.5 * time, rel=1e-11)
    slowed = run(spec, numbers, Course("load-step", load=2.0))
    assert (slowed.outcome, slowed.results["duration"]) == ("stopped", pytest.approx(12.0, rel=1e-11))
    assert "the mean resisting torque, 10 N*m, exceeds the largest torque of the drive, 5 N*m" in slowed.cause


def test_a_machine_without_a_cycle() -> None:
    far = transient(PRESS, PRESS_NUMBERS | {"mechanism.slider_crank.rod": 0.09}, Course("coasting"), 5)
    assert (far.outcome, far.motion.ending) == ("no_motion", Ending.CANNOT_ASSEMBLE)
    slow = transient(PRESS, PRESS_NUMBERS | {"mean_speed": 0.5}, Course("load-step", load=2.0), 5)
    assert (slow.outcome, slow.motion.ending) == ("no_motion", Ending.INERTIA_INSUFFICIENT)
    assert slow.motion.times.size == 0


def test_weights_turn_a_stopped_shaft_back() -> None:
    spec = MachineSpec(mechanism=MechanismChoice("slider_crank"), operation=OperationChoice("force"))
    numbers = {name: value for name, value in PRESS_NUMBERS.items() if "steps" not in name}
    numbers |= {"operation.value": 500.0, "mechanism.slider_crank.inclination": 0.5 * math.pi}
    made = run(spec, numbers, Course("coasting"))
    assert "Weights and springs then turn it back" in made.cause
