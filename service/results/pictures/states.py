"""States over time, as pages and pictures draw them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

#: How a state looks that its model has no look for.
OTHER_LOOK: Final = ("#999999", "+", "+++")


def spans_of(states: list[str]) -> Iterator[tuple[str, int, int]]:
    """Runs of equal states: (state, first position, position after the last)."""
    start = 0
    for position in range(1, len(states) + 1):
        if position == len(states) or states[position] != states[start]:
            yield states[start], start, position
            start = position
