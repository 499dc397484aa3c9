"""Free space for the database, and holding studies while there is not enough.

Studies are held before the disk is full, while the reason can still be written. Where other programs use up the
remaining space, a write fails. The dispatcher then discards its unfinished work and records the reason with the help of
a reserve: a file beside the database that is removed when there is no other space.
"""

from __future__ import annotations

import resource
import shutil
from typing import TYPE_CHECKING

import sqlalchemy as sa

from sprag_study.sentences import Amount, Sentence
from sprag_study.service.languages import recorded
from sprag_study.service.storage.database.reserve import keep_reserve
from sprag_study.service.storage.errors import DatabaseFullError
from sprag_study.service.storage.part import Part, change_row, holds, move_row
from sprag_study.service.storage.stored_sentences import sentence_in
from sprag_study.service.storage.tables import STUDIES, WAITS_FOR_ROOM
from sprag_study.service.storage.work.dispatchers import require_epoch, return_claims
from sprag_study.worker.states import GOING, StudyEvent

if TYPE_CHECKING:
    from pathlib import Path

    from sprag_study.service.storage.database.session import Session

#: Bytes kept free for the running chunks and for recording the reason of a hold.
RESERVE_BYTES = 4 * 1024 * 1024
#: Value for unknown free space: enough for any request.
UNKNOWN_BYTES = 1 << 62
GOES_ON = recorded.NO_ROOM.rpartition("; ")[2]


def room(session: Session) -> tuple[int, str]:
    """Bytes available to the database, and the cause of the limit: the disk, or the largest file allowed.

    The free space of a server is unknown until a write fails. Raises DatabaseError when the file was moved, replaced or
    deleted while in use.
    """
    if session.on_server:
        return UNKNOWN_BYTES, Sentence("the server of {place} does not report its free space", place=session.location)
    session.require_same_file()
    free = shutil.disk_usage(session.path.parent).free
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)[0]
    size, log = _size(session.path), _size(session.path.with_name(f"{session.path.name}-wal"))
    disk = Sentence(recorded.DISK, path=str(session.path), free=Amount(free / 1e6, digits=3))
    limited = Sentence(recorded.LARGEST_FILE, size=Amount(limit / 1e6, digits=3))
    capped = limit != resource.RLIM_INFINITY
    if free >= RESERVE_BYTES and not (capped and limit - size - log < RESERVE_BYTES):
        return (limit - size - log, limited) if capped and limit - size - log < free else (free, disk)
    spare, reusable = _within(session)
    reusable = min(reusable, log)
    if capped and (left := min(limit - size + spare, limit - log + reusable)) < free + spare + reusable:
        return left, limited
    return free + spare + reusable, disk


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except FileNotFoundError:
        return 0


def _within(session: Session) -> tuple[int, int]:
    """Free bytes inside the files: pages of deleted rows, and the checkpointed part of the log."""
    with session.plain() as connection:
        page: int = connection.exec_driver_sql("PRAGMA page_size").scalar_one()
        unused: int = connection.exec_driver_sql("PRAGMA freelist_count").scalar_one()
    try:
        with session.plain() as connection:
            _busy, logged, moved = connection.exec_driver_sql("PRAGMA wal_checkpoint(PASSIVE)").one()
    except DatabaseFullError:
        return unused * page, 0
    # The log is overwritten from its beginning once all of it is checkpointed.
    return unused * page, (logged * page if logged == moved else 0)


class Room(Part):
    """Studies held while the disk is full."""

    def left(self) -> int:
        """Bytes available to the database."""
        return room(self.session)[0]

    def shortage(self) -> str | None:
        """Why there is no room for more rows, as a sentence; None where there is room."""
        left, limit = room(self.session)
        if left < RESERVE_BYTES:
            return Sentence(recorded.NO_ROOM, limit=limit)
        if not self.session.on_server:
            keep_reserve(self.session.path)
        return None

    def full(self) -> str | None:
        """Why every study is held, or will be when one is to run, as a sentence; None while there is room."""
        c = STUDIES.c
        held = sa.select(c.reason, c.reason_values).where(c.waits_for == WAITS_FOR_ROOM, c.deleted_at.is_(None))
        with self.session.read() as connection:
            row = connection.execute(held.limit(1)).one_or_none()
        reason = None if row is None else sentence_in(row, "reason")
        if reason is None:
            left, limit = room(self.session)
            reason = Sentence(recorded.NO_ROOM, limit=limit) if left < RESERVE_BYTES else None
        return reason

    @holds
    def hold(self, epoch: int, reason: str, *, returned: bool) -> None:
        """Pause every study of this dispatcher or of none that is queued or running, with the reason, until `let_go`.

        With ``returned`` every claim of this epoch goes back to waiting in the same transaction.
        """
        with self.session.write() as connection:
            require_epoch(connection, epoch)
            if returned:
                return_claims(connection, epoch)
            ours = sa.func.coalesce(STUDIES.c.dispatcher, epoch) == epoch
            going = sa.select(STUDIES.c.number).where(STUDIES.c.state.in_(GOING), ours)
            numbers = connection.execute(going).scalars().all()
            for number in numbers:
                move_row(connection, number, StudyEvent.FAULT, self._now(), reason)
                change_row(connection, number, waits_for=WAITS_FOR_ROOM, dispatcher=epoch)

    def let_go(self, epoch: int) -> None:
        """Queue again every study that `hold` paused and nobody has changed since."""
        with self.session.write() as connection:
            require_epoch(connection, epoch)
            ours = sa.func.coalesce(STUDIES.c.dispatcher, epoch) == epoch
            held = sa.select(STUDIES.c.number).where(STUDIES.c.waits_for == WAITS_FOR_ROOM, ours)
            numbers = connection.execute(held)
            for number in numbers.scalars().all():
                move_row(connection, number, StudyEvent.RESUME, self._now())
