"""The rows of chunks: which are in a state, and changing those of many in one statement."""

from __future__ import annotations

from functools import cache
from itertools import groupby
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite

from sprag_study.service.storage.tables import CHUNKS, ENDINGS

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from sprag_study.worker.ports import Chunk
    from sprag_study.worker.states import ChunkState

    #: What identifies a chunk in the database: study, first position, number of cases.
    Key = tuple[int, int, int]


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
    """`_changing` that gives each chunk its digest, too; ``digests`` belong to ``firsts``, see `finish_chunks`.

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


def change_chunks(connection: sa.Connection, keys: Iterable[Key], values: Mapping[str, Any]) -> None:
    """Put ``values`` into the rows of those chunks."""
    statement = _changing(connection.dialect.name, *values)
    new = {f"new_{name}": value for name, value in values.items()}
    for these in _by_study(keys):
        connection.execute(statement, {**these, **new})


def finish_chunks(connection: sa.Connection, digests: Mapping[Key, int], values: Mapping[str, Any]) -> None:
    """Put ``values`` and their digests into the rows of those chunks."""
    dialect = connection.dialect.name
    statement = _finishing(dialect, *values)
    new = {f"new_{name}": value for name, value in values.items()}
    for number, group in groupby(sorted(digests.items()), key=lambda item: item[0][0]):
        of_first = {first: digest for (_, first, _), digest in group}
        listed = list(of_first.values()) if dialect == "postgresql" else of_first
        connection.execute(statement, {"of": number, "firsts": list(of_first), "digests": listed, **new})


def is_chunk(chunk: Chunk) -> sa.ColumnElement[bool]:
    """Condition on chunks: this one."""
    return (CHUNKS.c.study == chunk.study) & (CHUNKS.c["first"] == chunk.first) & (CHUNKS.c["count"] == chunk.count)


def add_endings(connection: sa.Connection, endings: Mapping[int, Mapping[str, int]]) -> None:
    """Add to the numbers of cases of studies by ending."""
    rows = [
        {"study": number, "ending": ending, "cases": cases}
        for number, counts in endings.items()
        for ending, cases in counts.items()
    ]
    connection.execute(_counting(connection.dialect.name), rows)
