"""Mechanisms reduced to the main shaft: an inertia that depends on the angle, and the travel of the working part.

For angles of the shaft, each mechanism returns the kinetic energy of its bodies as a reduced inertia I''(phi) with its
derivative, and the travel x of its working part (ram, rocker pin, follower) from the start of the forward stroke, with
dx/dphi: the factor that converts a force on the working part to a torque on the shaft.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine import elementary
from sprag_study.sentences import Sentence

Floats = NDArray[np.float64]
#: Values of parameters by their name within the mechanism; each of shape (cases or 1, 1, 1).
Values = Mapping[str, Floats]

_SCAN = 3_600


def number_of(values: Values, name: str) -> float:
    """A value of the first case."""
    return float(values[name].flat[0])


class Body(NamedTuple):
    """A body in plane motion: first and second derivatives of its centre and angle with respect to the shaft's
    angle.
    """

    mass: Floats
    inertia: Floats
    x1: Floats
    y1: Floats
    turn1: Floats
    x2: Floats
    y2: Floats
    turn2: Floats


@dataclass(frozen=True, slots=True)
class Motion:
    """A mechanism at angles of the shaft; all arrays broadcast to the angles' shape.

    Attributes
    ----------
    inertia, inertia_slope : arrays
        I'' in kg*m^2 and dI''/dphi.
    way, way_slope : arrays
        Travel of the working part from the start of its forward stroke, in m, and its derivative, in m/rad.
    """

    inertia: Floats
    inertia_slope: Floats
    way: Floats
    way_slope: Floats


def reduced(bodies: Sequence[Body]) -> tuple[Floats, Floats]:
    """Reduced inertia sum(m v^2 + J w^2)/omega^2 of the bodies and its derivative by the angle."""
    inertia: Floats = np.zeros(1)
    slope: Floats = np.zeros(1)
    for b in bodies:
        inertia = inertia + b.mass * (np.square(b.x1) + np.square(b.y1)) + b.inertia * np.square(b.turn1)
        slope = slope + 2.0 * (b.mass * (b.x1 * b.x2 + b.y1 * b.y2) + b.inertia * b.turn1 * b.turn2)
    return inertia, slope


def lifted(bodies: Sequence[Body], forward: Floats, turned: Floats | float = 0.0, *, outward: float = 1.0) -> Floats:
    """Sum of m dh/dphi of bodies whose x, turned by ``turned``, is that of a ram.

    Parameters
    ----------
    bodies : sequence of Body
    forward : array
        Angle at which the forward stroke rises, in rad.
    turned : array or float
        Angle from the ram's x to that of the bodies, in rad.
    outward : float
        1 where the forward stroke is along the ram's x, -1 where it is against it.
    """
    total: Floats = np.zeros(1)
    cos, sin = elementary.cos(turned), elementary.sin(turned)
    for b in bodies:
        x1, y1 = b.x1 * cos - b.y1 * sin, b.y1 * cos + b.x1 * sin
        total = total + b.mass * (outward * elementary.sin(forward) * x1 + elementary.cos(forward) * y1)
    return total


class Mechanism(ABC):
    """Base of the mechanisms: one period is one revolution of the shaft."""

    #: Name of the parameter with the mass of the working part; None where its path is not straight.
    ram_mass: str | None = None
    #: Whether it has singular positions with unbounded motion nearby: links in line, a pivot on the crank's circle.
    has_singular_positions = True

    @abstractmethod
    def motion(self, values: Values, phi: Floats) -> Motion:
        """Inertia and travel at ``phi`` (rad)."""

    def way(self, values: Values, phi: Floats) -> Floats:
        """Travel of the working part alone, the same as that of ``motion``."""
        return self.motion(values, phi).way

    @abstractmethod
    def dead_centres(self, values: Values) -> tuple[Floats, Floats]:
        """Angles, of the parameters' shape, at which the forward stroke starts and ends (rad, any revolution)."""

    @abstractmethod
    def margin(self, values: Values, phi: Floats) -> Floats:
        """Positive where the mechanism can be assembled at ``phi``."""

    @abstractmethod
    def worst_angles(self, values: Values) -> Sequence[Floats]:
        """Angles of which one has the smallest margin."""

    def prepared(self, values: Values) -> Mapping[str, Floats]:
        """Further values that follow from those of the parameters alone, computed once for a block of cases."""
        del values
        return {}

    def breaks(self, values: Values) -> Sequence[Floats]:
        """Angles at which the inertia or the travel has a kink, of the parameters' shape."""
        del values
        return ()

    def return_stroke(self, values: Values) -> tuple[Floats, Floats] | tuple[None, None]:
        """Start and length of the return stroke, in rad; None where it is everything outside the forward stroke."""
        del values
        return None, None

    def broken_rule(self, values: Values) -> Sentence | None:
        """Why the dimensions of a case cannot be assembled, as a clause; None where links are merely too short."""
        del values
        return None

    def unassembled(self, values: Values, ahead: Floats | None = None) -> Floats:
        """First angle at which the mechanism cannot be assembled, in 0 .. 2 pi; NaN where it always can.

        Parameters
        ----------
        values : mapping
        ahead : array, shape (cases or 1, 1, 1), optional
            The mechanism's angle is the returned one plus this, in rad.

        Returns
        -------
        array, shape (cases or 1,)
        """
        with np.errstate(invalid="ignore", divide="ignore"):
            margins = [self.margin(values, angle) for angle in self.worst_angles(values)]
            least = np.minimum.reduce(np.broadcast_arrays(*margins))[:, 0, 0]
        if ahead is not None and len(least) == 1:
            least = np.broadcast_to(least, (len(ahead),))
        angle = np.full(len(least), np.nan)
        for case in np.nonzero(~(least > 1e-12))[0]:
            own = {name: value[case if len(value) > 1 else 0].reshape(1, 1, 1) for name, value in values.items()}
            turned = 0.0 if ahead is None else float(np.mod(ahead.flat[case if len(ahead) > 1 else 0], 2.0 * np.pi))
            angle[case] = self._first_failure(own, turned)
        return angle

    def _first_failure(self, values: Values, ahead: float) -> float:
        def fails(phi: Floats) -> NDArray[np.bool_]:
            with np.errstate(invalid="ignore", divide="ignore"):
                margin = self.margin(values, phi.reshape(1, 1, -1) + ahead)
            return np.asarray(~np.broadcast_to(margin > 1e-12, (1, 1, phi.size))[0, 0])

        worst = [float(np.mod(angle[0, 0, 0] - ahead, 2.0 * np.pi)) for angle in self.worst_angles(values)]
        grid = np.unique(np.concatenate([np.linspace(0.0, 2.0 * np.pi, _SCAN + 1), np.array(worst)]))
        failing = fails(grid)
        first = int(np.argmax(failing)) if failing.any() else 0
        if first == 0:
            return float(grid[first])
        good, bad = grid[first - 1], grid[first]
        for _ in range(50):
            middle = 0.5 * (good + bad)
            good, bad = (good, middle) if fails(np.array([middle]))[0] else (middle, bad)
        return float(bad)


class RodMechanism(Mechanism):
    """Base of the mechanisms with a rod or a coupler, which can have a weight beside that of the working part."""

    @abstractmethod
    def lift(self, values: Values, phi: Floats) -> Floats:
        """Sum of m dh/dphi over all bodies with their heights h, in kg*m."""


class HarmonicMechanism(Mechanism):
    """Base of the mechanisms whose working part moves as the projection of the crank's pin: any crank will do."""

    has_singular_positions = False

    @abstractmethod
    def inertia(self, values: Values, phi: Floats) -> tuple[Floats, Floats]:
        """Inertia and its slope at ``phi``; see Motion."""

    def motion(self, values: Values, phi: Floats) -> Motion:
        """See Mechanism."""
        r = values["crank"]
        return Motion(*self.inertia(values, phi), r * (1.0 - elementary.cos(phi)), r * elementary.sin(phi))

    def dead_centres(self, values: Values) -> tuple[Floats, Floats]:
        """See Mechanism."""
        return np.zeros_like(values["crank"]), np.full_like(values["crank"], np.pi)

    def margin(self, values: Values, phi: Floats) -> Floats:
        """See Mechanism; any crank can be assembled."""
        return np.ones(np.broadcast_shapes(values["crank"].shape, phi.shape))

    def worst_angles(self, values: Values) -> Sequence[Floats]:
        """See Mechanism."""
        return (np.zeros_like(values["crank"]),)
