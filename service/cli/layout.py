"""Tables that fit a terminal: widths of columns, lines of headings, and columns that go on below the others."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

#: Characters of a table beside its cells: at both ends, around each cell, between two cells.
_ENDS, _PADDING, _BETWEEN = 2, 2, 1
#: Narrowest column of texts that are broken into lines.
_TEXT: Final = 20
#: Pieces of a heading: it may be broken after dots and spaces.
_PIECE: Final = re.compile(r"[^.\s]*\.(?=\S)|\S+\s*")


@dataclass(frozen=True, slots=True)
class Shape:
    """A column of a table: its heading, the longest of its texts, and whether these are whole: broken after dots only.

    ``piece`` is the longest piece of a whole text. It is broken only where a column has no room beside the first one.
    """

    heading: str
    longest: int
    whole: bool
    piece: int

    @property
    def natural(self) -> int:
        """The width at which nothing is broken."""
        return max(self.longest, *map(len, self.heading.split("\n")))

    @property
    def least(self) -> int:
        """The smallest width at which nothing is cut and no whole text is broken."""
        return max(_longest(self.heading), self.longest if self.whole else min(self.longest, _TEXT))

    @property
    def narrowest(self) -> int:
        """The smallest width at which nothing is cut."""
        return max(_longest(self.heading), self.piece if self.whole else min(self.longest, _TEXT))


def width_of(widths: Sequence[int]) -> int:
    """The width of a table with columns of these widths."""
    return _ENDS + sum(width + _PADDING for width in widths) + _BETWEEN * (len(widths) - 1)


def blocks(shapes: Sequence[Shape], width: int) -> list[dict[int, int]]:
    """The columns of each table into which one is broken so that it fits ``width``, with their widths.

    Every table begins with the first column.
    """
    natural = {index: shape.natural for index, shape in enumerate(shapes)}
    if width_of([*natural.values()]) <= width:
        return [natural]
    first, *others = (shape.least for shape in shapes)
    if width_of([first, max(others, default=0)]) > width:
        first, *others = (shape.narrowest for shape in shapes)
    found = [{0: first}]
    for index, least in enumerate(others, 1):
        if width_of([*found[-1].values(), least]) > width and len(found[-1]) > 1:
            found.append({0: first})
        found[-1][index] = least
    return [_widened(shapes, block, width) for block in found]


def _widened(shapes: Sequence[Shape], block: dict[int, int], width: int) -> dict[int, int]:
    """The rest of the width goes to texts, then to headings that then need one line."""
    rest = max(0, width - width_of([*block.values()]))
    widths = dict(block)
    for index in sorted(block, key=lambda index: shapes[index].whole):
        missing = shapes[index].natural - widths[index]
        if missing <= rest or not shapes[index].whole:
            widths[index] += min(rest, missing)
            rest -= min(rest, missing)
    return widths


def longest_piece(text: str, length: Callable[[str], int]) -> int:
    """The length of the longest piece of a text that is broken after dots; one of several words is a single piece."""
    return length(text) if " " in text else max(map(length, _PIECE.findall(text)), default=0)


def _longest(heading: str) -> int:
    return max((len(piece.rstrip()) for piece in _PIECE.findall(heading)), default=0)


def broken(heading: str, width: int) -> str:
    """The heading in lines of at most ``width`` characters where its pieces allow it; its own line breaks stay."""
    lines: list[str] = []
    for part in heading.split("\n"):
        lines.append("")
        for piece in _PIECE.findall(part):
            if lines[-1] and len((lines[-1] + piece).rstrip()) > width:
                lines.append("")
            lines[-1] += piece
    return "\n".join(line.rstrip() for line in lines)
