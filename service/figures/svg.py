"""Described figures as SVG: inside pages in the colours of the page, as files in their own."""

from __future__ import annotations

from dataclasses import dataclass, replace
from html import escape
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.service.figures.figure import Line
from sprag_study.service.figures.orders import motion_text
from sprag_study.service.figures.painter.elements import (
    LINE,
    SMALL,
    cut,
    dots,
    element,
    lines_of,
    moved,
    on_paper,
    path_of,
    short,
    text_at,
    text_width,
)  # fmt: skip
from sprag_study.service.figures.painter.legends import (
    MANY,
    Rows,
    blocks,
    fill_entry,
    grouped,
    line_entry,
    mark_entries,
    rows_of,
)  # fmt: skip
from sprag_study.service.figures.painter.panels import (
    Placed,
    colour_beside,
    linked,
    panel_parts,
    scale_parts,
    x_numbers,
)
from sprag_study.service.figures.painter.patterns import pattern
from sprag_study.service.figures.painter.picture import Painting, panel_group
from sprag_study.service.figures.painter.scales import Scale, extent, rounded_scale, tick_text
from sprag_study.service.languages import gettext
from sprag_study.service.reading.wording import unit_text

if TYPE_CHECKING:
    from collections.abc import Sequence
    from collections.abc import Set as AbstractSet

    from sprag_study.service.figures.figure import Figure, Fill, Panel, Quantity

#: Widths of a picture that a page has for a wide and for a narrow place (px), and of one in two columns.
WIDE: Final = 720
NARROW: Final = 350
DOUBLE: Final = 1100
#: Pixels of the height of a panel: alone, among others, of a motion.
_ALONE: Final = 300.0
_AMONG: Final = 180.0
_MOTION: Final = 150.0
#: Pixels between columns, right of a panel, of a colour scale, and of a row of states.
_BETWEEN: Final = 34.0
_RIGHT: Final = 14.0
_SCALE: Final = 62.0
_STATE: Final = 18.0
#: Pixels above a panel, in which half of its highest number stands.
_GAP: Final = 13.0
#: Runs of a state that are so near (px) are drawn as one.
_NEAR: Final = 0.4
#: Share of the width that names of states take at most.
_NAMES: Final = 0.3
_FONTS: Final = "system-ui, 'Segoe UI', 'Noto Sans', 'DejaVu Sans', 'Libertinus Serif', sans-serif"


def svg(
    figure: Figure,
    *,
    width: int = WIDE,
    label: str = "",
    cases: str = "",
    chosen: str = "",
    head: Sequence[str] = (),
    below: bool = False,
) -> str:
    """A figure, already in its reader's units and words, as an element of a page.

    Parameters
    ----------
    width : pixels; the picture is as high as it needs
    label : what it shows, for those who do not see it
    cases : address of the cases of its points, which their numbers follow, such as ``/studies/ID/cases/``
    chosen : key of the line that is drawn in ink, its family grey
    head : lines above it; ``below`` adds the sentence below it
    """
    return _Painting(figure, float(width), cases, chosen).element(label, head, below=below)


def picture_svg(figure: Figure, title: str, *, width: int | None = None) -> str:
    """The same figure as a file of its own, with its title and what is held, in its own colours."""
    held = figure.held if figure.studies == 1 else ()
    lines = [title, "; ".join(held)]
    across = width or (WIDE if figure.columns == 1 else DOUBLE)
    inner = svg(figure, width=across, label=title, head=[line for line in lines if line], below=True)
    return as_file(inner)


def as_file(inner: str) -> str:
    """A picture of a page as a file: with white paper, fonts and colours."""
    start = inner.index(">") + 1
    opening = inner[:start].replace("<svg ", f'<svg xmlns="http://www.w3.org/2000/svg" font-family="{_FONTS}" ', 1)
    return on_paper(f'{opening}<rect width="100%" height="100%" fill="var(--paper)"/>{inner[start:]}\n')


def spark(figure: Figure | Line, width: int = 96, height: int = 32) -> str:
    """A thumbnail of the first panel of a figure, or of a line, without numbers: it stands beside text that says it."""
    lines = [figure] if isinstance(figure, Line) else [one for one in figure.panels[0].lines if one.shades is None]
    across, up = extent(line.x for line in lines), extent(line.y for line in lines)
    if across is None or up is None:
        return element("svg", "", viewBox=f"0 0 {width} {height}", width=width, height=height, aria_hidden="true")
    x, y = Scale(*across, 3.0, width - 3.0), Scale(min(*up, 0.0), max(*up, 0.0), height - 3.0, 3.0)
    parts = [element("path", d=f"M0 {short(y.at(0.0))}H{width}", stroke="var(--grid)")]
    for line in lines:
        known = np.isfinite(line.x) & np.isfinite(line.y)
        every = max(int(known.sum()) // (2 * width), 1)
        points = x(line.x[known][::every]), y(line.y[known][::every])
        if line.joined:
            stroke = "var(--ink)" if line is lines[0] else "var(--edge)"
            parts.append(element("path", d=path_of(*points), fill="none", stroke=stroke, stroke_width=1.5))
        else:
            parts.append(element("path", d=dots(*points), stroke="var(--ink)", stroke_width=2, stroke_linecap="round"))
    size = {"viewBox": f"0 0 {width} {height}", "width": width, "height": height}
    return element("svg", "".join(parts), class_="spark", **size, aria_hidden="true")


@dataclass(slots=True)
class _Column:
    """A column of panels: its left edge, the room for its numbers, and the width of its panels (px)."""

    left: float
    numbers: float
    width: float


class _Painting(Painting):
    """One picture of a figure of a width."""

    def __init__(self, figure: Figure, width: float, cases: str, chosen: str) -> None:
        super().__init__(width, cases)
        self._figure, self._chosen = figure, chosen
        self._linked = cases != "" and linked(figure)
        self._across = None if figure.apart else self._ends(figure.panels)
        alone = figure.apart or (figure.rows == 1 and not figure.motion)
        high = _ALONE if alone else _MOTION if figure.motion else _AMONG
        self._high = min(high, 0.8 * width / figure.columns)
        self._patterns: dict[str, str] = {}
        definitions = ""
        for place, (state, (colour, shape)) in enumerate(figure.shown_looks.items()):
            if not shape:
                self._patterns[state] = colour
                continue
            definitions += pattern(f"~{place}", colour, shape)
            self._patterns[state] = f"url(#~{place})"
        if definitions:
            self._parts.append(element("defs", definitions))

    def element(self, label: str, head: Sequence[str], *, below: bool) -> str:
        """The whole picture."""
        figure = self._figure
        label = label or ", ".join(panel.y.name for panel in figure.panels)
        about = described(figure)
        for place, text in enumerate(head):
            self._text(text, bold=not place)
        if figure.note:
            self._text(figure.note)
            return self._whole(label, about)
        if figure.heading:
            self._text(figure.heading)
        columns = self._columns()
        # Names stand at curves where they find a place, so panels come before the legend above them.
        rows = [self._row(row, columns) for row in range(figure.rows)]
        self._legend(_named_throughout(rows))
        for place, row in enumerate(rows):
            self._add(row, last=place == len(rows) - 1, columns=columns)
        entries = list(mark_entries(figure, self._patterns))
        if entries:
            self._rows(rows_of(entries, self._width - 8.0, figure.title_of_marks))
        if below and figure.below:
            self._text(figure.below)
        return self._whole(label, about)

    # Layout ---------------------------------------------------------------------------------------------------------

    def _columns(self) -> list[_Column]:
        figure = self._figure
        own = (self._width - _BETWEEN * (figure.columns - 1)) / figure.columns
        found = []
        for column in range(figure.columns):
            panels = figure.panels[column :: figure.columns]
            numbers = max((text_width(text, SMALL) for panel in panels for text in self._numbers(panel)), default=0.0)
            if figure.spans:
                widest = max(text_width(row, SMALL) for row in figure.spans)
                numbers = max(numbers, min(widest, _NAMES * own))
            right = _RIGHT + (_SCALE if _scaled(figure) else 0.0)
            found.append(_Column((own + _BETWEEN) * column, numbers + 12.0, own - numbers - 12.0 - right))
        return found

    def _numbers(self, panel: Panel) -> list[str]:
        return [tick_text(value) for value in self._y_scale(panel).rising()]

    def _y_scale(self, panel: Panel) -> Scale:
        figure = self._figure
        panels = [one for one in figure.panels if one.y == panel.y] if figure.alike else [panel]
        values = [line.y for one in panels for line in one.lines]
        values += [array for one in panels for fill in one.fills for array in (fill.low, fill.high)]
        values += [marks.y for one in panels for marks in one.marks]
        log = "y" in figure.log
        ends = extent(values, log=log)
        scale = rounded_scale(ends, self._high, zero=figure.from_zero, log=log, unit=panel.y.unit)
        flipped = "y" in figure.flipped
        return scale.over(0.0, self._high) if flipped else scale.over(self._high, 0.0)

    def _ends(self, panels: Sequence[Panel]) -> tuple[float, float]:
        """The least and the largest x of panels."""
        figure = self._figure
        values = [line.x for one in panels for line in one.lines] + [fill.x for one in panels for fill in one.fills]
        values += [np.array([end for _, *ends in spans for end in ends]) for spans in figure.spans.values()]
        return extent(values, log="x" in figure.log) or (1.0, 10.0)

    def _x_scale(self, panel: Panel, width: float) -> Scale:
        figure = self._figure
        log = "x" in figure.log
        low, high = self._across or self._ends((panel,))
        if high - low <= 1e-12 * max(abs(low), abs(high)):
            room = 0.05 * abs(low) or 0.5
            low, high = (low / 2.0, high * 2.0) if log else (low - room, high + room)
        # Points at the ends are whole.
        edge = 0.0 if figure.motion else 6.0
        ends = (width - edge, edge) if "x" in figure.flipped else (edge, width - edge)
        unit = (panel.x or figure.x).unit
        return Scale(low, high, *ends, log=log, unit=unit)

    def _row(self, row: int, columns: Sequence[_Column]) -> _Row:
        """The panels of a row side by side."""
        figure, made = self._figure, _Row([], [], [], 0.0)
        for column, panel in zip(columns, figure.panels[row * figure.columns :], strict=False):
            placed = Placed(
                figure, panel, self._x_scale(panel, column.width), self._y_scale(panel), column.width, self._high,
                self._cases, self._linked, self._chosen,
            )  # fmt: skip
            parts, named = panel_parts(placed)
            made.placed.append((placed, parts))
            names = {one.text for one in named}
            made.named.append(names)
            title = _title_lines(panel.y, column.width + column.numbers)
            legend = self._own_legend(panel, column, names)
            made.titles.append((title, legend))
            made.head = max(made.head, LINE * len(title) + legend.height + _GAP)
        return made

    def _add(self, row: _Row, *, last: bool, columns: Sequence[_Column]) -> None:
        """Draw a row, below it the states and the numbers of the axis."""
        figure = self._figure
        top = self._top + row.head
        bottom = top + self._high
        for column, (placed, parts), (title, legend) in zip(columns, row.placed, row.titles, strict=False):
            start = top - _GAP + 2.0 - legend.height - LINE * (len(title) - 1)
            self._parts += [
                text_at(line, column.left, start + LINE * place, font_weight=600) for place, line in enumerate(title)
            ]
            if legend.parts:
                self._parts.append(moved("".join(legend.parts), column.left, top - legend.height - _GAP + 5.0))
            left = column.left + column.numbers
            self._parts.append(
                panel_group(
                    parts, (left, top), (placed.width, placed.height, "none"), (placed.x, placed.y),
                    (placed.across, placed.panel.y), figure.log,
                )
            )  # fmt: skip
            if _scaled(figure) and (scale := scale_parts(figure, placed.panel, self._high)):
                self._parts.append(moved("".join(scale), left + column.width + 10.0, top))
        self._top = bottom
        if last and figure.spans:
            for column, (placed, _) in zip(columns, row.placed, strict=False):
                self._strip(column, placed.x, bottom + 8.0)
            self._top += 8.0 + _STATE * len(figure.spans)
        if last or figure.apart:
            self._axis(row, columns)
        else:
            self._top += 10.0

    def _axis(self, row: _Row, columns: Sequence[_Column]) -> None:
        """Numbers and names of the x axes."""
        most = 0
        for column, (placed, _) in zip(columns, row.placed, strict=False):
            left = column.left + column.numbers
            names = lines_of(title_of(placed.across), column.width + column.numbers, SMALL)
            most = max(most, len(names))
            self._parts.append(moved("".join(x_numbers(placed.x, 0.0)), left, self._top))
            self._named_below(names, left + column.width)
        self._top += 24.0 + LINE * most

    def _strip(self, column: _Column, x: Scale, top: float) -> None:
        """The states along x, a row for each part of the machine or curve."""
        left = column.left + column.numbers
        for place, (name, spans) in enumerate(self._figure.spans.items()):
            middle = top + _STATE * place
            written = cut(name, column.numbers - 10.0, SMALL)
            self._parts.append(
                text_at(written, left - 7.0, middle + 12.0, text_anchor="end", font_size=SMALL, fill="var(--soft)")
            )
            runs: dict[str, list[list[float]]] = {}
            for state, begin, end in spans:
                low, high = sorted((x.at(begin), x.at(end)))
                own = runs.setdefault(state, [])
                if own and low - own[-1][1] < _NEAR:
                    own[-1][1] = high
                else:
                    own.append([low, high])
            for state, own in runs.items():
                path = "".join(
                    f"M{short(left + low)} {short(middle)}h{short(max(high - low, 0.3))}v14H{short(left + low)}z"
                    for low, high in own
                )
                what = element("title", escape(f"{name}: {motion_text(state)}"))
                self._parts.append(element("path", what, d=path, fill=self._patterns[state]))

    # Legends --------------------------------------------------------------------------------------------------------

    def _own_legend(self, panel: Panel, column: _Column, named: AbstractSet[str]) -> Rows:
        """The legend of a panel whose lines are its own: what is not named at its curve."""
        figure = self._figure
        listed = [line for line in panel.lines if line.listed and not (line.joined and line.name in named)]
        if not (figure.motion or figure.apart) or figure.family or len(listed) < (1 if named else 2):
            return Rows([], 0.0)
        return rows_of(map(line_entry, map(self._seen, listed)), column.width + column.numbers)

    def _filled(self, fill: Fill) -> Fill:
        """An area as the panels show it."""
        return replace(fill, colour=colour_beside(fill.key, fill.colour, self._chosen)) if self._chosen else fill

    def _seen(self, line: Line) -> Line:
        """A line as the panels show it: beside the chosen one, grey."""
        if not self._chosen:
            return line
        own = line.key == self._chosen
        return replace(line, colour=colour_beside(line.key, line.colour, self._chosen), wide=line.wide or own)

    def _legend(self, named: AbstractSet[str]) -> None:
        """The legend of the lines that all panels have: all but the ``named``, which stand at their curves."""
        figure = self._figure
        own = (figure.motion or figure.apart) and not figure.family
        unnamed = (line for line in figure.listed if line.heading or not (line.joined and line.name in named))
        listed = [] if own else list(unnamed)
        fills = [] if own else [fill for panel in figure.panels for fill in panel.fills if fill.listed]
        if fills:
            listed = [line for line in listed if line.name or line.heading]
        heading = ", ".join(map(title_of, figure.family)) or (gettext("Study") if figure.studies > 1 else "")
        listed = list(map(self._seen, listed))
        if len(listed) > MANY and not any(line.heading for line in listed):
            self._rows(blocks(listed, self._width - 20.0, heading))
        elif len(listed) + len(fills) > (0 if named or figure.family or fills else 1):
            self._rows(
                rows_of([*map(fill_entry, map(self._filled, fills)), *grouped(listed)], self._width - 8.0, heading)
            )
        elif figure.family and named:
            self._text(gettext("A curve for each: {quantities}", quantities=heading))


@dataclass(slots=True)
class _Row:
    """A row of panels: with their parts, the names at their curves, titles and legends, and their height."""

    placed: list[tuple[Placed, list[str]]]
    named: list[set[str]]
    titles: list[tuple[list[str], Rows]]
    head: float


def _named_throughout(rows: Sequence[_Row]) -> set[str]:
    """The names that stand at their curve in every panel that draws it: a reader needs them nowhere else."""
    panels = [(placed.panel, names) for row in rows for (placed, _), names in zip(row.placed, row.named, strict=True)]
    without = {
        line.name
        for panel, names in panels
        for line in panel.lines
        if line.name not in names and bool((np.isfinite(line.x) & np.isfinite(line.y)).any())
    }
    return {name for _, names in panels for name in names} - without


def _scaled(figure: Figure) -> bool:
    return any(line.shades is not None for panel in figure.panels for line in panel.lines)


def title_of(quantity: Quantity) -> str:
    """The title of an axis: what it is called, and its unit."""
    unit = unit_text(quantity.unit)
    if not quantity.name:
        return unit or gettext("dimensionless")
    return f"{quantity.name} ({unit})" if unit else quantity.name


def _title_lines(quantity: Quantity, width: float) -> list[str]:
    return lines_of(title_of(quantity), width, bold=True)


def described(figure: Figure) -> str:
    """What a figure shows in a sentence: its quantities with their ranges."""
    parts = []
    for panel in figure.panels:
        ends = extent([line.y for line in panel.lines])
        if ends is not None:
            name = title_of(panel.y)
            parts.append(gettext("{name} from {low} to {high}", name=name, low=_shown(ends[0]), high=_shown(ends[1])))
    return "; ".join(parts)


def _shown(value: float) -> str:
    return tick_text(float(f"{value:.4g}"))
