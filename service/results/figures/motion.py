"""The motion of one case as descriptions of figures: its variables over time or angle with states, phase portrait."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag.service.results.figures.figure import PALETTE, Figure, Line, Panel, Quantity
from sprag.service.results.wording import words

if TYPE_CHECKING:
    from sprag.worker.models import Presentation, Trajectory

#: Points of a line that are drawn.
_MOST_POINTS: Final = 2400


def motion_figure(made: Trajectory, shown: Presentation) -> Figure:
    """The model's panels over time, above the states of its parts; over the angle two in a row, in degrees."""
    angle = made.along == "angle"
    x = np.degrees(made.times) if angle else made.times
    panels = []
    for panel in shown.panels(made.names, made.units):
        lines = tuple(
            Line(
                label,
                x,
                made.values[:, made.names.index(name)],
                PALETTE[place % len(PALETTE)],
                place,
                key=f"{panel.title} {label}" if angle else panel.title,
                heading="" if angle else words(panel.title),
                listed=len(panel.lines) > 1 or not angle,
            )
            for place, (name, label) in enumerate(panel.lines)
        )
        panels.append(Panel(Quantity(panel.title, panel.unit), lines))
    return Figure(
        Quantity("φ, angle of the shaft", "°") if angle else Quantity("time", "s"),
        tuple(panels),
        columns=2 if angle else 1,
        spans={words(name): tuple(_spans(made, list(states))) for name, states in made.states.items()},
        looks=shown.states,
        motion=True,
        most=_MOST_POINTS,
    )


def _spans(made: Trajectory, states: list[str]) -> Iterator[tuple[str, float, float]]:
    """Runs of equal states, each until the next begins."""
    start = 0
    for position in range(1, len(states) + 1):
        if position == len(states) or states[position] != states[start]:
            yield states[start], float(made.times[start]), float(made.times[min(position, made.times.size - 1)])
            start = position


def phase_figure(made: Trajectory, shown: Presentation) -> Figure:
    """Speed over angle of each part of the machine that swings."""
    step = max(made.times.size // _MOST_POINTS, 1)
    lines = tuple(
        Line(
            label,
            made.values[::step, made.names.index(angle)],
            made.values[::step, made.names.index(speed)],
            PALETTE[index % len(PALETTE)],
            index,
            key=label,
        )
        for index, (angle, speed, label) in enumerate(shown.phases(made.names))
    )
    return Figure(Quantity("angle", "rad"), (Panel(Quantity("speed", "rad/s"), lines),))
