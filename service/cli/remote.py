"""Commands that talk to a running service: submit, watch, pause, resume, cancel, retry, rounds, export."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, Any, cast, get_args

import typer

from sprag_study.service.cli import completion
from sprag_study.service.cli.console import (
    CommandFailureError,
    TroubleError,
    WrongInputError,
    cell_text,
    say,
    show_table,
    time_text,
    write_json,
    wrong_option,
)
from sprag_study.service.cli.file_formats import TableFormat, require_csv, table_format
from sprag_study.service.cli.files import naming_points, read_spec, to_file, write_pieces
from sprag_study.service.cli.following import exit_as, follow, outlived, show_study, submitted, submitting
from sprag_study.service.cli.names import study_of
from sprag_study.service.cli.options import (
    DEFAULT_SERVER,
    Appendix,
    CsvHeader,
    FileUnits,
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
    in_units,
)
from sprag_study.service.faults import Fault, Kind
from sprag_study.service.formats import Format
from sprag_study.service.languages import N_, _, earlier
from sprag_study.worker.limits import MAX_BODY_BYTES, MAX_PRIORITY

if TYPE_CHECKING:
    from sprag_study.service.client import Client, Query, RefusedError

#: A parameter as in the service's messages: "by=", "at=shaft.load=0.2".
_PARAMETER_IN_TEXT = re.compile(r"(?<![\w.-])(x|y|by|at)=(?=(\w?))")

PriorityOption = Annotated[
    int,
    typer.Option(min=-MAX_PRIORITY, max=MAX_PRIORITY, help="Waiting studies with the highest priority run first."),
]


@contextmanager
def connection(server: str, token: str | None) -> Iterator[Client]:
    """A client of the service; its errors become failures of the command."""
    from sprag_study.service.client import (
        ArgumentError,
        Client,
        RefusedError,
        StudyTimeoutError,
        UnreachableError,
        UntrustedError,
    )

    try:
        client = Client(server, token)
    except ValueError as error:
        raise WrongInputError("invalid-parameter", str(error)) from error
    with client:
        try:
            yield client
        except UntrustedError as error:
            raise TroubleError(
                "unreachable",
                f"{error}; SSL_CERT_FILE names a PEM file with the certificate of its issuer.",
            ) from error
        except UnreachableError as error:
            raise TroubleError(
                "unreachable",
                _(
                    "No Sprag service at {address} ({why}); start one with `sprag serve` or name another with "
                    "--server.",
                    address=error.address,
                    why=error.reason,
                ),
            ) from error
        except RefusedError as error:
            raise refusal(error) from error
        except ArgumentError as error:
            raise WrongInputError("invalid-parameter", _("invalid argument"), error.faults) from error
        except StudyTimeoutError as error:
            raise TroubleError("not-done", _("{what}; it continues.", what=error)) from error


def refusal(error: RefusedError) -> CommandFailureError:
    """The failure of the command for a refusal of the service."""
    kind = cast("Kind", error.code)
    if error.status == 401:
        return TroubleError(
            kind,
            _(
                "{refusal} Give the service's token with --token or in SPRAG_TOKEN.",
                refusal=earlier.said(_(str(error))),
            ),
        )
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
    from sprag_study.service.client.queries import query_of

    data = read_spec(spec, points, MAX_BODY_BYTES, tables)
    query = query_of({"priority": priority or None, "fresh": fresh, "finish_by": finish_by})
    with naming_points(points), connection(server, token) as client:
        with submitting():
            study = client.request("POST", "/studies", json=data, key=key or "", params=query)
        submitted(client, study, wait, timeout, as_json)


def watch(
    study_id: StudyId,
    timeout: WaitTimeout = None,
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """Follow a study until it has ended, even across restarts of the service."""
    from sprag_study.service.client.wire import study_path, within

    with connection(server, token) as client:
        study_id = study_of(client, study_id)
        client.request("GET", study_path(study_id), timeout=within(timeout))  # a wrong address or id fails immediately
        with outlived(study_id):
            study = follow(client, study_id, timeout)
    show_study(study, as_json)
    exit_as(study)


def act_on(study_id: str, verb: str, server: str, token: str | None, as_json: bool, query: Query = ()) -> None:
    """Let the service do ``verb`` with a study, and print it."""
    from sprag_study.service.client.wire import study_path

    with connection(server, token) as client:
        study_id = study_of(client, study_id)
        study = client.request("POST", f"{study_path(study_id)}:{verb}", params=list(query))
    show_study(study, as_json)


def cancel(study_id: StudyId, server: Server = DEFAULT_SERVER, token: Token = None, as_json: JsonFlag = False) -> None:
    """Cancel a study; finished cases are kept."""
    act_on(study_id, "cancel", server, token, as_json)


def pause(study_id: StudyId, server: Server = DEFAULT_SERVER, token: Token = None, as_json: JsonFlag = False) -> None:
    """Hold a study: running cases are finished, no new ones are started."""
    act_on(study_id, "pause", server, token, as_json)


def resume(study_id: StudyId, server: Server = DEFAULT_SERVER, token: Token = None, as_json: JsonFlag = False) -> None:
    """Resume a study that is held; a past deadline or a closed window no longer applies."""
    act_on(study_id, "resume", server, token, as_json)


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
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """Run only those cases of an ended study again that did not end ok."""
    act_on(study_id, "retry", server, token, as_json, [("ending", name) for name in ending or ()])


def prioritize(
    study_id: StudyId,
    priority: Annotated[
        int, typer.Argument(min=-MAX_PRIORITY, max=MAX_PRIORITY, help="The new priority; studies start with 0.")
    ],
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """Change the priority of a study: among the waiting studies of one user the highest runs first."""
    act_on(study_id, "prioritize", server, token, as_json, [("priority", str(priority))])


def rounds(study_id: StudyId, server: Server = DEFAULT_SERVER, token: Token = None, as_json: JsonFlag = False) -> None:
    """List the rounds of a study that chooses its own cases, with what was known before each."""
    from sprag_study.service.client.wire import study_path

    with connection(server, token) as client:
        study_id = study_of(client, study_id)
        found = client.request("GET", f"{study_path(study_id)}/rounds")
    if as_json:
        write_json(found)
        return
    columns = (
        (_("round"), True),
        (_("first case"), True),
        (_("cases"), True),
        (_("planned"), False),
        (_("known before"), False),
    )
    rows = [
        (r["round"], r["first_case"], r["cases"], time_text(r["planned_at"]), _known(r["summary"]))
        for r in found["rounds"]
    ]
    show_table("", columns, rows)


def _known(summary: dict[str, Any]) -> str:
    single = {name: value for name, value in summary.items() if not isinstance(value, dict | list)}
    return ", ".join(f"{name} {cell_text(value)}" for name, value in single.items())


def export(
    study_id: StudyId,
    form: Annotated[
        TableFormat | None, typer.Option("--format", help="Default: by the ending of FILE; csv where it has none.")
    ] = None,
    file: OutputFile = None,
    units: FileUnits = None,
    header: CsvHeader = None,
    project: Annotated[str | None, typer.Option("--project", metavar="TEXT", help="Project, of a report.")] = None,
    customer: Annotated[str | None, typer.Option("--customer", metavar="TEXT", help="Customer, of a report.")] = None,
    quote: Annotated[str | None, typer.Option("--quote", metavar="TEXT", help="Quote, of a report.")] = None,
    author: Annotated[str | None, typer.Option("--author", metavar="TEXT", help="Author, of a report.")] = None,
    number: Annotated[str | None, typer.Option("--number", metavar="TEXT", help="Number of a report.")] = None,
    revision: Annotated[str | None, typer.Option("--revision", metavar="TEXT", help="Revision of a report.")] = None,
    date: Annotated[str | None, typer.Option("--date", metavar="TEXT", help="Date of a report.")] = None,
    text: Annotated[
        list[str] | None,
        typer.Option(
            "--text",
            metavar="TEXT",
            help="Text of the author in a report: beside the drawing, below the "
            "curves, above what is said of trust; may be repeated.",
        ),
    ] = None,
    appendix: Appendix = None,
    point: Annotated[
        str | None, typer.Option("--point", metavar="VALUE", help='Working point of a report, such as "0.3 N*m".')
    ] = None,
    language: Annotated[
        str | None, typer.Option("--language", metavar="CODE", help="Language of a report, such as uk.")
    ] = None,
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """Write all case rows of a study, or a report of it, to a file or to standard output."""
    from sprag_study.service.client.wire import study_path

    chosen = table_format(form, file, as_json)
    with connection(server, token) as client:
        study_id = study_of(client, study_id)
        block = {"project": project, "customer": customer, "quote": quote, "author": author, "number": number}
        every = {**block, "revision": revision, "date": date, "point": point, "language": language}
        given = [(name, value) for name, value in every.items() if value is not None]
        given += [("text", value) for value in text or ()] + [("appendix", name) for name in appendix or ()]
        table = chosen in get_args(Format)
        require_csv(header, chosen)
        if table and given:
            raise wrong_option(
                f"--{given[0][0]}", "not-used", N_("only reports have it"), given[0][1], allowed="pdf, html"
            )
        asked = [*in_units(units), *given, *([] if header is None else [("header", header)])]
        path = study_path(study_id)
        report = f"{path}/report", [*asked, ("format", chosen)]
        opened = client.rows(path, chosen, asked) if table else client.pieces(*report)
        with opened as pieces:
            written = write_pieces(file, pieces)
    if to_file(file):
        say(_("{file}: {size} bytes", file=file, size=written))
        if as_json:
            write_json({"file": file, "format": chosen, "bytes": written})
