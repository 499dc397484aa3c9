"""The answers of a study as tables."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sprag.service.cli.console import Column, cell_text, show_table
from sprag.service.cli.shown import heading, held_text
from sprag.service.languages import _

if TYPE_CHECKING:
    from sprag.service.answers.key import AnswerValue
    from sprag.service.reading.reader import Reading


def show_answers(found: dict[str, Any], model: str) -> None:
    """A table for each curve: its answers and its working point; then the extremes among all cases."""
    from sprag.service.reading.reader import Reading  # knows the models

    reading = Reading(model)
    x = heading(found["x"] or "", found["unit"] or "1")
    columns: list[Column] = [
        (_("answer"), False, True),
        (_("value"), True),
        (_("unit"), False),
        (x, True),
        (_("cases"), False),
        (_("note"), False),
    ]
    unit = found["unit"] or "1"
    for curve in found["curves"]:
        title = held_text({**curve["by"], **curve["at"]}, found["units"])
        every = (*curve["answers"], *curve["working_point"])
        show_table(title, columns, [_row(item, unit, reading) for item in every])
    if found["overall"]:
        columns[3] = (_("case with"), False)
        rows = [
            (*row[:3], held_text(item["parameters"], found["units"]), *row[4:])
            for item in found["overall"]
            for row in [_row(item, "1", reading)]
        ]
        show_table(_("among all cases"), columns, rows)


def _row(item: AnswerValue, x_unit: str, reading: Reading) -> tuple[object, ...]:
    from sprag.service.results.key_answer_words import note_of

    unit = "" if item["unit"] == "1" else item["unit"]
    title = reading.caption(item["title"]) if item["title"] == item["result"] else _(item["title"])
    value: object = item["value"]
    if item["above"] and item["value"] is not None:
        value = f"> {cell_text(item['value'])}"
    cases, note = ", ".join(map(str, item["cases"])), note_of(item, x_unit).said(reading)
    return title, value, unit, item["x"], cases, note
