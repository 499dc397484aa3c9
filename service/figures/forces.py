"""Forces as a described figure: those on the vibrating table over time, in both directions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.service.figures.figure import Figure, Line, Panel, Quantity, colour_at
from sprag_study.service.reading.reader import Phrase, part_label
from sprag_study.worker.models.vocabulary import ordinal

if TYPE_CHECKING:
    from sprag_study.worker.models.forces import Forces

#: Title of each panel, and the last part of the names of its variables.
_PANELS: Final = ((Phrase("force to the right"), "force_x"), (Phrase("upward force"), "force_y"))


def forces_figure(made: Forces, note: str) -> Figure:
    """The forces of each pendulum and of all on the table over time; ``note`` says why there are none."""
    x, motion = Quantity(Phrase("time"), "s"), made.motion
    if not motion.times.size:
        return Figure(x, (), note=note)
    bodies = list(dict.fromkeys(name.rpartition(".")[0] for name in motion.names))
    if len(bodies) == 2 and np.array_equal(motion.values[:, :2], motion.values[:, 2:]):
        del bodies[1]  # the only pendulum, and nothing beside it
    panels = [
        Panel(
            Quantity(title, "N"),
            tuple(
                Line(
                    body_label(body),
                    motion.times,
                    motion.values[:, motion.names.index(f"{body}.{direction}")],
                    colour_at(place),
                    place,
                    key=body,
                )
                for place, body in enumerate(bodies)
            ),
        )
        for title, direction in _PANELS
    ]
    return Figure(x, tuple(panels), motion=True)


def body_label(body: str) -> Phrase:
    """What acts on the table: all together, or a pendulum."""
    return Phrase("All") if body == "table" else part_label(f"Pendulum {ordinal(body.rpartition('.')[2])}")
