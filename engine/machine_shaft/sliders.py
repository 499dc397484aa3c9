"""Rod and ram driven by a pin on a circle, which most mechanisms end in: kinematics and bodies."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine import elementary
from sprag_study.engine.machine_shaft.mechanisms import Body, Values, number_of
from sprag_study.sentences import Sentence

Floats = NDArray[np.float64]


class Slider:
    """Rod and ram driven by a pin on a circle: everything as a function of the pin's angle ``theta``.

    x is measured along the ram's line from the pin circle's centre; the line passes it at the height ``offset``::

        x = r cos theta + L cos B,   L sin B = r sin theta - offset
    """

    def __init__(self, radius: Floats, rod: Floats, offset: Floats, theta: Floats) -> None:
        self.radius, self.rod = radius, rod
        self.sin, self.cos = elementary.sin(theta), elementary.cos(theta)
        self.sin_b = (radius * self.sin - offset) / rod
        with np.errstate(invalid="ignore"):
            self.cos_b = np.sqrt(1.0 - np.square(self.sin_b))

    @cached_property
    def b1(self) -> Floats:
        """First derivative of the rod's angle B by theta."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(self.radius / self.rod * self.cos / self.cos_b)

    @cached_property
    def b2(self) -> Floats:
        """Its second derivative."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray((self.sin_b * np.square(self.b1) - self.radius / self.rod * self.sin) / self.cos_b)

    def along_rod(self, s: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """First and second derivatives, by theta, of the x and y of the rod's point at ``s`` from the pin."""
        x1 = -self.radius * self.sin - s * self.sin_b * self.b1
        y1 = self.radius * self.cos - s * self.cos_b * self.b1
        x2 = -self.radius * self.cos - s * (self.cos_b * np.square(self.b1) + self.sin_b * self.b2)
        y2 = -self.radius * self.sin - s * (self.cos_b * self.b2 - self.sin_b * np.square(self.b1))
        return x1, y1, x2, y2

    def x(self) -> Floats:
        """Place of the ram."""
        return np.asarray(self.radius * self.cos + self.rod * self.cos_b)

    def x_slopes(self) -> tuple[Floats, Floats]:
        """First and second derivative of the ram's place by theta."""
        x1 = -self.radius * self.sin - self.rod * self.sin_b * self.b1
        x2 = -self.radius * self.cos - self.rod * (self.cos_b * np.square(self.b1) + self.sin_b * self.b2)
        return x1, x2


def slider_bodies(
    slider: Slider, values: Values, turn1: Floats | float, turn2: Floats | float
) -> tuple[list[Body], Floats]:
    """Rod and ram when the pin's angle itself has the derivatives ``turn1``, ``turn2``; and dx/dphi of the ram."""
    zero = np.zeros((1, 1, 1))
    x1, y1, x2, y2 = slider.along_rod(values["rod_centre"])
    ram1, ram2 = slider.x_slopes()

    def by_shaft(first: Floats, second: Floats) -> tuple[Floats, Floats]:
        return np.asarray(first * turn1), np.asarray(second * np.square(turn1) + first * turn2)

    (x1, x2), (y1, y2), (b1, b2) = by_shaft(x1, x2), by_shaft(y1, y2), by_shaft(slider.b1, slider.b2)
    ram1, ram2 = by_shaft(ram1, ram2)
    rod = Body(values["rod_mass"], values["rod_inertia"], x1, y1, b1, x2, y2, b2)
    return [rod, Body(values["ram_mass"], zero, ram1, zero, zero, ram2, zero, zero)], ram1


def slider_dead_centres(radius: Floats, values: Values) -> tuple[Floats, Floats]:
    """Angles of the pin at which the ram is farthest from the pin circle's centre, and nearest to it."""
    with np.errstate(invalid="ignore"):
        outer = elementary.arcsin(values["offset"] / (values["rod"] + radius))
        inner = np.pi + elementary.arcsin(values["offset"] / (values["rod"] - radius))
    return outer, inner


def slider_margin(radius: Floats, values: Values, theta: Floats) -> Floats:
    """Positive where the rod reaches the ram's line."""
    return np.asarray(1.0 - np.abs((radius * elementary.sin(theta) - values["offset"]) / values["rod"]))


def slider_fold(arm: str, part: Sentence, values: Values) -> Sentence | None:
    """The fault where the rod folds onto its arm at full retraction; None otherwise."""
    length, rod = number_of(values, arm) + abs(number_of(values, "offset")), number_of(values, "rod")
    if abs(length - rod) > 1e-9 * rod:
        return None
    return Sentence("the rod folds onto {part} there, and the ram could continue either way", part=part)
