"""Drive trains: reduced inertia and torque against energies and powers computed from motor to main shaft."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any, get_args

import numpy as np
import pytest
from scipy.integrate import quad

from sprag_study.engine.machine_shaft.checked import check
from sprag_study.engine.machine_shaft.problems import RelationError
from sprag_study.engine.machine_shaft.spec import Drive, MachineSpec, OperationChoice, Stage
from sprag_study.engine.machine_shaft.trajectory import trajectory
from tests.engine.machine_shaft.machines import PRESS, PRESS_NUMBERS, one

PLAIN = MachineSpec(operation=OperationChoice("torque", "constant"))
NUMBERS: dict[str, Any] = {"mean_speed": 10.0, "operation.value": 5.0}
KINDS: tuple[Stage, ...] = get_args(Stage)


def random_train(seed: int) -> tuple[tuple[Stage, ...], dict[str, float]]:
    rng = np.random.default_rng(seed)
    stages = tuple(KINDS[k] for k in rng.integers(0, len(KINDS), rng.integers(1, 6)))
    numbers = {"drive.inertia": float(rng.uniform(0.1, 2.0))}
    for index, kind in enumerate(stages):
        own = {"inertia": rng.uniform(0.0, 0.1)}
        if kind in {"gear", "belt", "chain", "worm"}:
            own |= {"ratio": rng.uniform(0.3, 6.0), "efficiency": rng.uniform(0.6, 1.0)}
            own |= {"output_inertia": rng.uniform(0.0, 0.2)}
        if kind not in {"gear", "worm"}:
            own |= {"mass": rng.uniform(0.0, 5.0)}
            own |= {"lead": rng.uniform(0.001, 0.02)} if kind == "screw_nut" else {"radius": rng.uniform(0.02, 0.3)}
        numbers |= {f"drive.stages.{index}.{name}": float(value) for name, value in own.items()}
    return stages, numbers


def walked(stages: tuple[Stage, ...], numbers: dict[str, float]) -> tuple[float, float, float]:
    """Kinetic energy at 1 rad/s of the motor, from body to body, then speed and power that reach the main shaft."""
    speed, power, energy = 1.0, 1.0, 0.0
    for index, kind in enumerate(stages):
        own = {name: numbers.get(f"drive.stages.{index}.{name}", 0.0) for name in ("inertia", "mass", "radius")}
        way = numbers[f"drive.stages.{index}.lead"] / math.tau if kind == "screw_nut" else own["radius"]
        energy += 0.5 * own["inertia"] * speed**2 + 0.5 * own["mass"] * (way * speed) ** 2
        if kind not in {"screw_nut", "rack"}:
            speed /= numbers[f"drive.stages.{index}.ratio"]
            power *= numbers[f"drive.stages.{index}.efficiency"]
            energy += 0.5 * numbers[f"drive.stages.{index}.output_inertia"] * speed**2
    return energy + 0.5 * numbers["drive.inertia"] * speed**2, speed, power


@pytest.mark.parametrize("seed", range(12))
def test_a_train_has_the_energy_and_the_power_of_its_bodies(seed: int) -> None:
    stages, numbers = random_train(seed)
    got = one(replace(PLAIN, drive=Drive(stages=stages)), NUMBERS | numbers)
    energy, speed, power = walked(stages, numbers)
    assert got["inertia.drive"] == pytest.approx(2.0 * energy / speed**2, rel=1e-13)
    assert got["energy.mean"] == pytest.approx(energy * (10.0 / speed) ** 2, rel=1e-12)
    assert got["motor.speed.mean"] == pytest.approx(10.0 / speed, rel=1e-13)
    assert got["motor.torque.mean"] == pytest.approx(5.0 * speed / power, rel=1e-12)
    assert got["motor.torque.max"] == pytest.approx(got["motor.torque.mean"], rel=1e-12)
    assert got["motor.power.mean"] == pytest.approx(got["power.mean"] / power, rel=1e-12)


def test_an_inertia_is_the_same_before_and_behind_its_stage() -> None:
    stages: tuple[Stage, ...] = ("belt", "gear")
    geared = replace(PRESS, drive=Drive(stages=stages))
    ratios = {"drive.stages.0.ratio": 3.0, "drive.stages.1.ratio": 4.0}
    before = one(geared, PRESS_NUMBERS | ratios | {"drive.inertia": 0.0, "drive.stages.0.inertia": 15.0 / 144.0})
    behind = one(geared, PRESS_NUMBERS | ratios)
    alone = one(PRESS, PRESS_NUMBERS)
    for name in ("irregularity", "energy.fluctuation", "required_inertia", "drive_torque.mean"):
        assert before[name] == pytest.approx(alone[name], rel=1e-12, nan_ok=True)
        assert behind[name] == alone[name] or math.isnan(alone[name])
    assert behind["motor.torque.mean"] == pytest.approx(alone["drive_torque.mean"] / 12.0, rel=1e-13)


def test_required_inertia_is_that_of_the_whole_train() -> None:
    spec = replace(PRESS, drive=Drive(stages=("gear",)))
    wanted = {"wanted_irregularity": 0.05, "drive.stages.0.ratio": 5.0, "drive.stages.0.inertia": 0.1}
    needed = one(spec, PRESS_NUMBERS | wanted)["required_inertia"]
    assert needed == pytest.approx(
        one(PRESS, PRESS_NUMBERS | {"wanted_irregularity": 0.05})["required_inertia"], rel=1e-9
    )
    made = one(spec, PRESS_NUMBERS | wanted | {"drive.inertia": needed - 2.5})
    assert made["irregularity"] == pytest.approx(0.05, rel=1e-9)


def test_a_torque_that_changes_its_sign_loses_both_ways() -> None:
    u, eta = 4.0, 0.8
    spec = replace(PLAIN, balance="scale", drive=Drive("formula", formula="1 + 3*cos(phi)", stages=("gear",)))
    numbers = NUMBERS | {"drive.stages.0.ratio": u, "drive.stages.0.efficiency": eta, "drive.inertia": 5.0}

    def torque(phi: float) -> float:
        own = 1.0 + 3.0 * math.cos(phi)
        return u * own * (eta if own > 0.0 else 1.0 / eta)

    zero = math.acos(-1.0 / 3.0)
    edges = [0.0, zero, math.tau - zero, math.tau]
    work = sum(quad(torque, low, high, epsabs=1e-12)[0] for low, high in pairwise(edges))
    got = one(spec, numbers)
    factor = 5.0 * math.tau / work
    assert got["drive_torque.max"] == pytest.approx(factor * u * eta * 4.0, rel=1e-9)
    assert got["drive_torque.min"] == pytest.approx(-factor * u / eta * 2.0, rel=1e-9)
    assert got["motor.torque.mean"] == pytest.approx(factor, rel=1e-9)
    assert got["motor.torque.max"] == pytest.approx(4.0 * factor, rel=1e-9)
    assert got["balance.work"] < 1e-10


@pytest.mark.parametrize("motor", ["linear", "kloss"])
def test_a_motor_acts_through_its_train(motor: Any) -> None:
    """Braking, too: a light flywheel and heavy masses turn the shaft beyond the motor's free speed."""
    u, eta, rotor = 10.0, 0.9, 0.002
    own = {"no_load_speed": 130.0, "stall_torque": 30.0}
    if motor == "kloss":
        own = {"synchronous_speed": 125.0, "breakdown_torque": 20.0, "breakdown_slip": 0.2}
    spec = replace(PRESS, balance="motor", drive=Drive(motor=motor, stages=("gear",)))
    numbers = {path: value for path, value in PRESS_NUMBERS.items() if path != "mean_speed"}
    numbers |= {"drive.inertia": 0.3, "operation.steps.0.value": 4e3, "drive.motor.inertia": rotor}
    numbers |= {"drive.stages.0.ratio": u, "drive.stages.0.efficiency": eta}
    numbers |= {f"drive.motor.{name}": value for name, value in own.items()}
    got = one(spec, numbers)
    assert got["inertia.drive"] == pytest.approx(0.3 + rotor * u**2, rel=1e-13)
    assert got["balance.work"] < 1e-10
    table = trajectory(spec, numbers, np.linspace(0.0, math.tau, 181))
    columns = dict(zip(table.names, table.values.T, strict=True))
    speed = u * columns["omega"]
    if motor == "linear":
        torque = own["stall_torque"] * (1.0 - speed / own["no_load_speed"])
    else:
        slip = 1.0 - speed / own["synchronous_speed"]
        critical = own["breakdown_slip"]
        torque = 2.0 * own["breakdown_torque"] * slip * critical / (slip**2 + critical**2)
    assert torque.min() < 0.0 < torque.max()
    assert columns["drive_torque"] == pytest.approx(
        u * torque * np.where(torque > 0.0, eta, 1.0 / eta), rel=1e-7, abs=1e-6
    )


def test_a_belt_with_a_mass_needs_its_radius() -> None:
    spec = replace(PLAIN, drive=Drive(stages=("gear", "belt")))
    numbers = NUMBERS | {"drive.stages.0.ratio": 2.0, "drive.stages.1.ratio": 2.0, "drive.stages.1.mass": 3.0}
    with pytest.raises(RelationError) as error:
        check(spec, numbers | {"drive.inertia": 1.0})
    assert error.value.path == "drive.stages.1.radius"
    check(spec, numbers | {"drive.inertia": 1.0, "drive.stages.1.radius": 0.1})
