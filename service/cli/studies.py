"""Commands about the list of studies: search and sort it; name, tag, archive, delete and restore studies."""

from __future__ import annotations

import sys
from itertools import islice
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from sprag_study.service.answers.studies import StudyOrder
from sprag_study.service.cli import completion
from sprag_study.service.cli.console import confirmed, say, show_table, time_text, write_json, wrong_option
from sprag_study.service.cli.following import show_study
from sprag_study.service.cli.names import study_of
from sprag_study.service.cli.options import DEFAULT_SERVER, JsonFlag, Server, StudyId, Token
from sprag_study.service.cli.remote import act_on, connection
from sprag_study.service.faults import FaultError
from sprag_study.service.languages import N_, _
from sprag_study.worker.states import StudyState

if TYPE_CHECKING:
    from sprag_study.service.client import Client

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
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """List the studies of the service, newest first, or those that are searched for."""
    words = {"search": search, "tag": tag, "owner": owner, "model": model, "sort": sort and sort.value}
    query = [("page_size", str(min(limit, _PAGE)))]
    query += [] if state is None else [("state", state.value)]
    query += [(name, value) for name, value in words.items() if value is not None]
    query += [(name, "true") for name, chosen in (("archived", archived), ("deleted", deleted)) if chosen]
    with connection(server, token) as client:
        studies = list(islice(client.items("/studies", "studies", query), limit))
    if as_json:
        write_json({"studies": studies})
        return
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


def edit(
    study_id: StudyId,
    name: Annotated[str | None, typer.Option("--name", metavar="TEXT", help="Its new name.")] = None,
    notes: Annotated[str | None, typer.Option("--notes", metavar="TEXT", help="New notes of the study.")] = None,
    tag: Annotated[list[str] | None, typer.Option("--tag", metavar="TAG", help="Tag to add; may be repeated.")] = None,
    untag: Annotated[
        list[str] | None, typer.Option("--untag", metavar="TAG", help="Tag to remove; may be repeated.")
    ] = None,
    archived: Annotated[
        bool | None, typer.Option("--archive/--unarchive", help="Keep it out of the usual list, or not.")
    ] = None,
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """Change the name, notes and tags of a study, or archive it."""
    from sprag_study.service.client.wire import study_path

    given = {"name": name, "notes": notes, "add_tags": tag, "remove_tags": untag, "archived": archived}
    fields = {field: value for field, value in given.items() if value is not None}
    if not fields:
        allowed = "--name, --notes, --tag, --untag, --archive, --unarchive"
        raise wrong_option(
            "--name", "required", N_("no change is given"), allowed=_("at least one of {options}", options=allowed)
        )
    with connection(server, token) as client:
        study = client.request("PATCH", study_path(study_of(client, study_id)), json=fields)
    show_study(study, as_json)


def delete(
    study_id: StudyId,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask before deleting.")] = False,
    at_once: Annotated[
        bool, typer.Option("--at-once", help="Remove its results now, to make room; it cannot be restored.")
    ] = False,
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """Delete a study that has ended, or is held at its deadline; `sprag restore` undoes it for some days.

    With --at-once, one that is deleted already can be named by its whole id, as `sprag list --deleted` has it.
    """
    from sprag_study.service.client.wire import study_path

    with connection(server, token) as client:
        study = _to_delete(client, study_id, at_once=at_once)
        described = _(
            "{study} ({name}, {cases} cases)",
            study=study["id"],
            name=study["name"] or study["model"],
            cases=study["progress"]["done"],
        )
        if not yes:
            if not sys.stdin.isatty():
                detail = _("delete {what}?", what=described)
                raise wrong_option("--yes", "required", N_("is needed where nobody can be asked"), detail=detail)
            if not confirmed(_("Delete {what} with all its results?", what=described)):
                say(_("nothing is deleted"))
                return
        client.delete(study_path(study["id"]), [("at_once", "true")] if at_once else ())
    if as_json:
        write_json({"deleted": study["id"]})
    else:
        said = _("{what} is deleted", what=described)
        undone = _("`sprag restore {study}` undoes it", study=study["id"])
        say(said if at_once else f"{said}; {undone}")


def _to_delete(client: Client, text: str, *, at_once: bool) -> dict[str, Any]:
    """The study that is meant; ``at_once``: also one that is deleted and can be restored, by its whole id."""
    from sprag_study.service.client.wire import study_path

    study_id = study_of(client, text)
    try:
        return client.request("GET", study_path(study_id))
    except FaultError as error:
        if at_once and error.code == "study-not-found":
            for study in client.items("/studies", "studies", [("search", study_id), ("deleted", "true")]):
                if study["id"] == study_id:
                    return study
        raise


def restore(
    study_id: Annotated[str, typer.Argument(metavar="ID", help="Whole id of the study, as `list --deleted` has it.")],
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """Undo the deletion of a study."""
    act_on(study_id, "restore", server, token, as_json)
