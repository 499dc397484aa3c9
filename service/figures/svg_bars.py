"""Bars as SVG, and sensitivities: bars of every result above its lines."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.service.figures.figure import Figure, Line, Panel, Quantity, line_colours
from sprag_study.service.figures.painter.elements import LINE, SIZE, SMALL, element, lines_of, moved, short, text_at
from sprag_study.service.figures.painter.legends import Entry, area, rows_of
from sprag_study.service.figures.painter.panels import x_numbers
from sprag_study.service.figures.painter.scales import Scale, rounded_scale
from sprag_study.service.figures.svg import WIDE, svg, title_of
from sprag_study.service.languages import _
from sprag_study.service.reading.wording import number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.reading.reader import Reading
    from sprag_study.service.results.sensitivity import Sensitivity
    from sprag_study.service.results.sensitivity_indices import Pair

#: Interactions that are drawn, and the least share of one.
MOST_PAIRS: Final = 6
_LEAST_SHARE: Final = 0.005
#: Share of the width that names of bars take, and pixels of a bar and between two rows of bars.
_NAMES: Final = 0.36
_BAR: Final = 11.0
_BETWEEN: Final = 8.0
_SIZE: Final = re.compile(r'^<svg [^>]*? height="([\d.]+)"')


@dataclass(frozen=True, slots=True)
class Bars:
    """Bars in rows.

    Attributes
    ----------
    title : what they are
    series : what the bars of a row are
    rows : name of each row, and for each of the series value and half width of its interval; None for none
    """

    title: str
    series: tuple[str, ...]
    rows: tuple[tuple[str, tuple[tuple[float | None, float | None], ...]], ...]


def bars_svg(bars: Bars, width: int = WIDE) -> str:
    """Bars with their names at the left and numbers below."""
    names = _NAMES * width
    scale = rounded_scale(_ends(bars), 10 * SMALL, zero=True, log=False, unit="1")
    x = Scale(scale.low, scale.high, 0.0, width - names - 24.0)
    entries = [Entry(area(f"var(--series-{place})"), name) for place, name in enumerate(bars.series, 1)]
    parts, top = [], LINE
    for line in lines_of(bars.title, width, bold=True):
        parts.append(text_at(line, 0.0, top - 3.0, font_weight=600))
        top += LINE
    legend = rows_of(entries, width)
    parts.append(moved("".join(legend.parts), 0.0, top - LINE + 2.0))
    first = top = top + legend.height - 8.0
    for name, values in bars.rows:
        lines = lines_of(name, names - 12.0, SMALL)
        shown = [one for one in enumerate(values) if one[1][0] is not None]
        high = max(_BAR * len(shown), LINE * len(lines)) + _BETWEEN
        middle = top + high / 2.0
        parts += [
            text_at(
                line,
                names - 8.0,
                middle + 4.0 + LINE * (place - (len(lines) - 1) / 2.0),
                text_anchor="end",
                font_size=SMALL,
            )
            for place, line in enumerate(lines)
        ]
        for place, (series, (value, error)) in enumerate(shown):
            at = middle + _BAR * (place - len(shown) / 2.0)
            parts += _bar(x, names, at, series, value or 0.0, error)
        top += high
    parts.append(element("path", d=f"M{short(names + x.at(0.0))} {short(first)}V{short(top)}", stroke="var(--edge)"))
    parts.append(moved("".join(x_numbers(x, top)), names, 0.0))
    size = {"viewBox": f"0 0 {width} {short(top + 24.0)}", "width": width, "height": top + 24.0}
    return element(
        "svg", "".join(parts), class_="figure", **size, role="img", aria_label=bars.title, font_size=SIZE,
        fill="var(--ink)",
    )  # fmt: skip


def _ends(bars: Bars) -> tuple[float, float]:
    """The least and the largest number, with the intervals."""
    known = [
        value + sign * (error or 0.0)
        for _name, values in bars.rows
        for value, error in values
        if value is not None
        for sign in (-1.0, 1.0)
    ]
    return min(known, default=0.0), max(known, default=1.0)


def _bar(x: Scale, left: float, top: float, series: int, value: float, error: float | None) -> list[str]:
    """A bar with its interval."""
    low, high = sorted((x.at(0.0), x.at(value)))
    parts = [
        element(
            "rect",
            element("title", number(value, 4)),
            x=left + low,
            y=top + 1.0,
            width=max(high - low, 0.5),
            height=_BAR - 2.0,
            fill=f"var(--series-{series + 1})",
        )
    ]
    if error:
        ends = sorted((x.at(value - error), x.at(value + error)))
        middle = top + _BAR / 2.0
        path = "".join(f"M{short(left + end)} {short(middle - 3.0)}v6" for end in ends)
        path += f"M{short(left + ends[0])} {short(middle)}H{short(left + ends[1])}"
        parts.append(element("path", d=path, stroke="var(--ink)", fill="none"))
    return parts


def sensitivity_svg(found: Sequence[Sensitivity], reading: Reading, width: int = WIDE, head: Sequence[str] = ()) -> str:
    """For each result, as somebody reads it, its bars where it has some, and the lines of its axes.

    ``head`` are lines above.
    """
    pictures: list[str] = []
    for item in found:
        if item.method != "none":
            bars = sensitivity_bars(item, reading)
            pictures.append(_sentence(_nothing(item), width) if not _drawn(bars) else bars_svg(bars, width))
        lines = sensitivity_lines(item, reading)
        pictures.append(svg(lines, width=width))
    return stacked(pictures, width, head)


def stacked(pictures: Sequence[str], width: int, head: Sequence[str] = ()) -> str:
    """Pictures of one width, one below the other, below lines of text."""
    parts, top = [], 4.0
    for place, text in enumerate(head):
        for line in lines_of(text, width - 4.0, bold=not place):
            top += LINE
            parts.append(text_at(line, 0.0, top - 4.0, font_weight=None if place else 600))
    for picture in pictures:
        found = _SIZE.search(picture)
        assert found is not None
        parts.append(picture.replace("<svg ", f'<svg y="{short(top)}" ', 1))
        top += float(found[1]) + 10.0
    size = {"viewBox": f"0 0 {width} {short(top)}", "width": width, "height": top}
    label = head[0] if head else None
    return element("svg", "".join(parts), class_="figure", **size, role="group", aria_label=label, font_size=SIZE)


def sensitivity_bars(item: Sensitivity, reading: Reading) -> Bars:
    """The indices of every axis; below them those of the strongest pairs."""
    pairs = _largest(item)
    captions = [[reading.caption(path) for path in effect.paths[:2]] for effect in item.effects]
    every = [effect.indices for effect in item.effects]
    size = partial(reading.value, si=item.info.unit)
    rows: list[tuple[str, tuple[tuple[float | None, float | None], ...]]] = []
    series: tuple[str, ...]
    if item.method == "morris":
        series = (_("mu*, mean of absolute effects"), _("sigma, their standard deviation"))
        for names, own in zip(captions, every, strict=True):
            values = ((size(own.mu_star), size(own.mu_star_error)), (size(own.sigma), None))
            rows.append((" = ".join(names), values))
    else:
        series = (_("first order"), _("total"), *([_("second order")] if pairs else []))
        for names, own in zip(captions, every, strict=True):
            rows.append((" = ".join(names), ((own.first_order, own.first_order_error), (own.total, own.total_error))))
        for pair in pairs:
            both = " × ".join(captions[place][0] for place in (pair.first, pair.second))
            rows.append((both, ((None, None), (None, None), (pair.index, pair.error))))
    what = _("elementary effects on {result}") if item.method == "morris" else _("share of the variance of {result}")
    unit = reading.unit(item.info.unit) if item.method == "morris" else "1"
    return Bars(what.format(result=title_of(Quantity(reading.within(item.info.name), unit))), series, tuple(rows))


def _drawn(bars: Bars) -> bool:
    return any(value is not None and math.isfinite(value) for _name, values in bars.rows for value, _error in values)


def _nothing(item: Sensitivity) -> str:
    return _("no shares of the variance") if item.cases else _("no case has this result")


def _sentence(text: str, width: int) -> str:
    return svg(Figure(Quantity("", "1"), (), note=text), width=width, label=text)


def _largest(item: Sensitivity) -> list[Pair]:
    """The strongest interactions, at most `MOST_PAIRS`."""
    known = [pair for pair in item.pairs if pair.index is not None and abs(pair.index) > _LEAST_SHARE]
    return sorted(known, key=lambda pair: -abs(pair.index or 0.0))[:MOST_PAIRS]


def sensitivity_lines(item: Sensitivity, reading: Reading) -> Figure:
    """Every axis from its least to its largest value, so that axes of different units share one plot."""
    lines = []
    for index, (effect, colour) in enumerate(zip(item.effects, line_colours(len(item.effects)), strict=True)):
        if not np.isfinite(effect.means).any():
            continue
        low, high = effect.values.min(), effect.values.max()
        place = (effect.values - low) / (high - low) if high > low else np.zeros(effect.values.size)
        ends = f"{number(reading.value(low, effect.unit), 4)} … {reading.quantity(high, effect.unit, 4)}"
        text = f"{reading.caption(effect.paths[0])}: {ends}"
        means = reading.units.values(effect.means, item.info.unit)
        lines.append(Line(text, place, means, colour, index, key=str(index)))
    result = title_of(Quantity(reading.within(item.info.name), reading.unit(item.info.unit)))
    y = Quantity(_("mean of {result}", result=result), "1")
    x = Quantity(_("axis, from its least to its largest value"), "1")
    return Figure(x, (Panel(y, tuple(lines), x=x),), note="" if lines else _("no case has this result"))
