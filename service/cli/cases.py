"""``sprag cases``: the finished cases of a study of a running service, optionally of one ending, regime or flag."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice
from typing import Annotated, Any

import typer

from sprag.service.cli.console import WrongInputError, show_table, write_json
from sprag.service.cli.options import DEFAULT_SERVER, JsonFlag, Server, StudyId, Token
from sprag.service.cli.remote import connection
from sprag.service.faults import Fault

#: Most cases of one request.
_PAGE = 500


def cases(
    study_id: StudyId,
    ending: Annotated[
        str | None, typer.Option("--ending", metavar="ENDING", help="Only cases with this ending.")
    ] = None,
    regime: Annotated[
        str | None, typer.Option("--regime", metavar="REGIME", help="Only cases of this regime, of a settled study.")
    ] = None,
    flag: Annotated[str | None, typer.Option("--flag", metavar="FLAG", help="Only cases with this flag.")] = None,
    result: Annotated[
        list[str] | None, typer.Option("--result", metavar="RESULT", help="Result to show; may be repeated.")
    ] = None,
    limit: Annotated[int, typer.Option(min=1, max=100_000, help="Most cases to show.")] = 50,
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """List finished cases of a study, in order of their numbers."""
    from sprag.service.client.queries import case_query

    with connection(server, token) as client:
        query = [*case_query(ending, regime, flag), ("page_size", str(min(limit, _PAGE)))]
        found = list(islice(client.cases(study_id, query), limit))
    if as_json:
        write_json({"cases": found})
    elif found:
        _show(found, result or ())
    else:
        show_table("", (("case", True), ("ending", False)), ())


def _show(found: Sequence[dict[str, Any]], results: Sequence[str]) -> None:
    """A row for each case: its parameters, how it ended, its regime and flags, and the chosen results."""
    first = found[0]
    unknown = [name for name in results if name not in first["results"]]
    if unknown:
        allowed = ", ".join(first["results"])
        faults = [Fault("--result", "unknown-name", "is not a result", name, allowed) for name in unknown]
        raise WrongInputError("invalid-parameter", "invalid option", faults)
    kinds = [name for name in ("regime", "regime.order") if name in first["results"] and name not in results]
    columns = [("case", True), *((path, True) for path in first["parameters"]), ("ending", False), ("flags", False)]
    columns += [(name, name not in kinds[:1]) for name in (*kinds, *results)]
    rows = (
        (
            case["case"],
            *case["parameters"].values(),
            case["ending"],
            ", ".join(case["flags"]),
            *(case["results"][name] for name in (*kinds, *results)),
        )
        for case in found
    )
    show_table("", columns, rows)
