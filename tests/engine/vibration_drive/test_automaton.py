"""The automaton's table (docs/theory.md), and its rarer states on machines that can be worked out by hand."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from sprag_study.engine.vibration_drive.automaton import (
    CLUTCH_TARGET,
    CLUTCH_THRESHOLD,
    TRANSITIONS,
    Band,
    Clutch,
    Quantity,
    Shaft,
    Threshold,
    Transition,
)
from sprag_study.engine.vibration_drive.simulate import trajectory
from tests.engine.vibration_drive.drive import Columns, clutch, column, drive, one, pendulum, periods

UP, DOWN = +1, -1

#: The table of docs/theory.md row by row: state, what it watches, direction, threshold, next state; START stands for
#: "xi := 0, then TAKE-UP; if delta = 0: ENGAGED, or LOCKED".
MODEL_TABLE = {
    (Clutch.FREE, Quantity.RELATIVE_SPEED, UP, Threshold.ZERO, Clutch.START),
    (Clutch.TAKE_UP, Quantity.WINDUP, UP, Threshold.ZERO, Clutch.ENGAGED),
    (Clutch.TAKE_UP, Quantity.RELATIVE_SPEED, DOWN, Threshold.ZERO, Clutch.FREE),
    (Clutch.ENGAGED, Quantity.WINDUP, DOWN, Threshold.ZERO, Clutch.FREE),
    (Clutch.ENGAGED, Quantity.WINDUP, UP, Threshold.DATA_END, Clutch.BEYOND),
    (Clutch.BEYOND, Quantity.WINDUP, DOWN, Threshold.DATA_END, Clutch.ENGAGED),
    (Clutch.LOCKED, Quantity.LOCK_TORQUE, UP, Threshold.FIRST_COEFFICIENT, Clutch.ENGAGED),
    (Clutch.LOCKED, Quantity.LOCK_TORQUE, DOWN, Threshold.ZERO, Clutch.FREE),
    (Shaft.HELD, Quantity.TOTAL_TORQUE, UP, Threshold.LOAD, Shaft.ROTATING),
    (Shaft.ROTATING, Quantity.SHAFT_SPEED, DOWN, Threshold.ZERO, Shaft.HELD),
}
#: What the letter of (5) adds: every upward crossing starts anew, once the speed has fallen through zero.
LITERAL_STARTS = {
    (state, Quantity.RELATIVE_SPEED, UP, Threshold.ZERO, Clutch.START) for state in (Clutch.ENGAGED, Clutch.BEYOND)
}

#: A clutch with damping does not pull: it opens where its torque falls to zero, perhaps still wound up.
DAMPED_RELEASES = {
    (state, Quantity.CLUTCH_TORQUE, DOWN, Threshold.ZERO_IF_DAMPED, Clutch.FREE)
    for state in (Clutch.ENGAGED, Clutch.BEYOND)
}


def _key(row: Transition) -> tuple[object, ...]:
    return (row.source, row.quantity, row.direction, row.threshold, row.target)


def test_table_is_the_model() -> None:
    # IntEnums of clutch and shaft compare as numbers, so the kind of the state is compared too.
    def typed(keys: object) -> set[tuple[object, ...]]:
        return {(type(key[0]).__name__, *key) for key in keys}  # type: ignore[attr-defined]

    damped = {_key(row) for row in TRANSITIONS if row.threshold is Threshold.ZERO_IF_DAMPED}
    always = [_key(row) for row in TRANSITIONS if not row.literal_only and _key(row) not in damped]
    literal = {_key(row) for row in TRANSITIONS if row.literal_only}
    assert typed(always) == typed(MODEL_TABLE)
    assert len(always) == len(MODEL_TABLE)
    assert typed(literal) >= typed(LITERAL_STARTS)
    assert typed(damped) == typed(DAMPED_RELEASES)
    # Anything else that literal resets watch only waits for the speed to fall and leaves the state as it is.
    assert all(key[0] == key[4] and key[2] == DOWN for key in literal - LITERAL_STARTS)


def test_every_row_says_what_it_sets() -> None:
    assert all(row.reset for row in TRANSITIONS)
    assert all(row.source is not Clutch.START for row in TRANSITIONS)


EDGES = {
    (Quantity.RELATIVE_SPEED, DOWN): Band.W_LOW,
    (Quantity.RELATIVE_SPEED, UP): Band.W_HIGH,
    (Quantity.WINDUP, DOWN): Band.U_LOW,
    (Quantity.WINDUP, UP): Band.U_HIGH,
    (Quantity.LOCK_TORQUE, DOWN): Band.T_LOW,
    (Quantity.CLUTCH_TORQUE, DOWN): Band.T_LOW,
    (Quantity.LOCK_TORQUE, UP): Band.T_HIGH,
}


@pytest.mark.parametrize("literal", [0, 1])
def test_compiled_arrays_are_the_table(literal: int) -> None:
    rows = {
        (int(row.source), int(EDGES[row.quantity, row.direction])): row
        for row in TRANSITIONS
        if isinstance(row.source, Clutch) and (literal or not row.literal_only)
    }
    for state in Clutch:
        for band in Band:
            row = rows.get((int(state), int(band)))
            assert CLUTCH_THRESHOLD[literal, state, band] == (row.threshold if row else 0)
            if row:
                assert CLUTCH_TARGET[literal, state, band] == row.target


def test_documentation_has_the_table() -> None:
    text = (Path(__file__).resolve().parents[3] / "docs" / "theory.md").read_text(encoding="utf-8")
    block = text.split("<!-- transitions: begin -->")[1].split("<!-- transitions: end -->")[0]
    rows = [[cell.strip() for cell in line.strip("| ").split("|")] for line in block.strip().splitlines()][2:]
    documented = [(row[0].removesuffix(" (literal)"), "(literal)" in row[0], row[1], row[2], row[4]) for row in rows]
    direction = {UP: "upward", DOWN: "downward"}
    table = [
        (row.source.name, row.literal_only, str(row.quantity), direction[row.direction], row.target.name)
        for row in TRANSITIONS
    ]
    assert documented == table


# LOCKED: delta = 0 and c_1 above any torque that is needed.


def locking(**changes: float) -> Columns:
    """A weightless, springless pendulum driven by the base; a clutch that can lock; a shaft without load."""
    return {
        "gravity": 0.0, "excitation.frequency": 1.0, "excitation.amplitude_x": 0.01,
        "shaft.inertia": 3.0, "shaft.load": 0.0, **clutch(1e6, 1e6),
        **pendulum(0, inertia=1.0, mass=1.0, arm=1.0, spring_rate=0.0, damping=0.0, backlash=0.0),
    } | changes  # fmt: skip


def test_pendulum_and_shaft_move_together_as_one_inertia() -> None:
    # x'' = -d nu^2 cos nu t takes the pendulum back for half a period; as fast as the shaft again, it locks and pushes
    # for a quarter, until x'' changes sign.
    columns = locking()
    times = np.linspace(0.0, 1.0, 401)
    path = trajectory(columns, periods(1.0, 0.0, 1.0), times)
    states = np.array(path.states["pendulums.0"])
    locked = states == "locked"
    assert set(states) == {"free", "locked"}
    shaft, own = column(path, "shaft.speed"), column(path, "pendulums.0.speed")
    np.testing.assert_array_equal(shaft[locked], own[locked])
    rate, turn = column(path, "pendulums.0.acceleration"), column(path, "shaft.acceleration")
    np.testing.assert_allclose(rate[locked], turn[locked], rtol=1e-12, atol=1e-12)
    nu = 2.0 * math.pi
    push = -0.01 * nu**2 * np.cos(nu * times) * np.cos(column(path, "pendulums.0.angle"))
    np.testing.assert_allclose(turn[locked], push[locked] / 4.0, rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(column(path, "pendulums.0.torque")[locked], 0.75 * push[locked], rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(rate[~locked], push[~locked], rtol=1e-9, atol=1e-10)
    assert one(columns, periods(1.0, 0.0, 1.0))["pendulums.0.windup.max"] == 0.0


def test_a_lock_ends_where_its_torque_would_be_negative() -> None:
    # The pair is pushed by x'' alone, which changes sign at three quarters of the period; cos phi only scales it.
    times = np.linspace(0.0, 1.0, 4001)
    states = trajectory(locking(), periods(1.0, 0.0, 1.0), times).states["pendulums.0"]
    ends = [k for k in range(1, len(times)) if states[k - 1] == "locked" and states[k] != "locked"]
    assert times[ends] == pytest.approx([0.75], abs=times[1])


def test_a_lock_gives_way_at_its_first_coefficient() -> None:
    # The torque needed peaks at 0.75 d nu^2 = 0.296: a c_1 of half of it lets the clutch wind up.
    row = one(locking() | clutch(0.15, 50.0), periods(1.0, 0.0, 1.0))
    assert row["pendulums.0.windup.max"] > 0.0
    assert row["pendulums.0.torque.max"] > 0.15
    assert row["balance.energy"] < 1e-9
    assert row["balance.momentum"] < 1e-9


SIZE = 0.01 * (2.0 * math.pi) ** 2


def level(load: float, phase: float) -> Columns:
    """A pendulum started level, which the vertical vibration pushes by SIZE sin(nu t + phase) against a load."""
    return locking() | {
        "excitation.amplitude_x": 0.0, "excitation.amplitude_y": 0.01, "excitation.phase": phase, "shaft.load": load,
        "pendulums.0.initial_angle": -math.pi / 2.0,
    }  # fmt: skip


def test_a_held_shaft_holds_the_pendulum_that_is_locked_to_it() -> None:
    columns = level(1.1 * SIZE, 0.01)
    times = np.linspace(0.0, 0.49, 50)
    path = trajectory(columns, periods(1.0, 0.0, 1.0), times)
    assert set(path.states["shaft"]) == {"held"}
    assert set(path.states["pendulums.0"]) == {"locked"}
    np.testing.assert_array_equal(column(path, "pendulums.0.speed"), 0.0)
    np.testing.assert_allclose(column(path, "torque"), SIZE * np.sin(2.0 * math.pi * times + 0.01), rtol=0, atol=1e-8)


def test_breakaway_of_a_held_shaft_by_a_locked_pendulum() -> None:
    load, phase = 0.5 * SIZE, 0.01
    times = np.linspace(0.0, 0.5, 5001)
    path = trajectory(level(load, phase), periods(1.0, 0.0, 1.0), times)
    first = path.states["shaft"].index("rotating")
    assert times[first] == pytest.approx((math.asin(0.5) - phase) / (2.0 * math.pi), abs=times[1])
    states = np.array(path.states["pendulums.0"])
    assert set(states[: first + 100]) == {"locked"}
    together = (states == "locked") & (np.arange(len(times)) >= first)
    push = -SIZE * np.sin(2.0 * math.pi * times + phase) * np.sin(column(path, "pendulums.0.angle"))
    found = column(path, "shaft.acceleration")[together]
    np.testing.assert_allclose(found, (push[together] - load) / 4.0, rtol=1e-8, atol=1e-10)


def test_start_with_no_acceleration_yet() -> None:
    at_once, later = (one(level(0.5 * SIZE, phase), periods(1.0, 0.0, 1.0)) for phase in (0.0, 1e-9))
    assert at_once["shaft.turn"] == pytest.approx(later["shaft.turn"], rel=1e-7)


@pytest.mark.parametrize("backlash", [0.0, 1e-3])
def test_where_the_data_end_changes_nothing_for_a_straight_law(backlash: float) -> None:
    """Beyond the data the law goes on straight, and under literal resets a turn of the pendulum counts once."""
    machine = drive(1, **clutch(0.0, 60.0, 0.0, 0.0)) | pendulum(0, backlash=backlash) | {"shaft.load": 0.8}
    run = periods(8.0, 3.0, 8.0, reset="literal")
    free, *limited = (one(machine | {"clutch.windup_limit": end}, run) for end in (math.inf, 1e-2, 1.2e-3, 6e-4))
    assert free["pendulums.0.fraction.beyond_data"] == 0.0
    for row in limited:
        assert row["pendulums.0.fraction.beyond_data"] > 0.4
        for name in ("pendulums.0.engagements", "clutches.engagements_per_period"):
            assert row[name] == free[name]
        for name in ("torque.mean", "reset.energy_lost", "power.clutch.mean"):
            assert row[name] == pytest.approx(free[name], rel=1e-8)


# Simultaneous events: identical pendulums act as one.


def _symmetric(n: int, tolerance: float, **changes: float) -> tuple[dict[str, float], dict[str, float]]:
    """Results of n identical pendulums, and of one with the n-th part of the shaft's inertia and load."""
    shared = drive(1) | changes
    single = shared | {"shaft.inertia": shared["shaft.inertia"] / n, "shaft.load": shared["shaft.load"] / n}
    own = {name: value for name, value in shared.items() if name.startswith("pendulums.0.")}
    many = shared | {name.replace(".0.", f".{i}."): value for i in range(n) for name, value in own.items()}
    run = periods(10.0, 4.0, 10.0, tolerance=tolerance)
    return one(many, run), one(single, run)


MACHINES = {
    "ordinary": {"shaft.inertia": 6e-3, "shaft.load": 0.3},
    "near stall": {"shaft.inertia": 2e-3, "shaft.load": 1.5},
    "no load": {"shaft.load": 0.0, "shaft.inertia": 0.05},
    "torque that jumps": {"clutch.coefficients.0": 0.4, "shaft.load": 0.3},
    "no backlash": {"pendulums.0.backlash": 0.0, "shaft.load": 0.5},
    "locking": {"pendulums.0.backlash": 0.0, "clutch.coefficients.0": 0.4, "shaft.load": 0.5},
    "beyond the data": {"clutch.windup_limit": 3e-3, "shaft.load": 0.4},
}


def compare_identical(n: int, machine: str, tolerance: float = 1e-9) -> None:
    """Fails where n identical pendulums do not act as one."""
    many, single = _symmetric(n, tolerance, **MACHINES[machine])
    assert single["pendulums.0.engagements"] > 0.0
    shaft = (f"shaft.{name}" for name in ("speed.mean", "speed.max", "speed.min", "acceleration.max"))
    for name in (*shaft, "fraction.driven", "fraction.held"):
        assert many[name] == pytest.approx(single[name], rel=1e-9, abs=1e-12), name
    for name in ("torque.mean", "torque.max", "power.input.mean", "power.loss.mean", "power.clutch.max"):
        assert many[name] == pytest.approx(n * single[name], rel=1e-9), name
    for name in ("angle.max", "speed.max", "acceleration.max", "torque.max", "windup.max", "fraction.engaged"):
        for i in range(n):
            assert many[f"pendulums.{i}.{name}"] == pytest.approx(single[f"pendulums.0.{name}"], rel=1e-9), (name, i)
    assert many["clutches.driving_max"] == n


@pytest.mark.parametrize("n", [2, 3])  # up to eight: benchmarks.identical
@pytest.mark.parametrize("machine", MACHINES)
def test_identical_pendulums_act_as_one(n: int, machine: str) -> None:
    compare_identical(n, machine)
