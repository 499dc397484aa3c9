"""A calibration as a described figure: measured points on the fitted curves with their intervals, and residuals."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.service.figures.figure import Figure, Line, Panel, Quantity, line_colours
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.reader import Phrase, joined
from sprag_study.service.reading.wording import number
from sprag_study.worker.planning.calibrate.candidates import along, groups

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sprag_study.service.results.calibration import Calibration
    from sprag_study.worker.arrays import Floats, Ints

_NOTHING: Final = Phrase("The first fit has not ended yet.")
#: Dashes of a fitted curve, and of the ends of its intervals.
_SOLID, _DOTTED = 0, 2


def calibration_figure(found: Calibration, columns: int = 2) -> Figure:
    """For each measured result a panel with the points, the fit and its 95 % intervals, and one with the residuals."""
    plan = found.plan
    x = along(plan)
    across = Quantity(Phrase("measured value"), "1") if x is None else _quantity(found, plan.paths_at[x])
    panels: list[Panel] = []
    for column, name in enumerate(plan.results):
        info = found.infos[name]
        panels.append(Panel(Quantity(name, info.unit), tuple(_fit_lines(found, column)), x=across))
        panels.append(
            Panel(Quantity(Phrase("residual"), "standard deviations"), tuple(_residuals(found, column)), x=across)
        )
    family = tuple(_quantity(found, path) for index, path in enumerate(plan.paths_at) if index != x)
    return Figure(across, tuple(panels), columns=columns, family=family, note="" if found.answer else _NOTHING)


def _quantity(found: Calibration, path: str) -> Quantity:
    return Quantity(path, unit_of(found.study, path))


def _places(found: Calibration, rows: Ints) -> Floats:
    """Where measured values are drawn: at their condition, or by their number where there is none."""
    x = along(found.plan)
    if x is None:
        return rows.astype(np.float64) + 1.0
    column: Floats = found.plan.at[found.plan.places[0][rows], x]
    return column


def _curves(found: Calibration, column: int) -> Iterator[tuple[int, str, str, Ints]]:
    """Number, name, colour and measured values of each curve."""
    values, which = groups(found.plan)
    conditions, columns = found.plan.places
    for curve, colour in enumerate(line_colours(len(values))):
        rows = np.flatnonzero((columns == column) & (which[conditions] == curve))
        name = ", ".join(number(value) for value in values[curve].tolist())
        yield curve, name, colour, rows


def _named(what: Phrase, curve: str) -> Phrase:
    """A line of a curve: its values first."""
    return joined(" ", (curve, what)) if curve else what


def _fit_lines(found: Calibration, column: int) -> Iterator[Line]:
    known, x = found.answer, along(found.plan)
    values, _ = groups(found.plan)
    for curve, name, colour, rows in _curves(found, column):
        key = str(curve)
        if known is not None and known.curve is not None and known.others is not None and x is not None:
            own = np.flatnonzero((np.delete(known.others, x, axis=1) == values[curve]).all(axis=1))
            places = known.others[own, x]
            yield Line(
                _named(Phrase("fit"), name),
                places,
                known.curve[own, column],
                colour,
                _SOLID,
                key,
                listed=column == 0,
            )
            ends = () if known.ribbon is None else known.ribbon[own, column].T
            for end in ends:
                yield Line("95 %", places, end, colour, _DOTTED, key, listed=False)
        yield Line(
            _named(Phrase("measured"), name), _places(found, rows), found.plan.values[rows], colour, key=key,
            listed=column == 0, joined=False,
        )  # fmt: skip


def _residuals(found: Calibration, column: int) -> Iterator[Line]:
    known = found.answer
    for curve, name, colour, rows in _curves(found, column):
        values = np.full(len(rows), np.nan) if known is None else known.residuals[rows]
        yield Line(
            _named(Phrase("measured"), name), _places(found, rows), values, colour, key=str(curve), listed=False,
            joined=False,
        )  # fmt: skip
