"""Pictures of sensitivities: shares of the variance or elementary effects as bars, main effects as lines."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag.service.figures.pictures.curves import Picture, check_size, head, legend_above, render
from sprag.service.figures.pictures.text import axis_label, wrapped
from sprag.service.languages import _
from sprag.service.reading.wording import number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sprag.service.reading.reader import Reading
    from sprag.service.results.sensitivity import Sensitivity
    from sprag.service.results.sensitivity_indices import Pair

MOST_RESULTS: Final = 8
#: Interactions that are drawn, and the least share of one.
MOST_PAIRS: Final = 6
_LEAST_SHARE: Final = 0.005
#: Inches of the width of a picture, and of the height of a panel, of an axis among the bars and of a line of a legend.
_WIDTH: Final = 9.0
_PANEL: Final = 2.6
_BAR: Final = 0.45
_ENTRY: Final = 0.19
#: Characters of a line of notes that fit into the width of a picture, and inches of such a line.
_NOTE_WIDTH: Final = 110
_NOTE: Final = 0.18
#: Characters of labels that stand along the height of a panel, and below the bars.
_LABEL_HEIGHT: Final = 34
_LABEL_WIDTH: Final = 44


def draw_sensitivity(
    found: Sequence[Sensitivity], title: str, reading: Reading, picture: Picture, *, noted: bool = True
) -> bytes:
    """A row of plots for each result, as somebody reads it: its bars, where any result has some, and its lines.

    ``noted`` writes the notes of the results above them.

    Raises SelectionError when there are more than one picture can show.
    """
    check_size("results", len(found), MOST_RESULTS, "y")
    notes = dict.fromkeys(reading.say(note) for item in found for note in item.notes) if noted else ()
    lines = [line for note in notes for line in textwrap.wrap(note, _NOTE_WIDTH)]
    bars = max(len(item.effects) + len(_largest(item)) for item in found)
    listed = max(len(item.effects) for item in found)
    panel = max(_PANEL, 0.8 + _BAR * bars) + _ENTRY * listed
    height = 0.5 + _NOTE * len(lines) + len(found) * panel
    return render(partial(_paint, found, title, lines, reading), picture, (_WIDTH, height))


def _paint(found: Sequence[Sensitivity], title: str, notes: Sequence[str], reading: Reading, figure: Figure) -> None:
    shared = any(item.method != "none" for item in found)
    plots = figure.subplots(len(found), 1 + shared, squeeze=False, width_ratios=(3, 4) if shared else (1,))
    for own, item in zip(plots, found, strict=True):
        if shared:
            _bars(own[0], item, reading)
        _lines(own[-1], item, reading)
    head(figure, title, ("\n".join(notes),) if notes else ())


def _bars(axes: Axes, item: Sensitivity, reading: Reading) -> None:
    """The indices of every axis; below them those of the strongest pairs."""
    pairs = _largest(item)
    names = ["\n".join(map(reading.caption, effect.paths[:2])) for effect in item.effects]
    for pair in pairs:
        first, second = (reading.caption(item.effects[place].paths[0]) for place in (pair.first, pair.second))
        names.append(f"{first}\n× {second}")
    every = [effect.indices for effect in item.effects]
    size = partial(reading.value, si=item.info.unit)
    blank: list[tuple[float | None, float | None]] = [(None, None)] * len(pairs)
    bars: tuple[tuple[str, list[tuple[float | None, float | None]], float], ...]
    if item.method == "morris":
        bars = (
            (_("mu*, mean of absolute effects"), [(size(own.mu_star), size(own.mu_star_error)) for own in every], -0.2),
            (_("sigma, their standard deviation"), [(size(own.sigma), None) for own in every], 0.2),
        )
    else:
        bars = (
            (_("first order"), [*((own.first_order, own.first_order_error) for own in every), *blank], -0.2),
            (_("total"), [*((own.total, own.total_error) for own in every), *blank], 0.2),
            (_("second order"), [*[(None, None)] * len(every), *((pair.index, pair.error) for pair in pairs)], 0.0),
        )
    places = np.arange(len(names))
    for index, (name, values, offset) in enumerate(bars):
        if all(value is None for value, _ in values):
            continue
        axes.barh(
            places + offset,
            [np.nan if value is None else value for value, _ in values],
            0.38,
            xerr=None if all(error is None for _, error in values) else [error or 0.0 for _, error in values],
            color=f"C{index}",
            label=name,
        )
    axes.set_yticks(places, names, fontsize=8)
    axes.invert_yaxis()
    what = _("elementary effects on {result}") if item.method == "morris" else _("share of the variance of {result}")
    unit = reading.unit(item.info.unit) if item.method == "morris" else "1"
    axes.set_xlabel(wrapped(what.format(result=axis_label(reading.within(item.info.name), unit)), _LABEL_WIDTH))
    if axes.has_data():
        legend_above(axes, 1)
    else:
        _tell(axes, _("no shares of the variance") if item.cases else _("no case has this result"))


def _largest(item: Sensitivity) -> list[Pair]:
    """The strongest interactions, at most `MOST_PAIRS`."""
    known = [pair for pair in item.pairs if pair.index is not None and abs(pair.index) > _LEAST_SHARE]
    return sorted(known, key=lambda pair: -abs(pair.index or 0.0))[:MOST_PAIRS]


def _lines(axes: Axes, item: Sensitivity, reading: Reading) -> None:
    """Every axis from its least to its largest value, so that axes of different units share one plot."""
    for index, effect in enumerate(item.effects):
        if not np.isfinite(effect.means).any():
            continue
        low, high = effect.values.min(), effect.values.max()
        place = (effect.values - low) / (high - low) if high > low else np.zeros(effect.values.size)
        ends = f"{number(reading.value(low, effect.unit), 4)} … {reading.quantity(high, effect.unit, 4)}"
        text = f"{reading.caption(effect.paths[0])}: {ends}"
        means = reading.units.values(effect.means, item.info.unit)
        axes.plot(place, means, marker="o", markersize=3.0, color=f"C{index}", label=text)
    axes.set_xlabel(_("axis, from its least to its largest value"))
    label = axis_label(reading.within(item.info.name), reading.unit(item.info.unit))
    axes.set_ylabel(wrapped(_("mean of {result}", result=label), _LABEL_HEIGHT))
    if axes.has_data():
        legend_above(axes, 1)
    else:
        _tell(axes, _("no case has this result"))


def _tell(axes: Axes, sentence: str) -> None:
    """A sentence in the middle of a panel that has nothing to draw."""
    axes.text(0.5, 0.5, sentence, ha="center", va="center", transform=axes.transAxes, color="0.35")
