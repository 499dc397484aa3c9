"""Following a study of a running service to its end, and telling of it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import typer

from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.console import (
    OK,
    ExitCode,
    progress_bar,
    progress_text,
    say,
    state_text,
    warning_lines,
    write_json,
)
from sprag_study.service.languages import _, earlier
from sprag_study.worker.states import TERMINAL, StudyState

if TYPE_CHECKING:
    from sprag_study.service.client import Client


def further(client: Client, study_id: str, verb: str, **arguments: Any) -> dict[str, Any]:
    """The study that a verb of another one submits."""
    from sprag_study.service.client.wire import study_path

    with submitting():
        return client.request("POST", f"{study_path(study_id)}:{verb}", key="", **arguments)


def submitted(client: Client, study: dict[str, Any], wait: bool, timeout: float | None) -> None:
    """Tell of a study that was submitted, at once or when it has ended."""
    with outlived(study["id"]):
        say(*warning_lines(study.get("warnings", ()), study.get("warning_codes", ())))
        if wait:
            study = follow(client, study["id"], timeout)
    show_study(study)
    if wait:
        exit_as(study)


def follow(client: Client, study_id: str, timeout: float | None = None, *, patient: bool = True) -> dict[str, Any]:
    """Wait, with a bar on standard error, until a study has ended or reached its deadline; returns its final state.

    For a held study the reason is printed, and watching continues until it is resumed or cancelled. The same applies to
    a service that does not answer; with ``patient`` false, the command fails instead.
    """
    from sprag_study.service.client.synchronous.following import wait_for
    from sprag_study.service.client.waiting import Waiting

    reasons: set[str | None] = set()
    with progress_bar(study_id) as update:

        def tell(study: dict[str, Any]) -> None:
            progress = study["progress"]
            update(progress["done"], progress["total"], _remark(study))
            held = study["state"] == StudyState.PAUSED and not study["time_over"]
            if held and study.get("reason") not in reasons:
                reasons.add(study.get("reason"))
                why = earlier.said(_(study["reason"])) if study.get("reason") else _("on request")
                say(_("{study} is paused: {why}", study=study_id, why=why))

        return wait_for(client, study_id, Waiting(tell, timeout, patient=patient, notify=say))


@contextmanager
def outlived(study_id: str) -> Iterator[None]:
    """While a study of a service is followed, an interrupt ends the command only; that is said."""
    try:
        yield
    except KeyboardInterrupt:
        say(
            _(
                "The study {study} continues without this command: `sprag study watch {study}` follows it, `sprag "
                "study cancel {study}` ends it.",
                study=study_id,
            )
        )
        raise


@contextmanager
def submitting() -> Iterator[None]:
    """While a study is being submitted, an interrupt leaves open whether it was; that is said."""
    try:
        yield
    except KeyboardInterrupt:
        say(_("It is not known whether the study was submitted; `sprag list` shows it where it was."))
        raise


def _remark(study: dict[str, Any]) -> str:
    progress = study["progress"]
    left = progress["seconds_left"]
    interval = None if left is None else (left["low"], left["high"])
    rounds = _rounds(study)
    return progress_text(study["state"], progress["rate"], interval, study["finish_by"], progress["in_time"], rounds)


def _rounds(study: dict[str, Any]) -> str | None:
    """The rounds of a study that chooses its own cases, in words; None of another, or of a service without rounds."""
    rounds = study["progress"].get("rounds")
    return None if rounds is None else str(rounds["sentence"])


def exit_as(study: dict[str, Any]) -> None:
    """Exit with the code that shows whether every case ended ok."""
    progress = study["progress"]
    if progress["ok"] != progress["total"]:
        raise typer.Exit(ExitCode.NOT_ALL_OK)


def show_study(study: dict[str, Any]) -> None:
    """Print the current study: its id and progress, or everything as JSON."""
    if wants_json():
        write_json(study)
        return
    print(study["id"])
    progress = study["progress"]
    endings = ", ".join(f"{count} {name}" for name, count in progress.get("endings", {}).items() if name != OK)
    counts = _(
        "{name}: {state}, {done} of {total} cases done, {ok} ok",
        name=study["name"] or study["model"],
        state=state_text(study["state"]),
        **{name: progress[name] for name in ("done", "total", "ok")},
    )
    say("; ".join([counts + (f" ({endings})" if endings else ""), *_remarks(study)]))
    if study["time_over"]:
        say(f"{study['id']}: {earlier.said(_(study['reason']))}")


def _remarks(study: dict[str, Any]) -> Iterator[str]:
    """What else is known of a study: rounds, reuse, hosts, deadline."""
    if rounds := _rounds(study):
        yield rounds
    if study.get("reused"):
        yield _("{count} taken from other studies", count=study["reused"])
    found = [origin["host"] for origin in study.get("computed_by", []) if origin["host"]]
    if hosts := sorted({host for names in found for host in names.split(", ")}):
        yield _("computed by {hosts}", hosts=", ".join(hosts))
    if _is_due(study):
        yield _("to be finished by {time}", time=study["finish_by"])


def _is_due(study: dict[str, Any]) -> bool:
    """Whether the study has a future deadline."""
    return bool(study.get("finish_by")) and not (study["time_over"] or study["state"] in TERMINAL)
