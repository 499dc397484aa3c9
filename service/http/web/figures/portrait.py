"""How one case approaches its motion, as a figure: strobes on the orbit, and strobe by strobe."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag.service.http.web.figures.plotly import SYMBOLS, Data, axis_title
from sprag.service.json_text import numbers
from sprag.service.results.figures.figure import PALETTE, Quantity
from sprag.service.results.portrait_lines import approach, column_of, described, strobe_numbers
from sprag.worker import models

if TYPE_CHECKING:
    from sprag.worker.models import Portrait, Presentation
    from sprag.worker.study import Study

#: Approximate number of points of all orbits of a figure together.
_MOST_POINTS: Final = 12_000
#: Colour of the strobes of an orbit.
_RING: Final = "#d55e00"
#: Levels of an orbit that are drawn as lines.
_LEVELS: Final = 40
_HEIGHT: Final = 430


def portrait_figure(study: Study, case: int, columns: int) -> Data:
    """Run the case again and draw it, with panels side by side (2) or one below the other (1).

    For the computing process.
    """
    made = models.run_portrait(study, case)
    shown = models.presentation_of(study)
    if not made.strobes.times.size:
        return {"data": [], "layout": {}, "note": f"There are no strobes: the case ended with {made.ending}."}
    title, unit, lines = approach(made, shown)
    beside = columns == 2
    angle, speed = axis_title(Quantity("angle", "rad")), axis_title(Quantity("speed", "rad/s"))
    layout: Data = {
        "height": (_HEIGHT if beside else 2 * _HEIGHT) + 60,
        "margin": {"t": 60, "r": 20, "b": 60, "l": 75},
        "hovermode": "closest",
        "title": {"text": described(made), "font": {"size": 14}, "x": 0, "xref": "paper"},
        "showlegend": len(shown.phases(made.strobes.names)) > 1,
        "legend": {"orientation": "h", "x": 0, "y": 1.0, "yanchor": "bottom"},
        "xaxis": {
            "domain": [0.0, 0.44] if beside else [0.0, 0.9],
            "title": {"text": angle},
        },
        "yaxis": {
            "domain": [0.0, 1.0] if beside else [0.58, 1.0],
            "title": {"text": speed},
        },
        "xaxis2": {
            "domain": [0.62, 1.0] if beside else [0.0, 0.9],
            "anchor": "y2",
            "title": {"text": "Excitation period"},
        },
        "yaxis2": {
            "domain": [0.0, 1.0] if beside else [0.0, 0.42],
            "anchor": "x2",
            "title": {"text": axis_title(Quantity(title, unit))},
        },
    }
    return {"data": [*_plane(made, shown, beside), *_along(made, lines)], "layout": layout}


def _plane(made: Portrait, shown: Presentation, beside: bool) -> Iterator[Data]:
    """The orbit of each pendulum, its strobes coloured by period, and the strobes of the orbit."""
    phases = shown.phases(made.strobes.names)
    periods = strobe_numbers(made.strobes).tolist()
    step = max(made.orbit.times.size * len(phases) // _MOST_POINTS, 1)
    for index, (angle, speed, label) in enumerate(phases):
        colour, symbol = PALETTE[index % len(PALETTE)], SYMBOLS[index % len(SYMBOLS)]
        if made.order:
            x, y = column_of(made.orbit, angle), column_of(made.orbit, speed)
            yield {
                "type": "scatter",
                "mode": "lines",
                "name": label,
                "legendgroup": label,
                "x": numbers(np.append(x[:-1:step], x[-1])),
                "y": numbers(np.append(y[:-1:step], y[-1])),
                "line": {"color": colour, "width": 1.6},
                "hoverinfo": "skip",
            }
        bar = {"title": {"text": "Period", "side": "top"}, "x": 0.45 if beside else 0.91, "thickness": 12}
        bar |= {} if beside else {"y": 0.79, "len": 0.42}
        yield {
            "type": "scatter",
            "mode": "markers",
            "name": label,
            "legendgroup": label,
            "showlegend": not made.order,
            "x": numbers(column_of(made.strobes, angle)),
            "y": numbers(column_of(made.strobes, speed)),
            "customdata": periods,
            "marker": {
                "symbol": symbol,
                "size": 6,
                "color": periods,
                "colorscale": "Viridis",
                "showscale": index == 0,
                "colorbar": bar,
            },
            "hovertemplate": f"period %{{customdata}}: %{{x:.5g}} rad, %{{y:.5g}} rad/s<extra>{label}</extra>",
        }
        if made.order:
            x, y = column_of(made.orbit, angle), column_of(made.orbit, speed)
            yield {
                "type": "scatter",
                "mode": "markers",
                "name": f"{label}, orbit",
                "legendgroup": label,
                "showlegend": False,
                "x": numbers(x[: -1 : made.points]),
                "y": numbers(y[: -1 : made.points]),
                "marker": {"symbol": f"{symbol}-open", "size": 12, "color": _RING, "line": {"width": 2}},
                "hovertemplate": f"%{{x:.5g}} rad, %{{y:.5g}} rad/s<extra>{label}: strobe of the orbit</extra>",
            }


def _along(made: Portrait, lines: list[tuple[str, str]]) -> Iterator[Data]:
    """Values strobe by strobe, with the levels of the orbit."""
    periods = strobe_numbers(made.strobes).tolist()
    for index, (name, label) in enumerate(lines):
        if made.order:
            levels = np.unique(column_of(made.orbit, name)[: -1 : made.points])[:_LEVELS].tolist()
            yield {
                "type": "scatter",
                "mode": "lines",
                "x": [place for _ in levels for place in (periods[0], periods[-1], None)],
                "y": [place for level in levels for place in (level, level, None)],
                "line": {"color": _RING, "width": 1, "dash": "dash"},
                "showlegend": False,
                "hoverinfo": "skip",
                "xaxis": "x2",
                "yaxis": "y2",
            }
        yield {
            "type": "scatter",
            "mode": "markers",
            "name": label,
            "legendgroup": label,
            "showlegend": False,
            "x": periods,
            "y": numbers(column_of(made.strobes, name)),
            "marker": {"color": PALETTE[index % len(PALETTE)], "symbol": SYMBOLS[index % len(SYMBOLS)], "size": 5},
            "hovertemplate": f"period %{{x}}: %{{y:.6g}}<extra>{label}</extra>",
            "xaxis": "x2",
            "yaxis": "y2",
        }
