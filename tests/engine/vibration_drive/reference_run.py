"""Runs of the second implementation: each mode of its automaton is integrated by scipy's DOP853.

Guards are examined on samples of the step's dense output, refined where they come near zero, and events polished by
integrating up to them.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.integrate import DOP853, solve_ivp
from scipy.optimize import brentq, minimize_scalar

from tests.engine.vibration_drive.reference_automaton import Automaton, UpwardCrossing
from tests.engine.vibration_drive.reference_equations import Floats, Outcome

TORQUE_STATES = ("engaged", "beyond", "locked")
#: Points of a step at which guards and extrema are examined.
SAMPLES = 13
#: Transitions in a run after which it is taken for one whose events accumulate.
MOST_EVENTS = 600


class Accumulating(Exception):  # noqa: N818 - not a failure
    """Events accumulate at a moment: clutches that lock together, which this plain automaton does not resolve."""


class Drive(Automaton):
    """A machine that can be run."""

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
        square, cube = mean[4 * n + 6 : 4 * n + 8]
        self.out.mean["power.bearing.mean"] = self.bearing * square
        self.out.mean["power.linear.mean"] = self.linear * square
        self.out.mean["power.quadratic.mean"] = self.quadratic * cube
        self.out.mean["power.useful.mean"] = float(mean[5 * n + 8])
        clutches = mean[4 * n + 8 : 5 * n + 8]
        self.out.mean["power.loss.mean"] += float(np.sum(clutches))
        self.out.mean |= {f"pendulums.{i}.power.clutch_loss": float(clutches[i]) for i in range(n)}
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
            # Those at t = 0 belong to the start.
            self.out.events += t > 0.0
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
        """Extrema within the step: the best sample, then thrice the best one of the dense output around it."""
        if not self.watching or times[-1] <= times[0]:
            return
        for name, q in self.watched(times, values).items():
            k = int(np.argmax(q))
            known = self.out.largest.get(name, -math.inf)
            # At the edge of a step the peak may lie between two samples that are alike: look at the next one too.
            lowest = np.min(q[max(0, k - 2) : k + 3])
            if q[k] + (q[k] - lowest) > known:
                peak, around = float(q[k]), times
                for _ in range(3):
                    around = np.linspace(around[max(0, k - 1)], around[min(len(around) - 1, k + 1)], 2 * SAMPLES)
                    finer = self.watched(around, dense(around))[name]
                    k = int(np.argmax(finer))
                    peak = max(peak, float(finer[k]))
                self.out.largest[name] = max(known, peak)

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
            "power.useful.max": self.useful(speed, y[3 * n]) * speed,
        }
        for i in range(n):
            out[f"pendulums.{i}.angle.max"], out[f"pendulums.{i}.angle.min"] = y[i], -y[i]
            out[f"pendulums.{i}.speed.max"], out[f"pendulums.{i}.speed.min"] = y[n + i], -y[n + i]
            out[f"pendulums.{i}.torque.max"] = torque[i]
            if self.clutches[i] in TORQUE_STATES:
                out[f"pendulums.{i}.windup.max"] = y[2 * n + i]
        return out
