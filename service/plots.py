"""Pictures of curves and maps: SVG, PNG and PDF through matplotlib, the same bytes for the same numbers."""

from __future__ import annotations

import io
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final, Literal, get_args

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from service.curves import Curves, Map
    from worker.kernels import ResultInfo

Picture = Literal["svg", "png", "pdf"]
PICTURES: Final[tuple[Picture, ...]] = get_args(Picture)
MEDIA_TYPES: Final[dict[Picture, str]] = {"svg": "image/svg+xml", "png": "image/png", "pdf": "application/pdf"}

#: Curves in one picture that still can be told apart; the document has them all.
MAX_PICTURE_CURVES: Final = 24
_LEGEND_CURVES: Final = 10
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
    """Curves as a picture: one plot under another for results of different units, missing points left out."""
    groups: dict[str, list[ResultInfo]] = {}
    for info in curves.selection.results:
        groups.setdefault(info.unit, []).append(info)

    def paint(figure: Figure) -> None:
        plots = figure.subplots(len(groups), 1, sharex=True, squeeze=False)[:, 0]
        for axes, (unit, infos) in zip(plots, groups.items(), strict=True):
            _paint_curves(axes, curves, infos, unit)
        plots[-1].set_xlabel(_label(curves.selection.x, curves.selection.x_unit))
        figure.suptitle(_short(title), fontsize=11)

    return _render(paint, picture, (8.0, 1.2 + 3.6 * len(groups)))


def draw_map(drawn: Map, title: str, picture: Picture) -> bytes:
    """A map as a picture: colours over two axes, cases without a result left blank."""

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
    styles = ("-", "--", ":", "-.")
    for number, curve in enumerate(curves.curves[:MAX_PICTURE_CURVES]):
        by = ", ".join(f"{path} = {value:.6g}" for path, value in curve.line.by.items())
        for kind, info in enumerate(infos):
            label = ", ".join(part for part in (info.name if len(infos) > 1 or not by else "", by) if part)
            axes.plot(
                curve.line.x,
                curve.y[info.name],
                marker="o",
                markersize=3.0,
                linewidth=1.4,
                color=f"C{number % 10}",
                linestyle=styles[kind % len(styles)],
                label=label,
            )
    axes.set_ylabel(_label(infos[0].name if len(infos) == 1 else "", unit))
    lines = min(len(curves.curves), MAX_PICTURE_CURVES) * len(infos)
    if 1 < lines <= _LEGEND_CURVES or (lines == 1 and curves.curves[0].line.by):
        axes.legend(fontsize=8)


def _label(name: str, unit: str) -> str:
    return f"{name} ({unit})".strip() if unit != "1" else name


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
