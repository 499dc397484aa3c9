"""Groups of two links (dyads) at angles of the shaft: places, and first and second derivatives by the shaft's angle.

Places follow from circles and lines; differentiating the same conditions gives two linear equations for the velocities
and two for the accelerations (I. I. Artobolevsky, *Theory of Mechanisms*; R. L. Norton, *Design of Machinery*,
chapters 4, 6 and 7).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine import elementary

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Vector:
    """Plane vectors; both components are arrays that broadcast with each other."""

    x: Floats
    y: Floats

    def __add__(self, other: "Vector") -> "Vector":
        """Sum."""
        return Vector(self.x + other.x, self.y + other.y)

    def __sub__(self, other: "Vector") -> "Vector":
        """Difference."""
        return Vector(self.x - other.x, self.y - other.y)

    def __mul__(self, factor: Floats | float) -> "Vector":
        """Product with a number."""
        return Vector(np.asarray(self.x * factor), np.asarray(self.y * factor))

    def scalar(self, other: "Vector") -> Floats:
        """Scalar product."""
        return np.asarray(self.x * other.x + self.y * other.y)

    def cross(self, other: "Vector") -> Floats:
        """Component of the vector product across the plane."""
        return np.asarray(self.x * other.y - self.y * other.x)

    @property
    def ahead(self) -> "Vector":
        """Turned by a quarter counterclockwise."""
        return Vector(-self.y, self.x)

    @property
    def square(self) -> Floats:
        """Square of its length."""
        return np.asarray(np.square(self.x) + np.square(self.y))


def zero() -> Vector:
    """A vector of no length."""
    return Vector(np.zeros((1, 1, 1)), np.zeros((1, 1, 1)))


class Place(NamedTuple):
    """A point: its place (m), and its first (m/rad) and second derivative."""

    at: Vector
    first: Vector
    second: Vector


class Link(NamedTuple):
    """A link: the point from which its points count, its direction (of length 1), and derivatives of its angle."""

    base: Place
    direction: Vector
    turn1: Floats
    turn2: Floats

    def point(self, along: Floats, across: Floats | float = 0.0) -> Place:
        """The point of the link at these coordinates in m; ``across`` is to the left of its direction."""
        return self.rigid(self.direction * along + self.direction.ahead * across)

    def rigid(self, arm: Vector) -> Place:
        """The point of the link that is at ``arm`` from its base."""
        base = self.base
        first = base.first + arm.ahead * self.turn1
        second = base.second + arm.ahead * self.turn2 - arm * np.square(self.turn1)
        return Place(base.at + arm, first, second)


class Slack(NamedTuple):
    """How far a group is from where its links do not meet, in m, and a length of its size; positive where they do."""

    value: Floats
    size: Floats


class Joined(NamedTuple):
    """A group: its inner joint (None for RPR), its links by their names, what is left to its limit, and its slide.

    ``slide`` are the coordinate along the (first) guide or bar in m, with its two derivatives.
    """

    joint: Place | None
    links: dict[str, Link]
    slack: Slack
    slide: tuple[Floats, Floats, Floats]


class Line(NamedTuple):
    """A guide: the link to which it is fixed, its direction, a joint through which it goes, and its offset from it."""

    link: Link
    direction: Vector
    through: Place
    offset: Floats

    @classmethod
    def of(cls, link: Link, through: Place, angle: Floats, offset: Floats) -> "Line":
        """The guide at ``angle`` (rad) from the direction of its link, its line ``offset`` (m) to the left."""
        cos, sin = elementary.cos(angle), elementary.sin(angle)
        return cls(link, link.direction * cos + link.direction.ahead * sin, through, offset)

    @property
    def foot(self) -> Vector:
        """The point of the line from which its coordinate counts."""
        return self.through.at + self.direction.ahead * self.offset

    def carried(self, at: Vector) -> Place:
        """The point of the guide's link that is at the place ``at``."""
        about = self.link._replace(base=self.through)
        return about.rigid(at - self.through.at)._replace(at=at)


def solved(u: Vector, v: Vector, by_u: Floats, by_v: Floats) -> Vector:
    """The vector with these scalar products with ``u`` and ``v``."""
    across = u.cross(v)
    return Vector((by_u * v.y - by_v * u.y) / across, (by_v * u.x - by_u * v.x) / across)


def _bar(base: Place, end: Place) -> Link:
    """The link from ``base`` to ``end``, which keep their distance."""
    arm = end.at - base.at
    square = arm.square
    turn1, turn2 = (arm.cross(end_ - base_) / square for end_, base_ in zip(end[1:], base[1:], strict=True))
    return Link(base, arm * (1.0 / np.sqrt(square)), turn1, turn2)


def join_rrr(p: Place, q: Place, first: Floats, second: Floats, sign: float) -> Joined:
    """Two links of the lengths ``first`` (from ``p``) and ``second`` (from ``q``) that a revolute joint connects."""
    gap = q.at - p.at
    square = gap.square
    distance = np.sqrt(square)
    slack = np.minimum(first + second - distance, distance - np.abs(first - second))
    share = 0.5 * (square + np.square(first) - np.square(second)) / square
    height = sign * np.sqrt(np.square(first) / square - np.square(share))
    at = p.at + gap * share + gap.ahead * height
    u, v = at - p.at, at - q.at
    velocity = solved(u, v, u.scalar(p.first), v.scalar(q.first))
    by_u = u.scalar(p.second) - (velocity - p.first).square
    by_v = v.scalar(q.second) - (velocity - q.first).square
    joint = Place(at, velocity, solved(u, v, by_u, by_v))
    nothing = np.zeros((1, 1, 1))
    links = {"first": _bar(p, joint), "second": _bar(q, joint)}
    return Joined(joint, links, Slack(slack, first + second), (nothing, nothing, nothing))


def join_rrp(p: Place, line: Line, length: Floats, sign: float) -> Joined:
    """A link from ``p`` whose end is a revolute joint of a slider on a guide."""
    g = line.direction
    gap = p.at - line.foot
    away = gap.scalar(g.ahead)
    reach = np.sqrt(np.square(length) - np.square(away))
    slide = gap.scalar(g) + sign * reach
    at = line.foot + g * slide
    carried, u = line.carried(at), at - p.at
    turn1 = line.link.turn1
    along = u.scalar(g)
    slide1 = u.scalar(p.first - carried.first) / along
    velocity = carried.first + g * slide1
    rest = carried.second + g.ahead * (2.0 * turn1 * slide1)
    slide2 = (u.scalar(p.second - rest) - (velocity - p.first).square) / along
    joint = Place(at, velocity, rest + g * slide2)
    slider = Link(joint, g, turn1, line.link.turn2)
    links = {"first": _bar(p, joint), "slider": slider}
    return Joined(joint, links, Slack(length - np.abs(away), length), (slide, slide1, slide2))


def join_rpr(p: Place, q: Place, offset: Floats, sign: float) -> Joined:
    """A bar that turns about ``q`` and slides through a block on ``p``; the block's line is ``offset`` beside ``q``."""
    gap = p.at - q.at
    square = gap.square
    slide = sign * np.sqrt(square - np.square(offset))
    g = (gap * slide - gap.ahead * offset) * (1.0 / square)
    n = g.ahead
    velocity, acceleration = p.first - q.first, p.second - q.second
    turn1 = velocity.scalar(n) / slide
    slide1 = velocity.scalar(g) + offset * turn1
    turn2 = (acceleration.scalar(n) - 2.0 * slide1 * turn1 + np.square(turn1) * offset) / slide
    slide2 = acceleration.scalar(g) + offset * turn2 + np.square(turn1) * slide
    distance = np.sqrt(square)
    slack = Slack(distance - np.abs(offset), distance + np.abs(offset))
    return Joined(None, {"second": Link(q, g, turn1, turn2)}, slack, (slide, slide1, slide2))


def join_rpp(p: Place, line: Line, slot_angle: Floats) -> Joined:
    """A block on ``p`` in a slot of a slider on a guide; the slot is at ``slot_angle`` from the guide."""
    g = line.direction
    h = g * elementary.cos(slot_angle) + g.ahead * elementary.sin(slot_angle)
    apart = g.cross(h)

    def parts(vector: Vector) -> tuple[Floats, Floats]:
        return vector.cross(h) / apart, g.cross(vector) / apart

    slide, slot = parts(p.at - line.foot)
    turn1, turn2 = line.link.turn1, line.link.turn2
    carried = line.carried(p.at)
    relative = p.first - carried.first
    slide1, _ = parts(relative)
    slide2, _ = parts(p.second - carried.second - relative.ahead * (2.0 * turn1))
    at = line.foot + g * slide
    own = line.carried(at)
    second = own.second + g * slide2 + g.ahead * (2.0 * turn1 * slide1)
    joint = Place(at, own.first + g * slide1, second)
    slack = Slack(np.abs(apart) + 0.0 * slot, np.ones((1, 1, 1)))
    return Joined(joint, {"slider": Link(joint, g, turn1, turn2)}, slack, (slide, slide1, slide2))


def join_prp(line: Line, other: Line) -> Joined:
    """A joint whose two blocks slide on two guides: it is where their lines meet."""
    g, h = line.direction, other.direction
    apart = g.cross(h)
    slide = (other.foot - line.foot).cross(h) / apart
    at = line.foot + g * slide
    own, others = line.carried(at), other.carried(at)
    turns = line.link.turn1, other.link.turn1

    def parts(vector: Vector) -> tuple[Floats, Floats]:
        """The factors of g and of -h whose sum ``vector`` is."""
        return vector.cross(h) / apart, vector.cross(g) / apart

    slide1, slot1 = parts(others.first - own.first)
    rest = own.second + g.ahead * (2.0 * turns[0] * slide1)
    against = others.second + h.ahead * (2.0 * turns[1] * slot1)
    slide2, _ = parts(against - rest)
    joint = Place(at, own.first + g * slide1, rest + g * slide2)
    slack = Slack(np.abs(apart) + 0.0 * slide, np.ones((1, 1, 1)))
    return Joined(joint, {}, slack, (slide, slide1, slide2))
