"""Four-bar linkages: kinematics, the crank-rocker and parallel cranks."""

from collections.abc import Mapping, Sequence
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine import elementary
from sprag_study.engine.machine_shaft.mechanisms import (
    Body,
    HarmonicMechanism,
    Motion,
    RodMechanism,
    Values,
    lifted,
    number_of,
    reduced,
)
from sprag_study.engine.machine_shaft.problems import amount
from sprag_study.sentences import Sentence

Floats = NDArray[np.float64]


class Links:
    """Crank, coupler and a third link at angles of the crank, counted from the frame: the pin is on the left of it.

    ``a``, ``b``, ``c``, ``d`` are the lengths of crank, coupler, third link and frame. ``psi`` is the angle of the
    third link from its pivot, ``theta`` that of the coupler from the crank pin, ``cos_gamma`` the cosine of the angle
    at the pivot between crank pin and third link: beyond -1 .. 1 the links do not reach each other.
    """

    def __init__(self, a: Floats, b: Floats, c: Floats, d: Floats, phi: Floats) -> None:
        self.a, self.b, self.c, self.phi = a, b, c, phi
        x, y = a * elementary.cos(phi) - d, a * elementary.sin(phi)
        reach = np.sqrt(np.square(x) + np.square(y))
        self.cos_gamma = (np.square(c) + np.square(reach) - np.square(b)) / (2.0 * c * reach)
        with np.errstate(invalid="ignore"):
            self.psi = np.pi + elementary.arctan2(-y, -x) - elementary.arccos(self.cos_gamma)
        self.theta = elementary.arctan2(c * elementary.sin(self.psi) - y, c * elementary.cos(self.psi) - x)

    @classmethod
    def of(cls, values: Values, phi: Floats, third: str = "rocker") -> "Links":
        """Those of the parameters ``crank``, ``coupler``, ``third`` and ``frame``."""
        return cls(values["crank"], values["coupler"], values[third], values["frame"], phi)

    def turning(self) -> tuple[Floats, Floats, Floats, Floats]:
        """First derivatives of ``psi`` and ``theta`` by the crank's angle, and second ones."""
        a, b, c, phi, psi, theta = self.a, self.b, self.c, self.phi, self.psi, self.theta
        turn = elementary.sin(psi - theta)
        with np.errstate(invalid="ignore", divide="ignore"):
            psi1 = a * elementary.sin(phi - theta) / (c * turn)
            theta1 = a * elementary.sin(phi - psi) / (b * turn)
            across = elementary.cos(psi - theta)
            psi2 = (a * elementary.cos(phi - theta) + b * np.square(theta1) - c * np.square(psi1) * across) / (c * turn)
            theta2 = (a * elementary.cos(phi - psi) + b * np.square(theta1) * across - c * np.square(psi1)) / (b * turn)
        return psi1, theta1, psi2, theta2

    def coupler(self, values: Values, theta1: Floats, theta2: Floats) -> Body:
        """The coupler, with its centre at ``coupler_centre`` from the crank pin."""
        a, s, phi = self.a, values["coupler_centre"], self.phi
        sin, cos = elementary.sin(self.theta), elementary.cos(self.theta)
        return Body(
            values["coupler_mass"],
            values["coupler_inertia"],
            -a * elementary.sin(phi) - s * sin * theta1,
            a * elementary.cos(phi) + s * cos * theta1,
            theta1,
            -a * elementary.cos(phi) - s * (cos * np.square(theta1) + sin * theta2),
            -a * elementary.sin(phi) - s * (sin * np.square(theta1) - cos * theta2),
            theta2,
        )


def swinging(inertia: Floats, turn1: Floats, turn2: Floats) -> Body:
    """A link that turns about a fixed pivot, with its inertia about that."""
    zero = np.zeros((1, 1, 1))
    return Body(zero, inertia, zero, zero, turn1, zero, zero, turn2)


def crank_at(distance: Floats, values: Values) -> Floats:
    """Angle between frame and crank, or its extension, at which the rocker's pin is ``distance`` from the shaft."""
    c, d = values["rocker"], values["frame"]
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(elementary.arccos((np.square(d) + np.square(distance) - np.square(c)) / (2.0 * d * distance)))


def rocker_dead_centres(values: Values) -> tuple[Floats, Floats]:
    """Angles of the crank at which the rocker of a crank-rocker is nearest to the shaft, and farthest."""
    a, b = values["crank"], values["coupler"]
    return np.pi + crank_at(b - a, values), crank_at(b + a, values)


def rocking(values: Values) -> Floats:
    """Positive where the crank is shorter than frame and coupler, so that the third link rocks."""
    return np.asarray((np.minimum(values["frame"], values["coupler"]) - values["crank"]) / values["frame"])


def crank_rocker_rule(values: Values) -> Sentence | None:
    """Why the links are not a crank-rocker, as a clause; None where they are merely too short."""
    sizes = {name: number_of(values, name) for name in ("crank", "coupler", "rocker", "frame")}
    crank, ordered = sizes["crank"], sorted(sizes.values())
    short = [name for name in ("frame", "coupler") if sizes[name] <= crank]
    spare = ordered[1] + ordered[2] - ordered[0] - ordered[3]
    pairs = np.isclose(crank, sizes["rocker"], rtol=1e-9) and np.isclose(sizes["frame"], sizes["coupler"], rtol=1e-9)
    hint = Sentence("; links that are equal in pairs are a parallel_crank") if pairs else Sentence("")
    if not short:
        if abs(spare) > 1e-9 * ordered[3]:
            return None
        return Sentence(
            "all its links lie in one line there, and the rocker could continue either way{hint}", hint=hint
        )
    if sizes["frame"] == ordered[0] and spare > 1e-9 * ordered[3]:
        hint = Sentence("; with the frame as the shortest link both links turn fully: a drag_link")
    return Sentence(
        "the crank ({crank}) of a crank-rocker must be shorter than {links}{hint}",
        crank=amount(crank, "m"),
        links=listed_links({name: sizes[name] for name in short}),
        hint=hint,
    )


def listed_links(lengths: Mapping[str, float]) -> Sentence:
    """Links with their lengths in m: ``the frame (0.5 m) and the coupler (0.4 m)``."""
    texts = {
        "frame": Sentence("the frame"),
        "crank": Sentence("the crank"),
        "coupler": Sentence("the coupler"),
        "follower": Sentence("the follower"),
    }
    links = (
        Sentence("{link} ({length})", link=texts[name], length=amount(length, "m")) for name, length in lengths.items()
    )
    return reduce(lambda before, link: Sentence("{before} and {link}", before=before, link=link), links)


class FourBar(RodMechanism):
    """Crank and rocker; the crank's angle is counted from the frame, towards the side on which the rocker's pin is.

    ``frame``, ``crank``, ``coupler``, ``rocker`` are lengths. The coupler's centre of mass is at ``coupler_centre``
    from the crank pin on the line of the pins; ``rocker_inertia`` is about the rocker's pivot; ``tray_mass`` hangs on
    the rocker's pin and moves along its arc without turning, as a conveyor's trough on parallel rockers does. The way
    is the arc of that pin; the forward stroke leads away from the crank.
    """

    def motion(self, values: Values, phi: Floats) -> Motion:
        """See Mechanism."""
        links, c = Links.of(values, phi), values["rocker"]
        psi1, theta1, psi2, theta2 = links.turning()
        carried = values["rocker_inertia"] + values["tray_mass"] * np.square(c)
        inertia, slope = reduced([links.coupler(values, theta1, theta2), swinging(carried, psi1, psi2)])
        start = Links.of(values, self.dead_centres(values)[0]).psi
        return Motion(inertia, slope, c * (start - links.psi), -c * psi1)

    def lift(self, values: Values, phi: Floats) -> Floats:
        """See Mechanism; the frame rises from the shaft to the rocker's pivot by the inclination."""
        links, c, zero = Links.of(values, phi), values["rocker"], np.zeros((1, 1, 1))
        psi1, theta1, _, theta2 = links.turning()
        x1, y1 = -c * elementary.sin(links.psi) * psi1, c * elementary.cos(links.psi) * psi1
        tray = Body(values["tray_mass"], zero, x1, y1, zero, zero, zero, zero)
        return lifted([links.coupler(values, theta1, theta2), tray], values["inclination"])

    def dead_centres(self, values: Values) -> tuple[Floats, Floats]:
        """See Mechanism."""
        return rocker_dead_centres(values)

    def margin(self, values: Values, phi: Floats) -> Floats:
        """See Mechanism."""
        return np.asarray(np.minimum(1.0 - np.abs(Links.of(values, phi).cos_gamma), rocking(values)))

    def broken_rule(self, values: Values) -> Sentence | None:
        """See Mechanism."""
        return crank_rocker_rule(values)

    def worst_angles(self, values: Values) -> Sequence[Floats]:
        """See Mechanism."""
        one = np.ones_like(values["crank"])
        return 0.0 * one, np.pi * one


class ParallelCrank(HarmonicMechanism):
    """A parallelogram: two equal cranks joined by a coupler as long as the frame, which moves without turning.

    Every point of the coupler goes round a circle of the crank's radius. Its travel is counted along the direction in
    which the crank points at 0, towards the near side: the forward stroke ends half a turn later. Where the cranks lie
    along the frame, a bare parallelogram could go over into an antiparallel one; guidance (a third crank, wheels,
    gears) is taken to prevent it. ``driven_inertia`` is that of the second crank about its pivot.
    """

    ram_mass = "coupler_mass"

    def inertia(self, values: Values, phi: Floats) -> tuple[Floats, Floats]:
        """See HarmonicMechanism; it is constant."""
        del phi
        return values["coupler_mass"] * np.square(values["crank"]) + values["driven_inertia"], np.zeros((1, 1, 1))
