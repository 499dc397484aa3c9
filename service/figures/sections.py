"""Bifurcation diagrams and Poincare sections as described figures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import Name
from sprag_study.service.figures.figure import PALETTE, Figure, Line, Panel, Quantity, colour_at
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.reader import Phrase, joined, part_label, term
from sprag_study.service.reading.wording import number
from sprag_study.service.results.regimes import MARKS
from sprag_study.service.results.selection import axis_name
from sprag_study.worker import models

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from sprag_study.worker.models.sections import CaseSections, Sampling
    from sprag_study.worker.study import Study

#: Most points of a figure.
_MOST: Final = 40_000
_REPEATS = Phrase("periodic: strobes of one turn")
_OTHERS = Phrase("irregular or unsettled: last strobes")


def diagram_figure(made: CaseSections, study: Study, asked: Sampling, variable: str) -> Figure:
    """One variable at the strobes over the parameter."""
    x, column = parameter_of(study, asked.paths), made.names.index(variable)
    values = made.values[:, :, column]
    lines: list[Line] = []
    for label, colour, wanted in (
        (_REPEATS, PALETTE[0], made.orders > 0),
        (_OTHERS, MARKS["irregular"].colour, made.orders == 0),
    ):
        kept = ~np.isnan(values) & wanted[:, None]
        if kept.any():
            across = np.broadcast_to(asked.values[:, None], values.shape)[kept]
            lines.append(Line(label, across, values[kept], colour, len(lines), key=label, joined=False))
    panel = Panel(
        Quantity(Phrase("{variable} at the strobe", variable=Name(variable)), made.units[column]), tuple(lines), x=x
    )
    note = "" if lines else Phrase("There are no strobes: no case ended ok.")
    return Figure(x, (panel,), heading=_heading(asked), most=_MOST, note=note)


def parameter_of(study: Study, paths: Sequence[str]) -> Quantity:
    """The quantity of tied parameters, named as their axis where they vary in the study."""
    name = " = ".join(paths) if study.axis_of(paths[0]) is None else axis_name(study, paths[0])
    return Quantity(name, unit_of(study, paths[0]))


def section_figure(made: CaseSections, study: Study, asked: Sampling) -> Figure:
    """The strobes of one case in the plane of angle and speed of each pendulum."""
    lines = tuple(_planes(made, study))
    panel = Panel(Quantity(Phrase("speed"), "rad/s"), lines, x=Quantity(Phrase("angle"), "rad"))
    order = int(made.orders[0])
    regime = term(made.regimes[0]) if made.regimes[0] else Phrase("no motion")
    turns = Phrase("an orbit of order {order}", order=order) if order else regime
    note = "" if any(line.x.size for line in lines) else Phrase("There are no strobes: the case did not end ok.")
    return Figure(
        Quantity(Phrase("angle"), "rad"),
        (panel,),
        heading=joined(": ", (_heading(asked), turns)),
        most=_MOST,
        note=note,
    )


def _planes(made: CaseSections, study: Study) -> Iterator[Line]:
    values = made.values[0][~np.isnan(made.values[0, :, 0])]
    for index, (angle, speed, label) in enumerate(models.presentation_of(study).phases(made.names)):
        x, y = values[:, made.names.index(angle)], values[:, made.names.index(speed)]
        yield Line(part_label(label), x, y, colour_at(index), index, key=label, joined=False)


def _heading(asked: Sampling) -> Phrase:
    return Phrase("strobes at the phase {angle}° of the excitation", angle=number(360.0 * asked.phase, 6))
