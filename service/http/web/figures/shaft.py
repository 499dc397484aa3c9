"""What turns a machine's shaft, over its angle: speed, energy, the four squares, torques and inertia."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from sprag.service.http.web.figures.curves import DASHES, PALETTE, Figure
from sprag.service.http.web.figures.thinning import thin
from sprag.service.results.curves import numbers
from sprag.service.results.wording import unit_text

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sprag.worker.models import Presentation, Trajectory
    from sprag.worker.study import Study

#: Angles at which a machine is drawn.
SAMPLES: Final = 1441
_MOST_POINTS: Final = 1500
#: Between two rows of panels, in parts of the figure's height.
_GAP: Final = 0.12


def shaft_figure(shown: Presentation, made: Trajectory) -> Figure:
    """The panels over the angle in degrees, two in a row."""
    degrees = [math.degrees(angle) for angle in made.times.tolist()]
    column = {name: made.values[:, index] for index, name in enumerate(made.names)}
    traces: list[Figure] = []
    layout: Figure = {
        "height": 640,
        "margin": {"t": 50, "r": 20, "b": 60, "l": 75},
        "hovermode": "x",
        "uirevision": "keep",
        "legend": {"orientation": "h", "x": 0, "y": 1.0, "yanchor": "bottom"},
    }
    drawn = shown.panels(made.names, made.units)
    height = (1.0 + _GAP) / ((len(drawn) + 1) // 2) - _GAP
    for index, panel in enumerate(drawn):
        suffix = "" if index == 0 else str(index + 1)
        left, low = (0.0 if index % 2 == 0 else 0.56), max(1.0 - height - (index // 2) * (height + _GAP), 0.0)
        x_axis: Figure = {"domain": [left, left + 0.44], "anchor": f"y{suffix}", "zeroline": False, "dtick": 60}
        x_axis |= {"title": {"text": "φ, angle of the shaft (°)" if index >= len(drawn) - 2 else ""}}
        layout[f"xaxis{suffix}"] = x_axis | ({"matches": "x"} if index else {})
        layout[f"yaxis{suffix}"] = {
            "domain": [low, low + height],
            "anchor": f"x{suffix}",
            "title": {"text": f"{panel.title} ({unit_text(panel.unit)})"},
            "zeroline": True,
        }
        for place, (name, label) in enumerate(panel.lines):
            y = column[name]
            kept = thin(y, _MOST_POINTS)
            traces.append(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "x": [degrees[position] for position in kept.tolist()],
                    "y": numbers(y[kept]),
                    "name": label,
                    "showlegend": len(panel.lines) > 1,
                    "xaxis": f"x{suffix}",
                    "yaxis": f"y{suffix}",
                    "line": {"width": 1.8, "color": PALETTE[place % len(PALETTE)], "dash": DASHES[place % len(DASHES)]},
                }
            )
    return {"data": traces, "layout": layout}


def machine_case(study: Study) -> dict[str, Any]:
    """Ending, results and figure of a machine's first case. For the computing process."""
    from sprag.worker import models

    rows = models.run_chunk(study, 0, 1)
    infos = models.study_results(study)
    values = {info.name: numbers(rows.values[0, index : index + 1])[0] for index, info in enumerate(infos)}
    found: dict[str, Any] = {"ending": rows.endings[0], "results": values, "figure": None}
    if rows.endings[0] == models.OK:
        whole = models.run_trajectory(study, 0, 0.0, models.extent(study, 0).end, SAMPLES)
        found["figure"] = shaft_figure(models.presentation_of(study), whole)
    return found


def overridden(spec: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """``spec`` with other numbers at some flat paths of its base, and without axes."""
    base = _copied(spec["base"])
    for path, value in values.items():
        *parents, name = path.split(".")
        place = base
        for key in parents:
            place = place[int(key)] if isinstance(place, list) else place.setdefault(key, {})
        place[name] = value
    return {**{key: value for key, value in spec.items() if key not in ("axes", "combine")}, "base": base}


def _copied(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _copied(item) for key, item in value.items()}
    return [_copied(item) for item in value] if isinstance(value, list) else value
