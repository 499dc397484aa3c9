"""Dispatchers: who is at work, which studies each of them has, and what happens to those of one that is gone.

Each start of a dispatcher has a number of its own, the epoch, and every write names it. A database in a file has one
dispatcher at a time: whoever takes over ends the one before. On a server several are at work beside each other, as long
as `Presence` has them; each study belongs to one of them at a time.
"""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa

from sprag_study.sentences import Sentence
from sprag_study.service.storage.part import (
    SILENT_SECONDS,
    Part,
    announce,
    micros_of,
    moment,
    move_row,
    optional_moment,
)
from sprag_study.service.storage.rows.origins import differences_of, remember
from sprag_study.service.storage.studies.records import DispatcherRecord
from sprag_study.service.storage.tables import CHUNKS, DISPATCHERS, ENDED, STUDIES
from sprag_study.worker import fingerprint
from sprag_study.worker.ports import EpochLostError, Peer
from sprag_study.worker.states import ChunkState, StudyEvent, StudyState

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping
    from datetime import datetime

    from sprag_study.service.storage.database.lock import Presence
    from sprag_study.service.storage.database.session import Session
    from sprag_study.worker.chunking import Chunking
    from sprag_study.worker.ports import Clock

#: Separator between process and study in the name of an owner that runs a single study.
_RUNS: Final = " runs "
#: Seconds for which a dispatcher that has ended is remembered.
TAKE_OVER_SECONDS = 600
#: Values of a chunk that is returned to waiting.
WAITING = {"state": ChunkState.WAITING, "epoch": None, "claimed_at": None}
#: Only studies that have not ended have claims; by study the chunks have an index.
CLAIMED = (CHUNKS.c.state == ChunkState.CLAIMED) & CHUNKS.c.study.in_(sa.select(STUDIES.c.number).where(~ENDED))
_ALIVE = DISPATCHERS.c.ended_at.is_(None)
#: For every transaction of a dispatcher; building the statement anew takes longer than running it.
_OWN = sa.select(DISPATCHERS.c.epoch).where(DISPATCHERS.c.epoch == sa.bindparam("epoch"), _ALIVE).with_for_update()


def run_owner(process: str, study_id: str) -> str:
    """The name of a dispatcher that takes over for a single study."""
    return f"{process}{_RUNS}{study_id}"


def own_study(owner: str) -> str:
    """The study for which a `run_owner` took over; "" for any other dispatcher."""
    return owner.partition(_RUNS)[2]


def why_abandoned(owner: str) -> str:
    """The reason of a study that its `run_owner` left unfinished."""
    return Sentence(
        "`sprag run` (process {process}) ended before its study did; resume the study to have a worker continue it, or "
        "repeat the same `sprag run`, which reuses its finished cases",
        process=owner.partition(_RUNS)[0],
    )


def return_claims(connection: sa.Connection, epoch: int) -> None:
    """Return every claim of an epoch to waiting."""
    connection.execute(sa.update(CHUNKS).where(CLAIMED, CHUNKS.c.epoch == epoch).values(WAITING))


def require_epoch(connection: sa.Connection, epoch: int) -> None:
    """Raise EpochLostError when the epoch has ended."""
    if connection.execute(_OWN, {"epoch": epoch}).scalar_one_or_none() is None:
        raise EpochLostError(f"another dispatcher has taken over from this one (epoch {epoch})")


def may_change(connection: sa.Connection, epoch: int, number: int) -> bool:
    """Whether a study belongs to no other dispatcher; raises EpochLostError when the epoch has ended."""
    require_epoch(connection, epoch)
    query = sa.select(sa.func.coalesce(STUDIES.c.dispatcher, epoch)).where(STUDIES.c.number == number)
    return connection.execute(query).scalar_one_or_none() == epoch


def _record(row: sa.Row[Any], studies: int, differs: str | None, now: datetime) -> DispatcherRecord:
    """A row of the table as a record."""
    heartbeat = moment(row.heartbeat_at)
    return DispatcherRecord(
        row.epoch,
        row.owner,
        row.fingerprint,
        moment(row.started_at),
        heartbeat,
        optional_moment(row.ended_at),
        (now - heartbeat).total_seconds() > SILENT_SECONDS,
        None if row.report is None else json.loads(row.report),
        studies,
        differs,
    )


class Dispatchers(Part):
    """The dispatchers of the database."""

    #: Which of them are at work, on a database that admits several; None: the one that took over last.
    presence: Presence | None = None

    def __init__(self, session: Session, clock: Clock, chunking: Chunking) -> None:
        super().__init__(session, clock)
        #: How studies are divided while no worker is known.
        self.base_chunking = chunking

    def take_over(self, owner: str) -> int:
        """Begin an epoch, and end all dispatchers that are not present; returns the epoch.

        Their claims return to waiting, and their studies are free. The study that a `run_owner` left unfinished is
        held, because nobody asked a worker for it.
        """
        now = self._now()
        with self.session.write() as connection:
            c = DISPATCHERS.c
            last = connection.execute(sa.select(c.epoch, c.clock_at).order_by(c.epoch.desc()).limit(1)).one_or_none()
            epoch = (0 if last is None else last.epoch) + 1
            connection.execute(
                sa.insert(DISPATCHERS).values(
                    epoch=epoch,
                    owner=owner,
                    fingerprint=fingerprint.digest(),
                    started_at=now,
                    heartbeat_at=now,
                    clock_at=None if last is None else last.clock_at,
                )
            )
            remember(connection)
            present = {epoch} if self.presence is None else {epoch, *self.presence.present()}
            self._end_all_but(connection, present, now, owner)
            forgotten = c.ended_at < now - TAKE_OVER_SECONDS * 1_000_000
            connection.execute(sa.delete(DISPATCHERS).where(forgotten, c.epoch < epoch))
            if self.presence is not None:
                # Before the row is visible: nobody may find it without its lock.
                self.presence.enter(epoch)
        return epoch

    def end_absent(self, epoch: int) -> bool:
        """End every dispatcher that is no longer present; whether there was one. Raises EpochLostError."""
        if self.presence is None:
            return False
        present = {epoch, *self.presence.present()}
        gone = _ALIVE & DISPATCHERS.c.epoch.not_in(present)
        with self.session.read() as connection:
            if not connection.execute(sa.select(sa.func.count()).where(gone)).scalar_one():
                return False
        with self.session.write() as connection:
            require_epoch(connection, epoch)
            # Asked again: one that began in the meantime has its lock since then.
            self._end_all_but(connection, {epoch, *self.presence.present()}, self._now())
        return True

    def take_overs(self) -> int:
        """How often in the last `TAKE_OVER_SECONDS` a dispatcher began before that of another process ended, in a file.

        A process that begins anew takes nothing from another; a `run_owner`, which leaves its end to the next one, does
        not count either.
        """
        rows = self._all(sa.select(DISPATCHERS))
        begun = {row.started_at: row for row in rows}
        since = self._now() - TAKE_OVER_SECONDS * 1_000_000
        return sum(
            row.ended_at is not None
            and row.ended_at >= since
            and (next_one := begun.get(row.ended_at)) is not None
            and next_one.epoch > row.epoch
            and next_one.owner != row.owner
            and not own_study(row.owner)
            for row in rows
        )

    def _end_all_but(self, connection: sa.Connection, present: Collection[int], now: int, owner: str = "") -> None:
        """End all other dispatchers at ``now``; ``owner`` may continue its own study."""
        c = DISPATCHERS.c
        gone = connection.execute(sa.select(c.epoch, c.owner).where(_ALIVE, c.epoch.not_in(present))).all()
        ended = sa.update(DISPATCHERS).where(_ALIVE, c.epoch.not_in(present))
        connection.execute(ended.values(ended_at=now))
        connection.execute(sa.update(CHUNKS).where(CLAIMED, CHUNKS.c.epoch.not_in(present)).values(WAITING))
        free = STUDIES.c.dispatcher.not_in(present)
        connection.execute(sa.update(STUDIES).where(free).values(dispatcher=None))
        for row in gone:
            if row.owner != owner:
                self._hold_abandoned(connection, row.owner)
        announce(connection)

    def _hold_abandoned(self, connection: sa.Connection, owner: str) -> None:
        query = sa.select(STUDIES.c.number, STUDIES.c.state)
        query = query.where(STUDIES.c.id == own_study(owner), STUDIES.c.deleted_at.is_(None))
        row = connection.execute(query).one_or_none()
        if row is not None and StudyState(row.state).going:
            move_row(connection, row.number, StudyEvent.FAULT, self._now(), why_abandoned(owner))

    def release(self, epoch: int) -> None:
        """End a dispatcher: return its claims to waiting and free its studies.

        A `run_owner` keeps its study, which others hold when they find that it is gone.
        """
        with self.session.write() as connection:
            require_epoch(connection, epoch)
            return_claims(connection, epoch)
            owner = sa.select(DISPATCHERS.c.owner).where(DISPATCHERS.c.epoch == epoch)
            if own_study(connection.execute(owner).scalar_one()):
                return
            connection.execute(sa.update(STUDIES).where(STUDIES.c.dispatcher == epoch).values(dispatcher=None))
            mine = sa.update(DISPATCHERS).where(DISPATCHERS.c.epoch == epoch)
            connection.execute(mine.values(ended_at=self._now()))
            announce(connection)

    def heartbeat(self, epoch: int, report: Mapping[str, Any]) -> None:
        """Record that the dispatcher is alive, and the report of its workers (`sprag_study.worker.reports`)."""
        with self.session.write_rows() as connection:
            require_epoch(connection, epoch)
            mine = sa.update(DISPATCHERS).where(DISPATCHERS.c.epoch == epoch)
            connection.execute(mine.values(heartbeat_at=self._now(), report=json.dumps(report)))

    def adopt(self, epoch: int, number: int) -> bool:
        """Let an unfinished study that belongs to nobody belong to this dispatcher; whether it does."""
        with self.session.write() as connection:
            if not may_change(connection, epoch, number):
                return False
            this = (STUDIES.c.number == number) & ~ENDED
            return bool(connection.execute(sa.update(STUDIES).where(this).values(dispatcher=epoch)).rowcount)

    def leave(self, epoch: int, number: int) -> None:
        """Let a study of this dispatcher, of which nothing is in flight, belong to nobody."""
        with self.session.write() as connection:
            require_epoch(connection, epoch)
            mine = (STUDIES.c.number == number) & (STUDIES.c.dispatcher == epoch)
            connection.execute(sa.update(STUDIES).where(mine).values(dispatcher=None))
            announce(connection)

    def peers(self, epoch: int) -> list[Peer]:
        """The other dispatchers at work that take studies of any kind."""
        if self.presence is None:
            return []
        return [
            Peer(found.fingerprint, found.studies)
            for found in self.responding()
            if found.epoch != epoch and found.usable
        ]

    def all(self) -> tuple[DispatcherRecord, ...]:
        """The dispatchers at work, in order of their beginning; without any, the last one; () before the first."""
        c = STUDIES.c
        having = sa.select(c.dispatcher, sa.func.count()).where(~ENDED).group_by(c.dispatcher)
        with self.session.read() as connection:
            rows = list(connection.execute(sa.select(DISPATCHERS).order_by(DISPATCHERS.c.epoch)))
            studies = {row[0]: row[1] for row in connection.execute(having)}
            rows = [row for row in rows if row.ended_at is None] or rows[-1:]
            differs = differences_of(connection, [row.fingerprint for row in rows])
        now = self.clock.now()
        pairs = zip(rows, differs, strict=True)
        return tuple(_record(row, studies.get(row.epoch, 0), difference, now) for row, difference in pairs)

    def latest(self) -> DispatcherRecord | None:
        """The dispatcher that was heard of last; None when there was none."""
        return max(self.all(), key=lambda record: (record.heartbeat_at, record.epoch), default=None)

    def responding(self) -> list[DispatcherRecord]:
        """The dispatchers that respond and take studies of any kind, unlike a `run_owner`."""
        return [record for record in self.all() if not (record.silent or own_study(record.owner))]

    def silence(self) -> float | None:
        """Seconds since the latest heartbeat of a dispatcher that takes studies of any kind; None when there was none.

        In a file, a `run_owner` counts too, because dispatchers wait for its end. Where only such ones are at work on a
        server, nobody has responded since the first of them began, or longer.
        """
        found = self.all()
        if not found:
            return None
        times = [record.heartbeat_at for record in found if not own_study(record.owner)]
        if not times:
            times = [min(r.started_at for r in found)] if self.session.on_server else [r.heartbeat_at for r in found]
        return (self.clock.now() - max(times)).total_seconds()

    @property
    def chunking(self) -> Chunking:
        """How studies are divided: for the workers of the largest dispatcher, because a study runs on those of one.

        While no worker is known, for those of the settings.
        """
        usable = max((record.usable for record in self.responding()), default=0)
        return replace(self.base_chunking, processes=usable) if usable else self.base_chunking

    def believed_clock(self) -> datetime | None:
        """The last time at which the clock was trusted; None before the first check."""
        c = DISPATCHERS.c
        with self.session.read() as connection:
            query = sa.select(c.clock_at).order_by(c.epoch.desc()).limit(1)
            return optional_moment(connection.execute(query).scalar_one_or_none())

    def note_clock(self, now: datetime) -> None:
        """Record that the clock is trusted at ``now``; no effect before the first dispatcher."""
        with self.session.write() as connection:
            connection.execute(sa.update(DISPATCHERS).values(clock_at=micros_of(now)))


def dispatcher_of(connection: sa.Connection, number: int) -> sa.Row[Any] | None:
    """Owner and heartbeat of the dispatcher that has a study; of a free study, of the one heard of last."""
    c = DISPATCHERS.c
    order = (c.ended_at.is_not(None), c.heartbeat_at.desc())
    query: sa.Select[Any] = sa.select(c.owner, c.heartbeat_at).order_by(*order).limit(1)
    has = sa.select(STUDIES.c.dispatcher).where(STUDIES.c.number == number).scalar_subquery()
    found: sa.Row[Any] | None = connection.execute(query.where(c.epoch == has)).one_or_none()
    return found or connection.execute(query).one_or_none()
