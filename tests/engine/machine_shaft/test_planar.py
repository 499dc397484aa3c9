"""Planar linkages of dyads: against mechanisms with dimensions, against complex steps, and what is refused."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sprag_study.engine.machine_shaft.checked import check
from sprag_study.engine.machine_shaft.elements import Element, LinkageChoice, element_faults
from sprag_study.engine.machine_shaft.mechanisms import RodMechanism
from sprag_study.engine.machine_shaft.parts import mechanism_of
from sprag_study.engine.machine_shaft.planar import PlanarLinkage
from sprag_study.engine.machine_shaft.problems import AssemblyError, StructureError
from sprag_study.engine.machine_shaft.simulate import simulate
from sprag_study.engine.machine_shaft.spec import MachineSpec, MechanismChoice, OperationChoice
from sprag_study.engine.machine_shaft.strokes import Stroke
from tests.engine.machine_shaft import chains
from tests.engine.machine_shaft.linkages import Numbers, as_dyads, linkage, pivot, point, rpr, rrp, rrr
from tests.engine.machine_shaft.machines import NAMES, results_of
from tests.engine.machine_shaft.random_machines import RANDOM

Floats = NDArray[np.float64]
PHI = np.linspace(0.0, 2.0 * math.pi, 97)[None, None, :]
SHAPER = {
    "crank": 0.1, "pivot_distance": 0.25, "link_arm": 0.4, "rod": 0.5, "offset": 0.3, "rod_centre": 0.2,
    "rod_mass": 3.0, "rod_inertia": 0.05, "ram_mass": 20.0, "inclination": 0.3, "link_inertia": 0.2, "block_mass": 1.5,
}  # fmt: skip
KINDS = ("slider_crank", "scotch_yoke", "whitworth", "crank_shaper", "four_bar", "drag_link", "toggle")


def arrays(values: Mapping[str, float]) -> dict[str, Floats]:
    return {name: np.array(value, dtype=np.float64).reshape(1, 1, 1) for name, value in values.items()}


def mechanism(kind: str) -> tuple[MechanismChoice, dict[str, float]]:
    """A mechanism with random dimensions."""
    quick = kind in {"whitworth", "crank_shaper"}
    choice = MechanismChoice(
        "quick_return" if quick else kind,  # type: ignore[arg-type]
        quick_return="whitworth" if kind == "whitworth" else "crank_shaper",
        weights="ram" if kind == "scotch_yoke" else "all",
    )
    rng = np.random.default_rng(KINDS.index(kind))
    return choice, dict(SHAPER) if kind == "crank_shaper" else RANDOM[choice.kind](rng)


@pytest.mark.parametrize("kind", KINDS)
def test_mechanisms_as_dyads(kind: str) -> None:
    choice, numbers = mechanism(kind)
    known = mechanism_of(choice)
    assert known is not None
    as_list, own = as_dyads(kind, numbers)
    dyads, v, w = PlanarLinkage(as_list), arrays(numbers), arrays(own)
    assert np.isnan(dyads.unassembled(w)).all()
    wanted, got = known.motion(v, PHI), dyads.motion(w, PHI)
    for name in ("inertia", "inertia_slope", "way", "way_slope"):
        one, other = getattr(got, name), getattr(wanted, name)
        size = np.abs(other).max()
        assert np.broadcast_to(one, PHI.shape) == pytest.approx(np.broadcast_to(other, PHI.shape), abs=1e-12 * size)
    if isinstance(known, RodMechanism):
        inclined = v if "inclination" in v else v | arrays({"inclination": 0.0})
        lift = known.lift(inclined, PHI)
        assert dyads.lift(w, PHI) == pytest.approx(lift, abs=1e-12 * np.abs(lift).max())
    stroke, other = Stroke.of(known, v), Stroke.of(dyads, w)
    turn = 2.0 * math.pi
    for angle, exact in ((other.start, stroke.start), (other.end, stroke.end)):
        assert math.remainder(float((angle - exact).flat[0]), turn) == pytest.approx(0.0, abs=1e-12)
    assert other.length == pytest.approx(stroke.length, rel=1e-13)


@pytest.mark.parametrize("kind", ["slider_crank", "crank_shaper", "toggle"])
def test_rows_of_mechanisms_as_dyads(kind: str) -> None:
    """Every result, with a force over the stroke and all weights; angles of flat extremes are as exact as these are."""
    choice, numbers = mechanism(kind)
    as_list, own = as_dyads(kind, numbers)
    operation = OperationChoice("force", "steps", over="stroke", steps=1)
    rest = {"mean_speed": 20.0, "drive.inertia": 8.0, "wanted_irregularity": 0.05, "operation.steps.0.from": 0.4,
            "operation.steps.0.to": 0.9, "operation.steps.0.value": 900.0}  # fmt: skip

    def rows(choice: MechanismChoice, values: Numbers) -> dict[str, Any]:
        spec = MachineSpec(mechanism=choice, operation=operation)
        return results_of(spec, rest | {f"mechanism.{choice.kind}.{name}": value for name, value in values.items()})

    wanted, got = rows(choice, numbers), rows(MechanismChoice("linkage", linkage=as_list), own)
    scale = wanted["omega.mean"][0]
    for name in NAMES:
        loose = "angle_at" in name or name.endswith((".amplitude", ".share")) or "balance.work" in name
        size = max(abs(wanted[name][0]), scale if name.startswith(("s1", "s2", "s3", "s4", "omega")) else 0.0, 1e-3)
        difference = abs(got[name][0] - wanted[name][0])
        assert difference <= (2e-7 if "angle_at" in name else 1e-11 if loose else 1e-12) * size or (
            np.isnan(got[name][0]) and np.isnan(wanted[name][0])
        ), (name, got[name], wanted[name])


def test_parallel_cranks_are_a_dyad_on_either_side_of_their_change_points() -> None:
    known = mechanism_of(MechanismChoice("parallel_crank"))
    assert known is not None
    v = {"crank": 0.2, "coupler_mass": 7.0, "driven_inertia": 0.3, "inclination": 0.0}
    for branch, phi in (("left", PHI[..., 3:46]), ("right", PHI[..., 51:94])):
        second = {"second": 0.2, "second_inertia": 0.3}
        coupler = rrr("C", "A", "B", branch, first=0.5, first_centre=0.2, first_mass=7.0, **second)
        choice, own = linkage(pivot("B", 0.5), coupler, crank=0.2)
        got, wanted = PlanarLinkage(choice).motion(arrays(own), phi), known.motion(arrays(v), phi)
        assert got.inertia == pytest.approx(np.broadcast_to(wanted.inertia, phi.shape), rel=1e-12)
        assert got.inertia_slope == pytest.approx(np.zeros(phi.shape), abs=1e-10)
        assert PlanarLinkage(choice).unassembled(arrays(own))[0] == pytest.approx(0.0, abs=1e-6)
        rule = PlanarLinkage(choice).broken_rule(arrays(own))
        assert str(rule) == "the links of the group C lie in one line there, and their joint could go on to either side"


@pytest.mark.parametrize("seed", range(12))
def test_random_chains_agree_with_complex_steps(seed: int) -> None:
    """`python -m benchmarks.linkages` compares 300 of them."""
    assert chain_error(seed) < 1e-9


def chain_error(seed: int) -> float:
    """Largest difference of inertia, its slope, lift and joints from the other computation, over their size."""
    rng = np.random.default_rng(seed)
    choice, numbers = chains.random_chain(rng, 1 + seed % 4)
    engine, v = PlanarLinkage(choice), arrays(numbers)
    phi = np.linspace(0.0, 2.0 * math.pi, 41)
    if not np.isnan(engine.unassembled(v)[0]):
        # The links of a chain that does not turn fully meet at some angles.
        phi = phi[(engine.margin(v, phi[None, None, :])[0, 0] > 0.02)]
    if not len(phi):
        return 0.0
    places = phi[None, None, :]
    motion, pose = engine.motion(v, places), engine.pose(v, places)
    wanted = chains.inertia(choice, numbers, phi)
    by_step = chains.slope(lambda angles: chains.inertia(choice, numbers, angles), phi, 5e-4)
    rise, level = math.sin(numbers["inclination"]), math.cos(numbers["inclination"])
    bodies = chains.positions(choice, numbers, phi + 1e-30j)[1]
    lift = sum(mass * np.imag(rise * x + level * y) / 1e-30 for mass, _, x, y, _ in bodies)
    pairs = [
        (motion.inertia[0, 0], wanted, 1.0), (motion.inertia_slope[0, 0], by_step, 1e-2),
        (engine.lift(v, places)[0, 0], lift, 1.0),
    ]  # fmt: skip
    for name, (x, y) in chains.positions(choice, numbers, phi + 0j)[0].items():
        at = pose.joints[name].at
        pairs += [(np.broadcast_to(got, places.shape)[0, 0], part.real, 1.0) for got, part in ((at.x, x), (at.y, y))]
    errors = (
        weight * np.nanmax(np.abs(got - other)) / (np.nanmax(np.abs(other)) + 1e-6) for got, other, weight in pairs
    )
    return float(max(errors))


SIX_BAR = (
    pivot("B", 0.22, 0.03),
    rrr("C", "A", "B", first=0.2, second=0.13, first_mass=2.0, first_centre=0.1, first_inertia=0.01),
    point("D", "C.first", 0.1, 0.08),
    rrp("R", "D", "O", angle=-1.2, offset=0.02, first=0.5, first_mass=3.0, first_centre=0.2, mass=12.0),
)


def test_an_arc_of_more_than_three_quarters_of_a_turn() -> None:
    """Two slotted bars, each about a pivot just inside the arc of the one before it, swing 297 deg."""
    crank, coupler, rocker = math.sin(math.pi / 3.0), 3.0, 1.0
    frame = math.sqrt(coupler**2 + rocker**2 - crank**2)
    # The rocker swings 60 deg to either side of its middle, where the coupler is in line with the crank.
    ends = [(frame**2 + rocker**2 - reach**2) / (2.0 * frame * rocker) for reach in (coupler + crank, coupler - crank)]
    middle = math.pi - 0.5 * sum(map(math.acos, ends))
    x, y = 0.97 * math.cos(middle), 0.97 * math.sin(middle)
    choice, numbers = linkage(
        pivot("B", frame), rrr("C", "A", "B", first=coupler, second=rocker),
        pivot("P", frame + x, y), rpr("L", "C", "P"), point("E", "L.second", 1.0),
        pivot("Q", frame + 2.0 * x, 2.0 * y), rpr("M", "E", "Q"), point("F", "M.second", 2.0),
        crank=crank, working="F",
    )  # fmt: skip
    engine, v = PlanarLinkage(choice), arrays(numbers)
    assert np.isnan(engine.unassembled(v)[0])
    stroke = Stroke.of(engine, v)
    # From the law of cosines: a circle of radius 1 seen from a point at 0.97 of its radius.
    bar = math.atan2(math.sin(math.pi / 3.0), math.cos(math.pi / 3.0) - 0.97)
    bar = math.atan2(math.sin(bar), math.cos(bar) - 0.97)
    assert 2.0 * bar > 1.6 * math.pi
    assert float(stroke.length.flat[0]) == pytest.approx(2.0 * 2.0 * bar, rel=1e-9)
    phi = stroke.start + np.linspace(0.0, 2.0 * math.pi, 2001)[None, None, :]
    way, forward = engine.way(v, phi)[0, 0], (phi < stroke.end)[0, 0]
    assert np.diff(way[forward]).min() > -1e-9
    assert np.diff(way[~forward]).max() < 1e-9


def test_a_case_has_the_same_bits_in_every_block() -> None:
    choice, numbers = linkage(*SIX_BAR, crank=0.06, working="R")
    spec = MachineSpec(
        mechanism=MechanismChoice("linkage", linkage=choice), operation=OperationChoice("force", over="stroke")
    )
    values: dict[str, Any] = {f"mechanism.linkage.{name}": value for name, value in numbers.items()}
    values |= {"mean_speed": 15.0, "drive.inertia": 3.0, "operation.value": 200.0}
    cranks = np.linspace(0.05, 0.12, 9)
    block = simulate(spec, values | {"mechanism.linkage.crank": cranks}, cases=9)
    for k in (0, 4, 8):
        alone = simulate(spec, values | {"mechanism.linkage.crank": cranks[k]}, cases=1)
        assert alone.endings[0] == block.endings[k]
        assert alone.values.tobytes() == block.values[k : k + 1].tobytes()
    # Some of them cannot turn.
    assert len(set(block.endings.tolist())) == 2


@pytest.mark.parametrize(
    ("elements", "working", "text"),
    [
        ((pivot("B", 0.3), rrr("C", "A", "B", first=0.2, second=0.12)), "C",
         "refused at a shaft angle of 92.2924 deg: the links of the group C (0.2 m and 0.12 m) are too short to go "
         "from A to B: up to 0.08 m are missing in the turn"),
        ((pivot("B", 0.3), rrr("C", "A", "B", first=0.5, second=0.25)), "C",
         "refused at a shaft angle of 0 deg: the links of the group C (0.5 m and 0.25 m) differ too much for A and B, "
         "which come too near to each other: up to 0.05 m are missing in the turn"),
        ((rrp("R", "A", offset=0.2, first=0.25),), "R",
         "refused at a shaft angle of 210 deg: the link of the group R (0.25 m) does not reach its guide: up to 0.05 m "
         "are missing in the turn"),
        ((rrp("R", "A", offset=0.2, first=0.3),), "R",
         "refused at a shaft angle of 270 deg: the link of the group R is across its guide there, and could go on "
         "either way"),
        ((pivot("B", 0.05), rpr("L", "A", "B", offset=0.06)), "",
         "A comes nearer to B than the line of the bar of the group L passes it, so that the bar has no direction"),
        ((pivot("B", 0.05), rrr("C", "A", "B", first=0.12, second=0.12)), "C",
         "refused at a shaft angle of 0 deg: the working part C turns fully or stands still, and has no stroke"),
        ((pivot("B", 0.4), rrr("C", "A", "B", first=0.35, second=0.22), point("D", "C.first", 0.17, -0.34),
          rrp("R", "D", first=1.5, angle=1.5)), "R", "the working part R reverses 4 times in a turn"),
    ],
)  # fmt: skip
def test_a_linkage_that_cannot_turn_is_told_why(elements: Any, working: str, text: str) -> None:
    choice, numbers = linkage(*elements, crank=0.1, working=working)
    values = {f"mechanism.linkage.{name}": value for name, value in numbers.items()}
    spec = MachineSpec(mechanism=MechanismChoice("linkage", linkage=choice))
    with pytest.raises(AssemblyError) as problem:
        check(spec, values | {"mean_speed": 10.0, "drive.inertia": 1.0})
    assert text in str(problem.value)


@pytest.mark.parametrize(
    ("elements", "working", "wrong"),
    [
        ((pivot("O", 0.1),), "", (0, "name", "O")),
        ((rrr("C", "A", "B"),), "", (0, "to", "B")),
        ((rrr("C", "A", "A"),), "", (0, "to", "A")),
        ((point("D", "C.first", 0.1),), "", (0, "on", "C.first")),
        ((pivot("B", 0.1), rrr("C", "A", "B"), rrp("R", "C", "B", "C.first")), "", (2, "to", "B")),
        ((pivot("B", 0.1), rrr("C", "A", "B"), point("D", "C.first", 0.1)), "D", (None, "working", "D")),
        ((pivot("B", 0.1),), "B", (None, "working", "B")),
    ],
)
def test_names_that_are_not_known(elements: Any, working: str, wrong: tuple[int | None, str, str]) -> None:
    choice = LinkageChoice(tuple(element for element, _ in elements), working)
    (fault,) = element_faults(choice)
    assert fault[:3] == wrong
    spec = MachineSpec(mechanism=MechanismChoice("linkage", linkage=choice))
    with pytest.raises(StructureError, match=f"{wrong[1]} of the linkage, {wrong[2]},"):
        simulate(spec, {}, cases=1)


def test_a_force_needs_a_working_part() -> None:
    choice = LinkageChoice((Element("RRP", "R", ("A", "O"), ("frame",), "ahead"),))
    spec = MachineSpec(mechanism=MechanismChoice("linkage", linkage=choice), operation=OperationChoice("force"))
    with pytest.raises(StructureError, match="`working` names its joint"):
        simulate(spec, {}, cases=1)
    assert MachineSpec.from_json(spec.to_json()) == spec
