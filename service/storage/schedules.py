"""Schedules in the database: create, read, change, delete; due times taken up once; studies held by their windows."""

from __future__ import annotations

import json
import secrets
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa

from sprag.service.schedules.fields import ScheduleFields
from sprag.service.schedules.times import Timing, Window, read_time_of_day
from sprag.service.storage.errors import IdempotencyConflictError, ScheduleNotFoundError, TooManySchedulesError
from sprag.service.storage.part import Part, micros_of, moment, optional_moment
from sprag.service.storage.schedule_tables import SCHEDULE_RUNS, SCHEDULES
from sprag.service.storage.tables import STUDIES, WAITS_FOR_WINDOW
from sprag.worker.limits import MAX_SCHEDULES
from sprag.worker.states import TERMINAL, StudyEvent, StudyState

if TYPE_CHECKING:
    from datetime import datetime

_S, _R = SCHEDULES.c, SCHEDULE_RUNS.c
#: Number of latest runs reported for a schedule.
SHOWN_RUNS: Final = 20


class RunState(StrEnum):
    """Outcome of a due time."""

    TAKEN = "taken"
    SUBMITTED = "submitted"
    REFUSED = "refused"


@dataclass(frozen=True, slots=True)
class RunRecord:
    """A due time that was taken up. ``study`` is None where none was submitted or it has been deleted."""

    due: datetime
    state: RunState
    missed: int
    begun_at: datetime
    study: str | None
    problem: str | None


@dataclass(frozen=True, slots=True)
class ScheduleRecord:
    """A schedule: its fields, its next due time, and its last run."""

    number: int
    id: str
    fields: ScheduleFields
    next_due: datetime | None
    created_at: datetime
    last: RunRecord | None


@dataclass(frozen=True, slots=True)
class OpenRun:
    """A due time that was taken up at ``begun_at`` and has no outcome yet; ``problem`` states why."""

    schedule: int
    id: str
    due: int
    fields: ScheduleFields
    begun_at: datetime
    problem: str | None


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


class Schedules(Part):
    """The schedules of a database."""

    def create_schedule(
        self, fields: ScheduleFields, *, idempotency_key: str | None = None, body_hash: str = ""
    ) -> ScheduleRecord:
        """Store a new schedule; raises TooManySchedulesError.

        A key that was used before with the same ``body_hash`` returns the schedule of that request; with another hash
        it raises IdempotencyConflictError.
        """
        schedule_id = f"sc_{secrets.token_hex(8)}"
        asked = {"idempotency_key": idempotency_key, "body_hash": body_hash} if idempotency_key is not None else {}
        with self.session.write() as connection:
            if idempotency_key is not None:
                earlier = self._schedule_of_key(connection, idempotency_key, body_hash)
                if earlier is not None:
                    return earlier
            alive = sa.select(sa.func.count()).select_from(SCHEDULES).where(_S.deleted_at.is_(None))
            if connection.execute(alive).scalar_one() >= MAX_SCHEDULES:
                raise TooManySchedulesError(f"there are {MAX_SCHEDULES} schedules already; delete one first")
            connection.execute(
                sa.insert(SCHEDULES).values(id=schedule_id, created_at=self._now(), **asked, **self._values(fields))
            )
            return self._schedule(connection, schedule_id)

    def schedule_of_key(self, idempotency_key: str, body_hash: str) -> ScheduleRecord | None:
        """The schedule that was sent with that key; raises IdempotencyConflictError when its body was another."""
        with self.session.read() as connection:
            return self._schedule_of_key(connection, idempotency_key, body_hash)

    def _schedule_of_key(self, connection: sa.Connection, key: str, body_hash: str) -> ScheduleRecord | None:
        row = connection.execute(sa.select(SCHEDULES).where(_S.idempotency_key == key)).one_or_none()
        if row is None:
            return None
        if row.body_hash != body_hash:
            raise IdempotencyConflictError(f"the idempotency key {key!r} was already used with another body")
        return self._record(connection, row)

    def get_schedule(self, schedule_id: str) -> ScheduleRecord:
        """The schedule of that id; raises ScheduleNotFoundError."""
        with self.session.read() as connection:
            return self._schedule(connection, schedule_id)

    def list_schedules(self) -> tuple[ScheduleRecord, ...]:
        """Every schedule, newest first."""
        with self.session.read() as connection:
            query = sa.select(SCHEDULES).where(_S.deleted_at.is_(None)).order_by(_S.number.desc())
            return tuple(self._record(connection, row) for row in connection.execute(query).all())

    def schedule_runs(self, schedule_id: str) -> tuple[RunRecord, ...]:
        """The latest due times of the schedule, latest first; raises ScheduleNotFoundError."""
        with self.session.read() as connection:
            number = self._schedule_row(connection, schedule_id).number
            return self._runs(connection, number, SHOWN_RUNS)

    def change_schedule(self, schedule_id: str, fields: ScheduleFields) -> ScheduleRecord:
        """Replace the fields of the schedule by ``fields``; missed due times are forgotten.

        Where the schedule is disabled, runs without a study are no longer tried.
        """
        with self.session.write() as connection:
            number = self._schedule_row(connection, schedule_id).number
            connection.execute(sa.update(SCHEDULES).where(_S.number == number).values(self._values(fields)))
            if not fields.enabled:
                problem = "The schedule was disabled before a study was submitted."
                connection.execute(
                    sa.update(SCHEDULE_RUNS)
                    .where(_R.schedule == number, _R.state == RunState.TAKEN.value)
                    .values(state=RunState.REFUSED.value, problem=problem)
                )
            return self._schedule(connection, schedule_id)

    def delete_schedule(self, schedule_id: str) -> None:
        """Delete the schedule; its studies are kept, with their window. Raises ScheduleNotFoundError."""
        with self.session.write() as connection:
            number = self._schedule_row(connection, schedule_id).number
            connection.execute(
                sa.update(SCHEDULES)
                .where(_S.number == number)
                .values(deleted_at=self._now(), next_due=None, enabled=0, spec="{}", idempotency_key=None)
            )

    def due_schedules(self, now: datetime) -> list[ScheduleRecord]:
        """Schedules that are due at ``now``."""
        with self.session.read() as connection:
            query = sa.select(SCHEDULES).where(_S.next_due <= micros_of(now)).order_by(_S.next_due, _S.number)
            return [self._record(connection, row) for row in connection.execute(query).all()]

    def recover_schedules(self, now: datetime) -> list[str]:
        """Make schedules that a fast clock postponed due again at their next time after ``now``; returns their ids."""
        recovered = []
        with self.session.read() as connection:
            rows = connection.execute(sa.select(SCHEDULES).where(_S.next_due > micros_of(now))).all()
        for row in rows:
            due = _fields(row).next_due(now)
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

    def take_due(self, record: ScheduleRecord, due: datetime, missed: int, following: datetime | None) -> bool:
        """Take up ``due`` once: False when another process did so first, or the schedule was changed in the
        meantime.
        """
        assert record.next_due is not None
        with self.session.write() as connection:
            moved = connection.execute(
                sa.update(SCHEDULES)
                .where(_S.number == record.number, _S.next_due == micros_of(record.next_due))
                .values(next_due=None if following is None else micros_of(following))
            )
            this = (_R.schedule == record.number) & (_R.due == micros_of(due))
            # After the clock was put back, the same due time comes again.
            if not moved.rowcount or connection.execute(sa.select(_R.due).where(this)).first():
                return False
            connection.execute(
                sa.insert(SCHEDULE_RUNS).values(
                    schedule=record.number,
                    due=micros_of(due),
                    state=RunState.TAKEN.value,
                    missed=missed,
                    begun_at=self._now(),
                    unbound=0,
                )
            )
        return True

    def open_runs(self) -> list[OpenRun]:
        """Due times that were taken up and have neither a study nor a problem yet."""
        with self.session.read() as connection:
            query = (
                sa.select(_R.due, _R.begun_at, _R.problem, SCHEDULES)
                .join_from(SCHEDULE_RUNS, SCHEDULES)
                .where(_R.state == RunState.TAKEN.value, _S.deleted_at.is_(None))
                .order_by(_R.due)
            )
            rows = connection.execute(query).all()
        return [OpenRun(row.number, row.id, row.due, _fields(row), moment(row.begun_at), row.problem) for row in rows]

    def put_off_run(self, run: OpenRun, problem: str) -> None:
        """Record why a due time has no study yet; it stays open."""
        with self.session.write() as connection:
            connection.execute(
                sa.update(SCHEDULE_RUNS).where(_R.schedule == run.schedule, _R.due == run.due).values(problem=problem)
            )

    def close_run(self, run: OpenRun, *, study: int | None = None, problem: str | None = None) -> None:
        """Record the outcome of a due time: the number of its study, or why there is none."""
        state = RunState.REFUSED if study is None else RunState.SUBMITTED
        with self.session.write() as connection:
            connection.execute(
                sa.update(SCHEDULE_RUNS)
                .where(_R.schedule == run.schedule, _R.due == run.due)
                .values(state=state.value, study=study, problem=problem)
            )

    def bound_studies(self) -> list[BoundStudy]:
        """Studies that have not ended and are bound to a window."""
        c = STUDIES.c
        query = (
            sa.select(c.number, c.state, c.waits_for, c.reason, _S.window_begin, _S.window_end, _S.zone)
            .join_from(SCHEDULE_RUNS, SCHEDULES)
            .join(STUDIES, c.number == _R.study)
            .where(
                _S.window_begin.is_not(None) & (_R.unbound == 0) | (c.waits_for == WAITS_FOR_WINDOW),
                c.state.not_in([state.value for state in TERMINAL]),
            )
        )
        with self.session.read() as connection:
            rows = connection.execute(query).all()
        return [
            BoundStudy(row.number, StudyState(row.state), row.waits_for == WAITS_FOR_WINDOW, row.reason, _window(row))
            for row in rows
        ]

    def hold_for_window(self, number: int, reason: str) -> None:
        """Pause a queued or running study until `let_in`; a study that its window already holds gets the new reason."""
        c = STUDIES.c
        with self.session.write() as connection:
            state = connection.execute(sa.select(c.state).where(c.number == number)).scalar_one()
            if StudyState(state).going:
                self._move(connection, number, StudyEvent.FAULT, reason)
                self._change(connection, number, waits_for=WAITS_FOR_WINDOW)
            else:
                self._change(connection, number, c.waits_for == WAITS_FOR_WINDOW, reason=reason)

    def let_in(self, number: int) -> None:
        """Queue a study again that `hold_for_window` paused and nobody has changed since."""
        with self.session.write() as connection:
            waits = connection.execute(sa.select(STUDIES.c.waits_for).where(STUDIES.c.number == number)).scalar_one()
            if waits == WAITS_FOR_WINDOW:
                self._move(connection, number, StudyEvent.RESUME)

    def _values(self, fields: ScheduleFields) -> dict[str, Any]:
        timing, window = fields.timing, fields.window
        due = fields.next_due(self.clock.now())
        return {
            "name": fields.name,
            "spec": json.dumps(fields.spec, allow_nan=False),
            "cron": timing.cron,
            "due_at": None if timing.at is None else micros_of(timing.at),
            "zone": timing.zone,
            "window_begin": None if window is None else f"{window.begin:%H:%M}",
            "window_end": None if window is None else f"{window.end:%H:%M}",
            "priority": fields.priority,
            "fresh": int(fields.fresh),
            "finish_by": fields.finish_by,
            "enabled": int(fields.enabled),
            "next_due": None if due is None else micros_of(due),
        }

    def _schedule_row(self, connection: sa.Connection, schedule_id: str) -> sa.Row[Any]:
        row = connection.execute(
            sa.select(SCHEDULES).where(_S.id == schedule_id, _S.deleted_at.is_(None))
        ).one_or_none()
        if row is None:
            raise ScheduleNotFoundError(schedule_id)
        return row

    def _schedule(self, connection: sa.Connection, schedule_id: str) -> ScheduleRecord:
        return self._record(connection, self._schedule_row(connection, schedule_id))

    def _record(self, connection: sa.Connection, row: sa.Row[Any]) -> ScheduleRecord:
        last = next(iter(self._runs(connection, row.number, 1)), None)
        return ScheduleRecord(
            row.number, row.id, _fields(row), optional_moment(row.next_due), moment(row.created_at), last
        )

    @staticmethod
    def _runs(connection: sa.Connection, number: int, most: int) -> tuple[RunRecord, ...]:
        studies = STUDIES.c
        alive = (studies.number == _R.study) & studies.deleted_at.is_(None)
        rows = connection.execute(
            sa.select(_R.due, _R.state, _R.missed, _R.begun_at, _R.problem, studies.id.label("study"))
            .select_from(sa.outerjoin(SCHEDULE_RUNS, STUDIES, alive))
            .where(_R.schedule == number)
            .order_by(_R.due.desc())
            .limit(most)
        ).all()
        return tuple(
            RunRecord(moment(row.due), RunState(row.state), row.missed, moment(row.begun_at), row.study, row.problem)
            for row in rows
        )


def lift_window(connection: sa.Connection, study: int, now: datetime) -> None:
    """Somebody resumes a study, whatever held it: a window that is closed does not hold it any more."""
    query = (
        sa.select(_S.window_begin, _S.window_end, _S.zone).join_from(SCHEDULE_RUNS, SCHEDULES).where(_R.study == study)
    )
    row = connection.execute(query).first()
    window = None if row is None else _window(row)
    if window is not None and not window.open_at(now):
        connection.execute(sa.update(SCHEDULE_RUNS).where(_R.study == study).values(unbound=1))


def _window(row: Any) -> Window | None:
    if row.window_begin is None:
        return None
    return Window(read_time_of_day(row.window_begin), read_time_of_day(row.window_end), row.zone)


def _fields(row: Any) -> ScheduleFields:
    timing = Timing(row.cron, optional_moment(row.due_at), row.zone)
    return ScheduleFields(
        row.name,
        json.loads(row.spec),
        timing,
        _window(row),
        row.priority,
        bool(row.fresh),
        bool(row.enabled),
        row.finish_by,
    )
