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
from sprag_study.engine.machine_shaft.machine import check_structure
from sprag_study.engine.machine_shaft.problems import RelationError, StructureError
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
        if kind == "coupling":
            own |= {"stiffness": rng.uniform(10.0, 1e4), "output_inertia": rng.uniform(0.0, 0.2)}
        elif kind not in {"gear", "worm"}:
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
            speed /= numbers.get(f"drive.stages.{index}.ratio", 1.0)
            power *= numbers.get(f"drive.stages.{index}.efficiency", 1.0)
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


WHEEL: dict[str, Any] = {
    "drive.flywheel.diameter": 0.8, "drive.flywheel.mass": 40.0, "drive.flywheel.allowed_stress": 3e7
}  # fmt: skip


@pytest.mark.parametrize("shape", ["rim", "disc"])
@pytest.mark.parametrize("shaft", [0, 1, 2, 3])
def test_a_flywheel_counts_with_the_square_of_the_speed_of_its_shaft(shape: Any, shaft: int) -> None:
    """The same machine by hand: the converted inertia on the main shaft, and the speeds of the shaft with it."""
    stages: tuple[Stage, ...] = ("belt", "screw_nut", "gear")
    ratio = (12.0, 4.0, 4.0, 1.0)[shaft]
    train = {"drive.stages.0.ratio": 3.0, "drive.stages.1.lead": 0.01, "drive.stages.2.ratio": 4.0}
    numbers = PRESS_NUMBERS | train | {"drive.inertia": 8.0, "wanted_irregularity": 0.03}
    drive = Drive(stages=stages, flywheel=shape, flywheel_shaft=shaft)
    got = one(replace(PRESS, drive=drive), numbers | WHEEL)
    own = 40.0 * 0.8**2 / (4.0 if shape == "rim" else 8.0)
    by_hand = one(replace(PRESS, drive=Drive(stages=stages)), numbers | {"drive.inertia": 8.0 + own * ratio**2})
    for name, value in by_hand.items():
        if not math.isnan(value):
            assert got[name] == pytest.approx(value, rel=1e-12, abs=1e-12), name
    assert got["flywheel.inertia"] == pytest.approx(own, rel=1e-15)
    assert got["flywheel.speed"] == pytest.approx(0.4 * ratio * by_hand["omega.max"], rel=1e-13)
    factor = 1.0 if shape == "rim" else 3.3 / 8.0
    assert got["flywheel.stress"] == pytest.approx(factor * 7850.0 * got["flywheel.speed"] ** 2, rel=1e-13)
    assert got["flywheel.margin"] == pytest.approx(math.sqrt(3e7 / got["flywheel.stress"]), rel=1e-13)
    for name, path in (("mass", "drive.flywheel.mass"), ("diameter", "drive.flywheel.diameter")):
        enough = one(replace(PRESS, drive=drive), numbers | WHEEL | {path: got[f"flywheel.required_{name}"]})
        assert enough["irregularity"] == pytest.approx(0.03, rel=1e-9)


def test_the_main_shaft_of_a_flywheel_has_the_number_of_the_stages() -> None:
    stages: tuple[Stage, ...] = ("gear",)
    numbers = PRESS_NUMBERS | WHEEL | {"drive.stages.0.ratio": 4.0}
    usual = one(replace(PRESS, drive=Drive(stages=stages, flywheel="rim")), numbers)
    given = one(replace(PRESS, drive=Drive(stages=stages, flywheel="rim", flywheel_shaft=1)), numbers)
    assert all(usual[name] == given[name] or math.isnan(usual[name]) for name in usual)
    with pytest.raises(StructureError, match="from 0, the motor's, to 1, the main shaft"):
        check_structure(replace(PRESS, drive=Drive(stages=stages, flywheel="rim", flywheel_shaft=2)))


def test_a_geared_punch_press_of_shigley_with_the_flywheel_on_the_motor_shaft() -> None:
    """J. E. Shigley, C. R. Mischke, R. G. Budynas, *Mechanical Engineering Design*, problem 16-28, and its solution.

    A press geared 10:1 punches for half a second every 10 s with 1300 lbf*ft on the crankshaft: between 19 and 20 of
    its revolutions, and so are the results.
    """
    inch_pound = 0.0254 * 4.4482216152605
    free, stall = 2690.35 / 21.41, 2690.35 * inch_pound
    spec = MachineSpec(
        balance="motor", operation=OperationChoice("torque", "steps", steps=1),
        drive=Drive(motor="linear", stages=("gear",), flywheel="rim", flywheel_shaft=0),
    )  # fmt: skip
    numbers = {
        "drive.motor.no_load_speed": free, "drive.motor.stall_torque": stall, "drive.stages.0.ratio": 10.0,
        "drive.flywheel.diameter": 1.0, "drive.flywheel.mass": 4.0 * 110.72 * inch_pound,
        "operation.steps.0.from": 0.0, "operation.steps.0.to": 0.5 * 12.111,
        "operation.steps.0.value": 1300.0 * 12.0 * inch_pound,
    }  # fmt: skip
    short, long = (one(replace(spec, cycle=cycle), numbers) for cycle in (19, 20))
    periods = [math.tau * cycle / got["omega.mean_time"] for cycle, got in ((19, short), (20, long))]
    share = (10.0 - periods[0]) / (periods[1] - periods[0])
    assert 0.0 < share < 1.0
    between = {name: (1.0 - share) * short[name] + share * long[name] for name in short}
    assert 10.0 * between["omega.max"] == pytest.approx(124.41, abs=0.02)
    assert 10.0 * between["omega.min"] == pytest.approx(117.81, abs=0.02)
    assert between["irregularity"] == pytest.approx(0.0545, abs=1e-4)
    assert between["energy.fluctuation"] == pytest.approx(88_508.0 * inch_pound, rel=1e-3)


@pytest.mark.parametrize("cycle", [13, 60])
def test_long_cycles_are_many_short_ones(cycle: int) -> None:
    numbers = PRESS_NUMBERS | {"wanted_irregularity": 0.05}
    spec = replace(PRESS, operation=replace(PRESS.operation, over="stroke"))
    numbers |= {"operation.steps.0.from": 0.2, "operation.steps.0.to": 0.9}
    short, long = one(spec, numbers), one(replace(spec, cycle=cycle), numbers)
    for name in ("irregularity", "energy.fluctuation", "required_inertia", "power.mean", "omega.max"):
        assert long[name] == pytest.approx(short[name], rel=1e-9), name
    assert long["work.drive"] == pytest.approx(cycle * short["work.drive"], rel=1e-11)
    assert long["balance.work"] < 1e-10


def test_one_blow_in_sixty_revolutions_in_closed_form() -> None:
    """Of a constant torque over half a turn in 60, the flywheel gives the share 1 - 1/120."""
    spec = replace(PLAIN, cycle=60, operation=OperationChoice("torque", "steps", steps=1))
    numbers = {"mean_speed": 10.0, "drive.inertia": 50.0, "operation.steps.0.from": 100.0 * math.pi}
    numbers |= {"operation.steps.0.to": 101.0 * math.pi, "operation.steps.0.value": 600.0}
    got = one(spec, numbers)
    assert got["drive_torque.mean"] == pytest.approx(5.0, rel=1e-12)
    assert got["energy.fluctuation"] == pytest.approx(600.0 * math.pi * (1.0 - 1.0 / 120.0), rel=1e-12)
    assert got["irregularity"] == pytest.approx(got["energy.fluctuation"] / (50.0 * 100.0), rel=1e-12)


def test_a_ring_has_the_inertia_and_the_stress_of_its_section() -> None:
    """Mass and inertia by a quadrature over the radius, the stress in its limits: a thin rim, and a disc with a hole.

    A small hole in the middle of a disc doubles its stress (S. P. Timoshenko, J. N. Goodier, *Theory of Elasticity*,
    section 32).
    """
    drive = Drive(stages=("gear",), flywheel="ring", flywheel_shaft=0)
    spec = replace(PRESS, drive=drive)
    numbers = PRESS_NUMBERS | {
        "drive.stages.0.ratio": 5.0, "drive.flywheel.diameter": 0.6, "drive.flywheel.width": 0.08,
        "drive.flywheel.thickness": 0.05, "drive.flywheel.density": 7200.0, "wanted_irregularity": 0.03,
    }  # fmt: skip
    got = one(spec, numbers)
    own = quad(lambda r: 7200.0 * 0.08 * math.tau * r * r**2, 0.275, 0.325, epsabs=0.0)[0]
    assert got["flywheel.inertia"] == pytest.approx(own, rel=1e-12)
    assert got["inertia.drive"] == pytest.approx(15.0 + 25.0 * own, rel=1e-12)
    assert got["flywheel.speed"] == pytest.approx(0.3 * 5.0 * got["omega.max"], rel=1e-13)
    mass = 7200.0 * math.pi * 0.6 * 0.08 * 0.05
    wider = {"drive.flywheel.width": 0.08 * got["flywheel.required_mass"] / mass}
    for change in (wider, {"drive.flywheel.diameter": got["flywheel.required_diameter"]}):
        assert one(spec, numbers | change)["irregularity"] == pytest.approx(0.03, rel=1e-9)

    def stress(thickness: float) -> float:
        thin = one(spec, numbers | {"drive.flywheel.thickness": thickness})
        return thin["flywheel.stress"] / (7200.0 * thin["flywheel.speed"] ** 2)

    assert stress(1e-9) == pytest.approx(1.0, abs=1e-8)
    assert stress(0.6) == pytest.approx(2.0 * (3.0 + 0.3) / 8.0 * 2.0**2, rel=1e-13)
    with pytest.raises(RelationError) as error:
        check(spec, numbers | {"drive.flywheel.thickness": 0.7})
    assert error.value.path == "drive.flywheel.thickness"
