"""A second implementation of the vibration drive for comparison only, slow and plain: its equations.

It shares nothing with the engine. Its automaton is in ``reference_automaton``, its integration in ``reference_run``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import quad

Floats = NDArray[np.float64]


def sine_and_cosine(of: Any) -> tuple[Any, Any]:
    """The functions for numbers or for arrays."""
    return (math.sin, math.cos) if isinstance(of, float) else (np.sin, np.cos)


@dataclass(frozen=True)
class Pendulum:
    """docs/theory.md: J, M l, c a^2, lambda, delta, law and end of its data."""

    inertia: float
    moment: float
    spring: float
    damping: float
    backlash: float
    law: tuple[float, ...]
    limit: float
    clutch_damping: float
    overrunning_damping: float

    def energy(self, u: float) -> float:
        """Energy in the clutch at a windup."""
        return float(quad(self.torque, 0.0, u, points=[self.limit] if self.limit < u else None, epsabs=1e-15)[0])

    def torque(self, u: Any) -> Any:
        """Law (3), straight beyond the end of the data; numbers or arrays."""
        inside = min(u, self.limit) if isinstance(u, float) else np.minimum(u, self.limit)
        value = sum(c * inside**k for k, c in enumerate(self.law))
        if inside is u:
            return value
        slope = sum(k * c * inside ** (k - 1) for k, c in enumerate(self.law) if k > 0)
        return value + slope * (u - inside)


@dataclass
class Outcome:
    """What a run gave: states at whole periods, integrals and extrema over the window, number of transitions."""

    states: list[tuple[str, ...]] = field(default_factory=list)
    values: list[Floats] = field(default_factory=list)
    events: int = 0
    engagements: int = 0
    largest: dict[str, float] = field(default_factory=dict)
    mean: dict[str, float] = field(default_factory=dict)


class Machine:
    """The machine of flat parameters, as the engine takes them."""

    out: Outcome

    def __init__(self, columns: Mapping[str, Any], literal: bool) -> None:
        def get(path: str, default: float = 0.0) -> float:
            return float(columns.get(path, default))

        self.n = 1 + max(int(path.split(".")[1]) for path in columns if path.startswith("pendulums."))
        self.literal = literal
        self.nu = 2.0 * math.pi * get("excitation.frequency")
        self.period = 1.0 / get("excitation.frequency")
        self.d, self.b = get("excitation.amplitude_x"), get("excitation.amplitude_y")
        self.chi = get("excitation.phase")
        rows = sorted({path.split(".")[2] for path in columns if path.startswith("excitation.harmonics.")}, key=int)
        self.overtones = [
            tuple(
                get(f"excitation.harmonics.{k}.{name}")
                for name in ("order", "amplitude_x", "phase_x", "amplitude_y", "phase_y")
            )
            for k in rows
        ]
        self.g = get("gravity", 9.80665)
        self.inertia, self.load = get("shaft.inertia"), get("shaft.load")
        self.bearing, self.linear, self.quadratic = (
            get(f"shaft.{name}") for name in ("bearing_damping", "linear_load", "quadratic_load")
        )
        self.stribeck, self.stribeck_speed = get("shaft.stribeck_load"), get("shaft.stribeck_speed", 1.0)
        rows = sorted({path.split(".")[2] for path in columns if path.startswith("shaft.load_table.")}, key=int)
        self.table = [(get(f"shaft.load_table.{k}.speed"), get(f"shaft.load_table.{k}.torque")) for k in rows]
        self.swing, self.cycles, self.phase = (
            get(f"shaft.{name}", default)
            for name, default in (("cyclic_load", 0.0), ("load_cycles", 1.0), ("load_phase", 0.0))
        )
        law = tuple(get(f"clutch.coefficients.{k}") for k in range(12))
        while len(law) > 1 and law[-1] == 0.0:
            law = law[:-1]
        self.pendulums = [
            Pendulum(
                get(f"pendulums.{i}.inertia"),
                get(f"pendulums.{i}.mass") * get(f"pendulums.{i}.arm"),
                get(f"pendulums.{i}.spring_rate") * get(f"pendulums.{i}.spring_arm") ** 2,
                get(f"pendulums.{i}.damping"),
                get(f"pendulums.{i}.backlash"),
                law,
                get("clutch.windup_limit", math.inf),
                get(f"pendulums.{i}.clutch_damping"),
                get(f"pendulums.{i}.overrunning_damping"),
            )
            for i in range(self.n)
        ]
        # Angles, speeds, windups; shaft's angle and speed; integrals: torque, input, loss, clutch work, angles; square
        # and cube of the shaft's speed, what the clutches lose, work against the load.
        n = self.n
        self.shaft = 3 * n + 1
        self.start = np.zeros(5 * n + 9)
        self.start[:n] = [get(f"pendulums.{i}.initial_angle") for i in range(n)]
        self.start[n : 2 * n] = [get(f"pendulums.{i}.initial_speed") for i in range(n)]
        self.start[self.shaft] = get("shaft.initial_speed")
        self.clutches = ["free"] * n
        self.backstop = any(p.overrunning_damping > 0.0 for p in self.pendulums)
        self.row = self.row_at(float(self.start[self.shaft]))
        self.stops = self.load > 0.0 or self.stribeck > 0.0 or self.backstop or (self.table and self.table[0][1] > 0.0)
        self.shaft_state = "rotating" if self.start[self.shaft] > 0.0 or not self.stops else "held"

    def base(self, t: Any) -> tuple[Any, Any]:
        """x'' and y'' of (2)."""
        square, (sin, cos) = self.nu**2, sine_and_cosine(t)
        x, y = -self.d * square * cos(self.nu * t), -self.b * square * sin(self.nu * t + self.chi)
        for order, along, phase_x, upright, phase_y in self.overtones:
            rate = order * self.nu
            x = x - along * rate**2 * cos(rate * t + phase_x)
            y = y - upright * rate**2 * sin(rate * t + phase_y)
        return x, y

    def free_moment(self, i: int, t: Any, y: Any) -> Any:
        """J phi'' of (1) without the clutch."""
        p = self.pendulums[i]
        phi, speed = y[i], y[self.n + i]
        (ax, ay), (sin, cos) = self.base(t), sine_and_cosine(t)
        drive = p.moment * (ax * cos(phi) + (ay + self.g) * sin(phi))
        return drive - p.spring * phi - p.damping * speed

    def useful(self, speed: Any, angle: Any) -> Any:
        """Torque of the load at a speed and an angle of the shaft; at rest, what it holds."""
        bent = self.stribeck * np.exp(-speed / self.stribeck_speed)
        bent = bent + self.load * self.swing * np.cos(self.cycles * angle + self.phase)
        return self.load + self.linear * speed + self.quadratic * speed * np.abs(speed) + bent + self.on_line(speed)

    def row_at(self, speed: float) -> int:
        """The row of the load's table before which a speed is."""
        return sum(speed >= at for at, _ in self.table)

    def on_line(self, speed: Any) -> Any:
        """Torque on the line before the present row of the load's table, which holds beyond the ends of the table."""
        if not self.table:
            return 0.0 * speed
        if not 0 < self.row < len(self.table):
            return self.table[min(self.row, len(self.table) - 1)][1] + 0.0 * speed
        (low, first), (high, second) = self.table[self.row - 1 : self.row + 1]
        return first + (second - first) * (speed - low) / (high - low)

    def rate(self, i: int) -> float:
        """Damping of a clutch in its state."""
        p, state = self.pendulums[i], self.clutches[i]
        if state == "free":
            return p.overrunning_damping
        return p.clutch_damping if state in ("engaged", "beyond") else 0.0

    def torques(self, t: Any, y: Any) -> tuple[list[Any], Any]:
        """Torque of every clutch and the shaft's acceleration in the present mode."""
        sprung = []
        for i, p in enumerate(self.pendulums):
            spring = p.torque(y[2 * self.n + i]) if self.clutches[i] in ("engaged", "beyond") else 0.0 * t
            sprung.append(spring + self.rate(i) * (y[self.n + i] - y[self.shaft]))
        locked = [i for i in range(self.n) if self.clutches[i] == "locked"]
        free = {i: self.free_moment(i, t, y) for i in locked}
        acceleration = 0.0 * t
        if self.shaft_state == "rotating":
            together = self.inertia + sum(self.pendulums[i].inertia for i in locked)
            against = self.useful(y[self.shaft], y[3 * self.n]) + self.bearing * y[self.shaft]
            acceleration = (sum(sprung) + sum(free.values()) - against) / together
        for i in locked:
            sprung[i] = free[i] - self.pendulums[i].inertia * acceleration
        return sprung, acceleration

    def rates(self, t: float, state: Floats) -> Floats:
        """Right-hand side of everything that is integrated."""
        n = self.n
        y = state.tolist()  # Python's numbers take a third of the time of numpy's
        torque, acceleration = self.torques(t, y)
        out = [0.0] * len(y)
        ax, ay = self.base(t)
        shaft = y[self.shaft]
        for i, p in enumerate(self.pendulums):
            speed = y[n + i]
            out[i] = speed
            out[n + i] = (self.free_moment(i, t, y) - torque[i]) / p.inertia
            if self.clutches[i] == "locked":
                out[n + i] = acceleration
            elif self.clutches[i] != "free":
                out[2 * n + i] = speed - shaft
            out[3 * n + 3] += p.moment * speed * (ax * math.cos(y[i]) + ay * math.sin(y[i]))
            out[3 * n + 4] += p.damping * speed**2
            out[3 * n + 6 + i] = y[i]
            out[4 * n + 8 + i] = self.rate(i) * (speed - shaft) ** 2
        out[3 * n] = shaft
        out[self.shaft] = acceleration
        out[3 * n + 2] = sum(torque)
        out[3 * n + 4] += self.bearing * shaft**2
        out[3 * n + 5] = sum(torque) * shaft
        out[4 * n + 6], out[4 * n + 7] = shaft**2, shaft**3
        out[5 * n + 8] = self.useful(shaft, y[3 * n]) * shaft
        return np.array(out)
