"""Removal of the rows of deleted studies in steps, so that other writers can work in between."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import sqlalchemy as sa

from sprag.service.storage.part import Part
from sprag.service.storage.tables import CHUNKS, ROUNDS, STUDIES, further_table, results_table

if TYPE_CHECKING:
    from collections.abc import Iterator

#: Rows deleted in one transaction: other writers wait for it.
PURGED_ROWS: Final = 5_000


class Purging(Part):
    """The rows of deleted studies."""

    def purge(self) -> None:
        """Remove all of them now."""
        for _ in self.purge_steps():
            pass

    def purge_steps(self) -> Iterator[int]:
        """Remove them in short transactions; yields the number of rows that each deleted."""
        c = STUDIES.c
        with self.session.read() as connection:
            gone = connection.execute(sa.select(c.number, c.model, c.variant).where(c.deleted_at.is_not(None))).all()
        for number, model, variant in gone:
            rows = results_table(model, variant)
            yield from self._emptied(rows, rows.c.case_number, number)
            if (further := further_table(model, variant)) is not None:
                yield from self._emptied(further, further.c.case_number, number)
            yield from self._emptied(CHUNKS, CHUNKS.c["first"], number)
            with self.session.write() as connection:
                connection.execute(sa.delete(ROUNDS).where(ROUNDS.c.study == number))
                connection.execute(sa.delete(STUDIES).where(c.number == number))
            yield 1

    def _emptied(self, table: sa.Table, key: sa.Column[int], number: int) -> Iterator[int]:
        """Delete the rows of a study from a table, in the order of ``key``, which few rows share."""
        mine = table.c.study == number
        while True:
            with self.session.write() as connection:
                # The first row that is kept; none where the rest is small enough.
                edge = connection.execute(
                    sa.select(key).where(mine).order_by(key).offset(PURGED_ROWS).limit(1)
                ).scalar_one_or_none()
                deleted = connection.execute(sa.delete(table).where(mine, sa.true() if edge is None else key < edge))
            yield deleted.rowcount
            if edge is None:
                return
