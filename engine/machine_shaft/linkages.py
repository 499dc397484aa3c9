"""Slider-crank, crank-rocker four-bar linkage and quick returns: kinematics and inertia from dimensions and masses."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sprag.engine.machine_shaft.mechanisms import Body, Mechanism, Motion, Values, number_of, reduced

Floats = NDArray[np.float64]


class _Slider:
    """Rod and ram driven by a pin on a circle: everything as a function of the pin's angle ``theta``.

    x is measured along the ram's line from the pin circle's centre; the line passes it at the height ``offset``::

        x = r cos theta + L cos B,   L sin B = r sin theta - offset
    """

    def __init__(self, radius: Floats, rod: Floats, offset: Floats, theta: Floats) -> None:
        self.radius, self.rod = radius, rod
        self.sin, self.cos = np.sin(theta), np.cos(theta)
        self.sin_b = (radius * self.sin - offset) / rod
        with np.errstate(invalid="ignore"):
            self.cos_b = np.sqrt(1.0 - self.sin_b**2)
        q = radius / rod
        with np.errstate(invalid="ignore", divide="ignore"):
            self.b1 = q * self.cos / self.cos_b
            self.b2 = (self.sin_b * self.b1**2 - q * self.sin) / self.cos_b

    def along_rod(self, s: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """First and second derivatives, by theta, of the x and y of the rod's point at ``s`` from the pin."""
        x1 = -self.radius * self.sin - s * self.sin_b * self.b1
        y1 = self.radius * self.cos - s * self.cos_b * self.b1
        x2 = -self.radius * self.cos - s * (self.cos_b * self.b1**2 + self.sin_b * self.b2)
        y2 = -self.radius * self.sin - s * (self.cos_b * self.b2 - self.sin_b * self.b1**2)
        return x1, y1, x2, y2

    def x(self) -> Floats:
        return np.asarray(self.radius * self.cos + self.rod * self.cos_b)

    def x_slopes(self) -> tuple[Floats, Floats]:
        x1 = -self.radius * self.sin - self.rod * self.sin_b * self.b1
        x2 = -self.radius * self.cos - self.rod * (self.cos_b * self.b1**2 + self.sin_b * self.b2)
        return x1, x2


def _slider_bodies(
    slider: _Slider, values: Values, turn1: Floats | float, turn2: Floats | float
) -> tuple[list[Body], Floats]:
    """Rod and ram when the pin's angle itself has the derivatives ``turn1``, ``turn2``; and dx/dphi of the ram."""
    zero = np.zeros((1, 1, 1))
    x1, y1, x2, y2 = slider.along_rod(values["rod_centre"])
    ram1, ram2 = slider.x_slopes()

    def by_shaft(first: Floats, second: Floats) -> tuple[Floats, Floats]:
        return np.asarray(first * turn1), np.asarray(second * turn1**2 + first * turn2)

    (x1, x2), (y1, y2), (b1, b2) = by_shaft(x1, x2), by_shaft(y1, y2), by_shaft(slider.b1, slider.b2)
    ram1, ram2 = by_shaft(ram1, ram2)
    rod = Body(values["rod_mass"], values["rod_inertia"], x1, y1, b1, x2, y2, b2)
    return [rod, Body(values["ram_mass"], zero, ram1, zero, zero, ram2, zero, zero)], ram1


class SliderCrank(Mechanism):
    """Crank, rod and ram; the shaft's angle is 0 when the crank points along the ram's way to the far side.

    The forward stroke runs from the outer dead centre (ram farthest away) to the inner one. The rod's centre of mass
    is at ``rod_centre`` from the crank pin; ``offset`` is the distance of the ram's line from the shaft.
    """

    ram_mass = "ram_mass"

    def motion(self, values: Values, phi: Floats) -> Motion:
        """See Mechanism."""
        slider = _Slider(values["crank"], values["rod"], values["offset"], phi)
        bodies, x1 = _slider_bodies(slider, values, 1.0, 0.0)
        inertia, slope = reduced(bodies)
        reach = np.sqrt((values["rod"] + values["crank"]) ** 2 - values["offset"] ** 2)
        return Motion(inertia, slope, reach - slider.x(), -x1)

    def dead_centres(self, values: Values) -> tuple[Floats, Floats]:
        """See Mechanism."""
        return _slider_dead_centres(values["crank"], values)

    def margin(self, values: Values, phi: Floats) -> Floats:
        """See Mechanism."""
        return _slider_margin(values["crank"], values, phi)

    def broken_rule(self, values: Values) -> str | None:
        """See Mechanism."""
        return _slider_fold("crank", "crank", values)

    def worst_angles(self, values: Values) -> Sequence[Floats]:
        """See Mechanism."""
        one = np.ones_like(values["crank"])
        return 0.5 * np.pi * one, 1.5 * np.pi * one


def _slider_dead_centres(radius: Floats, values: Values) -> tuple[Floats, Floats]:
    with np.errstate(invalid="ignore"):
        outer = np.arcsin(values["offset"] / (values["rod"] + radius))
        inner = np.pi + np.arcsin(values["offset"] / (values["rod"] - radius))
    return outer, inner


def _slider_margin(radius: Floats, values: Values, theta: Floats) -> Floats:
    return np.asarray(1.0 - np.abs((radius * np.sin(theta) - values["offset"]) / values["rod"]))


def _slider_fold(arm: str, part: str, values: Values) -> str | None:
    """The fault where the rod folds onto its arm at full retraction; None otherwise."""
    length, rod = number_of(values, arm) + abs(number_of(values, "offset")), number_of(values, "rod")
    if abs(length - rod) > 1e-9 * rod:
        return None
    return f"the rod folds onto the {part} there, and the ram could continue either way"


class FourBar(Mechanism):
    """Crank and rocker; the crank's angle is counted from the frame, towards the side on which the rocker's pin is.

    ``frame``, ``crank``, ``coupler``, ``rocker`` are lengths. The coupler's centre of mass is at ``coupler_centre``
    from the crank pin on the line of the pins; ``rocker_inertia`` is about the rocker's pivot; ``tray_mass`` hangs on
    the rocker's pin and moves along its arc without turning, as a conveyor's trough on parallel rockers does. The way
    is the arc of that pin; the forward stroke leads away from the crank.
    """

    def _angles(self, values: Values, phi: Floats) -> tuple[Floats, Floats, Floats]:
        a, b, c, d = (values[name] for name in ("crank", "coupler", "rocker", "frame"))
        x, y = a * np.cos(phi) - d, a * np.sin(phi)
        reach = np.sqrt(x**2 + y**2)
        cos_gamma = (c**2 + reach**2 - b**2) / (2.0 * c * reach)
        with np.errstate(invalid="ignore"):
            rocker = np.pi + np.arctan2(-y, -x) - np.arccos(cos_gamma)
        coupler = np.arctan2(c * np.sin(rocker) - y, c * np.cos(rocker) - x)
        return rocker, coupler, cos_gamma

    def motion(self, values: Values, phi: Floats) -> Motion:
        """See Mechanism."""
        a, b, c = (values[name] for name in ("crank", "coupler", "rocker"))
        psi, theta, _ = self._angles(values, phi)
        turn = np.sin(psi - theta)
        with np.errstate(invalid="ignore", divide="ignore"):
            psi1 = a * np.sin(phi - theta) / (c * turn)
            theta1 = a * np.sin(phi - psi) / (b * turn)
            across = np.cos(psi - theta)
            psi2 = (a * np.cos(phi - theta) + b * theta1**2 - c * psi1**2 * across) / (c * turn)
            theta2 = (a * np.cos(phi - psi) + b * theta1**2 * across - c * psi1**2) / (b * turn)
        s = values["coupler_centre"]
        sin, cos = np.sin(theta), np.cos(theta)
        coupler = Body(
            values["coupler_mass"],
            values["coupler_inertia"],
            -a * np.sin(phi) - s * sin * theta1,
            a * np.cos(phi) + s * cos * theta1,
            theta1,
            -a * np.cos(phi) - s * (cos * theta1**2 + sin * theta2),
            -a * np.sin(phi) - s * (sin * theta1**2 - cos * theta2),
            theta2,
        )
        zero = np.zeros((1, 1, 1))
        swinging = values["rocker_inertia"] + values["tray_mass"] * c**2
        inertia, slope = reduced([coupler, Body(zero, swinging, zero, zero, psi1, zero, zero, psi2)])
        start = self._angles(values, self.dead_centres(values)[0])[0]
        return Motion(inertia, slope, c * (start - psi), -c * psi1)

    def dead_centres(self, values: Values) -> tuple[Floats, Floats]:
        """See Mechanism."""
        a, b, c, d = (values[name] for name in ("crank", "coupler", "rocker", "frame"))

        def pin(distance: Floats) -> Floats:
            with np.errstate(invalid="ignore", divide="ignore"):
                return np.asarray(np.arccos((d**2 + distance**2 - c**2) / (2.0 * d * distance)))

        return np.pi + pin(b - a), pin(b + a)

    def margin(self, values: Values, phi: Floats) -> Floats:
        """See Mechanism."""
        cos_gamma = self._angles(values, phi)[2]
        rocking = np.minimum(values["frame"], values["coupler"]) - values["crank"]
        return np.asarray(np.minimum(1.0 - np.abs(cos_gamma), rocking / values["frame"]))

    def broken_rule(self, values: Values) -> str | None:
        """See Mechanism."""
        crank = number_of(values, "crank")
        short = [name for name in ("frame", "coupler") if number_of(values, name) <= crank]
        if not short:
            sizes = sorted(number_of(values, name) for name in ("crank", "coupler", "rocker", "frame"))
            folds = abs(sizes[0] + sizes[3] - sizes[1] - sizes[2]) <= 1e-9 * sizes[3]
            return "all its links lie in one line there, and the rocker could continue either way" if folds else None
        told = " and ".join(f"the {name} ({number_of(values, name):.6g} m)" for name in short)
        return f"the crank ({crank:.6g} m) of a crank-rocker must be shorter than {told}"

    def worst_angles(self, values: Values) -> Sequence[Floats]:
        """See Mechanism."""
        one = np.ones_like(values["crank"])
        return 0.0 * one, np.pi * one


class _QuickReturn(Mechanism):
    """Crank whose pin slides in a slotted link; the link drives a ram by a rod.

    The link turns about a pivot at ``pivot_distance`` straight below the shaft; ``link_arm`` is the distance of the
    rod's pin from the pivot and ``offset`` the height of the ram's line above the pivot. The shaft's angle is counted
    from the direction of the ram's far side. ``block_mass`` is the sliding block on the crank pin, ``link_inertia``
    the link's about its pivot. The forward (slow) stroke draws the ram from the far side to the near one.
    """

    ram_mass = "ram_mass"

    def _link(self, values: Values, phi: Floats) -> tuple[Floats, Floats, Floats]:
        """Angle of the link from the direction of the ram's far side, and its two derivatives."""
        r, d = values["crank"], values["pivot_distance"]
        sin, cos = np.sin(phi), np.cos(phi)
        size = r**2 + d**2 + 2.0 * d * r * sin
        turn1 = (r**2 + d * r * sin) / size
        turn2 = d * r * cos * (d**2 - r**2) / size**2
        return np.arctan2(d + r * sin, r * cos), turn1, turn2

    def motion(self, values: Values, phi: Floats) -> Motion:
        """See Mechanism."""
        theta, turn1, turn2 = self._link(values, phi)
        slider = self._slider(values, theta)
        bodies, x1 = _slider_bodies(slider, values, turn1, turn2)
        zero = np.zeros((1, 1, 1))
        bodies.append(Body(zero, values["link_inertia"], zero, zero, turn1, zero, zero, turn2))
        inertia, slope = reduced(bodies)
        start = self._slider(values, self._link(values, self.dead_centres(values)[0])[0])
        return Motion(inertia + values["block_mass"] * values["crank"] ** 2, slope, start.x() - slider.x(), -x1)

    def _slider(self, values: Values, theta: Floats) -> _Slider:
        return _Slider(values["link_arm"], values["rod"], values["offset"], theta)


class Whitworth(_QuickReturn):
    """Quick return whose link turns fully: the pivot lies within the crank's circle. See _QuickReturn."""

    def dead_centres(self, values: Values) -> tuple[Floats, Floats]:
        """See Mechanism."""
        r, d = values["crank"], values["pivot_distance"]

        def shaft(theta: Floats) -> Floats:
            with np.errstate(invalid="ignore"):
                reach = d * np.sin(theta) + np.sqrt(r**2 - (d * np.cos(theta)) ** 2)
            return np.asarray(np.arctan2(reach * np.sin(theta) - d, reach * np.cos(theta)))

        outer, inner = _slider_dead_centres(values["link_arm"], values)
        return shaft(outer), shaft(inner)

    def margin(self, values: Values, phi: Floats) -> Floats:
        """See Mechanism."""
        rod = _slider_margin(values["link_arm"], values, self._link(values, phi)[0])
        return np.asarray(np.minimum(rod, (values["crank"] - values["pivot_distance"]) / values["crank"]))

    def broken_rule(self, values: Values) -> str | None:
        """See Mechanism."""
        crank, distance = number_of(values, "crank"), number_of(values, "pivot_distance")
        if crank > distance:
            return _slider_fold("link_arm", "link", values)
        return (
            f"the pivot_distance ({distance:.6g} m) of a whitworth must be less than the crank ({crank:.6g} m): its "
            "pivot lies within the crank's circle"
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
            swing = np.arcsin(values["crank"] / values["pivot_distance"])
        return -swing, np.pi + swing

    def margin(self, values: Values, phi: Floats) -> Floats:
        """See Mechanism."""
        theta = self._link(values, phi)[0]
        rod = _slider_margin(values["link_arm"], values, theta)
        # Rod and link in one line are a dead centre of the rod: the ram would reverse within a stroke.
        straight = np.sin(theta + np.arcsin(self._slider(values, theta).sin_b))
        swing = (values["pivot_distance"] - values["crank"]) / values["pivot_distance"]
        return np.asarray(np.minimum(np.minimum(rod, swing), straight))

    def broken_rule(self, values: Values) -> str | None:
        """See Mechanism."""
        crank, distance = number_of(values, "crank"), number_of(values, "pivot_distance")
        if distance > crank:
            return self._rod_at_fault(values)
        return (
            f"the pivot_distance ({distance:.6g} m) of a crank_shaper must be more than the crank ({crank:.6g} m): "
            "its pivot lies outside the crank's circle"
        )

    def _rod_at_fault(self, values: Values) -> str | None:
        """The fault where the link swings correctly; None where the rod does not reach the ram's line."""
        theta = np.stack([self._link(values, phi)[0] for phi in self.worst_angles(values)])
        reach = float(_slider_margin(values["link_arm"], values, theta).min())
        if abs(reach) <= 1e-9:
            return "the rod is perpendicular to the ram's line there, and the ram could continue either way"
        if reach > 0.0:
            return "the link_arm and the rod are in line there, and the ram would reverse within a stroke"
        return None

    def worst_angles(self, values: Values) -> Sequence[Floats]:
        """See Mechanism."""
        first, last = self.dead_centres(values)
        return 0.5 * np.pi * np.ones_like(first), first, last
