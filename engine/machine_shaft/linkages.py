"""Slider-crank, Scotch yoke and quick returns: kinematics and inertia from dimensions and masses."""

from collections.abc import Sequence

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
from sprag_study.engine.machine_shaft.sliders import (
    Slider,
    slider_bodies,
    slider_dead_centres,
    slider_fold,
    slider_margin,
)
from sprag_study.sentences import Sentence

Floats = NDArray[np.float64]


class SliderCrank(RodMechanism):
    """Crank, rod and ram; the shaft's angle is 0 when the crank points along the ram's way to the far side.

    The forward stroke runs from the outer dead centre (ram farthest away) to the inner one. The rod's centre of mass
    is at ``rod_centre`` from the crank pin; ``offset`` is the distance of the ram's line from the shaft.
    """

    ram_mass = "ram_mass"

    def motion(self, values: Values, phi: Floats) -> Motion:
        """See Mechanism."""
        slider = Slider(values["crank"], values["rod"], values["offset"], phi)
        bodies, x1 = slider_bodies(slider, values, 1.0, 0.0)
        inertia, slope = reduced(bodies)
        return Motion(inertia, slope, self._from_outside(values, slider), -x1)

    def way(self, values: Values, phi: Floats) -> Floats:
        """See Mechanism."""
        return self._from_outside(values, Slider(values["crank"], values["rod"], values["offset"], phi))

    def _from_outside(self, values: Values, slider: Slider) -> Floats:
        outside = np.sqrt(np.square(values["rod"] + values["crank"]) - np.square(values["offset"]))
        return np.asarray(outside - slider.x())

    def lift(self, values: Values, phi: Floats) -> Floats:
        """See Mechanism; the crank's pin is above the level through the shaft first."""
        slider = Slider(values["crank"], values["rod"], values["offset"], phi)
        return lifted(slider_bodies(slider, values, 1.0, 0.0)[0], values["inclination"], outward=-1.0)

    def dead_centres(self, values: Values) -> tuple[Floats, Floats]:
        """See Mechanism."""
        return slider_dead_centres(values["crank"], values)

    def margin(self, values: Values, phi: Floats) -> Floats:
        """See Mechanism."""
        return slider_margin(values["crank"], values, phi)

    def broken_rule(self, values: Values) -> Sentence | None:
        """See Mechanism."""
        return slider_fold("crank", Sentence("the crank"), values)

    def worst_angles(self, values: Values) -> Sequence[Floats]:
        """See Mechanism."""
        one = np.ones_like(values["crank"])
        return 0.5 * np.pi * one, 1.5 * np.pi * one


class ScotchYoke(HarmonicMechanism):
    """A crank pin in a slot across a yoke that slides: the travel is harmonic.

    The shaft's angle is 0 when the crank points along the yoke's way to the far side; the forward stroke ends half a
    turn later. ``block_mass`` is the sliding block on the crank pin.
    """

    ram_mass = "yoke_mass"

    def inertia(self, values: Values, phi: Floats) -> tuple[Floats, Floats]:
        """See HarmonicMechanism."""
        r, zero = values["crank"], np.zeros((1, 1, 1))
        yoke = Body(
            values["yoke_mass"], zero, -r * elementary.sin(phi), zero, zero, -r * elementary.cos(phi), zero, zero
        )
        inertia, slope = reduced([yoke])
        return inertia + values["block_mass"] * np.square(r), slope


class _QuickReturn(RodMechanism):
    """Crank whose pin slides in a slotted link; the link drives a ram by a rod.

    The link turns about a pivot at ``pivot_distance`` straight below the shaft; ``link_arm`` is the distance of the
    rod's pin from the pivot and ``offset`` the height of the ram's line above the pivot. The shaft's angle is counted
    from the direction of the ram's far side. ``block_mass`` is the sliding block on the crank pin, ``link_inertia``
    the link's about its pivot. The forward (slow) stroke draws the ram from the far side to the near one.
    """

    ram_mass = "ram_mass"

    def _direction(self, values: Values, phi: Floats) -> Floats:
        """Angle of the link from the direction of the ram's far side."""
        r, d = values["crank"], values["pivot_distance"]
        return np.asarray(elementary.arctan2(d + r * elementary.sin(phi), r * elementary.cos(phi)))

    def _link(self, values: Values, phi: Floats) -> tuple[Floats, Floats, Floats]:
        """Angle of the link from the direction of the ram's far side, and its two derivatives."""
        r, d = values["crank"], values["pivot_distance"]
        sin, cos = elementary.sin(phi), elementary.cos(phi)
        size = np.square(r) + np.square(d) + 2.0 * d * r * sin
        turn1 = (np.square(r) + d * r * sin) / size
        turn2 = d * r * cos * (np.square(d) - np.square(r)) / np.square(size)
        return elementary.arctan2(d + r * sin, r * cos), turn1, turn2

    def motion(self, values: Values, phi: Floats) -> Motion:
        """See Mechanism."""
        theta, turn1, turn2 = self._link(values, phi)
        slider = self._slider(values, theta)
        bodies, x1 = slider_bodies(slider, values, turn1, turn2)
        zero = np.zeros((1, 1, 1))
        bodies.append(Body(zero, values["link_inertia"], zero, zero, turn1, zero, zero, turn2))
        inertia, slope = reduced(bodies)
        way = self._from_outside(values, slider)
        return Motion(inertia + values["block_mass"] * np.square(values["crank"]), slope, way, -x1)

    def way(self, values: Values, phi: Floats) -> Floats:
        """See Mechanism."""
        return self._from_outside(values, self._slider(values, self._direction(values, phi)))

    def _from_outside(self, values: Values, slider: Slider) -> Floats:
        start = self._direction(values, self.dead_centres(values)[0])
        return np.asarray(self._slider(values, start).x() - slider.x())

    def lift(self, values: Values, phi: Floats) -> Floats:
        """See Mechanism; the link itself is taken to be balanced."""
        theta, turn1, turn2 = self._link(values, phi)
        bodies, _ = slider_bodies(self._slider(values, theta), values, turn1, turn2)
        r, zero = values["crank"], np.zeros((1, 1, 1))
        block = Body(
            values["block_mass"], zero, -r * elementary.sin(phi), r * elementary.cos(phi), zero, zero, zero, zero
        )
        return lifted([*bodies, block], values["inclination"], outward=-1.0)

    def _slider(self, values: Values, theta: Floats) -> Slider:
        return Slider(values["link_arm"], values["rod"], values["offset"], theta)


class Whitworth(_QuickReturn):
    """Quick return whose link turns fully: the pivot lies within the crank's circle. See _QuickReturn."""

    def dead_centres(self, values: Values) -> tuple[Floats, Floats]:
        """See Mechanism."""
        r, d = values["crank"], values["pivot_distance"]

        def shaft(theta: Floats) -> Floats:
            with np.errstate(invalid="ignore"):
                reach = d * elementary.sin(theta) + np.sqrt(np.square(r) - np.square(d * elementary.cos(theta)))
            return np.asarray(elementary.arctan2(reach * elementary.sin(theta) - d, reach * elementary.cos(theta)))

        outer, inner = slider_dead_centres(values["link_arm"], values)
        return shaft(outer), shaft(inner)

    def margin(self, values: Values, phi: Floats) -> Floats:
        """See Mechanism."""
        rod = slider_margin(values["link_arm"], values, self._link(values, phi)[0])
        return np.asarray(np.minimum(rod, (values["crank"] - values["pivot_distance"]) / values["crank"]))

    def broken_rule(self, values: Values) -> Sentence | None:
        """See Mechanism."""
        crank, distance = number_of(values, "crank"), number_of(values, "pivot_distance")
        if crank > distance:
            return slider_fold("link_arm", Sentence("the link"), values)
        return Sentence(
            "the pivot_distance ({distance}) of a whitworth must be less than the crank ({crank}): its pivot lies "
            "within the crank's circle",
            distance=amount(distance, "m"),
            crank=amount(crank, "m"),
        )

    def worst_angles(self, values: Values) -> Sequence[Floats]:
        """See Mechanism."""
        one = np.ones_like(values["crank"])
        return 0.5 * np.pi * one, 1.5 * np.pi * one


class CrankShaper(_QuickReturn):
    """Quick return whose link swings: the pivot lies outside the crank's circle. See _QuickReturn."""

    def dead_centres(self, values: Values) -> tuple[Floats, Floats]:
        """See Mechanism."""
        with np.errstate(invalid="ignore"):
            swing = elementary.arcsin(values["crank"] / values["pivot_distance"])
        return -swing, np.pi + swing

    def margin(self, values: Values, phi: Floats) -> Floats:
        """See Mechanism."""
        theta = self._link(values, phi)[0]
        rod = slider_margin(values["link_arm"], values, theta)
        # Rod and link in one line are a dead centre of the rod: the ram would reverse within a stroke.
        straight = elementary.sin(theta + elementary.arcsin(self._slider(values, theta).sin_b))
        swing = (values["pivot_distance"] - values["crank"]) / values["pivot_distance"]
        return np.asarray(np.minimum(np.minimum(rod, swing), straight))

    def broken_rule(self, values: Values) -> Sentence | None:
        """See Mechanism."""
        crank, distance = number_of(values, "crank"), number_of(values, "pivot_distance")
        if distance > crank:
            return self._rod_at_fault(values)
        return Sentence(
            "the pivot_distance ({distance}) of a crank_shaper must be more than the crank ({crank}): its pivot lies "
            "outside the crank's circle",
            distance=amount(distance, "m"),
            crank=amount(crank, "m"),
        )

    def _rod_at_fault(self, values: Values) -> Sentence | None:
        """The fault where the link swings correctly; None where the rod does not reach the ram's line."""
        theta = np.stack([self._link(values, phi)[0] for phi in self.worst_angles(values)])
        reach = float(slider_margin(values["link_arm"], values, theta).min())
        if abs(reach) <= 1e-9:
            return Sentence("the rod is perpendicular to the ram's line there, and the ram could continue either way")
        if reach > 0.0:
            return Sentence("the link_arm and the rod are in line there, and the ram would reverse within a stroke")
        return None

    def worst_angles(self, values: Values) -> Sequence[Floats]:
        """See Mechanism."""
        first, last = self.dead_centres(values)
        return 0.5 * np.pi * np.ones_like(first), first, last
