"""A described figure as a reader wants it: in the reader's units and words. Both painters draw the result."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from sprag_study.service.figures.figure import Quantity

if TYPE_CHECKING:
    from sprag_study.service.figures.figure import Band, Figure, Fill, Line, Marks, Note, Panel
    from sprag_study.service.reading.reader import Reading
    from sprag_study.service.results.curves import Map


def read_figure(figure: Figure, reading: Reading) -> Figure:
    """The figure, whose numbers are SI, in the reader's units, with captions for names."""
    x = figure.x.unit
    return replace(
        figure,
        x=_quantity(figure.x, reading),
        panels=tuple(_panel(panel, x, reading) for panel in figure.panels),
        family=tuple(_quantity(item, reading) for item in figure.family),
        held=tuple(map(reading.say, figure.held)),
        spans={
            reading.say(row): tuple((s, reading.value(low, x), reading.value(high, x)) for s, low, high in spans)
            for row, spans in figure.spans.items()
        },
        states=reading.say(figure.states),
        heading=reading.say(figure.heading),
        scale=figure.scale and reading.say_name(figure.scale),
        note=reading.say(figure.note),
        below=reading.say(figure.below),
        at=None if figure.at is None else reading.value(figure.at, x),
    )


def read_map(drawn: Map, reading: Reading) -> Map:
    """The map, whose numbers are SI, in the reader's units, with captions for names."""
    (x, y), z = drawn.units, drawn.result.unit
    refined = drawn.refined and replace(
        drawn.refined,
        x=reading.units.values(drawn.refined.x, x),
        y=reading.units.values(drawn.refined.y, y),
        values=reading.units.values(drawn.refined.values, z),
    )
    return replace(
        drawn,
        units=(reading.unit(x), reading.unit(y)),
        names=(reading.say_name(drawn.names[0]), reading.say_name(drawn.names[1])),
        held=tuple(map(reading.say, drawn.held)),
        x_values=tuple(reading.value(value, x) for value in drawn.x_values),
        y_values=tuple(reading.value(value, y) for value in drawn.y_values),
        values=reading.units.values(drawn.values, z),
        result=replace(drawn.result, unit=reading.unit(z)),
        title=reading.say_name(drawn.title or drawn.result.name),
        refined=refined,
    )


def _quantity(quantity: Quantity, reading: Reading) -> Quantity:
    return Quantity(quantity.name and reading.say_name(quantity.name), reading.unit(quantity.unit))


def _panel(panel: Panel, across: str, reading: Reading) -> Panel:
    x, y = (panel.x.unit if panel.x else across), panel.y.unit
    return replace(
        panel,
        x=panel.x and _quantity(panel.x, reading),
        y=_quantity(panel.y, reading),
        lines=tuple(_line(line, x, y, reading) for line in panel.lines),
        marks=tuple(_marks(marks, x, y, reading) for marks in panel.marks),
        bands=tuple(_band(band, x, reading) for band in panel.bands),
        fills=tuple(_fill(fill, x, y, reading) for fill in panel.fills),
        notes=tuple(_note(note, x, y, reading) for note in panel.notes),
    )


def _line(line: Line, x: str, y: str, reading: Reading) -> Line:
    name, heading = reading.say(line.name), reading.say(line.heading)
    return replace(
        line, name=name, heading=heading, x=reading.units.values(line.x, x), y=reading.units.values(line.y, y)
    )


def _marks(marks: Marks, x: str, y: str, reading: Reading) -> Marks:
    return replace(marks, x=reading.units.values(marks.x, x), y=reading.units.values(marks.y, y))


def _band(band: Band, x: str, reading: Reading) -> Band:
    return replace(band, low=reading.value(band.low, x), high=reading.value(band.high, x))


def _fill(fill: Fill, x: str, y: str, reading: Reading) -> Fill:
    low, high = reading.units.values(fill.low, y), reading.units.values(fill.high, y)
    return replace(fill, name=reading.say(fill.name), x=reading.units.values(fill.x, x), low=low, high=high)


def _note(note: Note, x: str, y: str, reading: Reading) -> Note:
    return replace(note, x=reading.value(note.x, x), y=reading.value(note.y, y), text=reading.say(note.text))
