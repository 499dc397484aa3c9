"""``sprag answers``: what one asks of a study first."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from sprag.service.cli import completion
from sprag.service.cli.console import Column, cell_text, say, show_table, write_json
from sprag.service.cli.file_formats import file_format
from sprag.service.cli.files import write_pieces
from sprag.service.cli.names import study_of
from sprag.service.cli.options import (
    DEFAULT_SERVER,
    CurveBy,
    FileUnits,
    JsonFlag,
    PictureLanguage,
    Server,
    StudyId,
    Token,
    in_language,
    in_units,
)
from sprag.service.cli.pictures import ChosenOf, HeldAt, heading, held_text
from sprag.service.cli.remote import connection
from sprag.service.languages import _

if TYPE_CHECKING:
    from sprag.service.answers.key import AnswerValue
    from sprag.service.reading.reader import Reading

_FORMATS = ("csv", "svg", "png", "pdf")


def answers(
    study_id: StudyId,
    point: Annotated[
        str | None,
        typer.Option("--point", metavar="VALUE", help='Working point on the axis along the curves, such as "0.3 N*m".'),
    ] = None,
    x: Annotated[
        str | None,
        typer.Option(
            "--x",
            metavar="PATH",
            help="Axis along the curves; default: that of the page.",
            autocompletion=completion.parameters,
        ),
    ] = None,
    by: CurveBy = None,
    at: HeldAt = None,
    of: ChosenOf = None,
    file: Annotated[
        str | None,
        typer.Option("-o", "--output", metavar="FILE", help="Table or picture to write: .csv, .svg, .png or .pdf."),
    ] = None,
    units: FileUnits = None,
    language: PictureLanguage = None,
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """Show what one asks of a study first: no-load speed, largest power, best efficiency, stall torque."""
    form = None if file is None else file_format(file, _FORMATS)
    query = [("point", point)] if point is not None else []
    query += [("x", x)] if x is not None else []
    query += [("by", path) for path in by or ()]
    query += [*(("at", item) for item in at or ()), *(("of", item) for item in of or ())]
    with connection(server, token) as client:
        study_id = study_of(client, study_id)
        found, record = client.answers(study_id, query), client.study(study_id)
        if file is not None and form is not None:
            drawing = [*in_units(units), *in_language(language), ("format", form)]
            write_pieces(file, client.answers_file(study_id, [*query, *drawing]))
    if as_json:
        write_json(found)
    else:
        from sprag.service.reading.reader import Reading  # knows the models

        _show(found, Reading(record["model"]))
    if file is not None:
        say(_("table: {file}", file=file) if form == "csv" else _("picture: {file}", file=file))


def _show(found: dict[str, Any], reading: Reading) -> None:
    """A table for each curve: its answers and its working point; then the extremes among all cases."""
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
