"""Maps as SVG: colours over two axes, lines of equal value, or the periods after which motions repeat."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Final, cast

import numpy as np

from sprag_study.service.figures.curves import doubtful_marks, map_quantities
from sprag_study.service.figures.figure import shade
from sprag_study.service.figures.orders import TITLE, map_edges, motion_text, order_map
from sprag_study.service.figures.painter.bitmap import data_address
from sprag_study.service.figures.painter.elements import (
    LINE,
    SMALL,
    colour_of,
    element,
    halo,
    lines_of,
    markers,
    moved,
    path_of,
    short,
    text_width,
)  # fmt: skip
from sprag_study.service.figures.painter.legends import Entry, area, regime_entry, rows_of
from sprag_study.service.figures.painter.panels import DIGITS, MOST_LINKS, case_link, colour_scale, x_numbers, y_numbers
from sprag_study.service.figures.painter.picture import Painting, panel_group
from sprag_study.service.figures.painter.scales import Scale, step_of, tick_text
from sprag_study.service.figures.svg import WIDE, as_file, title_of
from sprag_study.service.languages import gettext
from sprag_study.service.reading.reader import Phrase, plural, shown
from sprag_study.service.reading.wording import number, unit_text
from sprag_study.service.results.regimes import MARKS

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from sprag_study.service.figures.figure import Quantity
    from sprag_study.service.results.curves import Map
    from sprag_study.worker.arrays import Floats, Ints

#: Height of a map, and the same as a share of the width of a narrow one.
_HIGH: Final = 400.0
_SHARE: Final = 0.85
#: Colours of a map, and the lines of equal value.
_COLOURS: Final = 64
_LEVELS: Final = 10
#: Points of a map that are marked each, and of a refined one.
_MARKED: Final = 600
_REFINED: Final = 5_000
_RIGHT: Final = 78.0


def map_svg(
    drawn: Map,
    *,
    contours: bool = False,
    width: int = WIDE,
    label: str = "",
    cases: str = "",
    head: Sequence[str] = (),
    below: bool = False,
) -> str:
    """A map, already in its reader's units and words, as an element of a page; as
    `sprag_study.service.figures.svg.svg`.

    Cells without a result are left blank. The outer cells are whole, as those between them.
    """
    return _MapPainting(drawn.run(), float(width), cases, contours=contours).element(label, head, below=below)


def picture_map(drawn: Map, title: str, *, contours: bool = False) -> str:
    """The same map as a file of its own."""
    head = [line for line in (title, "; ".join(drawn.held)) if line]
    return as_file(map_svg(drawn, contours=contours, label=title, head=head, below=True))


class _MapPainting(Painting):
    """One picture of a map."""

    def __init__(self, drawn: Map, width: float, cases: str, *, contours: bool) -> None:
        super().__init__(width, cases)
        self._drawn = drawn
        self._orders = order_map(drawn)
        self._known = drawn.known() if self._orders is None else self._orders.places
        self._levels = contours and self._orders is None and _has_levels(self._known)
        self._edges = map_edges(drawn)
        # Lines of equal value end at the outer values; cells are around them.
        across, up = (drawn.x_values, drawn.y_values) if self._levels else self._edges
        self._high = min(_HIGH, _SHARE * width)
        self._y = Scale(float(up[0]), float(up[-1]), self._high, 0.0, unit=drawn.units[1])
        self._left = max(text_width(self._y.text(value), SMALL) for value in self._y.rising()) + 16.0
        self._plot = width - self._left - _RIGHT
        self._x = Scale(float(across[0]), float(across[-1]), 0.0, self._plot, unit=drawn.units[0])

    def element(self, label: str, head: Sequence[str], *, below: bool) -> str:
        """The whole picture."""
        x, y, z = map_quantities(self._drawn)
        for place, text in enumerate((*head, title_of(z) if self._orders is None else shown(TITLE))):
            self._text(text, bold=place in (0, len(head)))
        self._text(f"↑ {title_of(y)}")
        self._top += 4.0
        known = self._known
        cells = self._filled(known) if self._levels else self._cells(known, self._colours(known))
        self._parts.append(
            panel_group(
                [*cells, *self._points(), *self._marks(), *self._around()], (self._left, self._top),
                (self._plot, self._high, "var(--grid)"), (self._x, self._y), (x, y),
            )
        )  # fmt: skip
        if self._orders is None and np.isfinite(known).any():
            low, high = float(np.nanmin(known)), float(np.nanmax(known))
            scale = "".join(colour_scale(low, high, self._high, ""))
            self._parts.append(moved(scale, self._left + self._plot + 14.0, self._top))
        self._top += self._high
        self._parts.append(moved("".join(x_numbers(self._x, 0.0)), self._left, self._top))
        name = lines_of(title_of(x), self._width - _RIGHT, SMALL)
        self._named_below(name, self._left + self._plot)
        self._top += LINE * (len(name) + 1) + 8.0
        self._legend(known, below=below)
        return self._whole(label or f"{title_of(z)}: {title_of(x)}, {title_of(y)}", self._about(z))

    def _about(self, z: Quantity) -> str:
        known = self._drawn.known()
        if not np.isfinite(known).any():
            return ""
        low, high = (number(float(end), 4) for end in (np.nanmin(known), np.nanmax(known)))
        return gettext("{name} from {low} to {high}", name=title_of(z), low=low, high=high)

    def _around(self) -> Iterator[str]:
        """The edge of the cells with the numbers at their left."""
        ticks = self._y.rising()
        heights = self._y(np.array(ticks)).tolist()
        yield element("path", d="".join(f"M-5 {short(at)}h5" for at in heights), stroke="var(--edge)")
        yield element("rect", width=self._plot, height=self._high, fill="none", stroke="var(--edge)")
        yield y_numbers(self._y, ticks, heights, -9.0)

    def _colours(self, known: Floats) -> tuple[Ints, list[str]]:
        """Which colour each cell has, -1 for none, and the colours."""
        there = np.isfinite(known)
        if self._orders is not None:
            return np.where(there, np.nan_to_num(known), -1).astype(np.int64), self._orders.colours
        places = np.full(known.shape, -1, dtype=np.int64)
        if there.any():
            low, high = float(known[there].min()), float(known[there].max())
            shares = (known[there] - low) / ((high - low) or 1.0)
            places[there] = np.minimum((shares * _COLOURS).astype(np.int64), _COLOURS - 1)
        return places, [shade((place + 0.5) / _COLOURS) for place in range(_COLOURS)]

    def _cells(self, known: Floats, painted: tuple[Ints, list[str]]) -> Iterator[str]:
        """The cells: links to their cases where there are few, otherwise a picture of pixels."""
        places, colours = painted
        across, up = self._x(self._edges[0]), self._y(self._edges[1])
        if self._cases and self._drawn.refined is None and places.size <= MOST_LINKS:
            yield from self._links(known, painted, (across, up))
            return
        # Every pixel has the colour of the cell in which its middle lies.
        columns = np.searchsorted(np.sort(across), np.arange(0.5, self._plot), side="right") - 1
        rows = np.searchsorted(-up, -np.arange(self._high - 0.5, 0.0, -1.0)[::-1], side="right") - 1
        columns, rows = np.clip(columns, 0, places.shape[1] - 1), np.clip(rows, 0, places.shape[0] - 1)
        yield element(
            "image", width=self._plot, height=self._high, preserveAspectRatio="none",
            href=data_address(places[np.ix_(rows, columns)], colours), image_rendering="pixelated",
        )  # fmt: skip

    def _links(self, known: Floats, painted: tuple[Ints, list[str]], edges: tuple[Floats, Floats]) -> Iterator[str]:
        (places, colours), (across, up) = painted, edges
        x, y, z = map_quantities(self._drawn)
        for row, column in np.argwhere(places >= 0).tolist():
            left, right = across[column], across[column + 1]
            bottom, top = up[row], up[row + 1]
            case, place = int(self._drawn.cases[row, column]), places[row, column]
            names = self._orders.names if self._orders is not None else None
            value = (motion_text(names[row][column] or "") if names is not None else
                     f"{number(float(known[row, column]), DIGITS)} {unit_text(z.unit)}")  # fmt: skip
            told = (
                value,
                f"{x.name} {number(self._drawn.x_values[column], DIGITS)} {unit_text(x.unit)}",
                f"{y.name} {number(self._drawn.y_values[row], DIGITS)} {unit_text(y.unit)}",
            )
            # Cells overlap a little, so that no line is seen between them.
            cell = element(
                "rect", x=float(left), y=float(top), width=float(right - left) + 0.4, height=float(bottom - top) + 0.4,
                fill=colours[place],
            )  # fmt: skip
            yield case_link(self._cases, case, told, cell)

    def _filled(self, known: Floats) -> Iterator[str]:
        """Colours between lines of equal value, and the numbers of these."""
        from contourpy import FillType, LineType, contour_generator

        low, high = float(np.nanmin(known)), float(np.nanmax(known))
        step = step_of(low, high, _LEVELS)
        levels = [step * place for place in range(int(np.floor(low / step)), int(np.ceil(high / step)) + 1)]
        values = np.ma.masked_invalid(known)
        made = contour_generator(
            self._x(np.array(self._drawn.x_values)), self._y(np.array(self._drawn.y_values)), values,
            fill_type=FillType.OuterOffset, line_type=LineType.Separate,
        )  # fmt: skip
        for lower, upper in pairwise(levels):
            points, offsets = cast("tuple[list[Floats], list[Ints]]", made.filled(lower, upper))
            path = "".join(
                path_of(*polygon[start:stop].T) + "z"
                for polygon, starts in zip(points, offsets, strict=True)
                for start, stop in zip(starts[:-1].tolist(), starts[1:].tolist(), strict=True)
            )
            colour = shade(((lower + upper) / 2.0 - low) / (high - low))
            yield element("path", d=path, fill=colour, fill_rule="evenodd", stroke=colour, stroke_width=0.5)
        written: list[tuple[float, float]] = []
        for level in levels:
            lines = cast("list[Floats]", made.lines(level))
            yield element("path", d="".join(path_of(*line.T) for line in lines), fill="none", stroke="#404040",
                          stroke_width=0.8, class_="level")  # fmt: skip
            longest = max(lines, key=len, default=None)
            if longest is not None and len(longest) > 2:
                x, y = longest[len(longest) // 2].tolist()
                if all(abs(x - a) > 44.0 or abs(y - b) > 15.0 for a, b in written):
                    written.append((x, y))
                    inside = min(max(x, 18.0), self._plot - 18.0), min(max(y + 4.0, 12.0), self._high - 3.0)
                    yield halo(tick_text(round(level, 12)), *inside, text_anchor="middle", font_size=SMALL)

    def _points(self) -> Iterator[str]:
        """The cases: of a grid the middles of its cells, of a refined map where they are."""
        drawn = self._drawn
        if drawn.refined is not None:
            x, y, few = drawn.refined.x, drawn.refined.y, drawn.refined.x.size <= _REFINED
        else:
            across, up = np.meshgrid(drawn.x_values, drawn.y_values)
            x, y, few = across.reshape(-1), up.reshape(-1), across.size <= _MARKED and not self._cases
        if few:
            cases = drawn.refined.cases.tolist() if drawn.refined is not None and self._cases else []
            known = {"data_cases": " ".join(map(str, cases))} if cases else {}
            yield element("path", d=markers("circle", 1.1, self._x(x), self._y(y)), fill="#4d4d4d", **known)

    def _marks(self) -> Iterator[str]:
        for marks in doubtful_marks(self._drawn):
            look = MARKS[marks.regime]
            path = markers(look.symbol, 4.0, self._x(marks.x), self._y(marks.y))
            yield element("path", d=path, fill=colour_of(look.colour), stroke="var(--paper)", stroke_width=0.7,
                          pointer_events="none")  # fmt: skip

    def _legend(self, known: Floats, *, below: bool) -> None:
        drawn = self._drawn
        entries = [regime_entry(marks.regime) for marks in doubtful_marks(drawn)]
        for name, (colour, _) in self._orders.looks.items() if self._orders is not None else ():
            entries.append(Entry(area(colour), motion_text(name)))
        missing = int(np.isnan(known).sum())
        if missing:
            text = plural("{count} case without a result", "{count} cases without a result", missing)
            entries.append(Entry(area("var(--grid)"), shown(Phrase("not interpolated") if drawn.refined else text)))
        if entries:
            self._rows(rows_of(entries, self._width - 8.0))
        if below and drawn.refined is not None:
            self._text(shown(drawn.refined.sentence))


def _has_levels(values: Floats) -> bool:
    """Whether there are lines of equal value."""
    known = values[np.isfinite(values)]
    return min(values.shape) > 1 and known.size > 0 and bool(known.max() > known.min())
