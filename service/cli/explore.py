"""``sprag select``: cases of a running service as a new study; and the cases of a selection as a table."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from sprag.service.cli import completion
from sprag.service.cli.console import Column, show_table
from sprag.service.cli.following import further, submitted
from sprag.service.cli.names import study_of
from sprag.service.cli.options import (
    DEFAULT_SERVER,
    JsonFlag,
    OfEnding,
    OfFlag,
    OfRegime,
    Server,
    StudyId,
    Token,
    Wait,
    WaitTimeout,
)
from sprag.service.cli.remote import connection
from sprag.service.cli.shown import heading
from sprag.service.languages import _
from sprag.worker.limits import MAX_POINTS_SELECTED

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
        study = further(client, study_of(client, study_id), "select", params=query)
        submitted(client, study, wait, timeout, as_json)


def show_cases(found: dict[str, Any]) -> None:
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
