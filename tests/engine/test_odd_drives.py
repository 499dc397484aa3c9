"""Drives at exact equilibria and clutches that lock together: no spurious ending, and the balances close."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sprag_study.engine.endings import Ending
from tests.engine.odd_drives import idle_drive, odd_drive, without
from tests.engine.vibration_drive.drive import Columns, Results, batch_of, clutch, one, pendulum, periods
from tests.engine.vibration_drive.reference_run import Drive


@pytest.mark.parametrize("reset", ["contact", "literal"])
@pytest.mark.parametrize("seed", [1, 11])
def test_fifty_odd_drives_run_to_the_end(seed: int, reset: str) -> None:
    rng = np.random.default_rng(seed)
    cases = [odd_drive(rng, 2) for _ in range(50)]
    results = Results(batch_of(cases), periods(30, 20, 30, reset=reset), 50)
    assert set(results.endings) == {Ending.OK}
    moving = results["power.input.mean"] > 1e-6
    assert moving.sum() > 10
    assert results["balance.energy"][moving].max() < 1e-6
    assert results["balance.momentum"][moving].max() < 1e-6


def _lane(**changes: float) -> Columns:
    return {
        "excitation.frequency": 29.029, "excitation.amplitude_x": 0.0, "excitation.amplitude_y": 0.002,
        "excitation.phase": 3.463, "shaft.inertia": 5.07e-4, "shaft.load": 0.0354, **clutch(0.0, 21.2, 0.0, 1e4),
    } | changes  # fmt: skip


@pytest.mark.parametrize("backlash", [0.0, 0.005])
@pytest.mark.parametrize("first", [0.0, 0.05])
@pytest.mark.parametrize("reset", ["contact", "literal"])
def test_a_pendulum_that_stands_upright_stays_out_of_it(backlash: float, first: float, reset: str) -> None:
    """What the other pendulum does is what it would do alone."""
    alone = _lane() | clutch(first, 21.2, 0.0, 1e4) | pendulum(0, initial_angle=-0.15, initial_speed=0.0, damping=0.0)
    upright = pendulum(1, inertia=4.64e-4, backlash=backlash, initial_angle=0.0, initial_speed=0.0)
    run = periods(60, 30, 60, reset=reset)
    single, both = one(alone, run), one(alone | upright, run)
    assert both["pendulums.1.angle.max"] == 0.0
    for name in ("shaft.speed.mean", "torque.mean", "pendulums.0.angle.max", "power.clutch.mean"):
        assert both[name] == pytest.approx(single[name], rel=1e-7, abs=1e-12)


def _consistent(moments: list[float], inertias: list[float], first: float, shaft: float, load: float) -> float:
    """Shaft's acceleration with every clutch's torque between 0 and c_1, found by halving."""

    def excess(rate: float) -> float:
        torques = [min(max(m - j * rate, 0.0), first) for m, j in zip(moments, inertias, strict=True)]
        return shaft * rate + load - sum(torques)

    low, high = -1e6, 1e6
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if excess(middle) < 0.0 else (low, middle)
    return low


@pytest.mark.parametrize("seed", range(6))
def test_clutches_that_meet_share_one_consistent_state(seed: int) -> None:
    """All pendulums begin with the shaft's speed: the first instants show the accelerations of the complementarity."""
    rng = np.random.default_rng(seed)
    count, first, shaft, load = 3, 0.06, 2e-3, 0.05
    columns: Columns = {
        "excitation.frequency": 1e-3, "excitation.amplitude_x": 0.0, "excitation.amplitude_y": 1e-9,
        "shaft.inertia": shaft, "shaft.load": load, "shaft.initial_speed": 3.0, **clutch(first, 5.0, 0.0, 0.0),
    }  # fmt: skip
    moments, inertias = [], []
    for k in range(count):
        angle, inertia = rng.uniform(-0.02, 0.005), 10.0 ** rng.uniform(-3.5, -2.5)
        own = pendulum(k, inertia=inertia, backlash=0.0, damping=0.0, initial_angle=angle, initial_speed=3.0)
        columns |= own
        moments.append(0.5 * 0.03 * 9.80665 * math.sin(angle) - 9000.0 * 0.05**2 * angle)
        inertias.append(inertia)
    from sprag_study.engine.vibration_drive.simulate import trajectory

    moment = trajectory(columns, periods(1e-8, 0, 1e-8), np.array([1e-9, 5e-9]))
    acceleration = moment.values[-1, moment.names.index("shaft.acceleration")]
    assert acceleration == pytest.approx(_consistent(moments, inertias, first, shaft, load), rel=1e-4)


@pytest.mark.parametrize("seed", [3, 8, 21])
def test_an_odd_drive_agrees_with_the_twin(seed: int) -> None:
    """Where no clutches meet, the second implementation runs the drive too."""
    columns = odd_drive(np.random.default_rng(seed), 1)
    row = one(columns, periods(6, 3, 6))
    outcome = Drive(columns, literal=False).run(6, (3, 6))
    for name, value in outcome.mean.items():
        assert row[name] == pytest.approx(value, rel=1e-5, abs=1e-7)


#: A pendulum with mass 0 hangs at exactly 0 beside one that moves. When the shaft breaks away, its torques balance the
#: load but for the error of a step; that must not make the pendulum at rest overtake it.
IDLE = {
    "excitation.frequency": 25.0, "excitation.amplitude_x": 0.002, "excitation.amplitude_y": 0.0,
    "shaft.inertia": 1e-4, **clutch(0.0, 2000.0, 0.0, 2e4),
    **pendulum(1, inertia=0.008, mass=0.0, arm=0.0, spring_rate=2e4, damping=0.03, backlash=0.0),
}  # fmt: skip


@pytest.mark.parametrize("reset", ["contact", "literal"])
@pytest.mark.parametrize("backlash", [0.0, 0.005])
def test_a_pendulum_that_nothing_excites_stays_out_of_it(backlash: float, reset: str) -> None:
    moving = pendulum(0, inertia=0.004, mass=0.25, damping=0.03, backlash=backlash)
    cases = [IDLE | moving | {"shaft.load": load} for load in (0.1, 0.03, 0.01)]
    run = periods(30, 20, 30, reset=reset)
    both, single = (Results(batch_of(group), run, 3) for group in (cases, [without(case, 1) for case in cases]))
    assert both.endings == [Ending.OK] * 3
    for name in ("shaft.speed.mean", "torque.mean", "pendulums.0.angle.max"):
        assert both[name] == pytest.approx(single[name], rel=1e-5)


@pytest.mark.parametrize("reset", ["contact", "literal"])
def test_fifty_drives_with_an_idle_pendulum_are_those_without_it(reset: str) -> None:
    rng = np.random.default_rng(0)
    made = [idle_drive(rng, 2) for _ in range(50)]
    run = periods(12, 6, 12, reset=reset)
    both = Results(batch_of([columns for columns, _ in made]), run, 50)
    single = Results(batch_of([without(columns, place) for columns, place in made]), run, 50)
    assert set(both.endings) == {Ending.OK}
    for name in ("shaft.speed.mean", "torque.mean", "power.clutch.mean"):
        assert both[name] == pytest.approx(single[name], rel=1e-6, abs=1e-9)


def _copies(place: int) -> Columns:
    """Two pendulums that are the same, at rest at first, with clutches that lock."""
    rng = np.random.default_rng(0)
    return [odd_drive(rng, 2) for _ in range(place + 1)][place]


@pytest.mark.parametrize(("first", "reset"), [(None, "contact"), (0.01, "literal"), (0.16, "contact")])
def test_two_copies_act_as_one_on_half_the_shaft(first: float | None, reset: str) -> None:
    """They lock, wind up and open at the same instants, so the second implementation runs one of them."""
    columns = _copies(185)
    if first is not None:
        columns |= {"clutch.coefficients.0": first, "shaft.load": 2.0 * first, "shaft.initial_speed": 0.0}
    half = without(columns, 1)
    half |= {path: 0.5 * columns[path] for path in ("shaft.inertia", "shaft.load")}
    row = one(columns, periods(6, 3, 6, reset=reset))
    assert row["pendulums.0.angle.max"] == pytest.approx(row["pendulums.1.angle.max"], rel=1e-9)
    outcome = Drive(half, literal=reset == "literal").run(6, (3, 6))
    for name, share in (("shaft.speed.mean", 1.0), ("torque.mean", 0.5), ("power.clutch.mean", 0.5)):
        assert share * row[name] == pytest.approx(outcome.mean[name], rel=1e-5, abs=1e-7)


def test_copies_that_lock_run_to_the_end() -> None:
    """Two copies held in their locks came to c_1 at one instant, after a torque that had first fallen."""
    for reset in ("contact", "literal"):
        assert one(_copies(185), periods(30, 20, 30, reset=reset))["balance.energy"] < 1e-6


@pytest.mark.parametrize("seed", [0, 1, 4])
def test_an_idle_drive_agrees_with_the_twin(seed: int) -> None:
    columns, _ = idle_drive(np.random.default_rng(seed), 2)
    row = one(columns, periods(4, 2, 4))
    outcome = Drive(columns, literal=False).run(4, (2, 4))
    for name, value in outcome.mean.items():
        assert row[name] == pytest.approx(value, rel=1e-5, abs=1e-7)
