"""Pictures of curves and maps: SVG, PNG and PDF through matplotlib, the same bytes for the same numbers."""

from __future__ import annotations

import io
import itertools
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, partial
from typing import TYPE_CHECKING, Any, Final, Literal, get_args

import numpy as np

from sprag.service.faults import ErrorItem
from sprag.service.results.regimes import DOUBTFUL, MARKED, MARKS, regimes_of, stretches
from sprag.service.results.selection import SelectionError
from sprag.worker.pool.child_process import uncounted

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sprag.service.results.curves import Curves, Map
    from sprag.worker.models import ResultInfo

Picture = Literal["svg", "png", "pdf"]
PICTURES: Final[tuple[Picture, ...]] = get_args(Picture)
MEDIA_TYPES: Final[dict[Picture, str]] = {"svg": "image/svg+xml", "png": "image/png", "pdf": "application/pdf"}

#: What one picture can show; more would take minutes to draw and nobody could read it.
MAX_PICTURE_CURVES: Final = 200
MAX_PICTURE_POINTS: Final = 100_000
#: Curves that have an entry in the legend each; more have a block each of a colour bar, so many of them with a label.
_LEGEND_CURVES: Final = 10
_BAR_LABELS: Final = 24
#: How results of one unit are told apart: style of the line, and marker where there is none.
_STYLES: Final[tuple[tuple[Literal["-", "--", ":", "-."], str], ...]] = (
    ("-", "o"),
    ("--", "s"),
    (":", "^"),
    ("-.", "D"),
)
#: Characters on a line of a title.
_TITLE_WIDTH: Final = 100
#: Points of a map that are marked each.
_MARKED_POINTS: Final = 600
_STYLE: Final[dict[Any, Any]] = {
    "svg.hashsalt": "sprag",
    "svg.fonttype": "path",
    "axes.grid": True,
    "grid.alpha": 0.3,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "font.size": 10.0,
    # Names of results and studies are text, never formulas.
    "text.parse_math": False,
}
#: Dates and versions would make two pictures of the same numbers differ.
_METADATA: Final[dict[Picture, dict[str, str | None]]] = {
    "svg": {"Date": None, "Creator": "Sprag"},
    "png": {"Software": "Sprag"},
    "pdf": {"CreationDate": None, "Creator": "Sprag", "Producer": "Sprag"},
}


def draw_curves(curves: Curves, title: str, picture: Picture) -> bytes:
    """Curves as a picture: one plot under another for results of different units, missing points left out.

    Raises SelectionError when there are more curves or points than one picture can show.
    """
    require_drawable(curves)
    return render(partial(paint_curves, curves=curves, title=title), picture, (8.0, 1.2 + 3.6 * len(_groups(curves))))


def require_drawable(curves: Curves) -> None:
    """Raise SelectionError when there are more curves or points than one picture can show."""
    points = sum(len(curve.endings) for curve in curves.curves) * len(curves.selection.results)
    check_size("curves", len(curves.curves), MAX_PICTURE_CURVES)
    check_size("points", points, MAX_PICTURE_POINTS)


def _groups(curves: Curves) -> dict[str, list[ResultInfo]]:
    """The results by their units, each group a plot."""
    groups: dict[str, list[ResultInfo]] = {}
    for info in curves.selection.results:
        groups.setdefault(info.unit, []).append(info)
    return groups


def paint_curves(figure: Figure, curves: Curves, title: str) -> None:
    """Draw the curves into an empty figure; for use inside `painting`."""
    groups = _groups(curves)
    plots = figure.subplots(len(groups), 1, sharex=True, squeeze=False)[:, 0]
    for axes, (unit, infos) in zip(plots, groups.items(), strict=True):
        _paint_curves(axes, curves, infos, unit)
    chosen = curves.selection
    plots[-1].set_xlabel(axis_label(chosen.names[chosen.x], chosen.units[chosen.x]))
    _explain(figure, list(plots), curves)
    _explain_regimes(figure, regimes_of(curve.regimes for curve in curves.curves))
    head(figure, title, chosen.held)


def draw_map(drawn: Map, title: str, picture: Picture) -> bytes:
    """A map as a picture: colours over two axes, cases without a result left blank; SelectionError when too large."""
    check_size("points", drawn.values.size, MAX_PICTURE_POINTS)
    drawn = drawn.run()

    def paint(figure: Figure) -> None:
        axes = figure.subplots()
        mesh = axes.pcolormesh(
            _edges(drawn.x_values), _edges(drawn.y_values), np.ma.masked_invalid(drawn.values), cmap="viridis"
        )
        axes.grid(visible=False)
        axes.set_facecolor("0.85")
        if drawn.values.size <= _MARKED_POINTS:
            points = np.meshgrid(drawn.x_values, drawn.y_values)
            axes.plot(*(part.reshape(-1) for part in points), ".", color="0.3", markersize=2.5, clip_on=False)
        for axis, values in ((axes.xaxis, drawn.x_values), (axes.yaxis, drawn.y_values)):
            if len(values) == 1:
                axis.set_ticks(values)
        axes.set_xlabel(axis_label(drawn.names[0], drawn.units[0]))
        axes.set_ylabel(axis_label(drawn.names[1], drawn.units[1]))
        figure.colorbar(mesh, label=axis_label(drawn.result.name, drawn.result.unit))
        _mark_doubtful(axes, drawn)
        _explain_regimes(figure, [name for name in regimes_of(drawn.regimes or ()) if name in DOUBTFUL])
        missing = int(np.isnan(drawn.values).sum())
        head(figure, title, (*drawn.held, f"grey: {missing} cases without a result") if missing else drawn.held)

    return render(paint, picture, (8.0, 6.0))


def _mark_doubtful(axes: Axes, drawn: Map) -> None:
    """The points of a map whose motion is not periodic."""
    for name in DOUBTFUL:
        places = [
            (drawn.x_values[column], drawn.y_values[row])
            for row, regimes in enumerate(drawn.regimes or ())
            for column, own in enumerate(regimes)
            if own == name
        ]
        if places:
            mark = MARKS[name]
            axes.plot(
                *zip(*places, strict=True), color=mark.colour, linestyle="none", marker=mark.marker, clip_on=False
            )


def check_size(what: str, count: int, most: int) -> None:
    """SelectionError when a picture would show more than ``most``."""
    if count > most:
        message = f"{count} {what} are too many for one picture; choose fewer, or take the numbers"
        raise SelectionError([ErrorItem(message, parameter="format", allowed=f"<= {most} {what}")])


@cache
def load_matplotlib() -> None:
    """Load all of matplotlib that pictures need, once in a process: no picture is to be blamed for the time of that."""
    with uncounted():
        import matplotlib.backends.backend_agg
        import matplotlib.backends.backend_pdf
        import matplotlib.backends.backend_svg
        import matplotlib.figure
        import matplotlib.font_manager  # noqa: F401


@contextmanager
def painting() -> Iterator[None]:
    """The style of every picture. matplotlib keeps it in globals, so that a process draws one picture at a time."""
    load_matplotlib()
    import matplotlib as mpl

    with mpl.rc_context(_STYLE):
        yield


def render(paint: Callable[[Figure], None], picture: Picture, size: tuple[float, float]) -> bytes:
    """The picture that ``paint`` makes of a figure of that size (inches), in the style of all pictures."""
    load_matplotlib()
    from matplotlib.figure import Figure

    buffer = io.BytesIO()
    with painting():
        figure = Figure(figsize=size, layout="constrained")
        paint(figure)
        figure.savefig(buffer, format=picture, dpi=120, metadata=_METADATA[picture])
    return buffer.getvalue()


def _paint_curves(axes: Axes, curves: Curves, infos: list[ResultInfo], unit: str) -> None:
    """Colour tells the curves apart, the style of the line and the marker the results."""
    from matplotlib.lines import Line2D

    colours = _colours(len(curves.curves))
    for curve, colour in zip(curves.curves, colours, strict=True):
        # A line tells how x leads to y; points of a zip that go to and fro are not on one.
        run = curve.run()
        x = np.asarray(curve.line.x)[run]
        regimes = None if curve.regimes is None else [curve.regimes[place] for place in run.tolist()]
        joined = bool(np.all(np.diff(x) > 0.0))
        for info, (style, marker) in zip(infos, itertools.cycle(_STYLES), strict=False):
            y = curve.y[info.name][run]
            for stretch in stretches(regimes, len(x)):
                axes.plot(
                    x[stretch],
                    y[stretch],
                    color=colour,
                    linestyle=style if joined else "none",
                    marker=marker,
                    markersize=3.0 if joined else 4.5,
                    linewidth=1.4,
                )
            for name in MARKED:
                places = [place for place, own in enumerate(regimes or ()) if own == name]
                if places:
                    mark = MARKS[name]
                    axes.plot(
                        x[places], y[places], color=mark.colour, linestyle="none", marker=mark.marker, markersize=5.0
                    )
    if len(infos) == 1:
        axes.set_ylabel(axis_label(infos[0].name, unit))
        return
    axes.set_ylabel("dimensionless" if unit == "1" else unit)
    handles = [
        Line2D([], [], color="0.3", linestyle=style, marker=marker, markersize=3.0, label=info.name)
        for info, (style, marker) in zip(infos, itertools.cycle(_STYLES), strict=False)
    ]
    # Above the plot, where it hides no point.
    axes.legend(
        handles=handles,
        fontsize=8,
        ncols=min(len(handles), 3),
        frameon=False,
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        borderaxespad=0.2,
    )


def _colours(count: int) -> list[Any]:
    """Colours that differ most for a few curves, and that follow the order of many."""
    if count <= _LEGEND_CURVES:
        return [f"C{number}" for number in range(count)]
    from matplotlib import colormaps

    return [colormaps["viridis"](number / (count - 1)) for number in range(count)]


def _explain(figure: Figure, plots: list[Axes], curves: Curves) -> None:
    """What the colours mean, beside the plots: every curve in a legend, or in a colour bar where there are many."""
    chosen = curves.selection
    paths = list(curves.curves[0].line.by)
    if not paths:
        return
    meaning = ",\n".join(axis_label(chosen.names[path].replace(" = ", " =\n"), chosen.units[path]) for path in paths)
    texts = [", ".join(f"{value:.6g}" for value in curve.line.by.values()) for curve in curves.curves]
    colours = _colours(len(texts))
    if len(texts) <= _LEGEND_CURVES:
        from matplotlib.lines import Line2D

        handles = [
            Line2D([], [], color=colour, marker="o", markersize=3.0, label=text)
            for colour, text in zip(colours, texts, strict=True)
        ]
        figure.legend(handles=handles, title=meaning, loc="outside right upper", fontsize=8, title_fontsize=8)
        return
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap, Normalize

    # One block of colour for each curve, its number in the middle: values need not be evenly spaced, nor be numbers.
    blocks = ScalarMappable(Normalize(-0.5, len(texts) - 0.5), ListedColormap(colours))
    bar = figure.colorbar(blocks, ax=plots, aspect=30 * len(plots))
    labelled = range(0, len(texts), math.ceil(len(texts) / _BAR_LABELS))
    bar.set_ticks(list(labelled), labels=[texts[number] for number in labelled])
    bar.ax.tick_params(labelsize=8, length=0)
    bar.set_label(meaning.replace(" =\n", " = "), fontsize=8)


def _explain_regimes(figure: Figure, regimes: list[str]) -> None:
    """What the marks of points mean, below the plots; nothing where all motions are periodic."""
    from matplotlib.lines import Line2D

    if not set(regimes) & set(MARKED):
        return
    handles = [
        Line2D(
            [], [], color=MARKS[name].colour, marker=MARKS[name].marker, markersize=5.0, linestyle="none", label=name
        )
        for name in regimes
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), fontsize=8, frameon=False)


def head(figure: Figure, title: str, held: tuple[str, ...]) -> None:
    """The title, and below it what is held at which value, broken between two of these only."""
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


def axis_label(name: str, unit: str, brackets: str = "()") -> str:
    """What stands at an axis: the name, and its unit in ``brackets`` where it has one."""
    return f"{name} {brackets[:1]}{unit}{brackets[1:]}" if unit != "1" else name


def _short(title: str) -> str:
    """``title`` as the font can write it, and not wider than a picture."""
    text = writable(title)
    return text if len(text) <= 80 else text[:79] + "…"


def writable(text: str, family: str | None = None) -> str:
    """``text`` with a square for every character that the font does not have; lines stay lines."""
    load_matplotlib()
    from matplotlib.font_manager import FontProperties, findfont, get_font

    glyphs = get_font(findfont(FontProperties(family=family))).get_charmap()
    return "".join(c if c == "\n" or ord(c) in glyphs else "\N{WHITE SQUARE}" for c in text)


def _edges(values: tuple[float, ...]) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Borders of the cells around ascending values, one more than there are values.

    The outer cells end at the outer values, so that nothing is drawn where nothing was computed.
    """
    middle = np.array(values)
    if middle.size == 1:
        half = abs(float(middle[0])) * 0.05 or 0.5
        return np.array([middle[0] - half, middle[0] + half])
    return np.concatenate([middle[:1], (middle[1:] + middle[:-1]) / 2.0, middle[-1:]])
