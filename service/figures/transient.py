"""A transient as a described figure: speed, torques and energy over time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.service.figures.figure import PALETTE, Figure, Line, Panel, Quantity
from sprag_study.service.reading.reader import Phrase

if TYPE_CHECKING:
    from sprag_study.worker.models.transients import Transient

#: Title, unit and lines (variable, label) of each panel.
_PANELS: Final = (
    (Phrase("speed"), "rad/s", (("omega", Phrase("speed")),)),
    (Phrase("torque"), "N*m", (("drive_torque", Phrase("drive")), ("resisting_torque", Phrase("resistance")))),
    (Phrase("kinetic energy"), "J", (("energy", Phrase("kinetic energy")),)),
)
_MEANS: Final = (
    ("before.omega.mean", Phrase("mean before")),
    ("after.omega.mean", Phrase("mean of the steady cycle")),
)


def transient_figure(made: Transient) -> Figure:
    """Speed with the means of the steady cycles, torques, and energy, over time."""
    x, times = Quantity(Phrase("time"), "s"), made.motion.times
    if not times.size:
        return Figure(x, (Panel(Quantity(Phrase("speed"), "rad/s"), (), x=x),), note=made.cause)
    panels = []
    for title, unit, lines in _PANELS:
        drawn = [
            Line(label, times, made.motion.values[:, made.motion.names.index(name)], PALETTE[place], place, key=label)
            for place, (name, label) in enumerate(lines)
        ]
        if title == "speed":
            ends = times[[0, -1]]
            drawn += [
                Line(label, ends, np.full(2, made.results[name]), PALETTE[3 + place], 1 + place, key=label)
                for place, (name, label) in enumerate(_MEANS)
                if np.isfinite(made.results[name])
            ]
        panels.append(Panel(Quantity(title, unit), tuple(drawn)))
    return Figure(x, tuple(panels), motion=True, below=made.cause)
