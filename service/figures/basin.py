"""The basin of one case as a described figure: each start in the colour of the regime to which it comes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sprag_study.sentences import Amount
from sprag_study.service.figures.figure import Figure, Line, Panel, Quantity, colour_at
from sprag_study.service.reading.reader import Phrase, joined, plural
from sprag_study.service.reading.wording import number

if TYPE_CHECKING:
    from sprag_study.worker.models import Basin

#: Colour of starts that did not end ok.
_FAILED = "#999999"


def basin_figure(made: Basin, paths: tuple[str, str], units: tuple[str, str]) -> Figure:
    """Points in the plane of two initial values, a colour for each regime; ``units`` are SI."""
    across, along = np.meshgrid(made.x, made.y)
    lines = []
    for regime in (*range(len(made.values)), -1):
        inside = made.members == regime
        if not inside.any():
            continue
        colour = _FAILED if regime < 0 else colour_at(regime)
        lines.append(
            Line(_label(made, regime), across[inside], along[inside], colour, max(regime, 0), str(regime), joined=False)
        )
    x, y = (Quantity(path, unit) for path, unit in zip(paths, units, strict=True))
    starts = number(made.members.size)
    counts = plural(
        "{count} regime from {starts} starts", "{count} regimes from {starts} starts", len(made.values), starts=starts
    )
    return Figure(x, (Panel(y, tuple(lines)),), family=(Quantity(counts, "1"),))


def _label(made: Basin, regime: int) -> str:
    """Share, mean speed and order of a regime."""
    if regime < 0:
        return Phrase("not ended ok")
    row = dict(zip(made.names, made.values[regime].tolist(), strict=True))
    order = row["regime.order"]
    periods = Phrase("without an orbit") if np.isnan(order) else Phrase("order {order}", order=int(order))
    share = f"{number(100.0 * row['regime.share'], 3)} %"
    return joined(", ", (f"{regime}: {share}", Amount(row["shaft.speed.mean"], "rad/s", 4), periods))
