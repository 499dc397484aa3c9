"""The legends of pictures: curves, studies, kinds of motion and jumps."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, Literal

from sprag.service.results.figures.figure import BANDS, NOTES, PALETTE, shortened
from sprag.service.results.figures.orders import motion_text
from sprag.service.results.phrases import shown
from sprag.service.results.pictures.text import quantity_label, writable
from sprag.service.results.regimes import MARKS

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sprag.service.results.figures.figure import Figure as Described
    from sprag.service.results.figures.figure import Line, NoteKind

#: Style of the line, and marker where there is none.
STYLES: Final[tuple[tuple[Literal["-", "--", ":", "-."], str], ...]] = (
    ("-", "o"),
    ("--", "s"),
    (":", "^"),
    ("-.", "D"),
)
#: Markers of the points that are read off lines.
NOTE_MARKERS: Final[dict[NoteKind, str]] = {"largest": "v", "smallest": "^", "point": "o"}
#: Labels of a colour bar, which distinguishes more curves than a legend.
_BAR_LABELS: Final = 24
#: Columns of the legend of several studies, and the characters that fit in each.
COLUMNS: Final = 2
_MOST_LABEL: Final = 52
#: Characters on a line of a sentence below the plots.
_SENTENCE_WIDTH: Final = 110


def handle(line: Line) -> Artist:
    """The legend handle of a line."""
    from matplotlib.lines import Line2D

    style, marker = STYLES[line.style % len(STYLES)]
    marker = "" if line.joined and line.cases is None else marker
    return Line2D(
        [],
        [],
        color=line.colour,
        linestyle=style if line.joined else "none",
        marker=marker,
        markersize=6.0 if line.ring else 3.0,
        markerfacecolor="none" if line.ring else line.colour,
    )


def explain(figure: Figure, plots: list[Axes], drawn: Described) -> None:
    """Explain the colours beside the plots: in a legend, or in a colour bar where there are many curves.

    As on pages, one line alone needs none, and panels with axes of their own have their own.
    """
    if not drawn.family and (len(drawn.listed) < 2 or drawn.apart):
        return
    from matplotlib.patches import Patch

    meaning = ",\n".join(quantity_label(quantity).replace(" = ", " =\n") for quantity in drawn.family)
    lines = drawn.listed
    texts = [line.name for line in lines]
    if len(texts) <= len(PALETTE):
        fills = [fill for panel in drawn.panels for fill in panel.fills if fill.listed]
        figure.legend(
            [*(Patch(color=fill.colour, alpha=0.2, linewidth=0.0) for fill in fills), *map(handle, lines)],
            [*(fill.name for fill in fills), *texts],
            title=meaning or None, loc="outside right upper", fontsize=8, title_fontsize=8,
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
    bar.set_label(meaning.replace(" =\n", " = "), fontsize=8)


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


def explain_regimes(
    figure: Figure,
    regimes: Sequence[str],
    edge: Literal["upper", "lower"] = "lower",
    *,
    jumps: bool = False,
    below: str = "",
    notes: Sequence[NoteKind] = (),
) -> None:
    """Explain the marks of points, jumps and notes, at an edge of the picture, after the sentence ``below``.

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
    if handles or below:
        figure.legend(
            handles=handles,
            title="\n".join(textwrap.wrap(below, _SENTENCE_WIDTH)) or None,
            title_fontsize=9,
            loc="outside upper center" if edge == "upper" else "outside lower center",
            ncols=max(len(handles), 1),
            fontsize=8,
            frameon=False,
        )


def _fitting(label: str) -> str:
    """A name limited to the font's characters and the width of a legend's column."""
    return shortened(writable(label), _MOST_LABEL)
