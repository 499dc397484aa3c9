"""The motion of a machine's shaft over its angle as a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sprag.service.results.pictures.curves import Picture, axis_label, render

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sprag.worker.models import Presentation, Trajectory


def draw_shaft(made: Trajectory, shown: Presentation, title: str, picture: Picture) -> bytes:
    """The panels over the angle, two in a row; lines of one plot are told apart by colour and by style."""

    panels = shown.panels(made.names, made.units)

    def paint(figure: Figure) -> None:
        plots = figure.subplots((len(panels) + 1) // 2, 2, sharex=True).reshape(-1)
        for axes, panel in zip(plots, panels, strict=False):
            for (variable, label), style in zip(panel.lines, ("-", "--", ":", "-."), strict=False):
                y = made.values[:, made.names.index(variable)]
                axes.plot(np.degrees(made.times), y, style, label=label, linewidth=1.2)
            axes.set_ylabel(axis_label(panel.title, panel.unit))
            if len(panel.lines) > 1:
                axes.legend(fontsize=8)
        for axes in plots[-2:]:
            axes.set_xlabel("φ (°)")
        figure.suptitle(title, fontsize=10)

    return render(paint, picture, (10.0, 6.6))
