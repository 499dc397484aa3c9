"""The vibration drive in scipy: ``solve_ivp`` with DOP853, restarted at every located transition."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

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

_FREE, _TAKE_UP, _ENGAGED = range(3)
_BACKLASH = PENDULUM["backlash"]
_C2, _C4 = COEFFICIENTS[1], COEFFICIENTS[3]
#: Absolute tolerance over relative: speeds are of the order of 1 rad/s, windups of 0.01 rad.
_ABSOLUTE = 1e-2
#: scipy finds a crossing by the signs at a step's ends: two in one step are missed. Steps are kept to a share of the
#: excitation's period, which costs next to nothing at tight tolerances.
_STEPS_PER_PERIOD = 20.0
#: Guards are moved by this much, so that one that starts on zero starts on its own side of it.
_ASIDE = 1e-13

Guard = Callable[[float, Floats], float]


def _torque(u: float) -> float:
    return u * (_C2 + _C4 * u * u)


class _Case:
    """One case: the automaton's modes and the functions scipy calls.

    State: phi, phi', u of each pendulum, then angle and speed of the shaft.
    """

    def __init__(self, rates: tuple[float, ...], nu: float, amplitude: float, load: float) -> None:
        self.n, self.nu, self.base, self.load = len(rates), nu, amplitude * nu**2, load
        inertia = PENDULUM["inertia"]
        self.moment = PENDULUM["mass"] * PENDULUM["arm"] / inertia
        self.damping, self.per_inertia = PENDULUM["damping"] / inertia, 1.0 / inertia
        self.springs = [rate * PENDULUM["spring_arm"] ** 2 / inertia for rate in rates]
        self.clutch = [_FREE] * self.n
        self.rotating = False
        self.events = 0

    def total(self, y: Any) -> float:
        """Sum of the clutch torques."""
        return sum(_torque(y[3 * i + 2]) for i in range(self.n) if self.clutch[i] == _ENGAGED)

    def rate(self, t: float, y: Floats) -> list[float]:
        """The right-hand side. Lists and ``math`` are quicker than small arrays."""
        values = y.tolist()
        ax, ay = -self.base * math.cos(self.nu * t), -self.base * math.sin(self.nu * t)
        speed = values[-1]
        out, total = [], 0.0
        for i in range(self.n):
            phi, w, u = values[3 * i : 3 * i + 3]
            torque = _torque(u) if self.clutch[i] == _ENGAGED else 0.0
            total += torque
            drive = self.moment * ((GRAVITY + ay) * math.sin(phi) + ax * math.cos(phi))
            out += [w, drive - self.springs[i] * phi - self.damping * w - torque * self.per_inertia, w - speed]
        out += [speed, (total - self.load) / SHAFT_INERTIA if self.rotating else 0.0]
        return out

    def guards(self) -> list[tuple[Guard, Callable[[Floats], None]]]:
        """The guards of the modes the case is in, with what to do where they fire."""
        found: list[tuple[Guard, Callable[[Floats], None]]] = []
        for i, state in enumerate(self.clutch):
            if state == _FREE:
                found.append((self._guard(lambda y, i=i: y[3 * i + 1] - y[-1], 1.0), self._to(i, _TAKE_UP)))
            elif state == _TAKE_UP:
                found.append((self._guard(lambda y, i=i: y[3 * i + 2], 1.0), self._to(i, _ENGAGED)))
                found.append((self._guard(lambda y, i=i: y[3 * i + 1] - y[-1], -1.0), self._to(i, _FREE)))
            else:
                found.append((self._guard(lambda y, i=i: y[3 * i + 2], -1.0), self._to(i, _FREE)))
        if self.rotating:
            found.append((self._guard(lambda y: y[-1], -1.0), self._stop))
        elif _ENGAGED in self.clutch:
            found.append((self._guard(lambda y: self.total(y) - self.load, 1.0), self._set_off))
        return found

    def peaks(self) -> list[Guard]:
        """Functions that fall through zero where the shaft's speed or the torque may be largest."""
        found: list[Guard] = []
        if _ENGAGED in self.clutch:
            found.append(self._guard(self._torque_slope, -1.0, terminal=False))
            if self.rotating:
                found.append(self._guard(lambda y: self.total(y) - self.load, -1.0, terminal=False))
        return found

    def _torque_slope(self, y: Floats) -> float:
        driving = (3 * i for i in range(self.n) if self.clutch[i] == _ENGAGED)
        return sum((_C2 + 3.0 * _C4 * y[k + 2] ** 2) * (y[k + 1] - y[-1]) for k in driving)

    @staticmethod
    def _guard(value: Callable[[Floats], float], direction: float, *, terminal: bool = True) -> Guard:
        aside = direction * _ASIDE if terminal else 0.0

        def guard(_t: float, y: Floats) -> float:
            return value(y) - aside

        guard.terminal, guard.direction = terminal, direction  # type: ignore[attr-defined]
        return guard

    def missed_contact(self, y: Floats) -> bool:
        """Whether a clutch is said to be taking up its backlash although its windup is positive."""
        return any(state == _TAKE_UP and y[3 * i + 2] > 2.0 * _ASIDE for i, state in enumerate(self.clutch))

    def _to(self, i: int, target: int) -> Callable[[Floats], None]:
        def act(y: Floats) -> None:
            self.clutch[i] = target
            if target == _TAKE_UP:
                y[3 * i + 2] = -_BACKLASH

        return act

    def _stop(self, y: Floats) -> None:
        y[-1] = 0.0
        self.rotating = False

    def _set_off(self, _y: Floats) -> None:
        self.rotating = True


class _Window:
    """Largest speed and torque seen."""

    def __init__(self) -> None:
        self.speed = self.torque = 0.0

    def note(self, case: _Case, y: Any) -> None:
        self.speed = max(self.speed, float(y[-1]))
        self.torque = max(self.torque, case.total(y))


class ScipyDrive:
    """Runs cases one after the other."""

    def __init__(self, workload: Workload, tolerance: float) -> None:
        self.workload, self.tolerance = workload, tolerance

    def _advance(self, case: _Case, t: float, end: float, y: Floats, window: _Window | None) -> tuple[Floats, int]:
        """Integrate to ``end`` through all transitions; the state there and the steps taken."""
        steps = 0
        limit = end
        while t < end:
            guards = case.guards()
            peaks = case.peaks() if window else []
            solution: Any = solve_ivp(
                case.rate, (t, limit), y, method="DOP853", rtol=self.tolerance, atol=self.tolerance * _ABSOLUTE,
                max_step=2.0 * math.pi / case.nu / _STEPS_PER_PERIOD, events=[guard for guard, _ in guards] + peaks,
            )  # fmt: skip
            assert solution.status >= 0, solution.message
            steps += len(solution.t) - 1
            if solution.status == 1 and case.missed_contact(solution.y[:, -1]):
                # Contact was made and would be lost within one step, which ends now where the windup is largest.
                limit = solution.t[-1]
                continue
            limit = end
            if window:
                for found in solution.y_events[len(guards) :]:
                    for state in found:
                        window.note(case, state)
                window.note(case, solution.y[:, -1])
            t, y = solution.t[-1], solution.y[:, -1].copy()
            for (_, act), times in zip(guards, solution.t_events, strict=False):
                if solution.status == 1 and len(times):
                    act(y)
                    case.events += 1
        return y, steps

    def run(self, cases: Ints) -> Outcome:
        """Run the cases."""
        names = ("shaft.speed.mean", "shaft.speed.max", "torque.max", EVENTS)
        rows, steps = [], 0
        for nu, amplitude, load in zip(*(axis[cases].tolist() for axis in self.workload.grid), strict=True):
            case, window = _Case(self.workload.spring_rates, nu, amplitude, load), _Window()
            period = 2.0 * math.pi / nu
            begin, end = WINDOW_START * period, PERIODS * period
            y0, before = self._advance(case, 0.0, begin, np.zeros(3 * case.n + 2), None)
            window.note(case, y0)
            y1, within = self._advance(case, begin, end, y0, window)
            rows.append(((y1[-2] - y0[-2]) / (end - begin), window.speed, window.torque, float(case.events)))
            steps += before + within
        return Outcome(cases, dict(zip(names, np.array(rows).T, strict=True)), steps)
