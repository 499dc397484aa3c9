"""The description of a figure: panels of lines over one axis, independent of the painter."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Literal

import numpy as np

from sprag_study.service.languages import gettext
from sprag_study.service.reading.reader import Phrase
from sprag_study.worker.arrays import Floats, Ints

#: Colours of lines on white paper, with a contrast of at least 4.5 : 1; pages have others on dark ground. Markers,
#: dashes and names repeat what they tell apart.
PALETTE: Final = ("#0b5cad", "#c2500a", "#17713a", "#8a4a9e", "#00798c", "#7a6a00", "#b0396b", "#6b4f3a")
#: Colours of numbers in their order, from dark to light, so that they read in grey too (after viridis).
_SHADES: Final = ("#440154", "#472d7b", "#3b528b", "#2c728e", "#21918c", "#28ae80", "#5ec962", "#addc30", "#fde725")
#: Colour of what stands for the whole of other lines, or is drawn for reference only.
NEUTRAL: Final = "#7a7f87"
#: What bands are, for the legend.
BANDS: Final = Phrase("jump, not interpolated")
#: Shapes of markers, in the order of lines: they repeat the distinction by colour, for prints in grey.
MARKERS: Final = ("circle", "square", "diamond", "triangle-up", "x", "triangle-down", "star", "cross")
#: Lines with more points are drawn without markers.
_MARKED: Final = 60
#: Look of a state for which its model defines none.
OTHER_LOOK: Final = ("#999999", "+")


@dataclass(frozen=True, slots=True)
class Quantity:
    """The quantity of an axis: its name, "" for several quantities of one unit, and its unit."""

    name: str
    unit: str


@dataclass(frozen=True, slots=True)
class Line:
    """A line of a panel.

    Attributes
    ----------
    name, heading : its name in the legend, and the heading above it; ``listed``: whether the legend contains it
    x, y : float64 arrays, shape (m,)
        NaN is a gap.
    key : common to the lines that belong together in all panels
    colour, style : colour, and number of the dash
    cases : int64 array, shape (m,), optional
        The case of each point; a joined line without cases is drawn without markers.
    stretches : indices of the points that are joined, each ascending; None for all points
    joined : whether y is a function of x; otherwise only points are drawn
    shades : float64 array, shape (m,), optional
        Numbers that colour the points; the panel has a scale for them.
    ring : whether the points are large and open
    wide : whether the line is wider than others
    """

    name: str
    x: Floats
    y: Floats
    colour: str
    style: int = 0
    key: str = ""
    heading: str = ""
    listed: bool = True
    cases: Ints | None = None
    stretches: tuple[Ints, ...] | None = None
    joined: bool = True
    shades: Floats | None = None
    ring: bool = False
    wide: bool = False

    @property
    def marker(self) -> str:
        """The shape of its markers: that of its curve, or that of its style where its points are no cases."""
        return MARKERS[(self.style if self.cases is None else int(self.key)) % len(MARKERS)]

    def marked(self, points: int) -> bool:
        """Whether it is drawn with markers where it has so many points."""
        return not self.joined or (self.cases is not None and points <= _MARKED)


@dataclass(frozen=True, slots=True)
class Marks:
    """Points of one regime, drawn on the lines; ``x``, ``y`` and ``cases`` have the shape (m,)."""

    regime: str
    x: Floats
    y: Floats
    cases: Ints


@dataclass(frozen=True, slots=True)
class Band:
    """A part of the x axis, from ``low`` to ``high``, in which the lines of that ``key`` and ``colour`` are broken."""

    low: float
    high: float
    colour: str
    key: str


@dataclass(frozen=True, slots=True)
class Fill:
    """The area between two lines over the same x, behind all lines; arrays of shape (m,), NaN is a gap."""

    name: str
    x: Floats
    low: Floats
    high: Floats
    colour: str
    key: str = ""
    listed: bool = True


#: What a note marks: an extreme of a line, or the working point on it.
NoteKind = Literal["largest", "smallest", "point"]
#: What notes are, for the legend.
NOTES: Final[dict[NoteKind, Phrase]] = {
    "largest": Phrase("largest of its curve"),
    "smallest": Phrase("smallest of its curve"),
    "point": Phrase("working point"),
}


@dataclass(frozen=True, slots=True)
class Note:
    """A point on the line of that ``key`` and ``colour`` that is read off it, with a text beside it ("" for none)."""

    x: float
    y: float
    colour: str
    kind: NoteKind
    text: str = ""
    key: str = ""


@dataclass(frozen=True, slots=True)
class Panel:
    """One plot.

    ``x`` is the quantity of its own x axis; without one, the panel has the x axis of the figure.
    ``bands`` are the jumps of its curves, ``fills`` areas between two lines, ``notes`` points read off its lines.
    """

    y: Quantity
    lines: tuple[Line, ...]
    marks: tuple[Marks, ...] = ()
    x: Quantity | None = None
    bands: tuple[Band, ...] = ()
    fills: tuple[Fill, ...] = ()
    notes: tuple[Note, ...] = ()

    def on_the_right(self, note: Note) -> bool:
        """Whether a note is in the right half of the lines, where its text has more room to its left."""
        x = np.concatenate([line.x[np.isfinite(line.x)] for line in self.lines] or [np.empty(0)])
        return bool(x.size) and note.x > 0.5 * (x.min() + x.max())


#: The direction of an axis.
Direction = Literal["x", "y"]


@dataclass(frozen=True, slots=True)
class Figure:
    """Panels over one axis, row by row.

    Attributes
    ----------
    family : what distinguishes the lines of a study; ``studies`` is the number of studies
    regimes : names of the kinds of motion that occur, where not all are periodic
    spans : for each row of the strip below the panels, its states: (state, begin, end)
    states : what the states are, for the legend
    looks : colour and pattern of each state, in the order of the legend
    motion : whether it shows a motion, whose lines are read at one x
    heading : a sentence above the panels
    scale : the quantity of the numbers that colour points
    most : most points of a drawn line, where there are more than can be distinguished
    note : a sentence, where there is nothing to draw
    below : a sentence below the panels
    alike : whether the panels of one quantity show the same range of it, so that they can be compared
    at : x of a line across all panels, such as the working point; pages of motions draw theirs at their slider
    log, flipped : which axes have equal factors at equal distances, and which run backwards
    """

    x: Quantity
    panels: tuple[Panel, ...]
    columns: int = 1
    family: tuple[Quantity, ...] = ()
    studies: int = 1
    regimes: tuple[str, ...] = ()
    held: tuple[str, ...] = ()
    spans: Mapping[str, tuple[tuple[str, float, float], ...]] = field(default_factory=dict)
    states: str = Phrase("States")
    looks: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    motion: bool = False
    heading: str = ""
    scale: str = ""
    most: int = 6_000
    note: str = ""
    below: str = ""
    alike: bool = False
    at: float | None = None
    log: tuple[Direction, ...] = ()
    flipped: tuple[Direction, ...] = ()

    @property
    def apart(self) -> bool:
        """Whether every panel has an x axis of its own."""
        return any(panel.x for panel in self.panels)

    @property
    def from_zero(self) -> bool:
        """Whether the y axes contain zero, so that heights of curves can be compared."""
        return not (self.motion or self.apart)

    @property
    def rows(self) -> int:
        """Rows of panels."""
        return -(-len(self.panels) // self.columns)

    @property
    def shown_looks(self) -> dict[str, tuple[str, str]]:
        """The states that occur with their looks, in the order of the legend."""
        occurring = {state: None for spans in self.spans.values() for state, _, _ in spans}
        known = [state for state in self.looks if state in occurring]
        return {state: self.looks.get(state, OTHER_LOOK) for state in dict.fromkeys([*known, *occurring])}

    @property
    def title_of_marks(self) -> str:
        """What the legend of marks and strips is about."""
        if not self.regimes:
            return self.states if self.spans or not (self.banded or self.noted) else ""
        regime = gettext("Regime")
        return f"{regime}; {self.states.lower()}" if self.spans else regime

    @property
    def banded(self) -> bool:
        """Whether any panel has bands."""
        return any(panel.bands for panel in self.panels)

    @property
    def noted(self) -> tuple[NoteKind, ...]:
        """The kinds of notes that occur."""
        occurring = {note.kind for panel in self.panels for note in panel.notes}
        return tuple(kind for kind in NOTES if kind in occurring)

    @property
    def listed(self) -> list[Line]:
        """The lines that the legend has."""
        return [line for panel in self.panels for line in panel.lines if line.listed]


def colour_at(place: int) -> str:
    """The colour of a line at a place among few; those of the palette begin again."""
    return PALETTE[place % len(PALETTE)]


def line_colours(count: int) -> list[str]:
    """Colours: maximally different for a few lines, graded in order for many."""
    if count <= len(PALETTE):
        return list(PALETTE[:count])
    return [shade(0.92 * index / (count - 1)) for index in range(count)]


def shade(share: float) -> str:
    """The colour of a number that lies at this share, from 0 to 1, between the least and the largest one."""
    at = min(max(share, 0.0), 1.0) * (len(_SHADES) - 1)
    place = min(int(at), len(_SHADES) - 2)
    ends = [[int(colour[start : start + 2], 16) for start in (1, 3, 5)] for colour in _SHADES[place : place + 2]]
    parts = (round(low + (high - low) * (at - place)) for low, high in zip(*ends, strict=True))
    return "#" + "".join(f"{part:02x}" for part in parts)


def shortened(label: str, most: int) -> str:
    """A long name without its middle: a legend has little room, and similar names usually differ at their ends."""
    return label if len(label) <= most else f"{label[: most - 25]}…{label[-24:]}"
