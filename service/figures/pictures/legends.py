"""The legends of pictures: curves, studies, kinds of motion and jumps."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, Literal

from sprag.service.figures.figure import BANDS, NOTES, PALETTE, shortened
from sprag.service.figures.orders import motion_text
from sprag.service.figures.pictures.text import quantity_label, writable
from sprag.service.reading.reader import shown
from sprag.service.results.regimes import MARKS

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sprag.service.figures.figure import Figure as Described
    from sprag.service.figures.figure import Line, NoteKind

STYLES: Final[tuple[Literal["-", "--", ":", "-."], ...]] = ("-", "--", ":", "-.")
#: What matplotlib calls the shapes of markers.
MARKERS: Final = {
    "circle": "o", "square": "s", "diamond": "D", "triangle-up": "^", "x": "X", "triangle-down": "v", "star": "*",
    "cross": "P",
}  # fmt: skip
#: Markers of the points that are read off lines.
NOTE_MARKERS: Final[dict[NoteKind, str]] = {"largest": "v", "smallest": "^", "point": "o"}
#: Labels of a colour bar, which distinguishes more curves than a legend.
_BAR_LABELS: Final = 24
#: Columns of the legend of several studies, and the characters that fit in each.
COLUMNS: Final = 2
_MOST_LABEL: Final = 52
#: Points of a letter of a legend, and of a symbol with the space around an entry.
_LETTER: Final = 4.6
_SYMBOL: Final = 36.0
#: Characters on a line of a sentence below the plots.
_SENTENCE_WIDTH: Final = 110


def handle(line: Line) -> Artist:
    """The legend handle of a line."""
    from matplotlib.lines import Line2D

    return Line2D(
        [],
        [],
        color=line.colour,
        linestyle=STYLES[line.style % len(STYLES)] if line.joined else "none",
        marker=MARKERS[line.marker] if line.marked(line.x.size) else "",
        markersize=6.0 if line.ring else 4.0,
        markerfacecolor="none" if line.ring else line.colour,
    )


def explain(figure: Figure, plots: list[Axes], drawn: Described) -> None:
    """Explain the colours: in a legend above the plots, or in a colour bar beside them where there are many curves.

    As on pages, one line alone needs none, and panels with axes of their own have their own. The legend has the title
    of the picture, which would be written over it otherwise.
    """
    if not drawn.family and (len(drawn.listed) < 2 or drawn.apart):
        return
    from matplotlib.patches import Patch

    meaning = ", ".join(quantity_label(quantity) for quantity in drawn.family)
    lines = drawn.listed
    texts = [line.name for line in lines]
    if len(texts) <= len(PALETTE):
        fills = [fill for panel in drawn.panels for fill in panel.fills if fill.listed]
        labels = [*(fill.name for fill in fills), *texts]
        heading = figure.get_suptitle()
        figure.suptitle("")
        figure.legend(
            [*(Patch(color=fill.colour, alpha=0.2, linewidth=0.0) for fill in fills), *map(handle, lines)],
            labels,
            title="\n".join(filter(None, (heading, meaning))) or None, loc="outside upper center", fontsize=8,
            title_fontsize=9, ncols=columns_of(figure, labels), frameon=False,
        )  # fmt: skip
        return
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap, Normalize

    # One block of colour for each curve, with its label in the middle: values may be unevenly spaced or not be numbers.
    blocks = ScalarMappable(Normalize(-0.5, len(texts) - 0.5), ListedColormap([line.colour for line in lines]))
    bar = figure.colorbar(blocks, ax=plots, aspect=30 * len(plots))
    labelled = range(0, len(texts), math.ceil(len(texts) / _BAR_LABELS))
    bar.set_ticks(list(labelled), labels=[texts[number] for number in labelled])
    bar.ax.tick_params(labelsize=8, length=0)
    bar.set_label(meaning, fontsize=8)


def explain_studies(figure: Figure, _plots: list[Axes], drawn: Described) -> None:
    """The legend of several studies: each name once, and below it the values that distinguish its curves."""
    from matplotlib.patches import Patch

    lines = [(line.heading, handle(line), line.name) for line in drawn.listed]
    columns = COLUMNS
    if drawn.family:
        # A legend is filled column by column: blocks of equal length, equally many per column, keep the studies apart.
        empty = Patch(visible=False)
        studies = {name: [line for line in lines if line[0] == name] for name, _, _ in lines}
        length = max(map(len, studies.values()))
        blocks: list[tuple[str, Artist, str]] = []
        for name, own in studies.items():
            blocks += [(name, empty, name), *own, *[("", empty, "")] * (length - len(own))]
        lines = blocks + [("", empty, "")] * ((length + 1) * (-len(studies) % COLUMNS))
    labels = [_fitting(text) for _, _, text in lines]
    title = ", ".join(quantity_label(quantity) for quantity in drawn.family)
    figure.legend(
        [artist for _, artist, _ in lines], labels, title=title or None, loc="outside lower center",
        fontsize=8, title_fontsize=8, ncols=columns,
    )  # fmt: skip


def explain_marks(figure: Figure, drawn: Described) -> None:
    """Explain the marks, jumps, notes and states of a figure other than a motion: below the plots, or above them where
    the legend of several studies is below. The states of a motion are explained by their strip.
    """
    edge: Literal["upper", "lower"] = "lower" if drawn.studies == 1 else "upper"
    states = {name: look for name, look in drawn.shown_looks.items() if name not in drawn.regimes}
    lines = [drawn.below, drawn.title_of_marks if states else ""]
    explain_regimes(figure, drawn.regimes, edge, jumps=drawn.banded, below=lines, notes=drawn.noted, states=states)


def state_style(look: tuple[str, str, str]) -> dict[str, Any]:
    """The colour and the pattern of a state."""
    return {"facecolor": look[0], "hatch": look[2], "edgecolor": "#333333", "linewidth": 0.0}


def explain_regimes(
    figure: Figure,
    regimes: Sequence[str],
    edge: Literal["upper", "lower"] = "lower",
    *,
    jumps: bool = False,
    below: Sequence[str] = (),
    notes: Sequence[NoteKind] = (),
    states: Mapping[str, tuple[str, str, str]] = MappingProxyType({}),
) -> None:
    """Explain the marks of points, jumps, notes and states, at an edge of the picture, after the sentences ``below``.

    Nothing where all motions are periodic and there is none of these.
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    looks = [(name, MARKS[name]) for name in regimes]
    handles: list[Artist] = [
        Line2D([], [], color=look.colour, marker=look.marker, markersize=5.0, linestyle="none", label=motion_text(name))
        for name, look in looks
    ]
    if jumps:
        handles.append(Patch(facecolor="#777777", alpha=0.4, label=shown(BANDS)))
    handles += [
        Line2D(
            [], [], color="#555555", marker=NOTE_MARKERS[kind], markersize=6.0, linestyle="none",
            label=shown(NOTES[kind]), markerfacecolor="none" if kind == "point" else None,
        )
        for kind in notes
    ]  # fmt: skip
    handles += [Patch(label=motion_text(name), **state_style(look)) for name, look in states.items()]
    sentences = "\n".join(line for sentence in below for line in textwrap.wrap(sentence, _SENTENCE_WIDTH))
    if handles or sentences:
        figure.legend(
            handles=handles,
            title=sentences or None,
            title_fontsize=9,
            loc="outside upper center" if edge == "upper" else "outside lower center",
            ncols=columns_of(figure, [str(own.get_label()) for own in handles]),
            fontsize=8,
            frameon=False,
        )


def columns_of(figure: Figure, labels: Sequence[str]) -> int:
    """Columns of a legend across a picture: as many as its width has room for, at least one."""
    widest = _SYMBOL + _LETTER * max(map(len, labels), default=0)
    return max(min(len(labels), int(figure.get_figwidth() * 72.0 / widest)), 1)


def _fitting(label: str) -> str:
    """A name limited to the font's characters and the width of a legend's column."""
    return shortened(writable(label), _MOST_LABEL)
