"""Schedules in the database: create, read, change, delete; and studies that are bound to the window of theirs.

Such a study is held outside its window and queued again inside.
"""

from __future__ import annotations

import secrets
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa

from sprag_study.sentences import Sentence
from sprag_study.service.actor import acting
from sprag_study.service.languages import recorded
from sprag_study.service.storage.deployment import ANY_SCHEDULE
from sprag_study.service.storage.errors import IdempotencyConflictError, ScheduleNotFoundError, TooManySchedulesError
from sprag_study.service.storage.part import Part, change_row, micros_of, moment, move_row, optional_moment
from sprag_study.service.storage.people.audit import by_sender, note, require_edition, require_owner
from sprag_study.service.storage.people.pools import pool_of
from sprag_study.service.storage.schedules.runs import RunRecord, ScheduleRecord, refuse_open_runs, runs_of
from sprag_study.service.storage.schedules.tables import (
    SCHEDULE_RUNS,
    SCHEDULES,
    fields_of,
    logged_changes,
    logged_fields,
    row_values,
    window_of,
)
from sprag_study.service.storage.tables import ENDED, STUDIES, WAITS_FOR_WINDOW
from sprag_study.worker.limits import MAX_SCHEDULES
from sprag_study.worker.states import StudyEvent, StudyState

if TYPE_CHECKING:
    from collections.abc import Collection
    from datetime import datetime

    from sprag_study.service.schedules.fields import ScheduleFields
    from sprag_study.service.schedules.times import Window

_S, _R = SCHEDULES.c, SCHEDULE_RUNS.c
#: Number of latest runs reported for a schedule.
SHOWN_RUNS: Final = 20


@dataclass(frozen=True, slots=True)
class BoundStudy:
    """An unfinished study that is bound to a window. ``held`` states whether it waits for the window.

    ``window`` is None where the schedule no longer has one.
    """

    number: int
    state: StudyState
    held: bool
    reason: str | None
    window: Window | None
    schedule: str


class Schedules(Part):
    """The schedules of a database."""

    def create(
        self, fields: ScheduleFields, *, idempotency_key: str | None = None, body_hash: str = ""
    ) -> ScheduleRecord:
        """Store a new schedule; raises TooManySchedulesError.

        A key that was used before with the same ``body_hash`` returns the schedule of that request; with another hash
        it raises IdempotencyConflictError. Keys of other senders do not count.
        """
        schedule_id = f"sc_{secrets.token_hex(8)}"
        with self.session.write() as connection:
            if idempotency_key is not None:
                earlier = _schedule_of_key(connection, idempotency_key, body_hash)
                if earlier is not None:
                    return earlier
            pool = pool_of(connection, SCHEDULES, _S.deleted_at.is_(None), MAX_SCHEDULES)
            if not pool.takes():
                raise TooManySchedulesError(pool.refusal("schedules"))
            own = {"id": schedule_id, "created_at": self._now(), "owner": acting().user}
            if idempotency_key is not None:
                own |= {"sender": acting().share, "idempotency_key": idempotency_key, "body_hash": body_hash}
            connection.execute(sa.insert(SCHEDULES).values(**own, **row_values(fields, self.clock.now(), new=True)))
            note(connection, self._now(), "schedule.create", schedule_id, **logged_fields(fields))
            return _schedule(connection, schedule_id)

    def of_key(self, idempotency_key: str, body_hash: str) -> ScheduleRecord | None:
        """The schedule that the present sender created with that key; IdempotencyConflictError for another body."""
        with self.session.read() as connection:
            return _schedule_of_key(connection, idempotency_key, body_hash)

    def get(self, schedule_id: str) -> ScheduleRecord:
        """The schedule of that id; raises ScheduleNotFoundError."""
        with self.session.read() as connection:
            return _schedule(connection, schedule_id)

    def all(self) -> tuple[ScheduleRecord, ...]:
        """Every schedule, newest first."""
        with self.session.read() as connection:
            query = sa.select(SCHEDULES).where(_S.deleted_at.is_(None)).order_by(_S.number.desc())
            return tuple(_record(connection, row) for row in connection.execute(query).all())

    def runs(self, schedule_id: str) -> tuple[RunRecord, ...]:
        """The latest due times of the schedule, latest first; raises ScheduleNotFoundError."""
        with self.session.read() as connection:
            number = _row(connection, schedule_id).number
            return runs_of(connection, number, SHOWN_RUNS)

    def change(self, schedule_id: str, fields: ScheduleFields, read: Collection[str] | None = None) -> ScheduleRecord:
        """Replace the fields of the schedule by ``fields``; missed due times are forgotten.

        Where the schedule is paused, due times without a study are refused. ``read``: the editions
        (`ScheduleRecord.etag`) that the change is meant for; ChangedMeanwhileError for any other.
        """
        with self.session.write() as connection:
            row = _row(connection, schedule_id)
            number, old = row.number, fields_of(row)
            require_owner("schedule", schedule_id, row.owner)
            require_edition("schedule", schedule_id, _record(connection, row).etag, read)
            values = row_values(fields, self.clock.now(), new=fields.timing != old.timing)
            connection.execute(sa.update(SCHEDULES).where(_S.number == number).values(values))
            changes = logged_changes(old, fields)
            if changes:
                note(connection, self._now(), "schedule.change", schedule_id, name=fields.name, changes=changes)
            if not fields.enabled:
                refuse_open_runs(connection, number, schedule_id, self._now(), Sentence(recorded.PAUSED))
            return _schedule(connection, schedule_id)

    def delete(self, schedule_id: str, read: Collection[str] | None = None) -> None:
        """Delete the schedule; its studies are kept, with their window, and due times without a study are refused.

        Raises ScheduleNotFoundError; ``read`` as for `change`.
        """
        with self.session.write() as connection:
            row = _row(connection, schedule_id)
            require_owner("schedule", schedule_id, row.owner)
            require_edition("schedule", schedule_id, _record(connection, row).etag, read)
            note(connection, self._now(), "schedule.delete", schedule_id, name=row.name, owner=row.owner)
            refuse_open_runs(connection, row.number, schedule_id, self._now(), Sentence(recorded.DELETED))
            connection.execute(
                sa.update(SCHEDULES)
                .where(_S.number == row.number)
                .values(deleted_at=self._now(), next_due=None, enabled=0, spec="{}", idempotency_key=None)
            )

    def any(self) -> bool:
        """Whether there is a schedule, or has been one: what it began outlasts it."""
        with self.session.read() as connection:
            return bool(connection.execute(ANY_SCHEDULE).scalar_one())

    def due(self, now: datetime) -> list[ScheduleRecord]:
        """Schedules that are due at ``now``."""
        with self.session.read() as connection:
            query = sa.select(SCHEDULES).where(_S.next_due <= micros_of(now)).order_by(_S.next_due, _S.number)
            return [_record(connection, row) for row in connection.execute(query).all()]

    def recover(self, now: datetime) -> list[str]:
        """Make schedules that a fast clock postponed due again at their next time after ``now``; returns their ids."""
        recovered = []
        rows = self._all(sa.select(SCHEDULES).where(_S.next_due > micros_of(now)))
        for row in rows:
            due = fields_of(row).next_due(now)
            if due is None or micros_of(due) >= row.next_due:
                continue
            with self.session.write() as connection:
                connection.execute(
                    sa.update(SCHEDULES)
                    .where(_S.number == row.number, _S.next_due == row.next_due)
                    .values(next_due=micros_of(due))
                )
            recovered.append(row.id)
        return recovered

    def bound_studies(self) -> list[BoundStudy]:
        """Studies that have not ended and are bound to a window."""
        c = STUDIES.c
        query = (
            sa.select(c.number, c.state, c.waits_for, c.reason, _S.id, _S.window_begin, _S.window_end, _S.zone)
            .join_from(SCHEDULE_RUNS, SCHEDULES)
            .join(STUDIES, c.number == _R.study)
            .where(
                _S.window_begin.is_not(None) & (_R.unbound == 0) | (c.waits_for == WAITS_FOR_WINDOW),
                ~ENDED,
            )
        )
        rows = self._all(query)
        return [
            BoundStudy(r.number, StudyState(r.state), r.waits_for == WAITS_FOR_WINDOW, r.reason, window_of(r), r.id)
            for r in rows
        ]

    def hold_for_window(self, number: int, reason: str) -> None:
        """Pause a queued or running study until `let_in`; a study that its window already holds gets the new reason."""
        c = STUDIES.c
        with self.session.write() as connection:
            row = connection.execute(sa.select(c.state, c.id).where(c.number == number)).one()
            if StudyState(row.state).going:
                move_row(connection, number, StudyEvent.FAULT, self._now(), reason)
                change_row(connection, number, waits_for=WAITS_FOR_WINDOW)
                note(connection, self._now(), "study.hold", row.id, reason=reason)
            else:
                change_row(connection, number, c.waits_for == WAITS_FOR_WINDOW, reason=reason)

    def let_in(self, number: int) -> None:
        """Queue a study again that `hold_for_window` paused and nobody has changed since."""
        with self.session.write() as connection:
            c = STUDIES.c
            row = connection.execute(sa.select(c.waits_for, c.id).where(c.number == number)).one()
            if row.waits_for == WAITS_FOR_WINDOW:
                move_row(connection, number, StudyEvent.RESUME, self._now())
                note(connection, self._now(), "study.release", row.id)


def _row(connection: sa.Connection, schedule_id: str) -> sa.Row[Any]:
    row = connection.execute(sa.select(SCHEDULES).where(_S.id == schedule_id, _S.deleted_at.is_(None))).one_or_none()
    if row is None:
        raise ScheduleNotFoundError(schedule_id)
    return row


def _schedule(connection: sa.Connection, schedule_id: str) -> ScheduleRecord:
    return _record(connection, _row(connection, schedule_id))


def _record(connection: sa.Connection, row: sa.Row[Any]) -> ScheduleRecord:
    last = next(iter(runs_of(connection, row.number, 1)), None)
    return ScheduleRecord(
        row.number, row.id, fields_of(row), optional_moment(row.next_due), moment(row.created_at), last, row.owner
    )


def _schedule_of_key(connection: sa.Connection, key: str, body_hash: str) -> ScheduleRecord | None:
    mine = sa.select(SCHEDULES).where(_S.idempotency_key == key, by_sender(_S.sender)).order_by(_S.sender.desc())
    row = connection.execute(mine).first()
    if row is None:
        return None
    if row.body_hash != body_hash:
        raise IdempotencyConflictError(f"the idempotency key {key!r} was already used with another body")
    return _record(connection, row)


def lift_window(connection: sa.Connection, study: int, now: datetime) -> None:
    """Somebody resumes a study, whatever held it: a window that is closed does not hold it any more."""
    query = (
        sa.select(_S.window_begin, _S.window_end, _S.zone).join_from(SCHEDULE_RUNS, SCHEDULES).where(_R.study == study)
    )
    row = connection.execute(query).first()
    window = None if row is None else window_of(row)
    if window is not None and not window.open_at(now):
        connection.execute(sa.update(SCHEDULE_RUNS).where(_R.study == study).values(unbound=1))
