"""Pictures of curves and maps: SVG, PNG and PDF through matplotlib, the same bytes for the same numbers."""

from __future__ import annotations

import io
import itertools
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final, Literal, get_args

import numpy as np

from service.errors import ErrorItem
from service.selection import SelectionError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from service.curves import Curves, Map
    from worker.kernels import ResultInfo

Picture = Literal["svg", "png", "pdf"]
PICTURES: Final[tuple[Picture, ...]] = get_args(Picture)
MEDIA_TYPES: Final[dict[Picture, str]] = {"svg": "image/svg+xml", "png": "image/png", "pdf": "application/pdf"}

#: What one picture can show; more would take minutes to draw and nobody could read it.
MAX_PICTURE_CURVES: Final = 200
MAX_PICTURE_POINTS: Final = 100_000
#: Curves that have a colour and an entry in the legend each.
_LEGEND_CURVES: Final = 10
_STYLES: Final[tuple[Literal["-", "--", ":", "-."], ...]] = ("-", "--", ":", "-.")
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
#: matplotlib keeps its style and its fonts in globals, so that only one picture is drawn at a time.
_ONE_AT_A_TIME = threading.Lock()


def draw_curves(curves: Curves, title: str, picture: Picture) -> bytes:
    """Curves as a picture: one plot under another for results of different units, missing points left out.

    Raises SelectionError when there are more curves or points than one picture can show.
    """
    points = sum(len(curve.endings) for curve in curves.curves) * len(curves.selection.results)
    _check_size("curves", len(curves.curves), MAX_PICTURE_CURVES)
    _check_size("points", points, MAX_PICTURE_POINTS)
    groups: dict[str, list[ResultInfo]] = {}
    for info in curves.selection.results:
        groups.setdefault(info.unit, []).append(info)

    def paint(figure: Figure) -> None:
        plots = figure.subplots(len(groups), 1, sharex=True, squeeze=False)[:, 0]
        for axes, (unit, infos) in zip(plots, groups.items(), strict=True):
            _paint_curves(axes, curves, infos, unit)
        plots[-1].set_xlabel(_label(curves.selection.x, curves.selection.units[curves.selection.x]))
        figure.suptitle(_short(title), fontsize=11)

    return _render(paint, picture, (8.0, 1.2 + 3.6 * len(groups)))


def draw_map(drawn: Map, title: str, picture: Picture) -> bytes:
    """A map as a picture: colours over two axes, cases without a result left blank; SelectionError when too large."""
    _check_size("points", drawn.values.size, MAX_PICTURE_POINTS)

    def paint(figure: Figure) -> None:
        axes = figure.subplots()
        mesh = axes.pcolormesh(
            _edges(drawn.x_values), _edges(drawn.y_values), np.ma.masked_invalid(drawn.values), cmap="viridis"
        )
        axes.grid(visible=False)
        axes.set_xlabel(_label(drawn.x, drawn.units[0]))
        axes.set_ylabel(_label(drawn.y, drawn.units[1]))
        figure.colorbar(mesh, label=_label(drawn.result.name, drawn.result.unit))
        figure.suptitle(_short(title), fontsize=11)

    return _render(paint, picture, (8.0, 6.0))


def _check_size(what: str, count: int, most: int) -> None:
    if count > most:
        message = f"{count} {what} are too many for one picture; choose fewer, or take the numbers"
        raise SelectionError([ErrorItem(message, parameter="format", allowed=f"<= {most} {what}")])


def _render(paint: Callable[[Figure], None], picture: Picture, size: tuple[float, float]) -> bytes:
    import matplotlib as mpl
    from matplotlib.figure import Figure

    buffer = io.BytesIO()
    with _ONE_AT_A_TIME, mpl.rc_context(_STYLE):
        figure = Figure(figsize=size, layout="constrained")
        paint(figure)
        figure.savefig(buffer, format=picture, dpi=120, metadata=_METADATA[picture])
    return buffer.getvalue()


def _paint_curves(axes: Axes, curves: Curves, infos: list[ResultInfo], unit: str) -> None:
    """Colour tells the curves apart, the style of the line the results."""
    colours = _colours(len(curves.curves))
    for curve, colour in zip(curves.curves, colours, strict=True):
        for info, style in zip(infos, itertools.cycle(_STYLES), strict=False):
            y = curve.y[info.name]
            axes.plot(curve.line.x, y, color=colour, linestyle=style, marker="o", markersize=3.0, linewidth=1.4)
    axes.set_ylabel(_label(infos[0].name, unit) if len(infos) == 1 else unit)
    _explain(axes, curves, infos, colours)


def _colours(count: int) -> list[Any]:
    """Colours that differ most for a few curves, and that follow the order of many."""
    if count <= _LEGEND_CURVES:
        return [f"C{number}" for number in range(count)]
    from matplotlib import colormaps

    return [colormaps["viridis"](number / (count - 1)) for number in range(count)]


def _explain(axes: Axes, curves: Curves, infos: list[ResultInfo], colours: list[Any]) -> None:
    """A legend for the styles and for a few colours; of many curves only the first, the middle and the last."""
    from matplotlib.lines import Line2D

    lines = [curve.line for curve in curves.curves]
    shown = range(len(lines)) if len(lines) <= _LEGEND_CURVES else (0, len(lines) // 2, len(lines) - 1)
    units = curves.selection.units
    handles = [
        Line2D([], [], color="0.3", linestyle=style, label=info.name)
        for info, style in zip(infos, itertools.cycle(_STYLES), strict=False)
        if len(infos) > 1
    ]
    for number in shown:
        values = [f"{path} = {_label(f'{value:.6g}', units[path], '')}" for path, value in lines[number].by.items()]
        if values:
            handles.append(Line2D([], [], color=colours[number], label=", ".join(values)))
    if handles:
        axes.legend(handles=handles, fontsize=8)


def _label(name: str, unit: str, brackets: str = "()") -> str:
    return f"{name} {brackets[:1]}{unit}{brackets[1:]}" if unit != "1" else name


def _short(title: str) -> str:
    """``title`` as the font can write it, and not wider than a picture."""
    from matplotlib.font_manager import FontProperties, findfont, get_font

    glyphs = get_font(findfont(FontProperties())).get_charmap()
    text = "".join(character if ord(character) in glyphs else "\N{WHITE SQUARE}" for character in title)
    return text if len(text) <= 80 else text[:79] + "…"


def _edges(values: tuple[float, ...]) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Borders of the cells around ascending values, one more than there are values."""
    middle = np.array(values)
    if middle.size == 1:
        half = abs(float(middle[0])) * 0.05 or 0.5
        return np.array([middle[0] - half, middle[0] + half])
    inner = (middle[1:] + middle[:-1]) / 2.0
    return np.concatenate([[2 * middle[0] - inner[0]], inner, [2 * middle[-1] - inner[-1]]])
