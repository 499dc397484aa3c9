"""``sprag answers``: what one asks of a study first."""

from __future__ import annotations

from typing import Annotated, Any

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
        found = client.answers(study_id, query)
        if file is not None and form is not None:
            drawing = [*in_units(units), *in_language(language), ("format", form)]
            write_pieces(file, client.answers_file(study_id, [*query, *drawing]))
    if as_json:
        write_json(found)
    else:
        _show(found)
    if file is not None:
        say(_("table: {file}", file=file) if form == "csv" else _("picture: {file}", file=file))


def _show(found: dict[str, Any]) -> None:
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
    for curve in found["curves"]:
        title = held_text({**curve["by"], **curve["at"]}, found["units"])
        show_table(title, columns, [_row(item) for item in (*curve["answers"], *curve["working_point"])])
    if found["overall"]:
        columns[3] = (_("case with"), False)
        rows = [
            (*row[:3], held_text(item["parameters"], found["units"]), *row[4:])
            for item in found["overall"]
            for row in [_row(item)]
        ]
        show_table(_("among all cases"), columns, rows)


def _row(item: dict[str, Any]) -> tuple[object, ...]:
    unit = "" if item["unit"] == "1" else item["unit"]
    cases = ", ".join(map(str, item["cases"]))
    value = item["value"]
    if item["above"] and value is not None:
        value = f"> {cell_text(value)}"
    return _(item["title"]), value, unit, item["x"], cases, _(item["note"]) if item["note"] else item["note"]
