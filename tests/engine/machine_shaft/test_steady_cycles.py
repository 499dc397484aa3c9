"""All steady cycles of a machine: closed forms, marching by scipy, and what the rows say."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.machine_shaft.simulate import simulate
from sprag_study.engine.machine_shaft.spec import Drive, MachineSpec, OperationChoice
from sprag_study.engine.machine_shaft.steady_cycles import SteadyCycles, steady_cycles
from sprag_study.engine.machine_shaft.tables import Table
from sprag_study.engine.machine_shaft.transient_course import Course
from sprag_study.engine.machine_shaft.transients import transient
from tests.engine.machine_shaft.machines import NAMES, PRESS, PRESS_NUMBERS
from tests.engine.machine_shaft.marching import judged, random_machine

TURN = 2.0 * math.pi
LINEAR = {"drive.inertia": 2.0, "drive.motor.no_load_speed": 22.0, "drive.motor.stall_torque": 100.0}
#: A motor with a saddle, whose rising branch crosses a load of 52 N*m between two falling ones.
SADDLE = Table(((0.0, 90.0), (10.0, 70.0), (25.0, 40.0), (100.0, 115.0), (140.0, 43.0), (157.0, 0.0)), "linear")


def loaded(formula: str, **fields: Any) -> MachineSpec:
    return MachineSpec(operation=OperationChoice("torque", "formula", formula=formula), **fields)


def saddle(load: str = "52") -> MachineSpec:
    return loaded(load, balance="motor", drive=Drive(motor="table", table=SADDLE))


def cycles_of(spec: MachineSpec, numbers: dict[str, Any]) -> SteadyCycles:
    found = steady_cycles(spec, numbers)
    assert found is not None
    return found


def test_a_load_of_constant_power_has_two_cycles() -> None:
    """100 (1 - w/22) = 400/w: the slower one is unstable, and parts standstill from the faster one."""
    found = cycles_of(loaded("400/omega", balance="motor", drive=Drive(motor="linear")), LINEAR)
    slow, fast = found.cycles
    for cycle, sign in ((slow, -1.0), (fast, 1.0)):
        speed = 11.0 + sign * math.sqrt(121.0 - 88.0)
        assert cycle.course.mean == pytest.approx(speed, rel=1e-10)
        slope = -100.0 / 22.0 + 400.0 / speed**2
        assert cycle.multiplier == pytest.approx(math.exp(TURN * slope / (2.0 * speed)), rel=1e-8)
    assert (slow.stable, fast.stable, found.case) == (False, True, 1)
    assert found.stops_below == slow.start == fast.low
    assert fast.high == found.runs_away_above == math.inf


def test_a_motor_with_a_saddle_has_two_speeds() -> None:
    found = cycles_of(saddle(), {"drive.inertia": 3.0})
    slow, between, fast = found.cycles
    assert [cycle.course.mean for cycle in found.cycles] == pytest.approx([19.0, 37.0, 135.0], rel=1e-9)
    for cycle, slope in ((slow, -2.0), (between, 1.0), (fast, -1.8)):
        assert cycle.multiplier == pytest.approx(math.exp(TURN * slope / (3.0 * cycle.course.mean)), rel=1e-8)
    assert (slow.low, slow.high, fast.low, fast.high) == (0.0, between.start, between.start, math.inf)
    assert math.isnan(between.low)
    # The results of the case are those of the faster one, as they come from the speed without load.
    assert found.case == 2
    assert found.reached_from(0.0, 0.0) is slow
    assert found.reached_from(1.0, 0.5 * 3.0 * 37.1**2) is fast


def test_a_shaft_can_run_away_or_stop() -> None:
    found = cycles_of(loaded("300 - 20*omega", balance="motor", drive=Drive(motor="linear")), LINEAR)
    (cycle,) = found.cycles
    assert not cycle.stable
    assert found.ending is Ending.UNSTABLE
    assert found.stops_below == found.runs_away_above == cycle.start == pytest.approx(200.0 / (20.0 - 100.0 / 22.0))
    assert found.reached_from(0.0, 1e3) is None


def test_only_torques_that_follow_the_speed_have_speeds() -> None:
    assert steady_cycles(PRESS, PRESS_NUMBERS) is None
    stuck = cycles_of(loaded("400", balance="motor", drive=Drive(motor="linear")), LINEAR)
    assert (stuck.cycles, stuck.ending, stuck.stops_below) == ((), Ending.MOTOR_STALLED, stuck.speeds[-1])


def test_a_run_up_comes_to_the_slowest_cycle() -> None:
    made = transient(saddle(), {"drive.inertia": 3.0}, Course("run-up"), 2)
    assert made.outcome == "reached"
    assert made.results["after.omega.mean"] == pytest.approx(19.0, rel=1e-9)
    # Within 1 % of the first difference, which is the whole speed.
    assert made.results["omega.end"] == pytest.approx(0.99 * 19.0, rel=1e-9)
    # From the faster cycle a blow takes the shaft below the unstable one only where it lasts.
    made = transient(saddle(), {"drive.inertia": 3.0}, Course("load-step", load=1.1), 2)
    assert made.results["after.omega.mean"] > 100.0


@pytest.mark.parametrize("seed", [2, 3, 13, 15])
def test_random_machines_against_marching(seed: int) -> None:
    """`python -m benchmarks.steady_cycles` tries 200 of them."""
    machine = random_machine(np.random.default_rng(seed))
    found = cycles_of(machine.spec, machine.numbers)
    assert found.whole
    batch = simulate(machine.spec, machine.numbers, cases=1)
    row = dict(zip(NAMES, batch.values[0].tolist(), strict=True))
    assert judged(machine, found, row["drive_torque.mean"]) == []
    ending = ENDINGS[int(batch.endings[0])]
    assert ending in {Ending.OK, Ending.UNSTABLE}
    assert found.case is not None
    assert found.cycles[found.case].stable == (ending is Ending.OK)
    assert found.cycles[found.case].multiplier == pytest.approx(row["cycle.multiplier"], rel=1e-6)
