"""PostgreSQL instead of SQLite: its URL, connections and transactions, its lock, and notifications of changes.

Each writer holds an advisory lock for the length of its transaction. So the store has one writer at a time on a server
too, and reasoning about SQLite's immediate transactions remains valid. What people write about a study, heartbeats,
times of stages and uses of tokens lock only the rows that they change (`Session.write_rows`): they do not wait until
rows are stored.

Rows are copied in the binary format, built as arrays instead of row by row: a row is a 16-bit number of fields, then
for each field a 32-bit length and that many bytes, all big-endian; the length -1 and no bytes are NULL (PostgreSQL's
manual, "COPY", "Binary Format"). Every row of a block is laid out at its full width first; the bytes that a row does
not have are dropped afterwards.
"""

from __future__ import annotations

import struct
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import psycopg
import sqlalchemy as sa
from sqlalchemy.engine import URL

from sprag_study.service.storage.errors import DatabaseBusyError, DatabaseError, DatabaseFullError, busy

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from sprag_study.service.storage.database.blocks import Block, Target
    from sprag_study.worker.arrays import Bools, Floats

#: Signature, flags (none) and the length of the extension of the header (none).
HEADER: Final = b"PGCOPY\n\xff\r\n\0" + struct.pack(">ii", 0, 0)
TRAILER: Final = struct.pack(">h", -1)
_LENGTH, _REAL, _WHOLE = ">i4", ">f8", ">i4"
#: Range of a column of integers.
_LEAST, _MOST = -(2**31), 2**31 - 1


def encoded(place: Target, rows: Block) -> bytes:
    """The rows without header and trailer.

    Raises OverflowError for a count that a column of 32-bit integers cannot hold.
    """
    texts = [_Texts(rows.endings), _Texts(rows.flags)]
    form = _form(place, [text.width for text in texts])
    laid = np.zeros(len(rows.cases), dtype=form)
    laid["fields"] = len(place.columns)
    for name, values in (("study", rows.studies), ("case", rows.cases)):
        laid[f"{name}_length"], laid[name] = 4, values
    for name, text in zip(("ending", "flags"), texts, strict=True):
        laid[f"{name}_length"], laid[name] = text.lengths, text.values
    finite = np.isfinite(rows.values)
    for index, whole in enumerate(place.whole):
        column, known = rows.values[:, index], finite[:, index]
        numbers = _whole(place.columns[4 + index], column, known) if whole else column
        width = form[f"value_{index}"].itemsize
        laid[f"value_{index}_length"] = width if known.all() else np.where(known, width, -1)
        laid[f"value_{index}"] = numbers
    return _packed(laid, texts, finite)


def _form(place: Target, widths: Sequence[int]) -> np.dtype[Any]:
    """The layout of a row whose texts are all as long as the longest, and in which nothing is NULL."""
    fields: list[tuple[str, str]] = [("fields", ">i2")]
    for name, kind in (("study", _WHOLE), ("case", _WHOLE), ("ending", f"S{widths[0]}"), ("flags", f"S{widths[1]}")):
        fields += [(f"{name}_length", _LENGTH), (name, kind)]
    for index, whole in enumerate(place.whole):
        fields += [(f"value_{index}_length", _LENGTH), (f"value_{index}", _WHOLE if whole else _REAL)]
    return np.dtype(fields)


class _Texts:
    """A column of few different texts: ``values`` as bytes of one width, ``lengths`` of each."""

    def __init__(self, texts: Sequence[str]) -> None:
        kinds: dict[str, int] = {}
        codes = [kinds.setdefault(text, len(kinds)) for text in texts]
        kept = [text.encode() for text in kinds]
        # numpy has no strings without bytes.
        self.width = max(1, *map(len, kept)) if kept else 1
        self.values = np.array(kept, dtype=f"S{self.width}")[codes]
        self.lengths = np.array([len(text) for text in kept], dtype=np.int32)[codes]


def _whole(column: str, values: Floats, known: Bools) -> Floats:
    numbers = np.where(known, values, 0.0)
    if numbers.size and not (numbers.min() >= _LEAST and numbers.max() <= _MOST):
        raise OverflowError(f"{column} has a value outside {_LEAST} to {_MOST}")
    return numbers


def _packed(laid: NDArray[Any], texts: Sequence[_Texts], finite: Bools) -> bytes:
    """The rows one after the other, without the bytes of shorter texts and of what is NULL."""
    even = all((text.lengths == text.width).all() for text in texts)
    if even and finite.all():
        return laid.tobytes()
    form = laid.dtype
    assert form.fields is not None
    kept = np.ones((len(laid), form.itemsize), dtype=np.bool_)
    for name, text in zip(("ending", "flags"), texts, strict=True):
        start = form.fields[name][1]
        kept[:, start : start + text.width] = np.arange(text.width) < text.lengths[:, None]
    for index in np.flatnonzero(~finite.all(axis=0)).tolist():
        kind, start = form.fields[f"value_{index}"][:2]
        kept[:, start : start + kind.itemsize] = finite[:, index, None]
    return laid.view(np.uint8).reshape(kept.shape)[kept].tobytes()


#: First key of the advisory locks of Sprag ("SPRA" in ASCII), of which the second key gives the purpose; and of those
#: of the dispatchers ("SPRB"), whose second key is the epoch.
LOCKS: Final = 0x53505241
EPOCHS: Final = 0x53505242
WRITER, CHORES, USERS = 1, 2, 3
#: Begins a write transaction.
TAKE_WRITER: Final = f"SELECT pg_advisory_xact_lock({LOCKS}, {WRITER})"
#: The channel of notifications about changed studies.
CHANNEL: Final = "sprag"
#: Older versions lack features that are used here, and are out of support.
OLDEST_SERVER: Final = 140_000
#: Seconds after which either side counts a silent connection as lost.
LOST_SECONDS: Final = 5
#: Seconds for which a process frozen in a transaction blocks the others.
FROZEN_SECONDS: Final = 60
#: Options of the URL that are passed on to the driver.
URL_OPTIONS: Final = frozenset({"host", "passfile", "sslcert", "sslkey", "sslmode", "sslrootcert"})
_LOCAL: Final = frozenset({"", "localhost", "127.0.0.1", "::1"})


def checked(url: URL) -> URL:
    """The URL with the driver, and with encryption required of every server that is not on this machine.

    Raises DatabaseError for an invalid URL.
    """
    if url.drivername not in {"postgresql", "postgresql+psycopg"}:
        raise DatabaseError(
            f"the driver {url.get_driver_name()!r} is not supported; write postgresql://...", "invalid-database-url"
        )
    unknown = sorted(set(url.query) - URL_OPTIONS)
    if unknown:
        raise DatabaseError(
            f"unknown option {', '.join(unknown)} in the PostgreSQL URL; allowed are {', '.join(sorted(URL_OPTIONS))}",
            "invalid-database-url",
        )
    if not url.database:
        raise DatabaseError(
            f"{location(url)} names no database; a URL looks like postgresql://user@host/sprag", "invalid-database-url"
        )
    host = str(url.query.get("host", url.host or ""))
    if "sslmode" not in url.query and host not in _LOCAL and not host.startswith("/"):
        url = url.update_query_dict({"sslmode": "require"})
    return url.set(drivername="postgresql+psycopg")


def location(url: URL) -> str:
    """The database for display: without password and options."""
    shown = URL.create("postgresql", url.username, None, url.host, url.port, url.database)
    return shown.render_as_string()


def _arguments(lock_seconds: float) -> dict[str, Any]:
    """Arguments of every connection; both client and server notice when the other is gone."""
    server = {
        "tcp_keepalives_idle": 2,
        "tcp_keepalives_interval": 1,
        "tcp_keepalives_count": LOST_SECONDS - 2,
        "tcp_user_timeout": LOST_SECONDS * 1000,
        "lock_timeout": int(lock_seconds * 1000),
        "idle_in_transaction_session_timeout": FROZEN_SECONDS * 1000,
    }
    return {
        "connect_timeout": LOST_SECONDS,
        "keepalives_idle": 2,
        "keepalives_interval": 1,
        "keepalives_count": LOST_SECONDS - 2,
        "tcp_user_timeout": LOST_SECONDS * 1000,
        "application_name": "sprag",
        "options": " ".join(f"-c {name}={value}" for name, value in server.items()),
    }


def make_engine(url: URL, *, lock_seconds: float, connections: int) -> sa.Engine:
    """Connections to the server; a lost one is replaced before use."""
    engine = sa.create_engine(
        url,
        connect_args=_arguments(lock_seconds),
        pool_size=connections,
        max_overflow=64,
        pool_pre_ping=True,
    )
    sa.event.listen(engine, "first_connect", _require_version)
    return engine


def _require_version(connection: Any, _record: object) -> None:
    version = connection.info.server_version
    if version < OLDEST_SERVER:
        raise DatabaseError(
            f"PostgreSQL {version // 10_000} is too old; Sprag needs {OLDEST_SERVER // 10_000} or newer",
            "unsupported-database",
        )


def connect(url: URL, lock_seconds: float, application: str = "sprag") -> psycopg.Connection[Any]:
    """A connection outside the pool, in autocommit mode. Raises DatabaseError."""
    given = {**_arguments(lock_seconds), "application_name": application[:63]}
    dialect = url.get_dialect()()
    _, named = dialect.create_connect_args(url)
    try:
        return psycopg.connect(autocommit=True, **{**named, **given})
    except psycopg.Error as error:
        raise explained(error, location(url)) or DatabaseError(
            _unreachable(error, location(url)), "database-unreachable"
        ) from None


def _first_line(error: BaseException) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[0] if lines else type(error).__name__


def _unreachable(error: BaseException, where: str) -> str:
    return f"the database {where} cannot be reached: {_first_line(error)}"


def explained(error: BaseException, where: str) -> DatabaseError | None:
    """The DatabaseError for an error of the driver that has an external cause; None for other errors."""
    state = getattr(error, "sqlstate", None) or ""
    if state in {"55P03", "40001", "40P01"}:
        return busy(where)
    if state == "53100":
        return DatabaseFullError(f"the disk of the server that holds {where} is full")
    if state.startswith(("53", "58")):
        return DatabaseBusyError(f"the server of the database {where} has a problem: {_first_line(error)}")
    if state == "42501":
        return DatabaseError(f"permission denied in the database {where}: {_first_line(error)}", "database-forbidden")
    if state == "25006":
        return DatabaseError(
            f"the database {where} is read-only; name the primary server, not its copy", "database-read-only"
        )
    # A lost connection has no state, or one of classes 08 (connection) and 57 (the server is shutting down).
    if state.startswith(("08", "57")) or (not state and isinstance(error, psycopg.OperationalError)):
        return DatabaseError(_unreachable(error, where), "database-unreachable")
    return None


def writer_is_free(connection: sa.Connection, seconds: float) -> bool:
    """Whether the writers' lock can be acquired within ``seconds``; it is released immediately."""
    until = time.monotonic() + seconds
    while True:
        if connection.exec_driver_sql(f"SELECT pg_try_advisory_xact_lock({LOCKS}, {WRITER})").scalar_one():
            return True
        if time.monotonic() > until:
            return False
        time.sleep(0.05)


def copy_blocks(connection: sa.Connection, place: Target, blocks: Iterable[Block]) -> None:
    """Insert rows by a binary COPY; the server takes a block while the next one is built.

    Raises sqlalchemy.exc.DBAPIError.
    """
    driver: psycopg.Connection[Any] | None = connection.connection.driver_connection
    assert driver is not None
    statement = f"COPY {place.table} ({', '.join(place.columns)}) FROM STDIN (FORMAT BINARY)"
    try:
        with driver.cursor() as cursor, cursor.copy(statement.encode()) as copy:
            copy.write(HEADER)
            for rows in blocks:
                copy.write(encoded(place, rows))
            copy.write(TRAILER)
    except psycopg.Error as error:
        raise sa.exc.DBAPIError(statement, None, error) from error


def copy_in(connection: sa.Connection, table: str, rows: Iterable[tuple[Any, ...]]) -> None:
    """Insert any rows by COPY; ``table`` is its name with its columns. Raises sqlalchemy.exc.DBAPIError."""
    driver: psycopg.Connection[Any] | None = connection.connection.driver_connection
    assert driver is not None
    statement = f"COPY {table} FROM STDIN"
    try:
        with driver.cursor() as cursor, cursor.copy(statement.encode()) as copy:
            for row in rows:
                copy.write_row(row)
    except psycopg.Error as error:
        raise sa.exc.DBAPIError(statement, None, error) from error


class News:
    """Notifications of changed studies as soon as they are committed by any process."""

    def __init__(self, url: URL, lock_seconds: float) -> None:
        self._url = url
        self._lock_seconds = lock_seconds
        self._connection: psycopg.Connection[Any] | None = None

    def wait(self, timeout: float) -> bool:
        """Whether something has or may have changed since the last call; waits at most ``timeout`` s."""
        try:
            if self._connection is None:
                self._connection = connect(self._url, self._lock_seconds)
                self._connection.execute(f"LISTEN {CHANNEL}".encode())
                return True  # earlier changes are not reported
            heard = False
            for _ in self._connection.notifies(timeout=timeout, stop_after=1):
                heard = True
            for _ in self._connection.notifies(timeout=0.0):
                heard = True
        except (psycopg.Error, DatabaseError):
            self.close()
            time.sleep(timeout)
            return True
        return heard

    def close(self) -> None:
        """Stop listening."""
        connection, self._connection = self._connection, None
        if connection is not None:
            with suppress(psycopg.Error):
                connection.close()
