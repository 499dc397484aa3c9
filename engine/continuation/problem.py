"""The return map whose fixed points are followed, and what is found about a branch of them."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
#: For each part of the machine, the discrete states that it goes through in one turn of the orbit, from a canonical
#: begin on.
Pattern = Mapping[str, tuple[str, ...]]
#: Error of a multiplier.
_ROUNDING = 1e-8


class ReturnMap(Protocol):
    """A return map that depends on one parameter, in scaled coordinates (all of order 1)."""

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest value of the parameter at which the map exists."""

    def images(self, points: Floats, parameters: Floats) -> Floats:
        """Images of points.

        Parameters
        ----------
        points : array, shape (m, n)
        parameters : array, shape (m,)

        Returns
        -------
        array, shape (m, n)
            NaN in the rows of points that have no image in this section.
        """

    def pattern(self, point: Floats, parameter: float) -> Pattern:
        """The discrete states of the turn that begins at a point, shape (n,)."""

    def moved(self, points: Floats, parameters: Floats) -> "tuple[ReturnMap, Floats] | None":
        """The map in a better section, and the same orbits there, shape (3, k); None where the present one is good.

        Called with a point of a branch (row 0) and two points near it, shapes (3, n) and (3,). A map without events
        always returns None.
        """

    def half(self, point: Floats, parameter: float) -> float:
        """Distance between a point and its image after half a turn; infinite where the order is odd."""

    def state(self, point: Floats) -> Floats:
        """What is kept of a point, shape (k,): unlike the point it says in which section it is."""


class Kind(StrEnum):
    """Special points of a branch."""

    #: The branch turns back: a multiplier passes +1.
    FOLD = "fold"
    #: A multiplier passes -1: a branch of twice the order begins here.
    DOUBLING = "doubling"
    #: A complex pair of multipliers passes the unit circle (Neimark-Sacker).
    TORUS = "torus"
    #: A multiplier passes +1 and the branch does not turn back: another branch crosses it.
    BRANCHING = "branching"
    #: An event appears or disappears: the map is not smooth here.
    GRAZING = "grazing"

    @property
    def sentence(self) -> str:
        """Description for users."""
        return _SENTENCES[self]


_SENTENCES = {
    Kind.FOLD: "The branch turns back: a multiplier passes +1.",
    Kind.DOUBLING: "A multiplier passes -1: a branch of twice the order begins or ends here.",
    Kind.TORUS: "A complex pair of multipliers passes the unit circle: quasi-periodic motion begins here.",
    Kind.BRANCHING: "A multiplier passes +1: another branch crosses this one.",
    Kind.GRAZING: "A contact grazes: an event appears or disappears, and the branch may bend, turn back or end.",
}


class End(StrEnum):
    """Why a branch ends."""

    RANGE = "range"
    CLOSED = "closed"
    GRAZING = "grazing"
    HALVED = "halved"
    LOST = "lost"
    LIMIT = "limit"

    @property
    def sentence(self) -> str:
        """Description for users."""
        return _ENDS[self]


_ENDS = {
    End.RANGE: "the end of the range",
    End.CLOSED: "the branch returns to its start",
    End.GRAZING: "a contact grazes, and the orbit does not continue beyond it",
    End.HALVED: "the orbit has half the order there, where its period doubles",
    End.LOST: "the orbit cannot be followed any further",
    End.LIMIT: "the largest number of points",
}


@dataclass(frozen=True, slots=True)
class Contact:
    """What differs on the two sides of a grazing: how often a part is in a state in one turn, before and after."""

    part: str
    state: str
    before: int
    after: int


@dataclass(frozen=True, slots=True)
class Special:
    """A special point of a branch.

    Attributes
    ----------
    kind : Kind
    parameter : float
        Where it is located, to about 1e-9 of the range.
    index : int
        Its place among the points of the branch; of a grazing, the last point before it.
    multipliers : tuple of complex
        Those at the point, largest modulus first.
    contacts : tuple of Contact
        Of a grazing.
    """

    kind: Kind
    parameter: float
    index: int
    multipliers: tuple[complex, ...]
    contacts: tuple[Contact, ...] = ()


@dataclass(frozen=True, slots=True)
class Point:
    """One orbit of a branch: a fixed point of the map.

    Attributes
    ----------
    state : array, shape (k,)
        From ``ReturnMap.state``.
    parameter : float
    multipliers : tuple of complex
        All Floquet multipliers, largest modulus first.
    residual : float
        Largest scaled distance between the point and its image.
    """

    state: Floats
    parameter: float
    multipliers: tuple[complex, ...]
    residual: float

    @property
    def multiplier(self) -> float:
        """Largest modulus of the multipliers; 0 where there is none."""
        return abs(self.multipliers[0]) if self.multipliers else 0.0

    @property
    def stable(self) -> bool:
        """Whether disturbances die away: every multiplier is below 1 in modulus, and not 1 to rounding."""
        return self.multiplier < 1.0 - _ROUNDING


@dataclass(frozen=True, slots=True)
class Branch:
    """A branch of orbits.

    Attributes
    ----------
    points : tuple of Point
        In order along the branch.
    specials : tuple of Special
        In order; folds, doublings and the like are points of the branch themselves, where their multiplier is 1 in
        modulus to rounding.
    ends : tuple of two End
        Why the branch ends before its first point, and after its last one.
    start : int
        Place of the orbit from which it was followed.
    """

    points: tuple[Point, ...]
    specials: tuple[Special, ...]
    ends: tuple[End, End]
    start: int


def differences(before: Pattern, after: Pattern) -> tuple[Contact, ...]:
    """What differs between two patterns: the states of each part that it is in more or less often."""
    found = []
    for part in dict.fromkeys((*before, *after)):
        one, other = before.get(part, ()), after.get(part, ())
        if one == other:
            continue
        states = dict.fromkeys((*one, *other))
        counts = [Contact(part, state, one.count(state), other.count(state)) for state in states]
        changed = [count for count in counts if count.before != count.after]
        found += changed or counts
    return tuple(found)
