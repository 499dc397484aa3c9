"""Commands that talk to a running service: submit, and what is shown of a study itself."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from sprag_study.service.cli.common import access, token_sentences, wants_json
from sprag_study.service.cli.configured import read_settings
from sprag_study.service.cli.console import (
    CommandFailureError,
    TroubleError,
    WrongInputError,
    cell_text,
    say,
    show_table,
    table_words,
    tables_in,
    time_text,
    warning_lines,
    write_json,
)
from sprag_study.service.cli.files import naming_points, read_spec, read_study, require_cases
from sprag_study.service.cli.following import show_study, submitted, submitting
from sprag_study.service.cli.names import study_of
from sprag_study.service.cli.options import (
    FinishBy,
    Fresh,
    KeptIn,
    PointsFile,
    SpecFile,
    TableFiles,
    Wait,
    WaitTimeout,
)
from sprag_study.service.cli.running import run_parsed
from sprag_study.service.cli.sources import SpecOrStudy, is_study, refuse_local
from sprag_study.service.cli.stores import require_store, started_in
from sprag_study.service.faults import Fault, FaultError, Kind
from sprag_study.service.languages import _, earlier
from sprag_study.service.login import Access
from sprag_study.worker.limits import MAX_BODY_BYTES, MAX_PRIORITY

if TYPE_CHECKING:
    from collections.abc import Callable

    from sprag_study.service.client import Client, RefusedError
    from sprag_study.service.client.synchronous.connection import Connection
    from sprag_study.service.reading.reader import Reading
    from sprag_study.service.spec.document import ParsedSpec

#: A parameter as in the service's messages: "by=", "at=shaft.load=0.2".
_PARAMETER_IN_TEXT = re.compile(r"(?<![\w.-])(x|y|by|at)=(?=(\w?))")

PriorityOption = Annotated[
    int,
    typer.Option(min=-MAX_PRIORITY, max=MAX_PRIORITY, help="Waiting studies with the highest priority run first."),
]


@contextmanager
def connection() -> Iterator[Client]:
    """A client of the service of the command; its errors become failures of the command."""
    with served_by(access()) as client:
        yield client


@contextmanager
def served_by(access: Access) -> Iterator[Client]:
    """A client of a service; its errors become failures of the command."""
    from sprag_study.service.client import Client

    try:
        client = Client(access.server, access.token)
    except ValueError as error:
        raise WrongInputError("invalid-parameter", str(error)) from error
    with client, _failing(access):
        yield client


@contextmanager
def _failing(access: Access | None = None) -> Iterator[None]:
    """Errors of a connection as failures of the command."""
    from sprag_study.service.client import (
        ArgumentError,
        RefusedError,
        StudyTimeoutError,
        UnreachableError,
        UntrustedError,
    )

    try:
        yield
    except UntrustedError as error:
        raise TroubleError(
            "unreachable",
            f"{error}; SSL_CERT_FILE names a PEM file with the certificate of its issuer.",
        ) from error
    except UnreachableError as error:
        raise TroubleError(
            "unreachable",
            _(
                "No Sprag service at {address} ({why}); start one with `sprag serve` or name another with --server.",
                address=error.address,
                why=error.reason,
            ),
        ) from error
    except RefusedError as error:
        raise refusal(error, access) from error
    except ArgumentError as error:
        raise WrongInputError("invalid-parameter", _("invalid argument"), error.faults) from error
    except StudyTimeoutError as error:
        raise TroubleError("not-done", _("{what}; it continues.", what=error)) from error


def refusal(error: RefusedError, access: Access | None = None) -> CommandFailureError:
    """The failure of the command for a refusal; of a service, with advice about its token."""
    kind = cast("Kind", error.code)
    if error.status == 401 and access is not None:
        advice = (
            _("Give the service's token with --token or in SPRAG_TOKEN, or keep it with `sprag login`.")
            if access.takes_variable
            else _("Give the service's token with --token, or log in again with `sprag login`.")
        )
        return TroubleError(kind, " ".join([earlier.said(_(error.detail)), *token_sentences(access), advice]))
    if error.status in (403, 421) or error.status >= 500:
        return TroubleError(kind, error.detail)
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
    return WrongInputError(kind, str(title) if faults and title else error.detail, faults)


def _option(parameter: object) -> str:
    """The option for a parameter of a request."""
    return "--" + str(parameter).replace("_", "-")


def opened(
    text: str, *, points: str | None = None, tables: list[str] | None = None, db: str | None = None,
    change: Callable[[object], object] | None = None, check: Callable[[ParsedSpec], None] | None = None,
    units: str | None = None, case: int | None = None, **of_spec: Any,
) -> AbstractContextManager[tuple[Connection, str]]:  # fmt: skip
    """Who is asked about a study, and its id: a service, or the database in which the study of a spec is run first.

    The options are checked at once; a spec is run when the context is entered. ``change`` completes the spec, ``check``
    looks at its study, and so is refused what it has not of ``units`` and ``case``; ``of_spec`` are further options
    that only a spec has.
    """
    if is_study(text):
        refuse_local(**of_spec, points_file=points, tables=tables, db=db)
        return _asked(text)
    require_store(db)
    parsed = read_study(text, points, started_in(db, change), tables)
    say(*warning_lines(parsed.warnings))
    if units is not None:
        _reading(parsed, units)
    if case is not None:
        from sprag_study.worker.planning import most_cases

        require_cases(parsed.study, [case], most_cases(parsed.study))
    if check is not None:
        check(parsed)
    return _run(parsed, db)


@contextmanager
def _asked(text: str) -> Iterator[tuple[Connection, str]]:
    with connection() as client:
        yield client, study_of(client, text)


@contextmanager
def _run(parsed: ParsedSpec, db: str | None) -> Iterator[tuple[Connection, str]]:
    from sprag_study.service.here import Here

    settings = read_settings(database=db)
    with _failing(), run_parsed(parsed, settings, db=db) as done:
        yield Here(done.store, settings), done.record.id


@contextmanager
def read_in(source: Connection, study_id: str, units: str | None) -> Iterator[Callable[[], Reading]]:
    """What gives the reading of a study of `opened` on a terminal; tables within the block have its ``units``.

    Without them nothing is loaded that knows the models. Raises WrongInputError for units that it has not.
    """
    from sprag_study.service.client.wire import study_path

    def detail() -> dict[str, Any]:
        return source.request("GET", study_path(study_id))

    if units is None:

        def plain() -> Reading:
            from sprag_study.service.reading.reader import Reading

            return Reading(detail()["model"])

        yield plain
        return
    from sprag_study.service.spec.document import parse_spec

    reading = _reading(parse_spec(detail()["spec"]), units)
    with tables_in(reading.units):
        yield lambda: reading


def _reading(parsed: ParsedSpec, units: str) -> Reading:
    """The reading of a study in units; raises WrongInputError for units that it has not."""
    from sprag_study.service.reading.reader import Choice, reading_for

    try:
        return reading_for(parsed.study, parsed.spec, Choice(units))
    except FaultError as error:
        faults = [replace(fault, where="--units") for fault in error.faults]
        raise WrongInputError("invalid-parameter", _("invalid option"), faults) from error


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
) -> None:
    """Submit a study to the service and print its id."""
    from sprag_study.service.client.queries import query_of

    data = read_spec(spec, points, MAX_BODY_BYTES, tables)
    query = query_of({"priority": priority or None, "fresh": fresh, "finish_by": finish_by})
    with naming_points(points), connection() as client:
        with submitting():
            study = client.request("POST", "/studies", json=data, key=key or "", params=query)
        submitted(client, study, wait, timeout)


def state(
    study_id: SpecOrStudy,
    points_file: PointsFile = None,
    tables: TableFiles = None,
    db: KeptIn = None,
) -> None:
    """Show the state of a study: how far it is, how it ended, where it runs; of a spec what it would be."""
    from sprag_study.service.client.wire import study_path

    if not is_study(study_id):
        from sprag_study.service.cli.local import check

        check(study_id, points_file, tables, db)
        return
    refuse_local(points_file=points_file, tables=tables, db=db)
    with connection() as client:
        show_study(client.request("GET", study_path(study_of(client, study_id))))


def study_named(text: str, points: str | None, tables: list[str] | None, db: str | None = None) -> ParsedSpec:
    """The checked study of a spec file, as `read_study` gives it, or of a study of the service, to be run here.

    ``db`` is the database with the case from whose end the drive of a spec starts.
    """
    from sprag_study.service.client.wire import study_path
    from sprag_study.service.spec.document import parse_spec

    if not is_study(text):
        require_store(db)
        return read_study(text, points, started_in(db), tables)
    refuse_local(points_file=points, tables=tables, db=db)
    with connection() as client:
        return parse_spec(client.request("GET", study_path(study_of(client, text)))["spec"])


def views_of(text: str, names: Iterable[str]) -> list[str]:
    """Those of the views by these names that a study has; all where it cannot be asked, or the models are missing."""
    try:
        from sprag_study.service.views.cases import CASE_VIEWS
        from sprag_study.service.views.studies import STUDY_VIEWS

        study = study_named(text, None, None).study
    except (CommandFailureError, ModuleNotFoundError):
        return [*names]
    views: dict[str, Any] = {**STUDY_VIEWS, **CASE_VIEWS}
    return [name for name in names if name not in views or views[name].has(study)]


def rounds(
    study: SpecOrStudy,
    points_file: PointsFile = None,
    tables: TableFiles = None,
    db: KeptIn = None,
) -> None:
    """List the rounds of a study that chooses its own cases, with what was known before each."""
    from sprag_study.service.client.wire import study_path

    with opened(study, points=points_file, tables=tables, db=db) as (source, study_id):
        found = source.request("GET", f"{study_path(study_id)}/rounds")
    if wants_json():
        write_json(found)
        return
    with table_words():
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
