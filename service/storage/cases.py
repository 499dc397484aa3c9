"""Reading results: pages, streams and columns of cases."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import sqlalchemy as sa

from sprag.service.storage.order import Orders
from sprag.service.storage.part import MAX_INTEGER
from sprag.service.storage.records import CaseColumns, CaseRow, RowBlock
from sprag.service.storage.tables import CHUNKS, ENDINGS, STUDIES, results_table
from sprag.worker import models
from sprag.worker.models import WorkerEnding, regime_info
from sprag.worker.states import ChunkState, StudyState

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import ArrayLike, NDArray

#: Cases named one by one in a statement.
CASES_AT_ONCE = 5_000
#: Rows of one block of a stream.
BLOCK_ROWS = 2_000


@dataclass(frozen=True, slots=True)
class _Rows:
    """Where the rows of a study are."""

    number: int
    table: sa.Table
    infos: tuple[models.ResultInfo, ...]
    cases: int
    cancelled: bool


class Cases(Orders):
    """Rows of finished cases; and the cases that a cancelled study never ran, which have no rows in the database."""

    def _rows(self, connection: sa.Connection, study_id: str) -> _Rows:
        c = STUDIES.c
        row = self._row(connection, study_id, c.number, c.model, c.variant, c.cases, c.state)
        return _Rows(
            row.number,
            results_table(row.model, row.variant),
            models.result_infos(row.model, row.variant),
            row.cases,
            row.state == StudyState.CANCELLED.value,
        )

    def case_rows(self, study_id: str, after_case: int = -1, limit: int = BLOCK_ROWS) -> RowBlock:
        """At most ``limit`` finished cases with numbers above ``after_case``, in order; raises StudyNotFound."""
        with self.session.read() as connection:
            rows = self._rows(connection, study_id)
            return _block(rows.infos, _read(connection, rows, after_case, limit))

    def case_page(
        self,
        study_id: str,
        after_case: int = -1,
        limit: int = BLOCK_ROWS,
        ending: str | None = None,
        regime: str | None = None,
    ) -> RowBlock:
        """The same, and the cases that a cancelled study never ran in their places among them.

        With ``ending`` only the cases that ended so, with ``regime`` only those of that regime.
        """
        cancelled: str = WorkerEnding.CANCELLED.value
        with self.session.read() as connection:
            rows = self._rows(connection, study_id)
            found = [] if ending == cancelled else _read(connection, rows, after_case, limit, ending, regime)
            if rows.cancelled and ending in {None, cancelled} and regime is None:
                nothing = [None] * len(rows.infos)
                left = itertools.islice(self._never_run(connection, rows, after_case), limit)
                found = [*found, *((case, cancelled, "", *nothing) for case in left)]
                found = sorted(found, key=lambda row: int(row[0]))[:limit]
        return _block(rows.infos, found)

    def regimes(self, study_id: str) -> dict[str, int]:
        """How many finished cases have which regime, the most frequent first; empty where there are no regimes.

        Raises StudyNotFound.
        """
        with self.session.read() as connection:
            rows = self._rows(connection, study_id)
            info = regime_info(rows.infos)
            if info is None:
                return {}
            column, count = rows.table.c[info.column], sa.func.count()
            query = sa.select(column, count).where(rows.table.c.study == rows.number, column.is_not(None))
            found = connection.execute(query.group_by(column).order_by(count.desc(), column)).all()
        return {info.categories[code]: cases for code, cases in found}

    def cases_of_regime(self, study_id: str, regime: str) -> NDArray[np.int64]:
        """Numbers of the cases of a regime, ascending; raises StudyNotFound."""
        with self.session.read() as connection:
            rows = self._rows(connection, study_id)
            info, c = regime_info(rows.infos), rows.table.c
            if info is None:
                return np.empty(0, dtype=np.int64)
            code = info.categories.index(regime)
            query = sa.select(c.case_number).where(c.study == rows.number, c[info.column] == code)
            found = connection.execute(query.order_by(c.case_number)).scalars()
            return np.fromiter(found, dtype=np.int64)

    def iter_rows(self, study_id: str, block: int = BLOCK_ROWS) -> Iterator[RowBlock]:
        """Every finished case in order, ``block`` cases at a time, each block read in its own short transaction."""
        after = -1
        while len(found := self.case_rows(study_id, after, block)):
            yield found
            after = int(found.cases[-1])

    def case_row(self, study_id: str, case: int) -> CaseRow | None:
        """One case, None while it is not finished; raises StudyNotFound."""
        found = self.case_page(study_id, case - 1, 1)
        return next(found.rows()) if len(found) and found.cases[0] == case else None

    def rows_for_cases(self, study_id: str, cases: ArrayLike, names: Sequence[str]) -> CaseColumns:
        """Results ``names`` of the given case numbers (shape (m,), any order), aligned with them.

        Raises StudyNotFound, and KeyError for a name that is not a result of the study.
        """
        wanted: NDArray[np.int64] = np.asarray(cases, dtype=np.int64).reshape(-1)
        unique, position = np.unique(wanted, return_inverse=True)
        endings = np.full(unique.size, None, dtype=object)
        values = np.full((unique.size, len(names)), np.nan)
        with self.session.read() as connection:
            rows = self._rows(connection, study_id)
            columns = {info.name: info.column for info in rows.infos}
            c = rows.table.c
            query = sa.select(c.case_number, c.ending, *(c[columns[name]] for name in names)).where(
                c.study == rows.number
            )
            for condition in conditions(c.case_number, unique):
                found = connection.execute(query.where(condition)).all()
                if found:
                    numbers, ended, *results = zip(*found, strict=True)
                    at = np.searchsorted(unique, np.array(numbers, dtype=np.int64))
                    endings[at] = np.array(ended, dtype=object)
                    for index, column in enumerate(results):
                        values[at, index] = np.array(column, dtype=np.float64)
        if rows.cancelled:
            endings[[ending is None for ending in endings]] = WorkerEnding.CANCELLED.value
        return CaseColumns(
            wanted,
            endings[position].tolist(),
            {name: values[position, index] for index, name in enumerate(names)},
        )

    def _never_run(self, connection: sa.Connection, rows: _Rows, after_case: int) -> Iterator[int]:
        """Cases above ``after_case`` that are in no chunk that is done, in order."""
        c = CHUNKS.c
        done = (
            sa.select(c["first"], c["count"])
            .where(c.study == rows.number, c.state == ChunkState.DONE)
            .order_by(c["first"])
        )
        order = self._order(rows.number, connection)
        if order is not None:
            never = np.ones(rows.cases, dtype=np.bool_)
            for first, count in connection.execute(done):
                never[first : first + count] = False
            left = np.sort(order.cases(np.flatnonzero(never)))
            yield from left[np.searchsorted(left, after_case, side="right") :].tolist()
            return
        reached = after_case + 1
        for first, count in connection.execute(done.where(c["first"] + c["count"] > min(reached, MAX_INTEGER))):
            yield from range(reached, first)
            reached = max(reached, first + count)
        yield from range(reached, rows.cases)


def _read(
    connection: sa.Connection,
    rows: _Rows,
    after_case: int,
    limit: int,
    ending: str | None = None,
    regime: str | None = None,
) -> Sequence[Sequence[Any]]:
    """Rows of the database: number, ending, flags, results."""
    c = rows.table.c
    query = sa.select(c.case_number, c.ending, c.flags, *(c[info.column] for info in rows.infos)).where(
        c.study == rows.number, c.case_number > min(after_case, MAX_INTEGER)
    )
    if regime is not None:
        info = regime_info(rows.infos)
        if info is None or regime not in info.categories:
            return []
        query = query.where(c[info.column] == info.categories.index(regime))
    if ending is not None:
        ended = connection.execute(
            sa.select(ENDINGS.c.cases).where(ENDINGS.c.study == rows.number, ENDINGS.c.ending == ending)
        ).scalar_one_or_none()
        # The rows are not ordered by ending: without the count, a rare one would have every row of the study read.
        if not ended:
            return []
        query, limit = query.where(c.ending == ending), min(limit, ended)
    return connection.execute(query.order_by(c.case_number).limit(limit)).all()


def conditions(column: sa.ColumnElement[Any], cases: NDArray[np.int64]) -> Iterator[sa.ColumnElement[bool]]:
    """Conditions that together select exactly ``cases`` (ascending, each once)."""
    if not cases.size:
        return
    low, high = int(cases[0]), int(cases[-1])
    if high - low + 1 == cases.size:
        yield column.between(low, high)
        return
    for start in range(0, cases.size, CASES_AT_ONCE):
        yield column.in_(cases[start : start + CASES_AT_ONCE].tolist())


def _block(infos: tuple[models.ResultInfo, ...], found: Sequence[Sequence[Any]]) -> RowBlock:
    if not found:
        return RowBlock(infos, np.empty(0, dtype=np.int64), [], [], np.empty((0, len(infos))))
    values = np.array([row[3:] for row in found], dtype=np.float64)
    return RowBlock(
        infos,
        np.array([row[0] for row in found], dtype=np.int64),
        [row[1] for row in found],
        [row[2] for row in found],
        values,
    )
