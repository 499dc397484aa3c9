"""What a sketch of a mechanism is made of: joints, bars and plates at angles of the shaft.

Coordinates are in m, x to the right and y upwards, with the shaft at the origin; the crank turns counterclockwise.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine import elementary

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Bar:
    """A straight or angled link through joints; ``about`` are the names of the parameters that it stands for."""

    joints: tuple[str, ...]
    about: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Plate:
    """A closed outline, shape (k, 2), that goes with a joint and turns by the angle of that name, if any."""

    joint: str
    outline: Floats
    about: tuple[str, ...]
    turn: str = ""


@dataclass(slots=True)
class Sketch:
    """A mechanism at angles of the shaft.

    Attributes
    ----------
    joints : name -> array, shape (angles, 2)
    turns : name -> array, shape (angles,)
        In rad, counterclockwise.
    bars, plates : what moves
    pivots : names of the joints that are fixed
    guides : lines of shape (k, 2) along which something slides
    """

    joints: dict[str, Floats]
    turns: dict[str, Floats] = field(default_factory=dict)
    bars: list[Bar] = field(default_factory=list)
    plates: list[Plate] = field(default_factory=list)
    pivots: list[str] = field(default_factory=lambda: ["O"])
    guides: list[Floats] = field(default_factory=list)

    def turned(self, angle: float) -> "Sketch":
        """The sketch turned counterclockwise about the shaft."""
        joints = {name: _turned(points, angle) for name, points in self.joints.items()}
        # What slides without turning of its own turns with its guide.
        still = np.full(len(next(iter(joints.values()))), angle)
        turns = {"": still} | {name: values + angle for name, values in self.turns.items()}
        guides = [_turned(points, angle) for points in self.guides]
        return Sketch(joints, turns, self.bars, self.plates, self.pivots, guides)


def _turned(points: Floats, angle: float) -> Floats:
    """Points of shape (k, 2), turned counterclockwise about the origin."""
    x, y = points[:, 0], points[:, 1]
    cos, sin = elementary.cos(angle), elementary.sin(angle)
    return np.stack([x * cos - y * sin, x * sin + y * cos], axis=1)
