"""Figures over all studies, for monitoring."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING

import sqlalchemy as sa

from sprag_study.service.storage.part import Part, micros_of, moment
from sprag_study.service.storage.tables import CHUNKS, DISPATCHERS, ENDED, ENDINGS, HELD_AT_DEADLINE, STUDIES
from sprag_study.worker.states import ChunkState

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True, slots=True)
class Figures:
    """Studies by state, cases by ending, cases to be run, cases reused from other studies, and the latest heartbeat of
    the dispatcher that has been silent longest.
    """

    studies: Mapping[str, int]
    endings: Mapping[str, int]
    waiting: int
    reused: int
    heartbeat: datetime | None


@dataclass(frozen=True, slots=True)
class FinishedWork:
    """A finished chunk: its cases, and the seconds from its claim to its commit."""

    finished_at: datetime
    seconds: float
    cases: int


class Totals(Part):
    """The figures of the metrics."""

    def current(self) -> Figures:
        """The current figures."""
        c = STUDIES.c
        alive = c.deleted_at.is_(None)
        going = alive & ~ENDED & c.waits_for.is_distinct_from(HELD_AT_DEADLINE)
        with self.session.read() as connection:
            states = connection.execute(sa.select(c.state, sa.func.count()).where(alive).group_by(c.state)).all()
            waiting, reused = connection.execute(
                sa.select(
                    sa.func.coalesce(sa.func.sum(sa.case((going, c.cases - c.done), else_=0)), 0),
                    sa.func.coalesce(sa.func.sum(c.reused), 0),
                ).where(alive)
            ).one()
            endings = connection.execute(
                sa.select(ENDINGS.c.ending, sa.func.sum(ENDINGS.c.cases)).group_by(ENDINGS.c.ending)
            ).all()
            # Of those at work, otherwise of the last one.
            d = DISPATCHERS.c
            order = (d.ended_at.is_not(None), sa.case((d.ended_at.is_(None), d.heartbeat_at), else_=-d.heartbeat_at))
            beat = connection.execute(sa.select(d.heartbeat_at).order_by(*order).limit(1)).scalar_one_or_none()
        return Figures(
            {str(state): int(count) for state, count in states},
            {ending: int(cases) for ending, cases in endings},
            int(waiting),
            int(reused),
            None if beat is None else moment(beat),
        )

    def database_bytes(self) -> int:
        """Size of the database in bytes, with the log beside its file."""
        if not self.session.on_server:
            file = self.session.path
            return sum(path.stat().st_size for path in (file, file.with_name(f"{file.name}-wal")) if path.exists())
        with self.session.read() as connection:
            return int(connection.execute(sa.select(sa.func.pg_database_size(sa.func.current_database()))).scalar_one())

    def finished_since(self, since: datetime) -> list[FinishedWork]:
        """Chunks finished after ``since``, in order."""
        micros = micros_of(since)
        c = CHUNKS.c
        # Only studies that may have such chunks are read; chunks are indexed by study.
        lately = STUDIES.c.finished_at.is_(None) | (STUDIES.c.finished_at >= micros)
        query = (
            sa.select(c.claimed_at, c.finished_at, c["count"])
            .where(
                c.study.in_(sa.select(STUDIES.c.number).where(lately)),
                c.state == ChunkState.DONE,
                c.finished_at > micros,
            )
            .order_by(c.finished_at)
        )
        rows = self._all(query)
        return [
            FinishedWork(moment(end), max(0.0, (end - (end if begin is None else begin)) / 1e6), count)
            for begin, end, count in rows
        ]
