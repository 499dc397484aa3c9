"""``sprag admin audit``: who changed what, when and from where, in a service or in a database."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Final

import typer

from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.console import WrongInputError
from sprag_study.service.cli.files import write_pieces
from sprag_study.service.cli.options import Database, OutputFile
from sprag_study.service.cli.remote import connection
from sprag_study.service.cli.stores import asks_service, named_store
from sprag_study.service.faults import FaultError
from sprag_study.service.json_text import list_document
from sprag_study.service.languages import _

if TYPE_CHECKING:
    from sprag_study.service.exports.audit import AuditFormat


class AuditForm(StrEnum):
    """Formats of the audit log."""

    CSV = "csv"
    JSONL = "jsonl"


Since = Annotated[
    str | None, typer.Option("--since", metavar="TIME", help="From this date or time on, such as 2027-01-31.")
]
Until = Annotated[str | None, typer.Option("--until", metavar="TIME", help="Up to this time; of a date the whole day.")]
Actor = Annotated[
    str | None, typer.Option("--actor", metavar="NAME", help="Only changes by this user, token or schedule.")
]
Action = Annotated[
    str | None, typer.Option("--action", metavar="ACTION", help="Only this action, such as study.delete.")
]
Target = Annotated[
    str | None, typer.Option("--target", metavar="ID", help="Only changes of this study, schedule, token or user.")
]
FormOption = Annotated[
    AuditForm | None,
    typer.Option("--format", help="A CSV row or a JSON object for each change; default: csv, with --json a document."),
]
#: Names of the filters, in the order of `audit_filter`.
_FILTERS: Final = ("since", "until", "actor", "action", "target")


def audit(
    since: Since = None,
    until: Until = None,
    actor: Actor = None,
    action: Action = None,
    target: Target = None,
    form: FormOption = None,
    output: OutputFile = None,
    db: Database = None,
) -> None:
    """Write the audit log: who changed what, when and from where; earliest first."""
    wanted = since, until, actor, action, target
    if not asks_service(db):
        write_stored(wanted, form, output, db)
        return
    document = form is None and wants_json()
    query = [("format", "jsonl" if document else form or AuditForm.CSV)]
    query += [(name, text) for name, text in zip(_FILTERS, wanted, strict=True) if text]
    with connection() as client, client.pieces("/audit", query) as pieces:
        write_pieces(output, list_document("entries", _lines(pieces)) if document else pieces)


def write_stored(wanted: tuple[str | None, ...], form: AuditForm | None, output: str | None, db: str | None) -> None:
    """Write the rows of a database that are ``wanted``, in the order of `audit_filter`; raises WrongInputError."""
    from sprag_study.service.exports.audit import audit_pieces
    from sprag_study.service.storage.people.audit import audit_filter

    try:
        rows = audit_filter(*wanted)
    except FaultError as error:
        named = [replace(fault, where=f"--{fault.where}") for fault in error.faults]
        raise WrongInputError("invalid-parameter", _("invalid option"), named) from error
    with named_store(db) as store:
        usual: AuditFormat = "json" if wants_json() else "csv"
        write_pieces(output, audit_pieces(store.audit.rows(rows), form.value if form else usual))


def _lines(pieces: Iterable[bytes]) -> Iterator[bytes]:
    """The lines of a text that comes in pieces of any length, each of them ended."""
    rest = b""
    for piece in pieces:
        *lines, rest = (rest + piece).split(b"\n")
        yield from lines
