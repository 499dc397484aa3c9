"""All steady cycles of a case as a described figure: the change of the speed in a cycle over the speed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.service.figures.figure import PALETTE, Figure, Line, Panel, Quantity
from sprag_study.service.reading.reader import Phrase

if TYPE_CHECKING:
    from sprag_study.worker.models.speeds import SteadyCycles

#: The largest speed of the figure, over that of the fastest cycle.
_BEYOND: Final = 1.5


def speeds_figure(made: SteadyCycles) -> Figure:
    """The change of the speed in a cycle, with the steady cycles where it is zero."""
    x = Quantity(Phrase("speed at the angle 0"), "rad/s")
    shown = np.ones(made.speeds.shape, dtype=np.bool_)
    if made.cycles:
        shown = made.speeds <= _BEYOND * made.cycles[-1].start
    change = Phrase("change in a cycle")
    lines = [Line(change, made.speeds[shown], made.changes[shown], PALETTE[0], key=change)]
    for number, (name, stable) in enumerate(((Phrase("stable"), True), (Phrase("unstable"), False)), start=1):
        starts = np.array([cycle.start for cycle in made.cycles if cycle.stable == stable])
        if starts.size:
            points = np.zeros(starts.shape)
            lines.append(Line(name, starts, points, PALETTE[number], number, name, joined=False, ring=not stable))
    return Figure(x, (Panel(Quantity(change, "rad/s"), tuple(lines)),))
