"""Continuation by pseudo-arclength (Keller): step along the tangent, correct in the plane normal to it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from sprag_study.engine.continuation.corrector import DISTURBANCE, Corrector, Node
from sprag_study.engine.continuation.linear import dot
from sprag_study.engine.continuation.locate import Between
from sprag_study.engine.continuation.problem import Branch, Contact, End, Kind, Point, Special, differences

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.engine.continuation.problem import Floats, ReturnMap

#: Cosine of the largest angle between the tangents of neighbouring points on a smooth part of a branch.
_STRAIGHT = 0.95
#: Step below which a change of pattern excuses a larger angle.
_CORNER = 1e-3
#: How far beyond the last point a pattern is looked for that explains why the branch ends there.
_BEYOND = (1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3)
#: A fold closer than this to itself after half a turn is where the period doubles, and an orbit closer than the second
#: number has half the order and is on another branch.
_HALVED, _OTHER = 1e-3, 1e-5
#: Points after which a branch may close.
_CLOSES_AFTER = 8


@dataclass(frozen=True, slots=True)
class Range:
    """How far and in which steps a branch is followed.

    Attributes
    ----------
    low, high : float
        Range of the parameter. Its length counts as 1 in arc lengths.
    first, most, least : float
        Arc length of the first step, of the longest and of the shortest one.
    max_points : int
        Most steps in each direction.
    """

    low: float
    high: float
    first: float = 0.01
    most: float = 0.04
    least: float = 1e-9
    max_points: int = 400


@dataclass(slots=True)
class _Walk:
    """One direction of a branch, with its points and special points so far."""

    corrector: Corrector
    range: Range
    start: Node
    nodes: list[Node] = field(default_factory=list)
    specials: list[tuple[Kind, int, Node, tuple[Contact, ...]]] = field(default_factory=list)
    _size: float = 0.0

    def run(self) -> End:
        """Follow the branch; why it ends."""
        node, self._size = self.start, self.range.first
        for number in range(self.range.max_points):
            new, last = self._next(node)
            if new is None:
                found = self._around(node)
                if isinstance(found, End):
                    return found
                node = found
                continue
            if self._add(node, new):
                return End.HALVED
            if last:
                return End.RANGE
            if number >= _CLOSES_AFTER and self._closes(node, new):
                return End.CLOSED
            moved = self.corrector.transported(new)
            node = new if moved is None else moved
        return End.LIMIT

    def _next(self, node: Node) -> tuple[Node | None, bool]:
        """The next point, and whether it is at the end of the range; None where no step leads on."""
        low, high = self.range.low / self.corrector.scale, self.range.high / self.corrector.scale
        while self._size >= self.range.least:
            new = self.corrector.correct(node.map, node.at(self._size), node.tangent)
            last = False
            if new is not None and not low <= new.z[-1] <= high:
                new, last = self._at_bound(node, new, high if new.z[-1] > high else low), True
            if new is not None and self._follows(node, new):
                self._size = min(self.range.most, 1.5 * self._size)
                return new, last
            self._size *= 0.5
        return None, False

    def _at_bound(self, node: Node, new: Node, bound: float) -> Node | None:
        """The point at a bound of the range, between two."""
        share = (bound - node.z[-1]) / (new.z[-1] - node.z[-1])
        guess = [a + share * (b - a) for a, b in zip(node.z, new.z, strict=True)]
        guess[-1] = bound
        border = [0.0] * len(guess)
        border[-1] = 1.0 if new.z[-1] > node.z[-1] else -1.0
        return self.corrector.correct(node.map, guess, border)

    def _follows(self, node: Node, new: Node) -> bool:
        """Whether a point is the next one of the same branch, as far as its tangent shows."""
        if node.along(new.z) <= 0.0 or self._halved(new) < _OTHER:
            return False
        if dot(node.tangent, new.tangent) > _STRAIGHT:
            return True
        return node.pattern != new.pattern and self._size < _CORNER

    def _add(self, node: Node, new: Node) -> bool:
        """Add the points after ``node`` up to ``new``, with the special ones; whether the branch ends before."""
        if node.pattern != new.pattern:
            pair = Between(self.corrector, node, new).grazing()
            if pair is not None:
                before, after = pair
                if before is not node and self._add_smooth(node, before):
                    return True
                contacts = differences(before.pattern, after.pattern)
                self.specials.append((Kind.GRAZING, len(self.nodes) - 1, before, contacts))
                if after is new:
                    self.nodes.append(new)
                    return False
                self.nodes.append(after)
                return self._add(after, new) if after.along(new.z) > 0.0 else self._add_smooth(after, new)
        return self._add_smooth(node, new)

    def _add_smooth(self, node: Node, new: Node) -> bool:
        for kind, special in Between(self.corrector, node, new).specials():
            self.nodes.append(special)
            halved = kind == Kind.FOLD and self._halved(special) < _HALVED
            self.specials.append((Kind.DOUBLING if halved else kind, len(self.nodes) - 1, special, ()))
            if halved:
                return True
        self.nodes.append(new)
        return False

    def _halved(self, node: Node) -> float:
        """Distance of an orbit from itself after half a turn."""
        return node.map.half(np.array(node.z[:-1]), node.z[-1] * self.corrector.scale)

    def _closes(self, node: Node, new: Node) -> bool:
        """Whether the branch has come back to its start."""
        start = self.start
        if start.map is not new.map or node.map is not new.map or start.pattern != new.pattern:
            return False
        passed = start.along(node.z) < 0.0 <= start.along(new.z)
        return passed and max(abs(a - b) for a, b in zip(start.z, new.z, strict=True)) < 2.0 * self.range.most

    def _around(self, node: Node) -> Node | End:
        """A point beyond a grazing at which the branch turns back or bends sharply; otherwise why it ends."""
        for size in _BEYOND:
            beyond = node.at(size)
            pattern = node.map.pattern(np.array(beyond[:-1]), beyond[-1] * self.corrector.scale)
            if pattern == node.pattern:
                continue
            self.specials.append((Kind.GRAZING, len(self.nodes) - 1, node, differences(node.pattern, pattern)))
            # The disturbed points must all lie beyond, too.
            inside = node.at(size + 10.0 * DISTURBANCE)
            tangent = self.corrector.tangent_at(node.map, inside, node.tangent)
            if tangent is None:
                return End.GRAZING
            for sign in (1.0, -1.0):
                direction = [sign * part for part in tangent]
                for step in (1e-5, 1e-4, 1e-3):
                    guess = [a + step * b for a, b in zip(node.z, direction, strict=True)]
                    new = self.corrector.correct(node.map, guess, direction)
                    if new is not None and new.pattern == pattern:
                        self.nodes.append(new)
                        self._size = self.range.first * 0.1
                        return new
            return End.GRAZING
        return End.LOST


def follow(map_: ReturnMap, point: Sequence[float], parameter: float, along: Range) -> Branch:
    """The branch of fixed points through one of them, in both directions.

    Parameters
    ----------
    map_ : ReturnMap
    point : sequence of float, shape (n,)
        A fixed point, or a point near one.
    parameter : float
        Value of the parameter there.
    along : Range

    Raises
    ------
    ValueError
        If the range is empty, the parameter is not in it, or there is no fixed point near ``point``.
    """
    if not along.low <= parameter <= along.high or not along.low < along.high:
        raise ValueError(f"the parameter {parameter:g} must be within {along.low:g} .. {along.high:g}")
    scale = along.high - along.low
    corrector = Corrector(scale)
    border = [*[0.0] * len(point), 1.0]
    begin = corrector.correct(map_, [*point, parameter / scale], border)
    if begin is None:
        raise ValueError(f"there is no fixed point near the given one at {parameter:g}")
    start = corrector.transported(begin) or begin
    up = _Walk(corrector, along, start)
    back = [-part for part in start.tangent]
    down = _Walk(corrector, along, Node(start.map, start.z, back, start.multipliers, start.residual, start.pattern))
    end_up = up.run() if parameter < along.high else End.RANGE
    end_down = End.CLOSED if end_up == End.CLOSED else down.run() if parameter > along.low else End.RANGE
    return _joined(down, start, up, (end_down, end_up), (along.low, along.high, parameter))


def _joined(down: _Walk, start: Node, up: _Walk, ends: tuple[End, End], given: tuple[float, float, float]) -> Branch:
    """The branch; ``given`` has the ends of its range and the parameter of the first orbit, which it has exactly."""
    nodes = [*reversed(down.nodes), start, *up.nodes]
    at = len(down.nodes)
    scale = up.corrector.scale
    found = []
    for kind, index, node, contacts in reversed(down.specials):
        turned = tuple(Contact(one.part, one.state, one.after, one.before) for one in contacts)
        # Its last point before a grazing is the one after it in the other direction.
        place = at - 1 - index - (1 if kind == Kind.GRAZING and index + 1 < len(down.nodes) else 0)
        found.append(Special(kind, node.z[-1] * scale, place, node.multipliers, turned))
    for kind, index, node, contacts in up.specials:
        found.append(Special(kind, node.z[-1] * scale, at + 1 + index, node.multipliers, contacts))
    return Branch(tuple(_point(node, scale, given) for node in nodes), tuple(found), ends, at)


def _point(node: Node, scale: float, given: tuple[float, float, float]) -> Point:
    state: Floats = node.map.state(np.array(node.z[:-1]))
    parameter = node.z[-1] * scale
    # Scaling rounds.
    exact = next((value for value in given if abs(parameter - value) <= 4.0 * math.ulp(value)), parameter)
    return Point(state, exact, node.multipliers, node.residual)
