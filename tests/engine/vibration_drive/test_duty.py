"""The duty of clutches: rainflow counts against published ones, a turn against several, numbers against scipy."""

from __future__ import annotations

import math
from collections import defaultdict
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import rainflow

from sprag_study.engine.endings import Ending
from sprag_study.engine.outcome import Duty
from sprag_study.engine.run import SettledRun
from sprag_study.engine.vibration_drive.duty import Rating, duty_of
from sprag_study.engine.vibration_drive.engagements import tables_of
from sprag_study.engine.vibration_drive.examined import Examined, examined, examined_settled
from sprag_study.engine.vibration_drive.pieces import extremes
from sprag_study.engine.vibration_drive.rainflow_counts import Cycle, cycles, equivalent, spectrum
from tests.engine.vibration_drive.drive import Columns, clutch, drive, one, pendulum, periods
from tests.engine.vibration_drive.reference_equations import Floats
from tests.engine.vibration_drive.reference_run import TORQUE_STATES, Drive
from tests.engine.vibration_drive.test_drag import damped, free_pair
from tests.engine.vibration_drive.test_engagements import LOCKING, TWO, w1

#: Reversals of the example of ASTM E1049-85, figures 4 to 6.
ASTM = (-2.0, 1.0, -3.0, 5.0, -1.0, 3.0, -4.0, 4.0, -2.0)
DAMPED = drive(1, pendulums__0__clutch_damping=0.05, pendulums__0__overrunning_damping=0.001)


def counts(history: list[float], *, repeats: bool) -> dict[float, float]:
    """Cycles by their range."""
    found: defaultdict[float, float] = defaultdict(float)
    for cycle in cycles(history, repeats=repeats):
        found[cycle.size] += cycle.number
    return dict(found)


def exponents(exponent: float) -> list[Rating]:
    """The Wöhler curve of each of two clutches."""
    return [Rating(exponent=exponent)] * 2


def settled(columns: Columns) -> Examined:
    return examined_settled(columns, SettledRun())


def test_the_example_of_the_standard() -> None:
    assert counts(list(ASTM), repeats=False) == {3.0: 0.5, 4.0: 1.5, 6.0: 0.5, 8.0: 1.0, 9.0: 0.5}


def test_the_example_of_the_standard_for_a_history_that_repeats() -> None:
    """Figure 7: the same history, counted from its largest peak on."""
    assert counts(list(ASTM)[:-1], repeats=True) == {3.0: 1.0, 4.0: 1.0, 7.0: 1.0, 9.0: 1.0}


@pytest.mark.parametrize("number", [2, 5])
def test_a_turn_counted_several_times_has_as_many_times_the_cycles(number: int) -> None:
    rng = np.random.default_rng(3)
    for _ in range(40):
        turn = rng.integers(0, 9, rng.integers(2, 30)).astype(float).tolist()
        once, often = counts(turn, repeats=True), counts(turn * number, repeats=True)
        assert often == {size: number * count for size, count in once.items()}
        assert all(count == round(count) for count in once.values())


def test_where_a_turn_begins_does_not_matter() -> None:
    rng = np.random.default_rng(4)
    turn = rng.integers(0, 9, 25).astype(float).tolist()
    for begin in range(1, 25):
        assert counts(turn[begin:] + turn[:begin], repeats=True) == counts(turn, repeats=True)


def test_a_steady_load_has_no_cycles() -> None:
    for history in ([], [2.0], [2.0, 2.0, 2.0]):
        assert cycles(history, repeats=True) == cycles(history, repeats=False) == []
    assert equivalent([], 3.0, 1.0) == 0.0


def test_rounding_is_no_cycle_and_cycles_alike_are_one() -> None:
    counted = cycles([0.0, 5.0, 5.0 - 1e-9, 7.0, 0.0, 7.0 + 1e-4, 0.0], repeats=False)
    assert len(counted) == 4
    (cycle,) = spectrum(counted)
    assert cycle == pytest.approx((7.0 + 5e-5, 3.5 + 2.5e-5, 2.0), rel=1e-12)


def test_turning_points_between_and_on_the_points_of_a_step() -> None:
    """The first is on one of the points at which a step is sampled."""
    rows, values = extremes(np.array([[0.0, 1.0, -1.0, 0.0], [1.0, -0.6, 1.0, 0.0], [0.0, 2.0, -4.5, 3.0 - 1e-3]]))
    assert rows[:6].tolist() == [0, 0, 0, 1, 1, 1]
    assert values[:6] == pytest.approx([0.0, 0.25, 0.0, 1.0, 0.91, 1.4])
    turns = np.roots([3.0 * (3.0 - 1e-3), -9.0, 2.0])
    inner = sorted(turns[(turns > 0.0) & (turns < 1.0)])
    assert values[7:-1] == pytest.approx([2.0 * x - 4.5 * x**2 + (3.0 - 1e-3) * x**3 for x in inner])


def test_a_load_that_only_rises_has_half_a_cycle() -> None:
    assert cycles([0.0, 5.0], repeats=False) == [Cycle(5.0, 2.5, 0.5)]
    assert counts([0.0, 5.0], repeats=True) == {5.0: 1.0}
    assert cycles([0.0, 2.0, 5.0, 5.0], repeats=False) == [Cycle(5.0, 2.5, 0.5)]


def test_the_equivalent_range() -> None:
    counted = [Cycle(4.0, 2.0, 1.0), Cycle(2.0, 1.0, 8.0)]
    assert equivalent(counted, 3.0, 1.0) == pytest.approx(128.0 ** (1.0 / 3.0))
    assert equivalent(counted, 3.0, 2.0) == pytest.approx(4.0)
    assert equivalent(counted, 300.0, 1.0) == pytest.approx(4.0, rel=1e-12)
    assert math.isnan(equivalent(counted, 3.0, 0.0))


@pytest.mark.parametrize("columns", [drive(1), TWO, LOCKING, DAMPED], ids=["one", "two", "locking", "damped"])
def test_the_duty_of_a_window_is_that_of_its_results(columns: Columns) -> None:
    run = periods(24, 14, 24)
    motion, row = examined(columns, run), one(columns, run)
    duty, table = duty_of(motion, exponents(4.0)), tables_of(motion)
    hours = 10.0 / columns["excitation.frequency"] / 3600.0
    assert (duty.ending, duty.start, duty.end) == (Ending.OK, table.start, table.end)
    for number, bears in enumerate(duty.rows):
        own = [found for found in table.rows if found.clutch == number]
        begun = [found for found in own if not math.isnan(found.impact_speed)]
        prefix = f"pendulums.{number}."
        assert bears.engagements_per_hour * hours == pytest.approx(row[f"{prefix}engagements"])
        assert bears.torque_max == pytest.approx(row[f"{prefix}torque.max"], rel=1e-12)
        assert bears.windup_max == pytest.approx(row[f"{prefix}windup.max"], rel=1e-9)
        assert bears.slip_work_per_hour == row[f"{prefix}power.clutch_loss"] * 3600.0
        assert bears.impact_speed_max == max(found.impact_speed for found in begun)
        assert bears.torque_rate_max == max(found.torque_rate_max for found in own)
        assert bears.windup_max == max(found.windup_max for found in own)
        counted = [cycle for cycle in duty.cycles if cycle.clutch == number]
        assert sum(cycle.per_hour for cycle in counted) == pytest.approx(bears.cycles_per_hour)
        assert max(cycle.range for cycle in counted) == pytest.approx(bears.torque_max, rel=1e-3)
        assert 0.9 * bears.torque_max < bears.torque_equivalent <= bears.torque_max * (1.0 + 1e-12)


@pytest.mark.parametrize("columns", [w1(20.0, 0.002, 0.1), w1(35.0, 0.0015, 0.1), TWO, DAMPED])
def test_the_duty_of_a_turn_is_that_of_many_periods(columns: Columns) -> None:
    turn = settled(columns)
    duty, run = (
        duty_of(turn, exponents(3.0)),
        duty_of(examined(columns, periods(840, 840 - 20 * turn.turn, 840)), exponents(3.0)),
    )
    assert duty.regime == "periodic"
    for settled_row, row in zip(duty.rows, run.rows, strict=True):
        for name in (
            "engagements_per_hour", "torque_max", "torque_rate_max", "torque_jump_max", "impact_speed_max",
            "overrunning_speed_max", "windup_max", "slip_work_per_hour", "cycles_per_hour", "torque_equivalent",
        ):  # fmt: skip
            assert getattr(settled_row, name) == pytest.approx(getattr(row, name), rel=2e-6, abs=1e-12), name


def _impact(columns: Columns) -> Duty:
    """The duty of a clutch between a free pendulum and a free shaft at rest."""
    return duty_of(examined(columns, periods(1.0, 0.0, 1.0)), exponents(3.0))


def test_an_impact_with_a_spring_is_that_of_two_free_bodies() -> None:
    """Closed form: the torque is a half sine, after which nothing happens."""
    columns = free_pair(**{"pendulums.0.backlash": 0.01})
    (bears,) = _impact(columns).rows
    speed = columns["pendulums.0.initial_speed"]
    inertia, shaft = columns["pendulums.0.inertia"], columns["shaft.inertia"]
    nu = math.sqrt(200.0 * (1.0 / inertia + 1.0 / shaft))
    assert bears.impact_speed_max == pytest.approx(speed, rel=1e-9)
    assert bears.torque_max == pytest.approx(200.0 * speed / nu, rel=1e-9)
    assert bears.torque_rate_max == pytest.approx(200.0 * speed, rel=1e-9)
    assert bears.overrunning_speed_max == pytest.approx(speed, rel=1e-8)
    assert (bears.windup_min, bears.windup_max) == (0.0, pytest.approx(speed / nu, rel=1e-9))
    assert bears.torque_jump_max == bears.slip_work_per_hour == 0.0
    assert bears.torque_equivalent == pytest.approx(bears.torque_max, rel=1e-9)


def test_a_damped_impact_jumps_and_turns_energy_into_heat() -> None:
    damping = 0.2
    columns = free_pair(**{"pendulums.0.backlash": 0.01, "pendulums.0.clutch_damping": damping})
    (bears,) = _impact(columns).rows
    row = one(columns, periods(1.0, 0.0, 1.0))
    assert bears.torque_jump_max == pytest.approx(damping * 6.0, rel=1e-9)
    heat = bears.slip_work_per_hour / 3600.0 * 0.05
    speeds = row["pendulums.0.speed.min"], row["shaft.speed.max"]
    inertia, shaft = columns["pendulums.0.inertia"], columns["shaft.inertia"]
    assert heat == pytest.approx(0.5 * (inertia * (36.0 - speeds[0] ** 2) - shaft * speeds[1] ** 2), rel=1e-8)


class Watched(Drive):
    """The second implementation, which also records what clutches have to bear."""

    def __init__(self, columns: Columns) -> None:
        super().__init__(columns, literal=False)
        self.history: list[list[float]] = [[] for _ in self.pendulums]
        self.impacts: list[list[float]] = [[] for _ in self.pendulums]

    def watch(self, times: Floats, values: Floats, dense: Any) -> None:
        super().watch(times, values, dense)
        if self.watching and times[-1] > times[0]:
            fine = np.linspace(times[0], times[-1], 121)
            torques, _ = self.torques(fine, dense(fine))
            for state, torque, history in zip(self.clutches, torques, self.history, strict=True):
                history.extend(np.broadcast_to(torque if state in TORQUE_STATES else 0.0, fine.shape).tolist())

    def watched(self, t: Any, y: Any) -> dict[str, Any]:
        out, n = super().watched(t, y), self.n
        torques, shaft = self.torques(t, y)
        for i, p in enumerate(self.pendulums):
            lead = y[n + i] - y[self.shaft]
            if self.clutches[i] == "free":
                out[f"pendulums.{i}.overrun"] = -lead
            if self.clutches[i] == "engaged":
                stiffness = np.polyval(np.polyder(np.poly1d(p.law[::-1])), y[2 * n + i])
                gained = (self.free_moment(i, t, y) - torques[i]) / p.inertia - shaft
                rate = stiffness * lead + p.clutch_damping * gained
                out[f"pendulums.{i}.rise"], out[f"pendulums.{i}.fall"] = rate, -rate
        return out

    def wind(self, i: int, y: Floats, windup: float, state: str) -> None:
        if self.watching and self.clutches[i] == "take_up":
            self.impacts[i].append(float(y[self.n + i] - y[self.shaft]))
        super().wind(i, y, windup, state)


@pytest.mark.parametrize("columns", [TWO, DAMPED, damped(2, 308, 2)[1]], ids=["two", "damped", "random"])
def test_duty_is_that_of_an_independent_integration(columns: Columns) -> None:
    duty, machine = duty_of(examined(columns, periods(14, 8, 14))), Watched(columns)
    machine.run(14, (8, 14))
    largest, hours = machine.out.largest, 6.0 / columns["excitation.frequency"] / 3600.0
    for i, bears in enumerate(duty.rows):
        assert round(bears.engagements_per_hour * hours) == len(machine.impacts[i])
        assert bears.impact_speed_max == pytest.approx(max(machine.impacts[i]), rel=1e-7)
        rate = max(largest[f"pendulums.{i}.rise"], largest[f"pendulums.{i}.fall"])
        assert bears.torque_rate_max == pytest.approx(rate, rel=1e-6)
        assert bears.overrunning_speed_max == pytest.approx(largest[f"pendulums.{i}.overrun"], rel=1e-7)
        assert bears.windup_max == pytest.approx(largest[f"pendulums.{i}.windup.max"], rel=1e-7)
        jumps = [abs(after - before) for before, after in pairwise(machine.history[i])]
        assert bears.torque_jump_max == pytest.approx(max(jumps), abs=2e-3 * bears.torque_max)
        sampled = rainflow.count_cycles(machine.history[i])
        counted = [cycle for cycle in duty.cycles if cycle.clutch == i]
        for power in (0.0, 1.0, 3.0):
            own = sum(cycle.count * cycle.range**power for cycle in counted if cycle.range > 0.01 * bears.torque_max)
            other = sum(count * size**power for size, count in sampled if size > 0.01 * bears.torque_max)
            assert own == pytest.approx(other, rel=1e-5)


def test_a_clutch_that_never_lets_go_has_the_range_of_its_windup() -> None:
    """Its windup is known from the state in which the part begins."""
    pressed = drive(
        1, **pendulum(0, backlash=0.0, initial_angle=-0.05, damping=2.0), **clutch(0.0, 200.0), shaft__load=10.0,
        excitation__amplitude_x=1e-4, excitation__amplitude_y=0.0,
    )  # fmt: skip
    for motion in (settled(pressed), examined(pressed, periods(600, 590, 600))):
        duty = duty_of(motion, exponents(3.0))
        (bears,), largest = duty.rows, max(duty.cycles, key=lambda cycle: cycle.range)
        assert (bears.engagements_per_hour, bears.impact_speed_max, bears.torque_jump_max) == (0.0, 0.0, 0.0)
        assert math.isnan(bears.torque_equivalent)
        assert bears.torque_max == pytest.approx(200.0 * bears.windup_max, rel=1e-9)
        assert largest.range == pytest.approx(200.0 * (bears.windup_max - bears.windup_min), rel=1e-6)
        assert 0.0 < bears.windup_min < bears.windup_max


def test_a_run_that_begins_wound_up_counts_from_there() -> None:
    begun = drive(1, **pendulum(0, initial_windup=0.01, initial_clutch=2.0))
    run = periods(12, 0, 12)
    (bears,), row = duty_of(examined(begun, run), exponents(3.0)).rows, one(begun, run)
    assert bears.windup_max == pytest.approx(row["pendulums.0.windup.max"], rel=1e-9)
    assert bears.windup_max >= 0.01
    assert bears.torque_jump_max == 0.0
