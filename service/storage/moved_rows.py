"""Tables as a move sees them: rows as plain tuples, in the order of their keys, in batches of bounded size."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa

if TYPE_CHECKING:
    from collections.abc import Generator, Sequence

    from sprag.service.storage.database.session import Session

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
            from sprag.service.storage.database.postgres import copy_in

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
