"""Pictures of maps, through matplotlib as those of figures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag.service.figures.curves import doubtful_marks, map_quantities
from sprag.service.figures.orders import TITLE, OrderMap, map_edges, motion_text, order_map
from sprag.service.figures.pictures.curves import (
    MAX_PICTURE_POINTS,
    Picture,
    check_size,
    head,
    paint_marks,
    render,
)
from sprag.service.figures.pictures.legends import explain_regimes
from sprag.service.figures.pictures.text import quantity_label
from sprag.service.reading.reader import Phrase, plural, shown

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.contour import QuadContourSet
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from sprag.service.results.curves import Map

#: Points of a map that are marked each.
_MARKED_POINTS: Final = 600
#: Points of a refined map that are drawn each.
_REFINED_POINTS: Final = 5_000


def draw_map(drawn: Map, title: str, picture: Picture, *, contours: bool = False) -> bytes:
    """A map as a picture: colours over two axes, or lines of equal value with their numbers.

    Cases without a result are left blank. Raises SelectionError when it is too large.
    """
    check_size("points", drawn.values.size, MAX_PICTURE_POINTS)
    return render(lambda figure: paint_map(figure, drawn, title, contours=contours), picture, (8.0, 6.0))


def paint_map(figure: Figure, drawn: Map, title: str, *, contours: bool = False) -> None:
    """Paint the map of `draw_map`."""
    drawn = drawn.run()
    x, y, z = map_quantities(drawn)
    orders = order_map(drawn)
    axes = figure.subplots()
    borders = map_edges(drawn)
    if orders is None:
        fields = np.ma.masked_invalid(drawn.known())
        mesh: ScalarMappable = (
            _paint_contours(axes, drawn, fields)
            if contours and _has_levels(fields)
            else axes.pcolormesh(*borders, fields, cmap="viridis")
        )
        figure.colorbar(mesh, label=quantity_label(z))
    else:
        _paint_orders(axes, borders, orders)
    axes.grid(visible=False)
    axes.set_facecolor("0.85")
    if drawn.values.size <= _MARKED_POINTS:
        points = np.meshgrid(drawn.x_values, drawn.y_values)
        axes.plot(*(part.reshape(-1) for part in points), ".", color="0.3", markersize=2.5, clip_on=False)
    if drawn.refined is not None and drawn.refined.x.size <= _REFINED_POINTS:
        axes.plot(drawn.refined.x, drawn.refined.y, ".", color="0.3", markersize=1.5, clip_on=False)
    for axis, values in ((axes.xaxis, drawn.x_values), (axes.yaxis, drawn.y_values)):
        if len(values) == 1:
            axis.set_ticks(values)
    axes.set_xlabel(quantity_label(x))
    axes.set_ylabel(quantity_label(y))
    doubtful = list(doubtful_marks(drawn))
    paint_marks(axes, doubtful, clipped=False)
    below = () if drawn.refined is None else (shown(drawn.refined.sentence),)
    explain_regimes(figure, [marks.regime for marks in doubtful], below=below)
    missing = int(np.isnan(drawn.known() if orders is None else orders.places).sum())
    grey = plural("grey: {count} case without a result", "grey: {count} cases without a result", missing)
    grey = Phrase("grey: not interpolated") if drawn.refined else grey
    head(figure, title, (*drawn.held, shown(grey)) if missing else drawn.held)


def _has_levels(values: np.ma.MaskedArray[Any, np.dtype[np.float64]]) -> bool:
    """Whether there are lines of equal value."""
    return min(values.shape) > 1 and values.count() > 0 and bool(values.max() > values.min())


def _paint_contours(axes: Axes, drawn: Map, values: np.ma.MaskedArray[Any, np.dtype[np.float64]]) -> QuadContourSet:
    """Colours between lines of equal value, and the numbers of these."""
    places = (np.asarray(drawn.x_values), np.asarray(drawn.y_values), values)
    filled = axes.contourf(*places, cmap="viridis")
    lines = axes.contour(*places, levels=filled.levels, colors="0.25", linewidths=0.8)
    axes.clabel(lines, fontsize=8)
    return filled


def _paint_orders(axes: Axes, borders: tuple[NDArray[np.float64], NDArray[np.float64]], orders: OrderMap) -> None:
    """A colour for each number of periods, and one for each regime without, named above the map."""
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    colours = ListedColormap(orders.colours or ["none"])
    mesh = axes.pcolormesh(
        *borders, np.ma.masked_invalid(orders.places), cmap=colours, vmin=-0.5, vmax=len(orders.looks) - 0.5
    )
    mesh.set_edgecolor("face")
    axes.legend(
        handles=[Patch(facecolor=colour, label=motion_text(name)) for name, (colour, _, _) in orders.looks.items()],
        title=shown(TITLE),
        fontsize=8,
        title_fontsize=8,
        loc="center left",
        bbox_to_anchor=(1.0, 0.5),
        frameon=False,
    )
