"""Described figures inside pages: drawn once for a wide and once for a narrow place, of which the style shows one."""

from __future__ import annotations

from typing import TYPE_CHECKING

from markupsafe import Markup

from sprag.service.figures.read import read_figure
from sprag.service.figures.svg import DOUBLE, NARROW, WIDE, svg
from sprag.service.http.web.view_forms import Seen
from sprag.service.views.shown import NOTHING, Shown

if TYPE_CHECKING:
    from collections.abc import Callable

    from sprag.service.figures.figure import Figure
    from sprag.service.reading.reader import Reading


def inline(
    figure_of: Callable[[int], Figure], reading: Reading, shown: Shown = NOTHING, *, label: str = "", cases: str = ""
) -> Seen:
    """A figure with as many columns as there is room for, as its reader reads it, and what is read beside it."""
    wide, narrow = (read_figure(figure_of(columns), reading) for columns in (2, 1))
    below = "" if any(wide.below in reading.say(text) for text in shown.sentences) else wide.below
    width = DOUBLE if wide.motion or wide.columns > 1 else WIDE
    drawn = svg(wide, width=width, label=label, cases=cases), svg(narrow, width=NARROW, label=label, cases=cases)
    both = Markup('<div class="broad">{}</div><div class="narrow">{}</div>')
    return Seen(both.format(*map(Markup, drawn)), below, shown)
