"""``sprag study VERB ID``: what is done with a study of a running service."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from sprag_study.service.cli import completion, extend
from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.console import agreed, say, write_json, wrong_option
from sprag_study.service.cli.described import listing, option, parameter, query_of, signed
from sprag_study.service.cli.following import exit_as, follow, further, outlived, show_study, submitted
from sprag_study.service.cli.groups import Groups
from sprag_study.service.cli.names import study_of
from sprag_study.service.cli.options import StudyId, Wait, WaitTimeout
from sprag_study.service.cli.remote import connection
from sprag_study.service.faults import FaultError
from sprag_study.service.languages import N_, _
from sprag_study.service.views.setting import settings_of
from sprag_study.service.views.study_questions import SelectQuestion
from sprag_study.worker.limits import MAX_PRIORITY

if TYPE_CHECKING:
    from collections.abc import Callable

    from sprag_study.service.client import Client, Query

app = typer.Typer(help="Watch, change, continue and delete a study of a service.", no_args_is_help=True, cls=Groups)
app.callback()(listing(wait=Wait, timeout=WaitTimeout))
#: Verbs without options.
_PLAIN: Final = {
    "pause": N_("Hold a study: running cases are finished, no new ones are started."),
    "resume": N_("Resume a study that is held; a past deadline or a closed window no longer applies."),
    "cancel": N_("Cancel a study; finished cases are kept."),
    "restore": N_("Undo the deletion of one of the studies of `sprag list --deleted`; latest: the one deleted last."),
}


@app.command()
def watch(study_id: StudyId, timeout: WaitTimeout = None) -> None:
    """Follow a study until it has ended, even across restarts of the service."""
    from sprag_study.service.client.wire import study_path, within

    with connection() as client:
        study_id = study_of(client, study_id)
        client.request("GET", study_path(study_id), timeout=within(timeout))  # a wrong address or id fails immediately
        with outlived(study_id):
            study = follow(client, study_id, timeout)
    show_study(study)
    exit_as(study)


def _act(study_id: str, verb: str, query: Query = ()) -> None:
    """Let the service do ``verb`` with a study, and print it."""
    from sprag_study.service.client.wire import study_path

    with connection() as client:
        named = study_of(client, study_id, deleted=verb == "restore")
        study = client.request("POST", f"{study_path(named)}:{verb}", params=list(query))
    show_study(study)


def _plain(verb: str, about: str) -> Callable[..., None]:
    def run(study_id: str) -> None:
        _act(study_id, verb)

    return signed(run, about, [parameter("study_id", StudyId, ...)])


for _verb, _about in _PLAIN.items():
    app.command(_verb)(_plain(_verb, _about))


@app.command()
def retry(
    study_id: StudyId,
    ending: Annotated[
        list[str] | None,
        typer.Option(
            "--ending",
            metavar="ENDING",
            help="Only cases with this ending; may be repeated.",
            autocompletion=completion.endings,
        ),
    ] = None,
) -> None:
    """Run only those cases of an ended study again that did not end ok."""
    _act(study_id, "retry", [("ending", name) for name in ending or ()])


@app.command()
def prioritize(
    study_id: StudyId,
    priority: Annotated[
        int, typer.Argument(min=-MAX_PRIORITY, max=MAX_PRIORITY, help="The new priority; studies start with 0.")
    ],
) -> None:
    """Change the priority of a study: among the waiting studies of one user the highest runs first."""
    _act(study_id, "prioritize", [("priority", str(priority))])


@app.command()
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
    with connection() as client:
        study = client.request("PATCH", study_path(study_of(client, study_id)), json=fields)
    show_study(study)


@app.command()
def delete(
    study_id: StudyId,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask before deleting.")] = False,
    at_once: Annotated[
        bool, typer.Option("--at-once", help="Remove its results now, to make room; it cannot be restored.")
    ] = False,
) -> None:
    """Delete a study that has ended, or is held at its deadline; `sprag study restore` undoes it for some days.

    With --at-once, one that is deleted already can be named by its whole id, as `sprag list --deleted` has it.
    """
    from sprag_study.service.client.wire import study_path

    with connection() as client:
        study = _to_delete(client, study_id, at_once=at_once)
        described = _(
            "{study} ({name}, {cases} cases)",
            study=study["id"],
            name=study["name"] or study["model"],
            cases=study["progress"]["done"],
        )
        question = _("Delete {what} with all its results?", what=described)
        if not agreed(question, yes=yes, needed=_("delete {what}?", what=described)):
            say(_("nothing is deleted"))
            return
        client.delete(study_path(study["id"]), [("at_once", "true")] if at_once else ())
    if wants_json():
        write_json({"deleted": study["id"]})
    else:
        said = _("{what} is deleted", what=described)
        undone = _("`sprag study restore {study}` undoes it", study=study["id"])
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


_SELECTED: Final = settings_of(SelectQuestion)


def _select(study_id: str, wait: bool, timeout: float | None, **asked: Any) -> None:
    with connection() as client:
        study = further(client, study_of(client, study_id), "select", params=query_of(_SELECTED, asked))
        submitted(client, study, wait, timeout)


app.command("select")(
    signed(
        _select,
        "Submit a study of the first cases within ranges of parameters and results, as points.",
        [
            parameter("study_id", StudyId, ...),
            *(parameter(one.name, option(one), one.default) for one in _SELECTED),
            parameter("wait", Wait, False), parameter("timeout", WaitTimeout, None),
        ],
    )
)  # fmt: skip
for _command in (extend.extend, extend.longer, extend.narrow):
    app.command()(_command)
