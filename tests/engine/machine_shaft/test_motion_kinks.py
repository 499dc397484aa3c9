"""Kinks of torques that follow from the motion: extremes against runs from event to event that march to the cycle."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar

from sprag_study.engine.machine_shaft.columns import Columns
from sprag_study.engine.machine_shaft.motor_tables import motor_table
from sprag_study.engine.machine_shaft.simulate import attempts, simulate
from sprag_study.engine.machine_shaft.spec import Drive, MachineSpec, OperationChoice
from sprag_study.engine.machine_shaft.tables import Table
from tests.engine.machine_shaft.machines import one

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

ROWS = ((0.0, 50.0), (100.0, 60.0), (120.0, 80.0), (150.0, 0.0), (160.0, -40.0))
LINEAR = {"drive.motor.no_load_speed": 30.0, "drive.motor.stall_torque": 600.0}


def _marched(
    inertia: float,
    drive: Callable[[float], float],
    load: Callable[[float, float], float],
    ends: Sequence[float],
    kinks: Sequence[Callable[[float, float], float]],
    speed: float,
) -> dict[str, float]:
    """Extremes along the cycle to which the shaft comes from a ``speed``.

    A run ends at each of the angles ``ends`` and wherever one of ``kinks`` of angle and speed changes its sign. The
    inertia is constant: I omega domega/dphi is the sum of ``drive``, by speed, and ``load``, by angle and speed.
    """
    for _ in range(200):
        before, found = speed, []
        for start, end in pairwise((0.0, *ends, 2.0 * math.pi)):
            inside = 1e-12 * (end - start)

            def total(angle: float, omega: float, low: float = start + inside, high: float = end - inside) -> float:
                return drive(omega) + load(min(max(angle, low), high), omega)

            run = solve_ivp(
                lambda angle, y, total=total: [total(angle, y[0]) / (inertia * y[0])],
                (start, end), [speed], "DOP853", rtol=1e-12, atol=1e-12, max_step=0.1, dense_output=True,
                events=[lambda angle, y, kink=kink: kink(angle, y[0]) for kink in kinks],
            )  # fmt: skip
            speed = float(run.y[0, -1])
            found.append((run, total))
        if abs(speed - before) < 1e-11 * speed:
            break
    courses: dict[str, list[float]] = {"drive_torque": [], "omega": [], "acceleration": []}
    for run, total in found:

        def values(angle: float, run: Any = run, total: Any = total) -> tuple[float, float, float]:
            omega = float(run.sol(angle)[0])
            return drive(omega), omega, total(angle, omega) / inertia

        grid = np.linspace(run.t[0], run.t[-1], 401)
        places = [*grid.tolist(), *np.concatenate(run.t_events).tolist()]
        sampled = np.array([values(angle) for angle in grid.tolist()])
        for own, name in enumerate(courses):
            at = sampled[:, own]
            for sign in (1.0, -1.0):
                best = int(np.argmax(sign * at))
                around = (grid[max(best - 1, 0)], grid[min(best + 1, 400)])
                peak = minimize_scalar(
                    lambda angle, own=own, sign=sign, values=values: -sign * values(angle)[own],
                    bounds=around, method="bounded", options={"xatol": 1e-9},
                )  # fmt: skip
                places.append(float(peak.x))
            courses[name] += [values(angle)[own] for angle in places]
    most = {f"{name}.max": max(values) for name, values in courses.items()}
    return most | {f"{name}.min": min(values) for name, values in courses.items()}


def _table(interpolation: Any = "linear") -> MachineSpec:
    drive = Drive(motor="table", table=Table(ROWS, interpolation))
    return MachineSpec(balance="motor", drive=drive, operation=OperationChoice("torque", "steps", steps=1))


def _steps(inertia: float, torque: Any) -> dict[str, Any]:
    return {
        "drive.inertia": inertia, "operation.steps.0.from": 1.0, "operation.steps.0.to": 3.2,
        "operation.steps.0.value": torque,
    }  # fmt: skip


@pytest.mark.parametrize(("inertia", "torque"), [(0.1, 186.0), (0.05, 150.0), (0.3, 170.0)])
def test_extremes_where_the_speed_crosses_rows_of_a_motor(inertia: float, torque: float) -> None:
    """The largest torque of the motor is the one of its table's peak, and not above it."""
    got = one(_table(), _steps(inertia, torque))
    speeds, torques = np.array(ROWS).T

    def drive(omega: float) -> float:
        return float(np.interp(omega, speeds, torques))

    def load(phi: float, omega: float) -> float:
        return -torque if 1.0 < phi < 3.2 else 0.0

    kinks = [lambda phi, omega, at=at: omega - at for at in speeds.tolist()]
    wanted = _marched(inertia, drive, load, (1.0, 3.2), kinks, 140.0)
    assert {name: got[name] for name in wanted} == pytest.approx(wanted, rel=1e-9)
    if wanted["omega.min"] < 120.0 < wanted["omega.max"]:
        assert got["motor.torque.max"] <= 80.0 * (1.0 + 1e-12)


def _motored(formula: str, **changes: Any) -> tuple[MachineSpec, dict[str, float]]:
    """A linear motor of 600 N*m at rest and 30 rad/s without load, with a load by a formula."""
    operation = OperationChoice("torque", "formula", formula=formula)
    return MachineSpec(balance="motor", drive=Drive(motor="linear", **changes), operation=operation), LINEAR


def _linear(omega: float) -> float:
    return 600.0 * (1.0 - omega / 30.0)


def test_extremes_where_a_load_of_the_speed_switches() -> None:
    """A brake that acts above a speed, and one that acts either way about another speed."""
    spec, numbers = _motored("150 + 40*max(0, omega - 20) - 30*abs(omega - 19) + 100*sin(phi)")
    got = one(spec, numbers | {"drive.inertia": 3.0})

    def load(phi: float, omega: float) -> float:
        return -(150.0 + 40.0 * max(0.0, omega - 20.0) - 30.0 * abs(omega - 19.0) + 100.0 * math.sin(phi))

    kinks = [lambda phi, omega: omega - 20.0, lambda phi, omega: omega - 19.0]
    wanted = _marched(3.0, _linear, load, (), kinks, 22.0)
    assert {name: got[name] for name in wanted} == pytest.approx(wanted, rel=1e-9)


def test_extremes_where_a_load_jumps_by_the_speed() -> None:
    spec, numbers = _motored("100 + floor(omega) + 100*sin(phi)")
    got = one(spec, numbers | {"drive.inertia": 3.0})

    def load(phi: float, omega: float) -> float:
        return -(100.0 + math.floor(omega) + 100.0 * math.sin(phi))

    kinks = [lambda phi, omega, at=at: omega - at for at in (23.0, 24.0, 25.0)]
    wanted = _marched(3.0, _linear, load, (), kinks, 24.0)
    assert wanted["omega.min"] < 23.0
    assert wanted["omega.max"] > 25.0
    for name in ("drive_torque.max", "drive_torque.min", "omega.max", "omega.min"):
        assert got[name] == pytest.approx(wanted[name], rel=1e-8)


def test_the_largest_acceleration_is_where_a_brake_begins() -> None:
    """At the speed above which the load grows, for a given mean speed and a constant drive, which is found."""
    operation = OperationChoice("torque", "formula", formula="150 + 40*max(0, omega - 20) + 100*sin(phi)")
    got = one(MachineSpec(balance="constant", operation=operation), {"drive.inertia": 3.0, "mean_speed": 20.0})

    def load(phi: float, omega: float) -> float:
        return -(150.0 + 40.0 * max(0.0, omega - 20.0) + 100.0 * math.sin(phi))

    kinks = [lambda phi, omega: omega - 20.0]
    wanted = _marched(3.0, lambda omega: got["drive_torque.max"], load, (), kinks, 20.0)
    for name in ("omega.max", "omega.min", "acceleration.max", "acceleration.min"):
        assert got[name] == pytest.approx(wanted[name], rel=1e-9)


def test_extremes_of_a_given_mean_speed_where_the_load_drives_with_losses() -> None:
    """A load that follows the speed and pulls at times, less of which arrives: for a constant drive, which is found."""
    operation = OperationChoice("torque", "formula", formula="15*max(omega, 19) - 300 + 100*sin(phi)")
    numbers = {"drive.inertia": 3.0, "mean_speed": 20.0, "operation.efficiency": 0.7}
    got = one(MachineSpec(balance="constant", operation=operation), numbers)

    def lossless(phi: float, omega: float) -> float:
        return 300.0 - 15.0 * max(omega, 19.0) - 100.0 * math.sin(phi)

    def load(phi: float, omega: float) -> float:
        torque = lossless(phi, omega)
        return torque * 0.7 if torque > 0.0 else torque / 0.7

    kinks = [lambda phi, omega: omega - 19.0, lossless]
    wanted = _marched(3.0, lambda omega: got["drive_torque.max"], load, (), kinks, 20.0)
    assert 0.5 * (wanted["omega.max"] + wanted["omega.min"]) == pytest.approx(20.0, rel=1e-10)
    assert wanted["omega.min"] < 19.0
    for name in ("omega.max", "omega.min", "acceleration.max", "acceleration.min"):
        assert got[name] == pytest.approx(wanted[name], rel=1e-9)


def _cuts(spec: MachineSpec, numbers: dict[str, Any]) -> tuple[int, Any]:
    """Number of attempts at a case, and its last cuts."""
    with np.errstate(all="ignore"):
        every = list(attempts(spec, Columns.of(spec, numbers, 1)))
    return len(every), every[-1][1].decomposition.panels.cuts[0]


def test_cuts_lie_where_torques_with_losses_change_their_sign() -> None:
    """The motor brakes while the load drives: both lose power by its direction, and each change of sign is a cut."""
    spec, numbers = _motored("20 + 300*sin(phi)", stages=("gear",))
    numbers = numbers | {
        "drive.inertia": 1.0, "drive.stages.0.ratio": 2.0, "drive.stages.0.efficiency": 0.8,
        "drive.stages.0.output_inertia": 0.0, "operation.efficiency": 0.7,
    }  # fmt: skip
    got = one(spec, numbers)

    def at_shaft(omega: float) -> float:
        torque = 2.0 * _linear(2.0 * omega)
        return torque * 0.8 if torque > 0.0 else torque / 0.8

    def load(phi: float, omega: float) -> float:
        torque = -(20.0 + 300.0 * math.sin(phi))
        return torque * 0.7 if torque > 0.0 else torque / 0.7

    kinks = [lambda phi, omega: omega - 15.0, lambda phi, omega: 20.0 + 300.0 * math.sin(phi)]
    wanted = _marched(1.0, at_shaft, load, (), kinks, 15.0)
    assert wanted["omega.min"] < 15.0 < wanted["omega.max"]
    assert {name: got[name] for name in wanted} == pytest.approx(wanted, rel=1e-8)
    _, cuts = _cuts(spec, numbers)
    for angle in (math.pi + math.asin(1.0 / 15.0), 2.0 * math.pi - math.asin(1.0 / 15.0)):
        assert np.abs(cuts - angle).min() < 1e-9


@pytest.mark.parametrize("balance", ["scale", "refuse"])
def test_a_given_drive_with_losses_is_cut_where_it_changes_its_sign(balance: Any) -> None:
    """Also in a case without motion, for lack of balance or inertia."""
    drive = Drive("formula", formula="sin(phi + 0.003) + 0.2", stages=("gear",))
    spec = MachineSpec(balance=balance, drive=drive, operation=OperationChoice("torque", "steps", steps=1))
    numbers = {
        "mean_speed": 10.0, "drive.inertia": 1e-3, "drive.stages.0.ratio": 2.0, "drive.stages.0.efficiency": 0.5,
        "drive.stages.0.output_inertia": 0.0, "drive.scale": 1.0,
    }  # fmt: skip
    _, cuts = _cuts(spec, numbers | _steps(1e-3, 1.0))
    for angle in (math.pi + math.asin(0.2) - 0.003, 2.0 * math.pi - math.asin(0.2) - 0.003):
        assert np.abs(cuts - angle).min() < 1e-9


@pytest.mark.parametrize("at", [1e-4, 2.0 * math.pi - 1e-4])
def test_a_kink_beside_the_end_of_the_cycle_is_a_cut(at: float) -> None:
    """The first and the last node of a cycle are neighbours."""
    operation = OperationChoice("torque", "formula", formula="100*sin(phi - a)")
    spec = MachineSpec(operation=operation, constants=("a",))
    numbers = {"mean_speed": 20.0, "drive.inertia": 50.0, "operation.efficiency": 0.5, "constants.a": at}
    count, cuts = _cuts(spec, numbers)
    assert np.abs(cuts - at).min() < 1e-12
    assert count == 2


def test_rounding_errors_of_the_speed_are_no_kinks() -> None:
    """A shaft that turns evenly at a row of its motor, or at a speed at which its load has a kink, is left alone."""
    rows = ((0.0, 50.0), (100.0, 60.0), (120.0, 40.0), (150.0, 0.0))
    even = OperationChoice("torque", "formula", formula="40 + 0*phi")
    motored = MachineSpec(balance="motor", drive=Drive(motor="table", table=Table(rows, "linear")), operation=even)
    bent, numbers = _motored("300 + 30*abs(omega - 15)")
    for spec, given, speed in ((motored, {}, 120.0), (bent, numbers, 15.0)):
        own = given | {"drive.inertia": 1.0}
        assert one(spec, own)["omega.max"] == pytest.approx(speed, rel=1e-12)
        assert _cuts(spec, own)[0] == 1


def test_rows_on_a_straight_line_are_no_kinks() -> None:
    rows = tuple((0.5 * row, 100.0 - 0.5 * row) for row in range(221))
    assert not motor_table(Table(rows, "linear")).kinks.size
    bent = motor_table(Table(((0.0, 100.0), (30.0, 70.0), (50.0, 50.0), (80.0, -10.0)), "linear"))
    assert bent.kinks.tolist() == [50.0]
    smooth = motor_table(Table(ROWS, "smooth"))
    assert smooth.kinks.tolist() == [row[0] for row in ROWS]


def test_more_kinks_than_are_cut_at_leave_panels_as_they_are() -> None:
    """More than 300 bends are passed in a revolution: none is cut at, and bends as small as these need no panels."""
    rows = [(0.02 * row, 100.0 - 0.02 * row + 1e-9 * (row % 2)) for row in range(1, 5000)]
    bent = Table((*rows, (110.0, -10.0)), "linear")
    operation = OperationChoice("torque", "formula", formula="50 + 40*sin(phi)")
    table, linear = Drive(motor="table", table=bent), Drive(motor="linear")
    numbers = {"drive.inertia": 0.3}
    spec = MachineSpec(balance="motor", drive=table, operation=operation)
    assert motor_table(bent).kinks.size > 4900
    got = one(spec, numbers)
    straight = MachineSpec(balance="motor", drive=linear, operation=operation)
    wanted = one(straight, numbers | {"drive.motor.no_load_speed": 100.0, "drive.motor.stall_torque": 100.0})
    assert wanted["omega.max"] - wanted["omega.min"] > 0.02 * 200
    for name in ("omega.max", "omega.min", "drive_torque.max"):
        assert got[name] == pytest.approx(wanted[name], rel=1e-9)
    assert len(_cuts(spec, numbers)[1]) == 17


def test_a_batch_with_kinks_leaves_each_case_its_bits() -> None:
    torques = np.array([186.0, 20.0, 150.0, 240.0, 170.0])
    every = simulate(_table(), _steps(0.1, torques), cases=5)
    for place, torque in enumerate(torques.tolist()):
        alone = simulate(_table(), _steps(0.1, torque), cases=1)
        assert alone.values.tobytes() == every.values[place : place + 1].tobytes()
        assert alone.endings[0] == every.endings[place]
