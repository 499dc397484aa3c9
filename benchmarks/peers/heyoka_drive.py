"""The vibration drive in heyoka (Biscani and Izzo 2021), a Taylor integrator with just-in-time compiled systems.

Eight cases are integrated at once, in the lanes of ``taylor_adaptive_batch``. The mode of the automaton stands in the
lane's parameters (0 or 1), transitions are terminal events whose guards are switched by the mode, and extrema are
non-terminal events, watched in the window only. It is specialised where that helps it: everything that is the same in
all cases is a literal in its equations, and it computes nothing but what the reference values hold.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import heyoka as hy
import numpy as np

from benchmarks.workloads import (
    COEFFICIENTS,
    EVENTS,
    GRAVITY,
    PENDULUM,
    PERIODS,
    SHAFT_INERTIA,
    WINDOW_START,
    Floats,
    Ints,
    Outcome,
    Workload,
)

LANES = 8
_BACKLASH = PENDULUM["backlash"]
_C2, _C4 = COEFFICIENTS[1], COEFFICIENTS[3]
#: A rotating shaft that starts from exactly zero speed must not be found to stop there.
_STANDSTILL = 1e-13
#: Seconds in which a guard that has fired does not fire again. It is reversed or left by its mode then, so that only
#: the rounding of its zero is to be passed over; at loose tolerances heyoka's own choice would hide true events.
_COOLDOWN = 1e-11

#: Parameters of a lane: nu, amplitude * nu^2, load, whether the shaft rotates; then for each pendulum the direction in
#: which w and u are watched (+1, -1, or 0: not watched) and whether the clutch transmits torque.
_NU, _BASE, _LOAD, _ROTATING, _CLUTCHES = range(5)
#: State: for each pendulum phi, phi', u; then angle and speed of the shaft; in the window of a full run two integrals.
_PER_PENDULUM = 3


def clutch_torque(u: Any) -> Any:
    """The clutch law, for numbers and for expressions."""
    return u * (_C2 + _C4 * (u * u))


class _Model:
    """Expressions of equations and guards."""

    def __init__(self, rates: tuple[float, ...]) -> None:
        self.n = n = len(rates)
        nu, base, self.load, self.rotating = (hy.par[k] for k in range(_CLUTCHES))
        self.clutches = [[hy.par[_CLUTCHES + 3 * i + k] for k in range(3)] for i in range(n)]
        self.pendulums = [hy.make_vars(f"phi{i}", f"w{i}", f"u{i}") for i in range(n)]
        self.angle, self.speed = hy.make_vars("angle", "speed")
        inertia, moment = PENDULUM["inertia"], PENDULUM["mass"] * PENDULUM["arm"]
        ax, ay = -base * hy.cos(nu * hy.time), -base * hy.sin(nu * hy.time)
        torques = [mode[2] * clutch_torque(u) for mode, (_, _, u) in zip(self.clutches, self.pendulums, strict=True)]
        self.torque = sum(torques[1:], torques[0])
        self.equations = []
        self.accelerations = []
        self.input_power = hy.expression(0.0)
        for rate, torque, (phi, w, u) in zip(rates, torques, self.pendulums, strict=True):
            spring = rate * PENDULUM["spring_arm"] ** 2
            sine, cosine = hy.sin(phi), hy.cos(phi)
            acceleration = (
                (moment / inertia) * ((GRAVITY + ay) * sine + ax * cosine)
                - (spring / inertia) * phi - (PENDULUM["damping"] / inertia) * w - torque * (1.0 / inertia)
            )  # fmt: skip
            self.accelerations.append(acceleration)
            self.input_power += moment * w * (ay * sine + ax * cosine)
            self.equations += [(phi, w), (w, acceleration), (u, w - self.speed)]
        acceleration = self.rotating * ((self.torque - self.load) * (1.0 / SHAFT_INERTIA))
        self.equations += [(self.angle, self.speed), (self.speed, acceleration)]

    def torque_slope(self) -> Any:
        """d/dt of the torque; 1 where no clutch transmits any, so that no root is found there."""
        slope, idle = hy.expression(0.0), hy.expression(1.0)
        for (_, w, u), (_, _, engaged) in zip(self.pendulums, self.clutches, strict=True):
            slope += engaged * ((_C2 + 3.0 * _C4 * (u * u)) * (w - self.speed))
            idle *= 1.0 - engaged
        return slope + idle


class HeyokaDrive:
    """Both integrators of a workload, up to the window and within it, and the modes they share.

    ``full`` computes all the quantities the reference holds (integrals of torque and input power, extrema of the
    pendulum), not just those that are compared.
    """

    def __init__(self, workload: Workload, tolerance: float, *, full: bool = False) -> None:
        self.workload, self.full = workload, full
        self.n = workload.pendulums
        self.events = [0] * LANES
        self.peaks = {name: [0.0] * LANES for name in ("speed", "torque", "angle", "swing")}
        self.before = self._integrator(tolerance, window=False)
        self.within = self._integrator(tolerance, window=True)

    def _integrator(self, tolerance: float, *, window: bool) -> Any:
        model = _Model(self.workload.spring_rates)
        memory: list[memoryview] = []  # states and parameters, once the integrator is made
        rising, falling = hy.event_direction.positive, hy.event_direction.negative
        terminal = []
        for i, ((_, w, u), (watch_w, watch_u, _)) in enumerate(zip(model.pendulums, model.clutches, strict=True)):
            # A guard that is not watched is the constant 1.
            for guard, watch, act in ((w - model.speed, watch_w, self._on_w), (u, watch_u, self._on_u)):
                equation = watch * guard + (1.0 - watch * watch)
                terminal.append(
                    hy.t_event_batch(equation, callback=act(i, memory), direction=rising, cooldown=_COOLDOWN)
                )
        held = (1.0 - model.rotating) * (model.load - model.torque)
        shaft = model.rotating * (model.speed + _STANDSTILL) + held
        terminal.append(hy.t_event_batch(shaft, callback=self._on_shaft(memory), direction=falling, cooldown=_COOLDOWN))
        peaks = []
        equations = model.equations
        if window:
            driven = model.rotating * (model.torque - model.load + 1.0) - 1.0
            peaks.append(hy.nt_event_batch(driven, callback=self._on_peak("speed", memory), direction=falling))
            slope = model.torque_slope()
            peaks.append(hy.nt_event_batch(slope, callback=self._on_peak("torque", memory), direction=falling))
        if window and self.full:
            integrals = hy.make_vars("impulse", "work")
            equations = [*equations, *zip(integrals, (model.torque, model.input_power), strict=True)]
            _, w, _ = model.pendulums[0]
            peaks.append(hy.nt_event_batch(w, callback=self._on_peak("angle", memory)))
            peaks.append(hy.nt_event_batch(model.accelerations[0], callback=self._on_peak("swing", memory)))
        integrator = hy.taylor_adaptive_batch(
            equations, np.zeros((len(equations), LANES)), pars=np.zeros((_CLUTCHES + 3 * self.n, LANES)),
            tol=tolerance, t_events=terminal, nt_events=peaks, fast_math=True,
        )  # fmt: skip
        # Plain memory is several times quicker to index than arrays.
        memory += [memoryview(array).cast("B").cast("d") for array in (integrator.state, integrator.pars)]
        return integrator

    def _on_w(self, i: int, memory: list[memoryview]) -> Callable[..., bool]:
        windup = (_PER_PENDULUM * i + 2) * LANES
        watch_w = (_CLUTCHES + 3 * i) * LANES
        watch_u = watch_w + LANES
        angles = self.peaks["angle"]

        def act(_integrator: Any, _sign: int, lane: int) -> bool:
            state, modes = memory
            self.events[lane] += 1
            if self.full and i == 0:  # with the shaft held the pendulum turns back here
                angles[lane] = max(angles[lane], abs(state[lane]))
            if modes[watch_w + lane] > 0.0:  # FREE: the interaction starts
                state[windup + lane] = -_BACKLASH
                modes[watch_w + lane], modes[watch_u + lane] = -1.0, 1.0
            else:  # TAKE-UP: overrun before contact
                modes[watch_w + lane], modes[watch_u + lane] = 1.0, 0.0
            return True

        return act

    def _on_u(self, i: int, memory: list[memoryview]) -> Callable[..., bool]:
        watch_w = (_CLUTCHES + 3 * i) * LANES
        watch_u, engaged = watch_w + LANES, watch_w + 2 * LANES

        def act(_integrator: Any, _sign: int, lane: int) -> bool:
            modes = memory[1]
            self.events[lane] += 1
            contact = modes[watch_u + lane] > 0.0
            modes[watch_w + lane] = 0.0 if contact else 1.0
            modes[watch_u + lane] = -1.0 if contact else 0.0
            modes[engaged + lane] = 1.0 if contact else 0.0
            return True

        return act

    def _on_shaft(self, memory: list[memoryview]) -> Callable[..., bool]:
        speed, rotating = (_PER_PENDULUM * self.n + 1) * LANES, _ROTATING * LANES

        def act(_integrator: Any, _sign: int, lane: int) -> bool:
            state, modes = memory
            self.events[lane] += 1
            if modes[rotating + lane] > 0.0:
                modes[rotating + lane] = state[speed + lane] = 0.0
            else:
                modes[rotating + lane] = 1.0
            return True

        return act

    def _on_peak(self, name: str, memory: list[memoryview]) -> Callable[..., None]:
        peaks = self.peaks[name]
        engaged = [(_CLUTCHES + 3 * i + 2) * LANES for i in range(self.n)]
        row = {"angle": 0, "swing": 1, "speed": _PER_PENDULUM * self.n + 1, "torque": 0}[name]

        def torque(state: Floats, lane: int) -> float:
            modes = memory[1]
            us = (state[_PER_PENDULUM * i + 2, lane] for i in range(self.n) if modes[engaged[i] + lane] > 0.0)
            return sum(map(clutch_torque, us), 0.0)

        def note(integrator: Any, time: float, _sign: int, lane: int) -> None:
            state = integrator.update_d_output(time)
            value = torque(state, lane) if name == "torque" else abs(state[row, lane])
            if value > peaks[lane]:
                peaks[lane] = value

        return note

    def _start(self, cases: Ints) -> Floats:
        """Set the lanes to rest; the excitation's periods."""
        nu, amplitude, load = (axis[cases] for axis in self.workload.grid)
        first = self.before
        first.state[:] = 0.0
        first.pars[:] = 0.0
        first.pars[_NU], first.pars[_BASE], first.pars[_LOAD] = nu, amplitude * nu**2, load
        first.pars[_CLUTCHES::3] = 1.0
        first.set_time(np.zeros(LANES))
        first.reset_cooldowns()
        self.events[:] = [0] * LANES
        return 2.0 * np.pi / nu

    def _propagate(self, integrator: Any, until: Floats) -> int:
        integrator.propagate_until(until)
        for outcome, *_ in integrator.propagate_res:
            assert outcome == hy.taylor_outcome.time_limit, outcome
        return sum(result[3] for result in integrator.propagate_res)

    def _batch(self, cases: Ints) -> tuple[dict[str, Floats], int]:
        """Eight cases: their values and steps."""
        shaft = _PER_PENDULUM * self.n
        period = self._start(cases)
        steps = self._propagate(self.before, WINDOW_START * period)
        then = self.within
        then.state[:] = 0.0
        then.state[: shaft + 2] = begin = self.before.state
        then.pars[:] = self.before.pars
        then.set_time(WINDOW_START * period)
        then.reset_cooldowns()
        for name, row in (("angle", 0), ("swing", 1), ("speed", shaft + 1)):
            self.peaks[name][:] = np.abs(begin[row]).tolist()
        self.peaks["torque"][:] = self._torques(begin).tolist()
        steps += self._propagate(then, PERIODS * period)
        length = (PERIODS - WINDOW_START) * period
        values = {
            "shaft.speed.mean": (then.state[shaft] - begin[shaft]) / length,
            "shaft.speed.max": np.maximum(self.peaks["speed"], then.state[shaft + 1]),
            "torque.max": np.maximum(self.peaks["torque"], self._torques(then.state)),
            EVENTS: np.array(self.events, dtype=np.float64),
        }
        if self.full:
            values["torque.mean"] = then.state[shaft + 2] / length
            values["power.input.mean"] = then.state[shaft + 3] / length
            values["pendulums.0.angle.max_abs"] = np.maximum(self.peaks["angle"], np.abs(then.state[0]))
            values["pendulums.0.speed.max_abs"] = np.maximum(self.peaks["swing"], np.abs(then.state[1]))
        return values, steps

    def _torques(self, state: Floats) -> Floats:
        modes = (self.before if state is self.before.state else self.within).pars
        rows = range(self.n)
        return sum(
            (modes[_CLUTCHES + 3 * i + 2] * clutch_torque(state[_PER_PENDULUM * i + 2]) for i in rows),
            np.zeros(LANES),
        )

    def run(self, cases: Ints) -> Outcome:
        """Run the cases in batches of eight; the last batch is filled up with cases that are thrown away."""
        parts, steps = [], 0
        for start in range(0, len(cases), LANES):
            values, more = self._batch(np.resize(cases[start : start + LANES], LANES))
            parts.append(values)
            steps += more
        merged = {name: np.concatenate([part[name] for part in parts])[: len(cases)] for name in parts[0]}
        return Outcome(cases, merged, steps)
