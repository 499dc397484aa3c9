"""Moving a whole database into another one, of the same kind or not: every table, row by row, compared at the end.

Until the last row has been compared the target has a revision that no program accepts, so nothing works on half of a
database; a move that was interrupted is continued by the same command. Nothing else writes to the source meanwhile.
"""

from __future__ import annotations

import hashlib
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa

from sprag.service.storage import deployment, maintenance
from sprag.service.storage.database.lock import DispatcherLock
from sprag.service.storage.errors import DatabaseError
from sprag.service.storage.moved_rows import TableOf, tables_of
from sprag.service.storage.tables import HEAD_REVISION, all_tables

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from sprag.service.storage.database.server_lock import ServerLock
    from sprag.service.storage.database.session import Session

#: Tables that belong to the database itself.
_NOT_MOVED: Final = frozenset({"alembic_version", "sqlite_sequence"})


@dataclass(frozen=True, slots=True)
class Moved:
    """Rows of each table of the target after a move, and how many of them were there from an earlier attempt.

    ``problems``: sentences on what had changed in the source since it was stored, which is moved as it is.
    """

    rows: dict[str, int]
    there: int
    problems: tuple[str, ...] = ()


def move(source: Session, target: Session, owner: str, say: Callable[[str], None]) -> Moved:
    """Copy every table of ``source`` into ``target``, which is empty or has an unfinished move of this source.

    ``owner`` names this process to others that wait for it, ``say`` gets the progress. Raises DatabaseError where
    one of them is in use, where the target has something else, and where a row is not the same after all.
    """
    name = _name(source)
    if name == _name(target):
        raise DatabaseError(f"{source.location} is both source and target of the move", "target-not-empty")
    if (found := maintenance.revision(source)) != HEAD_REVISION:
        raise maintenance.other_revision(source, found)
    with _unused(source, owner), source.write() as connection:
        _require_known(connection, source)
        # What the target gets is the place of the source: it is a copy until somebody adopts it.
        deployment.settle_in(source, connection)
        problems = maintenance.changed_on_disk(source)
        mark = maintenance.MOVING + hashlib.sha256(name.encode()).hexdigest()[:16]
        resumed = _prepare(target, mark)
        with _unused(target, owner):
            moved = replace(_copy(connection, target, resumed=resumed, say=say), problems=problems)
            maintenance.set_revision(target, HEAD_REVISION)
    return moved


def _name(session: Session) -> str:
    """What tells a database from others."""
    return session.url.render_as_string() if session.on_server else str(session.path)


@contextmanager
def _unused(session: Session, owner: str) -> Iterator[None]:
    """Keep workers off a database."""
    lock: DispatcherLock | ServerLock
    if session.on_server:
        lock = session.server_lock(owner)
        taken = lock.take_alone()
    else:
        lock = DispatcherLock(session.path)
        taken = lock.take()
    if not taken:
        raise DatabaseError(
            f"a worker (process {lock.holder()}) is working on {session.location}: stop Sprag first", "database-in-use"
        )
    try:
        yield
    finally:
        lock.release()


def _require_known(connection: sa.Connection, source: Session) -> None:
    """Raise DatabaseError for a table that is not one of ours: what is not known cannot be moved."""
    unknown = set(sa.inspect(connection).get_table_names()) - set(all_tables().tables) - _NOT_MOVED
    if unknown:
        raise DatabaseError(
            f"{source.location} has tables that are not Sprag's: {', '.join(sorted(unknown))}; drop them or move them "
            "by yourself",
            "unknown-tables",
        )


def _prepare(target: Session, mark: str) -> bool:
    """Make the tables of the target and mark it as unfinished; whether an earlier move had begun."""
    found = maintenance.revision(target)
    if found == mark:
        return True
    if found is not None and found.startswith(maintenance.MOVING):
        raise DatabaseError(
            f"{target.location} has an unfinished move of another database; name an empty one", "target-not-empty"
        )
    if found is None:
        maintenance.make(target, mark)
        return False
    if found != HEAD_REVISION:
        raise maintenance.other_revision(target, found)
    with target.read() as connection:
        tables = [table for table in all_tables().sorted_tables if table is not deployment.DEPLOYMENT]
        full = [table.name for table in tables if _has_rows(connection, table)]
    if full:
        raise DatabaseError(
            f"{target.location} is not empty: it has rows in {', '.join(full)}; name an empty database",
            "target-not-empty",
        )
    maintenance.set_revision(target, mark)
    return False


def _has_rows(connection: sa.Connection, table: sa.Table) -> bool:
    return connection.execute(sa.select(sa.literal(1)).select_from(table).limit(1)).first() is not None


def _copy(connection: sa.Connection, target: Session, *, resumed: bool, say: Callable[[str], None]) -> Moved:
    """Bring the target to the state of the source and compare all of it."""
    tables = tables_of(all_tables())
    if resumed:
        for table in reversed(tables):
            _drop_surplus(connection, target, table)
    there = 0
    rows: dict[str, int] = {}
    for table in tables:
        rows[table.name], known = _copy_table(connection, target, table)
        there += known
        if rows[table.name]:
            say(f"{table.name}: {rows[table.name]:,} rows, {known:,} of them there already")
    for table in tables:
        table.copy_counter(connection, target)
    for table in tables:
        _compare(connection, target, table)
    say(f"{sum(rows.values()):,} rows in {len(rows)} tables are the same in both databases")
    return Moved(rows, there)


def _drop_surplus(connection: sa.Connection, target: Session, table: TableOf) -> None:
    """Delete the rows of an unfinished move that the source no longer has."""
    with closing(table.batches(connection)) as batches:
        for low, high, rows in batches:
            kept = set(map(table.key, rows))
            with target.write() as there:
                surplus = [key for row in table.between(there, low, high) if (key := table.key(row)) not in kept]
                if surplus:
                    table.delete(there, surplus)


def _copy_table(connection: sa.Connection, target: Session, table: TableOf) -> tuple[int, int]:
    """Copy what the target lacks: the number of rows, and how many were there already."""
    count = there = 0
    with closing(table.batches(connection)) as batches:
        for low, high, rows in batches:
            with target.read() as reading:
                old = table.between(reading, low, high)
            count += len(rows)
            if old == rows:
                there += len(rows)
                continue
            same = set(old) & set(rows)
            there += len(same)
            with target.write() as writing:
                table.put(writing, [row for row in rows if row not in same], replace=bool(old))
    return count, there


def _compare(connection: sa.Connection, target: Session, table: TableOf) -> None:
    """Raise DatabaseError unless every row of the table is the same in both databases."""
    with closing(table.batches(connection)) as batches:
        for low, high, rows in batches:
            with target.read() as there:
                copied = table.between(there, low, high)
            if copied != rows:
                wrong = _first_difference(table, rows, copied)
                raise DatabaseError(
                    f"the row {wrong} of {table.name} is not the same in {target.location}: run the move again",
                    "move-differs",
                )


def _first_difference(table: TableOf, rows: Sequence[tuple[Any, ...]], copied: Sequence[tuple[Any, ...]]) -> str:
    for ours, theirs in zip(rows, copied, strict=False):
        if ours != theirs:
            return str(min(table.key(ours), table.key(theirs)))
    longer = max(rows, copied, key=len)
    return str(table.key(longer[min(len(rows), len(copied))]))
