"""The settled motion of a vibration drive over its excitation periods, beside that of another setting."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from sprag_study.service.figures.figure import Figure, Line, Panel, Quantity
from sprag_study.service.figures.motion import in_two, motion_figure
from sprag_study.service.reading.reader import Phrase

if TYPE_CHECKING:
    from sprag_study.worker.models import Presentation, Trajectory

_PERIOD: Final = Quantity(Phrase("excitation period"), "1")
#: Colour and number of the dash of the lines that are held for comparison.
_HELD: Final = ("#8493a5", 2)


def turn_figure(made: Trajectory, frequency: float, shown: Presentation, held: Figure | None = None) -> Figure:
    """Speeds, torques and states over the excitation periods of a motion.

    Parameters
    ----------
    made : Trajectory
        Over time, from the start of an excitation period on.
    frequency : float
        Of the excitation, Hz.
    shown : Presentation
    held : Figure, optional
        This figure of another motion, whose lines are drawn behind those of this one.
    """
    figure, _others = in_two(motion_figure(replace(made, times=made.times * frequency), shown), shown)
    panels = list(figure.panels)
    if held is not None:
        panels = [_with_held(panel, held) for panel in panels]
    return replace(figure, x=_PERIOD, panels=tuple(panels))


def _with_held(panel: Panel, held: Figure) -> Panel:
    """The panel with the lines of the same quantity of the figure held."""
    others = [line for other in held.panels if other.y == panel.y for line in other.lines]
    lines = tuple(_pale(line) for line in others)
    return replace(panel, lines=(*lines, *panel.lines))


def _pale(line: Line) -> Line:
    colour, style = _HELD
    return replace(line, name=Phrase("{line}, held", line=line.name), colour=colour, style=style + line.style)
