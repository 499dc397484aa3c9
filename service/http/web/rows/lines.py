"""Rows as lines through axes of all shown quantities."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.service.figures.painter.elements import SMALL, text_width
from sprag_study.service.figures.painter.elements import lines_of as lines_of_text
from sprag_study.service.results.explore import histogram
from sprag_study.service.results.headlines.along import wanted_of
from sprag_study.worker.directions import DIRECTIONS, SWEEP

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from sprag_study.service.results.explore import Explored

#: Pixels: height of an axis, room above and below it for words, width of the whole, least and most between two axes.
HEIGHT: Final = 200
TOP: Final = 54
BELOW: Final = 24
_WIDTH: Final = 1040
_STEPS: Final = (108, 240)
#: Pixels beside the first and the last axis, for their words.
_EDGE: Final = 64
#: Pixels between the names of two axes.
_APART: Final = 8
#: Pixels of the longest bar of a histogram beside its axis.
_BAR: Final = 22
#: Most lines of rows within the conditions, and of those outside.
_MOST: Final = 400
_MOST_OUTSIDE: Final = 300
#: Shades from the palest to the strongest.
SHADES: Final = 5


@dataclass(frozen=True, slots=True)
class Axis:
    """One axis.

    Attributes
    ----------
    ends : values (SI) at the bottom, in the middle and at the top
    x : place (px)
    bars : path of the histogram of the rows within the conditions
    range : bottom and top (px) of the chosen range; None where there is none
    log : whether it is logarithmic
    words : names of a direction with their places (px), in the place of numbers
    wanted : place (px) of the value that is wanted; None where there is none on the axis
    """

    name: str
    unit: str
    ends: tuple[float, float, float]
    x: int
    bars: str
    range: tuple[float, float] | None
    log: bool
    words: tuple[tuple[str, float], ...] = ()
    wanted: float | None = None

    @property
    def digits(self) -> int:
        """Digits with which its numbers differ, at least three."""
        low, middle, high = self.ends
        share = min(abs(middle - low), abs(high - middle)) / max(abs(low), abs(high))
        return min(max(math.ceil(1.0 - math.log10(share)), 3), 9)


@dataclass(frozen=True, slots=True)
class Lines:
    """Axes, and the lines: number of the row, shade (0: outside) and path, the last ones in front.

    ``left_out`` rows within the conditions have no line.
    """

    axes: tuple[Axis, ...]
    lines: tuple[tuple[int, int, str], ...]
    width: int
    left_out: int

    def heads(self, names: Mapping[str, str]) -> dict[str, list[str]]:
        """What each axis is called, in two lines of about the same length, or in as many as fit between two axes."""
        room = self.axes[1].x - self.axes[0].x - _APART
        heads = {}
        for axis in self.axes:
            name = names[axis.name]
            two = _halves(name)
            fit = all(text_width(line, SMALL) <= room for line in two)
            heads[axis.name] = two if fit else lines_of_text(name, room, SMALL)
        return heads


def _halves(text: str) -> list[str]:
    words = text.split()
    pairs = [(" ".join(words[:cut]), " ".join(words[cut:])) for cut in range(1, len(words))]
    return list(min(pairs, key=lambda pair: max(map(len, pair)))) if pairs else [text]


def lines_of(
    found: Explored, log: Sequence[str], flip: Sequence[str], shades: NDArray[np.int64], *, outside: bool
) -> Lines | None:
    """The plot of a selection; None where fewer than two quantities have numbers.

    ``shades`` are those of all rows, shape (known,).
    """
    scales = [scale for name in reversed(found.plan.shown) if (scale := _Scale(found, name, log, flip)).known]
    if len(scales) < 2:
        return None
    least, most = _STEPS
    step = min(max((_WIDTH - 2 * _EDGE) // (len(scales) - 1), least), most)
    xs = [_EDGE + step * index for index in range(len(scales))]
    inside = np.flatnonzero(found.selected)
    first = found.order.astype(np.intp)
    chosen = np.union1d(_evenly(inside, _MOST - first.size), first)
    # The first row of the table is drawn last.
    places = np.concatenate([chosen[~np.isin(chosen, first)], first[::-1]])
    if outside:
        places = np.concatenate([_evenly(np.flatnonzero(~found.selected), _MOST_OUTSIDE), places])
    kinds = np.where(found.selected, shades, 0)[places].tolist()
    ys = np.stack([TOP + HEIGHT * (1.0 - scale.shares[places]) for scale in scales], axis=1).tolist()
    lines = [(case, kind, _line(xs, row)) for case, kind, row in zip(
        found.rows.cases[places].tolist(), kinds, ys, strict=True)]  # fmt: skip
    axes = tuple(scale.axis(x, found) for scale, x in zip(scales, xs, strict=True))
    return Lines(axes, tuple(lines), 2 * _EDGE + step * (len(scales) - 1), inside.size - chosen.size)


def shades_of(values: NDArray[np.float64], selected: NDArray[np.bool_], *, falling: bool) -> NDArray[np.int64]:
    """The shade of each row from 1, the palest, to `SHADES` in equal steps of the selected values."""
    known = selected & np.isfinite(values)
    if not known.any():
        return np.ones(len(values), dtype=np.int64)
    low, high = values[known].min(), values[known].max()
    share = np.nan_to_num((values - low) / ((high - low) or 1.0))
    steps = np.clip((SHADES * share).astype(np.int64), 0, SHADES - 1)
    return np.asarray((SHADES - 1 - steps if falling else steps) + 1)


class _Scale:
    """A quantity over all rows, from 0 to 1."""

    def __init__(self, found: Explored, name: str, log: Sequence[str], flip: Sequence[str]) -> None:
        self.name, self.unit = name, found.plan.units.get(name, "1")
        values = found.values[name]
        finite = values[np.isfinite(values)]
        self.known = bool(finite.size)
        if not self.known:
            return
        self.values = values
        low, high = float(finite.min()), float(finite.max())
        if high - low <= 1e-12 * max(abs(low), abs(high)):
            low, high = low - (abs(low) / 2 or 0.5), high + (abs(high) / 2 or 0.5)
        self.log = name in log and low > 0.0
        self.flip = name in flip
        self.ends = low, high
        self.shares = self.share(values)

    def share(self, value: NDArray[np.float64] | float) -> NDArray[np.float64]:
        """Place of values from the bottom, 0, to the top, 1; NaN where one is none."""
        low, high = self._straight(np.array(self.ends))
        share = np.clip((self._straight(np.asarray(value, dtype=np.float64)) - low) / (high - low), 0.0, 1.0)
        return np.asarray(1.0 - share if self.flip else share)

    def _straight(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.log10(np.maximum(values, self.ends[0])) if self.log else values

    def axis(self, x: int, found: Explored) -> Axis:
        """The axis at ``x``."""
        low, high = self.ends
        middle = float(np.sqrt(low * high)) if self.log else 0.5 * (low + high)
        own = [one for one in found.plan.ranges if one.name == self.name]
        chosen = None
        if own:
            least = max((one.limit for one in own if one.at_least), default=low)
            most = min((one.limit for one in own if not one.at_least), default=high)
            ends = (TOP + HEIGHT * (1.0 - self.share(np.array([least, most])))).tolist()
            chosen = max(ends), min(ends)
        counted = histogram(self.shares, found.selected)
        bars = "" if counted is None else _bars(counted["selected"], x)
        words = tuple(
            (name, TOP + HEIGHT * (1.0 - float(self.share(float(place))))) for place, name in enumerate(DIRECTIONS)
        )
        ends_ = (high, middle, low) if self.flip else (low, middle, high)
        wanted = wanted_of(found.study, self.name)
        mark = None
        if wanted is not None and low <= wanted <= high:
            mark = TOP + HEIGHT * (1.0 - float(self.share(wanted)))
        return Axis(self.name, self.unit, ends_, x, bars, chosen, self.log, words if self.name == SWEEP else (), mark)


def _bars(counts: Sequence[int], x: int) -> str:
    """The outline of a histogram that stands on the axis at ``x``."""
    wide, most = HEIGHT / len(counts), max(counts) or 1
    parts = [f"M{x} {TOP + HEIGHT}"]
    for index, count in enumerate(counts):
        parts.append(f"H{round(x + _BAR * count / most, 1):g}V{round(TOP + HEIGHT - wide * (index + 1), 1):g}")
    return "".join([*parts, f"H{x}z"])


def _line(xs: Sequence[int], ys: Sequence[float]) -> str:
    """The line of a row over the axes, broken where it has no number."""
    parts, joined = [], False
    for x, y in zip(xs, ys, strict=True):
        known = y == y  # noqa: PLR0124 - not NaN
        if known:
            parts.append(f"{'L' if joined else 'M'}{x} {round(y)}")
        joined = known
    return "".join(parts)


def _evenly(places: NDArray[np.intp], most: int) -> NDArray[np.intp]:
    """At most so many of the places, evenly through the study."""
    if places.size <= most:
        return places
    return places[np.linspace(0, places.size - 1, max(most, 0)).astype(np.intp)]
