"""Curves of one study or of several, and the marks of a map, as descriptions of figures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import Amount, Name
from sprag_study.service.figures.figure import Band, Figure, Fill, Line, Marks, Panel, Quantity, line_colours
from sprag_study.service.figures.orders import TITLE, order_map, strip_of
from sprag_study.service.reading.reader import Phrase, joined, term
from sprag_study.service.results.joined import joined_points
from sprag_study.service.results.refined import band, jumps_of, sentence
from sprag_study.service.results.regimes import DOUBTFUL, MARKED, UNSETTLED, regimes_of
from sprag_study.service.results.sweeps import hysteresis, values_text, without_direction
from sprag_study.worker.codes import PENDING
from sprag_study.worker.directions import SWEEP
from sprag_study.worker.models import Ending, WorkerEnding

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.service.results.curves import Curve, Curves, Map
    from sprag_study.worker.models import ResultInfo

#: Most points of all lines of a panel together, and the least and the most of one line: five per column of pixels of a
#: wide picture.
_MOST_POINTS: Final = 24_000
#: Name of the points of other motions than those that the lines are of.
OTHER_MOTIONS: Final = Phrase("other motions of the same cases")
#: Name of the band around a line where the motion is irregular.
SCATTER: Final = Phrase("irregular motion: results scatter")
_LEAST_POINTS: Final = 400
_LINE_POINTS: Final = 6_000


def curves_figure(drawn: Sequence[tuple[str, Curves]], columns: int = 1, *, apart: str = "") -> Figure:
    """Curves of one study, or of several that are overlaid: a panel for each result.

    Parameters
    ----------
    drawn : pairs of label and curves
        All with the same x and the same results; one study alone has the label "".
    columns : int
        Panels side by side.
    apart : str
        Name of the parameter whose values the labels of studies are.
    """
    chosen = drawn[0][1].selection
    x = Quantity(chosen.names[chosen.x], chosen.units[chosen.x])
    lines = [(study, curve) for study, (_, curves) in enumerate(drawn) for curve in curves.curves]
    family = tuple(Quantity(chosen.names[path], chosen.units[path]) for path in chosen.lines[0].by)
    if apart and not family:
        family = (Quantity(apart, "1"),)
    occurring = tuple(regimes_of(_regimes(curve) for _, curve in lines))
    regimes = occurring if len(occurring) > 1 or set(occurring) & set(MARKED) else ()
    labels = [label for label, _ in drawn]
    panels: list[Panel] = []
    for index, info in enumerate(chosen.results):
        parts = (
            *_lines(lines, labels, info, chosen.units, listed=index == 0),
            *_further(drawn, info, listed=index == 0),
        )
        bands = tuple(_bands(lines, info)) if len(drawn) == 1 else ()
        marks = tuple(_marks(lines, info, regimes))
        known = any(panel.fills for panel in panels)
        fills = tuple(_fills(lines, info, known=known))
        panels.append(Panel(Quantity(info.name, info.unit), parts, marks, bands=bands, fills=fills))
    most = min(max(_MOST_POINTS // len(lines), _LEAST_POINTS), _LINE_POINTS)
    spans, looks = strip_of(drawn[0][1].curves, chosen.units) if len(drawn) == 1 else ({}, {})
    return Figure(
        x,
        tuple(panels),
        min(columns, len(panels)),
        family,
        len(drawn),
        regimes,
        chosen.held,
        spans,
        TITLE,
        looks,
        most=most,
        note=_nothing(drawn),
        below=_remark(drawn[0][1]) if len(drawn) == 1 else "",
    )


def _remark(curves: Curves) -> str:
    """How right refined curves are, or what a sweep up and down differ in."""
    if curves.selection.swept:
        return hysteresis(curves)
    plan, refined = curves.selection.plan, [curve.refined for curve in curves.curves if curve.refined is not None]
    return "" if plan is None else sentence(plan, refined, curves.selection.results)


def _bands(lines: Sequence[tuple[int, Curve]], info: ResultInfo) -> Iterator[Band]:
    """The jumps of refined curves and of sweeps."""
    for index, ((_, curve), colour) in enumerate(zip(lines, _colours(lines), strict=True)):
        for jump in curve.jumps or ():
            yield Band(jump["low"], jump["high"], colour, str(index))
        if curve.refined is not None:
            for jump in jumps_of(curve.refined, (info.name,)):
                yield Band(jump["low"], jump["high"], colour, str(index))


def _fills(lines: Sequence[tuple[int, Curve]], info: ResultInfo, *, known: bool) -> Iterator[Fill]:
    """The bands in which a result of refined curves scatters; the legend has the first that is not ``known`` yet."""
    for index, ((_, curve), colour) in enumerate(zip(lines, _colours(lines), strict=True)):
        if curve.refined is None:
            continue
        x, low, high = band(curve.refined, info.name)
        if x.size:
            yield Fill(SCATTER, x, low, high, colour, str(index), listed=not known)
            known = True


def _both(lines: Sequence[tuple[int, Curve]]) -> bool:
    """Whether there are curves of both directions of a sweep: dashes tell them apart."""
    return any(SWEEP in curve.line.by for _, curve in lines)


def _colours(lines: Sequence[tuple[int, Curve]]) -> list[str]:
    """The colour of each line: one for both directions of a sweep."""
    keys = [(study, without_direction(curve.line.by)) if SWEEP in curve.line.by else place
            for place, (study, curve) in enumerate(lines)]  # fmt: skip
    different = list(dict.fromkeys(keys))
    colours = line_colours(len(different))
    return [colours[different.index(key)] for key in keys]


def _lines(
    lines: Sequence[tuple[int, Curve]],
    labels: Sequence[str],
    info: ResultInfo,
    units: Mapping[str, str],
    *,
    listed: bool,
) -> Iterator[Line]:
    both = _both(lines)
    for index, ((study, curve), colour) in enumerate(zip(lines, _colours(lines), strict=True)):
        down = int({**curve.line.at, **curve.line.by}.get(SWEEP, 0.0))
        run = curve.run()
        x = np.asarray(curve.line.x)[run]
        values = values_text(curve.line.by, units)
        yield Line(
            values or labels[study],
            x,
            curve.shown(info.name)[run],
            colour,
            style=down if both else study,
            key=str(index),
            heading=labels[study] if values else "",
            listed=listed,
            cases=curve.line.cases[run],
            stretches=joined_points(curve, info.name),
            # A line needs y as a function of x; the points of a zip may go back and forth.
            joined=bool(np.all(np.diff(x) > 0.0)),
        )


def _further(drawn: Sequence[tuple[str, Curves]], info: ResultInfo, *, listed: bool) -> Iterator[Line]:
    """The other motions of cases that have several, as points in the colour of their curve."""
    curves = drawn[0][1] if len(drawn) == 1 else None
    if curves is None or not curves.further:
        return
    own = [curve.line.by for curve in curves.curves]
    colours = line_colours(len(own))
    for count, curve in enumerate(curves.further):
        index = own.index(curve.line.by)
        values = curve.shown(info.name)
        kept = np.isfinite(values)
        yield Line(
            OTHER_MOTIONS,
            np.asarray(curve.line.x)[kept],
            values[kept],
            colours[index],
            key=str(index),
            listed=listed and not count,
            cases=curve.line.cases[kept],
            joined=False,
        )


def _marks(lines: Sequence[tuple[int, Curve]], info: ResultInfo, regimes: Sequence[str]) -> Iterator[Marks]:
    """The points of each regime that occurs, except periodic ones, which have the colour of their curve."""
    for name in regimes:
        places = [
            (curve, place)
            for _, curve in lines
            for place, regime in enumerate(_regimes(curve))
            if regime == name and name in MARKED
        ]
        yield Marks(
            name,
            np.array([curve.line.x[place] for curve, place in places]),
            np.array([curve.y[info.name][place] for curve, place in places]),
            np.array([curve.line.cases[place] for curve, place in places], dtype=np.int64),
        )


def _regimes(curve: Curve) -> Sequence[str | None]:
    """The regime of each case; of runs of a given time, which have none, that of motions that had not settled."""
    if curve.regimes is not None or not curve.usable:
        return curve.regimes or ()
    # Of cases that ended ok, every result counts, or none.
    return _not_settled(curve.endings, next(iter(curve.usable.values())))


def _not_settled(endings: Sequence[str], usable: NDArray[np.bool_]) -> list[str | None]:
    return [UNSETTLED if ending == Ending.OK and not ok else None for ending, ok in zip(endings, usable, strict=True)]


def _nothing(drawn: Sequence[tuple[str, Curves]]) -> str:
    """Why there is nothing to draw, as a sentence; "" otherwise. Empty axes would have arbitrary scales."""
    curves = [curve for _, found in drawn for curve in found.curves]
    if any(not np.all(np.isnan(curve.shown(name))) for curve in curves for name in curve.y):
        return ""
    chosen = drawn[0][1].selection
    at = curves[0].line.at if curves else {}
    held = [
        Phrase("{name} = {value}", name=Name(path, within=True), value=Amount(value, chosen.units[path]))
        for path, value in at.items()
    ]
    known = held and len(drawn) == 1
    cases = Phrase("case at {place}", place=joined(", ", held)) if known else Phrase("case that is drawn here")
    endings = {ending for curve in curves for ending in curve.endings}
    if endings <= {PENDING, WorkerEnding.CANCELLED}:
        if PENDING in endings:
            return Phrase("No {case} is done yet.", case=cases)
        return Phrase("No {case} was run before the study was cancelled.", case=cases)
    others = joined(", ", map(term, sorted(endings - {PENDING, WorkerEnding.CANCELLED})))
    return Phrase("No {case} has a result; they ended with: {endings}.", case=cases, endings=others)


def map_quantities(drawn: Map) -> tuple[Quantity, Quantity, Quantity]:
    """The quantities of the axes of a map, and of its colours."""
    (x, y), (x_unit, y_unit) = drawn.names, drawn.units
    return Quantity(x, x_unit), Quantity(y, y_unit), Quantity(drawn.title or drawn.result.name, drawn.result.unit)


def doubtful_marks(drawn: Map) -> Iterator[Marks]:
    """The points of a map whose motion is not periodic; none of a map whose colours say so."""
    kinds: Sequence[Sequence[str | None]] = drawn.regimes or ()
    if drawn.regimes is None and drawn.usable is not None:
        kinds = list(map(_not_settled, drawn.endings, drawn.usable))
    for name in () if order_map(drawn) else DOUBTFUL:
        places = [
            (row, column) for row, regimes in enumerate(kinds) for column, own in enumerate(regimes) if own == name
        ]
        if places:
            rows, columns = np.array(places).T
            yield Marks(
                name, np.array(drawn.x_values)[columns], np.array(drawn.y_values)[rows], drawn.cases[rows, columns]
            )
