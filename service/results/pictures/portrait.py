"""How one case approaches its motion, as a picture: strobes on the orbit, and strobe by strobe."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from sprag.service.results.figures.figure import PALETTE
from sprag.service.results.pictures.curves import Picture, axis_label, render
from sprag.service.results.portrait_lines import approach, column_of, described, strobe_numbers

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sprag.worker.models import Portrait, Presentation

_MARKERS: Final = ("o", "s", "^", "D", "v", "P", "*", "X")


def draw_portrait(made: Portrait, shown: Presentation, title: str, picture: Picture) -> bytes:
    """Orbit and strobes in the plane of angle and speed, beside the strobes period by period."""

    def paint(figure: Figure) -> None:
        plane, along = figure.subplots(1, 2)
        _plane(figure, plane, made, shown)
        _along(along, made, shown)
        figure.suptitle(f"{title}\n{described(made)}", fontsize=10)

    return render(paint, picture, (11.0, 4.8))


def _plane(figure: Figure, axes: Axes, made: Portrait, shown: Presentation) -> None:
    numbers = strobe_numbers(made.strobes)
    dots = None
    for index, (angle, speed, label) in enumerate(shown.phases(made.strobes.names)):
        marker = _MARKERS[index % len(_MARKERS)]
        if made.order:
            x, y = column_of(made.orbit, angle), column_of(made.orbit, speed)
            axes.plot(x, y, color=PALETTE[index % len(PALETTE)], linewidth=1.1, label=label, zorder=1)
        x, y = column_of(made.strobes, angle), column_of(made.strobes, speed)
        dots = axes.scatter(x, y, c=numbers, cmap="viridis", s=12, marker=marker, zorder=2)
        if made.order:
            ends = slice(0, -1, made.points)
            x, y = column_of(made.orbit, angle)[ends], column_of(made.orbit, speed)[ends]
            axes.plot(
                x, y, color="#d55e00", linestyle="none", marker=marker, markersize=9.0, markerfacecolor="none", zorder=3
            )
    axes.set_xlabel(axis_label("angle", "rad"))
    axes.set_ylabel(axis_label("speed", "rad/s"))
    if dots is not None and numbers.size:
        figure.colorbar(dots, ax=axes, label="excitation period")
    if made.order and len(shown.phases(made.strobes.names)) > 1:
        axes.legend(fontsize=8)


def _along(axes: Axes, made: Portrait, shown: Presentation) -> None:
    numbers = strobe_numbers(made.strobes)
    title, unit, lines = approach(made, shown)
    for index, (name, label) in enumerate(lines):
        colour, marker = PALETTE[index % len(PALETTE)], _MARKERS[index % len(_MARKERS)]
        y = column_of(made.strobes, name)
        axes.plot(numbers, y, color=colour, linestyle="none", marker=marker, markersize=3.0, label=label)
        if made.order:
            for level in np.unique(column_of(made.orbit, name)[: -1 : made.points]):
                axes.axhline(level, color="#d55e00", linewidth=0.8, linestyle="--", zorder=0)
    axes.set_xlabel("excitation period")
    axes.set_ylabel(axis_label(title, unit))
    if len(lines) > 1:
        axes.legend(fontsize=8)
