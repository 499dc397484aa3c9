"""The curves of the main results with their answers marked on them: extremes, and the working point."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from sprag_study.sentences import Amount
from sprag_study.service.figures.curves import curves_figure
from sprag_study.service.figures.figure import Figure, Note, NoteKind, Panel
from sprag_study.service.reading.reader import Phrase

if TYPE_CHECKING:
    from sprag_study.service.results.key_answers import ReadAnswer, StudyAnswers


def answers_figure(found: StudyAnswers, columns: int = 1, *, chosen: int | None = None) -> Figure:
    """The curves of ``found``, which has some, with their answers marked; values beside those of ``chosen``.

    ``columns`` are panels side by side. Without a chosen curve, a single one has its values.
    """
    assert found.drawn is not None
    figure = curves_figure([("", found.drawn)], columns)
    if figure.note:
        return figure
    marked = chosen if chosen is not None else 0 if len(found.curves) == 1 else None
    results = found.drawn.selection.results
    panels = tuple(
        replace(panel, notes=tuple(_notes(found, panel, info.name, marked)))
        for panel, info in zip(figure.panels, results, strict=True)
    )
    return replace(figure, panels=panels, at=found.point)


def _notes(found: StudyAnswers, panel: Panel, name: str, marked: int | None) -> Iterator[Note]:
    """The marks on the lines of a panel with the result of that name."""
    colours = {line.key: line.colour for line in panel.lines}
    for place, one in enumerate(found.curves):
        colour = colours.get(str(place), "#777777")
        extremes = [item for item in one.answers if item.answer.kind in ("largest", "smallest")]
        for item in (*extremes, *one.working_point):
            if item.value is None or item.x is None or item.info.name != name:
                continue
            kind: NoteKind = "point" if item.answer.kind == "here" else item.answer.kind  # type: ignore[assignment]
            text = _text(item, found.unit) if place == marked and kind != "point" else ""
            yield Note(item.x, item.value, colour, kind, text, str(place))


def _text(item: ReadAnswer, x_unit: str) -> str:
    """The extreme, and where it is."""
    return Phrase("{value} at {x}", value=Amount(item.value, item.unit, 3), x=Amount(item.x, x_unit, 3))
