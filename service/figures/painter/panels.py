"""What a panel shows: lines, points, marks, jumps, areas and notes, around it its numbers."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag_study.service.figures.figure import shade
from sprag_study.service.figures.orders import motion_text
from sprag_study.service.figures.painter.elements import (
    SMALL,
    colour_of,
    dots,
    element,
    halo,
    markers,
    path_of,
    short,
    text_at,
    text_width,
)  # fmt: skip
from sprag_study.service.figures.painter.legends import DASHES, NOTE_MARKERS
from sprag_study.service.figures.painter.names import Box, Named, clearest, dense, named_curves
from sprag_study.service.figures.painter.scales import Scale, tick_text
from sprag_study.service.figures.painter.thinning import thin
from sprag_study.service.languages import gettext
from sprag_study.service.reading.wording import number, unit_text
from sprag_study.service.results.regimes import MARKS

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from sprag_study.service.figures.figure import Figure, Line, Panel, Quantity

    Numbers = NDArray[np.float64]

#: Points of a figure that are links of their own each.
MOST_LINKS: Final = 600
#: Points from which on dots stand in the place of markers of a shape.
_DOTS: Final = 1_500
_CROWDED: Final = 10_000
#: Points of a line for each pixel of its width.
_DENSE: Final = 3
#: Different colours of points that are coloured by numbers.
_SHADES: Final = 32
#: Digits of what a link tells.
DIGITS: Final = 5
#: Pixels of a scale of colours with its numbers, at whose right end its name ends.
_SCALE_WIDTH: Final = 52.0


@dataclass(frozen=True, slots=True)
class Placed:
    """A panel with its axes, whose pixels begin at the upper left corner of the panel.

    Attributes
    ----------
    cases : where the case with a number is, which follows; "" where points are no links
    linked : whether every point is a link of its own
    chosen : key of the line that stands before the others; "" for none
    """

    figure: Figure
    panel: Panel
    x: Scale
    y: Scale
    width: float
    height: float
    cases: str = ""
    linked: bool = False
    chosen: str = ""

    @property
    def across(self) -> Quantity:
        """The quantity of its x axis."""
        return self.panel.x or self.figure.x

    def colour(self, line_key: str, colour: str) -> str:
        """The colour of a line."""
        return colour_beside(line_key, colour, self.chosen)


def colour_beside(line_key: str, colour: str, chosen: str) -> str:
    """The colour of a line: where one is ``chosen``, that one has ink, and the others are grey."""
    if not chosen:
        return colour_of(colour)
    return "var(--ink)" if line_key == chosen else "var(--edge)"


def panel_parts(placed: Placed) -> tuple[list[str], list[Named]]:
    """What is inside a panel from back to front, and the names that stand at its curves."""
    curves = {index: _drawn(line, placed) for index, line in enumerate(placed.panel.lines)}
    notes, boxes = _notes(placed, [(x, y) for _, x, y in curves.values()])
    named = _names(placed, curves, boxes)
    parts = [*_grid(placed), *_fills(placed), *_bands(placed), *_at(placed)]
    order = sorted(curves, key=lambda index: placed.panel.lines[index].key == placed.chosen != "")
    for index in order:
        parts += _line(placed.panel.lines[index], placed, *curves[index])
    parts += [*_marks(placed), *notes]
    parts += [
        halo(one.text, one.x, one.y, font_size=SMALL, font_weight=600 if one.bold else None, class_="name")
        for one in named
    ]
    return parts, named


def _drawn(line: Line, placed: Placed) -> tuple[NDArray[np.int64], Numbers, Numbers]:
    """The points of a line that are drawn: which, and their pixels."""
    most = placed.figure.most
    if line.joined and np.all(np.diff(line.x[np.isfinite(line.x)]) >= 0.0):  # orbits go back and forth
        most = min(most, int(_DENSE * placed.width))
    kept = thin(line.y, most)
    return kept, placed.x(line.x[kept]), placed.y(line.y[kept])


def _grid(placed: Placed) -> Iterator[str]:
    """Lines at the numbers that go up, and their numbers."""
    ticks = placed.y.rising()
    heights = placed.y(np.array(ticks)).tolist()
    yield element("path", d="".join(f"M0 {short(at)}h{short(placed.width)}" for at in heights), stroke="var(--grid)")
    zero = 0.0 if 0.0 in ticks else placed.y.low
    yield element("path", d=f"M0 {short(placed.y.at(zero))}h{short(placed.width)}", stroke="var(--edge)")
    yield y_numbers(placed.y, ticks, heights, -7.0)


def y_numbers(y: Scale, ticks: Sequence[float], heights: Sequence[float], right: float) -> str:
    """The numbers at the left of an axis that goes up, which end at ``right``."""
    return element(
        "g",
        "".join(text_at(y.text(value), right, at + 4.0) for value, at in zip(ticks, heights, strict=True)),
        class_="y", text_anchor="end", font_size=SMALL, fill="var(--soft)",
    )  # fmt: skip


def x_numbers(x: Scale, top: float) -> Iterator[str]:
    """The numbers below an axis, with short strokes."""
    ticks = x.ticks()
    places = x(np.array(ticks)).tolist()
    yield element("path", d="".join(f"M{short(at)} {short(top)}v4" for at in places), stroke="var(--edge)")
    yield element(
        "g",
        "".join(text_at(x.text(value), at, top + 17.0) for value, at in zip(ticks, places, strict=True)),
        class_="x", text_anchor="middle", font_size=SMALL, fill="var(--soft)",
    )  # fmt: skip


def _fills(placed: Placed) -> Iterator[str]:
    for fill in placed.panel.fills:
        x, low, high = placed.x(fill.x), placed.y(fill.low), placed.y(fill.high)
        known = np.isfinite(x) & np.isfinite(low) & np.isfinite(high)
        edges = np.flatnonzero(np.diff(known.astype(np.int8), prepend=0, append=0))
        path = ""
        for start, stop in edges.reshape(-1, 2).tolist():
            there = path_of(x[start:stop], low[start:stop])
            back = path_of(x[start:stop][::-1], high[start:stop][::-1])
            path += f"{there}L{back[1:]}z"
        yield element("path", d=path, fill=placed.colour(fill.key, fill.colour), fill_opacity=0.2)


def _bands(placed: Placed) -> Iterator[str]:
    for band in placed.panel.bands:
        low, high = sorted((placed.x.at(band.low), placed.x.at(band.high)))
        # The least width shows a jump that is narrower than a pixel.
        yield element(
            "rect", x=low, y=0, width=max(high - low, 1.0), height=placed.height,
            fill=placed.colour(band.key, band.colour), fill_opacity=0.25,
        )  # fmt: skip


def _at(placed: Placed) -> Iterator[str]:
    if placed.figure.at is not None:
        x = placed.x.at(placed.figure.at)
        yield element("path", d=f"M{short(x)} 0v{short(placed.height)}", stroke="var(--accent)", stroke_width=1.5,
                      class_="at")  # fmt: skip


def _line(line: Line, placed: Placed, kept: NDArray[np.int64], x: Numbers, y: Numbers) -> Iterator[str]:
    """A line with its points."""
    colour = placed.colour(line.key, line.colour)
    if line.shades is not None:
        yield from _shades(line, line.shades[kept], x, y)
        return
    front = line.wide or (placed.chosen != "" and line.key == placed.chosen)
    lone = np.zeros(kept.size, dtype=np.bool_)
    if line.joined:
        path = ""
        for stretch in _stretches(line, kept):
            path += path_of(x[stretch], y[stretch])
            if stretch.size == 1:  # no line is seen of a point between two gaps
                lone[stretch] = line.cases is not None
        yield element(
            "path", d=path, fill="none", stroke=colour, stroke_width=2.6 if front else 1.7, stroke_linejoin="round",
            stroke_dasharray=DASHES[line.style % len(DASHES)], data_line=line.name or placed.panel.y.name,
        )  # fmt: skip
    marked = line.marked(kept.size)
    own = np.isfinite(x) & np.isfinite(y) & (marked | lone)
    if own.any():
        yield _points(line, placed, colour, kept[own], x[own], y[own])


def _stretches(line: Line, kept: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Places among the kept points that are joined."""
    if line.stretches is None:
        return [np.arange(kept.size)]
    return [np.flatnonzero(np.isin(kept, stretch, assume_unique=True)) for stretch in line.stretches]


def _points(line: Line, placed: Placed, colour: str, kept: NDArray[np.int64], x: Numbers, y: Numbers) -> str:
    """The markers of a line: links to their cases where there are few."""
    look: dict[str, Any] = {"fill": "none", "stroke": colour, "stroke_width": 2} if line.ring else {"fill": colour}
    size = 5.0 if line.ring else 2.9 if line.joined else 3.3
    name = line.name or placed.panel.y.name
    cases = None if line.cases is None else line.cases[kept]
    if cases is not None and placed.linked:
        links = _links(placed, line.marker, size, (x, y), (line.x[kept], line.y[kept]), cases, name)
        # An invisible edge is part of what can be clicked.
        edge = look if line.ring else {**look, "stroke": "var(--ink)", "stroke_opacity": 0, "stroke_width": 9}
        return element("g", "".join(links), **edge)
    many = kept.size > _DOTS
    if many:
        x, y, places = _different(x, y)
        cases = None if cases is None else cases[places]
    known: dict[str, Any] = {"data_line": name}
    if cases is not None and placed.cases:
        known["data_cases"] = " ".join(map(str, cases.tolist()))
    return _dots(x, y, colour, known) if many else _many(line.marker, size, x, y, {**look, **known})


def _many(shape: str, size: float, x: Numbers, y: Numbers, look: Mapping[str, Any]) -> str:
    return element("path", d=markers(shape, size, x, y), **look)


def _dots(x: Numbers, y: Numbers, colour: str, known: Mapping[str, Any]) -> str:
    return element("path", d=dots(x, y), fill="none", stroke=colour, stroke_width=3.4, stroke_linecap="round", **known)


def _different(x: Numbers, y: Numbers) -> tuple[Numbers, Numbers, NDArray[np.int64]]:
    """One of the points on each pixel, of very many on each square of four, and which these are: more is not seen."""
    side = 2.0 if x.size > _CROWDED else 1.0
    across, up = np.round(x / side), np.round(y / side)
    places = np.sort(np.unique(across * 100_000.0 + up, return_index=True)[1])
    return side * across[places], side * up[places], places


def linked(figure: Figure) -> bool:
    """Whether the points of a figure are links of their own."""
    lines = [line for panel in figure.panels for line in panel.lines if line.cases is not None]
    return 0 < sum(line.x.size for line in lines) <= MOST_LINKS


def _links(
    placed: Placed,
    shape: str,
    size: float,
    pixels: tuple[Numbers, Numbers],
    values: tuple[Numbers, Numbers],
    cases: NDArray[np.int64],
    name: str,
) -> Iterator[str]:
    """A link to the case of each point, which says what the point is."""
    x, y = pixels
    outlines = (markers(shape, size, x[place : place + 1], y[place : place + 1]) for place in range(x.size))
    units = unit_text(placed.across.unit), unit_text(placed.panel.y.unit)
    for path, *point, case in zip(outlines, *(one.tolist() for one in values), cases.tolist(), strict=True):
        told = (f"{number(one, DIGITS)} {unit}" for one, unit in zip(point, units, strict=True))
        yield case_link(placed.cases, case, (*told, name), element("path", d=path))


def case_link(cases: str, case: int, told: Iterable[str], shape: str) -> str:
    """The link of a shape to its case, below the address ``cases``, with a title of what is told and its number."""
    what = ", ".join(filter(None, (*(one.rstrip() for one in told), gettext("case {case}", case=case))))
    return element(
        "a", element("title", escape(what)) + shape, href=f"{cases}{case}", tabindex=-1, data_case=case
    )  # fmt: skip


def _shades(line: Line, numbers: Numbers, x: Numbers, y: Numbers) -> Iterator[str]:
    """Points in the colours of numbers."""
    known = np.isfinite(numbers) & np.isfinite(x) & np.isfinite(y)
    if not known.any():
        return
    low, high = float(numbers[known].min()), float(numbers[known].max())
    place = np.zeros(numbers.size, dtype=np.int64)
    place[known] = np.round((numbers[known] - low) / ((high - low) or 1.0) * (_SHADES - 1)).astype(np.int64)
    for step in np.unique(place[known]).tolist():
        own = known & (place == step)
        yield element("path", d=markers(line.marker, 3.0, x[own], y[own]), fill=shade(step / (_SHADES - 1)))


def _marks(placed: Placed) -> Iterator[str]:
    for marks in placed.panel.marks:
        if not marks.x.size:
            continue
        look = {"fill": colour_of(MARKS[marks.regime].colour)}
        x, y, shape = placed.x(marks.x), placed.y(marks.y), MARKS[marks.regime].symbol
        known = np.isfinite(x) & np.isfinite(y)
        x, y, cases = x[known], y[known], marks.cases[known]
        if placed.linked:
            name, values = motion_text(marks.regime), (marks.x[known], marks.y[known])
            yield element("g", "".join(_links(placed, shape, 4.0, (x, y), values, cases, name)), **look)
        else:
            more = {"data_cases": " ".join(map(str, cases.tolist()))} if placed.cases else {}
            yield _many(shape, 4.0, x, y, {**look, **more, "data_line": motion_text(marks.regime)})


def _notes(placed: Placed, curves: Sequence[tuple[Numbers, Numbers]]) -> tuple[list[str], list[Box]]:
    """Points that are read off lines with their texts, where no curve runs, and the boxes of these."""
    parts: list[str] = []
    boxes: list[Box] = []
    lines = [dense(x, y) for x, y in curves] if placed.panel.notes else []
    for note in placed.panel.notes:
        x, y = placed.x.at(note.x), placed.y.at(note.y)
        if not (np.isfinite(x) and np.isfinite(y)):
            continue
        ring, colour = note.kind == "point", placed.colour(note.key, note.colour)
        look = {"fill": "none", "stroke": colour, "stroke_width": 2} if ring else {"fill": colour}
        parts.append(_many(NOTE_MARKERS[note.kind], 5.5 if ring else 4.5, np.array([x]), np.array([y]), look))
        if note.text:
            places = list(_beside(placed, x, y, text_width(note.text, SMALL), placed.panel.on_the_right(note)))
            box = clearest(places, lines, boxes)
            boxes.append(box)
            parts.append(halo(note.text, box.left, box.bottom - 3.0, font_size=SMALL, fill="var(--ink)"))
    return parts, boxes


def _beside(placed: Placed, x: float, y: float, wide: float, on_the_right: bool) -> Iterator[Box]:
    """Places for a text at a point: above and below it, on the side with more room first."""
    room = max(placed.width - wide, 0.0)
    sides = [min(max(left, 0.0), room) for left in (x + 8.0, x - wide - 8.0)]
    for away in range(0, 60, 10):
        for line in (y - 9.0 - away, y + 19.0 + away):
            base = max(min(line, placed.height - 3.0), 11.0)
            for left in reversed(sides) if on_the_right else sides:
                yield Box(left, base - 11.0, left + wide, base + 3.0)


def _names(
    placed: Placed, curves: dict[int, tuple[NDArray[np.int64], Numbers, Numbers]], boxes: list[Box]
) -> list[Named]:
    """The names at the curves of a panel, of those that find a place."""
    lines = placed.panel.lines
    distinct = {line.name for line in lines if line.joined and line.name}
    own = [index for index, line in enumerate(lines) if line.joined and line.name and not line.heading]
    if len(distinct) != len(own) or len(own) < 2 or any(line.heading for line in lines):
        return []
    curved = [(lines[index].name, *curves[index][1:]) for index in own]
    others = [curves[index][1:] for index in curves if index not in own]
    chosen = next((at for at, index in enumerate(own) if placed.chosen and lines[index].key == placed.chosen), None)
    return named_curves(curved, others, boxes, (placed.width, placed.height), chosen)


def scale_parts(figure: Figure, panel: Panel, height: float) -> list[str]:
    """The scale of the numbers that colour points, from the upper left corner of its place."""
    every = [line.shades[np.isfinite(line.shades)] for line in panel.lines if line.shades is not None]
    values = np.concatenate(every) if every else np.empty(0)
    return colour_scale(float(values.min()), float(values.max()), height, figure.scale) if values.size else []


def colour_scale(low: float, high: float, height: float, name: str) -> list[str]:
    """Colours from a least to a largest number, with round numbers beside them and their name above."""
    scale = Scale(low, high, height, 0.0)
    steps = 48
    tall = height / steps
    parts = [
        element(
            "rect", x=0, y=height - tall * (step + 1), width=11, height=tall + 0.5, fill=shade((step + 0.5) / steps)
        )
        for step in range(steps)
    ]
    ticks = scale.rising() if high > low else [low]
    parts += [
        text_at(tick_text(value), 16.0, scale.at(value) + 4.0, font_size=SMALL, fill="var(--soft)") for value in ticks
    ]
    if name:
        parts.append(text_at(name, _SCALE_WIDTH, -8.0, text_anchor="end", font_size=SMALL, fill="var(--soft)"))
    return parts
