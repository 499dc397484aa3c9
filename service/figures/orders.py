"""After how many excitation periods motions repeat, in colours: strips below curves, and maps."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, groupby
from typing import TYPE_CHECKING, Final, TypeVar

import numpy as np

from sprag_study.service.reading.reader import Phrase, plural, shown, term
from sprag_study.service.results.regimes import MARKS, ORDER
from sprag_study.service.results.sweeps import values_text

if TYPE_CHECKING:
    from sprag_study.service.results.curves import Curve, Map
    from sprag_study.worker.arrays import Floats

Name = TypeVar("Name")

Look = tuple[str, str]
Span = tuple[str, float, float]

#: What the colours mean, alone and with those of regimes.
TITLE: Final = Phrase("Motion repeats after")
#: Rows of a strip; more cannot be read. A map shows them.
MOST_ROWS: Final = 8
#: Red, green and blue of the fewest, of some and of many periods: a hue for each sequence of doubled periods that
#: begins with 1, 3 or 5, and one for all others; with the pattern that tells them apart in grey.
_HUES: Final = {
    1: (((224, 233, 244), (93, 130, 190), (16, 24, 80)), ""),
    3: (((198, 230, 190), (84, 158, 84), (8, 62, 28)), "/"),
    5: (((244, 226, 150), (190, 150, 50), (92, 66, 8)), "\\"),
    7: (((226, 212, 238), (150, 110, 190), (62, 20, 104)), "|"),
}
#: The number from which on the colour stays the same.
_DARKEST: Final = 32
#: Patterns of the regimes, which tell the same in grey.
_PATTERNS: Final = {"held": "-", "coasting": ".", "irregular": "x", "unsettled": "+"}


def edges(values: Sequence[float] | Floats, *, whole: bool = False) -> Floats:
    """Borders of the cells around ascending values, one more than there are values.

    The outer cells end at the outer values, as curves do, unless they are ``whole``, with the values inside.
    """
    middle = np.array(values)
    if middle.size == 1:
        half = abs(float(middle[0])) * 0.05 or 0.5
        return np.array([middle[0] - half, middle[0] + half])
    between = (middle[1:] + middle[:-1]) / 2.0
    first, last = middle[:1], middle[-1:]
    if whole:
        first, last = 2.0 * first - between[:1], 2.0 * last - between[-1:]
    return np.concatenate([first, between, last])


def map_edges(drawn: Map) -> tuple[Floats, Floats]:
    """Borders of the cells of a map along x and y; squares of a refined map are whole."""
    if drawn.refined is None:
        return edges(drawn.x_values, whole=True), edges(drawn.y_values, whole=True)
    return _even(np.array(drawn.x_values)), _even(np.array(drawn.y_values))


def _even(middles: Floats) -> Floats:
    """Borders of even squares with these middles."""
    step = middles[1] - middles[0]
    return np.concatenate([middles - step / 2.0, middles[-1:] + step / 2.0])


def motion_name(regime: str | None, order: int | None) -> str | None:
    """``2 periods`` for a periodic motion, the name of its regime for another one; None for a case without."""
    if regime != "periodic" or order is None:
        return regime
    return "1 period" if order == 1 else f"{order} periods"


def motion_text(name: str) -> str:
    """The name of `motion_name`, or of a state, for the reader."""
    order = name.partition(" ")[0]
    return shown(plural("{count} period", "{count} periods", int(order)) if order.isdigit() else term(name))


def looks_of(names: Iterable[str | None]) -> dict[str, Look]:
    """Colour and pattern of each name that occurs: the fewest periods first, then the regimes."""
    occurring = {name for name in names if name is not None}
    orders = sorted((int(name.split()[0]), name) for name in occurring if name not in MARKS)
    looks: dict[str, Look] = {name: _order_look(order) for order, name in orders}
    return looks | {name: (MARKS[name].colour, _PATTERNS.get(name, "")) for name in MARKS if name in occurring}


def _order_look(order: int) -> Look:
    root = order // (order & -order)  # what is left when all doublings are undone
    first = root if root in _HUES else max(_HUES)
    stops, pattern = _HUES[first]
    share = math.log2(order / first) / math.log2(_DARKEST / first)
    parts = (round(float(np.interp(share, (0.0, 0.5, 1.0), channel))) for channel in zip(*stops, strict=True))
    return "#" + "".join(f"{part:02x}" for part in parts), pattern


def strip_of(curves: Sequence[Curve], units: Mapping[str, str]) -> tuple[dict[str, tuple[Span, ...]], dict[str, Look]]:
    """A row for each curve, named by its values, and the looks of what stands in it: runs of equal motions along x.

    ``units`` are those of the values.

    There is none where all motions repeat after one period, of too many curves, or where x does not ascend.
    """
    rows: dict[str, tuple[Span, ...]] = {}
    for curve in curves:
        run = curve.run()
        x = np.asarray(curve.line.x)[run]
        if curve.regimes is None or curve.orders is None or len(curves) > MOST_ROWS or np.any(np.diff(x) <= 0.0):
            return {}, {}
        names = [motion_name(curve.regimes[place], curve.orders[place]) for place in run.tolist()]
        borders = edges(x).tolist() if x.size else []
        rows[values_text(curve.line.by, units)] = tuple(
            (name, borders[start], borders[stop]) for name, start, stop in runs_of(names) if name is not None
        )
    looks = looks_of(name for spans in rows.values() for name, _, _ in spans)
    return (rows, looks) if set(looks) - {"1 period"} else ({}, {})


def runs_of(names: Iterable[Name]) -> Iterator[tuple[Name, int, int]]:
    """Each run of equal names, with its first place and the first one behind it."""
    start = 0
    for name, run in groupby(names):
        stop = start + len(list(run))
        yield name, start, stop
        start = stop


@dataclass(frozen=True, slots=True)
class OrderMap:
    """A map of the periods after which motions repeat.

    Attributes
    ----------
    looks : colour and pattern of each name, in their order
    places : float64 array, shape (y values, x values)
        Place of each case's name among the looks, NaN for a case without.
    names : the same as names
    """

    looks: dict[str, Look]
    places: Floats
    names: list[list[str | None]]

    @property
    def colours(self) -> list[str]:
        """The colours in their order."""
        return [colour for colour, _ in self.looks.values()]


def order_map(drawn: Map) -> OrderMap | None:
    """The map as one of these, where its result is the order; None of another."""
    if drawn.regimes is None or drawn.orders is None or drawn.result.name != ORDER:
        return None
    names = [
        [motion_name(regime, order) for regime, order in zip(*row, strict=True)]
        for row in zip(drawn.regimes, drawn.orders, strict=True)
    ]
    looks = looks_of(chain.from_iterable(names))
    place = {name: float(index) for index, name in enumerate(looks)}
    places = np.array([[np.nan if name is None else place[name] for name in row] for row in names])
    return OrderMap(looks, places, names)
