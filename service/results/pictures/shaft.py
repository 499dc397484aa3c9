"""The motion of a machine's shaft over its angle as a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from service.results.pictures.curves import Picture, axis_label, render
from service.results.pictures.panels import PANELS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from worker.models import Trajectory


def draw_shaft(made: Trajectory, title: str, picture: Picture) -> bytes:
    """Speed, energy, squares and torques over the angle; lines of one plot are told apart by colour and by style."""

    def paint(figure: Figure) -> None:
        plots = figure.subplots(2, 2, sharex=True).reshape(-1)
        for axes, (name, unit, lines) in zip(plots, PANELS, strict=True):
            for (variable, label), style in zip(lines, ("-", "--", ":", "-."), strict=False):
                y = made.values[:, made.names.index(variable)]
                axes.plot(np.degrees(made.times), y, style, label=label, linewidth=1.2)
            axes.set_ylabel(axis_label(name, unit))
            if len(lines) > 1:
                axes.legend(fontsize=8)
        for axes in plots[2:]:
            axes.set_xlabel("φ (°)")
        figure.suptitle(title, fontsize=10)

    return render(paint, picture, (10.0, 6.6))
