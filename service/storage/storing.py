"""Storing finished chunks and claiming the next ones: one transaction for all that wait."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from functools import cache
from itertools import groupby
from operator import attrgetter, itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np
import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite

from sprag.service.storage.dispatchers import WAITING, Dispatchers
from sprag.service.storage.origins import names_of
from sprag.service.storage.reuse import Reuse, copy_rows, endings_of, mark_origin
from sprag.service.storage.row_hashes import digests_of, row_words, signed
from sprag.service.storage.rows import Block, Target, block, further_block, further_target, merged, target
from sprag.service.storage.tables import CHUNKS, ENDINGS, STUDIES
from sprag.worker import fingerprint, models
from sprag.worker.states import ChunkState, StudyEvent, StudyState

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from sprag.service.storage.row_hashes import Words
    from sprag.worker.ports import Chunk, Finished

    #: What identifies a chunk in the database: study, first position, number of cases.
    Key = tuple[int, int, int]


class _SourceGoneError(Exception):
    """Rows to be copied for a chunk no longer exist."""

    def __init__(self, chunk: Chunk) -> None:
        super().__init__()
        self.chunk = chunk


@dataclass(slots=True)
class _Gain:
    """What a study gains by a transaction."""

    cases: int = 0
    reused: int = 0
    endings: Counter[str] = field(default_factory=Counter)


def key_of(chunk: Chunk) -> Key:
    """What identifies the chunk in the database."""
    return chunk.study, chunk.first, chunk.count


@cache
def _these(dialect: str) -> sa.ColumnElement[bool]:
    """Condition on chunks: those of the study ``of`` whose first positions are among ``firsts``.

    They are one parameter: one for each takes longer than the statement itself, and so does building it anew.
    """
    first = CHUNKS.c["first"]
    if dialect == "postgresql":
        among = first == sa.any_(sa.bindparam("firsts", type_=postgresql.ARRAY(sa.Integer)))
    else:
        listed = sa.func.json_each(sa.bindparam("firsts", type_=sa.JSON)).table_valued("value")
        among = first.in_(sa.select(listed.c.value))
    return (CHUNKS.c.study == sa.bindparam("of")) & among


@cache
def _looking(dialect: str) -> sa.Select[Any]:
    c = CHUNKS.c
    return sa.select(c["first"], c["count"], c.state, c.epoch).where(_these(dialect))


@cache
def _changing(dialect: str, *columns: str) -> sa.Update:
    """Gives the columns of `_these` chunks the values of parameters ``new_NAME``."""
    return sa.update(CHUNKS).where(_these(dialect)).values({name: sa.bindparam(f"new_{name}") for name in columns})


@cache
def _finishing(dialect: str, *columns: str) -> sa.Update:
    """`_changing` that gives each chunk its digest, too; ``digests`` belong to ``firsts``, see `_finish_chunks`.

    A statement for each chunk takes longer than computing its digest.
    """
    first, changing = CHUNKS.c["first"], _changing(dialect, *columns)
    if dialect == "postgresql":
        firsts = sa.bindparam("firsts", type_=postgresql.ARRAY(sa.Integer))
        digests = sa.bindparam("digests", type_=postgresql.ARRAY(sa.BigInteger))
        listed = sa.func.unnest(firsts, digests).table_valued("place", "digest").render_derived(name="listed")
        return changing.where(first == listed.c.place).values(digest=listed.c.digest)
    # Not joined with `json_each`: SQLite may go through all chunks of the study for it.
    path = sa.literal("$.").concat(sa.cast(first, sa.Text))
    return changing.values(digest=sa.func.json_extract(sa.bindparam("digests", type_=sa.JSON), path))


#: The parameters of these are the numbers of studies, ``numbers``.
_AMONG = STUDIES.c.number.in_(sa.bindparam("numbers", expanding=True))
_KINDS = sa.select(STUDIES.c.number, STUDIES.c.model, STUDIES.c.variant, STUDIES.c.fingerprint).where(_AMONG)
_CLAIMABLE = sa.select(STUDIES.c.number, STUDIES.c.state).where(
    _AMONG,
    sa.func.coalesce(STUDIES.c.dispatcher, sa.bindparam("epoch")) == sa.bindparam("epoch"),
    sa.func.coalesce(STUDIES.c.finish_by > sa.bindparam("now", type_=sa.BigInteger), sa.true()),
)
_TAKE_FREE = sa.update(STUDIES).where(_AMONG, STUDIES.c.dispatcher.is_(None)).values(dispatcher=sa.bindparam("epoch"))
_GAINED = (
    sa.update(STUDIES)
    .where(STUDIES.c.number == sa.bindparam("of"))
    .values(
        {name: STUDIES.c[name] + sa.bindparam(f"more_{name}", type_=sa.Integer) for name in ("done", "ok", "reused")}
        | {"revision": STUDIES.c.revision + 1}
    )
)


@cache
def _counting(dialect: str) -> postgresql.Insert | sqlite.Insert:
    """Adds to the number of cases of a study with an ending."""
    more = (postgresql.insert if dialect == "postgresql" else sqlite.insert)(ENDINGS)
    return more.on_conflict_do_update(
        index_elements=[ENDINGS.c.study, ENDINGS.c.ending], set_={"cases": ENDINGS.c.cases + more.excluded.cases}
    )


def _by_study(keys: Iterable[Key]) -> Iterator[dict[str, Any]]:
    """The parameters of `_these` for each study."""
    for number, group in groupby(sorted(keys), key=itemgetter(0)):
        yield {"of": number, "firsts": [first for _, first, _ in group]}


def in_state(
    connection: sa.Connection, chunks: Iterable[Chunk], state: ChunkState, epoch: int | None = None
) -> set[Key]:
    """Which of the chunks are in the database as they are here, in that state and, where given, of that epoch."""
    keys = set(map(key_of, chunks))
    return {
        (these["of"], first, count)
        for these in _by_study(keys)
        for first, count, found, of_epoch in connection.execute(_looking(connection.dialect.name), these)
        if found == state and epoch in {None, of_epoch}
    } & keys


def _change_chunks(connection: sa.Connection, keys: Iterable[Key], values: Mapping[str, Any]) -> None:
    """Put ``values`` into the rows of those chunks."""
    statement = _changing(connection.dialect.name, *values)
    new = {f"new_{name}": value for name, value in values.items()}
    for these in _by_study(keys):
        connection.execute(statement, {**these, **new})


def _finish_chunks(connection: sa.Connection, digests: Mapping[Key, int], values: Mapping[str, Any]) -> None:
    """Put ``values`` and their digests into the rows of those chunks."""
    dialect = connection.dialect.name
    statement = _finishing(dialect, *values)
    new = {f"new_{name}": value for name, value in values.items()}
    for number, group in groupby(sorted(digests.items()), key=lambda item: item[0][0]):
        of_first = {first: digest for (_, first, _), digest in group}
        listed = list(of_first.values()) if dialect == "postgresql" else of_first
        connection.execute(statement, {"of": number, "firsts": list(of_first), "digests": listed, **new})


class Storing(Reuse, Dispatchers):
    """Results and claims."""

    def exchange(
        self, epoch: int, finished: Sequence[Finished], wanted: Sequence[Chunk] = ()
    ) -> tuple[list[Chunk], list[Chunk]]:
        """Store finished chunks and claim waiting ones, in one transaction: the chunks stored, and those claimed.

        A finished chunk that is not claimed by us is ignored. One whose rows were to be copied from a study that is
        gone returns to waiting. Claimed are chunks of queued or running studies before their
        deadline, which belong to no other dispatcher.
        """
        for item in finished:
            _require_whole(item)
        left = list(finished)
        while True:
            try:
                with self.session.write() as connection:
                    self._own(connection, epoch)
                    ours = in_state(connection, [item.chunk for item in left], ChunkState.CLAIMED, epoch)
                    stored = [item for item in left if key_of(item.chunk) in ours]
                    self._store(connection, stored)
                    claimed = self._claim(connection, epoch, wanted)
                break
            except _SourceGoneError as error:
                gone = error.chunk
                self._forget_reuse(gone.study)
                self.put_back(epoch, gone, "the study from which cases were to be copied was deleted")
                left = [item for item in left if item.chunk != gone]
        return [item.chunk for item in stored], claimed

    def _claimed(self, connection: sa.Connection, epoch: int, chunk: Chunk) -> bool:
        """Whether the chunk is claimed in this epoch; raises EpochLostError when the epoch is no longer ours."""
        self._own(connection, epoch)
        return bool(in_state(connection, [chunk], ChunkState.CLAIMED, epoch))

    def put_back(self, epoch: int, chunk: Chunk, detail: str) -> None:
        """Return a claimed chunk to waiting, with ``chunk.failures`` as its new count and what happened to it."""
        with self.session.write() as connection:
            if self._claimed(connection, epoch, chunk):
                connection.execute(
                    sa.update(CHUNKS).where(is_chunk(chunk)).values(failures=chunk.failures, detail=detail, **WAITING)
                )

    def _claim(self, connection: sa.Connection, epoch: int, wanted: Sequence[Chunk]) -> list[Chunk]:
        if not wanted:
            return []
        these = {"numbers": list({chunk.study for chunk in wanted}), "epoch": epoch, "now": self._now()}
        states = {number: StudyState(state) for number, state in connection.execute(_CLAIMABLE, these).all()}
        waiting = in_state(connection, wanted, ChunkState.WAITING)
        for number in {key[0] for key in waiting}:
            if states.get(number) is StudyState.QUEUED:
                states[number] = self._move(connection, number, StudyEvent.START)
        running = {number for number, state in states.items() if state is StudyState.RUNNING}
        got = [chunk for chunk in wanted if key_of(chunk) in waiting and chunk.study in running]
        if got:
            values = {"state": ChunkState.CLAIMED, "epoch": epoch, "claimed_at": self._now()}
            _change_chunks(connection, map(key_of, got), values)
            connection.execute(_TAKE_FREE, {"numbers": list({chunk.study for chunk in got}), "epoch": epoch})
        return got

    def _store(self, connection: sa.Connection, finished: Sequence[Finished]) -> None:
        """Insert the rows of claimed chunks, mark them done, and count."""
        if not finished:
            return
        kinds = self._kinds(connection, {item.chunk.study for item in finished})
        digests = self._insert(connection, finished, kinds)
        gains = {number: _Gain() for number in kinds}
        hosts: dict[Key, set[str]] = {}
        for item in finished:
            chunk, known, gain = item.chunk, item.known, gains[item.chunk.study]
            gain.cases += chunk.count
            gain.endings.update(item.result.endings)
            if known is not None and known.cases.size:
                model, variant = kinds[chunk.study]
                if not copy_rows(connection, model, variant, chunk, known):
                    raise _SourceGoneError(chunk)
                gain.endings += endings_of(connection, model, variant, chunk.study, known.cases)
                gain.reused += known.cases.size
                hosts[key_of(chunk)] = self._hosts_of(connection, known)
            if known is not None:
                digests[key_of(chunk)] = self.digest_in(connection, chunk)
        self._mark_done(connection, finished, hosts, digests)
        _count(connection, gains)
        for number, gain in gains.items():
            more = {"more_done": gain.cases, "more_ok": gain.endings[models.OK], "more_reused": gain.reused}
            connection.execute(_GAINED, {"of": number, **more})

    def _mark_done(
        self,
        connection: sa.Connection,
        finished: Sequence[Finished],
        copied_from: Mapping[Key, set[str]],
        digests: Mapping[Key, int],
    ) -> None:
        """Mark chunks done, with their digests and the hosts that ran them, or ran the rows that were copied."""
        done = {"state": ChunkState.DONE, "finished_at": self._now(), "detail": None}
        origin = {"fingerprint": fingerprint.digest()}
        by_host: dict[str | None, dict[Key, int]] = {}
        for item in finished:
            key = key_of(item.chunk)
            hosts = names_of({*filter(None, [item.host]), *copied_from.get(key, ())})
            by_host.setdefault(hosts, {})[key] = digests[key]
        for host, of_host in by_host.items():
            _finish_chunks(connection, of_host, {**done, **origin, "host": host})

    @staticmethod
    def _kinds(connection: sa.Connection, numbers: Iterable[int]) -> dict[int, tuple[str, str]]:
        """Model and variant of studies, which are marked with the origin of the rows that they get."""
        rows = connection.execute(_KINDS, {"numbers": sorted(numbers)}).all()
        for row in rows:
            if row.fingerprint != fingerprint.digest():
                mark_origin(connection, row.number)
        return {row.number: (row.model, row.variant) for row in rows}

    def _insert(
        self, connection: sa.Connection, finished: Sequence[Finished], kinds: Mapping[int, tuple[str, str]]
    ) -> dict[Key, int]:
        """Insert the rows of chunks, those of one table together and in the order of their key; their digests."""
        digests = {key_of(item.chunk): 0 for item in finished}
        chunks: dict[tuple[Target, bool], dict[Key, Block]] = {}
        for item in sorted(finished, key=attrgetter("chunk.study", "chunk.first")):
            if not item.result.count:
                continue
            chunk, kind = item.chunk, kinds[item.chunk.study]
            cases = self._cases(chunk, connection) if item.known is None else item.known.missing
            own = block(chunk.study, cases, item.result)
            chunks.setdefault((target(*kind), False), {})[key_of(chunk)] = own
            # In the same transaction: a case has all of its rows or none.
            more, place = further_block(chunk.study, cases, item.result), further_target(*kind)
            if more is not None and place is not None:
                chunks.setdefault((place, True), {})[key_of(chunk)] = more
        for (place, further), blocks in chunks.items():
            rows: list[Block] = []
            words: list[Words] = []
            # Before they are inserted: in turn with it, nothing would be in the processor's cache.
            for some in merged(blocks.values()):
                rows.append(some)
                words.append(_words(some, further=further))
            for key, digest in zip(blocks, _digests(words, blocks.values()), strict=True):
                digests[key] = signed(digests[key] + digest)
            self.session.insert_blocks(connection, place, rows)
        return digests


def _words(rows: Block, *, further: bool) -> Words:
    return row_words(rows.cases, rows.endings, rows.flags, rows.values, further=further)


def _digests(words: Sequence[Words], blocks: Iterable[Block]) -> list[int]:
    """The digests of chunks from the hashes of the rows of all of them."""
    return digests_of(np.concatenate(words), [len(rows.cases) for rows in blocks])


def is_chunk(chunk: Chunk) -> sa.ColumnElement[bool]:
    """Condition on chunks: this one."""
    return (CHUNKS.c.study == chunk.study) & (CHUNKS.c["first"] == chunk.first) & (CHUNKS.c["count"] == chunk.count)


def _require_whole(item: Finished) -> None:
    """Raise ValueError for a result that does not cover the cases of its chunk that were to be run."""
    chunk, result = item.chunk, item.result
    expected = (chunk.first, chunk.count) if item.known is None else (0, item.known.missing.size)
    if (result.first, result.count) != expected:
        raise ValueError(f"a result of {result.count} cases from {result.first} does not belong to {chunk}")


def _count(connection: sa.Connection, gains: Mapping[int, _Gain]) -> None:
    """Add to the numbers of cases by ending."""
    rows = [
        {"study": number, "ending": ending, "cases": cases}
        for number, gain in gains.items()
        for ending, cases in gain.endings.items()
    ]
    connection.execute(_counting(connection.dialect.name), rows)
