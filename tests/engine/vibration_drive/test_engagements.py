"""Engagements against the results of the same case, an independent integration, and the turn of an orbit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from benchmarks.workloads import W1
from sprag_study.engine.endings import Ending
from sprag_study.engine.outcome import Engagement, Engagements
from sprag_study.engine.run import Reset, SettledRun
from sprag_study.engine.vibration_drive.engagements import tables_of
from sprag_study.engine.vibration_drive.examined import MAX_PERIODS, examined, examined_settled
from sprag_study.engine.vibration_drive.regimes import settled_infos
from sprag_study.engine.vibration_drive.settle import settle
from sprag_study.engine.vibration_drive.simulate import trajectory
from tests.engine.vibration_drive.drive import Columns, clutch, column, drive, one, pendulum, periods

#: Every pendulum of these works, and their clutches overlap.
TWO = drive(2, **pendulum(1, spring_rate=10000.0), shaft__load=0.3)
LITERAL = drive(1, **pendulum(0, backlash=0.0), shaft__load=0.02, excitation__amplitude_x=0.003)
LOCKING = drive(1, **pendulum(0, backlash=0.0), **clutch(0.4, 200.0, 0.0, 2e4))


def settled(columns: Columns, **settings: Any) -> tuple[Engagements, dict[str, float]]:
    """The table of a settled case, and its results."""
    run = SettledRun(**settings)
    names = [info.name for info in settled_infos(1)]
    row = dict(zip(names, settle(columns, run, cases=1).values[0], strict=True))
    return tables_of(examined_settled(columns, run)), row


def w1(frequency: float, amplitude: float, load: float, **changes: float) -> Columns:
    """A drive of the first workload."""
    named = {path.replace("__", "."): value for path, value in changes.items()}
    return {
        **W1.columns(np.array([0])),
        "excitation.frequency": frequency,
        "excitation.amplitude_x": amplitude,
        "excitation.amplitude_y": amplitude,
        "shaft.load": load,
        **named,
    }


@pytest.mark.parametrize("reset", ["contact", "literal"])
@pytest.mark.parametrize("columns", [drive(1), TWO, LITERAL, LOCKING], ids=["one", "two", "no backlash", "locking"])
def test_counts_torques_work_and_times_are_those_of_the_results(columns: Columns, reset: Reset) -> None:
    run = periods(24, 14, 24, reset=reset)
    table, row = tables_of(examined(columns, run)), one(columns, run)
    length = 10.0 / columns["excitation.frequency"]
    assert table.ending is Ending.OK
    assert (table.start, table.end) == pytest.approx((14.0 / 20.0, 24.0 / 20.0))
    assert sum(found.work_shaft for found in table.rows) == pytest.approx(row["power.clutch.mean"] * length, rel=1e-9)
    assert [found.start for found in table.rows] == sorted(found.start for found in table.rows)
    n = 1 + max(found.clutch for found in table.rows)
    for i in range(n):
        own = [found for found in table.rows if found.clutch == i]
        begun = [found for found in own if found.start > table.start]
        assert len(begun) == row[f"pendulums.{i}.engagements"]
        assert max(found.torque_max for found in own) == pytest.approx(row[f"pendulums.{i}.torque.max"], rel=1e-12)
        engaged = sum(found.end - found.start for found in own)
        assert engaged == pytest.approx(row[f"pendulums.{i}.fraction.engaged"] * length, rel=1e-9)
    assert max(found.order for found in table.rows) == row["clutches.driving_max"]


def test_work_that_a_literal_reset_loses_is_the_difference_of_both_works() -> None:
    run = periods(24, 14, 24, reset="literal")
    table, row = tables_of(examined(LITERAL, run)), one(LITERAL, run)
    assert all(found.complete for found in table.rows[1:-1])
    lost = sum(found.work_pendulum - found.work_shaft for found in table.rows)
    stored = row["power.stored.mean"]
    assert row["reset.energy_lost"] >= 0.0
    assert lost == pytest.approx(row["reset.energy_lost"], rel=1e-6, abs=1e-9 + 10.0 * abs(stored))


def test_periods_are_those_of_the_whole_run() -> None:
    run = periods(24, 14, 24)
    table, row = tables_of(examined(drive(1), run)), one(drive(1), run)
    assert [found.start * 20.0 for found in table.periods] == pytest.approx(list(range(24)))
    window = table.periods[14:]
    assert np.mean([found.speed_mean for found in window]) == pytest.approx(row["shaft.speed.mean"], rel=1e-12)
    assert max(found.speed_max for found in window) == pytest.approx(row["shaft.speed.max"], rel=1e-12)
    assert np.mean([found.torque_mean for found in window]) == pytest.approx(row["torque.mean"], rel=1e-12)
    assert table.periods[0].speed_mean < table.periods[-1].speed_mean


def test_a_window_cuts_the_engagements_at_its_ends() -> None:
    table = tables_of(examined(drive(1), periods(24, 14, 24)))
    first = next(found for found in table.rows if found.complete)
    cut = 0.5 * (first.start + first.end) * 20.0
    halves = [tables_of(examined(drive(1), periods(24, *window))).rows for window in ((14, cut), (cut, 24))]
    left, right = halves[0][-1], halves[1][0]
    assert (left.complete, right.complete) == (False, False)
    assert left.end == pytest.approx(cut / 20.0, rel=1e-12)
    assert right.start == pytest.approx(cut / 20.0, rel=1e-12)
    assert left.work_shaft + right.work_shaft == pytest.approx(first.work_shaft, rel=1e-7)


def test_of_a_long_run_the_last_periods_are_told() -> None:
    table = tables_of(examined(drive(1), periods(MAX_PERIODS + 20, 0, MAX_PERIODS + 20)))
    assert len(table.periods) == MAX_PERIODS
    assert table.start * 20.0 == pytest.approx(20.0)
    assert table.rows[0].start >= table.start


def test_of_a_longer_run_the_part_begins_with_a_period() -> None:
    motion = examined(drive(1), periods(MAX_PERIODS + 20.5, 0, MAX_PERIODS + 20.5))
    assert motion.part is not None
    assert motion.start == pytest.approx(21 * motion.period)
    assert (motion.part.start[0], motion.part.end[-1]) == pytest.approx((21.0, MAX_PERIODS + 20.5))


def test_an_engagement_is_that_of_an_independent_integration() -> None:
    columns, run = drive(1), periods(24, 14, 24)
    found = tables_of(examined(columns, run)).rows[3]
    at = trajectory(columns, run, [found.start])
    names = ("pendulums.0.angle", "pendulums.0.speed", "shaft.speed")
    end, torque, work = _by_scipy(columns, found, [float(column(at, name)[0]) for name in names])
    assert found.end - found.start == pytest.approx(end, rel=1e-8)
    assert found.torque_max == pytest.approx(torque, rel=1e-8)
    assert found.work_shaft == pytest.approx(work, rel=1e-8)


def _by_scipy(columns: Columns, found: Engagement, state: list[float]) -> tuple[float, float, float]:
    """Length of an engagement, largest torque, work on the shaft: from the equations of motion."""
    c = {path.removeprefix("pendulums.0."): value for path, value in columns.items()}
    nu, moment = 2.0 * np.pi * c["excitation.frequency"], c["mass"] * c["arm"]

    def law(u: float) -> float:
        return float(sum(c[f"clutch.coefficients.{k}"] * u**k for k in range(4)))

    def rates(t: float, y: Any) -> list[float]:
        phi, speed, shaft, u, _ = y
        phase = nu * (found.start + t)
        across = -c["excitation.amplitude_x"] * nu**2 * np.cos(phase) * np.cos(phi)
        upright = c["excitation.amplitude_y"] * nu**2 * np.sin(phase)
        drive_ = moment * (across + (9.80665 - upright) * np.sin(phi))
        spring = c["spring_rate"] * c["spring_arm"] ** 2 * phi
        gain = (drive_ - spring - c["damping"] * speed - law(u)) / c["inertia"]
        return [speed, gain, (law(u) - c["shaft.load"]) / c["shaft.inertia"], speed - shaft, law(u) * shaft]

    def open_again(t: float, y: Any) -> float:
        return float(y[3]) if t > 1e-4 else 1.0

    open_again.terminal = True  # type: ignore[attr-defined]
    done = solve_ivp(
        rates, (0.0, 0.04), [*state, 0.0, 0.0], method="DOP853", rtol=1e-12, atol=1e-14, events=open_again,
        dense_output=True,
    )  # fmt: skip
    end = float(done.t_events[0][0])
    times = np.linspace(0.0, end, 20001)
    return end, max(law(u) for u in done.sol(times)[3]), float(done.sol(end)[4])


def test_one_turn_of_an_orbit() -> None:
    table, row = settled(w1(25.0, 0.002, 0.2))
    (found,) = table.rows
    assert (table.regime, table.start, table.end) == ("periodic", 0.0, 2.0 / 25.0)
    assert found.torque_max == pytest.approx(4.0567750130, abs=1e-9)
    assert found.torque_max == pytest.approx(row["torque.max"], rel=1e-12)
    assert found.work_shaft == pytest.approx(row["power.clutch.mean"] * 2.0 / 25.0, rel=1e-10)
    assert found.work_pendulum == pytest.approx(found.work_shaft, rel=1e-9)
    assert (found.clutch, found.order, found.complete) == (0, 1, True)
    assert len(table.periods) == 2
    assert np.mean([each.speed_mean for each in table.periods]) == pytest.approx(22.8350116679, abs=1e-9)


@pytest.mark.parametrize(
    ("frequency", "amplitude", "load"), [(20.0, 0.002, 0.1), (35.0, 0.0015, 0.1), (15.0, 0.003, 0.3)]
)
def test_every_engagement_of_a_turn_is_told_once_and_whole(frequency: float, amplitude: float, load: float) -> None:
    table, row = settled(w1(frequency, amplitude, load))
    assert table.regime == "periodic"
    assert len(table.rows) == row["pendulums.0.engagements"]
    assert all(found.complete and 0.0 <= found.start < table.end for found in table.rows)
    work = sum(found.work_shaft for found in table.rows)
    assert work == pytest.approx(row["power.clutch.mean"] * table.end, rel=1e-9)
    assert sum(found.end - found.start for found in table.rows) == pytest.approx(
        row["pendulums.0.fraction.engaged"] * table.end, rel=1e-9
    )


def test_a_machine_that_nothing_moves_has_an_empty_table() -> None:
    table, _ = settled(w1(25.0, 0.0, 0.2))
    assert (table.regime, table.rows) == ("held", ())
    assert [each.speed_max for each in table.periods] == [0.0]


def test_a_clutch_that_never_lets_go_is_told_over_the_whole_part() -> None:
    # The spring presses the pendulum against the held shaft, and the damping keeps it there.
    pressed = drive(
        1,
        **pendulum(0, backlash=0.0, initial_angle=-0.05, damping=2.0),
        **clutch(0.0, 200.0),
        shaft__load=10.0,
        excitation__amplitude_x=1e-5,
        excitation__amplitude_y=0.0,
    )
    table, row = settled(pressed)
    (found,) = table.rows
    assert row["pendulums.0.fraction.engaged"] == 1.0
    assert (found.start, found.end, found.complete) == (table.start, pytest.approx(table.end), False)
    assert found.torque_max == pytest.approx(row["pendulums.0.torque.max"], rel=1e-12)
    assert found.torque_max > 0.9


def test_without_a_load_no_clutch_works_once_settled() -> None:
    table, _ = settled(w1(25.0, 0.002, 0.0))
    assert (table.regime, table.rows, table.ending) == ("coasting", (), Ending.OK)


def test_an_irregular_motion_is_told_over_the_largest_order() -> None:
    table, _ = settled(w1(25.0, 0.0002, 3.0), max_period=8)
    assert table.regime in ("irregular", "unsettled")
    assert table.end - table.start == pytest.approx(8.0 / 25.0)
    assert len(table.periods) in (7, 8)
    assert all(found.work_shaft == 0.0 and found.torque_max < 3.0 for found in table.rows)


def test_a_case_that_does_not_end_ok_has_no_rows() -> None:
    run = periods(24, 14, 24, max_steps=50)
    table = tables_of(examined(drive(1), run))
    assert (table.ending, table.rows, table.periods) == (Ending.STEP_BUDGET, (), ())
