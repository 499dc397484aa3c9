"""``sprag explore`` and ``select``: cases of a running service chosen by ranges and kinds, shown or as a new study."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from sprag.service.cli import completion
from sprag.service.cli.console import Column, say, show_table, write_json
from sprag.service.cli.file_formats import file_format
from sprag.service.cli.files import write_pieces
from sprag.service.cli.following import submitted, submitting
from sprag.service.cli.names import study_of
from sprag.service.cli.options import (
    DEFAULT_SERVER,
    FileUnits,
    JsonFlag,
    OfEnding,
    OfFlag,
    OfRegime,
    Server,
    StudyId,
    Token,
    Wait,
    WaitTimeout,
    in_units,
)
from sprag.service.cli.pictures import heading
from sprag.service.cli.remote import connection
from sprag.service.languages import _
from sprag.worker.limits import MAX_POINTS_SELECTED, MAX_SELECTED

Where = Annotated[
    list[str] | None,
    typer.Option("--where", metavar="RANGE", help='Range such as "shaft.load <= 2 N*m"; may be repeated.'),
]
Sort = Annotated[
    str,
    typer.Option(
        "--sort",
        metavar="NAME",
        help='Parameter or result; "-NAME": from the largest down.',
        autocompletion=completion.sortings,
    ),
]


def select(
    study_id: StudyId,
    where: Where = None,
    sort: Sort = "case",
    limit: Annotated[
        int, typer.Option("--limit", min=1, max=MAX_POINTS_SELECTED, metavar="N", help="Most cases of the new study.")
    ] = 50,
    ending: OfEnding = None,
    regime: OfRegime = None,
    flag: OfFlag = None,
    wait: Wait = False,
    timeout: WaitTimeout = None,
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """Submit a study of the first cases within ranges of parameters and results, as points."""
    from sprag.service.client.queries import explore_query

    query = explore_query(where or (), sort, limit, (), ending, regime, flag)
    with connection(server, token) as client:
        study_id = study_of(client, study_id)
        with submitting():
            study = client.select(study_id, query)
        submitted(client, study, wait, timeout, as_json)


def explore(
    study_id: StudyId,
    where: Where = None,
    sort: Sort = "case",
    limit: Annotated[
        int, typer.Option("--limit", min=1, max=MAX_SELECTED, metavar="N", help="Most cases to show.")
    ] = 20,
    show: Annotated[
        list[str] | None,
        typer.Option(
            "--show", metavar="NAME", help="Quantity to show; may be repeated.", autocompletion=completion.quantities
        ),
    ] = None,
    ending: OfEnding = None,
    regime: OfRegime = None,
    flag: OfFlag = None,
    file: Annotated[
        str | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help=f"File to write: .csv, the selection, at most {MAX_SELECTED:,} cases.",
        ),
    ] = None,
    units: FileUnits = None,
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """Show the cases within ranges of parameters and results, sorted over all rows."""
    from sprag.service.client.queries import explore_query

    form = None if file is None else file_format(file, ("csv",))
    query = explore_query(where or (), sort, None, show or (), ending, regime, flag)
    with connection(server, token) as client:
        study_id = study_of(client, study_id)
        found = client.explore(study_id, [*query, ("limit", str(limit))])
        if file is not None and form is not None:
            asked = [*query, ("limit", str(MAX_SELECTED)), *in_units(units), ("format", form)]
            write_pieces(file, client.explore_file(study_id, asked))
    if as_json:
        write_json(found)
    else:
        _show(found)
    if file is not None:
        say(
            _("table: {file}, the first {count} cases of the selection", file=file, count=f"{MAX_SELECTED:,}")
            if found["selected"] > MAX_SELECTED
            else _("table: {file}", file=file)
        )


def _show(found: dict[str, Any]) -> None:
    """A line for each case in its order."""
    units = {item["name"]: item["unit"] for item in found["quantities"]}
    columns: list[Column] = [(_("case"), True), *((heading(name, unit), True) for name, unit in units.items())]
    columns += [(_("ending"), False), (_("regime"), False), (_("flags"), False)]
    rows = [
        (
            case["case"],
            *({**case["parameters"], **case["results"]}.get(name) for name in units),
            case["ending"],
            case["regime"] or "",
            ", ".join(case["flags"]),
        )
        for case in found["cases"]
    ]
    show_table(_("{selected} of {known} cases", selected=found["selected"], known=found["known"]), columns, rows)
