"""Curves of several studies in one picture."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

from service.plots import MAX_PICTURE_CURVES, MAX_PICTURE_POINTS, Picture, axis_label, check_size, render

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.figure import Figure

    from service.curves import Curves


def draw_compare(drawn: Sequence[tuple[str, Curves]], picture: Picture) -> bytes:
    """Curves of studies, each with its name, a plot for each result; the style of a line and its marker tell the study.

    Raises SelectionError when there are more curves or points than one picture can show.
    """
    lines = [(label, curve) for label, curves in drawn for curve in curves.curves]
    chosen = drawn[0][1].selection
    check_size("curves", len(lines), MAX_PICTURE_CURVES)
    check_size("points", sum(len(curve.endings) for _, curve in lines) * len(chosen.results), MAX_PICTURE_POINTS)
    studies = [label for label, _ in drawn]

    def paint(figure: Figure) -> None:
        plots = figure.subplots(len(chosen.results), 1, sharex=True, squeeze=False)[:, 0]
        for axes, info in zip(plots, chosen.results, strict=True):
            for (label, curve), colour in zip(lines, itertools.cycle(f"C{n}" for n in range(10)), strict=False):
                style = ("-", "--", ":", "-.")[studies.index(label) % 4]
                marker = "os^D"[studies.index(label) % 4]
                name = ", ".join([label, *(f"{value:.6g}" for value in curve.line.by.values())])
                axes.plot(
                    curve.line.x, curve.y[info.name], style, marker=marker, markersize=3, color=colour, label=name
                )
            axes.set_ylabel(axis_label(info.name, info.unit))
        plots[-1].set_xlabel(axis_label(chosen.names[chosen.x], chosen.units[chosen.x]))
        handles, labels = plots[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", fontsize=8, ncols=2)

    return render(paint, picture, (8.0, 1.2 + 3.6 * len(chosen.results) + 0.12 * len(lines)))
