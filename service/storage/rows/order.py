"""The cases of a chunk: consecutive numbers, or those at its positions in the order of the study."""

from __future__ import annotations

from threading import Lock
from typing import TYPE_CHECKING, Final

import numpy as np
import sqlalchemy as sa
from cachetools import LRUCache

from sprag_study.service.storage.part import Part
from sprag_study.service.storage.tables import CHUNKS, STUDIES
from sprag_study.worker.order import coverage, order_of
from sprag_study.worker.states import ChunkState
from sprag_study.worker.study import Study
from sprag_study.worker.sweeps import LineOrder

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.service.storage.database.session import Session
    from sprag_study.worker.order import Coverage, Order
    from sprag_study.worker.ports import Chunk, Clock

#: Studies whose orders are kept in memory; each takes a few numbers per value of an axis, or of the list.
_KEPT: Final = 16


class Orders(Part):
    """The orders of studies, which never change."""

    def __init__(self, session: Session, clock: Clock) -> None:
        super().__init__(session, clock)
        self._orders: LRUCache[int, Order | None] = LRUCache(_KEPT)
        self._orders_lock = Lock()

    def of(self, number: int, connection: sa.Connection | None = None) -> Order | None:
        """The order of a study; None where its cases run in the order of their numbers.

        Without a connection it is read once, in a transaction of its own.
        """
        with self._orders_lock:
            if number in self._orders:
                return self._orders[number]
        if connection is None:
            with self.session.read() as own:
                return self.of(number, own)
        coarse, text = connection.execute(
            sa.select(STUDIES.c.coarse, sa.case((STUDIES.c.coarse != 0, STUDIES.c.study), else_="")).where(
                STUDIES.c.number == number
            )
        ).one()
        found = order_of(Study.from_text(text)) if coarse else None
        with self._orders_lock:
            self._orders[number] = found
        return found

    def cases(self, chunk: Chunk, connection: sa.Connection | None = None) -> NDArray[np.int64]:
        """Numbers of the cases of a chunk, int64 array of shape (chunk.count,), ascending."""
        positions = np.arange(chunk.first, chunk.first + chunk.count, dtype=np.int64)
        order = self.of(chunk.study, connection)
        return positions if order is None else np.sort(order.cases(positions))

    def unit(self, number: int, connection: sa.Connection) -> int:
        """Cases of a study that cannot be run apart: those of a line of a sweep, otherwise 1."""
        order = self.of(number, connection)
        return order.unit if isinstance(order, LineOrder) else 1

    def coverage(self, connection: sa.Connection, number: int, cases: int) -> Coverage | None:
        """The complete part of a study of ``cases`` cases; None where it is not run coarse to fine."""
        order = self.of(number, connection)
        if order is None or not order.passes:
            return None
        c = CHUNKS.c
        first_open, done = connection.execute(
            sa.select(
                sa.func.min(sa.case((c.state != ChunkState.DONE, c["first"]))),
                sa.func.coalesce(sa.func.sum(sa.case((c.state == ChunkState.DONE, c["count"]), else_=0)), 0),
            ).where(c.study == number)
        ).one()
        if first_open is not None:
            return coverage(order, first_open)
        return coverage(order, cases if done == cases else _first_gap(connection, number))


def _first_gap(connection: sa.Connection, number: int) -> int:
    """First position without a chunk: a cancelled study has lost its open ones."""
    ends = sa.select((CHUNKS.c["first"] + CHUNKS.c["count"]).label("end")).where(CHUNKS.c.study == number).subquery()
    begins = sa.select(CHUNKS.c["first"]).where(CHUNKS.c.study == number)
    if connection.execute(begins.where(CHUNKS.c["first"] == 0)).first() is None:
        return 0
    gap: int = connection.execute(sa.select(sa.func.min(ends.c.end)).where(ends.c.end.not_in(begins))).scalar_one()
    return gap
