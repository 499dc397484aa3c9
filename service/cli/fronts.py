"""``sprag front``: the designs of a study with a goal."""

from __future__ import annotations

from itertools import chain
from typing import Annotated, Any

import typer

from sprag.service.cli.console import say, show_table, write_json
from sprag.service.cli.file_formats import file_format
from sprag.service.cli.files import write_pieces
from sprag.service.cli.names import study_of
from sprag.service.cli.options import DEFAULT_SERVER, JsonFlag, Server, StudyId, Token
from sprag.service.cli.pictures import heading
from sprag.service.cli.remote import connection
from sprag.service.languages import _

#: Designs of a file: every one.
_EVERY = 1_000_000


def front(
    study_id: StudyId,
    limit: Annotated[int, typer.Option("--limit", min=1, metavar="N", help="Most designs, the best first.")] = 20,
    exact: Annotated[
        bool, typer.Option("--exact", help="Designs must meet equalities to 1e-6 to be feasible.")
    ] = False,
    file: Annotated[
        str | None, typer.Option("-o", "--output", metavar="FILE", help="File to write: .csv, with all designs.")
    ] = None,
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """Show the best designs of a study with a goal: goals, variables, results of limits."""
    form = None if file is None else file_format(file, ("csv",))
    with connection(server, token) as client:
        study_id = study_of(client, study_id)
        query = [("exact", str(exact).lower())]
        found = client.front(study_id, [*query, ("limit", str(limit))])
        if file is not None and form is not None:
            write_pieces(file, client.front_file(study_id, [*query, ("limit", str(_EVERY)), ("format", form)]))
    if as_json:
        write_json(found)
    else:
        _show(found)
    if file is not None:
        say(_("table: {file}", file=file))


def _show(found: dict[str, Any]) -> None:
    """A line for each design, the best first."""
    counts = found["counts"]
    parts = [
        _("{count} designs", count=counts["known"]),
        _("{count} feasible", count=counts["feasible"]),
        _("{count} on the front", count=counts["front"]),
    ]
    if counts["pending"]:
        parts.append(_("{count} still to be run", count=counts["pending"]))
    columns = [(name, True) for name in (_("design"), _("case"))]
    columns += [(_lines(goal["result"], goal["unit"]), True) for goal in found["best"]]
    columns += [(_lines(one["name"], one["unit"]), True) for one in found["variables"]]
    limited, points = _limited(found), len(found["at"])
    columns += [
        (_lines(name if points == 1 else _("{name} at {number}", name=name, number=number), unit), True)
        for name, unit in limited.items()
        for number in range(1, points + 1)
    ]
    rows = [
        (
            design["design"],
            design["cases"][0],
            *design["goals"].values(),
            *design["variables"].values(),
            *chain.from_iterable(design["results"][name] for name in limited),
            *(design[name] for name in ("feasible", "exact", "rank")),
            ", ".join(dict.fromkeys([*filter(None, design["regimes"] or ()), *design["flags"]])),
        )
        for design in found["designs"]
    ]
    columns += [(_("feasible"), False), (_("exact"), False), (_("rank"), True), (_("motion"), False)]
    show_table(", ".join(parts), columns, rows)


def _limited(found: dict[str, Any]) -> dict[str, str]:
    """Names and units of the results of limits; without those that the columns of goals show."""
    goals = {goal["result"] for goal in found["best"]} if len(found["at"]) == 1 else ()
    return {limit["result"]: limit["unit"] for limit in found["subject_to"] if limit["result"] not in goals}


def _lines(name: str, unit: str) -> str:
    """The heading of a narrow column: a line for each part of the name, and one for the unit."""
    return heading(name, unit).replace(".", ".\n").replace(" ", "\n")
