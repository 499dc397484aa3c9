"""Patterns of areas: they repeat the distinction by colour, for prints in grey."""

from __future__ import annotations

from typing import Final

from sprag_study.service.figures.painter.elements import element

#: Pixels after which a pattern repeats, and the colour of its lines.
_EVERY: Final = 6
_INK: Final = "#333333"
_PATHS: Final = {
    "/": "M0 6L6 0", "\\": "M0 0L6 6", "x": "M0 0L6 6M0 6L6 0", "-": "M0 3H6", "|": "M3 0V6", "+": "M0 3H6M3 0V6",
}  # fmt: skip


def pattern(name: str, colour: str, shape: str) -> str:
    """The definition of a pattern on a colour."""
    ground = element("rect", width=_EVERY, height=_EVERY, fill=colour)
    if shape == ".":
        signs = element("circle", cx=3, cy=3, r=1, fill=_INK)
    else:
        signs = element("path", d=_PATHS.get(shape, _PATHS["/"]), fill="none", stroke=_INK, stroke_width=0.8)
    return element("pattern", ground + signs, id=name, width=_EVERY, height=_EVERY, patternUnits="userSpaceOnUse")
