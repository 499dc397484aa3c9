"""Maps as plotly data for the browser."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag.service.figures.curves import doubtful_marks, map_quantities
from sprag.service.figures.orders import TITLE, OrderMap, map_edges, motion_text, order_map
from sprag.service.http.web.figures.plotly import (
    BELOW,
    MOTIONS,
    Data,
    axis_title,
    case_text,
    escaped,
    marks_trace,
    separators,
)
from sprag.service.json_text import numbers
from sprag.service.languages import gettext
from sprag.service.reading.reader import shown
from sprag.service.reading.wording import unit_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from sprag.service.results.curves import Map
    from sprag.service.results.refined import RefinedMap


def map_figure(drawn: Map, contour: bool) -> Data:
    """A map as a figure: colours, or lines of equal value with their numbers; gaps where there is no result."""
    drawn = drawn.run()
    x, y, z = map_quantities(drawn)
    orders = order_map(drawn)
    contour = contour and orders is None
    where = f"{escaped(x.name)} %{{x:.5g}} {unit_text(x.unit)}<br>{escaped(y.name)} %{{y:.5g}} {unit_text(y.unit)}"
    trace: Data = {
        "type": "contour" if contour else "heatmap",
        "x": list(drawn.x_values),
        "y": list(drawn.y_values),
        "z": [numbers(row) for row in drawn.known()],
        "customdata": drawn.cases.tolist(),
        "colorscale": "Viridis",
        "colorbar": {"title": {"text": axis_title(z), "side": "right"}},
        "hoverongaps": False,
        "hovertemplate": f"{where}<br>%{{z:.5g}} {unit_text(z.unit)}<br>{case_text()}<extra></extra>",
    }
    if drawn.refined is not None:
        trace |= {"customdata": None, "hovertemplate": f"{where}<br>%{{z:.5g}} {unit_text(z.unit)}<extra></extra>"}
    if contour:
        trace |= {"contours": {"showlabels": True}, "line": {"width": 1}, "connectgaps": False}
    if orders is not None:
        trace |= _orders(orders) | {"hovertemplate": f"{where}<br>%{{text}}<br>{case_text()}<extra></extra>"}
    across, up = (drawn.x_values, drawn.y_values) if drawn.refined is None else map_edges(drawn)
    blocks = [] if orders is None else list(_blocks(orders))
    doubtful = [marks_trace(marks, y, listed=True) | {"cliponaxis": False} for marks in doubtful_marks(drawn)]
    return {
        "data": [trace, *([] if drawn.refined is None else [_points(drawn.refined)]), *doubtful, *blocks],
        "layout": {
            "height": 520,
            **separators(),
            "margin": {"t": 20, "r": 20, "b": 60, "l": 70},
            "showlegend": bool(doubtful or blocks),
            MOTIONS: {**BELOW, "title": {"text": shown(TITLE) if blocks else gettext("Regime"), "side": "top"}},
            # A field ends where nothing further was computed.
            "xaxis": {"title": {"text": axis_title(x)}, **_whole(across)},
            "yaxis": {"title": {"text": axis_title(y)}, **_whole(up)},
        },
        "cases": True,
        **({} if drawn.refined is None else {"below": shown(drawn.refined.sentence)}),
    }


def _points(refined: RefinedMap) -> Data:
    """The cases of a refined map; a click on one opens it."""
    return {
        "type": "scatter", "mode": "markers", "x": refined.x.tolist(), "y": refined.y.tolist(), "showlegend": False,
        "customdata": refined.cases.tolist(), "marker": {"color": "#777777", "size": 3}, "cliponaxis": False,
        "hovertemplate": f"{case_text()}<extra></extra>",
    }  # fmt: skip


def _orders(orders: OrderMap) -> Data:
    """Blocks of colour in the place of a scale."""
    count = max(len(orders.looks), 1)
    edges = [place / count for place in range(count + 1)]
    scale = [[edge, colour] for place, colour in enumerate(orders.colours) for edge in edges[place : place + 2]]
    return {
        "z": [numbers(row) for row in orders.places],
        "text": [[motion_text(name) if name else "" for name in row] for row in orders.names],
        "colorscale": scale or "Viridis",
        "zmin": -0.5,
        "zmax": count - 0.5,
        "showscale": False,
    }


def _blocks(orders: OrderMap) -> Iterator[Data]:
    """The entries of the legend of such a map."""
    for name, (colour, _, _) in orders.looks.items():
        yield {
            "type": "scatter", "mode": "markers", "name": motion_text(name), "legend": MOTIONS, "x": [None],
            "y": [None], "showlegend": True, "hoverinfo": "skip",
            "marker": {"color": colour, "symbol": "square", "size": 11},
        }  # fmt: skip


def _whole(values: Sequence[float] | NDArray[np.float64]) -> Data:
    """An axis that shows all of the values, and no more."""
    return {"range": [float(values[0]), float(values[-1])]} if len(values) > 1 else {}
