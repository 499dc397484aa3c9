"""Legends: entries in rows, and blocks of colour for many curves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from sprag_study.service.figures.figure import BANDS, NEUTRAL, NOTES, shortened
from sprag_study.service.figures.orders import motion_text
from sprag_study.service.figures.painter.elements import (
    LINE,
    SMALL,
    colour_of,
    element,
    lines_of,
    marker,
    moved,
    text_at,
    text_width,
)  # fmt: skip
from sprag_study.service.reading.reader import shown
from sprag_study.service.results.regimes import MARKS

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from sprag_study.service.figures.figure import Figure, Fill, Line, NoteKind

DASHES: Final = (None, "7 4", "2 3", "8 3 2 3")
NOTE_MARKERS: Final[dict[NoteKind, str]] = {"largest": "triangle-down", "smallest": "triangle-up", "point": "circle"}
#: Curves from which on blocks of colour stand in the place of entries.
MANY: Final = 12
#: Pixels of the sign of an entry and behind an entry, and letters of a name.
_SIGN: Final = 26.0
_BEHIND: Final = 16.0
_MOST_LETTERS: Final = 60
_BLOCK: Final = 12.0
#: Dashes of the sign of a line that has a marker in its middle.
_BESIDE_MARKER: Final = "3 3"


class Entry(NamedTuple):
    """An entry of a legend: its sign, drawn around the middle of its place, and its text; alone in bold a heading."""

    sign: str
    text: str


class Rows(NamedTuple):
    """What a legend draws, from its upper edge on, and its height (px)."""

    parts: list[str]
    height: float


def line_entry(line: Line) -> Entry:
    """The entry of a line."""
    colour = colour_of(line.colour)
    width = 3.0 if line.wide else 2.0
    marked = line.marked(line.x.size)
    dash = DASHES[line.style % len(DASHES)]
    if marked and dash:  # its gaps are beside the marker
        dash = _BESIDE_MARKER
    parts = (
        [element("path", d="M2 0h18", stroke=colour, stroke_width=width, stroke_dasharray=dash)] if line.joined else []
    )
    if marked:
        parts.append(sign_of(line.marker, colour, ring=line.ring))
    return Entry("".join(parts), shortened(line.name, _MOST_LETTERS))


def sign_of(shape: str, colour: str, size: float = 3.5, *, ring: bool = False) -> str:
    """A marker as the sign of an entry."""
    look = {"fill": "none", "stroke": colour, "stroke_width": 2} if ring else {"fill": colour}
    return element("path", d=f"M11 0{marker(shape, size + ring)}", **look)


def fill_entry(fill: Fill) -> Entry:
    """The entry of an area."""
    return Entry(area(colour_of(fill.colour), 0.25), fill.name)


def regime_entry(name: str) -> Entry:
    """The entry of the marks of a regime."""
    return Entry(sign_of(MARKS[name].symbol, colour_of(MARKS[name].colour)), motion_text(name))


def area(colour: str, opacity: float | None = None) -> str:
    """An area as the sign of an entry."""
    return element("rect", x=2, y=-5, width=18, height=10, fill=colour, fill_opacity=opacity)


def mark_entries(figure: Figure, patterns: Mapping[str, str]) -> Iterator[Entry]:
    """The entries of marks, jumps, notes and states; ``patterns`` fill the states."""
    for name in figure.regimes:
        yield regime_entry(name)
    if figure.banded:
        yield Entry(area(NEUTRAL, 0.35), shown(BANDS))
    for kind in figure.noted:
        yield Entry(sign_of(NOTE_MARKERS[kind], "var(--soft)", 4.0, ring=kind == "point"), shown(NOTES[kind]))
    for state in figure.shown_looks:
        if state not in figure.regimes or figure.motion:
            yield Entry(area(patterns[state]), motion_text(state))


def rows_of(entries: Iterable[Entry], width: float, heading: str = "") -> Rows:
    """Entries one after the other in rows of a width, behind a heading."""
    parts: list[str] = []
    left, row = 0.0, 0
    every = [Entry("", f"{heading}:")] if heading else []
    for sign, text in (*every, *entries):
        bold = not sign
        behind = _SIGN if sign else 0.0
        lines = lines_of(text, width - behind, SMALL) or [""]
        own = behind + max(text_width(line, SMALL, bold=bold) for line in lines)
        if left and left + own > width:
            left, row = 0.0, row + 1
        middle = LINE * (row + 0.5)
        if sign:
            parts.append(moved(sign, left, middle))
        parts += [
            text_at(
                line, left + behind, middle + 4.0 + LINE * place, font_size=SMALL, font_weight=600 if bold else None
            )
            for place, line in enumerate(lines)
        ]
        row += len(lines) - 1
        left = left + own + (_BEHIND if sign else 8.0) if len(lines) == 1 else width
    return Rows(parts, LINE * (row + 1) if parts else 0.0)


def blocks(lines: Sequence[Line], width: float, heading: str) -> Rows:
    """A block of colour for each of many curves in their order, and the names of as many as have room."""
    own = width / len(lines)
    parts = [text_at(heading, 0.0, 13.0, font_size=SMALL, font_weight=600)] if heading else []
    top = LINE + 2.0 if heading else 2.0
    parts += [
        element("rect", x=own * place, y=top, width=own, height=_BLOCK, fill=colour_of(line.colour))
        for place, line in enumerate(lines)
    ]
    free = -1.0
    last = width - text_width(lines[-1].name, SMALL)
    for place, line in enumerate(lines):
        wide = text_width(line.name, SMALL)
        left = min(max(own * (place + 0.5) - wide / 2.0, 0.0), width - wide)
        end = place == len(lines) - 1
        if left > free and (end or left + wide + _BEHIND < last):
            parts.append(text_at(line.name, left, top + _BLOCK + 13.0, font_size=SMALL))
            free = left + wide + _BEHIND
    return Rows(parts, top + _BLOCK + LINE + 2.0)


def grouped(lines: Sequence[Line]) -> Iterator[Entry]:
    """The entries of lines, each heading once before its lines."""
    headings: set[str] = set()
    for line in lines:
        if line.heading and line.heading not in headings:
            headings.add(line.heading)
            yield Entry("", shortened(line.heading, _MOST_LETTERS))
        yield line_entry(line)
