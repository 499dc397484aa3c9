"""Commands that talk to a running service: submit, watch, list, pause, resume, cancel, export, curve."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli.console import (
    CommandFailureError,
    ExitCode,
    TroubleError,
    WrongInputError,
    cell_text,
    progress_bar,
    progress_text,
    say,
    show_table,
    write_json,
)
from service.cli.files import read_spec, write_pieces
from service.cli.options import DEFAULT_SERVER, JsonFlag, OutputFile, Server, SpecFile, StudyId, Token
from service.spec_messages import Problem
from worker.states import TERMINAL, StudyState

if TYPE_CHECKING:
    from service.client import RefusedError, ServiceClient
    from service.exports import Format

#: Seconds between two looks at a study that is being watched.
_POLL_SECONDS = 0.25
_ENDED = {state.value for state in TERMINAL}
#: A parameter with its sign, as the service's messages write it: "by=", "at=shaft.load=0.2".
_PARAMETER_IN_TEXT = re.compile(r"(?<![\w.-])(x|y|by|at)=(?=(\w?))")
_PICTURES = ("svg", "png", "pdf")


class TableFormat(StrEnum):
    """Formats of case rows, as `service.exports` has them."""

    CSV = "csv"
    JSON = "json"
    JSONL = "jsonl"
    PARQUET = "parquet"
    ARROW = "arrow"
    XLSX = "xlsx"
    NETCDF = "netcdf"


@contextmanager
def connection(server: str, token: str | None) -> Iterator[ServiceClient]:
    """A client of the service; its failures become failures of the command."""
    from service.client import RefusedError, ServiceClient, UnreachableError

    try:
        client = ServiceClient(server, token)
    except ValueError as error:
        raise WrongInputError(str(error)) from error
    with client:
        try:
            yield client
        except UnreachableError as error:
            raise TroubleError(
                f"No Sprag service at {error.address} ({error.reason}); start one with `sprag serve` or name another "
                "with --server."
            ) from error
        except RefusedError as error:
            raise refusal(error) from error


def refusal(error: RefusedError) -> CommandFailureError:
    """The failure of the command that the service's refusal means."""
    if error.status == 401:
        return TroubleError(f"{error} Give the service's token with --token or in SPRAG_TOKEN.")
    if error.status in (403, 421) or error.status >= 500:
        return TroubleError(str(error))
    problems = [
        Problem(
            _option(item["parameter"]) if item.get("parameter") else str(item.get("pointer") or ""),
            _PARAMETER_IN_TEXT.sub(
                lambda found: f"{_option(found[1])}{found[2] and ' '}", str(item.get("message", "is wrong"))
            ),
            item.get("value"),
            allowed=item.get("allowed"),
            unit=item.get("unit"),
        )
        for item in error.errors
    ]
    title = error.problem.get("title")
    return WrongInputError(str(title) if problems and title else str(error), problems=problems)


def _option(parameter: object) -> str:
    """A parameter of a request as the command line calls it."""
    return "--" + str(parameter).replace("_", "-")


def submit(
    spec: SpecFile,
    wait: Annotated[bool, typer.Option("--wait", help="Wait until the study has ended.")] = False,
    key: Annotated[
        str | None, typer.Option("--key", metavar="KEY", help="Idempotency key: the same key submits the study once.")
    ] = None,
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """Submit a study to the service and print its id."""
    data = read_spec(spec)
    with connection(server, token) as client:
        study = client.create_study(data, key)
        say(*(f"warning: {warning}" for warning in study.get("warnings", ())))
        if wait:
            study = follow(client, study["id"])
    _show_study(study, as_json)
    if wait:
        _exit_as(study)


def watch(study_id: StudyId, server: Server = DEFAULT_SERVER, token: Token = None, as_json: JsonFlag = False) -> None:
    """Follow a study until it has ended."""
    with connection(server, token) as client:
        study = follow(client, study_id)
    _show_study(study, as_json)
    _exit_as(study)


def follow(client: ServiceClient, study_id: str) -> dict[str, Any]:
    """Look at a study until it has ended, with a bar on standard error; the study as it is then.

    A held study is not left by itself: its reason is said, and the watching goes on until it is resumed or cancelled.
    """
    told = None
    with progress_bar(study_id) as update:
        while True:
            study = client.study(study_id)
            progress = study["progress"]
            update(progress["done"], progress["total"], _remark(study))
            if study["state"] in _ENDED:
                return study
            if study["state"] == StudyState.PAUSED and study.get("reason") != told:
                told = study.get("reason")
                say(f"{study_id} is paused: {told or 'somebody asked for it'}")
            time.sleep(_POLL_SECONDS)


def _remark(study: dict[str, Any]) -> str:
    progress = study["progress"]
    left = progress["seconds_left"]
    return progress_text(study["state"], progress["rate"], None if left is None else (left["low"], left["high"]))


def _exit_as(study: dict[str, Any]) -> None:
    """End with the code that tells whether every case ended ok."""
    progress = study["progress"]
    if progress["ok"] != progress["total"]:
        raise typer.Exit(ExitCode.NOT_ALL_OK)


def _show_study(study: dict[str, Any], as_json: bool) -> None:
    if as_json:
        write_json(study)
        return
    print(study["id"])
    from worker.kernels import OK

    progress = study["progress"]
    endings = ", ".join(f"{count} {name}" for name, count in progress.get("endings", {}).items() if name != OK)
    say(
        f"{study['name'] or study['model']}: {study['state']}, {progress['done']} of {progress['total']} cases done, "
        f"{progress['ok']} ok" + (f" ({endings})" if endings else "")
    )


def list_studies(
    state: Annotated[StudyState | None, typer.Option(help="Only studies in this state.")] = None,
    limit: Annotated[int, typer.Option(min=1, max=100_000, help="Most studies to show, newest first.")] = 50,
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """List the studies of the service, newest first."""
    with connection(server, token) as client:
        studies = list(_pages(client, state, limit))
    if as_json:
        write_json({"studies": studies})
        return
    columns = (("id", False), ("state", False), ("done", True), ("cases", True), ("created", False), ("name", False))
    rows = [
        (s["id"], s["state"], s["progress"]["done"], s["progress"]["total"], s["created_at"], s["name"])
        for s in studies
    ]
    show_table("", columns, rows)


def _pages(client: ServiceClient, state: StudyState | None, limit: int) -> Iterator[dict[str, Any]]:
    token: str | None = None
    while limit > 0:
        query = [("page_size", str(min(limit, 100)))]
        if state is not None:
            query.append(("state", state.value))
        if token:
            query.append(("page_token", token))
        page = client.studies(query)
        yield from page["studies"][:limit]
        limit -= len(page["studies"])
        token = page.get("next_page_token")
        if not token:
            return


def _act(study_id: str, verb: str, server: str, token: str | None, as_json: bool) -> None:
    with connection(server, token) as client:
        study = client.act(study_id, verb)
    _show_study(study, as_json)


def cancel(study_id: StudyId, server: Server = DEFAULT_SERVER, token: Token = None, as_json: JsonFlag = False) -> None:
    """Cancel a study; the cases that are done are kept."""
    _act(study_id, "cancel", server, token, as_json)


def pause(study_id: StudyId, server: Server = DEFAULT_SERVER, token: Token = None, as_json: JsonFlag = False) -> None:
    """Hold a study: cases that are running are finished, no new ones are started."""
    _act(study_id, "pause", server, token, as_json)


def resume(study_id: StudyId, server: Server = DEFAULT_SERVER, token: Token = None, as_json: JsonFlag = False) -> None:
    """Go on with a study that is held."""
    _act(study_id, "resume", server, token, as_json)


def export(
    study_id: StudyId,
    form: Annotated[TableFormat | None, typer.Option("--format", help="Default: as FILE ends, else csv.")] = None,
    file: OutputFile = None,
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """Write all case rows of a study to a file or to standard output."""
    chosen = table_format(form, file, as_json)
    with connection(server, token) as client:
        written = write_pieces(file, client.results(study_id, chosen))
    if file not in (None, "-"):
        say(f"{file}: {written} bytes")


def table_format(form: TableFormat | None, file: str | None, as_json: bool) -> Format:
    """The format of case rows that was asked for: by name, by ``--json``, or by the ending of the file's name."""
    from service.exports import FORMATS, format_of

    if form is not None:
        return next(known for known in FORMATS if known == form.value)
    return "json" if as_json else format_of(file or "") or "csv"


def curve(
    study_id: StudyId,
    x: Annotated[str, typer.Option("--x", metavar="PATH", help="Axis along the curve, such as shaft.load.")],
    y: Annotated[list[str], typer.Option("--y", metavar="RESULT", help="Result to draw; may be given again.")],
    by: Annotated[
        list[str] | None, typer.Option("--by", metavar="PATH", help="Axis with one curve for each value.")
    ] = None,
    at: Annotated[
        list[str] | None, typer.Option("--at", metavar="PATH=VALUE", help="Value at which another axis is held.")
    ] = None,
    file: Annotated[
        str | None, typer.Option("-o", "--output", metavar="FILE", help="Picture to write: .svg, .png or .pdf.")
    ] = None,
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """Show results against an axis as a table, and write them as a picture."""
    picture = (file or "").rpartition(".")[2].lower()
    if file is not None and picture not in _PICTURES:
        raise WrongInputError(
            "an option is wrong",
            problems=[
                Problem("--output", "no kind of picture", file, allowed="a name that ends in .svg, .png or .pdf")
            ],
        )
    query = [("x", x), *(("y", name) for name in y), *(("by", path) for path in by or ())]
    query += [("at", item) for item in at or ()]
    with connection(server, token) as client:
        found = client.curves(study_id, query)
        if file is not None:
            write_pieces(file, client.picture(study_id, query, picture))
    if as_json:
        write_json(found)
    else:
        show_curves(found)
    if file is not None:
        say(f"picture: {file}")


def show_curves(found: dict[str, Any]) -> None:
    """One table for each curve: the axis, then every result against it."""
    from worker.kernels import OK

    x = found["x"]
    columns = [(_heading(x["path"], x["unit"]), True)]
    columns += [(_heading(name, result["unit"]), True) for name, result in found["results"].items()]
    columns.append(("ending", False))
    for drawn in found["curves"]:
        held = {**drawn["by"], **drawn["at"]}
        title = ", ".join(f"{path} = {cell_text(value)}" for path, value in held.items())
        rows = zip(drawn["x"], *drawn["y"].values(), drawn["endings"], strict=True)
        show_table(title, columns, [(*row[:-1], "" if row[-1] == OK else row[-1]) for row in rows])


def _heading(name: str, unit: str) -> str:
    return name if unit == "1" else f"{name} [{unit}]"
