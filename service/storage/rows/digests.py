"""Digests of rows: flipped bits in stored results are noticed, whatever the database thinks of its pages.

Each finished chunk has the sum of the hashes of its rows (`sprag_study.service.storage.rows.hashes`).
"""

from __future__ import annotations

import logging
from contextlib import suppress
from dataclasses import dataclass
from threading import Lock
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import sqlalchemy as sa
from cachetools import TTLCache

from sprag_study.service.storage.errors import DatabaseError
from sprag_study.service.storage.part import Part, change_row, move_row, row_of
from sprag_study.service.storage.people.audit import note
from sprag_study.service.storage.rows.columns import as_number, conditions, records
from sprag_study.service.storage.rows.hashes import as_kept, digest_of, row_words
from sprag_study.service.storage.studies.round_table import rounds_of
from sprag_study.service.storage.studies.study_digests import counts_differ, require_whole
from sprag_study.service.storage.tables import CHUNKS, ENDINGS, STUDIES, further_table, results_table
from sprag_study.worker import models
from sprag_study.worker.ports import Chunk
from sprag_study.worker.states import ChunkState, StudyEvent, StudyState

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from sprag_study.service.storage.database.session import Session
    from sprag_study.service.storage.rows.hashes import Words
    from sprag_study.service.storage.rows.order import Orders
    from sprag_study.worker.arrays import Ints
    from sprag_study.worker.ports import Clock

_LOG = logging.getLogger("sprag.digests")

#: Most cases whose rows are looked over before an answer about a study is given; housekeeping looks over the rest.
LOOKED_OVER: Final = 20_000
#: Finished chunks that a process keeps in memory as looked over.
_KEPT: Final = 50_000
#: Seconds after which a process looks at rows again.
_AGAIN: Final = 600.0
#: What reading flipped bits as numbers, cases and texts may raise.
_UNREADABLE: Final = (ValueError, TypeError, OverflowError, IndexError, sa.exc.DBAPIError)
#: Rows that are read at once.
_PART: Final = 5_000
_CANCELLED: Final = frozenset({StudyState.CANCELLING, StudyState.CANCELLED})


@dataclass(frozen=True, slots=True)
class DamagedRows:
    """A finished chunk whose rows are not those that were stored: its study, and its cases from first to last."""

    study: str
    chunk: Chunk
    first: int
    last: int

    def __str__(self) -> str:
        cases = f"case {self.first}" if self.first == self.last else f"cases {self.first} to {self.last}"
        return f"the rows of the study {self.study}, {cases}, are not those that were stored"


class Digests(Part):
    """Looking for rows that are not those that were stored, and running them again."""

    def __init__(self, session: Session, clock: Clock, orders: Orders) -> None:
        super().__init__(session, clock)
        self._orders = orders
        self._looking = Lock()
        #: Revision of the studies whose rows were looked at last.
        self._looked_at: TTLCache[str, int] = TTLCache(1024, _AGAIN)
        #: Study, first position and digest of chunks whose rows were looked at last.
        self._sound: TTLCache[tuple[int, int, int], bool] = TTLCache(_KEPT, _AGAIN)

    def run_damaged_again(self, study_id: str) -> list[DamagedRows]:
        """Delete the rows of the damaged chunks of a study and return the chunks to waiting; which they were.

        Those of a study that was cancelled, or is being cancelled, are only logged.
        """
        damaged = self.damaged_rows(study_id)
        if not damaged:
            return []
        with self.session.write() as connection:
            c = STUDIES.c
            row = row_of(connection, study_id, c.number, c.model, c.variant, c.state)
            state = StudyState(row.state)
            if state in _CANCELLED:
                _tell(damaged, "they are kept")
                return damaged
            damaged = [item for item in damaged if self._still_damaged(connection, item.chunk)]
            for item in damaged:
                cases = self._orders.cases(item.chunk, connection)
                for table, _ in _tables(row.model, row.variant):
                    for these in conditions(table.c.case_number, cases):
                        connection.execute(sa.delete(table).where(table.c.study == row.number, these))
                this = (CHUNKS.c.study == row.number) & (CHUNKS.c["first"] == item.chunk.first)
                waiting = {"state": ChunkState.WAITING, "epoch": None, "detail": str(item), "failures": 0}
                none = dict.fromkeys(("claimed_at", "finished_at", "host", "fingerprint", "digest"))
                connection.execute(sa.update(CHUNKS).where(this).values({**waiting, **none}))
            if not damaged:  # somebody else was faster
                return []
            _count_again(connection, row)
            if state.terminal:
                move_row(connection, row.number, StudyEvent.RETRY, self._now())
            # They must be run, not copied from a study that may have copied them from here.
            change_row(connection, row.number, fresh=1)
            note(connection, self._now(), "study.damaged", study_id, chunks=len(damaged))
        _tell(damaged, "they are run again")
        return damaged

    def _still_damaged(self, connection: sa.Connection, chunk: Chunk) -> bool:
        c = CHUNKS.c
        this = (c.study == chunk.study) & (c["first"] == chunk.first) & (c["count"] == chunk.count)
        query = sa.select(c.digest).where(this, c.state == ChunkState.DONE)
        digest = connection.execute(query).scalar_one_or_none()
        return digest is not None and not self.has_digest(connection, chunk, digest)

    def require_undamaged(self, study_id: str, cases: Ints | None = None, *, anew: bool = False) -> None:
        """Raise DatabaseError where rows of a study are not those that were stored; they are run again.

        Where all rows are looked at, its numbers of cases are compared with them, and counted again where they differ.
        With ``cases`` only the chunks with these cases are looked at where the study is under way or has more than
        `LOOKED_OVER`, and none where these chunks have more than that, too. What was sound counts for ten minutes,
        unless ``anew``.
        """
        with self.session.read() as connection:
            c = STUDIES.c
            now = row_of(connection, study_id, c.number, c.revision, c.state, c.cases)
            ended = StudyState(now.state).terminal
            if not anew and self._kept(self._looked_at, study_id) == now.revision:
                return
            if cases is not None and (now.cases > LOOKED_OVER or not ended):
                cases = cases[(cases >= 0) & (cases < now.cases)]
                if not self.damaged_chunks(connection, now.number, cases, LOOKED_OVER):
                    return
        damaged = self.run_damaged_again(study_id)
        if damaged:
            again = StudyState(now.state) not in _CANCELLED
            rest = "they are run again" if again else "the study was cancelled, so submit it as a new one"
            raise DatabaseError(f"{damaged[0]}: {rest}", "database-damaged")
        self.count_endings_again(study_id)
        with self._looking:
            self._looked_at[study_id] = now.revision

    def _kept(self, kept: TTLCache[Any, Any], key: object) -> Any:
        with self._looking:
            return kept.get(key)

    def damaged_chunks(
        self, connection: sa.Connection, number: int, cases: Ints, most: int | None = None
    ) -> list[Chunk]:
        """The finished chunks with any of these cases of a study whose rows changed.

        None are looked at where they have more than ``most`` cases together. What was sound counts for ten minutes.
        """
        if not cases.size:
            return []
        order, c = self._orders.of(number, connection), CHUNKS.c
        places = np.sort(cases if order is None else order.positions(cases))
        query = sa.select(c["first"], c["count"], c.digest).where(
            c.study == number, c.state == ChunkState.DONE, c.digest.is_not(None),
            c["first"] <= int(places[-1]), c["first"] + c["count"] > int(places[0]),
        )  # fmt: skip
        with_cases = []
        for first, count, digest in connection.execute(query.order_by(c["first"])):
            at = np.searchsorted(places, first)
            if at < places.size and places[at] < first + count:
                with_cases.append((Chunk(number, first, count), digest))
        if most is not None and sum(chunk.count for chunk, _ in with_cases) > most:
            return []
        damaged = []
        for chunk, digest in with_cases:
            key = (chunk.study, chunk.first, digest)
            if self._kept(self._sound, key):
                continue
            if self.has_digest(connection, chunk, digest):
                with self._looking:
                    self._sound[key] = True
            else:
                damaged.append(chunk)
        return damaged

    def has_digest(self, connection: sa.Connection, chunk: Chunk, digest: int) -> bool:
        """Whether a chunk has the rows with that digest."""
        return self._digest_or_none(connection, chunk) == digest

    def damaged_rows(self, study_id: str) -> list[DamagedRows]:
        """The finished chunks of a study whose rows changed since they were stored; raises StudyNotFoundError.

        Chunks from before revision 0036 have no digest and are not looked at. Raises DatabaseError as `require_whole`.
        """
        with self.session.read() as connection:
            require_whole(connection, study_id)
            row = row_of(connection, study_id, STUDIES.c.number, STUDIES.c.model, STUDIES.c.variant)
            c = CHUNKS.c
            known = connection.execute(
                sa.select(c["first"], c["count"], c.digest)
                .where(c.study == row.number, c.state == ChunkState.DONE)
                .order_by(c["first"])
            ).all()
            if not any(chunk.digest is not None for chunk in known):
                return []
            try:
                found = self._digests(connection, row, known)
            except _UNREADABLE:
                found = [self._digest_or_none(connection, Chunk(row.number, *chunk[:2])) for chunk in known]
            wrong = [
                Chunk(row.number, int(chunk[0]), int(chunk[1]))
                for chunk, digest in zip(known, found, strict=True)
                if chunk.digest is not None and chunk.digest != digest
            ]
            return [DamagedRows(study_id, chunk, *_ends(self._orders.cases(chunk, connection))) for chunk in wrong]

    def _digests(self, connection: sa.Connection, row: Any, known: Sequence[Any]) -> list[int | None]:
        """The digest of the rows of each finished chunk; None where their number is not that of its cases."""
        first, count = (np.array([chunk[at] for chunk in known], dtype=np.int64) for at in (0, 1))
        sums, rows = np.zeros(len(known), dtype=np.uint64), np.zeros(len(known), dtype=np.int64)
        order = self._orders.of(row.number, connection)
        for table, further in _tables(row.model, row.variant):
            for cases, words in _stored_words(connection, table, row, further=further):
                places = cases if order is None else order.positions(cases)
                at = np.clip(np.searchsorted(first, places, side="right") - 1, 0, None)
                inside = (places >= first[at]) & (places < (first + count)[at])
                np.add.at(sums, at[inside], words[inside])
                if not further:
                    np.add.at(rows, at[inside], 1)
        digests = sums.astype(np.int64).tolist()
        return [digest if whole else None for digest, whole in zip(digests, rows == count, strict=True)]

    def _digest_or_none(self, connection: sa.Connection, chunk: Chunk) -> int | None:
        try:
            return self.digest_in(connection, chunk)
        except _UNREADABLE:
            return None

    def all_damaged_rows(self) -> Iterator[DamagedRows]:
        """Those of every study whose inputs and chunks are what was stored."""
        for study_id in self._present():
            with suppress(DatabaseError):  # `broken_studies` has it
                yield from self.damaged_rows(study_id)

    def broken_studies(self) -> Iterator[str]:
        """A sentence on each study that is not what was stored."""
        for study_id in self._present():
            try:
                with self.session.read() as connection:
                    require_whole(connection, study_id)
                    rounds_of(connection, row_of(connection, study_id, STUDIES.c.number).number)
                    differ = counts_differ(connection, study_id)
            except DatabaseError as error:
                yield str(error)
                continue
            if differ:
                yield f"the numbers of cases of the study {study_id} are not those of its rows"

    def _present(self) -> Sequence[str]:
        """Ids of the studies that are not deleted."""
        c = STUDIES.c
        with self.session.read() as connection:
            return connection.execute(sa.select(c.id).where(c.deleted_at.is_(None)).order_by(c.number)).scalars().all()

    def with_rows_after(self, number: int) -> tuple[int, str] | None:
        """Number and id of the next study with rows; None after the last one."""
        c = STUDIES.c
        some = (c.done > 0) & c.deleted_at.is_(None)
        query = sa.select(c.number, c.id).where(some, c.number > number).order_by(c.number).limit(1)
        with self.session.read() as connection:
            found = connection.execute(query).one_or_none()
        return None if found is None else (found.number, found.id)

    def undigested(self) -> int:
        """Number of finished chunks without a digest, which cannot be looked at."""
        query = sa.select(sa.func.count()).select_from(CHUNKS)
        with self.session.read() as connection:
            without = query.where(CHUNKS.c.state == ChunkState.DONE, CHUNKS.c.digest.is_(None))
            return int(connection.execute(without).scalar_one())

    def count_endings_again(self, study_id: str) -> None:
        """Make the numbers of cases those of the rows, where they are not; raises StudyNotFoundError."""
        with self.session.read() as connection:
            if not counts_differ(connection, study_id):
                return
        with self.session.write() as connection:
            c = STUDIES.c
            _LOG.error("The numbers of cases of the study %s were not those of its rows: counted again.", study_id)
            _count_again(connection, row_of(connection, study_id, c.number, c.model, c.variant))

    def seal(self, connection: sa.Connection, chunk: Chunk) -> None:
        """Give a finished chunk the digest of the rows that the database has."""
        this = (CHUNKS.c.study == chunk.study) & (CHUNKS.c["first"] == chunk.first)
        connection.execute(sa.update(CHUNKS).where(this).values(digest=self.digest_in(connection, chunk)))

    def digest_in(self, connection: sa.Connection, chunk: Chunk) -> int:
        """The digest of the rows that the database has for a chunk."""
        c = STUDIES.c
        row = connection.execute(sa.select(c.number, c.model, c.variant).where(c.number == chunk.study)).one()
        cases = self._orders.cases(chunk, connection)
        found = []
        for table, further in _tables(row.model, row.variant):
            between = table.c.case_number.between(int(cases[0]), int(cases[-1]))
            for numbers, words in _stored_words(connection, table, row, between, further=further):
                found.append(words[np.isin(numbers, cases)])
        return digest_of(*found)


def _tell(damaged: Sequence[DamagedRows], rest: str) -> None:
    for item in damaged:
        text = str(item)
        _LOG.error("%s%s: %s.", text[:1].upper(), text[1:], rest)


def _count_again(connection: sa.Connection, row: sa.Row[Any]) -> None:
    """Count the endings of a study from its rows: those counted before belong to rows that are gone."""
    # Deleted first: this waits for dispatchers that have added to them, whose rows are counted, too.
    connection.execute(sa.delete(ENDINGS).where(ENDINGS.c.study == row.number))
    c = results_table(row.model, row.variant).c
    counted = sa.select(c.ending, sa.func.count()).where(c.study == row.number).group_by(c.ending)
    endings = {ending: int(cases) for ending, cases in connection.execute(counted)}
    if endings:
        rows = [{"study": row.number, "ending": ending, "cases": cases} for ending, cases in endings.items()]
        connection.execute(sa.insert(ENDINGS), rows)
    done = {"done": sum(endings.values()), "ok": endings.get(models.OK, 0)}
    connection.execute(sa.update(STUDIES).where(STUDIES.c.number == row.number).values(done))


def _tables(model: str, variant: str) -> list[tuple[sa.Table, bool]]:
    further = further_table(model, variant)
    return [(results_table(model, variant), False), *([] if further is None else [(further, True)])]


def _stored_words(
    connection: sa.Connection, table: sa.Table, row: Any, *which: sa.ColumnElement[bool], further: bool
) -> Iterator[tuple[Ints, Words]]:
    """Case numbers and hashes of the rows of a study in a table, in the order of the cases."""
    c, infos = table.c, models.result_infos(row.model, row.variant)
    types = [("case", np.int64), ("ending", object), ("flags", object)]
    layout = np.dtype([*types, *((f"value{index}", np.float64) for index in range(len(infos)))])
    query = sa.select(c.case_number, c.ending, c.flags, *(as_number(c[info.column]) for info in infos))
    query = query.where(c.study == row.number, *which).order_by(c.case_number).limit(_PART)
    generations = tuple(info.generation for info in infos)
    last, skip = -1, 0
    while True:
        part = records(connection, query.where(c.case_number >= last).offset(skip), layout)
        if not len(part):
            return
        values = np.array([part[f"value{index}"] for index in range(len(infos))]).reshape(len(infos), -1).T
        yield (
            part["case"].copy(),
            row_words(
                part["case"], part["ending"].tolist(), part["flags"].tolist(), as_kept(values),
                generations=generations, further=further,
            ),
        )  # fmt: skip
        # Cases may have several further rows, which a part may divide.
        end = int(part["case"][-1])
        at_end = int((part["case"] == end).sum())
        last, skip = end, at_end + (skip if end == last else 0)


def _ends(cases: Ints) -> tuple[int, int]:
    return int(cases[0]), int(cases[-1])
