"""The base of every part of the store: the session, the clock, and a study's row."""

from __future__ import annotations

import time
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Any

import sqlalchemy as sa

from sprag.service.storage.errors import StudyNotFoundError
from sprag.service.storage.stored_sentences import written
from sprag.service.storage.tables import CHUNKS, STUDIES
from sprag.worker.states import ChunkState, StudyEvent, StudyState, follow

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sprag.service.storage.session import Session
    from sprag.worker.ports import Chunk, Clock

EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


class SystemClock:
    """The machine's clocks."""

    def now(self) -> datetime:
        """The current time, aware, UTC."""
        return datetime.now(UTC)

    def monotonic(self) -> float:
        """Seconds on a clock that never goes back and keeps running while the machine sleeps."""
        return time.clock_gettime(time.CLOCK_BOOTTIME) if hasattr(time, "CLOCK_BOOTTIME") else time.monotonic()


def moment(micros: int) -> datetime:
    """Microseconds since 1970 as an aware time."""
    return EPOCH + timedelta(microseconds=micros)


def micros_of(when: datetime) -> int:
    """An aware time as microseconds since 1970, UTC."""
    return (when - EPOCH) // timedelta(microseconds=1)


def optional_moment(micros: int | None) -> datetime | None:
    """The same, None for None."""
    return None if micros is None else moment(micros)


#: Seconds without a heartbeat after which the worker counts as gone: several times the interval of heartbeats.
SILENT_SECONDS = 60.0
#: The largest number that an integer column holds on every server.
MAX_INTEGER = 2**31 - 1


def announce(connection: sa.Connection) -> None:
    """Notify dispatchers of a change once this transaction is committed, where the database supports it."""
    if connection.dialect.name == "postgresql":
        connection.exec_driver_sql("NOTIFY sprag")


def add_chunks(connection: sa.Connection, chunks: Iterable[Chunk], detail: str | None = None) -> None:
    """Add waiting chunks; ``detail`` says where they come from."""
    rows = [
        {
            "study": chunk.study,
            "first": chunk.first,
            "count": chunk.count,
            "state": ChunkState.WAITING,
            "failures": chunk.failures,
            "detail": detail,
        }
        for chunk in chunks
    ]
    connection.execute(sa.insert(CHUNKS), rows)


class Part:
    """A part of the store."""

    def __init__(self, session: Session, clock: Clock) -> None:
        self.session = session
        self.clock = clock

    def _now(self) -> int:
        """The current time in microseconds since 1970."""
        return micros_of(self.clock.now())

    def _row(self, connection: sa.Connection, study_id: str, *columns: sa.ColumnElement[Any]) -> sa.Row[Any]:
        """Columns of the study of that id; raises StudyNotFoundError."""
        found = connection.execute(
            sa.select(*columns).where(STUDIES.c.id == study_id, STUDIES.c.deleted_at.is_(None))
        ).one_or_none()
        if found is None:
            raise StudyNotFoundError(study_id)
        return found

    def _lift_deadline(self, connection: sa.Connection, number: int) -> None:
        """Let a resumed study run although its deadline has passed."""
        self._change(connection, number, STUDIES.c.finish_by <= self._now(), finish_by=None)

    @staticmethod
    def _change(connection: sa.Connection, number: int, *only: sa.ColumnElement[bool], **values: object) -> None:
        """Put ``values`` into the row of a study where all of ``only`` hold; its revision tells readers of it."""
        if "reason" in values:
            reason = values["reason"]
            values |= written("reason", reason if isinstance(reason, str) else None)
        values["revision"] = STUDIES.c.revision + 1
        connection.execute(sa.update(STUDIES).where(STUDIES.c.number == number, *only).values(values))

    def _move(self, connection: sa.Connection, number: int, event: StudyEvent, reason: str | None = None) -> StudyState:
        """Apply ``event`` to the study; raises TransitionError where the table of states has no such transition.

        Afterwards the study does not wait for anything.
        """
        before = StudyState(
            connection.execute(
                sa.select(STUDIES.c.state).where(STUDIES.c.number == number).with_for_update()
            ).scalar_one()
        )
        after = follow(before, event)
        if after is before:
            return after
        values: dict[str, Any] = {"state": after.value, "reason": reason, "waits_for": None}
        if after is StudyState.RUNNING:
            values["started_at"] = sa.func.coalesce(STUDIES.c.started_at, self._now())
        if after.terminal:
            values["finished_at"] = self._now()
            values["dispatcher"] = None
        elif before.terminal:
            values["finished_at"] = None
        self._change(connection, number, **values)
        announce(connection)
        return after
