"""How one case approaches its motion, as a described figure: strobes on the orbit, and strobe by strobe."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.service.figures.figure import Figure, Line, Panel, Quantity, colour_at
from sprag_study.service.reading.reader import Phrase, part_label, plural, term
from sprag_study.worker import models

if TYPE_CHECKING:
    from sprag_study.worker.arrays import Floats
    from sprag_study.worker.models import Portrait, Presentation, Trajectory

#: Approximate number of points of all orbits of a figure together.
_MOST_POINTS: Final = 12_000
#: Colour of the strobes of an orbit.
_RING: Final = "#d55e00"
#: Levels of an orbit that are drawn as lines.
_LEVELS: Final = 40
_PERIOD: Final = Quantity(Phrase("excitation period"), "1")


def portrait_figure(made: Portrait, shown: Presentation, columns: int = 2) -> Figure:
    """Orbit and strobes in the plane of angle and speed, and the strobes period by period.

    ``columns`` is 2 for panels side by side, 1 for one below the other.
    """
    title, unit, lines = _approach(made, shown)
    plane = Panel(Quantity(Phrase("speed"), "rad/s"), tuple(_plane(made, shown)), x=Quantity(Phrase("angle"), "rad"))
    along = Panel(Quantity(title, unit), tuple(_along(made, lines)), x=_PERIOD)
    note = (
        ""
        if made.strobes.times.size
        else Phrase("There are no strobes: the case ended with {ending}.", ending=term(made.ending))
    )
    return Figure(
        _PERIOD, (plane, along), columns, heading=described(made), scale=_PERIOD.name, most=_MOST_POINTS, note=note
    )


def _plane(made: Portrait, shown: Presentation) -> Iterator[Line]:
    """The orbit of each pendulum, its strobes coloured by period, and the strobes of the orbit."""
    phases = shown.phases(made.strobes.names)
    step = max(made.orbit.times.size * len(phases) // _MOST_POINTS, 1)
    for index, (angle, speed, label) in enumerate(phases):
        if made.order:
            x, y = _column(made.orbit, angle), _column(made.orbit, speed)
            kept = np.append(np.arange(0, x.size - 1, step), x.size - 1)
            yield Line(part_label(label), x[kept], y[kept], colour_at(index), key=label)
        yield Line(
            part_label(label),
            _column(made.strobes, angle),
            _column(made.strobes, speed),
            colour_at(index),
            index,
            key=label,
            listed=not made.order,
            shades=_periods(made.strobes),
            joined=False,
        )
        if made.order:
            x, y = (_column(made.orbit, variable)[: -1 : made.points] for variable in (angle, speed))
            name = Phrase("{part}: strobe of the orbit", part=part_label(label))
            yield Line(name, x, y, _RING, index, key=label, listed=False, joined=False, ring=True)


def _along(made: Portrait, lines: list[tuple[str, str]]) -> Iterator[Line]:
    """Values strobe by strobe, with the levels of the orbit."""
    periods = _periods(made.strobes)
    for index, (name, label) in enumerate(lines):
        if made.order:
            levels = np.unique(_column(made.orbit, name)[: -1 : made.points])[:_LEVELS]
            x = np.tile([periods[0], periods[-1], periods[-1]], levels.size)
            y = np.stack([levels, levels, np.full(levels.size, np.nan)], axis=1).reshape(-1)
            yield Line(Phrase("{part}: level of the orbit", part=part_label(label)), x, y, _RING, 1, listed=False)
        colour = colour_at(index)
        yield Line(
            part_label(label),
            periods,
            _column(made.strobes, name),
            colour,
            index,
            key=label,
            listed=False,
            joined=False,
        )


def _column(made: Trajectory, name: str) -> Floats:
    """Values of a variable, shape (times,)."""
    values: Floats = made.values[:, made.names.index(name)]
    return values


def _periods(strobes: Trajectory) -> Floats:
    """Number of the excitation period at whose end each strobe lies, from 1."""
    if strobes.times.size < 2:
        return np.arange(1.0, strobes.times.size + 1.0)
    period = (strobes.times[-1] - strobes.times[0]) / (strobes.times.size - 1)
    periods: Floats = np.rint(strobes.times / period)
    return periods


def _approach(made: Portrait, shown: Presentation) -> tuple[str, str, list[tuple[str, str]]]:
    """What is drawn strobe by strobe: title, unit, and pairs of a variable and its label.

    The speed of the shaft; where it never turns, the angles of the pendulums.
    """
    if np.any(_column(made.strobes, "shaft.speed") != 0.0):
        return Phrase("speed of the shaft at the strobe"), "rad/s", [("shaft.speed", "Shaft")]
    return (
        Phrase("angle at the strobe"),
        "rad",
        [(angle, label) for angle, _, label in shown.phases(made.strobes.names)],
    )


def described(made: Portrait) -> str:
    """A sentence that describes the figure."""
    strobes = plural("{count} strobe", "{count} strobes", made.strobes.times.size)
    if made.order:
        return plural(
            "{regime}: {strobes} on the way to an orbit of {count} excitation period",
            "{regime}: {strobes} on the way to an orbit of {count} excitation periods",
            made.order,
            regime=term(made.regime),
            strobes=strobes,
        )
    if made.ending != models.OK:
        return Phrase("{strobes}; the run ended with {ending}", strobes=strobes, ending=term(made.ending))
    if made.regime:
        return Phrase("{regime}: {strobes}, no orbit", regime=term(made.regime), strobes=strobes)
    return Phrase("{strobes} of a run of a given time", strobes=strobes)
