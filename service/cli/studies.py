"""Commands about the list of studies: search and sort it; name, tag, archive, delete and restore studies."""

from __future__ import annotations

from itertools import islice
from typing import Annotated, Final

import typer

from sprag_study.service.answers.studies import StudyOrder
from sprag_study.service.cli import completion
from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.console import show_table, table_words, time_text, write_json
from sprag_study.service.cli.remote import connection
from sprag_study.service.languages import _
from sprag_study.worker.states import StudyState

#: Most studies of one request.
_PAGE: Final = 100


def list_studies(
    search: Annotated[
        str | None,
        typer.Argument(metavar="[WORDS]", help="Words that occur in the name, the notes, the tags or the id."),
    ] = None,
    state: Annotated[StudyState | None, typer.Option(help="Only studies in this state.")] = None,
    tag: Annotated[str | None, typer.Option("--tag", metavar="TAG", help="Only studies with this tag.")] = None,
    owner: Annotated[str | None, typer.Option("--owner", metavar="USER", help="Only studies of this user.")] = None,
    model: Annotated[
        str | None,
        typer.Option("--model", metavar="MODEL", help="Only studies of this model.", autocompletion=completion.models),
    ] = None,
    archived: Annotated[bool, typer.Option("--archived", help="Only archived studies.")] = False,
    deleted: Annotated[bool, typer.Option("--deleted", help="Only deleted studies that can be restored.")] = False,
    sort: Annotated[StudyOrder | None, typer.Option("--sort", help="Order of the list; default: newest.")] = None,
    limit: Annotated[int, typer.Option(min=1, max=100_000, help="Most studies to show.")] = 50,
) -> None:
    """List the studies of the service, newest first, or those that are searched for."""
    words = {"search": search, "tag": tag, "owner": owner, "model": model, "sort": sort and sort.value}
    query = [("page_size", str(min(limit, _PAGE)))]
    query += [] if state is None else [("state", state.value)]
    query += [(name, value) for name, value in words.items() if value is not None]
    query += [(name, "true") for name, chosen in (("archived", archived), ("deleted", deleted)) if chosen]
    with connection() as client:
        studies = list(islice(client.items("/studies", "studies", query), limit))
    if wants_json():
        write_json({"studies": studies})
        return
    with table_words():
        last = _("restorable until") if deleted else _("finish by")
        columns = ((_("id"), False, True), (_("state"), False, True), (_("done"), True), (_("cases"), True),
                   (_("created"), False), (last, False), (_("name"), False), (_("tags"), False))  # fmt: skip
        rows = [
            (
                *(s["id"], s["state"], s["progress"]["done"], s["progress"]["total"], time_text(s["created_at"])),
                *(time_text(s["purge_at" if deleted else "finish_by"]), s["name"], ", ".join(s["tags"])),
            )
            for s in studies
        ]
        show_table("", columns, rows)
