"""Ribbons and yields as descriptions of figures, and as maps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import Name
from sprag_study.service.faults import refused
from sprag_study.service.figures.figure import Figure, Fill, Line, Panel, Quantity, line_colours
from sprag_study.service.reading.reader import Phrase, joined, plural
from sprag_study.service.results.curves import Map
from sprag_study.service.results.sweeps import values_text
from sprag_study.service.results.tolerances.written import percent
from sprag_study.worker.models import ResultInfo

if TYPE_CHECKING:
    from sprag_study.service.results.tolerances.batch import Places
    from sprag_study.service.results.tolerances.ribbons import Ribbon, RibbonLine
    from sprag_study.service.results.tolerances.yields import Yield
    from sprag_study.worker.arrays import Floats

_NOTHING: Final = Phrase("No drive has this result yet.")
#: Dashes of the nominal drive, and of quantiles other than that in the middle.
_NOMINAL: Final = 1
_OTHERS: Final = 2


def ribbon_figure(found: Ribbon, columns: int = 1) -> Figure:
    """A panel for each result: bands from the lowest to the highest quantile, the middle one, the nominal drive."""
    places = found.places
    if places.x is None:
        return _distributions(found, columns)
    colours = line_colours(len(found.lines))
    x = Quantity(places.names[places.x], places.units[places.x])
    panels = []
    for index, info in enumerate(found.results):
        parts = list(zip(found.lines, colours, strict=True))
        lines = [
            line
            for at, (one, colour) in enumerate(parts)
            for line in _lines(found, one, info.name, colour, str(at), listed=index == 0)
        ]
        fills = tuple(
            _fill(found, one, info.name, colour, str(at), listed=index == 0) for at, (one, colour) in enumerate(parts)
        )
        panels.append(Panel(Quantity(info.name, info.unit), tuple(lines), fills=fills))
    known = any(np.isfinite(spread.quantiles.values).any() for one in found.lines for spread in one.spreads.values())
    return Figure(
        x,
        tuple(panels),
        columns,
        _family(places),
        held=places.held,
        note="" if known else _NOTHING,
        below=_legend(found),
    )


def _family(places: Places) -> tuple[Quantity, ...]:
    return tuple(Quantity(places.names[path], places.units[path]) for path in places.lines[0].by)


def _legend(found: Ribbon) -> str:
    """What band and lines are."""
    low, high = percent(found.probabilities[0]), percent(found.probabilities[-1])
    middle = percent(found.probabilities[_middle(found)])
    drives = plural("{count} drive", "{count} drives", found.places.study.drives)
    failed = max(int(one.failed.max(initial=0)) for one in found.lines)
    label = Phrase(
        "Solid: {middle} quantile of {drives}; band: {low} to {high}; dashed: the nominal drive.",
        middle=middle,
        drives=drives,
        low=low,
        high=high,
    )
    if not failed:
        return label
    without = Phrase("Drives without a result (failed or unsettled) at a place: up to {count}.", count=failed)
    return joined(" ", (label, without))


def _middle(found: Ribbon) -> int:
    return int(np.argmin(np.abs(np.array(found.probabilities) - 0.5)))


def _lines(found: Ribbon, one: RibbonLine, name: str, colour: str, key: str, *, listed: bool) -> Iterator[Line]:
    spread, x = one.spreads[name], np.array(one.line.x)
    values = values_text(one.line.by, found.places.units)
    middle = _middle(found)
    for index, probability in enumerate(found.probabilities):
        own = index == middle
        if own or 0 < index < len(found.probabilities) - 1:
            text = values or percent(probability)
            style = 0 if own else _OTHERS
            yield Line(
                text, x, spread.quantiles.values[index], colour, style, key, listed=listed and (own or not values)
            )
    named = Phrase("{curve} nominal", curve=values) if values else Phrase("nominal")
    yield Line(
        named, x, spread.nominal, colour, _NOMINAL, key, listed=listed and not values,
        cases=one.line.cases,
    )  # fmt: skip


def _fill(found: Ribbon, one: RibbonLine, name: str, colour: str, key: str, *, listed: bool) -> Fill:
    values = one.spreads[name].quantiles.values
    low, high = percent(found.probabilities[0]), percent(found.probabilities[-1])
    text = Phrase("{low} to {high}", low=low, high=high)
    return Fill(text, np.array(one.line.x), values[0], values[-1], colour, key, listed=listed and not one.line.by)


def _distributions(found: Ribbon, columns: int) -> Figure:
    """At a single place: the share of drives below each value, for every result."""
    one = found.lines[0]
    shares = np.arange(1, 200) / 200.0
    panels = []
    for index, info in enumerate(found.results):
        spread = one.spreads[info.name]
        values = np.full(shares.size, np.nan) if spread.distribution is None else spread.distribution
        nominal = np.repeat(spread.nominal, 2)
        lines = (
            Line(Phrase("drives"), values, shares, line_colours(1)[0], key="0", listed=index == 0),
            Line(
                Phrase("nominal drive"),
                nominal,
                np.array([0.0, 1.0]),
                line_colours(2)[1],
                _NOMINAL,
                "1",
                listed=index == 0,
            ),
        )
        panels.append(Panel(Quantity(Phrase("share of drives below"), "1"), lines, x=Quantity(info.name, info.unit)))
    known = any(np.isfinite(spread.quantiles.values).any() for spread in one.spreads.values())
    return Figure(
        panels[0].x or Quantity("", "1"), tuple(panels), columns, held=found.places.held, note="" if known else _NOTHING
    )


def yield_figure(found: Yield) -> Figure:
    """The yield along each line with its interval."""
    places = found.places
    if places.x is None:
        raise refused("x", "required", "a single place has one yield and no picture", allowed="an axis")
    colours = line_colours(len(found.lines))
    lines, fills = [], []
    for at, (one, colour) in enumerate(zip(found.lines, colours, strict=True)):
        x, text = np.array(one.line.x), values_text(one.line.by, places.units)
        share = one.each
        fills.append(
            Fill(Phrase("95 % interval"), x, 100.0 * share.low, 100.0 * share.high, colour, str(at), listed=not text)
        )
        lines.append(Line(text or Phrase("yield"), x, 100.0 * share.value, colour, key=str(at), cases=one.line.cases))
    known = any(np.isfinite(one.each.value).any() for one in found.lines)
    panel = Panel(Quantity(Phrase("yield"), "%"), tuple(lines), fills=tuple(fills))
    wanted = joined(", ", (condition.text for condition in found.conditions))
    return Figure(
        Quantity(places.names[places.x], places.units[places.x]),
        (panel,),
        family=_family(places),
        held=places.held,
        note="" if known else _NOTHING,
        below=Phrase("Drives of {count} with {conditions}.", count=places.study.drives, conditions=wanted),
    )


def batch_figure(found: Ribbon, reached: Yield | None) -> Figure:
    """The quantiles of results, and below them the yield over the same axis, where there is an axis and a yield."""
    figure = replace(ribbon_figure(found), below="")
    if reached is None or reached.places.x is None:
        return figure
    (panel,) = yield_figure(reached).panels
    lines = tuple(replace(line, listed=False) for line in panel.lines)
    fills = tuple(replace(fill, listed=False) for fill in panel.fills)
    good = replace(panel, y=Quantity(Phrase("yield, with its 95 % interval"), "%"), lines=lines, fills=fills)
    return replace(figure, panels=(*figure.panels, good))


def ribbon_map(found: Ribbon, probability: float) -> Map:
    """A quantile of one result over x and the axis of the lines; raises SelectionError where there is no such axis."""
    if len(found.results) != 1:
        raise refused("y", "too-many", "a map shows one result", [info.name for info in found.results])
    info, index = found.results[0], found.probabilities.index(probability)
    values = [one.spreads[info.name].quantiles.values[index] for one in found.lines]
    label = Phrase("{name}, {share} quantile", name=Name(info.name), share=percent(probability))
    return replace(_map(found.places, info, np.array(values)), title=label)


def yield_map(found: Yield) -> Map:
    """The yield over x and the axis of the lines; raises SelectionError where there is no such axis."""
    shown = ResultInfo("yield", "%", " and ".join(condition.text for condition in found.conditions))
    return _map(found.places, shown, 100.0 * np.array([one.each.value for one in found.lines]))


def _map(places: Places, shown: ResultInfo, values: Floats) -> Map:
    by = list(places.lines[0].by)
    if places.x is None or len(by) != 1:
        raise refused("by", "required", "a map needs an axis x and another one", by, allowed="one axis")
    if len({line.x for line in places.lines}) > 1:
        raise refused("by", "not-a-grid", "a map needs a grid; the lines have different places", by)
    (y,), x = by, places.x
    first = places.lines[0]
    return Map(
        x,
        y,
        (places.units[x], places.units[y]),
        (places.names[x], places.names[y]),
        places.held,
        first.x,
        tuple(line.by[y] for line in places.lines),
        first.at,
        {path: places.units[path] for path in first.at},
        shown,
        np.stack([line.cases for line in places.lines]),
        values,
        [["ok"] * len(first.x) for _ in places.lines],
    )
