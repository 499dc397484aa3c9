"""Two quantities of all cases as a described figure: the selected ones in colour, the others grey."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.service.faults import refused
from sprag_study.service.figures.figure import PALETTE, Figure, Line, Panel, Quantity
from sprag_study.service.reading.reader import Phrase, plural
from sprag_study.service.results.selection import listed

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.service.results.explore import Explored

_OTHERS: Final = "#b0b8c4"
#: Most points of a kind in a picture.
_MOST: Final = 5_000


def chosen_pair(found: Explored, x: str, y: str) -> tuple[str, str]:
    """Names of the two quantities; by default the first and the last shown one. Raises SelectionError for others."""
    shown = found.plan.shown
    for parameter, name in (("x", x), ("y", y)):
        if name and name not in found.values:
            raise refused(parameter, "unknown-name", "is not a shown quantity", name, allowed=listed(shown))
    return x or shown[0], y or shown[-1]


def explore_figure(found: Explored, x: str = "", y: str = "") -> Figure:
    """Every case as a point; of many cases, some evenly through the study, always with the first rows of the table."""
    first, second = chosen_pair(found, x, y)
    units = found.plan.units
    across, up = (Quantity(name, units.get(name, "1")) for name in (first, second))
    xs, ys = found.values[first], found.values[second]
    known = np.isfinite(xs) & np.isfinite(ys) if found.known else np.zeros(0, dtype=np.bool_)
    top = np.zeros(found.known, dtype=np.bool_)
    top[found.order] = True
    kinds = (
        (Phrase("other cases"), _OTHERS, known & ~found.selected),
        (Phrase("selected"), PALETTE[0], known & found.selected & ~top),
        (Phrase("first in the table"), PALETTE[1], known & top),
    )
    lines = []
    left_out = 0
    for index, (name, colour, which) in enumerate(kinds):
        places = _some(np.flatnonzero(which))
        left_out += int(np.count_nonzero(which)) - places.size
        if places.size:
            cases = found.rows.cases[places]
            lines.append(Line(name, xs[places], ys[places], colour, index, str(index), cases=cases, joined=False))
    note = "" if lines else Phrase("No case has both numbers.")
    below = (
        plural(
            "{count} further case is left out of this picture.",
            "{count} further cases are left out of this picture.",
            left_out,
        )
        if left_out
        else ""
    )
    return Figure(across, (Panel(up, tuple(lines), x=across),), note=note, below=below, most=3 * _MOST)


def _some(places: NDArray[np.intp]) -> NDArray[np.intp]:
    """At most so many places as a picture shows, evenly."""
    if places.size <= _MOST:
        return places
    return places[np.linspace(0, places.size - 1, _MOST).astype(np.intp)]
