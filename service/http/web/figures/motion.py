"""The motion of one case as figures: time histories over the states of clutches and shaft, phase portrait, powers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag.service.http.web.figures.curves import DASHES, PALETTE, Figure, axis_title
from sprag.service.http.web.figures.shaft import shaft_figure
from sprag.service.http.web.figures.thinning import thin
from sprag.service.results.curves import numbers
from sprag.service.results.pictures.states import OTHER_LOOK, spans_of
from sprag.service.results.wording import number, words
from sprag.worker import models

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag.worker.models import Presentation, Trajectory
    from sprag.worker.study import Study

#: Times at which a motion is sampled for a picture, and points of a line that are drawn.
SAMPLES: Final = 6000
_MOST_POINTS: Final = 2400


def motion_figures(study: Study, case: int, start: float, end: float) -> dict[str, Figure]:
    """The case run again and drawn. For the computing process."""
    made = models.run_trajectory(study, case, start, end, SAMPLES)
    shown = models.presentation_of(study)
    if made.times.size == 0 or made.times[-1] == start < end:
        told = {"data": [], "layout": {}, "note": _no_motion(study, case, made.ending)}
        return {"motion": told, **({"phase": told} if shown.portrait else {})}
    if made.along == "angle":
        return {"motion": shaft_figure(shown, made)}
    column = {name: made.values[:, index] for index, name in enumerate(made.names)}
    histories = {"motion": _histories(shown, made, column)}
    return histories | ({"phase": _phase(shown.phases(made.names), made, column)} if shown.portrait else {})


def _no_motion(study: Study, case: int, ending: str) -> str:
    """Why a part has no motion: the run stopped before."""
    extent = models.extent(study, case)
    if extent.along == "angle":
        return f"There is no motion: the case ended with {ending}."
    times = models.run_trajectory(study, case, 0.0, extent.end, SAMPLES).times
    last = float(times[-1]) if times.size else 0.0
    when = f"about t = {number(last, 3)} s" if last > 0.0 else "t = 0"
    return f"There is no motion in this part: the run stopped at {when} with {ending}."


def _histories(shown: Presentation, made: Trajectory, column: dict[str, NDArray[np.float64]]) -> Figure:
    rows = shown.panels(made.names, made.units)
    strip = 0.045 * len(made.states) + 0.02
    height = (1.0 - strip - 0.05 * len(rows)) / len(rows)
    traces: list[Figure] = []
    layout: Figure = {
        "height": 210 * len(rows) + 60 + 40 * len(made.states),
        "margin": {"t": 20, "r": 20, "b": 50, "l": 75},
        "hovermode": "x",
        "barmode": "overlay",
        "bargap": 0.25,
        "uirevision": "keep",
        "legend": {"tracegroupgap": 8, "groupclick": "toggleitem"},
        "xaxis": {"anchor": "y", "title": {"text": "Time (s)"}, "zeroline": False},
        "yaxis": {"domain": [0.0, strip], "fixedrange": True, "zeroline": False, "showgrid": False},
    }
    for index, panel in enumerate(rows):
        top = 1.0 - index * (height + 0.05)
        layout[f"yaxis{index + 2}"] = {
            "domain": [top - height, top],
            "title": {"text": axis_title(panel.title, panel.unit)},
            "zeroline": True,
        }
        for index_of, (name, label) in enumerate(panel.lines):
            y = column[name]
            kept = thin(y, _MOST_POINTS)
            traces.append(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "x": made.times[kept].tolist(),
                    "y": numbers(y[kept]),
                    "name": label,
                    "legendgroup": panel.title,
                    "legendgrouptitle": {"text": words(panel.title)},
                    "yaxis": f"y{index + 2}",
                    "line": {
                        "width": 1.6,
                        "color": PALETTE[index_of % len(PALETTE)],
                        "dash": DASHES[index_of % len(DASHES)],
                    },
                }
            )
    return {"data": [*traces, *_strips(shown, made)], "layout": layout, "zoom": True}


def _strips(shown: Presentation, made: Trajectory) -> Iterator[Figure]:
    """States over time: one row for the shaft and one for each clutch, a colour and a pattern for each state."""
    if not made.times.size:
        return
    bars: dict[str, list[tuple[float, float, str]]] = {}
    for name, states in made.states.items():
        row = words(name)
        for state, first, stop in spans_of(list(states)):
            begin, last = float(made.times[first]), float(made.times[min(stop, made.times.size - 1)])
            bars.setdefault(state, []).append((begin, last - begin, row))
    for state, found in bars.items():
        colour, pattern, _ = shown.states.get(state, OTHER_LOOK)
        yield {
            "type": "bar",
            "orientation": "h",
            "base": [begin for begin, _, _ in found],
            "x": [width for _, width, _ in found],
            "y": [row for _, _, row in found],
            "name": words(state).lower(),
            "legendgroup": "states",
            "legendgrouptitle": {"text": "States"},
            "marker": {
                "color": colour,
                "pattern": {"shape": pattern, "fgcolor": "#333333", "bgcolor": colour, "size": 6},
                "line": {"width": 0},
            },
            "hovertemplate": f"%{{y}}: {words(state).lower()}<extra></extra>",
        }


def _phase(
    phases: tuple[tuple[str, str, str], ...], made: Trajectory, column: dict[str, NDArray[np.float64]]
) -> Figure:
    """Speed over angle of each part of the machine that swings."""
    traces = []
    for index, (angle, speed, label) in enumerate(phases):
        step = max(made.times.size // _MOST_POINTS, 1)
        traces.append(
            {
                "type": "scatter",
                "mode": "lines",
                "x": numbers(column[angle][::step]),
                "y": numbers(column[speed][::step]),
                "name": label,
                "line": {"width": 1.4, "color": PALETTE[index % len(PALETTE)], "dash": DASHES[index % len(DASHES)]},
            }
        )
    layout: Figure = {
        "height": 430,
        "margin": {"t": 20, "r": 20, "b": 60, "l": 75},
        "hovermode": "closest",
        "showlegend": len(traces) > 1,
        "xaxis": {"title": {"text": axis_title("angle", "rad")}},
        "yaxis": {"title": {"text": axis_title("speed", "rad/s")}},
    }
    return {"data": traces, "layout": layout}
