"""``sprag explore``: cases of a running service chosen by ranges and kinds, sorted over all rows."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from sprag.service.cli.console import Column, say, show_table, write_json
from sprag.service.cli.files import write_pieces
from sprag.service.cli.options import DEFAULT_SERVER, JsonFlag, Server, StudyId, Token
from sprag.service.cli.pictures import file_format, heading
from sprag.service.cli.remote import connection
from sprag.worker.limits import MAX_SELECTED


def explore(
    study_id: StudyId,
    where: Annotated[
        list[str] | None,
        typer.Option("--where", metavar="RANGE", help='Range such as "shaft.load <= 2 N*m"; may be repeated.'),
    ] = None,
    sort: Annotated[
        str, typer.Option("--sort", metavar="NAME", help='Parameter or result; "-NAME": from the largest down.')
    ] = "case",
    limit: Annotated[
        int, typer.Option("--limit", min=1, max=MAX_SELECTED, metavar="N", help="Most cases to show.")
    ] = 20,
    show: Annotated[
        list[str] | None, typer.Option("--show", metavar="NAME", help="Quantity to show; may be repeated.")
    ] = None,
    ending: Annotated[str | None, typer.Option("--ending", metavar="ENDING", help="Only with this ending.")] = None,
    regime: Annotated[str | None, typer.Option("--regime", metavar="REGIME", help="Only of this regime.")] = None,
    flag: Annotated[str | None, typer.Option("--flag", metavar="FLAG", help="Only with this flag.")] = None,
    file: Annotated[
        str | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help=f"File to write: .csv, the selection, at most {MAX_SELECTED:,} cases.",
        ),
    ] = None,
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """Show the cases within ranges of parameters and results, sorted over all rows."""
    from sprag.service.client.queries import explore_query

    form = None if file is None else file_format(file, ("csv",), "table")
    query = explore_query(where or (), sort, None, show or (), ending, regime, flag)
    with connection(server, token) as client:
        found = client.explore(study_id, [*query, ("limit", str(limit))])
        if file is not None and form is not None:
            write_pieces(file, client.explore_file(study_id, [*query, ("limit", str(MAX_SELECTED)), ("format", form)]))
    if as_json:
        write_json(found)
    else:
        _show(found)
    if file is not None:
        cut = f", the first {MAX_SELECTED:,} cases of the selection" if found["selected"] > MAX_SELECTED else ""
        say(f"table: {file}{cut}")


def _show(found: dict[str, Any]) -> None:
    """A line for each case in its order."""
    units = {item["name"]: item["unit"] for item in found["quantities"]}
    columns: list[Column] = [("case", True), *((heading(name, unit), True) for name, unit in units.items())]
    columns += [("ending", False), ("regime", False), ("flags", False)]
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
    show_table(f"{found['selected']} of {found['known']} cases", columns, rows)
