"""Curves of several studies in one picture."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Final

from sprag.service.results.pictures.curves import (
    MAX_PICTURE_CURVES,
    MAX_PICTURE_POINTS,
    Picture,
    axis_label,
    check_size,
    render,
    writable,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.artist import Artist
    from matplotlib.figure import Figure

    from sprag.service.results.curves import Curves


_COLUMNS: Final = 2
#: Characters of a study's name for which a column of the legend has room.
_MOST_LABEL: Final = 52


def draw_compare(drawn: Sequence[tuple[str, Curves]], picture: Picture) -> bytes:
    """Curves of studies, each with its name, a plot for each result; the style of a line and its marker tell the study.

    Raises SelectionError when there are more curves or points than one picture can show.
    """
    lines = [(study, curve) for study, (_, curves) in enumerate(drawn) for curve in curves.curves]
    chosen = drawn[0][1].selection
    check_size("curves", len(lines), MAX_PICTURE_CURVES)
    check_size("points", sum(len(curve.endings) for _, curve in lines) * len(chosen.results), MAX_PICTURE_POINTS)

    def paint(figure: Figure) -> None:
        plots = figure.subplots(len(chosen.results), 1, sharex=True, squeeze=False)[:, 0]
        for axes, info in zip(plots, chosen.results, strict=True):
            shown: list[list[Artist]] = [[] for _ in drawn]
            for (study, curve), colour in zip(lines, itertools.cycle(f"C{n}" for n in range(10)), strict=False):
                style, marker = ("-", "--", ":", "-.")[study % 4], "os^D"[study % 4]
                shown[study] += axes.plot(
                    curve.line.x, curve.y[info.name], style, marker=marker, markersize=3, color=colour
                )
            axes.set_ylabel(axis_label(info.name, info.unit))
        plots[-1].set_xlabel(axis_label(chosen.names[chosen.x], chosen.units[chosen.x]))
        _explain(figure, drawn, shown)

    rows = sum(1 + len(curves.curves) for _, curves in drawn) / _COLUMNS
    return render(paint, picture, (8.0, 1.2 + 3.6 * len(chosen.results) + 0.24 * rows))


def _explain(figure: Figure, drawn: Sequence[tuple[str, Curves]], shown: Sequence[list[Artist]]) -> None:
    """The legend: the name of a study once, and under it the values that tell its curves apart."""
    chosen = drawn[0][1].selection
    paths = list(chosen.lines[0].by)
    if not paths:
        handles = [artist for artists in shown for artist in artists]
        labels = [_short(label) for (label, curves) in drawn for _ in curves.curves]
        figure.legend(handles, labels, loc="outside lower center", fontsize=8, ncols=_COLUMNS)
        return
    from matplotlib.patches import Patch

    # A legend is filled column by column: blocks of one length, as many in each column, keep the studies apart.
    empty = Patch(visible=False)
    length = max(map(len, shown))
    blocks = math.ceil(len(drawn) / _COLUMNS) * _COLUMNS if len(drawn) > 1 else 1
    handles, labels = [], []
    for (label, curves), artists in zip(drawn, shown, strict=True):
        values = [", ".join(f"{value:.6g}" for value in curve.line.by.values()) for curve in curves.curves]
        padding = length - len(values)
        handles += [empty, *artists, *[empty] * padding]
        labels += [_short(label), *values, *[""] * padding]
    padding = (blocks - len(drawn)) * (length + 1)
    title = ", ".join(axis_label(chosen.names[path], chosen.units[path]) for path in paths)
    figure.legend(
        [*handles, *[empty] * padding], [*labels, *[""] * padding], title=title,
        loc="outside lower center", fontsize=8, title_fontsize=8, ncols=min(blocks, _COLUMNS),
    )  # fmt: skip


def _short(label: str) -> str:
    text = writable(label)
    return text if len(text) <= _MOST_LABEL else f"{text[: _MOST_LABEL - 25]}…{text[-24:]}"
