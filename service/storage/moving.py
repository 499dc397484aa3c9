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

from sprag_study.service.storage import deployment, maintenance
from sprag_study.service.storage.database.lock import DispatcherLock
from sprag_study.service.storage.errors import DatabaseError
from sprag_study.service.storage.tables import HEAD_REVISION, all_tables

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterator, Sequence

    from sprag_study.service.storage.database.server_lock import ServerLock
    from sprag_study.service.storage.database.session import Session

    Row = tuple[Any, ...]
    #: Rows after the first key (None: from the beginning) up to the second one (None: to the end).
    Batch = tuple[Row | None, Row | None, list[Row]]

#: Limits of a batch, which is in memory twice and is one transaction.
BATCH_ROWS: Final = 5_000
BATCH_BYTES: Final = 32_000_000
#: Rows that are fetched at once: of tables of results, and of others, whose texts can have megabytes.
_FETCHED_RESULTS: Final = 1_000
_FETCHED: Final = 20


@dataclass(frozen=True, slots=True)
class TableOf:
    """One table."""

    table: sa.Table

    @property
    def name(self) -> str:
        """Its name."""
        return self.table.name

    def key(self, row: Row) -> Row:
        """The primary key of a row."""
        return tuple(row[index] for index, column in enumerate(self.table.c) if column.primary_key)

    def batches(self, connection: sa.Connection) -> Generator[Batch]:
        """Every row, in order; the last batch ends the table, and may be empty. Close it before the connection."""
        fetched = _FETCHED_RESULTS if "case_number" in self.table.c else _FETCHED
        low: Row | None = None
        rows: list[Row] = []
        size = 0
        options = {"stream_results": True, "yield_per": fetched}
        found = connection.exec_driver_sql(self._select(connection, ""), execution_options=options)
        with closing(found):
            for part in found.partitions(fetched):
                for row in map(tuple, part):
                    rows.append(row)
                    size += sum(len(cell) if isinstance(cell, str) else 8 for cell in row)
                if len(rows) >= BATCH_ROWS or size >= BATCH_BYTES:
                    high = self.key(rows[-1])
                    yield low, high, rows
                    low, rows, size = high, [], 0
        yield low, None, rows

    def between(self, connection: sa.Connection, low: Row | None, high: Row | None) -> list[Row]:
        """Rows after ``low`` up to ``high``, in order."""
        limits = [(sign, key) for sign, key in ((">", low), ("<=", high)) if key is not None]
        keys = self._keys(connection)
        where = " AND ".join(f"({keys}) {sign} ({self._marks(connection, key)})" for sign, key in limits)
        given = tuple(cell for _, key in limits for cell in key)
        found = connection.exec_driver_sql(self._select(connection, where and f"WHERE {where}"), given)
        return list(map(tuple, found))

    def put(self, connection: sa.Connection, rows: Sequence[Row], *, replace: bool) -> None:
        """Insert rows; with ``replace`` some may be there under the same keys."""
        if not rows:
            return
        columns = self._columns(connection)
        if not replace and connection.dialect.name == "postgresql":
            from sprag_study.service.storage.database.postgres import copy_in

            copy_in(connection, f"{self._quoted(connection, self.name)} ({columns})", rows)
            return
        statement = (
            f"INSERT INTO {self._quoted(connection, self.name)} ({columns}) "  # noqa: S608 - names of our own tables
            f"VALUES ({self._marks(connection, rows[0])})"
        )
        if replace:
            others = [self._quoted(connection, column.name) for column in self.table.c if not column.primary_key]
            action = ", ".join(f"{name} = excluded.{name}" for name in others)
            keys = ", ".join(self._quoted(connection, column.name) for column in self.table.primary_key)
            statement += f" ON CONFLICT ({keys}) DO {f'UPDATE SET {action}' if others else 'NOTHING'}"
        connection.exec_driver_sql(statement, list(rows))

    def delete(self, connection: sa.Connection, keys: Sequence[Row]) -> None:
        """Delete the rows with those keys."""
        where = f"({self._keys(connection)}) = ({self._marks(connection, keys[0])})"
        statement = f"DELETE FROM {self._quoted(connection, self.name)} WHERE {where}"  # noqa: S608
        connection.exec_driver_sql(statement, list(keys))

    def copy_counter(self, connection: sa.Connection, target: Session) -> None:
        """Let the target number new rows from where the source is, so that no number is used twice."""
        if (column := self.table.autoincrement_column) is None or column.autoincrement is False:
            return
        last = _counter(connection, self.name, column.name)
        with target.write() as writing:
            _set_counter(writing, self.name, column.name, last)

    def _select(self, connection: sa.Connection, where: str) -> str:
        return (
            f"SELECT {self._columns(connection)} FROM {self._quoted(connection, self.name)} "  # noqa: S608
            f"{where} ORDER BY {self._keys(connection)}"
        )

    def _columns(self, connection: sa.Connection) -> str:
        return ", ".join(self._quoted(connection, column.name) for column in self.table.c)

    def _keys(self, connection: sa.Connection) -> str:
        """The columns of the key; texts in the order of their bytes, which both kinds of databases know."""
        by_bytes = ' COLLATE "C"' if connection.dialect.name == "postgresql" else ""
        return ", ".join(
            self._quoted(connection, column.name) + (by_bytes if isinstance(column.type, sa.String) else "")
            for column in self.table.c
            if column.primary_key
        )

    @staticmethod
    def _quoted(connection: sa.Connection, name: str) -> str:
        return connection.dialect.identifier_preparer.quote(name)

    @staticmethod
    def _marks(connection: sa.Connection, cells: Sequence[Any]) -> str:
        return ", ".join(["%s" if connection.dialect.name == "postgresql" else "?"] * len(cells))


def tables_of(metadata: sa.MetaData) -> list[TableOf]:
    """Every table, each after those to which it refers."""
    return [TableOf(table) for table in metadata.sorted_tables]


def _counter(connection: sa.Connection, table: str, column: str) -> int:
    """The last number that the database gave to a row of the table; 0 for none."""
    if connection.dialect.name == "postgresql":
        sequence = connection.execute(sa.func.pg_get_serial_sequence(table, column).select()).scalar_one()
        last, called = connection.exec_driver_sql(f"SELECT last_value, is_called FROM {sequence}").one()  # noqa: S608
        return int(last) if called else 0
    largest = connection.exec_driver_sql(f"SELECT coalesce(max({column}), 0) FROM {table}").scalar_one()  # noqa: S608
    noted = sa.text("SELECT seq FROM sqlite_sequence WHERE name = :name")
    last = connection.execute(noted, {"name": table}).scalar_one_or_none() if _has_counters(connection) else None
    return max(int(largest), int(last or 0))


def _has_counters(connection: sa.Connection) -> bool:
    found = "SELECT 1 FROM sqlite_master WHERE name = 'sqlite_sequence'"
    return connection.exec_driver_sql(found).first() is not None


def _set_counter(connection: sa.Connection, table: str, column: str, last: int) -> None:
    if connection.dialect.name == "postgresql":
        sequence = sa.func.pg_get_serial_sequence(table, column)
        connection.execute(sa.func.setval(sequence, max(last, 1), last > 0).select())
    elif _has_counters(connection):
        given = {"name": table, "last": last}
        connection.execute(sa.text("DELETE FROM sqlite_sequence WHERE name = :name"), given)
        connection.execute(sa.text("INSERT INTO sqlite_sequence (name, seq) VALUES (:name, :last)"), given)


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
