"""``sprag cases``: the finished cases of a study of a running service, chosen and sorted."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Any

import typer

from sprag_study.service.cli import completion
from sprag_study.service.cli.compare import pair
from sprag_study.service.cli.console import WrongInputError, show_table, write_json
from sprag_study.service.cli.names import study_of
from sprag_study.service.cli.options import DEFAULT_SERVER, JsonFlag, OfEnding, OfFlag, OfRegime, Server, StudyId, Token
from sprag_study.service.cli.remote import connection
from sprag_study.service.cli.shown import heading
from sprag_study.service.faults import Fault
from sprag_study.service.languages import N_, _

#: Most cases of one request.
_PAGE = 500


def cases(
    study_id: StudyId,
    ending: OfEnding = None,
    regime: OfRegime = None,
    flag: OfFlag = None,
    where: Annotated[
        list[str] | None,
        typer.Option("--where", metavar="RANGE", help="Range such as 'efficiency >= 0.5'; may be repeated."),
    ] = None,
    at: Annotated[
        list[str] | None, typer.Option("--at", metavar="PATH=VALUE", help="Only this value of an axis.")
    ] = None,
    sort: Annotated[
        str | None,
        typer.Option(
            "--sort",
            metavar="NAME",
            help="Parameter, result, case, ending, regime or flags; -NAME: largest first.",
            autocompletion=completion.sortings,
        ),
    ] = None,
    result: Annotated[
        list[str] | None,
        typer.Option(
            "--result", metavar="RESULT", help="Result to show; may be repeated.", autocompletion=completion.results
        ),
    ] = None,
    limit: Annotated[int, typer.Option(min=1, max=100_000, help="Most cases to show.")] = 50,
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """List finished cases of a study, in order of their numbers or sorted over all of them."""
    from sprag_study.service.client.queries import query_of
    from sprag_study.service.client.wire import study_path

    held = dict(pair(text) for text in at or ())
    with connection(server, token) as client:
        study_id = study_of(client, study_id)
        chosen = {"ending": ending, "regime": regime, "flag": flag, "where": where, "at": held, "sort": sort}
        query = query_of({**chosen, "page_size": min(limit, _PAGE)})
        found, units = _first(client.pages(f"{study_path(study_id)}/cases", query), limit)
    if as_json:
        write_json({"cases": found})
    elif found:
        _show(found, result or (), units)
    else:
        show_table("", ((_("case"), True), (_("ending"), False)), ())


def _first(pages: Iterable[dict[str, Any]], limit: int) -> tuple[list[dict[str, Any]], dict[str, str]]:
    """At most ``limit`` cases, and the units of their columns."""
    found: list[dict[str, Any]] = []
    units: dict[str, str] = {}
    for page in pages:
        found, units = [*found, *page["cases"]], page.get("units", {})  # an older service has none
        if len(found) >= limit:
            break
    return found[:limit], units


def _show(found: Sequence[dict[str, Any]], results: Sequence[str], units: Mapping[str, str]) -> None:
    """A row for each case: its parameters, how it ended, its regime and flags, and the chosen results."""
    first = found[0]
    unknown = [name for name in results if name not in first["results"]]
    if unknown:
        allowed = ", ".join(first["results"])
        faults = [Fault("--result", "unknown-name", N_("is not a result"), name, allowed) for name in unknown]
        raise WrongInputError("invalid-parameter", _("invalid option"), faults)
    kinds = [name for name in ("regime", "regime.order") if name in first["results"] and name not in results]
    columns = [(_("case"), True), *((heading(path, units.get(path, "1")), True) for path in first["parameters"])]
    columns += [(_("ending"), False), (_("flags"), False)]
    columns += [(heading(name, units.get(name, "1")), name not in kinds[:1]) for name in (*kinds, *results)]
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
