"""Pictures of figures: SVG, PNG and PDF through matplotlib, the same bytes for the same numbers."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final, Literal, get_args

import numpy as np

from sprag.sentences import Sentence
from sprag.service.faults import refused
from sprag.service.figures.curves import curves_figure
from sprag.service.figures.motion import motion_figure
from sprag.service.figures.orders import motion_text
from sprag.service.figures.pictures.legends import (
    COLUMNS,
    MARKERS,
    NOTE_MARKERS,
    STYLES,
    explain,
    explain_marks,
    explain_studies,
    handle,
    state_style,
)
from sprag.service.figures.pictures.text import (
    load_matplotlib,
    quantity_label,
    use_decimal_mark,
    wrapped,
    writable,
    writer_of,
)
from sprag.service.figures.read import read_figure
from sprag.service.results.regimes import MARKS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sprag.service.figures.figure import Figure as Described
    from sprag.service.figures.figure import Line, Marks, Panel
    from sprag.service.reading.reader import Reading
    from sprag.service.results.curves import Curves
    from sprag.worker.models import Presentation, Trajectory

Picture = Literal["svg", "png", "pdf"]
PICTURES: Final[tuple[Picture, ...]] = get_args(Picture)
MEDIA_TYPES: Final[dict[Picture, str]] = {"svg": "image/svg+xml", "png": "image/png", "pdf": "application/pdf"}

#: Limits of one picture; more would take minutes to draw and be unreadable.
MAX_PICTURE_CURVES: Final = 200
MAX_PICTURE_POINTS: Final = 100_000
#: Columns of the legend of the states of a motion.
_MOST_STATES: Final = 8
#: Inches of a row of panels of a picture, and on paper, where a page has the width of a picture of two columns.
_ROW: Final = 3.6
_PAPER_ROW: Final = 2.4
_PAPER: Final = (8.5, 11.0)
#: Points of the letters of the names of axes, and the share of it that is the mean width of a letter.
_LABEL_SIZE: Final = 9.0
_LETTER: Final = 0.58
#: Inches around the panels of a picture, for names and legends.
_AROUND: Final = 1.6
#: Characters on a line of a title.
_TITLE_WIDTH: Final = 100
_STYLE: Final[dict[Any, Any]] = {
    "svg.hashsalt": "sprag",
    "svg.fonttype": "path",
    "axes.grid": True,
    "grid.alpha": 0.3,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "font.size": 10.0,
    "axes.labelsize": _LABEL_SIZE,
    # Names of results and studies are text, never formulas.
    "text.parse_math": False,
}
#: Dates and versions would make two pictures of the same numbers differ.
_METADATA: Final[dict[Picture, dict[str, str | None]]] = {
    "svg": {"Date": None, "Creator": "Sprag"},
    "png": {"Software": "Sprag"},
    "pdf": {"CreationDate": None, "Creator": "Sprag", "Producer": "Sprag"},
}


def draw_curves(curves: Curves, title: str, picture: Picture, reading: Reading) -> bytes:
    """Curves as a picture: a plot for each result as on pages, two in a row; missing points are left out.

    Raises SelectionError when there are more curves or points than one picture can show.
    """
    require_drawable([curves])
    return draw_figure(read_figure(curves_figure([("", curves)], 2), reading), title, picture)


def draw_compare(drawn: Sequence[tuple[str, Curves]], reading: Reading, picture: Picture) -> bytes:
    """Curves of several studies with their names, a plot for each result; raises SelectionError as
    `draw_curves` does.
    """
    require_drawable([curves for _, curves in drawn])
    return draw_figure(read_figure(curves_figure(drawn), reading), "", picture)


def draw_motion(
    made: Trajectory,
    shown: Presentation,
    reading: Reading,
    title: str,
    held: Sequence[tuple[str, Trajectory]],
    at: float | None,
    picture: Picture,
) -> bytes:
    """The motion of one case, beside others with their names: its variables, and below them the states of the parts of
    the machine. A line marks the place ``at`` (time in s, angle in degrees).
    """
    return draw_figure(read_figure(replace(motion_figure(made, shown, held), at=at), reading), title, picture)


def require_drawable(drawn: Sequence[Curves]) -> None:
    """Raise SelectionError when there are more curves or points than one picture can show."""
    lines = [curve for curves in drawn for curve in curves.curves]
    check_size("curves", len(lines), MAX_PICTURE_CURVES)
    points = sum(len(curve.endings) for curve in lines) * len(drawn[0].selection.results)
    check_size("points", points, MAX_PICTURE_POINTS)


def draw_figure(figure: Described, title: str, picture: Picture, *, paper: bool = False) -> bytes:
    """Any described figure as a picture; on ``paper`` its panels are lower, and all of it fits on a page."""
    legend = 0.24 * len(figure.listed) / COLUMNS if figure.studies > 1 else 0.5 * len(figure.spans)
    row = 2.1 if figure.motion else _ROW
    if paper:
        size = (_PAPER[0], min(1.2 + min(row, _PAPER_ROW) * figure.rows + legend, _PAPER[1]))
    else:
        size = (8.0 if figure.columns == 1 else 11.0, 1.2 + row * figure.rows + legend)
    return render(partial(paint_figure, drawn=figure, title=title), picture, size)


def paint_figure(figure: Figure, drawn: Described, title: str) -> None:
    """Draw a described figure into an empty one; for use inside `painting`."""
    strip = 0.2 + (0.3 if drawn.motion else 0.2) * len(drawn.spans) if drawn.spans else 0.0
    row = (figure.get_figheight() - _AROUND - strip) / drawn.rows
    heights = [row] * drawn.rows + [strip] * bool(drawn.spans)
    together = not drawn.apart
    # matplotlib asks all axes that share one at every step, which takes a tenth of the time of a page of panels.
    grid = figure.subplots(len(heights), drawn.columns, height_ratios=heights, squeeze=False)
    plots: list[Axes] = list(grid.reshape(-1))
    for axes, panel in zip(plots, drawn.panels, strict=False):
        _paint_panel(figure, axes, panel, drawn)
        axes.set_ylabel(wrapped(quantity_label(panel.y), int(72.0 * row / (_LETTER * _LABEL_SIZE))))
    for axes in plots[len(drawn.panels) : drawn.rows * drawn.columns]:
        axes.set_visible(False)
    for axes in plots[drawn.rows * drawn.columns :]:
        _paint_states(axes, drawn)
    if together:
        _one_x_axis(plots, drawn)
    held = drawn.held if drawn.studies == 1 else ()
    head(figure, title, (drawn.heading, *held) if drawn.heading else held)
    if not drawn.motion:
        (explain if drawn.studies == 1 else explain_studies)(figure, plots, drawn)
        explain_marks(figure, drawn)


def check_size(what: str, count: int, most: int, parameter: str = "format") -> None:
    """SelectionError when a picture would show more than ``most``."""
    if count > most:
        message = Sentence(
            "{count} {what} are too many for one picture; choose fewer, or take the numbers",
            count=str(count), what=Sentence(what),
        )  # fmt: skip
        allowed = Sentence("<= {count} {what}", count=str(most), what=Sentence(what))
        raise refused(parameter, "too-many", message, allowed=allowed)


@contextmanager
def painting() -> Iterator[None]:
    """The style of every picture. matplotlib keeps it in globals, so a process draws one picture at a time."""
    load_matplotlib()
    import matplotlib as mpl

    with mpl.rc_context(_STYLE):
        yield


def render(paint: Callable[[Figure], None], picture: Picture, size: tuple[float, float]) -> bytes:
    """The picture that ``paint`` makes of a figure of that size (inches), in the style of all pictures."""
    load_matplotlib()
    from matplotlib.figure import Figure

    buffer, write = io.BytesIO(), writer_of(picture)
    with painting():
        figure = Figure(figsize=size, layout="constrained", dpi=120.0 if picture == "png" else 72.0)
        paint(figure)
        use_decimal_mark(figure)
        # `savefig` would draw the figure twice: once for its layout alone, which does not need the drawing.
        engine = figure.get_layout_engine()
        assert engine is not None
        engine.execute(figure)
        figure.set_layout_engine("none")
        write(figure, buffer, _METADATA[picture])
    return buffer.getvalue()


def _paint_panel(figure: Figure, axes: Axes, panel: Panel, drawn: Described) -> None:
    shaded = None
    for band in panel.bands:
        # The edges show a jump that is narrower than a pixel.
        axes.axvspan(band.low, band.high, facecolor=band.colour, edgecolor=band.colour, alpha=0.25, linewidth=0.6)
    for fill in panel.fills:
        axes.fill_between(fill.x, fill.low, fill.high, color=fill.colour, alpha=0.2, linewidth=0.0)
    for line in panel.lines:
        if line.shades is not None and line.x.size:
            shaded = axes.scatter(
                line.x, line.y, c=line.shades, cmap="viridis", s=12.0, marker=MARKERS[line.marker], zorder=2.1
            )
        elif line.shades is None:
            _paint_line(axes, line, thin=drawn.motion or drawn.apart)
    if shaded is not None:
        figure.colorbar(shaded, ax=axes, label=drawn.scale)
    paint_marks(axes, panel.marks)
    paint_notes(axes, panel)
    if drawn.from_zero:
        _with_zero(axes)
    if panel.x is not None:
        axes.set_xlabel(quantity_label(panel.x))
        named = [line for line in panel.lines if line.listed]
        if len(named) > 1:
            axes.legend([handle(line) for line in named], [line.name for line in named], fontsize=8)
    if drawn.at is not None:
        axes.axvline(drawn.at, color="0.35", linewidth=0.9)
    if drawn.motion and len(panel.lines) > 1:
        legend_above(axes, columns=5)


def legend_above(axes: Axes, columns: int, **entries: Any) -> None:
    """A legend above a plot, where it hides no point; by default of all its lines."""
    handles = entries.get("handles") or axes.get_legend_handles_labels()[0]
    axes.legend(
        handles=handles,
        fontsize=8,
        ncols=min(len(handles), columns),
        frameon=False,
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        borderaxespad=0.2,
        columnspacing=1.2,
    )


def _paint_line(axes: Axes, line: Line, *, thin: bool) -> None:
    marked = line.marked(line.x.size)
    for stretch in line.stretches or (slice(None),):
        x = line.x[stretch]
        # Of a point between two gaps no line is seen.
        shown = marked or (line.cases is not None and x.size == 1)
        axes.plot(
            x,
            line.y[stretch],
            color=line.colour,
            linestyle=STYLES[line.style % len(STYLES)] if line.joined else "none",
            marker=MARKERS[line.marker] if shown else "",
            markersize=9.0 if line.ring else 3.5 if line.joined or thin else 4.5,
            markerfacecolor="none" if line.ring else None,
            linewidth=2.2 if line.wide else 1.1 if thin else 1.4,
            label=line.name,
        )


def _one_x_axis(plots: list[Axes], drawn: Described) -> None:
    """The same x axis for all plots, with numbers and name below the lowest."""
    ends = [ends for axes in plots if np.isfinite(ends := axes.dataLim.intervalx).all()]
    low, high = (min(low for low, _ in ends), max(high for _, high in ends)) if ends else (0.0, 1.0)
    room = 0.05 * (high - low) or 0.5
    for axes in plots:
        axes.set_xlim(low - room, high + room)
    for axes in plots[: -drawn.columns]:
        axes.tick_params(labelbottom=False)
    for axes in plots[-drawn.columns :]:
        axes.set_xlabel(quantity_label(drawn.x))


def _with_zero(axes: Axes) -> None:
    """Let the y axis contain zero, as on pages."""
    low, high = axes.dataLim.intervaly
    if low >= 0.0 < high:
        axes.set_ylim(0.0, 1.05 * high)
    elif low < 0.0 >= high:
        axes.set_ylim(1.05 * low, 0.0)


def paint_marks(axes: Axes, every: Sequence[Marks], *, clipped: bool = True) -> None:
    for marks in every:
        look = MARKS[marks.regime]
        if marks.x.size:
            axes.plot(
                marks.x, marks.y, color=look.colour, linestyle="none", marker=look.marker, markersize=5.0,
                clip_on=clipped,
            )  # fmt: skip


def paint_notes(axes: Axes, panel: Panel) -> None:
    """Points that are read off the lines, with their texts."""
    for note in panel.notes:
        ring = note.kind == "point"
        axes.plot(
            note.x, note.y, color=note.colour, linestyle="none", marker=NOTE_MARKERS[note.kind],
            markersize=9.0 if ring else 7.0, markerfacecolor="none" if ring else note.colour, zorder=3.0,
        )  # fmt: skip
        if note.text:
            side = -1 if panel.on_the_right(note) else 1
            axes.annotate(
                note.text, (note.x, note.y), xytext=(7 * side, 7), textcoords="offset points", fontsize=8,
                color=note.colour, ha="right" if side < 0 else "left",
            )  # fmt: skip


def _paint_states(axes: Axes, drawn: Described) -> None:
    """A strip of states over time: a row for each part of the machine."""
    from matplotlib.patches import Patch

    styles = {state: state_style(look) for state, look in drawn.shown_looks.items()}
    for row, spans in enumerate(drawn.spans.values()):
        for state in dict.fromkeys(state for state, _, _ in spans):
            bars = [(begin, end - begin) for own, begin, end in spans if own == state]
            axes.broken_barh(bars, (row - 0.4, 0.8), **styles[state])
    axes.set_yticks(range(len(drawn.spans)), list(drawn.spans))
    axes.grid(visible=False)
    if not drawn.motion:
        return
    listed = [Patch(label=motion_text(state), **style) for state, style in styles.items()]
    axes.legend(
        handles=listed,
        fontsize=7,
        ncols=min(len(listed), _MOST_STATES),
        loc="upper center",
        bbox_to_anchor=(0.5, 0.0),
        # Below the numbers and the name of the axis, whatever the height of the strip.
        borderaxespad=5.0,
    )


def head(figure: Figure, title: str, held: tuple[str, ...]) -> None:
    """The title, and below it the held parameters with their values; lines break only between two of these."""
    lines = [_short(title)] if title else []
    line = ""
    for text in held:
        if line and len(line) + len(text) > _TITLE_WIDTH:
            lines.append(f"{line};")
            line = ""
        line = f"{line}; {text}" if line else text
    if line:
        lines.append(line)
    if lines:
        figure.suptitle("\n".join(lines), fontsize=10)


def _short(title: str) -> str:
    """``title`` limited to the font's characters and the width of a picture."""
    text = writable(title)
    return text if len(text) <= 80 else text[:79] + "…"
