"""What is drawn of a motion: panels, their lines, and how states look. Pages and pictures draw the same."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from worker import models

if TYPE_CHECKING:
    from worker.models import Panel, Trajectory
    from worker.study import Study

#: How states look: colour and pattern, so that either alone tells them.
STATES: Final = {
    "free": ("#d9dee5", "", ""),
    "take_up": ("#f0c35a", "/", "///"),
    "engaged": ("#3f87c5", "", ""),
    "beyond": ("#d55e00", "x", "xxx"),
    "locked": ("#8a6fc4", ".", "..."),
    "held": ("#b9c1cb", "-", "---"),
    "rotating": ("#5fb38b", "", ""),
}


def panels(study: Study, made: Trajectory) -> tuple[Panel, ...]:
    """The plots of a motion of a case of ``study``."""
    return models.presentation_of(study).panels(made.names, made.units)


def spans_of(states: list[str]) -> Iterator[tuple[str, int, int]]:
    """Runs of equal states: (state, first position, position after the last)."""
    start = 0
    for position in range(1, len(states) + 1):
        if position == len(states) or states[position] != states[start]:
            yield states[start], start, position
            start = position
