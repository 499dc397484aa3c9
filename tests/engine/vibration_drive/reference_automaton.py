"""A second implementation of the vibration drive, written from its equations for comparison only: slow, plain.

It shares nothing with the engine. Each mode of the automaton is integrated by scipy's DOP853; guards are examined on
samples of the step's dense output, refined where they come near zero, and events polished by integrating up to them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853, solve_ivp
from scipy.optimize import brentq, minimize_scalar

Floats = NDArray[np.float64]

TORQUE_STATES = ("engaged", "beyond", "locked")
#: Points of a step at which guards and extrema are examined.
SAMPLES = 13
#: A torque this near to the bound of a lock, in N*m, counts as on it.
ROUNDING = 1e-11
#: Transitions in a run after which it is taken for one whose events accumulate.
MOST_EVENTS = 600


class Accumulating(Exception):  # noqa: N818 - not a failure
    """Events accumulate at a moment: clutches that lock together, which this plain automaton does not resolve."""


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

    def torque(self, u: Any) -> Any:
        """Law (3), straight beyond the end of the data; numbers or arrays."""
        inside = np.minimum(u, self.limit)
        value = sum(c * inside**k for k, c in enumerate(self.law))
        slope = sum(k * c * inside ** (k - 1) for k, c in enumerate(self.law) if k > 0)
        return value + np.where(u > self.limit, slope * (u - inside), 0.0)


@dataclass(frozen=True)
class UpwardCrossing:
    """A guard that is not yet on watch while the quantity is positive: it must have been negative first."""

    quantity: Callable[[Any, Any], Any]

    def __call__(self, t: Any, y: Any) -> Any:
        return -self.quantity(t, y)


@dataclass
class Outcome:
    """What a run gave: states at whole periods, integrals and extrema over the window, number of transitions."""

    states: list[tuple[str, ...]] = field(default_factory=list)
    values: list[Floats] = field(default_factory=list)
    events: int = 0
    engagements: int = 0
    largest: dict[str, float] = field(default_factory=dict)
    mean: dict[str, float] = field(default_factory=dict)


class Drive:
    """The machine of flat parameters, as the engine takes them."""

    def __init__(self, columns: Mapping[str, Any], literal: bool) -> None:
        def get(path: str, default: float = 0.0) -> float:
            return float(columns.get(path, default))

        self.n = 1 + max(int(path.split(".")[1]) for path in columns if path.startswith("pendulums."))
        self.literal = literal
        self.nu = 2.0 * math.pi * get("excitation.frequency")
        self.period = 1.0 / get("excitation.frequency")
        self.d, self.b = get("excitation.amplitude_x"), get("excitation.amplitude_y")
        self.chi = get("excitation.phase")
        self.g = get("gravity", 9.80665)
        self.inertia, self.load = get("shaft.inertia"), get("shaft.load")
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
            )
            for i in range(self.n)
        ]
        # Angles, speeds, windups; shaft's angle and speed; integrals: torque, input, loss, clutch work, angles.
        n = self.n
        self.shaft = 3 * n + 1
        self.start = np.zeros(4 * n + 6)
        self.start[:n] = [get(f"pendulums.{i}.initial_angle") for i in range(n)]
        self.start[n : 2 * n] = [get(f"pendulums.{i}.initial_speed") for i in range(n)]
        self.start[self.shaft] = get("shaft.initial_speed")
        self.clutches = ["free"] * n
        self.shaft_state = "rotating" if self.start[self.shaft] > 0.0 or self.load == 0.0 else "held"

    # -- equations ---------------------------------------------------------------------------------------------------

    def base(self, t: Any) -> tuple[Any, Any]:
        """x'' and y'' of (2)."""
        square = self.nu**2
        return -self.d * square * np.cos(self.nu * t), -self.b * square * np.sin(self.nu * t + self.chi)

    def free_moment(self, i: int, t: Any, y: Any) -> Any:
        """J phi'' of (1) without the clutch."""
        p = self.pendulums[i]
        phi, speed = y[i], y[self.n + i]
        ax, ay = self.base(t)
        drive = p.moment * (ax * np.cos(phi) + (ay + self.g) * np.sin(phi))
        return drive - p.spring * phi - p.damping * speed

    def torques(self, t: Any, y: Any) -> tuple[list[Any], Any]:
        """Torque of every clutch and the shaft's acceleration in the present mode."""
        sprung = [
            self.pendulums[i].torque(y[2 * self.n + i]) if self.clutches[i] in ("engaged", "beyond") else 0.0 * t
            for i in range(self.n)
        ]
        locked = [i for i in range(self.n) if self.clutches[i] == "locked"]
        free = {i: self.free_moment(i, t, y) for i in locked}
        acceleration = 0.0 * t
        if self.shaft_state == "rotating":
            together = self.inertia + sum(self.pendulums[i].inertia for i in locked)
            acceleration = (sum(sprung) + sum(free.values()) - self.load) / together
        for i in locked:
            sprung[i] = free[i] - self.pendulums[i].inertia * acceleration
        return sprung, acceleration

    def rates(self, t: float, y: Floats) -> Floats:
        """Right-hand side of everything that is integrated."""
        n = self.n
        torque, acceleration = self.torques(t, y)
        out = np.zeros_like(y)
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
        out[3 * n] = shaft
        out[self.shaft] = acceleration
        out[3 * n + 2] = sum(torque)
        out[3 * n + 5] = sum(torque) * shaft
        return out

    # -- automaton ---------------------------------------------------------------------------------------------------

    def guards(self) -> Iterator[tuple[Callable[[Any, Any], Any], Callable[[Floats, float], None]]]:
        """Functions that are positive until their event, each with what the event does (docs/theory.md)."""
        n = self.n
        if self.shaft_state == "held":
            yield lambda t, y: self.load - sum(self.torques(t, y)[0]), lambda y, t: self.turn("rotating")
        elif self.load > 0.0:
            yield lambda t, y: y[self.shaft], self.stop
        for i, p in enumerate(self.pendulums):
            state = self.clutches[i]

            def lead(t: Any, y: Any, i: int = i) -> Any:
                return y[n + i] - y[self.shaft]

            def windup(t: Any, y: Any, i: int = i) -> Any:
                return y[2 * n + i]

            if state == "free":
                yield lambda t, y, f=lead: -f(t, y), lambda y, t, i=i: self.interact(i, y, t, crossing=True)
            elif state == "take_up":
                yield lambda t, y, f=windup: -f(t, y), lambda y, t, i=i: self.wind(i, y, 0.0, "engaged")
                yield lead, lambda y, t, i=i: self.overrun(i, y)
            elif state == "locked":
                yield lambda t, y, i=i: self.torques(t, y)[0][i], lambda y, t, i=i: self.unlock(i, y, "free")
                yield (
                    lambda t, y, i=i, p=p: p.law[0] - self.torques(t, y)[0][i],
                    lambda y, t, i=i: self.unlock(i, y, "engaged"),
                )
            else:
                if state == "engaged":
                    yield windup, lambda y, t, i=i: self.wind(i, y, 0.0, "free")
                    if p.limit < math.inf:
                        yield (
                            lambda t, y, f=windup, p=p: p.limit - f(t, y),
                            lambda y, t, i=i, p=p: self.wind(i, y, p.limit, "beyond"),
                        )
                else:
                    yield (
                        lambda t, y, f=windup, p=p: f(t, y) - p.limit,
                        lambda y, t, i=i, p=p: self.wind(i, y, p.limit, "engaged"),
                    )
                if self.literal:
                    yield UpwardCrossing(lead), lambda y, t, i=i: self.interact(i, y, t, crossing=True)

    def turn(self, state: str) -> None:
        self.shaft_state = state

    def stop(self, y: Floats, t: float) -> None:
        y[self.shaft] = 0.0
        for i in range(self.n):
            if self.clutches[i] == "locked":
                y[self.n + i] = 0.0
        self.shaft_state = "held"

    def wind(self, i: int, y: Floats, windup: float, state: str) -> None:
        self.out.engagements += self.clutches[i] == "take_up"
        y[2 * self.n + i] = windup
        self.clutches[i] = state

    def overrun(self, i: int, y: Floats) -> None:
        y[self.n + i] = y[self.shaft]
        self.clutches[i] = "free"

    def unlock(self, i: int, y: Floats, state: str) -> None:
        y[self.n + i] = y[self.shaft]
        y[2 * self.n + i] = 0.0
        self.clutches[i] = state

    def interact(self, i: int, y: Floats, t: float, crossing: bool) -> None:
        """t_ni of (5)."""
        p = self.pendulums[i]
        if crossing:
            y[self.n + i] = y[self.shaft]
        y[2 * self.n + i] = -p.backlash
        if p.backlash > 0.0:
            self.clutches[i] = "take_up"
            return
        self.out.engagements += 1
        if not crossing or p.law[0] <= 0.0:
            self.clutches[i] = "engaged"
            return
        # Filippov: would the torque of the lock lie within its bounds?
        self.clutches[i] = "locked"
        needed = self.torques(t, y)[0][i]
        if self.shaft_state == "held":
            self.shaft_state = "rotating"
            moving, acceleration = self.torques(t, y)
            if acceleration > 0.0:
                needed = moving[i]
            self.shaft_state = "held"
        if needed > p.law[0]:
            self.clutches[i] = "engaged"

    def follow(self, y: Floats, t: float) -> None:
        """Transitions that the last one causes at once."""
        for _ in range(50):
            torque, _ = self.torques(t, y)
            if self.shaft_state == "held" and sum(torque) > self.load + ROUNDING:
                self.shaft_state = "rotating"
            else:
                for i, p in enumerate(self.pendulums):
                    if self.clutches[i] == "locked" and not -ROUNDING <= torque[i] <= p.law[0] + ROUNDING:
                        self.unlock(i, y, "free" if torque[i] < 0.0 else "engaged")
                        break
                else:
                    return
            self.out.events += t > 0.0
        raise AssertionError("the mode does not settle")

    # -- integration -------------------------------------------------------------------------------------------------

    def run(self, duration: int, window: tuple[int, int], rtol: float = 1e-12) -> Outcome:
        """Run so many periods; means and extrema over a window between whole periods."""
        self.out, self.rtol = Outcome(), rtol
        y, t, n = self.start.copy(), 0.0, self.n
        for i in range(n):
            lead = y[n + i] - y[self.shaft]
            torque, acceleration = self.torques(t, y)
            gain = (self.free_moment(i, t, y) - torque[i]) / self.pendulums[i].inertia - acceleration
            if lead > 0.0 or (lead == 0.0 and gain > 0.0):
                self.interact(i, y, t, crossing=lead == 0.0)
        self.follow(y, t)
        begin: Floats = y
        for k in range(duration):
            self.watching = window[0] <= k < window[1]
            if k == window[0]:
                begin, self.out.engagements = y.copy(), 0
            y = self.advance(t, (k + 1) * self.period, y)
            t = (k + 1) * self.period
            self.out.values.append(y.copy())
            self.out.states.append((self.shaft_state, *self.clutches))
            if k + 1 == window[1]:
                self.conclude((y - begin) / ((window[1] - window[0]) * self.period))
        return self.out

    def conclude(self, mean: Floats) -> None:
        n = self.n
        self.window_engagements = self.out.engagements
        names = ("shaft.speed.mean", "", "torque.mean", "power.input.mean", "power.loss.mean", "power.clutch.mean")
        self.out.mean = {name: float(mean[3 * n + k]) for k, name in enumerate(names) if name}
        self.out.mean |= {f"pendulums.{i}.angle.mean": float(mean[3 * n + 6 + i]) for i in range(n)}

    def advance(self, t: float, end: float, y: Floats) -> Floats:
        """Integrate to ``end`` through every event."""
        while t < end:
            solver = DOP853(
                self.rates,
                t,
                y,
                end,
                rtol=self.rtol,
                atol=1e-14,
                max_step=self.period / 40,
                first_step=min(1e-6, end - t),
            )
            fired = None
            while solver.status == "running" and fired is None:
                before = solver.y.copy()
                solver.step()
                assert solver.status != "failed"
                times = np.linspace(solver.t_old, solver.t, SAMPLES)
                dense = solver.dense_output()
                values = dense(times)
                values[:, 0], values[:, -1] = before, solver.y
                fired = self.first_event(times, values, dense)
                if fired is None:
                    self.watch(times, values, dense)
                else:
                    until = np.linspace(solver.t_old, fired[0], SAMPLES)
                    self.watch(until, dense(until), dense)
            if fired is None:
                return solver.y
            t, y = self.polish(solver.t_old, before, fired[0], fired[1])
            fired[2](y, t)
            self.out.events += 1
            if self.out.events > MOST_EVENTS:
                raise Accumulating
            self.follow(y, t)
        return y

    def first_event(self, times: Floats, values: Floats, dense: Any) -> tuple[float, Any, Any] | None:
        """Earliest guard that fires within a step: time, guard, what it does."""
        found: list[tuple[float, Any, Any]] = []
        for guard, act in self.guards():
            g = np.broadcast_to(guard(times, values), times.shape)

            def at(s: float, guard: Any = guard) -> float:
                return float(guard(s, dense(s)))

            bad = np.flatnonzero(g[1:] <= 0.0) + 1
            if isinstance(guard, UpwardCrossing):
                bad = np.flatnonzero((g[1:] <= 0.0) & (g[:-1] > 0.0)) + 1
                if not bad.size and g[0] <= 0.0:
                    continue
            k = int(bad[0]) if bad.size else 0
            if k == 1 and (g[0] <= 0.0 or at(times[0]) <= 0.0):
                found.append((float(times[0]), guard, act))
            elif k > 0:
                found.append((brentq(at, times[k - 1], times[k], xtol=1e-16, rtol=1e-15), guard, act))
            else:
                low = int(np.argmin(g[1:-1])) + 1
                dip = g[low - 1] + g[low + 1] - 2.0 * g[low]
                if 0.0 < g[low] < dip and times[low - 1] > times[0]:
                    best = minimize_scalar(at, bounds=(times[low - 1], times[low + 1]), method="bounded")
                    if best.fun < 0.0:
                        found.append((brentq(at, times[low - 1], best.x, xtol=1e-16, rtol=1e-15), guard, act))
        return min(found, key=lambda event: event[0], default=None)

    def polish(self, t: float, y: Floats, event: float, guard: Any) -> tuple[float, Floats]:
        """Time and state of the event, placed by Newton's method on the integration itself, not on its dense output."""
        end = y
        for _ in range(3):
            if event <= t:
                return t, y.copy()
            end = solve_ivp(self.rates, (t, event), y, "DOP853", rtol=self.rtol, atol=1e-15).y[:, -1]
            value = float(guard(event, end))
            ahead = end + 1e-9 * self.rates(event, end)
            slope = (float(guard(event + 1e-9, ahead)) - value) / 1e-9
            step = -value / slope if slope != 0.0 else 0.0
            if not abs(step) < 1e-7 * self.period:
                break
            event += step
        return event, solve_ivp(self.rates, (t, event), y, "DOP853", rtol=self.rtol, atol=1e-15).y[
            :, -1
        ] if event > t else y

    def watch(self, times: Floats, values: Floats, dense: Any) -> None:
        """Extrema within the step: the best sample, then the dense output around it."""
        if not self.watching or times[-1] <= times[0]:
            return
        series = self.watched(times, values)
        for name, q in series.items():
            k = int(np.argmax(q))
            known = self.out.largest.get(name, -math.inf)
            low, high = max(0, k - 1), min(len(q) - 1, k + 1)
            if q[k] + (q[k] - min(q[low], q[high])) > known:
                best = minimize_scalar(
                    lambda s, name=name: -float(self.watched(s, dense(s))[name]),
                    bounds=(times[low], times[high]),
                    method="bounded",
                    options={"xatol": 1e-7 * (times[high] - times[low])},
                )
                self.out.largest[name] = max(known, float(q[k]), -float(best.fun))

    def watched(self, t: Any, y: Any) -> dict[str, Any]:
        """Quantities whose largest value is wanted (minima as the negative)."""
        n = self.n
        torque, _ = self.torques(t, y)
        speed = y[self.shaft]
        out = {
            "shaft.speed.max": speed,
            "shaft.speed.min": -speed,
            "torque.max": sum(torque),
            "power.clutch.max": sum(torque) * speed,
        }
        for i in range(n):
            out[f"pendulums.{i}.angle.max"], out[f"pendulums.{i}.angle.min"] = y[i], -y[i]
            out[f"pendulums.{i}.speed.max"], out[f"pendulums.{i}.speed.min"] = y[n + i], -y[n + i]
            out[f"pendulums.{i}.torque.max"] = torque[i]
            if self.clutches[i] in TORQUE_STATES:
                out[f"pendulums.{i}.windup.max"] = y[2 * n + i]
        return out
