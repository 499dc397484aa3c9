"""The base of every part of the store: the session, the clock, a study's row, and writing on a full disk."""

from __future__ import annotations

import time
from datetime import UTC, datetime, timedelta
from functools import wraps
from typing import TYPE_CHECKING, Any, Concatenate, Final, ParamSpec, TypeVar

import sqlalchemy as sa

from sprag_study.service.storage.database.reserve import spend, spend_share
from sprag_study.service.storage.database.session import READ
from sprag_study.service.storage.errors import DatabaseFullError, StudyNotFoundError
from sprag_study.service.storage.stored_sentences import written
from sprag_study.service.storage.tables import CHUNKS, RECORD_COLUMNS, STUDIES
from sprag_study.worker.states import ChunkState, StudyEvent, StudyState, follow

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from pathlib import Path

    from sprag_study.service.storage.database.session import Session
    from sprag_study.worker.ports import Chunk, Clock

_A = ParamSpec("_A")
_R = TypeVar("_R")
_P = TypeVar("_P", bound="Part")

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


_RECORD: Final = {column.key for column in RECORD_COLUMNS}
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

    def _all(self, query: sa.Select[Any]) -> Sequence[Any]:
        """The rows of a query, read in a transaction of its own."""
        with self.session.read() as connection:
            return connection.execute(query).all()


def row_of(connection: sa.Connection, study_id: str, *columns: sa.ColumnElement[Any]) -> sa.Row[Any]:
    """Columns of the study of that id; raises StudyNotFoundError.

    In a `Moment` the row is read once, and once more with the long texts of the study.
    """
    rows: dict[tuple[str, bool], sa.Row[Any]] | None = connection.get_execution_options().get(READ)
    whole = not {column.key for column in columns} <= _RECORD
    if rows is not None:
        if kept := rows.get((study_id, True)) or rows.get((study_id, whole)):
            return kept
        columns = tuple(STUDIES.c) if whole else RECORD_COLUMNS
    row = connection.execute(
        sa.select(*columns).where(STUDIES.c.id == study_id, STUDIES.c.deleted_at.is_(None))
    ).one_or_none()
    if row is None:
        raise StudyNotFoundError(study_id)
    if rows is not None:
        rows[study_id, whole] = row
    return row


def lock_row(connection: sa.Connection, study_id: str) -> None:
    """Let no other transaction change the row of a study before the end of this one.

    Rows of its cases may be stored meanwhile: they refer to it.
    """
    connection.execute(sa.select(STUDIES.c.number).where(STUDIES.c.id == study_id).with_for_update(key_share=True))


def change_row(connection: sa.Connection, number: int, *only: sa.ColumnElement[bool], **values: object) -> None:
    """Put ``values`` into the row of a study where all of ``only`` hold; its revision tells readers of it."""
    if "reason" in values:
        reason = values["reason"]
        values |= written("reason", reason if isinstance(reason, str) else None)
    values["revision"] = STUDIES.c.revision + 1
    connection.execute(sa.update(STUDIES).where(STUDIES.c.number == number, *only).values(values))


def move_row(
    connection: sa.Connection, number: int, event: StudyEvent, now: int, reason: str | None = None
) -> StudyState:
    """Apply ``event`` to a study at ``now`` (µs since 1970); TransitionError where the table of states has none such.

    Afterwards the study does not wait for anything.
    """
    before = StudyState(
        connection.execute(
            sa.select(STUDIES.c.state).where(STUDIES.c.number == number).with_for_update(key_share=True)
        ).scalar_one()
    )
    after = follow(before, event)
    if after is before:
        return after
    values: dict[str, Any] = {"state": after.value, "reason": reason, "waits_for": None}
    if after is StudyState.RUNNING:
        values["started_at"] = sa.func.coalesce(STUDIES.c.started_at, now)
    if after.terminal:
        values["finished_at"] = now
        values["dispatcher"] = None
    elif before.terminal:
        values["finished_at"] = None
    change_row(connection, number, **values)
    announce(connection)
    return after


def lift_deadline(connection: sa.Connection, number: int, now: int) -> None:
    """Let a resumed study run although its deadline has passed."""
    change_row(connection, number, STUDIES.c.finish_by <= now, finish_by=None)


def holds(method: Callable[Concatenate[_P, _A], _R]) -> Callable[Concatenate[_P, _A], _R]:
    """A method, one write transaction, that holds studies: on a full disk it may use its share of the reserve."""
    return _with(method, spend_share)


def makes_room(method: Callable[Concatenate[_P, _A], _R]) -> Callable[Concatenate[_P, _A], _R]:
    """A method, one write transaction, that is a step to more room: on a full disk it may use all of the reserve.

    What makes no room must not: the reserve is there once.
    """
    return _with(method, spend_share, spend)


def _with(
    method: Callable[Concatenate[_P, _A], _R], *gains: Callable[[Path], None]
) -> Callable[Concatenate[_P, _A], _R]:
    """The method, tried again on a full disk: after the log begins anew, and after each of ``gains``.

    The log first, whose pages would take up what the reserve leaves; then the next write needs no room.
    """

    @wraps(method)
    def with_reserve(self: _P, /, *args: _A.args, **options: _A.kwargs) -> _R:
        for gain in (lambda _: self.session.renew_log(), *gains):
            try:
                return method(self, *args, **options)
            except DatabaseFullError:
                if self.session.on_server:
                    raise
                gain(self.session.path)
        return method(self, *args, **options)

    return with_reserve
