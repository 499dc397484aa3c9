"""Scales of axes: from numbers to pixels, and the round numbers that are written at them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import Named, name_of
from sprag_study.service.figures.painter.elements import SMALL, text_width
from sprag_study.service.reading.wording import number

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    Numbers = NDArray[np.float64]

#: Pixels between two numbers of an axis at least, and between those of one that goes up.
_BETWEEN: Final = 14.0
_APART: Final = 34.0
_DIGITS: Final = 10
#: Steps of degrees, whose round numbers are parts of a turn.
_DEGREES: Final = (1.0, 5.0, 15.0, 30.0, 45.0, 60.0, 90.0, 180.0, 360.0, 720.0)


@dataclass(frozen=True, slots=True)
class Scale:
    """An axis from ``low`` to ``high`` over the pixels from ``start`` to ``end``; ``log`` for equal factors.

    Numbers of a unit that stand for names are whole, and written as these names.
    """

    low: float
    high: float
    start: float = 0.0
    end: float = 1.0
    log: bool = False
    unit: str = "1"

    def over(self, start: float, end: float) -> Scale:
        """The same axis over other pixels."""
        return replace(self, start=start, end=end)

    def __call__(self, values: Numbers | float) -> Numbers:
        """Pixels of values; NaN where a logarithmic axis has no place for one."""
        given = np.asarray(values, dtype=np.float64)
        low, high = self.low, self.high
        if self.log:
            with np.errstate(divide="ignore", invalid="ignore"):
                given = np.where(given > 0.0, np.log10(given), np.nan)
            low, high = math.log10(low), math.log10(high)
        placed: Numbers = self.start + (given - low) * ((self.end - self.start) / ((high - low) or 1.0))
        return placed

    def at(self, value: float) -> float:
        """The pixel of one value."""
        return float(self(value))

    def text(self, value: float) -> str:
        """A number of the axis, or the name for which it stands."""
        return name_of(value, self.unit) or tick_text(value)

    def ticks(self) -> list[float]:
        """Round numbers along the axis, as many as have room."""
        pixels = abs(self.end - self.start)
        for wanted in range(10, 0, -1):
            found = self.round_numbers(wanted)
            if self._fits(found, pixels):
                return found
        return self.round_numbers(1)[:1]

    def rising(self) -> list[float]:
        """The same of an axis that goes up, whose numbers stand one above the other."""
        pixels = abs(self.end - self.start)
        return self.round_numbers(max(int(pixels / _APART), 1))

    def round_numbers(self, wanted: int) -> list[float]:
        """About ``wanted`` round numbers between the ends."""
        low, high = min(self.low, self.high), max(self.low, self.high)
        if isinstance(self.unit, Named):
            every = range(math.ceil(low), min(math.floor(high), len(self.unit.names) - 1) + 1)
            return [float(place) for place in every[:: max(len(every) // max(wanted, 1), 1)]]
        if not high > low:
            return [low]
        if self.log and len(found := _decades(low, high, wanted)) > 1:
            return found
        step = step_of(low, high, wanted, self.unit)
        places = range(math.ceil(low / step - 1e-6), math.floor(high / step + 1e-6) + 1)
        return [round(place * step, 12 - math.floor(math.log10(step))) for place in places]

    def _fits(self, ticks: list[float], pixels: float) -> bool:
        edges: list[tuple[float, float]] = []
        for at, text in zip(self(np.array(ticks)).tolist(), map(self.text, ticks), strict=True):
            half = text_width(text, SMALL) / 2.0
            edges.append((at - half, at + half))
        edges.sort()
        return bool(edges) and pixels > 0 and all(
            one[1] + _BETWEEN <= other[0] for one, other in pairwise(edges)
        )  # fmt: skip


def step_of(low: float, high: float, wanted: int, unit: str = "1") -> float:
    """A round step that divides an interval into about ``wanted`` parts, at most one more."""
    rough = (high - low) / max(wanted, 1)
    if unit == "°" and rough > _DEGREES[0]:
        return next((step for step in _DEGREES if step >= 0.999 * rough), 360.0 * math.ceil(rough / 360.0))
    size = 10.0 ** math.floor(math.log10(rough))
    return next(size * factor for factor in (1.0, 2.0, 5.0, 10.0) if size * factor >= 0.999 * rough)


def _decades(low: float, high: float, wanted: int) -> list[float]:
    """Powers of ten; numbers between them where there are few, of a part of a decade perhaps none."""
    first, last = math.floor(math.log10(low) + 1e-9), math.ceil(math.log10(high) - 1e-9)
    factors = (1.0,) if last - first > wanted / 2 else (1.0, 2.0, 5.0)
    every = max((last - first) // max(wanted, 1), 1) if factors == (1.0,) else 1
    found = [factor * 10.0**power for power in range(first, last + 1, every) for factor in factors]
    return [one for one in found if 0.999999 * low <= one <= 1.000001 * high]


def tick_text(value: float) -> str:
    """A number of an axis."""
    return number(value + 0.0, _DIGITS)


def extent(values: Iterable[Numbers], *, log: bool = False) -> tuple[float, float] | None:
    """The least and the largest of all finite values; of a logarithmic axis, of the positive ones."""
    ends: list[float] = []
    for one in values:
        known = one[np.isfinite(one) & (one > 0.0)] if log else one[np.isfinite(one)]
        if known.size:
            ends += [float(known.min()), float(known.max())]
    return (min(ends), max(ends)) if ends else None


def rounded_scale(ends: tuple[float, float] | None, pixels: float, *, zero: bool, log: bool, unit: str) -> Scale:
    """An axis that goes up and ends at round numbers; ``zero`` lets it contain zero."""
    low, high = ends or (0.0, 1.0)
    if log and low > 0.0:
        return Scale(
            10.0 ** math.floor(math.log10(low) + 1e-9), 10.0 ** (math.floor(math.log10(high) - 1e-9) + 1), log=True
        )
    if zero:
        low, high = min(low, 0.0), max(high, 0.0)
    if high - low <= 1e-9 * max(abs(low), abs(high)):
        room = 0.05 * abs(high) or 0.5
        low, high = low - room * (not zero or high <= 0), high + room
    step = step_of(low, high, max(int(pixels / _APART), 1), unit)
    return Scale(step * math.floor(low / step + 1e-6), step * math.ceil(high / step - 1e-6), unit=unit)
