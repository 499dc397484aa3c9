"""Planar linkages of one's own: pivots, points and dyads in a list, solved one after the other at angles of the shaft.

The shaft is at the origin, x to the right and y upwards; the crank turns counterclockwise from the x axis. The crank
is balanced, and its inertia belongs to the drive's.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine import elementary
from sprag_study.engine.machine_shaft.dyads import (
    Joined,
    Line,
    Link,
    Place,
    Slack,
    Vector,
    join_prp,
    join_rpp,
    join_rpr,
    join_rrp,
    join_rrr,
    zero,
)
from sprag_study.engine.machine_shaft.elements import (
    CRANK,
    FRAME,
    PIN,
    SHAFT,
    Element,
    LinkageChoice,
    working_link,
)
from sprag_study.engine.machine_shaft.mechanisms import Body, Motion, RodMechanism, Values, reduced
from sprag_study.engine.machine_shaft.problems import amount
from sprag_study.engine.machine_shaft.roots import bracketed_roots
from sprag_study.sentences import Part, Sentence

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_TURN = 2.0 * np.pi
#: Angles of a turn at which limits and reversals are looked for: narrower ones between two of them are not seen.
_ANGLES = 360
#: Evaluations that narrow the least slack of a group between two of them.
_NARROWINGS = 50
#: Most smallest slacks, or reversals, that are narrowed in a turn.
_MOST = 16
#: Part of a group's size within which its links count as lying in one line.
_TOUCHING = 1e-9
_START, _END, _SWING = "stroke.start", "stroke.end", "stroke.swing"
_COUNT, _SURPLUS = "stroke.count", "stroke.surplus"
#: Place of the working part at the start, as `PlanarLinkage.travel` tells it.
_HOME = "stroke.home_x", "stroke.home_y"


class Pose(NamedTuple):
    """A linkage at angles of the crank: its joints, its links and its groups, by name."""

    joints: dict[str, Place]
    links: dict[str, Link]
    groups: dict[str, Joined]


def numbers_of_element(values: Values, index: int) -> dict[str, Floats]:
    """The numbers of an element by their names."""
    return {name: values[path] for name, path in _paths_of_elements(tuple(values)).get(index, ())}


@lru_cache(maxsize=64)
def _paths_of_elements(paths: tuple[str, ...]) -> dict[int, list[tuple[str, str]]]:
    """Names and paths of the numbers of each element: a root takes a hundred poses, each with the same names."""
    by_element: dict[int, list[tuple[str, str]]] = {}
    for path in paths:
        subject, _, rest = path.partition(".")
        if subject == "elements":
            index, _, name = rest.partition(".")
            by_element.setdefault(int(index), []).append((name, path))
    return by_element


def guide_line(each: Element, number: int, v: Mapping[str, Floats], pose: Pose) -> Line:
    """The guide of a group by its number."""
    suffix = "_2" if number else ""
    through = each.joints[number if each.kind == "PRP" else 1]
    link = pose.links[each.guides[number]]
    return Line.of(link, pose.joints[through], v[f"angle{suffix}"], v[f"offset{suffix}"])


def _joined(each: Element, v: Mapping[str, Floats], pose: Pose) -> Joined:
    joints = pose.joints
    match each.kind:
        case "RRR":
            p, q = (joints[name] for name in each.joints)
            return join_rrr(p, q, v["first"], v["second"], each.sign)
        case "RRP":
            return join_rrp(joints[each.joints[0]], guide_line(each, 0, v, pose), v["first"], each.sign)
        case "RPR":
            p, q = (joints[name] for name in each.joints)
            return join_rpr(p, q, v["offset"], each.sign)
        case "RPP":
            return join_rpp(joints[each.joints[0]], guide_line(each, 0, v, pose), v["slot_angle"])
    return join_prp(guide_line(each, 0, v, pose), guide_line(each, 1, v, pose))


def _body(mass: Floats, inertia: Floats, centre: Place, link: Link | None) -> Body:
    nothing = np.zeros((1, 1, 1))
    turn1, turn2 = (nothing, nothing) if link is None else (link.turn1, link.turn2)
    first, second = centre.first, centre.second
    return Body(mass, inertia, first.x, first.y, turn1, second.x, second.y, turn2)


class PlanarLinkage(RodMechanism):
    """A linkage of a list of elements; see LinkageChoice for its structure and ``elements.K.*`` for its numbers."""

    def __init__(self, choice: LinkageChoice) -> None:
        self.choice = choice
        self.working_link = working_link(choice) if choice.working else None
        self._sign = -1.0 if choice.reversed else 1.0

    def pose(self, values: Values, phi: Floats) -> Pose:
        """Joints and links at angles ``phi`` (rad) that broadcast with the numbers; NaN where links do not meet."""
        cos, sin, nothing = elementary.cos(phi), elementary.sin(phi), np.zeros((1, 1, 1))
        origin = Place(zero(), zero(), zero())
        x_axis = Vector(np.ones((1, 1, 1)), nothing)
        crank = Link(origin, Vector(cos, sin), np.ones((1, 1, 1)), nothing)
        pose = Pose({SHAFT: origin}, {FRAME: Link(origin, x_axis, nothing, nothing), CRANK: crank}, {})
        pose.joints[PIN] = crank.point(values["crank"])
        with np.errstate(invalid="ignore", divide="ignore"):
            for index, each in enumerate(self.choice.elements):
                v = numbers_of_element(values, index)
                if each.kind == "pivot":
                    pose.joints[each.name] = Place(Vector(v["x"], v["y"]), zero(), zero())
                elif each.kind == "point":
                    pose.joints[each.name] = pose.links[each.guides[0]].point(v["along"], v["across"])
                else:
                    joined = _joined(each, v, pose)
                    pose.groups[each.name] = joined
                    pose.links.update({f"{each.name}.{name}": link for name, link in joined.links.items()})
                    if joined.joint is not None:
                        pose.joints[each.name] = joined.joint
        return pose

    def bodies(self, values: Values, pose: Pose) -> list[Body]:
        """Everything with a mass."""
        bodies, nothing = [], np.zeros((1, 1, 1))
        for index, each in enumerate(self.choice.elements):
            v = numbers_of_element(values, index)
            for end in ("first", "second"):
                if f"{end}_mass" in v:
                    link = pose.links[f"{each.name}.{end}"]
                    centre = link.point(v[f"{end}_centre"], v[f"{end}_across"])
                    bodies.append(_body(v[f"{end}_mass"], v[f"{end}_inertia"], centre, link))
            if "mass" in v:
                slider = pose.links.get(f"{each.name}.slider")
                bodies.append(_body(v["mass"], v.get("inertia", nothing), pose.joints[each.name], slider))
            if "block_mass" in v:
                at = pose.joints[each.name if each.kind == "PRP" else each.joints[0]]
                bodies.append(_body(v["block_mass"], nothing, at, None))
        return bodies

    def travel(self, pose: Pose) -> tuple[Vector, Floats, Floats]:
        """Of the working part: a vector that tells its place (m), the derivative of its way (m/rad), and its lever.

        The vector is its direction about the fixed pivot and the lever (m) its distance from it; along a guide the
        vector's x is the coordinate, and the lever is 0.
        """
        name, nothing = self.choice.working, np.zeros((1, 1, 1))
        if self.working_link is None:
            return Vector(nothing, nothing), nothing, nothing
        if self.working_link == FRAME:
            slide, slide1, _ = pose.groups[name].slide
            return Vector(self._sign * slide, nothing), np.asarray(self._sign * slide1), nothing
        link = pose.links[self.working_link]
        arm = pose.joints[name].at - link.base.at
        lever = np.sqrt(arm.square)
        return arm, np.asarray(self._sign * lever * link.turn1), lever

    def _travelled(self, values: Values, pose: Pose) -> Floats:
        """Way of the working part from the start of its forward stroke."""
        stroke = values if _START in values or self.working_link is None else self.prepared(values)
        place, _, lever = self.travel(pose)
        if self.working_link is None:
            return place.x
        home = Vector(*(stroke[name] for name in _HOME))
        if self.working_link == FRAME:
            return np.asarray(place.x - home.x)
        # From half a turn before the middle of the arc to half a turn behind it.
        least = 0.5 * stroke[_SWING] - np.pi
        return np.asarray(lever * (np.mod(self._turned(home, place) - least, _TURN) + least))

    def _turned(self, home: Vector, place: Vector) -> Floats:
        """Angle from one direction of the working part to another along its forward stroke, up to whole turns."""
        return np.asarray(self._sign * elementary.arctan2(home.cross(place), home.scalar(place)))

    def motion(self, values: Values, phi: Floats) -> Motion:
        """See Mechanism."""
        pose = self.pose(values, phi)
        with np.errstate(invalid="ignore", divide="ignore"):
            inertia, slope = reduced(self.bodies(values, pose))
            return Motion(inertia, slope, self._travelled(values, pose), self.travel(pose)[1])

    def way(self, values: Values, phi: Floats) -> Floats:
        """See Mechanism."""
        return self._travelled(values, self.pose(values, phi))

    def lift(self, values: Values, phi: Floats) -> Floats:
        """See Mechanism; the x axis rises by ``inclination``."""
        total: Floats = np.zeros(1)
        rise, level = elementary.sin(values["inclination"]), elementary.cos(values["inclination"])
        for body in self.bodies(values, self.pose(values, phi)):
            total = total + body.mass * (rise * body.x1 + level * body.y1)
        return total

    def prepared(self, values: Values) -> dict[str, Floats]:
        """Ends of the forward stroke, its place and arc, the reversals in a turn, and where there are too many."""
        if self.working_link is None:
            return {}
        if _START in values:
            return {name: values[name] for name in (_START, _END, *_HOME, _SWING, _COUNT, _SURPLUS)}
        cases = max(len(value) for value in values.values())
        grid: Floats = np.asarray(_TURN / _ANGLES * np.arange(_ANGLES + 1), dtype=np.float64)
        grid_slope = self.travel(self.pose(values, grid[None, None, :]))[1]
        slope = np.broadcast_to(grid_slope, (cases, 1, _ANGLES + 1))[:, 0, :].copy()
        # A turn ends as it begins, without the rounding of its angle.
        slope[:, -1] = slope[:, 0]
        case, left = np.nonzero((slope[:, :-1] >= 0.0) != (slope[:, 1:] >= 0.0))
        picked = {name: value[case] if len(value) > 1 else value for name, value in values.items()}

        def slopes(angles: Floats) -> Floats:
            found = self.travel(self.pose(picked, angles[:, None, None]))[1]
            return np.asarray(np.broadcast_to(found, (len(angles), 1, 1))[:, 0, 0])

        ends = slope[case, left], slope[case, left + 1]
        angle = bracketed_roots(slopes, grid[left], grid[left + 1], *ends) if case.size else np.zeros(0)
        known = np.isfinite(slope).all(axis=1)
        count = np.where(known, np.bincount(case, minlength=cases), 2).astype(np.float64)
        forward = ends[0] < 0.0
        start, end, surplus = (np.full(cases, np.nan) for _ in range(3))
        # Reversed, so that of several the first one stays.
        for at, chosen in ((start, forward), (end, ~forward)):
            at[case[chosen][::-1]] = angle[chosen][::-1]
        order = np.arange(len(case)) - np.searchsorted(case, case)
        surplus[case[order == 2]] = angle[order == 2]
        surplus[known & (count < 2.0)] = 0.0
        stroke = {_START: start, _END: end, _COUNT: count, _SURPLUS: surplus}
        shaped = {name: value.reshape(-1, 1, 1) for name, value in stroke.items()}
        with np.errstate(invalid="ignore", divide="ignore"):
            home = self.travel(self.pose(values, shaped[_START]))[0]
        shaped |= zip(_HOME, (home.x, home.y), strict=True)
        return shaped | {_SWING: self._swing(values, home, shaped[_END])}

    def _swing(self, values: Values, home: Vector, end: Floats) -> Floats:
        """Angle of the arc from ``home`` to an angle of the crank, less than a turn; 0 for a part on a guide."""
        if self.working_link == FRAME:
            return np.zeros_like(end)
        with np.errstate(invalid="ignore", divide="ignore"):
            place = self.travel(self.pose(values, end))[0]
            return np.asarray(np.mod(self._turned(home, place), _TURN))

    def dead_centres(self, values: Values) -> tuple[Floats, Floats]:
        """See Mechanism; half a turn apart where nothing works."""
        if self.working_link is None:
            return np.zeros_like(values["crank"]), np.full_like(values["crank"], np.pi)
        ends = values if _START in values else self.prepared(values)
        return ends[_START], ends[_END]

    def _slacks(self, values: Values, phi: Floats) -> list[Slack]:
        groups = self.pose(values, phi).groups.values()
        return [joined.slack for joined in groups]

    def margin(self, values: Values, phi: Floats) -> Floats:
        """See Mechanism; of the first group that does not meet, or else the least."""
        least: Floats = np.full(np.broadcast_shapes(values["crank"].shape, phi.shape), np.inf)
        with np.errstate(invalid="ignore", divide="ignore"):
            for slack in self._slacks(values, phi):
                # What hangs on a group that does not meet has no place: NaN, which fmin passes over.
                least = np.fmin(least, slack.value / slack.size)
        return least

    def worst_angles(self, values: Values) -> Sequence[Floats]:
        """See Mechanism; the least margins of a turn, narrowed between angles that are a degree apart."""
        cases = max(len(value) for value in values.values())
        grid: Floats = np.asarray(_TURN / _ANGLES * np.arange(_ANGLES), dtype=np.float64)
        margin = np.broadcast_to(self.margin(values, grid[None, None, :]), (cases, 1, _ANGLES))[:, 0, :]
        low = (margin <= np.roll(margin, 1, axis=1)) & (margin < np.roll(margin, -1, axis=1))
        low[np.arange(cases), np.argmin(margin, axis=1)] = True
        case, at = np.nonzero(low)
        picked = {name: value[case] if len(value) > 1 else value for name, value in values.items()}

        def margins(angles: Floats) -> Floats:
            found = self.margin(picked, angles[:, None, None])
            return np.asarray(np.broadcast_to(found, (len(angles), 1, 1))[:, 0, 0])

        narrowed = _least(margins, grid[at] - _TURN / _ANGLES, grid[at] + _TURN / _ANGLES)
        worst = np.broadcast_to(grid[np.argmin(margin, axis=1)][:, None], (cases, _MOST)).copy()
        order = np.arange(len(case)) - np.searchsorted(case, case)
        kept = order < _MOST
        worst[case[kept], order[kept]] = narrowed[kept]
        return [worst[:, k].reshape(-1, 1, 1) for k in range(min(_MOST, int(order.max()) + 1))]

    def unassembled(self, values: Values, ahead: Floats | None = None) -> Floats:
        """See Mechanism; a working part that does not go to and fro exactly once in a turn is refused, too."""
        angle = super().unassembled(values, ahead)
        if self.working_link is None:
            return angle
        surplus = self.prepared(values)[_SURPLUS][:, 0, 0]
        turned = 0.0 if ahead is None else ahead[:, 0, 0]
        wrong = np.where(np.isnan(surplus), np.nan, np.mod(surplus - turned, _TURN))
        return np.where(np.isnan(angle), wrong, angle)

    def broken_rule(self, values: Values) -> Sentence | None:
        """See Mechanism; which group does not meet and how much is missing, or how often the working part reverses."""
        first = {name: value[:1] for name, value in values.items()}
        angle = float(super().unassembled(first)[0])
        if np.isnan(angle):
            return self._reversal_rule(first)
        pose = self.pose(first, np.full((1, 1, 1), angle))
        for index, each in enumerate(self.choice.elements):
            if each.name not in pose.groups:
                continue
            slack, size = (float(np.asarray(part).flat[0]) for part in pose.groups[each.name].slack)
            if not slack > 1e-12 * size:
                return _limit(each, numbers_of_element(first, index), pose, size, self._deepest(first, index))
        return None

    def _deepest(self, values: Values, index: int) -> float:
        """The least slack of a group in a turn, as far as it has a place, in m."""
        phi = (_TURN / _ANGLES * np.arange(_ANGLES))[None, None, :]
        angles = np.concatenate([phi, *self.worst_angles(values)], axis=2)
        slack = self.pose(values, angles).groups[self.choice.elements[index].name].slack.value
        return float(np.nanmin(slack))

    def _reversal_rule(self, values: Values) -> Sentence | None:
        if self.working_link is None:
            return None
        count, name = int(self.prepared(values)[_COUNT].flat[0]), self.choice.working
        if count < 2:
            return Sentence("the working part {name} turns fully or stands still, and has no stroke", name=name)
        if count > 2:
            return Sentence(
                "the working part {name} reverses {count} times in a turn, and a stroke goes to and fro once",
                name=name, count=str(count),
            )  # fmt: skip
        return None


def _least(function: Callable[[Floats], Floats], low: Floats, high: Floats) -> Floats:
    """Where ``function`` is least between ``low`` and ``high``, elementwise, by golden sections."""
    share = 0.5 * (np.sqrt(5.0) - 1.0)
    inner, outer = high - share * (high - low), low + share * (high - low)
    at_inner, at_outer = function(inner), function(outer)
    for _ in range(_NARROWINGS):
        left = at_inner <= at_outer
        low, high = np.where(left, low, inner), np.where(left, outer, high)
        fresh = np.where(left, high - share * (high - low), low + share * (high - low))
        value = function(fresh)
        inner, outer = np.where(left, fresh, outer), np.where(left, inner, fresh)
        at_inner, at_outer = np.where(left, value, at_outer), np.where(left, at_inner, value)
    return np.asarray(np.where(at_inner <= at_outer, inner, outer))


def _limit(each: Element, v: Mapping[str, Floats], pose: Pose, size: float, deepest: float) -> Sentence:
    """Why a group does not meet, as a clause; ``deepest`` is its least slack in a turn, in m."""
    lengths = {name: amount(float(v[name].flat[0]), "m") for name in ("first", "second") if name in v}
    group = Sentence("the group {name}", name=each.name)
    touching, missing = abs(deepest) <= _TOUCHING * size, amount(-deepest, "m")
    if each.kind == "RRR":
        if touching:
            return Sentence(
                "the links of {group} lie in one line there, and their joint could go on to either side", group=group
            )
        p, q = (pose.joints[name].at for name in each.joints)
        distance = float(np.sqrt((q - p).square).flat[0])
        far = distance > max(float(v["first"].flat[0]), float(v["second"].flat[0]))
        start, end = each.joints
        about: dict[str, Part] = {"group": group, **lengths, "start": start, "end": end, "missing": missing}
        if far:
            return Sentence(
                "the links of {group} ({first} and {second}) are too short to go from {start} to {end}: up to "
                "{missing} are missing in the turn",
                **about,
            )
        return Sentence(
            "the links of {group} ({first} and {second}) differ too much for {start} and {end}, which come too near to "
            "each other: up to {missing} are missing in the turn",
            **about,
        )
    if each.kind == "RRP":
        if touching:
            return Sentence("the link of {group} is across its guide there, and could go on either way", group=group)
        return Sentence(
            "the link of {group} ({first}) does not reach its guide: up to {missing} are missing in the turn",
            group=group, **lengths, missing=missing,
        )  # fmt: skip
    start, end = each.joints
    if each.kind == "RPR":
        return Sentence(
            "{start} comes nearer to {end} than the line of the bar of {group} passes it, so that the bar has no "
            "direction there",
            start=start, end=end, group=group,
        )  # fmt: skip
    return Sentence("the two lines along which {group} slides are parallel there", group=group)
