"""Digests of rows: flipped bits in stored results are noticed, whatever the database thinks of its pages.

Each finished chunk has the sum of a hash of each of its rows, so that rows may be read in any order. The hash is
multilinear in the 64-bit patterns of a row's numbers: with odd factors, a change of one number always changes it.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import sqlalchemy as sa
from cachetools import LRUCache

from sprag.service.storage.audit import note
from sprag.service.storage.cases import conditions
from sprag.service.storage.columns import as_number, records
from sprag.service.storage.errors import DatabaseError
from sprag.service.storage.order import Orders
from sprag.service.storage.tables import CHUNKS, ENDINGS, STUDIES, further_table, results_table
from sprag.worker import models
from sprag.worker.ports import Chunk
from sprag.worker.states import ChunkState, StudyEvent, StudyState

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from sprag.service.storage.session import Session
    from sprag.worker.ports import Clock

    Words = NDArray[np.uint64]

#: What reading flipped bits as numbers, cases and texts may raise.
_UNREADABLE: Final = (ValueError, TypeError, OverflowError, IndexError, sa.exc.DBAPIError)
#: Rows that are read at once.
_PART: Final = 5_000
_MIX_A: Final = np.uint64(0xFF51AFD7ED558CCD)
_MIX_B: Final = np.uint64(0xC4CEB9FE1A85EC53)
_FURTHER: Final = np.uint64(0x9E3779B97F4A7C15)


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


@lru_cache(maxsize=64)
def _factors(count: int) -> Words:
    """Odd factors, one for each word of a row, always the same."""
    text = b"".join(hashlib.blake2b(f"row {index}".encode(), digest_size=8).digest() for index in range(count))
    return np.frombuffer(text, dtype="<u8").astype(np.uint64) | np.uint64(1)


@lru_cache(maxsize=4096)
def _text_word(ending: str, flags: str) -> int:
    return int.from_bytes(hashlib.blake2b(f"{ending}\n{flags}".encode(), digest_size=8).digest(), "little")


def _text_words(endings: Sequence[str], flags: Sequence[str]) -> Words:
    """A word for the ending and the flags of each row; one for all where they are the same, which is faster."""
    if len(endings) and all(list(texts).count(texts[0]) == len(texts) for texts in (endings, flags)):
        return np.array(_text_word(endings[0], flags[0]), dtype=np.uint64)
    pairs = zip(endings, flags, strict=True)
    return np.array([_text_word(*pair) for pair in pairs], dtype=np.uint64)


def row_words(
    cases: NDArray[np.int64],
    endings: Sequence[str],
    flags: Sequence[str],
    values: NDArray[np.float64],
    *,
    further: bool = False,
) -> Words:
    """A hash of each row, uint64 array of shape (rows,); ``values`` has shape (rows, results).

    Numbers count as the database keeps them: infinities as missing, and zeros without a sign. ``further``: the rows are
    those beside the first ones of their cases.
    """
    kept = np.ascontiguousarray(values, dtype=np.float64) + 0.0
    finite = np.isfinite(kept)
    if not finite.all():
        kept[~finite] = np.nan  # one pattern for all of them
    factors = _factors(kept.shape[1] + 2)
    words: Words = kept.view(np.uint64) @ factors[2:]
    words += cases.astype(np.uint64) * factors[0]
    words += _text_words(endings, flags) * factors[1]
    if further:
        words ^= _FURTHER
    words ^= words >> np.uint64(33)
    words *= _MIX_A
    words ^= words >> np.uint64(33)
    words *= _MIX_B
    words ^= words >> np.uint64(33)
    return words


def digest_of(*parts: Words) -> int:
    """The digest of rows with those hashes, as the database keeps it: a signed number of 64 bits."""
    total = sum(int(words.sum(dtype=np.uint64)) for words in parts) % 2**64
    return total - 2**64 if total >= 2**63 else total


class Digests(Orders):
    """Looking for rows that are not those that were stored, and running them again."""

    def __init__(self, session: Session, clock: Clock) -> None:
        super().__init__(session, clock)
        #: Revision of the studies whose rows were looked at last.
        self._looked_at: LRUCache[str, int] = LRUCache(1024)

    def run_damaged_again(self, study_id: str) -> list[DamagedRows]:
        """Return the damaged chunks of a study that has ended to waiting, with the reason; what they were.

        Of a study that has not ended, or was cancelled, they are only told.
        """
        damaged = self.damaged_rows(study_id)
        if not damaged:
            return []
        with self.session.write() as connection:
            c = STUDIES.c
            row = self._row(connection, study_id, c.number, c.model, c.variant, c.state)
            if StudyState(row.state) not in {StudyState.FINISHED, StudyState.FAILED}:
                return damaged
            for item in damaged:
                cases = self._cases(item.chunk, connection)
                for table, _ in _tables(row.model, row.variant):
                    for these in conditions(table.c.case_number, cases):
                        connection.execute(sa.delete(table).where(table.c.study == row.number, these))
                this = (CHUNKS.c.study == row.number) & (CHUNKS.c["first"] == item.chunk.first)
                waiting = {"state": ChunkState.WAITING, "epoch": None, "detail": str(item), "failures": 0}
                none = dict.fromkeys(("claimed_at", "finished_at", "host", "fingerprint", "digest"))
                connection.execute(sa.update(CHUNKS).where(this).values({**waiting, **none}))
            _count_again(connection, row)
            self._move(connection, row.number, StudyEvent.RETRY)
            # They must be run, not copied from a study that may have copied them from here.
            self._change(connection, row.number, fresh=1)
            note(connection, self._now(), "study.damaged", study_id, chunks=len(damaged))
        return damaged

    def require_undamaged(self, study_id: str) -> None:
        """Raise DatabaseError where rows are not those that were stored; of an ended study they are run again.

        A revision of a study is looked at once.
        """
        with self.session.read() as connection:
            now = self._row(connection, study_id, STUDIES.c.revision, STUDIES.c.state)
        if not StudyState(now.state).terminal or self._looked_at.get(study_id) == now.revision:
            return
        if damaged := self.run_damaged_again(study_id):
            raise DatabaseError(f"{damaged[0]}: they are run again", "database-damaged")
        self._looked_at[study_id] = now.revision

    def damaged_rows(self, study_id: str) -> list[DamagedRows]:
        """The finished chunks of a study whose rows changed since they were stored; raises StudyNotFoundError.

        Chunks from before revision 0036 have no digest and are not looked at.
        """
        with self.session.read() as connection:
            row = self._row(connection, study_id, STUDIES.c.number, STUDIES.c.model, STUDIES.c.variant)
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
            return [DamagedRows(study_id, chunk, *_ends(self._cases(chunk, connection))) for chunk in wrong]

    def _digests(self, connection: sa.Connection, row: Any, known: Sequence[Any]) -> list[int | None]:
        """The digest of the rows of each finished chunk; None where their number is not that of its cases."""
        first, count = (np.array([chunk[at] for chunk in known], dtype=np.int64) for at in (0, 1))
        sums, rows = np.zeros(len(known), dtype=np.uint64), np.zeros(len(known), dtype=np.int64)
        order = self._order(row.number, connection)
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
        """Those of every study."""
        with self.session.read() as connection:
            ids = connection.execute(
                sa.select(STUDIES.c.id).where(STUDIES.c.deleted_at.is_(None)).order_by(STUDIES.c.number)
            ).scalars()
            studies = list(ids)
        for study_id in studies:
            yield from self.damaged_rows(study_id)

    def ended_after(self, number: int) -> tuple[int, str] | None:
        """Number and id of the next study that finished or failed; None after the last one."""
        c = STUDIES.c
        ended = c.state.in_([StudyState.FINISHED.value, StudyState.FAILED.value]) & c.deleted_at.is_(None)
        query = sa.select(c.number, c.id).where(ended, c.number > number).order_by(c.number).limit(1)
        with self.session.read() as connection:
            found = connection.execute(query).one_or_none()
        return None if found is None else (found.number, found.id)

    def undigested(self) -> int:
        """Number of finished chunks without a digest, which cannot be looked at."""
        query = sa.select(sa.func.count()).select_from(CHUNKS)
        with self.session.read() as connection:
            without = query.where(CHUNKS.c.state == ChunkState.DONE, CHUNKS.c.digest.is_(None))
            return int(connection.execute(without).scalar_one())

    def seal(self, connection: sa.Connection, chunk: Chunk) -> None:
        """Give a finished chunk the digest of the rows that the database has."""
        this = (CHUNKS.c.study == chunk.study) & (CHUNKS.c["first"] == chunk.first)
        connection.execute(sa.update(CHUNKS).where(this).values(digest=self.digest_in(connection, chunk)))

    def digest_in(self, connection: sa.Connection, chunk: Chunk) -> int:
        """The digest of the rows that the database has for a chunk."""
        c = STUDIES.c
        row = connection.execute(sa.select(c.number, c.model, c.variant).where(c.number == chunk.study)).one()
        cases = self._cases(chunk, connection)
        found = []
        for table, further in _tables(row.model, row.variant):
            between = table.c.case_number.between(int(cases[0]), int(cases[-1]))
            for numbers, words in _stored_words(connection, table, row, between, further=further):
                found.append(words[np.isin(numbers, cases)])
        return digest_of(*found)


def _count_again(connection: sa.Connection, row: sa.Row[Any]) -> None:
    """Count the endings of a study from its rows: those counted before belong to rows that are gone."""
    c = results_table(row.model, row.variant).c
    counted = sa.select(c.ending, sa.func.count()).where(c.study == row.number).group_by(c.ending)
    endings = {ending: int(cases) for ending, cases in connection.execute(counted)}
    connection.execute(sa.delete(ENDINGS).where(ENDINGS.c.study == row.number))
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
) -> Iterator[tuple[NDArray[np.int64], Words]]:
    """Case numbers and hashes of the rows of a study in a table, in the order of the cases."""
    c, infos = table.c, models.result_infos(row.model, row.variant)
    types = [("case", np.int64), ("ending", object), ("flags", object)]
    layout = np.dtype([*types, *((f"value{index}", np.float64) for index in range(len(infos)))])
    query = sa.select(c.case_number, c.ending, c.flags, *(as_number(c[info.column]) for info in infos))
    query = query.where(c.study == row.number, *which).order_by(c.case_number).limit(_PART)
    last, skip = -1, 0
    while True:
        part = records(connection, query.where(c.case_number >= last).offset(skip), layout)
        if not len(part):
            return
        values = np.array([part[f"value{index}"] for index in range(len(infos))]).reshape(len(infos), -1).T
        yield (
            part["case"].copy(),
            row_words(part["case"], part["ending"].tolist(), part["flags"].tolist(), values, further=further),
        )
        # Cases may have several further rows, which a part may divide.
        end = int(part["case"][-1])
        at_end = int((part["case"] == end).sum())
        last, skip = end, at_end + (skip if end == last else 0)


def _ends(cases: NDArray[np.int64]) -> tuple[int, int]:
    return int(cases[0]), int(cases[-1])
