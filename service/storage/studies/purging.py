"""Removal of old studies, and of the rows of deleted ones in steps, so that other writers can work in between."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Final

import sqlalchemy as sa

from sprag_study.service.storage.errors import DatabaseFullError, StudyBusyError, StudyNotFoundError
from sprag_study.service.storage.part import Part, makes_room, micros_of
from sprag_study.service.storage.rows.case_keys import KEYED
from sprag_study.service.storage.saved_views import SAVED_VIEWS
from sprag_study.service.storage.tables import (
    CASE_KEYS,
    CHUNKS,
    ENDED,
    HELD_AT_DEADLINE,
    OF_STUDIES,
    STUDIES,
    tables_of_rows,
)
from sprag_study.worker.case_keys import case_keys
from sprag_study.worker.study import Study

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from datetime import datetime

    from sprag_study.service.storage.database.session import Session
    from sprag_study.service.storage.studies.studies import Studies
    from sprag_study.worker.ports import Clock

#: Rows deleted in one transaction: other writers wait for it.
PURGED_ROWS: Final = 5_000
#: On a full disk fewer and fewer, down to so many.
LEAST_PURGED_ROWS: Final = 50


class Purging(Part):
    """Removal of what was deleted, and of what is old."""

    def __init__(self, session: Session, clock: Clock, studies: Studies) -> None:
        super().__init__(session, clock)
        self._studies = studies

    def prune(self, ended_before: datetime, *, dry: bool = False) -> list[str]:
        """Delete every study that ended, or was held at its deadline, before ``ended_before``; returns their ids.

        They cannot be restored: this is how room is made.
        ``dry``: only return the ids.
        """
        c = STUDIES.c
        ended = ENDED & (c.finished_at < micros_of(ended_before))
        over = (c.waits_for == HELD_AT_DEADLINE) & (c.finish_by < micros_of(ended_before))
        old = (ended | over) & c.deleted_at.is_(None)
        with self.session.read() as connection:
            found = list(connection.execute(sa.select(c.id).where(old).order_by(c.number)).scalars())
        for study_id in () if dry else found:
            with suppress(StudyNotFoundError, StudyBusyError):  # somebody else has deleted it or runs it again
                self._studies.delete(study_id, at_once=True)
        return found

    def purge(self) -> None:
        """Remove all of them now."""
        for _ in self.steps():
            pass

    def steps(self) -> Iterator[int]:
        """Remove them in short transactions; yields the number of rows that each deleted."""
        c = STUDIES.c
        over = c.deleted_at.is_not(None) & (sa.func.coalesce(c.purge_at, 0) <= self._now())
        with self.session.read() as connection:
            if connection.execute(sa.select(c.number).where(over).limit(1)).first() is None:
                return
        for number, model, variant in self._taken_away(over):
            for rows in tables_of_rows(model, variant):
                yield from _emptied(partial(self._delete_first, rows, rows.c.case_number, number))
            yield from _emptied(partial(self._delete_first, CHUNKS, CHUNKS.c["first"], number))
            if keys := self._keys(number):
                yield from _emptied(partial(self._delete_keys, keys, number))
            self._remove(number)
            yield 1

    def _keys(self, number: int) -> list[int]:
        """The keys that a study has."""
        c = STUDIES.c
        with self.session.read() as connection:
            query = sa.select(c.study, c.kin_hash).where(c.number == number, c.keyed == KEYED)
            row = connection.execute(query).one_or_none()
        return [] if row is None else sorted(case_keys(Study.from_text(row.study), row.kin_hash).tolist())

    @makes_room
    def _delete_keys(self, keys: list[int], number: int, rows: int) -> tuple[int, bool]:
        """Delete about that many of the ``keys`` of a study, which then keeps the others: how many, and whether any are
        left.
        """
        with self.session.write() as connection:
            mine = CASE_KEYS.c.key.in_(keys[:rows]) & (CASE_KEYS.c.study == number)
            deleted = connection.execute(sa.delete(CASE_KEYS).where(mine)).rowcount
        del keys[:rows]
        return deleted, bool(keys)

    @makes_room
    def _taken_away(self, over: sa.ColumnElement[bool]) -> list[tuple[int, str, str]]:
        """Number, model and variant of the studies that are ``over``, which cannot be restored from now on."""
        c = STUDIES.c
        with self.session.write() as connection:
            # A clock that is set back does not let a study be restored of which half is gone.
            gone = sa.update(STUDIES).where(over).values(purge_at=0).returning(c.number, c.model, c.variant)
            return [(row.number, row.model, row.variant) for row in connection.execute(gone)]

    @makes_room
    def _remove(self, number: int) -> None:
        """Delete a study that has no rows any more."""
        with self.session.write() as connection:
            # The study first and then its rows, in the order of `TimesByStage.add`: otherwise both could deadlock.
            connection.execute(sa.select(STUDIES.c.number).where(STUDIES.c.number == number).with_for_update())
            for table in (*OF_STUDIES, SAVED_VIEWS):
                connection.execute(sa.delete(table).where(table.c.study == number))
            connection.execute(sa.delete(STUDIES).where(STUDIES.c.number == number))

    @makes_room
    def _delete_first(self, table: sa.Table, key: sa.Column[int], number: int, rows: int) -> tuple[int, bool]:
        """Delete about that many rows of a study from a table, in the order of ``key``, which few rows share: how many,
        and whether any are left.
        """
        mine = table.c.study == number
        with self.session.write() as connection:
            # The first row that is kept; none where the rest is small enough.
            edge = connection.execute(
                sa.select(key).where(mine).order_by(key).offset(rows).limit(1)
            ).scalar_one_or_none()
            deleted = connection.execute(sa.delete(table).where(mine, sa.true() if edge is None else key < edge))
        return deleted.rowcount, edge is not None


def _emptied(delete_first: Callable[[int], tuple[int, bool]]) -> Iterator[int]:
    """Call the function, which deletes about so many rows, until none are left; yields how many it deleted."""
    rows, left = PURGED_ROWS, True
    while left:
        try:
            deleted, left = delete_first(rows)
        except DatabaseFullError:
            if rows <= LEAST_PURGED_ROWS:
                raise
            rows //= 10  # even a deletion writes pages to the log
        else:
            yield deleted
