"""Rows of results: pages, streams and columns of cases, and where they come from."""

from __future__ import annotations

import itertools
from collections import Counter
from dataclasses import dataclass, field, replace
from threading import Lock
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import sqlalchemy as sa
from cachetools import LRUCache

from sprag_study.service.storage.part import MAX_INTEGER, Part, row_of
from sprag_study.service.storage.rows.columns import RowColumns, as_number, conditions, records
from sprag_study.service.storage.rows.digests import LOOKED_OVER
from sprag_study.service.storage.rows.origins import CasesOf, Origin, differences_of
from sprag_study.service.storage.studies.records import CaseColumns, CaseRow, Kinds, RowBlock
from sprag_study.service.storage.tables import CHUNKS, ENDINGS, STUDIES, further_table, results_table
from sprag_study.worker import models
from sprag_study.worker.models import WorkerEnding, regime_info
from sprag_study.worker.ports import Chunk
from sprag_study.worker.states import ChunkState, StudyState

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from numpy.typing import ArrayLike, NDArray

    from sprag_study.service.storage.database.session import Session
    from sprag_study.service.storage.rows.digests import Digests
    from sprag_study.service.storage.rows.order import Orders
    from sprag_study.service.storage.studies.studies import Studies
    from sprag_study.worker.arrays import Floats, Ints
    from sprag_study.worker.models import Quantities
    from sprag_study.worker.ports import Clock

#: Rows of one block of a stream.
BLOCK_ROWS = 2_000
#: Rows of a column that are read at once.
_COLUMN_ROWS: Final = 20_000
#: Studies whose counts of regimes and flags are kept.
_MOST_COUNTED = 256
_NO_CASES: Final = np.empty(0, dtype=np.int64)


@dataclass(frozen=True, slots=True)
class _Rows:
    """Where the rows of a study are."""

    number: int
    table: sa.Table
    infos: tuple[models.ResultInfo, ...]
    cases: int
    cancelled: bool
    #: Rows above number 0 of cases that can have several; None where they cannot, and the result with their number.
    further: sa.Table | None = None
    numbered: str | None = None


def _rows(connection: sa.Connection, study_id: str) -> _Rows:
    c = STUDIES.c
    row = row_of(connection, study_id, c.number, c.model, c.variant, c.cases, c.state)
    return _Rows(
        row.number,
        results_table(row.model, row.variant),
        models.result_infos(row.model, row.variant),
        row.cases,
        row.state == StudyState.CANCELLED.value,
        further_table(row.model, row.variant),
        models.numbered_by(row.model, row.variant),
    )


#: A finished chunk: its range of places, and when it finished.
_Done = tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class _Counted:
    """The kinds of a study at a revision; of one that still runs, also their numbers and the chunks with these rows."""

    revision: int
    kinds: Kinds
    rows: Counter[tuple[str, int | None]] = field(default_factory=Counter)
    chunks: frozenset[_Done] = frozenset()


class Rows(Part):
    """Rows of finished cases, and the cases that a cancelled study never ran, which have no rows in the database.

    They have the results of the model, as they are stored, and the quantities of the study, computed from these.

    What answers are made of is looked over before (`Digests.require_undamaged`): `page`, `case`, `of_case`, `for_cases`
    and `columns` raise DatabaseError where rows changed since they were stored. Exports look over the whole study, and
    then use `blocks`.
    """

    def __init__(self, session: Session, clock: Clock, orders: Orders, digests: Digests, studies: Studies) -> None:
        super().__init__(session, clock)
        self._orders, self._digests, self._studies = orders, digests, studies
        self._counted: LRUCache[str, _Counted] = LRUCache(_MOST_COUNTED)
        self._counting = Lock()

    def block(self, study_id: str, after_case: int = -1, limit: int = BLOCK_ROWS) -> RowBlock:
        """At most ``limit`` finished cases with numbers above ``after_case``, in order; raises StudyNotFoundError.

        With all rows of cases that have several, in the order of their numbers.
        """
        with self.session.read() as connection:
            rows = _rows(connection, study_id)
            block = _block(rows.infos, _with_further(connection, rows, _read(connection, rows, after_case, limit)))
        return self._with_quantities(study_id, block)

    def page(
        self,
        study_id: str,
        after_case: int = -1,
        limit: int = BLOCK_ROWS,
        ending: str | None = None,
        regime: str | None = None,
        flag: str | None = None,
    ) -> RowBlock:
        """The first row of each, with the cases that a cancelled study never ran at their positions.

        ``ending``, ``regime`` and ``flag`` select the cases with that ending, regime or flag.
        """
        self._digests.require_undamaged(study_id, np.arange(after_case + 1, after_case + 1 + limit))
        cancelled: str = WorkerEnding.CANCELLED.value
        with self.session.read() as connection:
            rows = _rows(connection, study_id)
            found = [] if ending == cancelled else _read(connection, rows, after_case, limit, ending, regime, flag)
            if rows.cancelled and ending in {None, cancelled} and regime is None and flag is None:
                nothing = [None] * len(rows.infos)
                left = itertools.islice(self._never_run(connection, rows, after_case), limit)
                found = [*found, *((case, cancelled, "", *nothing) for case in left)]
                found = sorted(found, key=lambda row: int(row[0]))[:limit]
        block = _block(rows.infos, found)
        if any(kind is not None for kind in (ending, regime, flag)):
            self._digests.require_undamaged(study_id, block.cases)
        return self._with_quantities(study_id, block)

    def kinds(self, study_id: str) -> Kinds:
        """How many finished cases have which regime and which flag; raises StudyNotFoundError.

        Counting reads every row of the study, so that the counts of a revision, with which its rows change, are kept.
        Until the study is over, only the rows of chunks that finished since are counted; afterwards a retry may replace
        rows.
        """
        with self.session.read() as connection:
            c = STUDIES.c
            row = row_of(connection, study_id, c.revision, c.state)
            with self._counting:
                kept = self._counted.get(study_id)
            if kept is not None and kept.revision == row.revision:
                return kept.kinds
            rows = _rows(connection, study_id)
            done = _done(connection, rows.number)
            if kept is not None and kept.chunks and kept.chunks <= done:
                counts = kept.rows + self._count_new(connection, rows, done - kept.chunks)
            else:
                counts = _count(connection, rows)
        counted = _Counted(row.revision, _kinds(rows, counts))
        if not StudyState(row.state).terminal:
            counted = replace(counted, rows=counts, chunks=done)
        with self._counting:
            self._counted[study_id] = counted
        return counted.kinds

    def _count_new(
        self, connection: sa.Connection, rows: _Rows, chunks: Iterable[_Done]
    ) -> Counter[tuple[str, int | None]]:
        """Numbers of the rows of these chunks by flags and regime."""
        cases = [self._orders.cases(Chunk(rows.number, first, count), connection) for first, count, _ in chunks]
        counts: Counter[tuple[str, int | None]] = Counter()
        for condition in conditions(rows.table.c.case_number, np.sort(np.concatenate([_NO_CASES, *cases]))):
            counts += _count(connection, rows, condition)
        return counts

    def cases_of_kind(self, study_id: str, regime: str | None = None, flag: str | None = None) -> Ints:
        """Numbers of the cases of a regime or with a flag, ascending; raises StudyNotFoundError."""
        with self.session.read() as connection:
            rows = _rows(connection, study_id)
            kind = _of_kind(rows, regime, flag)
            if kind is None:
                return _NO_CASES
            c = rows.table.c
            query = sa.select(c.case_number).where(c.study == rows.number, *kind)
            found = connection.execute(query.order_by(c.case_number)).scalars()
            return np.fromiter(found, dtype=np.int64)

    def blocks(self, study_id: str, size: int = BLOCK_ROWS) -> Iterator[RowBlock]:
        """Every finished case in order, ``size`` cases at a time, each block read in its own short transaction."""
        after = -1
        while len(found := self.block(study_id, after, size)):
            yield found
            after = int(found.cases[-1])

    def case(self, study_id: str, case: int) -> CaseRow | None:
        """One case, None while it is not finished; raises StudyNotFoundError."""
        found = self.page(study_id, case - 1, 1)
        return next(found.rows()) if len(found) and found.cases[0] == case else None

    def of_case(self, study_id: str, case: int) -> tuple[CaseRow, ...]:
        """Every row of a case in the order of their numbers, none while it is not finished."""
        self._digests.require_undamaged(study_id, np.array([case]))
        return tuple(row for row in self.block(study_id, case - 1, 1).rows() if row.case == case)

    def for_cases(self, study_id: str, cases: ArrayLike, names: Sequence[str], number: int = 0) -> CaseColumns:
        """Results ``names`` of the given case numbers (shape (m,), any order), aligned with them.

        Of cases with several rows those of the row with that ``number``; a case without one has its ending and no
        results. Raises StudyNotFoundError, and KeyError for a name that is not a result of the study.
        """
        wanted: Ints = np.asarray(cases, dtype=np.int64).reshape(-1)
        self._digests.require_undamaged(study_id, wanted)
        stored, quantities = self._split(study_id, names)
        columns = self._stored_for(study_id, wanted, stored, number)
        if quantities is None:
            return columns
        ran = np.array([ending not in {None, WorkerEnding.CANCELLED} for ending in columns.endings], dtype=np.bool_)
        values = {**columns.values, **quantities.columns(wanted, columns.values, ran)}
        return replace(columns, values={name: values[name] for name in names})

    def _stored_for(self, study_id: str, wanted: Ints, names: Sequence[str], number: int) -> CaseColumns:
        """`for_cases` of results that are stored."""
        unique, position = np.unique(wanted, return_inverse=True)
        endings, flags = np.full(unique.size, None, dtype=object), np.full(unique.size, "", dtype=object)
        values = np.full((unique.size, len(names)), np.nan)
        with self.session.read() as connection:
            rows = _rows(connection, study_id)
            columns = {info.name: info.column for info in rows.infos}
            wanted_columns = [columns[name] for name in names]
            _fill(connection, rows, rows.table, wanted_columns if number == 0 else [], unique, endings, flags, values)
            if number and rows.further is not None and rows.numbered is not None:
                own = rows.further.c[columns[rows.numbered]] == number
                _fill(connection, rows, rows.further, wanted_columns, unique, endings, flags, values, own)
        if rows.cancelled:
            endings[[ending is None for ending in endings]] = WorkerEnding.CANCELLED.value
        return CaseColumns(
            wanted,
            endings[position].tolist(),
            {name: values[position, index] for index, name in enumerate(names)},
            flags[position].tolist(),
        )

    def columns(self, study_id: str, names: Sequence[str]) -> RowColumns:
        """Results ``names`` of every finished case; raises StudyNotFoundError, and KeyError for an unknown name."""
        self._digests.require_undamaged(study_id, np.arange(LOOKED_OVER + 1))
        stored, quantities = self._split(study_id, names)
        columns = self._stored_columns(study_id, stored)
        if quantities is None:
            return columns
        values = {**columns.values, **quantities.columns(columns.cases, columns.values)}
        return replace(columns, values={name: values[name] for name in names})

    def _stored_columns(self, study_id: str, names: Sequence[str]) -> RowColumns:
        """`columns` of results that are stored."""
        kinds: dict[tuple[str, str], int] = {}
        types = [("case", np.int64), ("ending", object), ("flags", object)]
        layout = np.dtype([*types, *((f"value{index}", np.float64) for index in range(len(names)))])
        parts: list[tuple[Ints, NDArray[np.int32], Floats]] = []
        with self.session.read() as connection:
            rows = _rows(connection, study_id)
            c, own = rows.table.c, {info.name: rows.table.c[info.column] for info in rows.infos}
            query = sa.select(c.case_number, c.ending, c.flags, *(as_number(own[name]) for name in names))
            query = query.where(c.study == rows.number).order_by(c.case_number).limit(_COLUMN_ROWS)
            last = -1
            while len(part := records(connection, query.where(c.case_number > last), layout)):
                pairs = zip(part["ending"].tolist(), part["flags"].tolist(), strict=True)
                codes = np.array([kinds.setdefault(pair, len(kinds)) for pair in pairs], dtype=np.int32)
                columns = [part[f"value{index}"] for index in range(len(names))]
                parts.append((part["case"].copy(), codes, np.array(columns).reshape(len(names), len(part))))
                last = int(part["case"][-1])
        if not parts:
            return RowColumns(np.empty(0, np.int64), (), np.empty(0, np.int32), {name: np.empty(0) for name in names})
        cases, kind = (np.concatenate([part[index] for part in parts]) for index in (0, 1))
        values = {name: np.concatenate([part[2][row] for part in parts]) for row, name in enumerate(names)}
        return RowColumns(cases, tuple(kinds), kind.astype(np.int32), values)

    def _split(self, study_id: str, names: Sequence[str]) -> tuple[Sequence[str], Quantities | None]:
        """The stored results that ``names`` need, and the quantities among them; None where there is none.

        Raises StudyNotFoundError, and KeyError for a name that is neither.
        """
        with self.session.read() as connection:
            infos = _rows(connection, study_id).infos
        known = {info.name for info in infos}
        if known.issuperset(names):
            return names, None
        study = self._studies.study(study_id)
        quantities = models.Quantities(study, models.numeric(infos), (name for name in names if name not in known))
        stored = (name for name in names if name in known)
        return list(dict.fromkeys([*stored, *quantities.results])), quantities

    def _with_quantities(self, study_id: str, block: RowBlock) -> RowBlock:
        """Rows with the quantities of their study behind the stored results."""
        study = self._studies.study(study_id)
        if not study.quantities:
            return block
        ran = np.array([ending != WorkerEnding.CANCELLED for ending in block.endings], dtype=np.bool_)
        values = models.with_quantities(study, block.infos, block.cases, block.values, ran)
        infos = (*block.infos, *(one.info for one in study.quantities))
        return replace(block, infos=infos, values=values)

    def origins(self, study_id: str) -> tuple[Origin, ...]:
        """The origins of the rows of a study, most cases first, those without a fingerprint last.

        Raises StudyNotFoundError.
        """
        c = CHUNKS.c
        cases = sa.func.sum(c["count"])
        with self.session.read() as connection:
            number = row_of(connection, study_id, STUDIES.c.number).number
            query = sa.select(c.host, c.fingerprint, sa.func.count(), cases)
            query = query.where(c.study == number, c.state == ChunkState.DONE)
            rows = connection.execute(query.group_by(c.host, c.fingerprint)).all()
            found = [Origin(host, digest, int(chunks), int(cases)) for host, digest, chunks, cases in rows]
            # Those without a fingerprint last: the others are compared with the first.
            found.sort(key=lambda item: (not item.fingerprint, -item.cases, item.host or "", item.fingerprint or ""))
            differs = differences_of(connection, [item.fingerprint for item in found])
        return tuple(replace(item, differs=difference) for item, difference in zip(found, differs, strict=True))

    def cases_by_fingerprint(self, study_id: str) -> list[CasesOf]:
        """The ranges of cases that were computed under one fingerprint, in order; raises StudyNotFoundError.

        [] for a study that is not run in the order of its cases.
        """
        c = CHUNKS.c
        found: list[CasesOf] = []
        with self.session.read() as connection:
            study = row_of(connection, study_id, STUDIES.c.number, STUDIES.c.coarse)
            if study.coarse:
                return []
            query = sa.select(c["first"], c["count"], c.fingerprint).order_by(c["first"])
            query = query.where(c.study == study.number, c.state == ChunkState.DONE, c.fingerprint.is_not(None))
            for first, count, digest in connection.execute(query):
                neighbour = found and (found[-1].last, found[-1].fingerprint) == (first - 1, digest)
                found.append(CasesOf(digest, found.pop().first if neighbour else first, first + count - 1))
        return found

    def _never_run(self, connection: sa.Connection, rows: _Rows, after_case: int) -> Iterator[int]:
        """Cases above ``after_case`` that belong to no finished chunk, in order."""
        c = CHUNKS.c
        done = (
            sa.select(c["first"], c["count"])
            .where(c.study == rows.number, c.state == ChunkState.DONE)
            .order_by(c["first"])
        )
        order = self._orders.of(rows.number, connection)
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


def _done(connection: sa.Connection, number: int) -> frozenset[_Done]:
    c = CHUNKS.c
    query = sa.select(c["first"], c["count"], c.finished_at)
    chunks = connection.execute(query.where(c.study == number, c.state == ChunkState.DONE)).all()
    return frozenset((first, count, finished_at) for first, count, finished_at in chunks)


def _fill(
    connection: sa.Connection,
    rows: _Rows,
    table: sa.Table,
    columns: Sequence[str],
    cases: Ints,
    endings: NDArray[np.object_],
    flags: NDArray[np.object_],
    values: Floats,
    *which: sa.ColumnElement[bool],
) -> None:
    """Write endings, flags (shape (m,)) and columns (shape (m, columns)) of ``cases`` (ascending) that a table has."""
    c = table.c
    query = sa.select(c.case_number, c.ending, c.flags, *(c[name] for name in columns))
    query = query.where(c.study == rows.number, *which)
    for condition in conditions(c.case_number, cases):
        found = connection.execute(query.where(condition)).all()
        if found:
            numbers, ended, flagged, *results = zip(*found, strict=True)
            at = np.searchsorted(cases, np.array(numbers, dtype=np.int64))
            endings[at], flags[at] = np.array(ended, dtype=object), np.array(flagged, dtype=object)
            for index, column in enumerate(results):
                values[at, index] = np.array(column, dtype=np.float64)


def _with_further(connection: sa.Connection, rows: _Rows, found: Sequence[Sequence[Any]]) -> Sequence[Sequence[Any]]:
    """Rows of consecutive finished cases with their further rows among them."""
    if rows.further is None or rows.numbered is None or not found:
        return found
    c = rows.further.c
    names = [info.column for info in rows.infos]
    between = c.case_number.between(found[0][0], found[-1][0])
    query = sa.select(c.case_number, c.ending, c.flags, *(c[name] for name in names))
    more = connection.execute(query.where(c.study == rows.number, between)).all()
    place = 3 + [info.name for info in rows.infos].index(rows.numbered)
    # A failed case has no number.
    return sorted([*found, *more], key=lambda row: (row[0], row[place] or 0))


def _read(
    connection: sa.Connection,
    rows: _Rows,
    after_case: int,
    limit: int,
    ending: str | None = None,
    regime: str | None = None,
    flag: str | None = None,
) -> Sequence[Sequence[Any]]:
    """Rows of the database: number, ending, flags, results."""
    c = rows.table.c
    query = sa.select(c.case_number, c.ending, c.flags, *(c[info.column] for info in rows.infos)).where(
        c.study == rows.number, c.case_number > min(after_case, MAX_INTEGER)
    )
    kind = _of_kind(rows, regime, flag)
    if kind is None:
        return []
    query = query.where(*kind)
    if ending is not None:
        ended = connection.execute(
            sa.select(ENDINGS.c.cases).where(ENDINGS.c.study == rows.number, ENDINGS.c.ending == ending)
        ).scalar_one_or_none()
        # Rows are not ordered by ending: without the count, a rare ending would require reading all rows of the study.
        if not ended:
            return []
        query, limit = query.where(c.ending == ending), min(limit, ended)
    return connection.execute(query.order_by(c.case_number).limit(limit)).all()


def _count(
    connection: sa.Connection, rows: _Rows, *conditions: sa.ColumnElement[bool]
) -> Counter[tuple[str, int | None]]:
    """Numbers of the study's rows by joined flags and code of the regime (None: the study has none)."""
    info, c = regime_info(rows.infos), rows.table.c
    keys = [c.flags] if info is None else [c.flags, c[info.column]]
    query = sa.select(sa.func.count(), *keys).where(c.study == rows.number, *conditions)
    found = connection.execute(query.group_by(*keys)).all()
    return Counter({(flags, code[0] if code else None): cases for cases, flags, *code in found})


def _kinds(rows: _Rows, counts: Counter[tuple[str, int | None]]) -> Kinds:
    info = regime_info(rows.infos)
    regimes, flags = Counter[str](), Counter[str]()
    for (joined, code), cases in counts.items():
        for flag in filter(None, joined.split(",")):
            flags[flag] += cases
        if info is not None and code is not None:
            regimes[info.categories[code]] += cases
    order = {} if info is None else {name: place for place, name in enumerate(info.categories)}
    return Kinds(_by_frequency(regimes, order), _by_frequency(flags, {}))


def _of_kind(rows: _Rows, regime: str | None, flag: str | None) -> list[sa.ColumnElement[bool]] | None:
    """Conditions that select the rows with a regime and a flag; None where there can be no such row."""
    found: list[sa.ColumnElement[bool]] = []
    if regime is not None:
        info = regime_info(rows.infos)
        if info is None or regime not in info.categories:
            return None
        found.append(rows.table.c[info.column] == info.categories.index(regime))
    if flag is not None:
        joined: sa.ColumnElement[str] = sa.literal(",") + rows.table.c.flags + sa.literal(",")
        found.append(joined.contains(f",{flag},", autoescape=True))
    return found


def _by_frequency(counts: Counter[str], order: Mapping[str, int]) -> dict[str, int]:
    """The counts, largest first; equal ones in ``order``, then by name."""
    return dict(sorted(counts.items(), key=lambda item: (-item[1], order.get(item[0], 0), item[0])))


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
