"""Settings of a run: its length, the evaluated part, and the accuracy."""

from dataclasses import dataclass, replace
from typing import Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
#: A frequency, or those of a batch.
Frequency = TypeVar("Frequency", float, Floats)
Unit = Literal["periods", "s"]
Reset = Literal["contact", "literal"]

#: The step budget. A case takes about 10 steps in a cycle of what is fastest in it, and 43 at most among 1,400 random
#: drives at 0.02 to 20 Hz.
_STEPS_PER_CYCLE, _LEAST_STEPS = 100.0, 5_000_000.0
#: Tolerance of what is reported of an orbit, as a share of the run's, and at least.
_FINER, _FINEST = 0.01, 1e-14


@dataclass(frozen=True, slots=True)
class Span:
    """A time from the start of the run, in seconds or in excitation periods."""

    value: float
    unit: Unit = "periods"

    def in_periods(self, frequency: Frequency) -> Frequency | float:
        """The same time in excitation periods of a machine excited at ``frequency`` (Hz)."""
        return self.value if self.unit == "periods" else self.value * frequency


@dataclass(frozen=True, slots=True)
class Run:
    """Settings shared by every case of a batch.

    Attributes
    ----------
    duration : Span
        End of the run; it starts at t = 0.
    window : tuple of two Spans, optional
        Part of the run over which the characteristics are taken; by default the last third.
    tolerance : float
        Local relative error of a step, 1e-14 .. 1e-4.
    reset : {"contact", "literal"}
        Interpretation of equation (5) while torque is transmitted (docs/theory.md, "The automaton").
    max_steps : int, optional
    max_events_per_period : int
        Budgets that end a case as ``step_budget`` or ``chatter`` instead of letting it hang.
    """

    duration: Span = Span(60.0)
    window: tuple[Span, Span] | None = None
    tolerance: float = 1e-9
    reset: Reset = "contact"
    max_steps: int | None = None
    max_events_per_period: int = 2_000

    def step_budget(self, cycles: Floats) -> Floats:
        """Steps after which each case ends, shape (cases,).

        ``cycles`` (shape (cases,)) are those that what is fastest in a case, excitation or a motion of its own, goes
        through in the run.
        """
        if self.max_steps is not None:
            return np.full_like(cycles, self.max_steps)
        return np.maximum(_LEAST_STEPS, _STEPS_PER_CYCLE * cycles)

    def window_in_periods(self, frequency: Frequency) -> tuple[Frequency | float, Frequency | float]:
        """Start and end of the window in excitation periods at ``frequency`` (Hz)."""
        if self.window is None:
            end = self.duration.in_periods(frequency)
            return end * 2.0 / 3.0, end
        return self.window[0].in_periods(frequency), self.window[1].in_periods(frequency)


#: Excitation periods that a search needs for the means and intervals of irregular motion.
MEANS_FROM_PERIODS = 940


@dataclass(frozen=True, slots=True)
class SettledRun:
    """Settings of a search for the settled motion, shared by every case of a batch.

    Attributes
    ----------
    at_most : int
        Excitation periods from the start of a case after which the search ends.
    settled : float
        Scaled distance from its orbit below which a run counts as settled.
    max_period : int
        Largest order of an orbit, in excitation periods.
    tolerance, reset, max_events_per_period :
        As of ``Run``.
    """

    at_most: int = 1000
    settled: float = 1e-8
    max_period: int = 32
    tolerance: float = 1e-9
    reset: Reset = "contact"
    max_events_per_period: int = 2_000

    @property
    def run(self) -> Run:
        """A run as long as the search at most, with its accuracy and budgets."""
        return Run(
            duration=Span(float(self.at_most)),
            tolerance=self.tolerance,
            reset=self.reset,
            max_events_per_period=self.max_events_per_period,
        )

    @property
    def fine(self) -> Run:
        """The same with a smaller tolerance: over a single turn of an orbit smaller steps cost next to nothing."""
        return replace(self.run, tolerance=max(_FINER * self.tolerance, min(_FINEST, self.tolerance)))
