"""Main effects as a described figure: the mean of each result along each axis."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag_study.service.figures.figure import PALETTE, Figure, Line, Panel, Quantity
from sprag_study.service.reading.reader import Phrase
from sprag_study.service.results.sensitivity import in_order

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.results.sensitivity import Sensitivity


def effects_figure(found: Sequence[Sensitivity], columns: int = 2) -> Figure:
    """A panel for each result and axis, what matters most first, so many in a row; of three axes all in one row."""
    panels = tuple(
        Panel(
            Quantity(item.info.name, item.info.unit),
            (Line(effect.paths[0], effect.values, effect.means, PALETTE[0], key="0"),),
            x=Quantity(" = ".join(effect.paths), effect.unit),
        )
        for item in found
        for effect in in_order(item)
    )
    if not panels:
        return Figure(Quantity("", "1"), (), note=Phrase("No case has these results yet."))
    if columns > 1 and len(found[0].effects) == 3:
        columns = 3
    return Figure(panels[0].x or panels[0].y, panels, columns, alike=True)
