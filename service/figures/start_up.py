"""A start-up as a described figure: what is ramped, speed of the shaft, angles and torques over time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.service.figures.figure import PALETTE, Figure, Line, Panel, Quantity, colour_at
from sprag_study.service.reading.reader import Phrase, part_label
from sprag_study.worker.models.vocabulary import ordinal

if TYPE_CHECKING:
    from sprag_study.worker.models.ramps import StartUp

#: Title, unit and variable of each panel with one line; the first two are left out where nothing is ramped.
_RAMPED: Final = (
    (Phrase("excitation frequency"), "Hz", "excitation.frequency"), (Phrase("factor on the load"), "1", "load.factor"),
)  # fmt: skip
#: Title, unit and last part of the variables of each panel with a line for each pendulum.
_EACH: Final = ((Phrase("angle"), "rad", "angle"), (Phrase("clutch torque"), "N*m", "torque"))


def start_up_figure(made: StartUp, note: str) -> Figure:
    """The start-up over time; ``note`` says why there is none."""
    x, times = Quantity(Phrase("time"), "s"), made.motion.times
    if not times.size:
        return Figure(x, (), note=note)
    columns = dict(zip(made.motion.names, made.motion.values.T, strict=True))
    panels = [
        Panel(Quantity(title, unit), (Line(title, times, columns[name], PALETTE[0], 0, key=name),))
        for title, unit, name in _RAMPED
        if np.ptp(columns[name]) > 0.0
    ]
    speed = [Line(Phrase("speed"), times, columns["shaft.speed"], PALETTE[0], 0, key="shaft.speed")]
    settled = made.results["speed.settled"]
    if np.isfinite(settled):
        mean = Phrase("settled mean")
        speed.append(Line(mean, times[[0, -1]], np.full(2, settled), PALETTE[3], 1, key="speed.settled"))
    panels.append(Panel(Quantity(Phrase("speed of the shaft"), "rad/s"), tuple(speed)))
    pendulums = [name.split(".")[1] for name in columns if name.startswith("pendulums.") and name.endswith(".windup")]
    for title, unit, last in _EACH:
        lines = [
            Line(
                part_label(f"Pendulum {ordinal(number)}"), times, columns[name], colour_at(place), place, key=name
            )
            for place, number in enumerate(pendulums)
            for name in (f"pendulums.{number}.{last}",)
        ]  # fmt: skip
        panels.append(Panel(Quantity(title, unit), tuple(lines)))
    return Figure(x, tuple(panels), motion=True)
