"""Two quantities of rows as points, in the shades of a third one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.service.figures.explore import chosen_pair
from sprag_study.service.figures.figure import Direction, Figure, Line, Panel, Quantity
from sprag_study.service.figures.read import read_figure
from sprag_study.service.figures.svg import svg
from sprag_study.service.http.web.rows.lines import SHADES
from sprag_study.service.languages import _
from sprag_study.service.reading.reader import Phrase

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.service.http.web.rows.asked import Asked
    from sprag_study.service.reading.reader import Reading
    from sprag_study.service.results.explore import Explored

_WIDTH: Final = 960


def points_of(
    found: Explored, asked: Asked, shades: NDArray[np.int64], chosen: int | None, reading: Reading
) -> tuple[tuple[str, str], str]:
    """The two quantities, and their picture; ``chosen`` is the number of the row that stands out."""
    names = found.plan.shown  # of which the first follows from the others
    pair = chosen_pair(found, asked.x or names[-1], asked.y or names[0])
    xs, ys = (found.values[name] for name in pair)
    inside = np.where(found.selected, shades, 0)
    kinds = [(inside == shade, f"var(--q{shade})", Phrase("row")) for shade in range(1, SHADES + 1)]
    if asked.outside:
        kinds.insert(0, (inside == 0, "var(--line)", Phrase("outside the conditions")))
    lines = [
        Line(name, xs[which], ys[which], colour, key="0", listed=False, cases=found.rows.cases[which],
             joined=False)
        for which, colour, name in kinds
        if which.any()
    ]  # fmt: skip
    own = found.rows.cases == chosen
    if own.any():
        lines.append(Line(Phrase("the chosen row"), xs[own], ys[own], "var(--look)", key="0", listed=False,
                          cases=found.rows.cases[own], joined=False, ring=True))  # fmt: skip
    across, up = (Quantity(name, found.plan.units.get(name, "1")) for name in pair)
    directions: tuple[tuple[Direction, str], ...] = (("x", pair[0]), ("y", pair[1]))
    figure = Figure(
        across,
        (Panel(up, tuple(lines), x=across),),
        most=len(xs) + 1,
        note="" if lines else Phrase("No case has both numbers."),
        log=tuple(direction for direction, name in directions if name in asked.log),
        flipped=tuple(direction for direction, name in directions if name in asked.flip),
    )
    label = _("{y} against {x}", y=reading.caption(pair[1]), x=reading.within(pair[0]))
    address = f"{asked.link(row=None)}&row=".replace("?&", "?")
    return pair, svg(read_figure(figure, reading), width=_WIDTH, label=label, cases=address)
