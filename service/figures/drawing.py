"""The drawing of a machine to scale from its numbers, with the place of each dimension, as the text of an SVG.

Pages colour it by their variables (the classes of ``.drawing`` in the style sheet); as a picture of its own it has
colours of its own. A script moves what has a mark such as ``data-arm`` or ``data-bar``.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from html import escape
from itertools import combinations
from typing import TYPE_CHECKING, Final, Literal

from sprag_study.service.figures.painter.elements import text_width
from sprag_study.service.reading.wording import symbol

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

Side = Literal["left", "right"]
#: Width beside a drawing for labels with values, and the least distance of two of them, of which one has an index.
_LABEL, _APART = 118.0, 21.0
#: Symbols that are so near are one above the other.
_NEAR: Final = 17.0
#: A letter so far beside its place begins or ends there; a nearer one is centred above or below it.
_ASIDE: Final = 5.0
_PRINTED: Final = re.compile(r"<i>(.*)</i>(?:<sub>(.*)</sub>)?")
_COLOURS: Final = """<style>.drawing text{font:13px sans-serif;fill:#1b2430}
.drawing .thin,.drawing .dashed,.drawing .leader{fill:none;stroke:#8593a5}.drawing .dashed{stroke-dasharray:9 4 2 4}
.drawing .body{fill:none;stroke:#1b2430;stroke-width:1.6}.drawing .rod{fill:none;stroke:#1b2430;stroke-width:5;
stroke-linecap:round;stroke-linejoin:round}.drawing .mass{fill:#cfe0f2;stroke:#1b2430;stroke-width:1.6}
.drawing .wheel{fill:#f0dfc8;stroke:#1b2430;stroke-width:1.6}.drawing .pin{fill:#fff;stroke:#1b2430;stroke-width:1.6}
.drawing .solid{fill:#1b2430}.drawing .measure{fill:none;stroke:#0a5aa6}.drawing .tip{fill:#0a5aa6}
.drawing .crank{stroke:#0a5aa6}.drawing .letter{font-style:italic}</style>"""


@dataclass(frozen=True, slots=True)
class Dimension:
    """A number of the machine in its drawing: its path and symbol, its place (px), and the side of its label.

    Attributes
    ----------
    apart : from its place to the middle of its letter (px), so that the letter lies on no part of the machine
    on : what its place moves with: ``arm`` or ``base`` of a drive; of a linkage two joints, the share of the way from
        the first to the second, and px below that point; "" for nothing
    """

    path: str
    symbol: str
    x: float
    y: float
    side: Side
    apart: tuple[float, float] | None = None
    on: str = ""


@dataclass(frozen=True, slots=True)
class Drawing:
    """One picture of a machine or a part of it: sizes in px, its shapes as SVG without labels.

    ``about`` says in a sentence what it shows; ``frames`` are the places of what moves over a turn of the shaft, as
    JSON, where the numbers alone say them; ``at`` is the path of the part that it shows, "" for the whole machine.
    """

    title: str
    about: str
    width: float
    height: float
    shapes: str
    dimensions: tuple[Dimension, ...] = ()
    frames: str = ""
    at: str = ""

    def labelled(self, symbols: Mapping[str, str]) -> Drawing:
        """With the symbols of the catalogue, and without dimensions that the machine does not have."""
        own = tuple(replace(each, symbol=symbols[each.path]) for each in self.dimensions if each.path in symbols)
        return replace(self, dimensions=own)


def svg(
    drawing: Drawing, labels: Mapping[str, str] | None = None, links: Mapping[str, str] | None = None, *,
    alone: bool = False,
) -> str:  # fmt: skip
    """The drawing with a letter at each dimension, or with a label beside it where ``labels`` has one for its path.

    ``links`` has addresses of labels or letters by their paths; those of letters are no stops of the Tab key. ``alone``
    gives it the name space and the colours that it has as a file.
    """
    beside = 0.0 if labels is None else max([_LABEL, *(_room(each, labels) for each in drawing.dimensions)])
    text = _letters(drawing, links or {}) if labels is None else _beside(drawing, labels, links or {})
    space = ' xmlns="http://www.w3.org/2000/svg"' if alone else ""
    role = "group" if links else "img"
    frames = f' data-frames="{escape(drawing.frames)}"' if drawing.frames and not alone else ""
    return (
        f'<svg{space} width="{drawing.width + 2 * beside:g}" height="{drawing.height:g}" class="drawing" role="{role}" '
        f'aria-label="{escape(drawing.about)}"{frames} '
        f'viewBox="{-beside:g} 0 {drawing.width + 2 * beside:g} {drawing.height:g}">'
        f"{_COLOURS if alone else ''}{drawing.shapes}{text}</svg>"
    )


def _room(dimension: Dimension, labels: Mapping[str, str]) -> float:
    """Pixels that a label takes beside the drawing."""
    label = labels.get(dimension.path)
    return 14.0 + text_width(f"{dimension.symbol} = {label}") if label else 0.0


def rows_of(drawing: Drawing, side: Side) -> tuple[Dimension, ...]:
    """The dimensions whose labels stand at one side, from top to bottom."""
    return tuple(sorted((each for each in drawing.dimensions if each.side == side), key=lambda each: each.y))


def balanced(dimensions: Sequence[Dimension]) -> tuple[tuple[Dimension, ...], tuple[Dimension, ...]]:
    """Dimensions in two columns of about the same length, each from top to bottom: the left half and the right half."""
    across = sorted(dimensions, key=lambda each: each.x)
    half = (len(across) + 1) // 2
    left, right = (tuple(sorted(own, key=lambda each: each.y)) for own in (across[:half], across[half:]))
    return left, right


def uncrossed(rows: Sequence[Dimension], x: float, places: Sequence[float]) -> tuple[Dimension, ...]:
    """Dimensions of one side in an order in which no line to its place, at ``x``, crosses another one."""
    order = list(rows)

    def line(row: int) -> tuple[complex, complex]:
        return complex(x, places[row]), complex(order[row].x, order[row].y)

    # Two lines that cross are together longer than after an exchange of their places, so that this ends.
    while pair := next((each for each in combinations(range(len(order)), 2) if _cross(*map(line, each))), None):
        upper, lower = pair
        order[upper], order[lower] = order[lower], order[upper]
    return tuple(order)


def _cross(first: tuple[complex, complex], second: tuple[complex, complex]) -> bool:
    """Whether the ends of each of two lines lie at different sides of the other one."""

    def apart(line: tuple[complex, complex], points: tuple[complex, complex]) -> bool:
        along = (line[1] - line[0]).conjugate()
        before, behind = ((along * (point - line[0])).imag for point in points)
        return before * behind < 0.0

    return apart(first, second) and apart(second, first)


def field_places(
    drawing: Drawing, rows: Sequence[Sequence[Dimension]], step: float, at: float
) -> tuple[tuple[float, ...], ...]:
    """Where the lines end at the fields of each column (px), with the drawing in the middle of their height.

    ``step`` is the distance of two fields, ``at`` that of a line's end from the top of its field.
    """
    above = max(max(map(len, rows)) * step - drawing.height, 0.0) / 2
    return tuple(tuple(row * step + at - above for row in range(len(side))) for side in rows)


def with_leaders(
    drawing: Drawing, step: float, gap: float, at: float, rows: Sequence[Sequence[Dimension]] | None = None,
    links: Mapping[str, str] | None = None,
) -> str:  # fmt: skip
    """The drawing as `svg` gives it, behind it lines from dimensions to fields in two columns beside it.

    Parameters
    ----------
    step, at : as of `field_places`
    gap : distance of the columns from the drawing (px)
    rows : dimensions of the fields of both columns, from top to bottom; by default all, at their sides
    links : as of `svg`
    """
    sides = rows or (rows_of(drawing, "left"), rows_of(drawing, "right"))
    columns = zip(sides, (-gap, drawing.width + gap), field_places(drawing, sides, step, at), strict=True)
    lines = "".join(
        _leader(each, edge, y) for side, edge, places in columns for each, y in zip(side, places, strict=True)
    )
    text = svg(drawing, links=links)
    place = text.index(">") + 1
    return text[:place] + lines + text[place:]


def _leader(dimension: Dimension, x: float, y: float) -> str:
    """A line from the label or the field of a dimension to its place, whose end moves with the machine."""
    moves = _moves(dimension)
    return f'<path class="leader"{moves} d="M{x:g} {y:g}L{dimension.x:g} {dimension.y:g}"/>'


def _moves(dimension: Dimension) -> str:
    """What the mark of a dimension moves with, and its place while the machine stands still, as attributes."""
    return f' data-on="{dimension.on}" data-at="{dimension.x:g} {dimension.y:g}"' if dimension.on else ""


def _letters(drawing: Drawing, links: Mapping[str, str]) -> str:
    """The symbols at their places; of two at one place the first."""
    found, taken = list[str](), list[Dimension]()
    for each in drawing.dimensions:
        if any(abs(each.x - other.x) < _NEAR and abs(each.y - other.y) < _NEAR for other in taken):
            continue
        taken.append(each)
        across, down = each.apart or (-7.0 if each.side == "left" else 7.0, 0.0)
        end = ' text-anchor="end"' if across < -_ASIDE else "" if across > _ASIDE else ' text-anchor="middle"'
        text = (
            f'<text class="letter" data-mark="{escape(each.path)}"{_moves(each)} x="{each.x + across:g}" '
            f'y="{each.y + down + 4:g}"{end}>{_printed(each.symbol)}</text>'
        )
        link = links.get(each.path)
        found.append(f'<a href="{escape(link)}" tabindex="-1">{text}</a>' if link else text)
    return "".join(found)


def _printed(text: str, behind: str = "") -> str:
    """A symbol with its index as in print, and what is behind it, as a part of a text of an SVG."""
    found = _PRINTED.fullmatch(str(symbol(text))) if text else None
    base, index = (escape(text), None) if found is None else found.groups()
    lower = f'<tspan dy="3" font-size="10">{index}</tspan>' if index else ""
    return base + lower + (f'<tspan dy="-3">{behind}</tspan>' if lower and behind else behind)


def _beside(drawing: Drawing, labels: Mapping[str, str], links: Mapping[str, str]) -> str:
    found = []
    for side in ("left", "right"):
        rows = [each for each in rows_of(drawing, side) if labels.get(each.path)]
        edge, end = (-8.0, ' text-anchor="end"') if side == "left" else (drawing.width + 8.0, "")
        begins = edge + (4.0 if side == "left" else -4.0)
        places = _spread([each.y for each in rows], drawing.height)
        for each, y in zip(uncrossed(rows, begins, places), places, strict=True):
            symbol_ = f'<tspan class="letter">{_printed(each.symbol, " = ")}</tspan>' if each.symbol else ""
            text = (
                f'<text data-mark="{escape(each.path)}" x="{edge:g}" y="{y + 4:g}"{end}>'
                f"{symbol_}{escape(labels[each.path])}</text>"
            )
            found.append(
                _leader(each, begins, y)
                + (f'<a href="{escape(links[each.path])}">{text}</a>' if each.path in links else text)
            )
    return "".join(found)


def _spread(places: Sequence[float], height: float) -> list[float]:
    """Places from top to bottom at least `_APART` from each other, within the height as far as there is room."""
    found: list[float] = []
    for place in places:
        found.append(max(place, found[-1] + _APART) if found else max(place, 10.0))
    over = found[-1] - (height - 8.0) if found else 0.0
    for index in range(len(found) - 1, -1, -1):
        if over <= 0.0:
            break
        limit = (height - 8.0) if index == len(found) - 1 else found[index + 1] - _APART
        found[index] = min(found[index], limit)
    return found
