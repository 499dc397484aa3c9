"""Several mechanisms on one shaft: against an independent computation, against one mechanism, and part by part."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sprag_study.engine.endings import Ending
from sprag_study.engine.machine_shaft.checked import check
from sprag_study.engine.machine_shaft.load_results import joints_of, load_infos
from sprag_study.engine.machine_shaft.problems import AssemblyError, StructureError
from sprag_study.engine.machine_shaft.results import result_infos
from sprag_study.engine.machine_shaft.simulate import simulate
from sprag_study.engine.machine_shaft.spec import MachineSpec, MechanismChoice, OperationChoice, PartChoice
from sprag_study.engine.machine_shaft.tables import Table
from sprag_study.engine.machine_shaft.trajectory import trajectory
from tests.engine.machine_shaft import independent, random_machines
from tests.engine.machine_shaft.machines import PRESS, PRESS_NUMBERS, ending_of, one

OF_PART = ("mechanism.", "operation.")
PRESS_PART = PartChoice(PRESS.mechanism, PRESS.operation)


def in_part(index: int, numbers: dict[str, Any], **more: float) -> dict[str, Any]:
    """The numbers of a mechanism and its operation as those of one part; ``more`` are further ones of the part."""
    own = {path: value for path, value in numbers.items() if path.startswith(OF_PART)} | more
    return {f"parts.{index}.{path}": value for path, value in own.items()}


def of_shaft(numbers: dict[str, Any]) -> dict[str, Any]:
    """The other numbers."""
    return {path: value for path, value in numbers.items() if not path.startswith(OF_PART)}


_OPERATIONS = {
    "none": OperationChoice(), "step": OperationChoice("torque", "steps", steps=1), "gas": OperationChoice("gas"),
    "resisting": OperationChoice("force", "constant"),
}  # fmt: skip


def engine_machine(machine: independent.MachineData) -> tuple[MachineSpec, dict[str, float]]:
    """The machine of the independent computation as the engine takes it."""
    parts, numbers = [], {"drive.inertia": machine.inertia, "mean_speed": machine.speed}
    for k, part in enumerate(machine.parts):
        mechanism = MechanismChoice(part.kind, quick_return="whitworth")  # type: ignore[arg-type]
        turns = None if part.ratio == 1.0 else round(part.ratio * machine.cycle)
        parts.append(PartChoice(mechanism, _OPERATIONS[part.operation], turns))
        within = {"step": "operation.steps.0.", "gas": "operation.gas."}.get(part.operation, "operation.")
        own = {f"mechanism.{part.kind}.{name}": value for name, value in part.dimensions.items()}
        own |= {f"{within}{name}": value for name, value in part.load.items()}
        numbers |= {f"parts.{k}.{path}": value for path, value in own.items()}
        numbers[f"parts.{k}.crank_angle"] = part.angle
    return MachineSpec(cycle=machine.cycle, parts=tuple(parts)), numbers


@pytest.mark.parametrize(("seed", "geared"), [(0, False), (2, False), (3, False), (4, True)])
def test_random_machines_agree_with_an_independent_computation(seed: int, geared: bool) -> None:
    """`python -m benchmarks.machine_parts` compares 300 of them."""
    machine = random_machines.random_machine(np.random.default_rng(seed), geared=geared)
    expected = independent.solve(machine)
    found = one(*engine_machine(machine))
    for name, value in expected.items():
        scale = machine.speed if name.startswith("omega") else abs(value)
        assert abs(found[name] - value) <= 1e-8 * max(scale, 1e-6), name


def test_one_part_without_a_crank_angle_is_the_machine_without_parts() -> None:
    alone = simulate(PRESS, PRESS_NUMBERS, cases=1).values
    numbers = of_shaft(PRESS_NUMBERS) | in_part(0, PRESS_NUMBERS)
    listed = simulate(MachineSpec(parts=(PRESS_PART,)), numbers, cases=1).values
    assert listed.tobytes() == alone.tobytes()


def test_a_crank_angle_only_moves_the_cycle() -> None:
    """All but the angles is the same; these come earlier by the crank angle."""
    formula = MechanismChoice("formula", formula="0.3 + 0.1*sin(phi) + if(phi < 4, (phi*(4 - phi))^4, 0)/1e4")
    torque = OperationChoice("torque", "formula", formula="phi*(1 + x_0*phi)")
    table = Table(((0.0, 10.0), (1.0, 60.0), (2.0, 30.0), (2.0, 5.0)))
    spec = MachineSpec(
        cycle=2, mechanism=formula, operation=torque, constants=("x_0",),
    )  # fmt: skip
    numbers = {"mean_speed": 20.0, "drive.inertia": 2.0, "constants.x_0": 0.01}
    tabled = replace(spec, mechanism=PRESS.mechanism, operation=OperationChoice("torque", "table", table=table))
    mechanism = {path: value for path, value in PRESS_NUMBERS.items() if path.startswith("mechanism.")}
    for own, more in ((spec, {}), (tabled, mechanism)):
        alone = one(own, numbers | more)
        parts = replace(own, mechanism=MechanismChoice(), operation=OperationChoice(),
                        parts=(PartChoice(own.mechanism, own.operation),))  # fmt: skip
        for ahead in (1.25, -9.0):
            moved = one(parts, numbers | in_part(0, more, crank_angle=ahead))
            for name in ("irregularity", "energy.fluctuation", "omega.max", "inertia.max", "required_inertia"):
                assert moved[name] == pytest.approx(alone[name], rel=1e-10, nan_ok=True), name
            angle = moved["omega.angle_at_max"] - (alone["omega.angle_at_max"] - ahead)
            assert math.remainder(angle, 4.0 * math.pi) == pytest.approx(0.0, abs=1e-6)


def test_equal_parts_at_equal_angles_are_one_with_the_sum_of_masses_and_forces() -> None:
    three = MachineSpec(parts=(PRESS_PART,) * 3)
    numbers = of_shaft(PRESS_NUMBERS)
    for k in range(3):
        numbers |= in_part(k, PRESS_NUMBERS)
    heavy = dict(PRESS_NUMBERS)
    for path in heavy:
        if path.endswith(("mass", "rod_inertia", "value")):
            heavy[path] *= 3.0
    found, expected = one(three, numbers), one(PRESS, heavy)
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, rel=1e-9, abs=1e-9, nan_ok=True), name


def test_energy_closes_over_the_cycle_and_over_each_part() -> None:
    """The work of each part in closed form, of the whole as their sum; a weight gives back what it takes."""
    gas = PartChoice(MechanismChoice("slider_crank"), OperationChoice("gas"))
    idle = PartChoice(MechanismChoice("slider_crank"), OperationChoice())
    spec = MachineSpec(parts=(PRESS_PART, gas, idle))
    numbers = of_shaft(PRESS_NUMBERS) | {"mean_speed": 40.0} | in_part(0, PRESS_NUMBERS, crank_angle=0.7)
    mechanism = {path: value for path, value in PRESS_NUMBERS.items() if path.startswith("mechanism.")}
    numbers |= in_part(1, mechanism, **{
        "operation.gas.piston_area": 5e-3, "operation.gas.suction_pressure": 1e5,
        "operation.gas.discharge_pressure": 4e5,
    })  # fmt: skip
    numbers |= in_part(2, mechanism, crank_angle=-2.0, **{"mechanism.slider_crank.inclination": 1.0})
    whole = one(spec, numbers)
    pieces, order = 360, 8
    nodes, weights = np.polynomial.legendre.leggauss(order)
    found = trajectory(spec, numbers, [0.0])
    of_parts = [name for name in found.names if name.startswith("parts.") and not name.endswith(("force", ".x", ".y"))]
    assert of_parts == [f"parts.{k}.{name}" for k in range(3) for name in ("way", "inertia", "resisting_torque")]
    cuts = np.unique(np.concatenate([np.linspace(0.0, 2.0 * math.pi, pieces + 1), _kinks(spec, numbers)]))
    half = 0.5 * np.diff(cuts)
    angles = (cuts[:-1] + half)[:, None] + half[:, None] * nodes
    table = trajectory(spec, numbers, angles.ravel())
    torques = [
        table.values[:, table.names.index(f"parts.{k}.resisting_torque")].reshape(angles.shape) for k in range(3)
    ]
    works = [float((half[:, None] * weights * torque).sum()) for torque in torques]
    largest = abs(whole["work.resistance"])
    assert abs(sum(works) - whole["work.resistance"]) <= 1e-10 * largest
    assert abs(whole["work.drive"] + whole["work.resistance"]) <= 1e-10 * largest
    step = PRESS_NUMBERS["operation.steps.0.value"] * 0.1  # of the ram's way, in closed form
    q = 0.25
    rod = math.sqrt(1.0 - q**2 * math.sin(math.radians(120.0)) ** 2)
    way = 1.0 + math.cos(math.radians(120.0)) - (1.0 - rod) / q
    assert works[0] == pytest.approx(-step * way, abs=1e-10 * largest)
    stroke, c, n = 0.2 * 5e-3, 0.05, 1.3
    ratio = 4.0 ** ((n - 1.0) / n)
    drawn = 1.0 + c - c * 4.0 ** (1.0 / n)
    assert works[1] == pytest.approx(-1e5 * stroke * drawn * n / (n - 1.0) * (ratio - 1.0), abs=1e-10 * largest)
    assert abs(works[2]) <= 1e-10 * largest
    inertia = 15.0 + sum(table.values[:, table.names.index(f"parts.{k}.inertia")] for k in range(3))
    assert table.values[:, table.names.index("inertia")] == pytest.approx(inertia, rel=1e-10)


def _kinks(spec: MachineSpec, numbers: dict[str, Any]) -> np.ndarray:
    """Cuts of the machine's quadrature, between which its torques are smooth."""
    from sprag_study.engine.machine_shaft.columns import Columns
    from sprag_study.engine.machine_shaft.machine import Machine

    return np.concatenate([cut.ravel() for cut in Machine(spec, Columns.of(spec, numbers, 1)).breaks()])


@pytest.mark.parametrize(("cylinders", "harmonic"), [(1, 1), (2, 2), (4, 4), (6, 6)])
def test_equally_spaced_equal_parts_leave_multiples_of_their_number_only(cylinders: int, harmonic: int) -> None:
    """Of the harmonics 1 and 2 of each part those are left that the number of parts divides."""
    a, b = 120.0, 40.0
    torque = OperationChoice("torque", "formula", formula="50 + a*cos(phi) + b*cos(2*phi)")
    spec = MachineSpec(parts=(PartChoice(operation=torque),) * cylinders, constants=("a", "b"))
    numbers = {"mean_speed": 30.0, "drive.inertia": 4.0, "constants.a": a, "constants.b": b}
    numbers |= {f"parts.{k}.crank_angle": 2.0 * math.pi * k / cylinders for k in range(cylinders)}
    found = one(spec, numbers)
    assert found["drive_torque.mean"] == pytest.approx(50.0 * cylinders, rel=1e-12)
    if harmonic == 2:
        assert found["energy.fluctuation"] == pytest.approx(2 * b, rel=1e-10)
    elif harmonic > 2:
        assert found["energy.fluctuation"] == pytest.approx(0.0, abs=1e-9 * a)
    else:
        phi = np.linspace(0.0, 2.0 * math.pi, 100_001)
        assert found["energy.fluctuation"] == pytest.approx(np.ptp(a * np.sin(phi) + b / 2 * np.sin(2 * phi)), rel=1e-7)


def test_a_part_that_cannot_be_assembled_is_named() -> None:
    spec = MachineSpec(parts=(PRESS_PART, PRESS_PART))
    numbers = of_shaft(PRESS_NUMBERS) | in_part(0, PRESS_NUMBERS) | in_part(1, PRESS_NUMBERS, crank_angle=1.0)
    numbers["parts.1.mechanism.slider_crank.rod"] = 0.05
    assert ending_of(spec, numbers) is Ending.CANNOT_ASSEMBLE
    with pytest.raises(AssemblyError) as error:
        check(spec, numbers)
    assert error.value.prefix == "parts.1."
    # The crank pin is more than a rod's length above the ram's line from 30 to 150 deg of the part, so from there at 0.
    assert error.value.angle == 0.0
    numbers["parts.1.crank_angle"] = -0.2
    with pytest.raises(AssemblyError) as error:
        check(spec, numbers)
    assert error.value.angle == pytest.approx(math.radians(30.0) + 0.2, abs=1e-9)


def test_parts_beside_a_mechanism_are_refused() -> None:
    with pytest.raises(StructureError, match="not both"):
        simulate(replace(PRESS, parts=(PRESS_PART,)), {}, cases=1)
    with pytest.raises(StructureError, match="at most 16 parts"):
        simulate(MachineSpec(parts=(PartChoice(),) * 17), {}, cases=1)


def test_a_structure_with_parts_survives_json() -> None:
    table = Table(((0.0, 1.0), (1.0, 2.0)), "linear")
    spec = MachineSpec(parts=(PRESS_PART, PartChoice(MechanismChoice("table", table=table))))
    assert MachineSpec.from_json(spec.to_json()) == spec
    assert "parts" not in PRESS.to_json()
    geared = MachineSpec(cycle=2, parts=(PRESS_PART, replace(PRESS_PART, turns=6, cycle=3)))
    assert MachineSpec.from_json(geared.to_json()) == geared


def test_a_machine_seen_from_its_fast_shaft_is_the_same_machine() -> None:
    """A press with a compressor at three times its speed, with the shaft of either as the main shaft.

    What is reduced is converted by hand: inertias by 9, torques by 3; what parts and joints bear stays.
    """
    press = PartChoice(
        MechanismChoice("slider_crank", weights="all"),
        OperationChoice("force", "steps", over="stroke", steps=1, efficiency_is="work"),
    )
    gas = PartChoice(MechanismChoice("slider_crank"), OperationChoice("gas"))
    mechanism = {path: value for path, value in PRESS_NUMBERS.items() if path.startswith("mechanism.")}
    numbers = in_part(0, mechanism, crank_angle=0.3, **{
        "operation.steps.0.from": 0.3, "operation.steps.0.to": 0.8, "operation.steps.0.value": 2e4,
        "operation.efficiency": 0.8, "mechanism.slider_crank.inclination": 0.5,
    })  # fmt: skip
    numbers |= in_part(1, mechanism, crank_angle=1.1, **{
        "operation.gas.piston_area": 5e-3, "operation.gas.suction_pressure": 1e5,
        "operation.gas.discharge_pressure": 7e5, "operation.efficiency": 0.9,
    })  # fmt: skip
    numbers["wanted_irregularity"] = 0.05

    def results(spec: MachineSpec, speed: float, inertia: float) -> dict[str, float]:
        batch = simulate(spec, numbers | {"mean_speed": speed, "drive.inertia": inertia}, cases=1, with_loads=True)
        infos = (*result_infos(), *load_infos(2, len(joints_of(spec))))
        return dict(zip((info.name for info in infos), batch.values[0].tolist(), strict=True))

    slow = results(MachineSpec(parts=(press, replace(gas, turns=3, cycle=1))), 10.0, 90.0)
    whole = results(MachineSpec(parts=(press, replace(gas, turns=3))), 10.0, 90.0)
    fast = results(MachineSpec(cycle=3, parts=(replace(press, turns=1), gas)), 30.0, 10.0)
    units = {info.name: info.unit for info in (*result_infos(), *load_infos(2, 4))}
    scales = {"rad": 3.0, "rad/s": 3.0, "rad/s^2": 3.0, "rad^2/s^2": 9.0, "N*m": 1.0 / 3.0, "kg*m^2": 1.0 / 9.0}
    assert slow["irregularity"] > 0.1
    for name, value in slow.items():
        if math.isnan(value) or name in {"cycle.multiplier", "balance.work"}:
            continue
        own = not name.startswith(("parts.", "joints.")) or name.endswith("angle_at_max")
        scale = scales.get(units[name], 1.0) if own else 1.0
        assert whole[name] == pytest.approx(value, rel=1e-10, abs=1e-10), name
        assert fast[name] == pytest.approx(scale * value, rel=1e-10, abs=1e-9), name


def test_loads_and_inertias_of_a_geared_shaft_in_closed_form() -> None:
    """Torques with the ratio, dampers and inertias with its square, diagrams at the angle and speed of the shaft."""
    load = OperationChoice("torque", "formula", formula="m + c*omega + a*(sin(phi) + cos(phi/5))")
    inertia = MechanismChoice("formula", formula="1 + 0.3*sin(phi)^2")
    part = PartChoice(inertia, load, turns=5)
    by_hand = PartChoice(
        MechanismChoice("formula", formula="6.25*(1 + 0.3*sin(2.5*phi + 0.4)^2)"),
        OperationChoice(
            "torque", "formula", formula="2.5*(m + 2.5*c*omega + a*(sin(2.5*phi + 0.4) + cos(0.5*phi + 0.08)))"
        ),
    )
    spec = MachineSpec(cycle=2, constants=("m", "c", "a"), parts=(part,))
    numbers = {"mean_speed": 12.0, "drive.inertia": 4.0, "constants.m": 3.0, "constants.c": 0.5, "constants.a": 20.0}
    found = one(spec, numbers | {"parts.0.crank_angle": 0.4})
    expected = one(replace(spec, parts=(by_hand,)), numbers)
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, rel=1e-9, abs=1e-9, nan_ok=True), name
    assert found["drive_torque.mean"] == pytest.approx(2.5 * 3.0 + 6.25 * 0.5 * found["omega.mean_angle"], rel=1e-10)


def test_turns_that_do_not_close_are_refused() -> None:
    for turns, cycle, text in ((0, None, "1 to 60 times"), (61, None, "1 to 60 times"), (6, 4, "every 4 turns")):
        with pytest.raises(StructureError, match=text):
            simulate(MachineSpec(parts=(replace(PRESS_PART, turns=turns, cycle=cycle),)), {}, cases=1)


@pytest.mark.parametrize("kind", ["slider_crank", "quick_return", "four_bar", "drag_link", "toggle"])
def test_weights_of_all_bodies_are_those_of_their_heights(kind: str) -> None:
    """By complex steps through the heights; over a cycle they do no work. Two masses are a body with m s (L - s)."""
    rng = np.random.default_rng(11)
    part = independent.PartData(kind, random_machines.RANDOM[kind](rng), 0.4)
    part.dimensions["inclination"] = 0.7
    spec, numbers = engine_machine(independent.MachineData([part], 3.0, 25.0, 1))
    (only,) = spec.parts
    weighed = replace(spec, parts=(replace(only, mechanism=replace(only.mechanism, weights="all")),))
    if kind == "four_bar":
        del numbers["parts.0.mechanism.four_bar.inclination"]
        one(spec, numbers)
        numbers["parts.0.mechanism.four_bar.inclination"] = 0.7
    found = trajectory(weighed, numbers, np.linspace(0.0, 2.0 * math.pi, 37))
    torque = found.values[:, found.names.index("parts.0.resisting_torque")]
    expected = -9.80665 * independent.lift(part, found.times)
    assert torque == pytest.approx(expected, abs=1e-9 * np.max(np.abs(expected)))
    assert abs(one(weighed, numbers)["work.resistance"]) <= 1e-12 * np.max(np.abs(expected))

    halved = replace(only, mechanism=replace(only.mechanism, bodies="two_mass"))
    for name in {"rod", "coupler"} & set(part.dimensions):
        centre, mass = part.dimensions[f"{name}_centre"], part.dimensions[f"{name}_mass"]
        numbers[f"parts.0.mechanism.{kind}.{name}_inertia"] = mass * centre * (part.dimensions[name] - centre)
    bare = {path: value for path, value in numbers.items() if not path.endswith(("rod_inertia", "coupler_inertia"))}
    if kind == "four_bar":
        del numbers["parts.0.mechanism.four_bar.inclination"], bare["parts.0.mechanism.four_bar.inclination"]
    assert one(replace(spec, parts=(halved,)), bare) == pytest.approx(one(spec, numbers), rel=1e-12, nan_ok=True)
