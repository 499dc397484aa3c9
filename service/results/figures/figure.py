"""The description of a figure: panels of lines over one axis, without a word about who draws it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

#: Colours that people with any kind of colour vision tell apart (after Okabe and Ito), on light and on dark ground.
PALETTE: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f6fc4", "#8c6d31")
#: How a state looks that its model has no look for.
OTHER_LOOK: Final = ("#999999", "+", "+++")


@dataclass(frozen=True, slots=True)
class Quantity:
    """What stands at an axis: a name, "" for several of one unit, and a unit."""

    name: str
    unit: str


@dataclass(frozen=True, slots=True)
class Line:
    """A line of a panel.

    Attributes
    ----------
    name, heading : what the legend calls it, and under which heading; ``listed``: whether the legend has it
    x, y : float64 arrays, shape (m,)
        NaN is a gap.
    key : what belongs together in all panels
    colour, style : colour, and number of the dash
    cases : int64 array, shape (m,), optional
        The case of each point; a line without cases is drawn without markers.
    stretches : places of the points that are joined, each ascending; None for all of them
    joined : whether the line tells how x leads to y; otherwise there are points only
    """

    name: str
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    colour: str
    style: int = 0
    key: str = ""
    heading: str = ""
    listed: bool = True
    cases: NDArray[np.int64] | None = None
    stretches: tuple[NDArray[np.int64], ...] | None = None
    joined: bool = True


@dataclass(frozen=True, slots=True)
class Marks:
    """Points of one regime, upon the lines; ``x``, ``y`` and ``cases`` have the shape (m,)."""

    regime: str
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    cases: NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Panel:
    """One plot. ``styles`` tells what the dashes mean where they tell results apart."""

    y: Quantity
    lines: tuple[Line, ...]
    marks: tuple[Marks, ...] = ()
    styles: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Figure:
    """Panels over one axis, row by row.

    Attributes
    ----------
    family : what tells the lines of a study apart; ``studies`` is the number of studies
    regimes : names of the kinds of motion that occur, where not all are periodic
    spans : for each row of a strip below the panels its states: (state, begin, end)
    looks : colour and two patterns of each state
    motion : whether it is a motion: all lines are read at one x
    most : points that a line is drawn with at most, where there are more than can be told apart
    note : a sentence, where there is nothing to draw
    """

    x: Quantity
    panels: tuple[Panel, ...]
    columns: int = 1
    family: tuple[Quantity, ...] = ()
    studies: int = 1
    regimes: tuple[str, ...] = ()
    held: tuple[str, ...] = ()
    spans: Mapping[str, tuple[tuple[str, float, float], ...]] = field(default_factory=dict)
    looks: Mapping[str, tuple[str, str, str]] = field(default_factory=dict)
    motion: bool = False
    most: int = 6_000
    note: str = ""

    @property
    def rows(self) -> int:
        """Rows of panels."""
        return -(-len(self.panels) // self.columns)

    @property
    def listed(self) -> list[Line]:
        """The lines that the legend has."""
        return [line for panel in self.panels for line in panel.lines if line.listed]


def line_colours(count: int) -> list[str]:
    """Colours that differ most for a few lines, and that follow the order of many."""
    if count <= len(PALETTE):
        return list(PALETTE[:count])
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    return [to_hex(colormaps["viridis"](0.92 * index / (count - 1))) for index in range(count)]


def shortened(label: str, most: int) -> str:
    """A long name without its middle: a legend has little room, and ends tell more of similar names apart."""
    return label if len(label) <= most else f"{label[: most - 25]}…{label[-24:]}"
