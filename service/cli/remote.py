"""Commands that talk to a running service: submit, watch, list, pause, resume, cancel, retry, export, curve."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import islice
from typing import TYPE_CHECKING, Annotated, Any, Literal, cast, get_args

import typer

from sprag.service.cli.console import (
    OK,
    CommandFailureError,
    ExitCode,
    TroubleError,
    WrongInputError,
    progress_bar,
    progress_text,
    say,
    show_table,
    write_json,
)
from sprag.service.cli.files import naming_points, read_spec, to_file, write_pieces
from sprag.service.cli.options import (
    DEFAULT_SERVER,
    FinishBy,
    Fresh,
    JsonFlag,
    OutputFile,
    PointsFile,
    Server,
    SpecFile,
    StudyId,
    TableFiles,
    Token,
    Wait,
    WaitTimeout,
)
from sprag.service.faults import Fault, Kind
from sprag.service.formats import REPORT_FORMATS, Format, ReportFormat, format_of
from sprag.worker.limits import MAX_BODY_BYTES, MAX_PRIORITY
from sprag.worker.states import TERMINAL, StudyState

if TYPE_CHECKING:
    from sprag.service.client import Query, RefusedError, ServiceClient

#: Most studies of one request.
_PAGE = 100

#: A parameter as in the service's messages: "by=", "at=shaft.load=0.2".
_PARAMETER_IN_TEXT = re.compile(r"(?<![\w.-])(x|y|by|at)=(?=(\w?))")

PriorityOption = Annotated[
    int,
    typer.Option(min=-MAX_PRIORITY, max=MAX_PRIORITY, help="Waiting studies with the highest priority run first."),
]


#: Formats of a whole study: case rows (`sprag.service.results.exports`) and documents (`sprag.service.results.report`).
TableFormat = Literal[Format, ReportFormat]


@contextmanager
def connection(server: str, token: str | None) -> Iterator[ServiceClient]:
    """A client of the service; its errors become failures of the command."""
    from sprag.service.client import RefusedError, ServiceClient, StudyTimeoutError, UnreachableError

    try:
        client = ServiceClient(server, token)
    except ValueError as error:
        raise WrongInputError("invalid-parameter", str(error)) from error
    with client:
        try:
            yield client
        except UnreachableError as error:
            raise TroubleError(
                "unreachable",
                f"No Sprag service at {error.address} ({error.reason}); start one with `sprag serve` or name another "
                "with --server.",
            ) from error
        except RefusedError as error:
            raise refusal(error) from error
        except StudyTimeoutError as error:
            raise TroubleError("not-done", f"{error}; it continues.") from error


def refusal(error: RefusedError) -> CommandFailureError:
    """The failure of the command for a refusal of the service."""
    kind = cast("Kind", error.code)
    if error.status == 401:
        return TroubleError(kind, f"{error} Give the service's token with --token or in SPRAG_TOKEN.")
    if error.status in (403, 421) or error.status >= 500:
        return TroubleError(kind, str(error))
    faults = [
        Fault(
            _option(fault.where) if fault.place == "parameter" else fault.where,
            fault.code,
            _PARAMETER_IN_TEXT.sub(lambda found: f"{_option(found[1])}{found[2] and ' '}", fault.message),
            fault.value,
            fault.allowed,
            fault.unit,
        )
        for fault in error.faults
    ]
    title = error.problem.get("title")
    return WrongInputError(kind, str(title) if faults and title else str(error), faults)


def _option(parameter: object) -> str:
    """The option for a parameter of a request."""
    return "--" + str(parameter).replace("_", "-")


def submit(
    spec: SpecFile,
    points: PointsFile = None,
    tables: TableFiles = None,
    wait: Wait = False,
    key: Annotated[
        str | None, typer.Option("--key", metavar="KEY", help="Idempotency key: the same key submits the study once.")
    ] = None,
    priority: PriorityOption = 0,
    fresh: Fresh = False,
    finish_by: FinishBy = None,
    timeout: WaitTimeout = None,
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """Submit a study to the service and print its id."""
    data = read_spec(spec, points, MAX_BODY_BYTES, tables)
    with naming_points(points), connection(server, token) as client:
        submitted(client, client.create_study(data, key, priority, fresh, finish_by), wait, timeout, as_json)


def submitted(client: ServiceClient, study: dict[str, Any], wait: bool, timeout: float | None, as_json: bool) -> None:
    """Tell of a study that was submitted, at once or when it has ended."""
    say(*(f"warning: {warning}" for warning in study.get("warnings", ())))
    if wait:
        study = follow(client, study["id"], timeout)
    show_study(study, as_json)
    if wait:
        _exit_as(study)


def watch(
    study_id: StudyId,
    timeout: WaitTimeout = None,
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """Follow a study until it has ended, even across restarts of the service."""
    with connection(server, token) as client:
        client.study(study_id, timeout)  # a wrong address or id fails immediately
        study = follow(client, study_id, timeout)
    show_study(study, as_json)
    _exit_as(study)


def follow(
    client: ServiceClient, study_id: str, timeout: float | None = None, *, patient: bool = True
) -> dict[str, Any]:
    """Wait, with a bar on standard error, until a study has ended or reached its deadline; returns its final state.

    For a held study the reason is printed, and watching continues until it is resumed or cancelled. The same applies to
    a service that does not answer; with ``patient`` false, the command fails instead.
    """
    from sprag.service.client.waiting import Waiting, wait_for

    told: set[str | None] = set()
    with progress_bar(study_id) as update:

        def tell(study: dict[str, Any]) -> None:
            progress = study["progress"]
            update(progress["done"], progress["total"], _remark(study))
            held = study["state"] == StudyState.PAUSED and not study["time_over"]
            if held and study.get("reason") not in told:
                told.add(study.get("reason"))
                say(f"{study_id} is paused: {study.get('reason') or 'on request'}")

        return wait_for(client, study_id, Waiting(tell, timeout, patient=patient, notify=say))


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


def _exit_as(study: dict[str, Any]) -> None:
    """Exit with the code that shows whether every case ended ok."""
    progress = study["progress"]
    if progress["ok"] != progress["total"]:
        raise typer.Exit(ExitCode.NOT_ALL_OK)


def show_study(study: dict[str, Any], as_json: bool) -> None:
    """Print the current study: its id and progress, or everything as JSON."""
    if as_json:
        write_json(study)
        return
    print(study["id"])
    progress = study["progress"]
    endings = ", ".join(f"{count} {name}" for name, count in progress.get("endings", {}).items() if name != OK)
    say(
        f"{study['name'] or study['model']}: {study['state']}, {progress['done']} of {progress['total']} cases done, "
        f"{progress['ok']} ok"
        + (f" ({endings})" if endings else "")
        + (f"; {_rounds(study)}" if _rounds(study) else "")
        + (f"; {study['reused']} taken from other studies" if study.get("reused") else "")
        + (f"; to be finished by {study['finish_by']}" if _is_due(study) else "")
    )
    if study["time_over"]:
        say(f"{study['id']}: {study['reason']}")


def _is_due(study: dict[str, Any]) -> bool:
    """Whether the study has a future deadline."""
    return bool(study.get("finish_by")) and not (study["time_over"] or study["state"] in TERMINAL)


def list_studies(
    state: Annotated[StudyState | None, typer.Option(help="Only studies in this state.")] = None,
    limit: Annotated[int, typer.Option(min=1, max=100_000, help="Most studies to show, newest first.")] = 50,
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """List the studies of the service, newest first."""
    with connection(server, token) as client:
        query = [("page_size", str(min(limit, _PAGE))), *([] if state is None else [("state", state.value)])]
        studies = list(islice(client.studies(query), limit))
    if as_json:
        write_json({"studies": studies})
        return
    columns = (("id", False, True), ("state", False, True), ("done", True), ("cases", True), ("created", False),
               ("finish by", False), ("name", False))  # fmt: skip
    rows = [
        (s["id"], s["state"], s["progress"]["done"], s["progress"]["total"], s["created_at"], s["finish_by"], s["name"])
        for s in studies
    ]
    show_table("", columns, rows)


def _act(study_id: str, verb: str, server: str, token: str | None, as_json: bool, query: Query = ()) -> None:
    with connection(server, token) as client:
        study = client.act(study_id, verb, query)
    show_study(study, as_json)


def cancel(study_id: StudyId, server: Server = DEFAULT_SERVER, token: Token = None, as_json: JsonFlag = False) -> None:
    """Cancel a study; finished cases are kept."""
    _act(study_id, "cancel", server, token, as_json)


def pause(study_id: StudyId, server: Server = DEFAULT_SERVER, token: Token = None, as_json: JsonFlag = False) -> None:
    """Hold a study: running cases are finished, no new ones are started."""
    _act(study_id, "pause", server, token, as_json)


def resume(study_id: StudyId, server: Server = DEFAULT_SERVER, token: Token = None, as_json: JsonFlag = False) -> None:
    """Resume a study that is held; a past deadline or a closed window no longer applies."""
    _act(study_id, "resume", server, token, as_json)


def retry(
    study_id: StudyId,
    ending: Annotated[
        list[str] | None,
        typer.Option("--ending", metavar="ENDING", help="Only cases with this ending; may be repeated."),
    ] = None,
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """Run only those cases of an ended study again that did not end ok."""
    _act(study_id, "retry", server, token, as_json, [("ending", name) for name in ending or ()])


def prioritize(
    study_id: StudyId,
    priority: Annotated[
        int, typer.Argument(min=-MAX_PRIORITY, max=MAX_PRIORITY, help="The new priority; studies start with 0.")
    ],
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """Change the priority of a study: among waiting studies the highest runs first."""
    _act(study_id, "prioritize", server, token, as_json, [("priority", str(priority))])


def export(
    study_id: StudyId,
    form: Annotated[
        TableFormat | None, typer.Option("--format", help="Default: by the name of FILE, otherwise csv.")
    ] = None,
    file: OutputFile = None,
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """Write all case rows of a study, or a report of it, to a file or to standard output."""
    chosen = table_format(form, file, as_json)
    with connection(server, token) as client:
        table = chosen in get_args(Format)
        pieces = client.results(study_id, chosen) if table else client.report(study_id, chosen)
        written = write_pieces(file, pieces)
    if to_file(file):
        say(f"{file}: {written} bytes")
        if as_json:
            write_json({"file": file, "format": chosen, "bytes": written})


def table_format(form: TableFormat | None, file: str | None, as_json: bool) -> Format | ReportFormat:
    """The requested format: by name, by the ending of the file's name, or by ``--json``; csv otherwise."""
    if form is not None:
        return form
    ending = (file or "").rpartition(".")[2].lower()
    told = next((known for known in REPORT_FORMATS if known == ending), None) or format_of(file or "")
    return told or ("json" if as_json else "csv")
