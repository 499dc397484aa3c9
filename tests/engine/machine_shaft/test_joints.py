"""Forces in the joints of planar linkages: the power that they pass on, Newton's equations, and slider-cranks."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sprag_study.engine.machine_shaft.elements import Element, LinkageChoice
from sprag_study.engine.machine_shaft.joints import Reactions, reaction_columns, reactions
from sprag_study.engine.machine_shaft.planar import PlanarLinkage
from sprag_study.engine.machine_shaft.spec import MachineSpec, MechanismChoice, OperationChoice
from sprag_study.engine.machine_shaft.trajectory import trajectory
from tests.engine.machine_shaft import chains
from tests.engine.machine_shaft.linkages import Numbers, as_dyads, linkage, pivot, point, rpr, rrp, rrr
from tests.engine.machine_shaft.test_planar import SHAPER, arrays

Array = NDArray[Any]
SQUARE, ACCELERATION, PUSH, GRAVITY = 150.0, -40.0, -700.0, 9.80665
BODY = {"first_mass": 3.0, "first_centre": 0.1, "first_across": 0.03, "first_inertia": 0.02}
SECOND = {"second_mass": 2.0, "second_centre": 0.05, "second_across": -0.02, "second_inertia": 0.01}
FOUR = (
    pivot("B", 0.22, 0.03), rrr("C", "A", "B", first=0.2, second=0.13, **BODY, **SECOND),
    point("D", "C.first", 0.1, 0.08, 1.5),
)  # fmt: skip
RAM = rrp("R", "D", "O", angle=-1.2, offset=0.02, first=0.5, mass=12.0, **BODY)


def _element(kind: Any, name: str, joints: Any, guides: Any, **numbers: float) -> tuple[Element, Numbers]:
    return Element(kind, name, joints, guides), numbers


#: Linkages that have every kind of group, some on the links of others.
CHAINS: dict[str, Any] = {
    "ram": ((*FOUR, RAM), "R"),
    "ram on the joint of a group": ((*FOUR, rrp("R", "C", "B", angle=0.3, first=0.3, mass=9.0, **BODY)), "R"),
    "guide on a rocker": (
        (*FOUR, pivot("E", 0.5, 0.1),
         rrp("S", "E", "B", "C.second", angle=0.4, first=0.6, mass=3.0, inertia=0.05, **BODY)), "C"),
    "slotted bar": (
        (pivot("B", 0.0, -0.04), rpr("L", "A", "B", offset=0.01, block_mass=1.0, **SECOND), point("D", "L.second", 0.1),
         rrp("R", "D", "B", first=0.4, mass=9.0, **BODY)), "R"),
    "yoke": ((_element("RPP", "Y", ("A", "O"), ("frame",), mass=7.0, block_mass=2.0, slot_angle=1.2, angle=0.2,
                       offset=0.01),), "Y"),
    "yoke on a rocker": (
        (*FOUR, pivot("E", 0.4, -0.1), _element("RPP", "Y", ("E", "C"), ("C.first",), mass=7.0, inertia=0.1,
                                                block_mass=2.0)), "C"),
    "pin in two slots": (
        (*FOUR, _element("PRP", "T", ("C", "O"), ("C.second", "frame"), block_mass=4.0, offset=0.02, angle_2=0.1,
                         offset_2=-0.1)), "C"),
    "eight links": (
        (*FOUR, pivot("E", 0.1, 0.6), rrr("F", "D", "E", "right", first=0.45, second=0.3, **BODY, **SECOND),
         rrp("R", "F", "E", angle=1.0, first=0.8, mass=6.0, **BODY)), "R"),
}  # fmt: skip


def case_of(name: str) -> tuple[PlanarLinkage, Numbers]:
    elements, working = CHAINS[name]
    choice, numbers = linkage(*elements, crank=0.06, working=working, inclination=0.3)
    return PlanarLinkage(choice), numbers


def reactions_of(engine: PlanarLinkage, v: Numbers, phi: Array) -> Reactions:
    shape = np.ones((1, 1, 1))
    return reactions(engine, arrays(v), phi[None, None, :], SQUARE * shape, ACCELERATION * shape, PUSH * shape, GRAVITY)


@pytest.mark.parametrize("name", list(CHAINS))
def test_the_torque_on_the_crank_is_that_of_the_reduced_machine(name: str) -> None:
    engine, numbers = case_of(name)
    phi, v = np.linspace(0.05, 6.2, 50), arrays(numbers)
    places = phi[None, None, :]
    assert np.isnan(engine.unassembled(v)[0])
    motion = engine.motion(v, places)
    wanted = motion.inertia * ACCELERATION + 0.5 * motion.inertia_slope * SQUARE + GRAVITY * engine.lift(v, places)
    wanted = (wanted - PUSH * motion.way_slope)[0, 0]
    got = reactions_of(engine, numbers, phi)
    assert got.torque[0, 0] == pytest.approx(wanted, abs=1e-10 * np.abs(wanted).max())
    names = {f"{name}.force" for name in got.forces} | {f"{name}.moment" for name in got.moments}
    every = {column for column, _ in reaction_columns(engine.choice) if column.endswith(("force", "moment"))}
    assert names == every


@pytest.mark.parametrize("name", list(CHAINS))
def test_derivatives_are_those_of_the_places(name: str) -> None:
    """Of every joint and link, also on guides that turn, by differences of the places."""
    engine, numbers = case_of(name)
    phi, v = np.linspace(0.05, 6.2, 50), arrays(numbers)

    def columns(angles: Array) -> dict[str, tuple[Array, Array, Array]]:
        """Places of joints and directions of links with their two derivatives, shape (2, angles)."""
        pose = engine.pose(v, angles[None, None, :])
        parts = {name: tuple((own.x, own.y) for own in place) for name, place in pose.joints.items()}
        for link, own in pose.links.items():
            ahead, turn1 = own.direction.ahead, own.turn1
            first, second = ahead * turn1, ahead * own.turn2 - own.direction * turn1**2
            parts[link] = tuple((each.x, each.y) for each in (own.direction, first, second))
        shape = (1, 1, len(angles))
        flat = {
            name: [np.array([np.broadcast_to(x, shape)[0, 0] for x in pair]) for pair in own]
            for name, own in parts.items()
        }
        return {name: (own[0], own[1], own[2]) for name, own in flat.items()}

    for label, (_, first, second) in columns(phi).items():
        by_first = chains.slope(lambda angles, label=label: columns(angles)[label][0], phi)
        by_second = chains.slope(lambda angles, label=label: columns(angles)[label][1], phi)
        assert first == pytest.approx(by_first, abs=1e-9 * (1.0 + np.abs(first).max())), label
        assert second == pytest.approx(by_second, abs=1e-9 * (1.0 + np.abs(second).max())), label


def motions(choice: LinkageChoice, v: Numbers, at: float) -> list[Any]:
    """Mass, inertia, centre and accelerations (x, y, angle) of every body."""
    phi = np.array([at])
    bodies = chains.positions(choice, v, phi + 0j)[1]
    found = []
    for k, (mass, inertia, x, y, _) in enumerate(bodies):
        rates = []
        for part in (2, 3, 4):

            def first(angle: Array, k: int = k, part: int = part) -> Array:
                return chains.by_complex_step(lambda own: chains.positions(choice, v, own)[1][k][part], angle)

            rates.append(float((first(phi) * ACCELERATION + chains.slope(first, phi, 1e-3) * SQUARE)[0]))
        found.append((mass, inertia, float(x.real[0]), float(y.real[0]), *rates))
    return found


class Newton:
    """Three equations for each link, about the origin, at an angle; columns are unknown forces and moments."""

    def __init__(self, choice: LinkageChoice, v: Numbers, at: float) -> None:
        self.choice, self.v = choice, v
        self.links = [link for each in choice.elements for link in each.links]
        self.known, self.columns = np.zeros(3 * len(self.links)), dict[str, Array]()
        places = chains.positions(choice, v, np.array([at + 0j]))[0]
        self.joints = {name: np.array([float(x.real[0]), float(y.real[0])]) for name, (x, y) in places.items()}
        self.carriers = {"A": "crank", "O": "frame"}
        self._masses(motions(choice, v, at))
        for index, each in enumerate(choice.elements):
            self._joints(index, each)

    def place(self, link: str, values: Array, force: Array, at: Array, moment: float = 0.0) -> None:
        if link in self.links:
            row = 3 * self.links.index(link)
            values[row : row + 3] += [*force, at[0] * force[1] - at[1] * force[0] + moment]

    def column(self, label: str, link: str, other: str, force: Array, at: Array, moment: float = 0.0) -> None:
        """An unknown factor on a force on ``link``, whose opposite acts on ``other``."""
        values = np.zeros(3 * len(self.links))
        self.place(link, values, force, at, moment)
        self.place(other, values, -force, at, -moment)
        self.columns[label] = values

    def _masses(self, bodies: list[Any]) -> None:
        down = GRAVITY * np.array([-math.sin(self.v["inclination"]), -math.cos(self.v["inclination"])])
        left = iter(bodies)
        for each in self.choice.elements:
            self.carriers[each.name] = {"pivot": "frame", "point": (*each.guides, "")[0]}.get(
                each.kind, (*each.links, "")[0]
            )
            own = {"pivot": (), "point": each.guides, "RRP": each.links[::-1]}.get(each.kind, each.links)
            for link in own:
                mass, inertia, x, y, ax, ay, turn = next(left)
                force = mass * (down - np.array([ax, ay]))
                self.place(link, self.known, force, np.array([x, y]), -inertia * turn)

    def _joints(self, index: int, each: Element) -> None:
        for part, axis in zip("xy", np.eye(2), strict=True):
            ends = {"from": (0, 0), "to": (1, 1)} if each.kind == "RRR" else {"from": (0, 0)} if each.links else {}
            for end, (link, joint) in ends.items():
                outer = each.joints[joint]
                label = f"{each.name}.{end}.{part}"
                self.column(label, each.links[link], self.carriers[outer], axis, self.joints[outer])
            if each.links:
                self.column(f"{each.name}.inner.{part}", *each.links, axis, self.joints[each.name])
        if each.kind == "RRP":
            line, at = self.v[f"elements.{index}.angle"], self.joints[each.name]
            along, normal = np.array([math.cos(line), math.sin(line)]), np.array([-math.sin(line), math.cos(line)])
            self.column(f"{each.name}.normal", each.links[1], "frame", normal, at)
            self.column(f"{each.name}.to.moment", each.links[1], "frame", 0.0 * normal, at, 1.0)
            if each.name == self.choice.working:
                self.place(each.links[1], self.known, PUSH * along, at)

    def solution(self) -> dict[str, float]:
        values = np.linalg.solve(np.column_stack(list(self.columns.values())), -self.known)
        return dict(zip(self.columns, values.tolist(), strict=True))


@pytest.mark.parametrize("name", ["ram", "ram on the joint of a group", "eight links"])
def test_newtons_equations_of_all_links_at_once(name: str) -> None:
    engine, v = case_of(name)
    for at in (0.4, 2.0, 4.4):
        wanted, got = Newton(engine.choice, v, at).solution(), reactions_of(engine, v, np.array([at]))
        flat = {f"{key}.{part}": getattr(force, part) for key, force in got.forces.items() for part in "xy"}
        flat |= {f"{key}.moment": moment for key, moment in got.moments.items()}
        for index, each in enumerate(engine.choice.elements):
            if each.kind == "RRP":
                line, force = v[f"elements.{index}.angle"], got.forces[f"{each.name}.to"]
                flat[f"{each.name}.normal"] = math.cos(line) * force.y - math.sin(line) * force.x
        size = max(map(abs, wanted.values()))
        for label, value in wanted.items():
            assert float(np.asarray(flat[label]).flat[0]) == pytest.approx(value, abs=1e-9 * size), label


def test_joints_of_a_slider_crank_in_the_table_over_the_angle() -> None:
    numbers = {name: SHAPER[name] for name in ("crank", "rod", "rod_centre", "rod_mass", "rod_inertia", "ram_mass")}
    numbers |= {"offset": 0.02, "inclination": 0.3}
    choice, own = as_dyads("slider_crank", numbers)
    rest = {"mean_speed": 20.0, "drive.inertia": 8.0, "operation.value": 900.0}
    tables = []
    for kind, values in (
        (MechanismChoice("slider_crank", weights="all"), numbers), (MechanismChoice("linkage", linkage=choice), own),
    ):  # fmt: skip
        spec = MachineSpec(mechanism=kind, operation=OperationChoice("force"))
        paths = rest | {f"mechanism.{kind.kind}.{name}": value for name, value in values.items()}
        table = trajectory(spec, paths, np.linspace(0.1, 6.0, 9))
        tables.append(dict(zip(table.names, table.values.T, strict=True)))
    known, dyads = tables
    size = known["crank_pin.force"].max()
    for name, column, sign in (
        ("crank_pin.force", "joints.A.force", 1.0), ("crank_pin.x", "joints.C.from.x", -1.0),
        ("crank_pin.y", "joints.A.y", -1.0), ("guide.force", "joints.C.to.y", -1.0),
    ):  # fmt: skip
        assert sign * dyads[column] == pytest.approx(known[name], abs=1e-10 * size), name
    assert dyads["joints.C.to.moment"] == pytest.approx(np.zeros(9), abs=1e-10 * size)
