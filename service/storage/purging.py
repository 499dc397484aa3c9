"""Deletion of studies, its undoing, and removal of their rows in steps, so that other writers can work in between."""

from __future__ import annotations

from contextlib import suppress
from datetime import timedelta
from functools import partial
from typing import TYPE_CHECKING, Final

import sqlalchemy as sa

from sprag.service.storage.audit import note, require_own
from sprag.service.storage.case_keys import CaseKeys
from sprag.service.storage.editions import require_edition
from sprag.service.storage.errors import DatabaseFullError, StudyBusyError, StudyNotFoundError
from sprag.service.storage.part import micros_of
from sprag.service.storage.records import record_of
from sprag.service.storage.reserve import makes_room
from sprag.service.storage.tables import (
    CHUNKS,
    ENDINGS,
    HELD_AT_DEADLINE,
    IDEMPOTENCY_KEYS,
    RECORD_COLUMNS,
    ROUNDS,
    STUDIES,
    further_table,
    results_table,
)
from sprag.service.storage.users import Users
from sprag.service.storage.view_tables import SAVED_VIEWS
from sprag.worker.states import TERMINAL, StudyState

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator
    from datetime import datetime
    from threading import Event

#: Rows deleted in one transaction: other writers wait for it.
PURGED_ROWS: Final = 5_000
#: On a full disk fewer and fewer, down to so many.
LEAST_PURGED_ROWS: Final = 50


class Purging(Users, CaseKeys):
    """Deletion of studies, and their rows."""

    #: Set when a study is deleted whose rows are to be removed now (`Studies`).
    deleted: Event
    #: For how long a deleted study can be restored; set by the service.
    restorable = timedelta(0)

    @makes_room
    def delete_study(self, study_id: str, *, at_once: bool = False, read: Collection[str] | None = None) -> None:
        """Delete a study that has ended or is held at its deadline.

        Raises StudyNotFoundError, or StudyBusyError for any other study.

        The study is invisible when this returns, and can be restored for the time `restorable`, unless it is to be
        deleted ``at_once``; `Purging.purge_steps` removes its rows later. ``read``: the editions (`StudyRecord.etag`)
        that are meant; ChangedMeanwhileError for any other.
        """
        now, c = self._now(), STUDIES.c
        purge_at = 0 if at_once else now + self.restorable // timedelta(microseconds=1)
        # One that can be restored takes room as well, until it is deleted for good.
        there = c.deleted_at.is_(None) | (sa.literal(at_once) & (c.purge_at > now))
        with self.session.write() as connection:
            row = connection.execute(sa.select(*RECORD_COLUMNS).where(c.id == study_id, there)).one_or_none()
            if row is None:
                raise StudyNotFoundError(study_id)
            require_own("study", study_id, row.owner)
            require_edition("study", study_id, record_of(row).etag, read)
            state = StudyState(row.state)
            if not state.terminal and row.waits_for != HELD_AT_DEADLINE:
                raise StudyBusyError(f"the study {study_id} is {state.value}: cancel it before it is deleted")
            # From now on its key submits a new study.
            connection.execute(sa.delete(IDEMPOTENCY_KEYS).where(IDEMPOTENCY_KEYS.c.study == row.number))
            self._change(connection, row.number, deleted_at=now, purge_at=purge_at)
            note(connection, now, "study.delete", study_id, name=row.name, owner=row.owner)
        if purge_at <= now:
            self.deleted.set()

    def restore_study(self, study_id: str) -> None:
        """Undo the deletion of a study; raises StudyNotFoundError when its rows are being removed."""
        now, c = self._now(), STUDIES.c
        with self.session.write() as connection:
            found = connection.execute(
                sa.select(c.number, c.owner, c.name).where(
                    c.id == study_id, c.deleted_at.is_not(None), c.purge_at > now
                )
            ).one_or_none()
            if found is None:
                self._row(connection, study_id, c.number)  # one that is not deleted stays as it is
                return
            require_own("study", study_id, found.owner)
            self._change(connection, found.number, deleted_at=None, purge_at=None)
            note(connection, now, "study.restore", study_id, name=found.name)

    def prune(self, ended_before: datetime, *, dry: bool = False) -> list[str]:
        """Delete every study that ended, or was held at its deadline, before ``ended_before``; returns their ids.

        They cannot be restored: this is how room is made.
        ``dry``: only return the ids.
        """
        c = STUDIES.c
        ended = c.state.in_([state.value for state in TERMINAL]) & (c.finished_at < micros_of(ended_before))
        over = (c.waits_for == HELD_AT_DEADLINE) & (c.finish_by < micros_of(ended_before))
        old = (ended | over) & c.deleted_at.is_(None)
        with self.session.read() as connection:
            found = list(connection.execute(sa.select(c.id).where(old).order_by(c.number)).scalars())
        for study_id in () if dry else found:
            with suppress(StudyNotFoundError, StudyBusyError):  # somebody else has deleted it or runs it again
                self.delete_study(study_id, at_once=True)
        return found

    def purge(self) -> None:
        """Remove all of them now."""
        for _ in self.purge_steps():
            pass

    def purge_steps(self) -> Iterator[int]:
        """Remove them in short transactions; yields the number of rows that each deleted."""
        c = STUDIES.c
        over = c.deleted_at.is_not(None) & (sa.func.coalesce(c.purge_at, 0) <= self._now())
        with self.session.read() as connection:
            if connection.execute(sa.select(c.number).where(over).limit(1)).first() is None:
                return
        for number, model, variant in self._taken_away(over):
            rows = results_table(model, variant)
            yield from _emptied(partial(self._delete_first, rows, rows.c.case_number, number))
            if (further := further_table(model, variant)) is not None:
                yield from _emptied(partial(self._delete_first, further, further.c.case_number, number))
            yield from _emptied(partial(self._delete_first, CHUNKS, CHUNKS.c["first"], number))
            if keys := self._keys(number):
                yield from _emptied(partial(self._delete_keys, keys, number))
            self._remove(number)
            yield 1

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
            for table in (ENDINGS, ROUNDS, SAVED_VIEWS):
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
