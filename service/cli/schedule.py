"""``sprag schedule``: studies that the service submits on a schedule."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from sprag_study.service.cli import completion
from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.console import (
    ExitCode,
    WrongInputError,
    duration_text,
    piped,
    say,
    show_table,
    table_words,
    write_json,
    wrong_option,
)
from sprag_study.service.cli.described import listing
from sprag_study.service.cli.files import read_spec
from sprag_study.service.cli.groups import Groups
from sprag_study.service.cli.names import schedule_of
from sprag_study.service.cli.options import Fresh, SpecFile
from sprag_study.service.cli.remote import PriorityOption, connection
from sprag_study.service.languages import N_, _, earlier
from sprag_study.service.schedules.stages import STAGE_NAMES
from sprag_study.worker.limits import MAX_PRIORITY

if TYPE_CHECKING:
    from collections.abc import Mapping

app = typer.Typer(
    help="Studies that the service submits on a schedule, once or repeatedly.",
    no_args_is_help=True,
    cls=Groups,
)

#: In place of flags: those that count unless others are named.
_DEFAULT: Final = "default"

ScheduleId = Annotated[
    str,
    typer.Argument(
        metavar="ID",
        help="Id or name of the schedule, or the beginning of one.",
        autocompletion=completion.schedules,
    ),
]
Cron = Annotated[
    str | None,
    typer.Option(
        "--cron",
        metavar="FIELDS",
        help='Recurring: minute, hour, day, month, weekday, such as "0 22 * * 1-5"; or @hourly, @daily, @weekly ...',
    ),
]
At = Annotated[str | None, typer.Option("--at", metavar="TIME", help="Once, such as 2027-01-31T22:00.")]
Zone = Annotated[
    str | None,
    typer.Option("--zone", metavar="NAME", help="Time zone, such as Europe/Berlin; default for a new one: UTC."),
]
WindowOption = Annotated[
    str | None,
    typer.Option(
        "--window", metavar="FROM-TO", help='Run between these times only, such as 22:00-06:00; "" for any time.'
    ),
]
RunFinish = Annotated[
    str | None,
    typer.Option(
        "--finish-by",
        metavar="TIME",
        help='Run coarse to fine until a time of day, such as 06:00, or for a duration, such as "8 h"; "" for none.',
    ),
]
Overlap = Annotated[
    str | None,
    typer.Option(
        "--overlap",
        metavar="POLICY",
        help="While an earlier study of the schedule has not ended: queue (default), skip the due time, or replace "
        "that study.",
    ),
]
CatchUp = Annotated[
    str | None,
    typer.Option(
        "--catch-up",
        metavar="POLICY",
        help="Which missed due times to run: the latest (default), all (at most 50), or none.",
    ),
]
Grace = Annotated[
    str | None,
    typer.Option(
        "--misfire-grace",
        metavar="TIME",
        help='Longest delay with which a due time still runs, such as "30 min"; "" for any.',
    ),
]
TroubleFlags = Annotated[
    list[str] | None,
    typer.Option(
        "--trouble-flag",
        metavar="FLAG",
        help="Flag of a case that needs attention; may be repeated; "
        '"" for none, default (default) for those of motions that had not settled.',
        autocompletion=completion.flags,
    ),
]
Email = Annotated[
    list[str] | None,
    typer.Option("--email", metavar="ADDRESS", help='Report its runs by mail; may be repeated; "" for none.'),
]
Webhook = Annotated[
    str | None,
    typer.Option("--webhook", metavar="URL", help='Report its runs by a signed POST to that address; "" for none.'),
]
ReportWhen = Annotated[
    str | None,
    typer.Option("--report", metavar="WHEN", help="Report always (default), or only on trouble."),
]
Name = Annotated[
    str | None, typer.Option("--name", metavar="TEXT", help="Name of its studies; default: that of the spec.")
]


_SHARED: Final = {
    "cron": Cron, "at": At, "zone": Zone, "window": WindowOption, "name": Name, "finish_by": RunFinish,
    "overlap": Overlap, "catch_up": CatchUp, "misfire_grace": Grace, "trouble_flag": TroubleFlags, "email": Email,
    "webhook": Webhook, "report": ReportWhen,
}  # fmt: skip
app.callback()(listing(**_SHARED))


@app.command()
def add(
    spec: SpecFile,
    cron: Cron = None,
    at: At = None,
    zone: Zone = None,
    window: WindowOption = None,
    name: Name = None,
    priority: PriorityOption = 0,
    fresh: Fresh = False,
    finish_by: RunFinish = None,
    overlap: Overlap = None,
    catch_up: CatchUp = None,
    misfire_grace: Grace = None,
    trouble_flag: TroubleFlags = None,
    email: Email = None,
    webhook: Webhook = None,
    report: ReportWhen = None,
    key: Annotated[
        str | None,
        typer.Option("--key", metavar="KEY", help="Idempotency key: the same key creates one schedule."),
    ] = None,
) -> None:
    """Create a schedule for a study and print its id: recurring with --cron, once with --at."""
    fields: dict[str, Any] = {
        "spec": read_spec(spec),
        **_given(cron=cron, at=at, zone=zone, name=name, finish_by=finish_by, **_window(window)),
        **_given(overlap=overlap, catch_up=catch_up, misfire_grace=misfire_grace, **_report(email, webhook, report)),
        **_trouble(trouble_flag),
        "priority": priority,
        "fresh": fresh,
    }
    with connection() as client:
        _show(client.request("POST", "/schedules", json=fields, key=key or ""))


@app.command("list")
def list_schedules() -> None:
    """List the schedules with their last and their next run."""
    with connection() as client:
        found = client.request("GET", "/schedules")
    if wants_json():
        write_json(found)
        return
    with table_words():
        heads = (_("id"), _("when"), _("window"), _("finish by"), _("last run"), _("next run"), _("name"))
        columns = [(head, False, place == 0) for place, head in enumerate(heads)]
        rows = []
        for s in found["schedules"]:
            window = "-".join(s["window"] or ()) or None
            last = s["last_run"]
            times = (last and last["due_local"], s["next_due_local"]) if piped() else (_run(last), _next(s))
            rows.append((s["id"], _when(s), window, s["finish_by"], *times, s["name"]))
        show_table("", columns, rows)
    _say_off(found)


@app.command()
def show(schedule_id: ScheduleId) -> None:
    """Show a schedule and the outcome of its latest due times; with --json also its spec."""
    from sprag_study.service.client.wire import schedule_path

    with connection() as client:
        schedule = client.request("GET", schedule_path(schedule_of(client, schedule_id)))
    if wants_json():
        write_json(schedule)
        return
    _show(schedule)
    with table_words():
        columns = ((_("due"), False), (_("missed before"), True), (_("study"), False, True), (_("problem"), False))
        runs = schedule["runs"]
        show_table("", columns, [(_cell(r["due_local"]), r["missed"], r["study"], _known(r["problem"])) for r in runs])


@app.command()
def night(
    hours: Annotated[float, typer.Option("--hours", min=1, max=744, help="Hours to look back on.")] = 24,
    stages: Annotated[
        bool, typer.Option("--stages", help="Show what took how long: waiting, compiling, computing and so on.")
    ] = False,
) -> None:
    """Show what schedules did in the last hours, first what needs attention; exit code 4 if anything does."""
    with connection() as client:
        found = client.request("GET", "/night", params={"hours": hours})
    if wants_json():
        write_json(found)
    else:
        with table_words():
            columns = ((_("due"), False), (_("schedule"), False), (_("outcome"), False), (_("study"), False, True))
            listed = [(run, run["sentence"]) for run in found["late"]]
            listed += [(run, run["outcome"]["sentence"]) for run in found["runs"]]
            rows = [(_cell(run["due_local"]), run["name"], _(sentence), run["study"]) for run, sentence in listed]
            show_table("", columns, rows)
        if stages:
            _show_stages(found["runs"])
        _say_off(found)
    if found["trouble"] or found["late"] or found["off"]:
        raise typer.Exit(ExitCode.NOT_ALL_OK)


@table_words()
def _show_stages(runs: list[dict[str, Any]]) -> None:
    """Show how long each stage of the runs took that are over."""
    columns = (
        (_("schedule"), False), (_("study"), False, True), (_("stage"), False),
        (_("from"), False, True), (_("until"), False, True), (_("time"), True),
    )  # fmt: skip
    rows = [
        (
            run["name"] or run["schedule"],
            run["study"],
            _(STAGE_NAMES[stage["stage"]]),
            _cell(stage["begin_local"], seconds=True),
            _cell(stage["end_local"], seconds=True),
            stage["seconds"] if piped() else duration_text(stage["seconds"]),
        )
        for run in runs
        for stage in run["stages"] or ()
    ]
    show_table("", columns, rows)


@app.command()
def change(
    schedule_id: ScheduleId,
    spec: Annotated[
        str | None, typer.Option("--spec", metavar="SPEC", help="Another study spec; - reads standard input.")
    ] = None,
    cron: Cron = None,
    at: At = None,
    zone: Zone = None,
    window: WindowOption = None,
    name: Name = None,
    priority: Annotated[
        int | None, typer.Option(min=-MAX_PRIORITY, max=MAX_PRIORITY, help="Priority of its studies.")
    ] = None,
    fresh: Annotated[
        bool | None,
        typer.Option("--fresh/--no-fresh", help="Run every case, including those that other studies already have."),
    ] = None,
    finish_by: RunFinish = None,
    overlap: Overlap = None,
    catch_up: CatchUp = None,
    misfire_grace: Grace = None,
    trouble_flag: TroubleFlags = None,
    email: Email = None,
    webhook: Webhook = None,
    report: ReportWhen = None,
) -> None:
    """Change the given fields of a schedule; the others are kept."""
    fields = _given(
        cron=cron, at=at, zone=zone, name=name, priority=priority, fresh=fresh, finish_by=finish_by, **_window(window)
    ) | _given(overlap=overlap, catch_up=catch_up, misfire_grace=misfire_grace, **_report(email, webhook, report))
    fields |= _trouble(trouble_flag)
    if spec is not None:
        fields["spec"] = read_spec(spec)
    if not fields:
        raise WrongInputError(
            "invalid-parameter", _("nothing to change; `sprag schedule change --help` lists the fields")
        )
    _change(schedule_id, fields)


@app.command()
def pause(
    schedule_id: ScheduleId,
    until: Annotated[
        str | None,
        typer.Option("--until", metavar="TIME", help="Resume by itself then, such as 2027-01-07T00:00 in its zone."),
    ] = None,
) -> None:
    """Pause a schedule: it stays, but is not due, until somebody resumes it or until a certain time."""
    _change(schedule_id, {"enabled": False} if until is None else {"paused_until": until})


@app.command()
def resume(schedule_id: ScheduleId) -> None:
    """Resume a paused schedule from now on."""
    _change(schedule_id, {"enabled": True, "paused_until": None})


@app.command()
def delete(schedule_id: ScheduleId) -> None:
    """Delete a schedule; its studies are kept."""
    from sprag_study.service.client.wire import schedule_path

    with connection() as client:
        schedule_id = schedule_of(client, schedule_id)
        client.delete(schedule_path(schedule_id))
    say(_("{what} is deleted", what=schedule_id))


def _change(schedule_id: str, fields: Mapping[str, Any]) -> None:
    from sprag_study.service.client.wire import schedule_path

    with connection() as client:
        _show(client.request("PATCH", schedule_path(schedule_of(client, schedule_id)), json=dict(fields)))


def _given(**fields: Any) -> dict[str, Any]:
    """The given fields; an empty window, deadline or misfire grace removes it."""
    given = {name: value for name, value in fields.items() if value is not None}
    if given.get("window") == []:
        given["window"] = None
    return given | {name: None for name in ("finish_by", "misfire_grace", "report_webhook") if given.get(name) == ""}


def _report(email: list[str] | None, webhook: str | None, when: str | None) -> dict[str, Any]:
    addresses = None if email is None else [address for address in email if address]
    return {"report_email": addresses, "report_webhook": webhook, "report_when": when}


def _trouble(flags: list[str] | None) -> dict[str, Any]:
    if flags is None:
        return {}
    return {"trouble_flags": None if flags == [_DEFAULT] else [flag for flag in flags if flag]}


def _window(text: str | None) -> dict[str, Any]:
    if text is None:
        return {}
    if not text.strip():
        return {"window": []}
    begin, dash, end = text.partition("-")
    if not dash:
        raise wrong_option("--window", "invalid-text", N_("is not a time window"), text, allowed=_("as 22:00-06:00"))
    return {"window": [begin.strip(), end.strip()]}


def _show(schedule: dict[str, Any]) -> None:
    if wants_json():
        write_json(schedule)
        return
    print(schedule["id"])
    parts = [f"{schedule['name']}: {_when(schedule)}"]
    if schedule["window"]:
        first, last = schedule["window"]
        parts.append(_("between {first} and {last} only", first=first, last=last))
    if schedule["finish_by"]:
        parts.append(_("finished by {time}", time=schedule["finish_by"]))
    say(", ".join(parts) + "; " + _("next run: {time}", time=_next(schedule)))
    _say_off(schedule)


def _when(schedule: dict[str, Any]) -> str:
    return f"{schedule['cron'] or schedule['at']} ({schedule['zone']})"


def _next(schedule: dict[str, Any]) -> str:
    until = schedule["paused_until"]
    paused = _("paused until {time}", time=_clock(until)) + "; " if until else ""
    if schedule["next_due"] is not None:
        return f"{paused}{_clock(schedule['next_due_local'])}"
    return _("none") if schedule["enabled"] else _("paused")


def _run(run: dict[str, Any] | None) -> str | None:
    if run is None:
        return None
    return f"{_clock(run['due_local'])} {run['study'] or _known(run['problem']) or run['state']}"


def _say_off(found: dict[str, Any]) -> None:
    """Say why no schedule runs, where none does."""
    if found["off"]:
        say(_known(found["off"]) or "")


def _known(text: str | None) -> str | None:
    """A sentence of the service in the language of the task, where the catalogue has it."""
    return earlier.said(_(text)) if text else text


def _cell(text: str, *, seconds: bool = False) -> str:
    """A time in a table: on the wall clock, for programs as it comes."""
    return text if piped() else _clock(text, seconds=seconds)


def _clock(text: str, *, seconds: bool = False) -> str:
    """A time on the wall clock of a schedule with its offset: ``2027-01-31 22:00 +01:00``, or with ``seconds``."""
    return f"{text[:10]} {text[11 : 19 if seconds else 16]} {text[-6:]}"
