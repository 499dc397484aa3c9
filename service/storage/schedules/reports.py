"""Reports of schedules, and alerts, that are to be sent: an outbox.

A report is written in the transaction that finds its run over, so that none is lost; it is claimed for a time before it
is sent, so that no two processes send it at once, and marked as sent afterwards. A process that is killed between
sending and marking lets it be sent again under the same id, by which its recipient can recognise it.
"""

from __future__ import annotations

import json
import secrets
from dataclasses import dataclass
from datetime import timedelta
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa

from sprag_study.service.delivery import origin_of
from sprag_study.service.storage.part import Part, micros_of, moment, optional_moment
from sprag_study.service.storage.people.audit import note
from sprag_study.service.storage.schedules.tables import REPORTS, SCHEDULES
from sprag_study.service.storage.stored_sentences import sentence_in, written

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from datetime import datetime

_P, _S = REPORTS.c, SCHEDULES.c
#: For so long a process may take to send a report before another one tries.
CLAIM: Final = timedelta(minutes=10)


class ReportState(StrEnum):
    """State of a report."""

    WAITING = "waiting"
    SENT = "sent"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class Claimed:
    """A report that this process is to send, for the ``attempts``-th time.

    ``content`` is what it says, and ``schedule`` the id of its schedule; "" for an alert.
    """

    number: int
    id: str
    schedule: str
    channel: str
    target: str
    content: dict[str, Any]
    attempts: int
    created_at: datetime
    claimed_until: datetime


@dataclass(frozen=True, slots=True)
class ReportRecord:
    """A report: ``ended_at`` is when it was sent or given up, ``problem`` why the last attempt failed."""

    id: str
    kind: str
    channel: str
    target: str
    state: ReportState
    attempts: int
    created_at: datetime
    ended_at: datetime | None
    problem: str | None


def add_reports(
    connection: sa.Connection,
    now: int,
    schedule: int | None,
    due: int,
    kind: str,
    targets: Iterable[tuple[str, str]],
    content: Mapping[str, Any],
) -> int:
    """Add a report for each channel and target, unless it is there, at ``now`` (µs since 1970); returns how many."""
    this = sa.select(_P.channel, _P.target).where(_P.schedule == schedule, _P.due == due, _P.kind == kind)
    known = {(row.channel, row.target) for row in connection.execute(this)}
    rows = [
        {
            "id": f"rp_{secrets.token_hex(12)}",
            "schedule": schedule,
            "due": due,
            "kind": kind,
            "channel": channel,
            "target": target,
            "content": json.dumps(content, allow_nan=False),
            "state": ReportState.WAITING.value,
            "attempts": 0,
            "next_try": now,
            "created_at": now,
        }
        for channel, target in targets
        if (channel, target) not in known
    ]
    if rows:
        connection.execute(sa.insert(REPORTS), rows)
    return len(rows)


class Reports(Part):
    """The outbox."""

    def claim(self) -> Claimed | None:
        """Claim the report that has waited longest; None where none is to be sent now."""
        now = self._now()
        end = now + CLAIM // timedelta(microseconds=1)
        # A claim from after `end` was made by a clock that has been put back since.
        free = _P.claimed_until.is_(None) | (_P.claimed_until <= now) | (_P.claimed_until > end)
        query = (
            sa.select(REPORTS, _S.id.label("schedule_id"))
            .outerjoin_from(REPORTS, SCHEDULES)
            .where(_P.state == ReportState.WAITING.value, _P.next_try <= now, free)
            .order_by(_P.next_try, _P.number)
            .limit(1)
        )
        with self.session.read() as connection:
            if connection.execute(query).first() is None:
                return None
        with self.session.write() as connection:
            row = connection.execute(query).first()
            if row is None:
                return None
            connection.execute(
                sa.update(REPORTS).where(_P.number == row.number).values(claimed_until=end, attempts=row.attempts + 1)
            )
        return Claimed(
            row.number,
            row.id,
            row.schedule_id or "",
            row.channel,
            row.target,
            json.loads(row.content),
            row.attempts + 1,
            moment(row.created_at),
            moment(end),
        )

    def sent(self, report: Claimed) -> None:
        """Record that the report was sent."""
        with self.session.write() as connection:
            if self._end(
                connection, report, state=ReportState.SENT.value, ended_at=self._now(), **written("problem", None)
            ):
                note(connection, self._now(), "report.send", report.schedule, **_logged(report))

    def failed(self, report: Claimed, problem: str, next_try: datetime | None) -> None:
        """Record why the report was not sent, with the values of a Sentence; with ``next_try`` None it is given up."""
        why = written("problem", problem)
        with self.session.write() as connection:
            if next_try is not None:
                self._end(connection, report, next_try=micros_of(next_try), **why)
                return
            if self._end(connection, report, state=ReportState.FAILED.value, ended_at=self._now(), **why):
                note(connection, self._now(), "report.fail", report.schedule, **_logged(report), problem=str(problem))

    @staticmethod
    def _end(connection: sa.Connection, report: Claimed, **values: object) -> bool:
        """End the claim, unless it has passed to another process."""
        own = (_P.number == report.number) & (_P.claimed_until == micros_of(report.claimed_until))
        return bool(connection.execute(sa.update(REPORTS).where(own).values(claimed_until=None, **values)).rowcount)

    def between(self, since: datetime, until: datetime) -> dict[tuple[str, datetime], list[ReportRecord]]:
        """Reports of the due times from ``since`` until ``until``, by id of the schedule and due time."""
        query = (
            sa.select(REPORTS, _S.id.label("schedule_id"))
            .join_from(REPORTS, SCHEDULES)
            .where(_P.due >= micros_of(since), _P.due <= micros_of(until))
            .order_by(_P.number)
        )
        found: dict[tuple[str, datetime], list[ReportRecord]] = {}
        with self.session.read() as connection:
            for row in connection.execute(query):
                record = ReportRecord(
                    row.id,
                    row.kind,
                    row.channel,
                    row.target,
                    ReportState(row.state),
                    row.attempts,
                    moment(row.created_at),
                    optional_moment(row.ended_at),
                    sentence_in(row, "problem"),
                )
                found.setdefault((row.schedule_id, moment(row.due)), []).append(record)
        return found

    def prune(self, before: datetime) -> int:
        """Delete the reports that were sent or given up before ``before``; returns their number."""
        with self.session.write() as connection:
            return connection.execute(sa.delete(REPORTS).where(_P.ended_at < micros_of(before))).rowcount


def _logged(report: Claimed) -> dict[str, Any]:
    to = origin_of(report.target) if report.channel == "webhook" else report.target  # its path can be a secret
    return {"report": report.id, "channel": report.channel, "to": to, "attempts": report.attempts}
