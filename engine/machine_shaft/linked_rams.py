"""Rams that a four-bar linkage drives by a rod: the drag link and the toggle of a knuckle-joint press."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine import elementary
from sprag_study.engine.machine_shaft.four_bars import (
    Links,
    crank_rocker_rule,
    listed_links,
    rocker_dead_centres,
    rocking,
    swinging,
)
from sprag_study.engine.machine_shaft.mechanisms import Motion, RodMechanism, Values, lifted, number_of, reduced
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


class DragLink(RodMechanism):
    """A double crank whose second crank, the follower, turns fully but unevenly and drives a ram like a crank.

    The follower's pivot is at ``frame`` from the shaft, at ``frame_angle`` from the direction of the ram's far side;
    the ``arm`` with the rod's pin is ahead of the follower's own pin by ``arm_angle``. ``offset`` is the height of the
    ram's line above the follower's pivot. Angles are counted as those of the slider-crank.
    """

    ram_mass = "ram_mass"

    def _links(self, values: Values, phi: Floats) -> Links:
        return Links.of(values, phi - values["frame_angle"], "follower")

    def _arm(self, values: Values, links: Links) -> Floats:
        """Angle of the arm from the direction of the ram's far side."""
        return np.asarray(links.psi + values["frame_angle"] + values["arm_angle"])

    def _slider(self, values: Values, links: Links) -> Slider:
        return Slider(values["arm"], values["rod"], values["offset"], self._arm(values, links))

    def _shaft_angle(self, values: Values, arm: Floats) -> Floats:
        """Angle of the shaft at an angle of the arm."""
        psi = arm - values["frame_angle"] - values["arm_angle"]
        a, b, c, d = (values[name] for name in ("crank", "coupler", "follower", "frame"))
        x, y = d + c * elementary.cos(psi), c * elementary.sin(psi)
        reach = np.sqrt(np.square(x) + np.square(y))
        with np.errstate(invalid="ignore"):
            ahead = elementary.arccos((np.square(a) + np.square(reach) - np.square(b)) / (2.0 * a * reach))
        return np.asarray(elementary.arctan2(y, x) + ahead + values["frame_angle"])

    def motion(self, values: Values, phi: Floats) -> Motion:
        """See Mechanism."""
        links = self._links(values, phi)
        psi1, theta1, psi2, theta2 = links.turning()
        slider = self._slider(values, links)
        bodies, x1 = slider_bodies(slider, values, psi1, psi2)
        bodies += [links.coupler(values, theta1, theta2), swinging(values["follower_inertia"], psi1, psi2)]
        inertia, slope = reduced(bodies)
        start = self._slider(values, self._links(values, self.dead_centres(values)[0]))
        return Motion(inertia, slope, start.x() - slider.x(), -x1)

    def lift(self, values: Values, phi: Floats) -> Floats:
        """See Mechanism; the follower itself is taken to be balanced."""
        links = self._links(values, phi)
        psi1, theta1, psi2, theta2 = links.turning()
        own, _ = slider_bodies(self._slider(values, links), values, psi1, psi2)
        coupler = [links.coupler(values, theta1, theta2)]
        beta = values["inclination"]
        return lifted(own, beta, outward=-1.0) + lifted(coupler, beta, values["frame_angle"], outward=-1.0)

    def dead_centres(self, values: Values) -> tuple[Floats, Floats]:
        """See Mechanism."""
        outer, inner = slider_dead_centres(values["arm"], values)
        return self._shaft_angle(values, outer), self._shaft_angle(values, inner)

    def margin(self, values: Values, phi: Floats) -> Floats:
        """See Mechanism."""
        links = self._links(values, phi)
        turns = (values["crank"] - values["frame"]) / values["crank"]
        rod = slider_margin(values["arm"], values, self._arm(values, links))
        return np.asarray(np.minimum(np.minimum(1.0 - np.abs(links.cos_gamma), turns), rod))

    def broken_rule(self, values: Values) -> Sentence | None:
        """See Mechanism."""
        sizes = {name: number_of(values, name) for name in ("crank", "coupler", "follower")}
        frame, most = number_of(values, "frame"), max(sizes.values())
        short = {name: size for name, size in sizes.items() if size <= frame}
        if short:
            return Sentence(
                "the frame ({frame}) of a drag_link must be shorter than {links}",
                frame=amount(frame, "m"),
                links=listed_links(short),
            )
        spare = sum(sizes.values()) - 2.0 * most - frame
        if abs(spare) <= 1e-9 * most:
            return Sentence("all its links lie in one line there, and the follower could continue either way")
        if spare < 0.0:
            return Sentence(
                "the frame and the longest link ({together} together) must be shorter than the other two ({others}), "
                "else the follower cannot turn fully",
                together=amount(frame + most, "m"),
                others=amount(sum(sizes.values()) - most, "m"),
            )
        return slider_fold("arm", Sentence("the arm"), values)

    def worst_angles(self, values: Values) -> Sequence[Floats]:
        """See Mechanism; where frame and crank are in line, and where the arm is across the ram's line."""
        one = np.ones_like(values["crank"])
        across = (self._shaft_angle(values, angle * one) for angle in (0.5 * np.pi, 1.5 * np.pi))
        return values["frame_angle"] * one, values["frame_angle"] + np.pi * one, *across


class Toggle(RodMechanism):
    """The toggle of a knuckle-joint press: a crank-rocker whose rocker and a rod straighten to press a ram away.

    Crank, coupler and rocker are those of a four-bar, with the crank's angle counted from the frame. The ram slides on
    a line through the rocker's pivot, at ``line_angle`` from the direction of the frame beyond the pivot. The rod goes
    from the rocker's pin to the ram. The forward stroke presses the ram away from the pivot, as rocker and rod come
    nearer to one line; they must not pass it, else the ram would turn back within the stroke.
    """

    ram_mass = "ram_mass"

    def _slider(self, values: Values, psi: Floats) -> Slider:
        return Slider(values["rocker"], values["rod"], np.zeros((1, 1, 1)), psi - values["line_angle"])

    def motion(self, values: Values, phi: Floats) -> Motion:
        """See Mechanism."""
        links = Links.of(values, phi)
        psi1, theta1, psi2, theta2 = links.turning()
        slider = self._slider(values, links.psi)
        bodies, x1 = slider_bodies(slider, values, psi1, psi2)
        bodies += [links.coupler(values, theta1, theta2), swinging(values["rocker_inertia"], psi1, psi2)]
        inertia, slope = reduced(bodies)
        start = self._slider(values, Links.of(values, self.dead_centres(values)[0]).psi)
        return Motion(inertia, slope, slider.x() - start.x(), x1)

    def lift(self, values: Values, phi: Floats) -> Floats:
        """See Mechanism; the rocker itself is taken to be balanced."""
        links = Links.of(values, phi)
        psi1, theta1, psi2, theta2 = links.turning()
        own, _ = slider_bodies(self._slider(values, links.psi), values, psi1, psi2)
        coupler = [links.coupler(values, theta1, theta2)]
        return lifted(own, values["inclination"]) + lifted(coupler, values["inclination"], -values["line_angle"])

    def dead_centres(self, values: Values) -> tuple[Floats, Floats]:
        """See Mechanism."""
        return rocker_dead_centres(values)

    def margin(self, values: Values, phi: Floats) -> Floats:
        """See Mechanism."""
        links = Links.of(values, phi)
        slider = self._slider(values, links.psi)
        with np.errstate(invalid="ignore"):
            ram = slider.x() / values["rod"]
        # Straight at the end of the stroke is as far as the links may go.
        bent = np.minimum(1.0 - np.abs(slider.sin_b), slider.sin + 1e-9)
        return np.asarray(np.minimum.reduce(np.broadcast_arrays(
            1.0 - np.abs(links.cos_gamma), rocking(values), bent, ram)))  # fmt: skip

    def broken_rule(self, values: Values) -> Sentence | None:
        """See Mechanism."""
        with np.errstate(invalid="ignore"):
            ends = [Links.of(values, angle) for angle in (*self.dead_centres(values), np.zeros((1, 1, 1)))]
        if rocking(values).flat[0] <= 0.0 or not all(np.abs(links.cos_gamma).flat[0] < 1.0 for links in ends):
            return crank_rocker_rule(values)
        if min(float(self._slider(values, links.psi).sin.flat[0]) for links in ends) < 0.0:
            return Sentence("rocker and rod pass the position in line, and the ram would turn back within a stroke")
        return Sentence("the rod does not reach the ram's line, or reaches it on the wrong side of the pivot")

    def worst_angles(self, values: Values) -> Sequence[Floats]:
        """See Mechanism; where crank and frame are in line, the ends of the stroke, and the rocker across the line."""
        one = np.ones_like(values["crank"])
        start, end = self.dead_centres(values)
        psi = values["line_angle"] + 0.5 * np.pi
        a, b, c = (values[name] for name in ("crank", "coupler", "rocker"))
        x, y = values["frame"] + c * elementary.cos(psi), c * elementary.sin(psi)
        reach = np.sqrt(np.square(x) + np.square(y))
        with np.errstate(invalid="ignore"):
            ahead = elementary.arccos((np.square(a) + np.square(reach) - np.square(b)) / (2.0 * a * reach))
        across = elementary.arctan2(y, x) + ahead
        # A rocker that never stands across the line leaves the ends as the worst.
        return 0.0 * one, np.pi * one, start, end, np.where(np.isnan(across), 0.0, across)
