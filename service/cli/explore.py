"""``sprag select``: cases of a running service as a new study; and the cases of a selection as a table."""

from __future__ import annotations

from typing import Annotated

import typer

from sprag_study.service.cli import completion
from sprag_study.service.cli.following import further, submitted
from sprag_study.service.cli.names import study_of
from sprag_study.service.cli.options import (
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
from sprag_study.service.cli.remote import connection
from sprag_study.worker.limits import MAX_POINTS_SELECTED

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
    from sprag_study.service.client.queries import query_of

    kinds = {"ending": ending, "regime": regime, "flag": flag}
    query = query_of({"where": where, "sort": sort, "limit": limit, **kinds})
    with connection(server, token) as client:
        study = further(client, study_of(client, study_id), "select", params=query)
        submitted(client, study, wait, timeout, as_json)
