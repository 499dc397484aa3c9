"""The audit log as a file: JSON lines or CSV, piece by piece."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, Any, Final, Literal

from sprag_study.service.answers import filled
from sprag_study.service.answers.people import AuditEntry
from sprag_study.service.exports.text import typed_lines
from sprag_study.service.json_text import list_document, to_bytes
from sprag_study.service.spec.csv_text import escape

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from sprag_study.service.storage.people.audit import AuditRecord

AuditFormat = Literal["json", "csv", "jsonl"]
#: Formats of the log; `json` is a page of it, of the command all of it.
AUDIT_FORMATS: Final[dict[AuditFormat, str]] = {
    "json": "application/json",
    "csv": "text/csv; charset=utf-8",
    "jsonl": "application/jsonl",
}
_PIECE: Final = 500


def entry_json(record: AuditRecord) -> AuditEntry:
    """A row of the log as JSON data."""
    return filled(AuditEntry, record)


def audit_pieces(records: Iterable[AuditRecord], form: AuditFormat) -> Iterator[bytes]:
    """The rows as CSV, with a header, as one JSON object per line, or as one document with all of them."""
    rest = map(entry_json, records)
    if form == "json":
        yield from list_document("entries", map(to_bytes, rest))
        return
    if form == "csv":
        yield typed_lines([list(AuditEntry.__annotations__)])
    while piece := list(islice(rest, _PIECE)):
        if form == "csv":
            yield typed_lines([[_cell(value) for value in entry.values()] for entry in piece])
        else:
            yield b"".join(to_bytes(entry) + b"\n" for entry in piece)


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return escape(to_bytes(value).decode() if isinstance(value, dict) else str(value))
