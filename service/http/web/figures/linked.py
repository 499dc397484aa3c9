"""Plots of Explore that pages have as SVG: parallel coordinates, and a matrix of all pairs of quantities."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from math import isnan
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag.worker import models
from sprag.worker.directions import DIRECTIONS, SWEEP

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from sprag.service.answers.explore import ExploredQuantity
    from sprag.service.results.explore import Explored

#: Pixels: height of an axis, room above and below it for words, width of the whole, least and most between two axes.
HEIGHT: Final = 220
TOP: Final = 40
BELOW: Final = 22
_WIDTH: Final = 1180
_STEPS: Final = (112, 230)
#: Pixels of the longest bar of a histogram beside its axis.
_BAR: Final = 26
#: Most lines of cases outside the selection, inside it, and of the first rows.
_MOST: Final = {"outside": 300, "inside": 500, "first": 100}
#: Quantities of the matrix, intervals of each, and upper limits of its shades as shares of the fullest square.
MOST_PAIRED: Final = 5
GRID: Final = 32
_SHADES: Final = (0.03, 0.3, 1.0)


@dataclass(frozen=True, slots=True)
class Axis:
    """One axis of parallel coordinates.

    Attributes
    ----------
    low, high : ends (SI), at the bottom and at the top
    x : place (px)
    bars : path of the histogram of all cases, and of the selected ones
    range : bottom and top (px) of the chosen range; None where there is none
    words : names of categories with their places (px), in the place of numbers
    """

    name: str
    unit: str
    low: float
    high: float
    x: int
    bars: tuple[str, str]
    range: tuple[float, float] | None
    words: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True, slots=True)
class Parallel:
    """Axes, and a line for each drawn case: its number and its path, by kind, the last ones in front."""

    axes: tuple[Axis, ...]
    lines: Mapping[str, tuple[tuple[int, str], ...]]
    width: int
    left_out: int


@dataclass(frozen=True, slots=True)
class Cell:
    """Two quantities: numbers of cases in squares, as paths on a grid of `GRID` squares, by kind and shade.

    ``box`` is the chosen part: left, top, width, height on the grid; None where there is no range.
    """

    x: str
    y: str
    squares: Mapping[str, tuple[str, ...]]
    box: tuple[float, float, float, float] | None


@dataclass(frozen=True, slots=True)
class Linked:
    """Both plots; ``cells`` are those below the diagonal of the matrix, in rows."""

    parallel: Parallel
    names: tuple[str, ...]
    cells: tuple[tuple[Cell, ...], ...]


def linked(found: Explored, quantities: Sequence[ExploredQuantity], axes: tuple[str, str]) -> Linked | None:
    """The plots of a selection; None where fewer than two of its quantities have numbers.

    The matrix has the quantities that the question is about (``axes`` are those of the points), then the first ones.
    """
    shown = [item for item in quantities if item["histogram"]]
    if len(shown) < 2:
        return None
    scales = {item["name"]: _Scale(found, item) for item in shown}
    chosen = {found.plan.sort, *axes, *(one.name for one in found.plan.ranges)}
    first = sorted(scales, key=lambda name: name not in chosen)[:MOST_PAIRED]
    names = tuple(name for name in scales if name in first)
    places = {name: scales[name].squares() for name in names}
    cells: dict[str, list[Cell]] = {name: [] for name in names[1:]}
    for x, y in combinations(names, 2):
        cells[y].append(_cell(found, (x, y), (places[x], places[y]), (scales[x], scales[y])))
    own = [name in found.study.column_paths for name in scales]
    # Cases that failed have inputs and an ending but no results, where their lines break.
    after = len(own) - own[::-1].index(True) if True in own else 0
    every: list[_Scale | _Kinds] = list(scales.values())
    every[after:after] = [kinds for kinds in _kinds(found) if len(kinds.names) > 1]
    return Linked(_parallel(found, every), names, tuple(tuple(row) for row in cells.values()))


class _Scale:
    """A quantity over all finished cases and the range (SI) that the question has of it."""

    def __init__(self, found: Explored, item: ExploredQuantity) -> None:
        assert item["histogram"] is not None
        self.name, self.unit = item["name"], item["unit"]
        self.histogram = item["histogram"]
        self.values = found.values[self.name]
        self.words = tuple(zip(DIRECTIONS, (0.0, 1.0), strict=True)) if self.name == SWEEP else ()
        self.low, self.high = item["histogram"]["edges"][0], item["histogram"]["edges"][-1]
        own = [one for one in found.plan.ranges if one.name == self.name]
        least = max((one.limit for one in own if one.at_least), default=None)
        most = min((one.limit for one in own if not one.at_least), default=None)
        self.range = None if not own else (0.0 if least is None else self.share(least),
                                           1.0 if most is None else self.share(most))  # fmt: skip

    def share(self, value: float) -> float:
        """Place of a value between the ends, from 0 to 1."""
        return min(max((value - self.low) / (self.high - self.low), 0.0), 1.0)

    def shares(self, places: NDArray[np.intp]) -> NDArray[np.float64]:
        """The same of some cases; NaN where one has no number."""
        found: NDArray[np.float64] = (self.values[places] - self.low) / (self.high - self.low)
        return np.where(np.isfinite(found), found, np.nan)

    def squares(self) -> NDArray[np.int64]:
        """The interval of each case; -1 where it has no number."""
        known = np.isfinite(self.values)
        scaled = GRID * (np.where(known, self.values, self.low) - self.low) / (self.high - self.low)
        return np.where(known, np.clip(scaled.astype(np.int64), 0, GRID - 1), -1)


class _Kinds:
    """A kind that cases have, such as their ending: the names that occur, from the bottom up in their usual order."""

    unit = "1"

    def __init__(self, found: Explored, name: str, every: Sequence[str], own: NDArray[np.float64], chosen: str) -> None:
        """``own`` are the places in ``every`` of each case, NaN where it has none; ``chosen`` is "" for any."""
        self.name = name
        known = np.isfinite(own)
        places, index = np.unique(own[known], return_inverse=True)
        self.names = tuple(every[int(place)] for place in places)
        count = len(self.names)
        self.low, self.high = 0.0, float(count)
        self.values = np.full(own.size, np.nan)
        self.values[known] = index + 0.5
        self.words = tuple((text, (place + 0.5) / count) for place, text in enumerate(self.names))
        at = self.names.index(chosen) if chosen in self.names else None
        self.range = None if at is None else (at / count, (at + 1) / count)
        bins = max(count, 1)
        self.histogram = {
            kind: np.bincount(self.values[which & known].astype(np.int64), minlength=bins).tolist()
            for kind, which in (("all", known), ("selected", found.selected))
        }

    def shares(self, places: NDArray[np.intp]) -> NDArray[np.float64]:
        """Place of each of some cases, from 0 to 1; NaN where it has none."""
        return self.values[places] / self.high


def _kinds(found: Explored) -> Iterator[_Kinds]:
    """Ending and regime of all finished cases."""
    plan, rows = found.plan, found.rows
    endings = list(dict.fromkeys([*models.endings_of(found.study.model), *(ending for ending, _ in rows.kinds)]))
    own = np.array([endings.index(ending) for ending, _ in rows.kinds], dtype=np.float64)
    if found.known:
        yield _Kinds(found, "ending", endings, own[rows.kind], plan.query.ending)
        if plan.regime is not None:
            yield _Kinds(found, "regime", plan.regime.categories, rows.values[plan.regime.name], plan.query.regime)


def _parallel(found: Explored, scales: Sequence[_Scale | _Kinds]) -> Parallel:
    least, most = _STEPS
    step = min(max(_WIDTH // len(scales), least), most)
    xs = [step // 2 + step * index for index in range(len(scales))]
    axes = tuple(_axis(scale, x) for scale, x in zip(scales, xs, strict=True))
    top = np.zeros(found.known, dtype=np.bool_)
    top[found.order] = True
    kinds = {
        "outside": np.flatnonzero(~found.selected),
        "inside": np.flatnonzero(found.selected & ~top),
        "first": found.order.astype(np.intp),
    }
    lines, left_out = {}, 0
    for kind, which in kinds.items():
        places = which[: _MOST[kind]] if kind == "first" else _evenly(which, _MOST[kind])
        left_out += which.size - places.size
        heights = [TOP + HEIGHT * (1.0 - scale.shares(places)) for scale in scales]
        rows = np.stack(heights, axis=1).tolist() if places.size else []
        # The first row of the table is drawn last.
        drawn = [(case, _line(xs, ys)) for case, ys in zip(found.rows.cases[places].tolist(), rows, strict=True)]
        lines[kind] = tuple(reversed(drawn))
    return Parallel(axes, lines, step * len(scales), left_out)


def _axis(scale: _Scale | _Kinds, x: int) -> Axis:
    own = scale.range and (TOP + HEIGHT * (1.0 - scale.range[0]), TOP + HEIGHT * (1.0 - scale.range[1]))
    most = max(scale.histogram["all"]) or 1
    every, selected = (_bars(scale.histogram[kind], most, x) for kind in ("all", "selected"))
    words = tuple((text, TOP + HEIGHT * (1.0 - share)) for text, share in scale.words)
    return Axis(scale.name, scale.unit, scale.low, scale.high, x, (every, selected), own, words)


def _bars(counts: Sequence[int], most: int, x: int) -> str:
    """The outline of a histogram that stands on the axis at ``x``."""
    wide = HEIGHT / len(counts)
    parts = [f"M{x} {TOP + HEIGHT}"]
    for index, count in enumerate(counts):
        parts.append(f"H{_short(x + _BAR * count / most)}V{_short(TOP + HEIGHT - wide * (index + 1))}")
    return "".join([*parts, f"H{x}z"])


def _line(xs: Sequence[int], ys: Sequence[float]) -> str:
    """The line of a case over the axes, broken where it has no number."""
    parts, joined = [], False
    for x, y in zip(xs, ys, strict=True):
        known = not isnan(y)
        if known:
            parts.append(f"{'L' if joined else 'M'}{x} {round(y)}")
        joined = known
    return "".join(parts)


def _evenly(places: NDArray[np.intp], most: int) -> NDArray[np.intp]:
    """At most so many of the places, evenly through the study."""
    if places.size <= most:
        return places
    return places[np.linspace(0, places.size - 1, most).astype(np.intp)]


def _cell(
    found: Explored,
    names: tuple[str, str],
    places: tuple[NDArray[np.int64], NDArray[np.int64]],
    scales: tuple[_Scale, _Scale],
) -> Cell:
    across, up = places
    known = (across >= 0) & (up >= 0)
    code = GRID * (GRID - 1 - up) + across
    counts = {
        "outside": _counts(code[known & ~found.selected]),
        "inside": _counts(code[known & found.selected]),
        "first": _counts(code[found.order[known[found.order]]]),
    }
    squares = {kind: tuple(_shades(count)) for kind, count in counts.items()}
    return Cell(*names, squares, _box(*(scale.range for scale in scales)))


def _counts(code: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.bincount(code, minlength=GRID * GRID).reshape(GRID, GRID)


def _shades(counts: NDArray[np.int64]) -> Iterator[str]:
    """Paths of the squares with few, more and many cases: the middle lines of runs in each row."""
    share = counts / (counts.max() or 1)
    lower = 0.0
    for upper in _SHADES:
        yield "".join(_runs((share > lower) & (share <= upper)))
        lower = upper


def _runs(inside: NDArray[np.bool_]) -> Iterator[str]:
    edges = np.diff(inside.astype(np.int8), axis=1, prepend=0, append=0)
    rows, starts = np.nonzero(edges == 1)
    ends = np.nonzero(edges == -1)[1]
    for row, start, end in zip(rows.tolist(), starts.tolist(), ends.tolist(), strict=True):
        yield f"M{start} {row}.5h{end - start}"


def _box(
    across: tuple[float, float] | None, up: tuple[float, float] | None
) -> tuple[float, float, float, float] | None:
    if across is None and up is None:
        return None
    left, right = across or (0.0, 1.0)
    bottom, top = up or (0.0, 1.0)
    return (
        GRID * left, GRID * (1.0 - top), GRID * max(right - left, 0.0), GRID * max(top - bottom, 0.0)
    )  # fmt: skip


def _short(value: float) -> str:
    return f"{value:.1f}".removesuffix(".0")
