"""The audit log: who changed what, when, and from where.

Every change writes its row in its own transaction, so there is neither a change without a row nor a row without one.
What the worker does with a study by itself (its cases, rounds, end) is no row: the study has it.

Whoever saves what people edit names the edition that was read, so that no edit in between is lost.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from datetime import UTC, date, datetime, time, timedelta
from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa

from sprag_study.service.actor import acting
from sprag_study.service.faults import parameter_error
from sprag_study.service.languages import N_
from sprag_study.service.storage.errors import ChangedMeanwhileError, NotOwnerError, PageTokenError
from sprag_study.service.storage.part import MAX_INTEGER, Part, micros_of, moment
from sprag_study.service.storage.people.tables import AUDIT_LOG

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping


def edition_of(*content: object) -> str:
    """A short name for exactly this content, plain data and times; equal content has equal names."""
    text = json.dumps(content, default=str, sort_keys=True)
    return hashlib.sha256(text.encode("utf-8", "backslashreplace")).hexdigest()[:16]


def require_edition(kind: str, identity: str, present: str, read: Collection[str] | None) -> None:
    """Raise ChangedMeanwhileError unless the ``present`` edition is among those ``read``; None: any will do."""
    if read is not None and present not in read:
        raise ChangedMeanwhileError(
            f"the {kind} {identity} was changed after it was read, so nothing was saved: read it again first"
        )


_A = AUDIT_LOG.c
#: Rows read at a time for a file of the whole log.
_BLOCK: Final = 1000
_LONGEST: Final = 200
#: Names of what else is to be known of a change, in words; those that other pages have are in the catalogue already.
WORDS: Final = (
    N_("most cases"),
    N_("most bytes"),
    N_("most checks"),
    N_("login"),
    N_("instead of"),
    N_("account forgotten"),
    N_("sessions ended"),
    N_("role kept"),
    N_("role of groups"),
    N_("issuer"),
    N_("query"),
    N_("place"),
)
#: Longest text of a change, such as notes.
_LONGEST_VALUE: Final = 500
TIME_ALLOWED: Final = N_("a date or time such as 2027-01-31 or 2027-01-31T06:00+01:00; without an offset it is UTC")


@dataclass(frozen=True, slots=True)
class AuditRecord:
    """A row of the audit log. ``detail`` is what else is to be known of the change, as plain data."""

    number: int
    at: datetime
    door: str
    actor: str
    token: str | None
    address: str
    request: str | None
    action: str
    target: str
    detail: dict[str, Any]


@dataclass(frozen=True, slots=True)
class AuditFilter:
    """Which rows are wanted: from ``since`` until before ``until``, and of one actor, action and target."""

    since: datetime | None = None
    until: datetime | None = None
    actor: str | None = None
    action: str | None = None
    target: str | None = None

    def conditions(self) -> list[sa.ColumnElement[bool]]:
        """The conditions of a query."""
        if any("\0" in text for text in (self.actor, self.action, self.target) if text):
            return [sa.false()]  # no text that is stored has one, and PostgreSQL takes none
        found = [_A[name] == value for name in ("actor", "action", "target") if (value := getattr(self, name))]
        if self.since is not None:
            found.append(_A.at >= micros_of(self.since))
        if self.until is not None:
            found.append(_A.at < micros_of(self.until))
        return found


def audit_filter(
    since: str | None, until: str | None, actor: str | None, action: str | None, target: str | None
) -> AuditFilter:
    """The filter of a query; FaultError about a time that cannot be read."""
    return AuditFilter(
        _moment("since", since), _moment("until", until, last=True), actor or None, action or None, target or None
    )


def _moment(name: str, text: str | None, *, last: bool = False) -> datetime | None:
    if not text:
        return None
    try:
        if len(text) == len("2027-01-31"):
            return datetime.combine(date.fromisoformat(text), time(), UTC) + timedelta(days=int(last))
        found = datetime.fromisoformat(text)
        return (found if found.tzinfo else found.replace(tzinfo=UTC)).astimezone(UTC)
    except (ValueError, OverflowError):
        raise parameter_error(name, "invalid-time", "is not a time", text, TIME_ALLOWED) from None


@dataclass(frozen=True, slots=True)
class AuditPage:
    """A page of the log, latest first; ``next_token`` is None on the last."""

    records: tuple[AuditRecord, ...]
    next_token: str | None


def note(connection: sa.Connection, now: int, action: str, target: str, /, **detail: Any) -> None:
    """Write a row at ``now`` (µs since 1970) for the present actor (`acting`), in the transaction of the change."""
    actor = acting()
    values = {
        "at": now,
        "door": actor.door.value,
        "actor": actor.name[:_LONGEST],
        "token": actor.token,
        "address": actor.address[:_LONGEST],
        "request": actor.request,
        "action": action,
        "target": target[:_LONGEST],
        "detail": json.dumps(detail, ensure_ascii=False, allow_nan=False),
    }
    connection.execute(sa.insert(AUDIT_LOG).values(values))


def differences(before: Mapping[str, Any], after: Mapping[str, Any]) -> dict[str, Any]:
    """What differs of plain values, before and after, as detail of a row, with long texts cut; empty: nothing."""
    changes = {name: [_cut(before[name]), _cut(after[name])] for name in after if before[name] != after[name]}
    return {"changes": changes} if changes else {}


def _cut(value: Any) -> Any:
    return f"{value[:_LONGEST_VALUE]}…" if isinstance(value, str) and len(value) > _LONGEST_VALUE else value


def require_owner(kind: str, identity: str, owner: str | None) -> None:
    """Raise NotOwnerError where the present actor may not change what belongs to ``owner``."""
    actor = acting()
    if owner is not None and owner != actor.user and not actor.everything:
        raise NotOwnerError(f"the {kind} {identity} belongs to {owner}")


def by_sender(column: sa.ColumnElement[str]) -> sa.ColumnElement[bool]:
    """Condition: an idempotency key was sent by the present actor.

    A token without a user also has the keys of nobody: those of a service that needed no token yet, and of tokens
    without a user before revision 0033.
    """
    actor = acting()
    return column.in_([actor.share] if actor.user is not None else sorted({actor.share, ""}))


class Audit(Part):
    """The audit log of a database."""

    def note(self, action: str, target: str, /, **detail: Any) -> None:
        """Write a row about a change that is not one of the database's own."""
        with self.session.write() as connection:
            note(connection, self._now(), action, target, **detail)

    def page(self, wanted: AuditFilter, page_size: int = 100, page_token: str | None = None) -> AuditPage:
        """A page of the log, latest first; raises PageTokenError."""
        query = sa.select(AUDIT_LOG).where(*wanted.conditions())
        if page_token is not None:
            if not (page_token.isascii() and page_token.isdigit() and len(page_token) < 19):
                raise PageTokenError(f"{page_token[:40]!r} is not a page token of this list")
            query = query.where(_A.number < min(int(page_token), MAX_INTEGER))
        rows = self._all(query.order_by(_A.number.desc()).limit(page_size + 1))
        found = tuple(map(_audit_record, rows[:page_size]))
        return AuditPage(found, str(found[-1].number) if len(rows) > page_size else None)

    def rows(self, wanted: AuditFilter) -> Iterator[AuditRecord]:
        """All rows of the log, earliest first, read in blocks."""
        last = 0
        query = sa.select(AUDIT_LOG).where(*wanted.conditions()).order_by(_A.number).limit(_BLOCK)
        while True:
            rows = self._all(query.where(_A.number > last))
            yield from map(_audit_record, rows)
            if len(rows) < _BLOCK:
                return
            last = rows[-1].number

    def prune(self, before: datetime) -> int:
        """Delete the rows from before ``before``; returns their number, of which the log keeps a row itself."""
        with self.session.write() as connection:
            gone = connection.execute(sa.delete(AUDIT_LOG).where(_A.at < micros_of(before))).rowcount
            if gone:
                note(connection, self._now(), "audit.delete", "", rows=gone, before=before.isoformat())
        return gone


def _audit_record(row: Any) -> AuditRecord:
    own = {"at": moment(row.at), "detail": json.loads(row.detail)}
    return AuditRecord(**{name: own.get(name, getattr(row, name)) for name in AuditRecord.__slots__})
