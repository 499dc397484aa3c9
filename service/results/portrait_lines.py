"""Content of the pictures of strobes and orbit, for both painters."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sprag.worker import models

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag.worker.models import Portrait, Presentation, Trajectory


def column_of(made: Trajectory, name: str) -> NDArray[np.float64]:
    """Values of a variable, shape (times,)."""
    values: NDArray[np.float64] = made.values[:, made.names.index(name)]
    return values


def strobe_numbers(strobes: Trajectory) -> NDArray[np.int64]:
    """Number of the excitation period at whose end each strobe lies, from 1."""
    if strobes.times.size < 2:
        return np.arange(1, strobes.times.size + 1)
    period = (strobes.times[-1] - strobes.times[0]) / (strobes.times.size - 1)
    found: NDArray[np.int64] = np.rint(strobes.times / period).astype(np.int64)
    return found


def approach(made: Portrait, shown: Presentation) -> tuple[str, str, list[tuple[str, str]]]:
    """What is drawn strobe by strobe: title, unit, and pairs of a variable and its label.

    The speed of the shaft; where it never turns, the angles of the pendulums.
    """
    if np.any(column_of(made.strobes, "shaft.speed") != 0.0):
        return "speed of the shaft at the strobe", "rad/s", [("shaft.speed", "Shaft")]
    return "angle at the strobe", "rad", [(angle, label) for angle, _, label in shown.phases(made.strobes.names)]


def described(made: Portrait) -> str:
    """A sentence that describes the picture."""
    count = made.strobes.times.size
    strobes = f"{count:,} strobe{'' if count == 1 else 's'}"
    if made.order:
        turn = "one excitation period" if made.order == 1 else f"{made.order} excitation periods"
        return f"{made.regime}: {strobes} on the way to an orbit of {turn}"
    if made.ending != models.OK:
        return f"{strobes}; the run ended with {made.ending}"
    return f"{made.regime}: {strobes}, no orbit" if made.regime else f"{strobes} of a run of a given time"
