"""Forces in the joints of a planar linkage, group by group from the last one to the crank (kinetostatics).

Each group is in equilibrium under its inertial forces, weights, the force on the working part and what later groups
exert on its links. Two equations that do not contain the outer reactions give the inner one, as a dyad is statically
determinate (I. I. Artobolevsky, *Theory of Mechanisms*). Joints are without friction. A later group that is attached
to the joint of an RRR or RRP acts on its first link; the crank is balanced.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine import elementary
from sprag_study.engine.machine_shaft.dyads import Line, Link, Place, Vector, solved, zero
from sprag_study.engine.machine_shaft.elements import CRANK, FRAME, PIN, SHAFT, Element, LinkageChoice
from sprag_study.engine.machine_shaft.mechanisms import Values
from sprag_study.engine.machine_shaft.planar import PlanarLinkage, Pose, guide_line, numbers_of_element

Floats = NDArray[np.float64]


class Reactions(NamedTuple):
    """Forces in the joints of a linkage, in the coordinates of its elements.

    Attributes
    ----------
    forces : name -> Vector
        In N. ``NAME.inner`` is the force of a group's second link, slider or bar on its first link, block or pin;
        ``NAME.from`` and ``NAME.to`` are those of the outer joints or guides on the group; ``A`` is the force of the
        crank on its pin.
    moments : name -> array
        In N*m, of guides on what slides, about its joint.
    torque : array
        Torque of the shaft on the crank in N*m.
    """

    forces: dict[str, Vector]
    moments: dict[str, Floats]
    torque: Floats

    def table(self, along: Callable[[Floats], Floats]) -> dict[str, Floats]:
        """The columns of ``reaction_columns``, each of whose values ``along`` gives at the angles of a table."""
        columns: dict[str, Floats] = {}
        for name, force in self.forces.items():
            x, y = along(force.x), along(force.y)
            columns |= {f"{name}.force": np.sqrt(np.square(x) + np.square(y)), f"{name}.x": x, f"{name}.y": y}
        return columns | {f"{name}.moment": along(moment) for name, moment in self.moments.items()}


def joint_names(choice: LinkageChoice) -> tuple[str, ...]:
    """The joints of a linkage in the order of ``Reactions.forces``."""
    names = [PIN]
    for each in choice.elements:
        if each.kind not in {"pivot", "point"}:
            ends = ("from", "to") if each.kind == "PRP" else ("inner", "from", "to")
            names += [f"{each.name}.{end}" for end in ends]
    return tuple(names)


def reaction_columns(choice: LinkageChoice) -> tuple[tuple[str, str], ...]:
    """Name and SI unit of the columns that the joints of a linkage have in a table over the angle."""
    moments = [f"{each.name}.to" for each in choice.elements if each.kind in {"RRP", "RPP"}]
    forces = ((f"{name}.{part}", "N") for name in joint_names(choice) for part in ("force", "x", "y"))
    return (*forces, *((f"{name}.moment", "N*m") for name in moments))


class _Wrench:
    """Sum of the forces on a link, and of their moments about its base."""

    def __init__(self) -> None:
        self.force, self.moment = zero(), np.zeros((1, 1, 1))

    def add(self, force: Vector, arm: Vector, moment: Floats | float = 0.0) -> None:
        """Add a force at ``arm`` from the base, and a moment."""
        self.force = self.force + force
        self.moment = np.asarray(self.moment + arm.cross(force) + moment)


class _Loads:
    """What acts on the links of a linkage."""

    def __init__(self, choice: LinkageChoice, pose: Pose) -> None:
        self.pose = pose
        self.links = {name: _Wrench() for name in pose.links}
        #: Of blocks on joints, which have no link of their own.
        self.blocks = {each.name: zero() for each in choice.elements}
        self._carriers = {SHAFT: FRAME, PIN: CRANK}
        for each in choice.elements:
            carrier = each.guides[0] if each.kind == "point" else next(iter(each.links), FRAME)
            self._carriers[each.name] = FRAME if each.kind == "pivot" else carrier
            if each.kind == "PRP":
                self._carriers[each.name] = each.name

    def at(self, joint: str, force: Vector) -> None:
        """Let a force act at a joint."""
        carrier = self._carriers[joint]
        if carrier in self.blocks:
            self.blocks[carrier] = self.blocks[carrier] + force
        else:
            self.on(carrier, force, self.pose.joints[joint].at)

    def on(self, link: str, force: Vector, at: Vector, moment: Floats | float = 0.0) -> None:
        """Let a force act on a link at a place, and a moment."""
        self.links[link].add(force, at - self.pose.links[link].base.at, moment)


def reactions(
    linkage: PlanarLinkage, values: Values, phi: Floats, squares: Floats, acceleration: Floats, push: Floats,
    gravity: Floats | float,
) -> Reactions:  # fmt: skip
    """Forces in the joints at angles ``phi`` of the crank.

    Parameters
    ----------
    linkage : PlanarLinkage
    values : mapping
        Numbers of the linkage.
    phi, squares, acceleration : arrays
        Angle (rad), omega^2 (rad^2/s^2) and angular acceleration (rad/s^2) of the crank.
    push : array
        Force on the working part along its forward stroke in N, without its weight.
    gravity : array or float
        Gravitational acceleration in m/s^2.
    """
    choice = linkage.choice
    pose = linkage.pose(values, phi)
    loads = _Loads(choice, pose)
    down = Vector(-elementary.sin(values["inclination"]), -elementary.cos(values["inclination"])) * gravity

    def inertial(mass: Floats, at: Place) -> Vector:
        moving = at.first * acceleration + at.second * squares
        return (down - moving) * mass

    for index, each in enumerate(choice.elements):
        v = numbers_of_element(values, index)
        _load(each, v, loads, inertial, (squares, acceleration))
    if choice.working:
        _push(linkage, loads, push)
    found = Reactions({}, {}, np.zeros((1, 1, 1)))
    with np.errstate(invalid="ignore", divide="ignore"):
        for index, each in reversed(tuple(enumerate(choice.elements))):
            _balance(each, numbers_of_element(values, index), loads, found)
    crank = loads.links[CRANK]
    known = {PIN: crank.force * -1.0, **found.forces}
    forces = {name: known[name] for name in joint_names(choice)}
    return Reactions(forces, found.moments, np.asarray(-crank.moment))


def _load(
    each: Element,
    v: dict[str, Floats],
    loads: _Loads,
    inertial: Callable[[Floats, Place], Vector],
    motion: Sequence[Floats],
) -> None:
    """Let inertia and weight act on the links of an element."""
    pose, (squares, acceleration) = loads.pose, motion

    def turning(link: Link, inertia: Floats) -> Floats:
        return np.asarray(-inertia * (link.turn2 * squares + link.turn1 * acceleration))

    for end in ("first", "second"):
        if f"{end}_mass" in v:
            name = f"{each.name}.{end}"
            link = pose.links[name]
            centre = link.point(v[f"{end}_centre"], v[f"{end}_across"])
            loads.on(name, inertial(v[f"{end}_mass"], centre), centre.at, turning(link, v[f"{end}_inertia"]))
    if "mass" in v:
        own = pose.joints[each.name]
        force = inertial(v["mass"], own)
        if each.kind == "point":
            loads.at(each.name, force)
        else:
            slider = f"{each.name}.slider"
            loads.on(slider, force, own.at, turning(pose.links[slider], v["inertia"]))
    if "block_mass" in v:
        joint = each.name if each.kind == "PRP" else each.joints[0]
        loads.blocks[each.name] = loads.blocks[each.name] + inertial(v["block_mass"], pose.joints[joint])


def _push(linkage: PlanarLinkage, loads: _Loads, push: Floats) -> None:
    """Let the force on the working part act on its link."""
    name, link = linkage.choice.working, linkage.working_link
    at, backward = loads.pose.joints[name].at, linkage.choice.reversed
    if link == FRAME:
        own = loads.pose.links[f"{name}.slider"]
        direction, link = own.direction, f"{name}.slider"
    else:
        assert link is not None
        arm = at - loads.pose.links[link].base.at
        direction = arm.ahead * (1.0 / np.sqrt(arm.square))
    loads.on(link, direction * ((-1.0 if backward else 1.0) * push), at)


def _balance(each: Element, v: dict[str, Floats], loads: _Loads, found: Reactions) -> None:
    """Find the reactions of a group, and let them act on what it is attached to."""
    if each.kind in {"pivot", "point"}:
        return
    pose, name = loads.pose, each.name
    joints = [pose.joints[joint].at for joint in each.joints]
    lines = [guide_line(each, number, v, pose) for number in range(len(each.guides))]
    match each.kind:
        case "RRR":
            first, second = (loads.links[link] for link in each.links)
            u, w = (pose.joints[name].at - joint for joint in joints)
            inner = solved(u.ahead, w.ahead, -first.moment, second.moment)
            outer = [(first.force + inner) * -1.0, (second.force - inner) * -1.0]
        case "RRP":
            first, slider = (loads.links[link] for link in each.links)
            g, u = lines[0].direction, pose.joints[name].at - joints[0]
            inner = solved(g, u.ahead, slider.force.scalar(g), -first.moment)
            outer = [(first.force + inner) * -1.0, inner - slider.force]
            found.moments[f"{name}.to"] = np.asarray(-slider.moment)
        case "RPR":
            bar = loads.links[each.links[0]]
            n = pose.links[each.links[0]].direction.ahead
            inner = n * (bar.moment / (joints[0] - joints[1]).cross(n))
            outer = [inner * -1.0 - loads.blocks[name], inner - bar.force]
        case "RPP":
            slider, g = loads.links[each.links[0]], lines[0].direction
            k = g.ahead * elementary.cos(v["slot_angle"]) - g * elementary.sin(v["slot_angle"])
            inner = k * (slider.force.scalar(g) / k.scalar(g))
            outer = [inner * -1.0 - loads.blocks[name], inner - slider.force]
            at = joints[0] - pose.joints[name].at
            found.moments[f"{name}.to"] = np.asarray(at.cross(inner) - slider.moment)
        case _:
            normals = [line.direction.ahead for line in lines]
            inner = loads.blocks[name] * -1.0
            outer = [
                own * (inner.cross(other) / own.cross(other))
                for own, other in (normals, reversed(normals))
            ]  # fmt: skip
    _attach(each, lines, outer, loads, found)
    if each.kind != "PRP":
        found.forces[f"{name}.inner"] = inner


def _attach(each: Element, lines: Sequence[Line], outer: Sequence[Vector], loads: _Loads, found: Reactions) -> None:
    """Let the opposites of the outer reactions act on joints and on the links of guides."""
    guided = dict(zip((0, 1) if each.kind == "PRP" else (1,), each.guides, strict=False)) if lines else {}
    for number, (field, force) in enumerate(zip(("from", "to"), outer, strict=True)):
        found.forces[f"{each.name}.{field}"] = force
        against = force * -1.0
        if number in guided:
            moment = found.moments.get(f"{each.name}.{field}", 0.0)
            loads.on(guided[number], against, loads.pose.joints[each.name].at, -moment)
        else:
            loads.at(each.joints[number], against)
