"""What is drawn of a motion: panels, their lines, and how states look. Pages and pictures draw the same."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from service.results.wording import words

if TYPE_CHECKING:
    from worker.models import Trajectory

#: Panels: title, unit, and lines (variable, name).
PANELS: Final[tuple[tuple[str, str, tuple[tuple[str, str], ...]], ...]] = (
    ("ω, angular speed", "rad/s", (("omega", "ω"),)),
    ("T, kinetic energy", "J", (("energy", "T"),)),
    ("S₁ … S₄", "rad^2/s^2", (("s1", "S₁"), ("s2", "S₂"), ("s3", "S₃"), ("s4", "S₄"))),
    ("Torques", "N*m", (("drive_torque", "driving"), ("resisting_torque", "resisting"))),
)
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


def panels(made: Trajectory) -> list[tuple[str, str, list[tuple[str, str]]]]:
    """What is drawn over time: (title, unit, lines), each line a variable and what it is called."""
    pendulums = [
        name.removesuffix(".angle") for name in made.names if name.endswith(".angle") and name != "shaft.angle"
    ]

    def each(quantity: str) -> list[tuple[str, str]]:
        return [(f"{pendulum}.{quantity}", words(pendulum)) for pendulum in pendulums]

    powers = [
        ("power.input", "input"),
        ("power.useful", "useful"),
        ("power.loss", "loss"),
        ("power.clutch", "clutches"),
    ]
    return [
        ("angle", "rad", each("angle")),
        ("speed", "rad/s", [*each("speed"), ("shaft.speed", "Shaft")]),
        ("torque", "N*m", [*each("torque"), *([("torque", "All clutches")] if len(pendulums) > 1 else [])]),
        ("power", "W", powers),
    ]


def spans_of(states: list[str]) -> Iterator[tuple[str, int, int]]:
    """Runs of equal states: (state, first position, position after the last)."""
    start = 0
    for position in range(1, len(states) + 1):
        if position == len(states) or states[position] != states[start]:
            yield states[start], start, position
            start = position
