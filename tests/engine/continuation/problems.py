"""Return maps with known answers, followed by the same code as the drive's."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate._ivp import dop853_coefficients as dop853

from sprag_study.engine.continuation.problem import Pattern

Floats = NDArray[np.float64]


class Smooth:
    """What a map without events has."""

    bounds = (-math.inf, math.inf)

    def pattern(self, point: Floats, parameter: float) -> Pattern:
        return {}

    def moved(self, points: Floats, parameters: Floats) -> None:
        return None

    def half(self, point: Floats, parameter: float) -> float:
        return math.inf

    def state(self, point: Floats) -> Floats:
        return point


@dataclass(frozen=True)
class Duffing(Smooth):
    """x'' + c x' + k x + x^3 = f cos(w t), its state taken once in each period; the parameter is w."""

    damping: float
    stiffness: float
    force: float
    steps: int = 20

    def rate(self, phase: Any, x: Any, v: Any, frequency: Any) -> tuple[Any, Any]:
        """Derivatives by the phase w t."""
        force = self.force * np.cos(phase) - self.damping * v - self.stiffness * x - x * x * x
        return v / frequency, force / frequency

    def images(self, points: Floats, parameters: Floats) -> Floats:
        """Equal steps of Dormand and Prince's formula of order 8."""
        state = np.ascontiguousarray(points.T)
        h = 2.0 * np.pi / self.steps
        rates = np.empty((12, *state.shape))
        flat = rates.reshape(12, -1)
        for number in range(self.steps):
            for k in range(12):
                x, v = state + h * (dop853.A[k, :k] @ flat[:k]).reshape(state.shape)
                rates[k] = self.rate(h * (number + dop853.C[k]), x, v, parameters)
            state = state + h * (dop853.B @ flat).reshape(state.shape)
        return np.ascontiguousarray(state.T)


@dataclass(frozen=True)
class Impact(Smooth):
    """x'' + x = cos(w t) below a stop at x = s that returns the share r of the speed; the parameter is s.

    A point is the phase w t of an impact and the speed after it; the next impact follows about one period of
    the excitation later.
    """

    frequency: float
    restitution: float

    @property
    def amplitude(self) -> float:
        """Of the motion without a stop."""
        return 1.0 / (1.0 - self.frequency**2)

    def flight(self, points: Floats, stops: Floats, time: Any) -> tuple[Any, Any]:
        """Places and speeds some time after impacts."""
        phase, speed = points[:, 0], points[:, 1]
        a, w = self.amplitude, self.frequency
        c, d = stops - a * np.cos(phase), speed + a * w * np.sin(phase)
        x = a * np.cos(w * time + phase) + c * np.cos(time) + d * np.sin(time)
        return x, -a * w * np.sin(w * time + phase) - c * np.sin(time) + d * np.cos(time)

    def images(self, points: Floats, parameters: Floats) -> Floats:
        """The next impact: the first time at which the place passes the stop from below."""
        period = 2.0 * np.pi / self.frequency
        times = np.linspace(0.0, 2.0 * period, 801)[1:, None]
        x = self.flight(points, parameters, times)[0] - parameters
        passes = (x[:-1] < 0.0) & (x[1:] >= 0.0)
        time = times[np.argmax(passes, axis=0) + 1, 0]
        for _ in range(20):
            x, v = self.flight(points, parameters, time)
            time = time - (x - parameters) / v
        images = np.column_stack([points[:, 0] + self.frequency * time - 2.0 * np.pi, -self.restitution * v])
        return np.where(np.any(passes, axis=0)[:, None], images, np.nan)

    def orbits(self, stop: float) -> list[tuple[float, float, float]]:
        """Both orbits of one impact in each period, in closed form: phase, speed after the impact, trace of dF/dx."""
        a, w, r = self.amplitude, self.frequency, self.restitution
        period = 2.0 * math.pi / w
        slope = self.slope
        p, q, root = slope**2 + a**-2, stop / a**2, (stop / a) ** 2 - 1.0
        found = []
        for sign in (1.0, -1.0) if q * q - p * root >= 0.0 else ():
            c = (q + sign * math.sqrt(q * q - p * root)) / p
            phase = math.atan2(c * slope, (stop - c) / a)
            speed = c * math.tan(0.5 * period) - a * w * math.sin(phase)
            force = math.cos(phase) - stop
            trace = -2.0 * r * math.cos(period) - r * (1.0 + r) * force / speed * math.sin(period)
            found.append((phase, speed, trace))
        return found

    @property
    def slope(self) -> float:
        """sin(phase) by the coefficient of the free oscillation's cosine."""
        w, r = self.frequency, self.restitution
        return math.tan(math.pi / w) * (1.0 / r - 1.0) / (self.amplitude * w * (1.0 + 1.0 / r))

    @property
    def fold(self) -> float:
        """Distance of the stop at which both orbits are one."""
        return math.sqrt(self.amplitude**2 + self.slope**-2)


class Halved(Smooth):
    """x -> x + x (p - x^2)/10 as the second iterate of a map that turns x into -x: its period is halved at p = 0."""

    def images(self, points: Floats, parameters: Floats) -> Floats:
        return points + 0.1 * points * (parameters[:, None] - points**2)

    def half(self, point: Floats, parameter: float) -> float:
        return float(2.0 * abs(point[0]))
