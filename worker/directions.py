"""The directions of sweeps: an axis of its own, the last one of a swept study."""

from __future__ import annotations

from typing import Final

#: Path of the axis of directions. It is not a parameter of any machine.
SWEEP: Final = "sweep"
UP, DOWN = 0, 1
#: The directions in words, by their numbers.
DIRECTIONS: Final = ("up", "down")


def direction(value: float) -> str:
    """A value of the axis `SWEEP` in words."""
    return DIRECTIONS[int(value)]
