"""The automaton of the second implementation: guards, and what their events do (docs/theory.md, "The automaton")."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from tests.engine.vibration_drive.reference_equations import Floats, Machine

#: A torque this near to the bound of a lock, in N*m, counts as on it.
ROUNDING = 1e-11


@dataclass(frozen=True)
class UpwardCrossing:
    """A guard that is not yet on watch while the quantity is positive: it must have been negative first."""

    quantity: Callable[[Any, Any], Any]

    def __call__(self, t: Any, y: Any) -> Any:
        return -self.quantity(t, y)


class Automaton(Machine):
    """The machine's states and transitions."""

    def guards(self) -> Iterator[tuple[Callable[[Any, Any], Any], Callable[[Floats, float], None]]]:
        """Functions that are positive until their event, each with what the event does (docs/theory.md)."""
        n = self.n
        if self.shaft_state == "held":
            if self.is_pushed():
                yield lambda t, y: self.holds(y) - sum(self.torques(t, y)[0]), lambda y, t: self.turn("rotating")
        else:
            if self.row < len(self.table):
                yield (
                    lambda t, y, at=self.table[self.row][0]: at - y[self.shaft],
                    lambda y, t: self.pass_row(y, self.row, 1),
                )
            if self.row > 0 and self.table[self.row - 1][0] > 0.0:
                yield (
                    lambda t, y, at=self.table[self.row - 1][0]: y[self.shaft] - at,
                    lambda y, t: self.pass_row(y, self.row - 1, -1),
                )
            elif self.stops:
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
                if p.clutch_damping > 0.0:
                    yield lambda t, y, i=i: self.torques(t, y)[0][i], lambda y, t, i=i: self.release(i, y)
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

    def holds(self, y: Any) -> Any:
        """Torque up to which the load holds the shaft."""
        return self.useful(0.0 * y[self.shaft], y[3 * self.n])

    def is_pushed(self) -> bool:
        """Whether any clutch may drive the shaft: one that overruns or takes up its backlash never does."""
        return any(state not in ("free", "take_up") for state in self.clutches)

    def pass_row(self, y: Floats, row: int, further: int) -> None:
        """The line of the load's table changes; no transition."""
        y[self.shaft] = self.table[row][0]
        self.row += further
        self.out.events -= 1

    def turn(self, state: str) -> None:
        self.shaft_state = state

    def stop(self, y: Floats, t: float) -> None:
        y[self.shaft] = 0.0
        self.row = self.row_at(0.0)
        for i in range(self.n):
            if self.clutches[i] == "locked":
                y[self.n + i] = 0.0
        self.shaft_state = "held"

    def wind(self, i: int, y: Floats, windup: float, state: str) -> None:
        self.out.engagements += self.clutches[i] == "take_up"
        y[2 * self.n + i] = windup
        self.clutches[i] = state

    def release(self, i: int, y: Floats) -> None:
        """A damped clutch does not pull: it opens wound up, and its damping takes what the spring has."""
        y[4 * self.n + 8 + i] += self.pendulums[i].energy(float(y[2 * self.n + i]))
        y[2 * self.n + i] = 0.0
        self.clutches[i] = "free"

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
            if self.shaft_state == "held" and self.is_pushed() and sum(torque) > self.holds(y) + ROUNDING:
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
