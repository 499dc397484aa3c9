"""The motion of one case as a picture: angles, speeds, torques and powers over the states of clutches and shaft."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sprag.service.results.pictures.curves import Picture, axis_label, render
from sprag.service.results.pictures.shaft import draw_shaft
from sprag.service.results.pictures.states import OTHER_LOOK, spans_of
from sprag.service.results.wording import words

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sprag.worker.models import Presentation, Trajectory


def draw_motion(made: Trajectory, shown: Presentation, title: str, picture: Picture) -> bytes:
    """The picture of a motion; lines of one plot are told apart by colour and by style."""
    if made.along == "angle":
        return draw_shaft(made, shown, title, picture)
    panels = shown.panels(made.names, made.units)

    def paint(figure: Figure) -> None:
        heights = [*(3.0 for _ in panels), *([0.45 * len(made.states) + 0.3] if made.states else [])]
        plots = figure.subplots(len(heights), 1, sharex=True, height_ratios=heights, squeeze=False).reshape(-1)
        for axes, panel in zip(plots, panels, strict=False):
            for (name, label), style in zip(panel.lines, ("-", "--", ":", "-.") * 3, strict=False):
                axes.plot(made.times, made.values[:, made.names.index(name)], style, label=label, linewidth=1.1)
            axes.set_ylabel(axis_label(panel.title, panel.unit))
            if len(panel.lines) > 1:
                axes.legend(fontsize=8, loc="upper right", framealpha=0.8)
        if made.states:
            _strip(plots[-1], made, shown)
        plots[-1].set_xlabel("time (s)")
        figure.suptitle(title, fontsize=10)

    return render(paint, picture, (8.0, 2.1 * len(panels) + 0.5 * len(made.states) + 1.0))


def _strip(axes: Axes, made: Trajectory, presentation: Presentation) -> None:
    from matplotlib.patches import Patch

    shown: dict[str, Patch] = {}
    for row, states in enumerate(made.states.values()):
        for state, first, stop in spans_of(list(states)):
            colour, _, hatch = presentation.states.get(state, OTHER_LOOK)
            begin, last = float(made.times[first]), float(made.times[min(stop, made.times.size - 1)])
            style: dict[str, Any] = {"facecolor": colour, "hatch": hatch, "edgecolor": "#333333", "linewidth": 0.0}
            axes.broken_barh([(begin, last - begin)], (row - 0.4, 0.8), **style)
            shown.setdefault(state, Patch(label=words(state).lower(), **style))
    axes.set_yticks(range(len(made.states)), [words(name) for name in made.states])
    axes.grid(visible=False)
    axes.legend(
        handles=list(shown.values()), fontsize=7, ncols=len(shown), loc="upper center", bbox_to_anchor=(0.5, -0.6)
    )
