"""``sprag schedule``: studies that the service submits on a schedule."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from sprag.service.cli.console import WrongInputError, say, show_table, write_json, wrong_option
from sprag.service.cli.files import read_spec
from sprag.service.cli.options import DEFAULT_SERVER, Fresh, JsonFlag, Server, SpecFile, Token
from sprag.service.cli.remote import PriorityOption, connection
from sprag.worker.limits import MAX_PRIORITY

if TYPE_CHECKING:
    from collections.abc import Mapping

app = typer.Typer(
    help="Studies that the service submits on a schedule, once or repeatedly.",
    no_args_is_help=True,
    rich_markup_mode="rich",
)

ScheduleId = Annotated[str, typer.Argument(metavar="ID", help="Id of the schedule.")]
Cron = Annotated[
    str | None,
    typer.Option(
        "--cron",
        metavar="FIELDS",
        help='Recurring: minute, hour, day, month, weekday, such as "0 22 * * 1-5".',
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
Name = Annotated[str | None, typer.Option("--name", help="Name of its studies; default: that of the spec.")]


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
    key: Annotated[
        str | None,
        typer.Option("--key", metavar="KEY", help="Idempotency key: the same key creates one schedule."),
    ] = None,
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """Create a schedule for a study and print its id: recurring with --cron, once with --at."""
    fields: dict[str, Any] = {
        "spec": read_spec(spec),
        **_given(cron=cron, at=at, zone=zone, name=name, finish_by=finish_by, **_window(window)),
        "priority": priority,
        "fresh": fresh,
    }
    with connection(server, token) as client:
        _show(client.create_schedule(fields, key), as_json)


@app.command("list")
def list_schedules(server: Server = DEFAULT_SERVER, token: Token = None, as_json: JsonFlag = False) -> None:
    """List the schedules with their last and their next run."""
    with connection(server, token) as client:
        found = client.schedules()
    if as_json:
        write_json(found)
        return
    columns = [
        (heading, False, heading == "id")
        for heading in ("id", "when", "window", "finish by", "last run", "next run", "name")
    ]
    rows = []
    for s in found["schedules"]:
        window = "-".join(s["window"] or ()) or None
        rows.append((s["id"], _when(s), window, s["finish_by"], _run(s["last_run"]), _next(s), s["name"]))
    show_table("", columns, rows)


@app.command()
def show(
    schedule_id: ScheduleId, server: Server = DEFAULT_SERVER, token: Token = None, as_json: JsonFlag = False
) -> None:
    """Show a schedule and the outcome of its latest due times; with --json also its spec."""
    with connection(server, token) as client:
        schedule = client.schedule(schedule_id)
    if as_json:
        write_json(schedule)
        return
    _show(schedule, as_json)
    columns = (("due", False), ("missed before", True), ("study", False, True), ("problem", False))
    show_table("", columns, [(r["due"], r["missed"], r["study"], r["problem"]) for r in schedule["runs"]])


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
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """Change the given fields of a schedule; the others are kept."""
    fields = _given(
        cron=cron, at=at, zone=zone, name=name, priority=priority, fresh=fresh, finish_by=finish_by, **_window(window)
    )
    if spec is not None:
        fields["spec"] = read_spec(spec)
    if not fields:
        raise WrongInputError("invalid-parameter", "nothing to change; `sprag schedule change --help` lists the fields")
    _change(schedule_id, fields, server, token, as_json)


@app.command()
def enable(
    schedule_id: ScheduleId, server: Server = DEFAULT_SERVER, token: Token = None, as_json: JsonFlag = False
) -> None:
    """Enable a disabled schedule from now on."""
    _change(schedule_id, {"enabled": True}, server, token, as_json)


@app.command()
def disable(
    schedule_id: ScheduleId, server: Server = DEFAULT_SERVER, token: Token = None, as_json: JsonFlag = False
) -> None:
    """Disable a schedule: it is kept, but never due."""
    _change(schedule_id, {"enabled": False}, server, token, as_json)


@app.command()
def delete(schedule_id: ScheduleId, server: Server = DEFAULT_SERVER, token: Token = None) -> None:
    """Delete a schedule; its studies are kept."""
    with connection(server, token) as client:
        client.delete_schedule(schedule_id)
    say(f"{schedule_id} is deleted")


def _change(schedule_id: str, fields: Mapping[str, Any], server: str, token: str | None, as_json: bool) -> None:
    with connection(server, token) as client:
        _show(client.change_schedule(schedule_id, fields), as_json)


def _given(**fields: Any) -> dict[str, Any]:
    """The given fields; an empty window or deadline removes it."""
    given = {name: value for name, value in fields.items() if value is not None}
    if given.get("window") == []:
        given["window"] = None
    if given.get("finish_by") == "":
        given["finish_by"] = None
    return given


def _window(text: str | None) -> dict[str, Any]:
    if text is None:
        return {}
    if not text.strip():
        return {"window": []}
    begin, dash, end = text.partition("-")
    if not dash:
        raise wrong_option("--window", "invalid-text", "is not a time window", text, allowed="as 22:00-06:00")
    return {"window": [begin.strip(), end.strip()]}


def _show(schedule: dict[str, Any], as_json: bool) -> None:
    if as_json:
        write_json(schedule)
        return
    print(schedule["id"])
    window = f", between {' and '.join(schedule['window'])} only" if schedule["window"] else ""
    finish = f", finished by {schedule['finish_by']}" if schedule["finish_by"] else ""
    say(f"{schedule['name']}: {_when(schedule)}{window}{finish}; next run: {_next(schedule)}")


def _when(schedule: dict[str, Any]) -> str:
    return f"{schedule['cron'] or schedule['at']} ({schedule['zone']})"


def _next(schedule: dict[str, Any]) -> str:
    return schedule["next_due"] or ("none" if schedule["enabled"] else "disabled")


def _run(run: dict[str, Any] | None) -> str | None:
    return None if run is None else f"{run['due']} {run['study'] or run['problem'] or run['state']}"
