"""The motion of one case as descriptions of figures: its variables over time or angle with states, phase portrait."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.service.figures.figure import NEUTRAL, PALETTE, Figure, Line, Panel, Quantity, colour_at
from sprag_study.service.figures.orders import runs_of
from sprag_study.service.reading.reader import Phrase, joined, part_label
from sprag_study.service.reading.wording import words

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.worker.models import Panel as Described
    from sprag_study.worker.models import Presentation, Reference, Trajectory

#: Points of a line that are drawn.
_MOST_POINTS: Final = 2400


def motion_figure(
    made: Trajectory, shown: Presentation, held: Sequence[tuple[str, Trajectory]] = (), columns: int = 2
) -> Figure:
    """The model's panels over time, above the states of its parts; over the angle ``columns`` in a row, in degrees.

    ``held`` are other motions of the model with their names, drawn beside it.
    """
    angle = made.along == "angle"
    references = shown.references(made)
    panels = []
    for panel in shown.panels(made.names, made.units):
        beside = references.get(panel.title, ())
        listed = len(panel.lines) + len(beside) + len(held) > 1 or not angle
        lines = [
            Line(
                part_label(label),
                _along(made.times, angle=angle),
                made.values[:, made.names.index(name)],
                colour_at(place),
                place,
                key=f"{panel.title} {label}" if angle else panel.title,
                heading="" if angle else Phrase(words(panel.title)),
                listed=listed,
            )
            for place, (name, label) in enumerate(panel.lines)
        ]
        lines += [_reference_line(reference, panel.title, angle=angle) for reference in beside]
        for place, (name, other) in enumerate(held):
            lines += _held_lines(name, other, panel, shown, PALETTE[-1 - place])
        panels.append(Panel(Quantity(panel.title, panel.unit), tuple(lines)))
    return Figure(
        Quantity(Phrase("φ, angle of the shaft"), "°") if angle else Quantity(Phrase("time"), "s"),
        tuple(panels),
        columns=columns if angle else 1,
        spans={part_label(words(name)): tuple(_spans(made, list(states))) for name, states in made.states.items()},
        looks=shown.states,
        motion=True,
        most=_MOST_POINTS,
    )


def in_two(figure: Figure, shown: Presentation) -> tuple[Figure, Figure]:
    """The plots of a motion that the model shows first, and the others, which may be none."""
    names = shown.first_panels or [panel.y.name for panel in figure.panels]
    first, others = (
        tuple(panel for panel in figure.panels if (panel.y.name in names) == wanted) for wanted in (True, False)
    )
    return replace(figure, panels=first, columns=1), replace(figure, panels=others)


def _along(times: NDArray[np.float64], *, angle: bool) -> NDArray[np.float64]:
    return np.degrees(times) if angle else times


def _reference_line(reference: Reference, title: str, *, angle: bool) -> Line:
    """A level, an angle or a sum beside the variables of a panel."""
    x = _along(reference.x, angle=angle)
    key = f"{title} {reference.label}"
    return Line(part_label(reference.label), x, reference.y, NEUTRAL, reference.style, key=key, wide=reference.wide)


def _held_lines(name: str, made: Trajectory, panel: Described, shown: Presentation, colour: str) -> list[Line]:
    """The lines of another motion in a panel: its variables, or what stands for the whole of many."""
    x = _along(made.times, angle=made.along == "angle")
    wholes = [reference for reference in shown.references(made).get(panel.title, ()) if reference.wide]
    if wholes:
        return [
            Line(joined(": ", (name, part_label(whole.label))), x, whole.y, colour, 3, key=f"{panel.title} {name}")
            for whole in wholes
        ]
    return [
        Line(
            joined(": ", (name, part_label(label))),
            x,
            made.values[:, made.names.index(variable)],
            colour,
            place,
            key=f"{name} {label}",
        )
        for place, (variable, label) in enumerate(panel.lines)
    ]


def _spans(made: Trajectory, states: list[str]) -> Iterator[tuple[str, float, float]]:
    """Runs of equal states, each until the next begins."""
    for state, start, stop in runs_of(states):
        yield state, float(made.times[start]), float(made.times[min(stop, made.times.size - 1)])


def phase_figure(made: Trajectory, shown: Presentation) -> Figure:
    """Speed over angle of each part of the machine that swings."""
    step = max(made.times.size // _MOST_POINTS, 1)
    lines = tuple(
        Line(
            part_label(label),
            made.values[::step, made.names.index(angle)],
            made.values[::step, made.names.index(speed)],
            colour_at(index),
            index,
            key=label,
        )
        for index, (angle, speed, label) in enumerate(shown.phases(made.names))
    )
    return Figure(Quantity(Phrase("angle"), "rad"), (Panel(Quantity(Phrase("speed"), "rad/s"), lines),))
