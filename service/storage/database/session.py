"""Opening the database: connections and transactions, in a file of SQLite (`sqlite_files`) or on a PostgreSQL server
(`postgres`).
"""

from __future__ import annotations

import math
import re
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from pathlib import Path
from threading import Condition, Lock, local
from time import perf_counter
from typing import TYPE_CHECKING, Any, TypeVar, TypeVarTuple

import sqlalchemy as sa
from sqlalchemy.engine import URL, make_url

from sprag_study.service.storage.database import sqlite_files
from sprag_study.service.storage.database.file_news import FileNews
from sprag_study.service.storage.errors import DatabaseError, DatabaseFullError, EndingError, busy

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from types import ModuleType

    from sprag_study.service.storage.database.blocks import Block, Target
    from sprag_study.service.storage.database.server_lock import ServerLock
    from sprag_study.worker.ports import News

Args = TypeVarTuple("Args")
R = TypeVar("R")

#: Seconds a connection waits for another writer before it gives up.
BUSY_SECONDS = 30.0
POOL_CONNECTIONS = 8

#: Options of a connection: the statement that begins a transaction, and the seconds that a file waits for its lock.
_BEGIN = "sprag_begin"
_WAIT = "sprag_wait"
#: Of a connection in a `Moment`: the rows of studies that were read, each once.
READ = "sprag_read"


def _without_password(url: str) -> str:
    """An invalid URL without the part between its scheme and the last @."""
    return re.sub(r"(://).*@", r"\1...@", url)


def file_of(url: str) -> Path | None:
    """The file of an SQLite database; None for one on a server, and for what is no URL of a database."""
    try:
        place = make_url(url)
    except (sa.exc.ArgumentError, ValueError):
        return None
    return Path(place.database) if place.get_backend_name() == "sqlite" and place.database else None


_JOINED = local()


class Moment:
    """A state of the database that several reads see: the first of them begins a transaction, which stays until `end`.

    They may be in several threads, one after the other. After its end it begins anew.
    """

    def __init__(self) -> None:
        self._turn = Lock()
        self._transaction = ExitStack()
        self._connections: dict[Session, sa.Connection] = {}

    def __bool__(self) -> bool:
        return bool(self._connections)

    @contextmanager
    def joined(self) -> Iterator[None]:
        """Let this thread's reads inside be of this moment."""
        with self._turn:
            _JOINED.moment = self
            try:
                yield
            finally:
                _JOINED.moment = None

    def connection(self, session: Session) -> sa.Connection:
        """The connection to a database, for `Session.read`."""
        if session not in self._connections:
            connection = self._transaction.enter_context(session.transaction())
            self._connections[session] = connection.execution_options(**{READ: {}})
        return self._connections[session]

    def end(self) -> None:
        """End the transactions."""
        self._connections.clear()
        self._transaction.close()


def in_one_moment(function: Callable[[*Args], R], *args: *Args) -> R:
    """The value of a function all of whose reads are of one moment: that of its caller, where it has one."""
    if getattr(_JOINED, "moment", None) is not None:
        return function(*args)
    moment = Moment()
    try:
        with moment.joined():
            return function(*args)
    finally:
        moment.end()


class Session:
    """Connections to one database.

    ``url`` is a SQLAlchemy URL of an SQLite file or of a database on a PostgreSQL server. Raises DatabaseError when it
    cannot be used. ``location`` is the database for display. Without ``create`` a file has to be there; ``alone``: no
    other connection to the file may be open, on a server see `sprag_study.service.storage.alone`.
    """

    def __init__(self, url: str, *, create: bool = True, alone: bool = False) -> None:
        try:
            self.url: URL = make_url(url)
        except (sa.exc.ArgumentError, ValueError):  # the latter for an invalid port
            raise DatabaseError(
                f"{_without_password(url)!r} is not a database URL; use sqlite:////path/to/sprag.sqlite3 or "
                "postgresql://user@host:5432/database",
                "invalid-database-url",
            ) from None
        if "@" in (self.url.host or ""):
            raise DatabaseError(
                "the database URL has more than one @ before its host: "
                "in a name or password write @ as %40 and / as %2F",
                "invalid-database-url",
            )
        #: None where the database is on a server.
        self._file: sqlite_files.DatabaseFile | None = None
        match self.url.get_backend_name():
            case "sqlite":
                self._file = sqlite_files.DatabaseFile(self.url, BUSY_SECONDS, create=create, alone=alone)
                self.location = str(self._file.path)
                self._engine = self._file.make_engine(POOL_CONNECTIONS)
                begin = {"read": "BEGIN", "write": "BEGIN IMMEDIATE"}
                reading: dict[str, Any] = {}
            case "postgresql":
                postgres = _postgres()
                self.url = postgres.checked(self.url)
                self.location = postgres.location(self.url)
                self._engine = postgres.make_engine(self.url, lock_seconds=BUSY_SECONDS, connections=POOL_CONNECTIONS)
                begin = {"read": "", "write": postgres.TAKE_WRITER}
                reading = {"isolation_level": "REPEATABLE READ", "postgresql_readonly": True}
            case other:
                raise DatabaseError(
                    f"databases of kind {other!r} are not supported; use sqlite or postgresql", "invalid-database-url"
                )
        sa.event.listen(self._engine, "begin", _begin)
        self._turn = Condition()
        self._writing = self._refusing = False
        #: Called with the time ("read" or "write", s) that each transaction waited for its beginning.
        self.on_wait: Callable[[str, float], None] | None = None
        self._reader = self._engine.execution_options(**{_BEGIN: begin["read"]}, **reading)
        self._writer = self._engine.execution_options(**{_BEGIN: begin["write"]})

    @property
    def on_server(self) -> bool:
        """Whether the database is on a PostgreSQL server and not in a local file."""
        return self._file is None

    @property
    def file(self) -> sqlite_files.DatabaseFile:
        """The file of an SQLite database; only valid where `on_server` is false."""
        assert self._file is not None
        return self._file

    @property
    def path(self) -> Path:
        """Where that file is."""
        return self.file.path

    @property
    def damage(self) -> str | None:
        """Why the database cannot be trusted any more; None where nothing wrong was met."""
        return None if self._file is None else self._file.damage

    def require_same_file(self) -> None:
        """Raise DatabaseError when the file is not the one that was opened: writes would be lost with it."""
        if self._file is not None:
            self._file.require_same()

    def can_write(self, seconds: float) -> bool:
        """Whether a write transaction could begin within ``seconds``. Raises DatabaseError."""
        if self._file is not None:
            return self._file.can_write(seconds)
        with self.plain() as connection:
            return bool(_postgres().writer_is_free(connection, seconds))

    @property
    def dialect(self) -> sa.engine.Dialect:
        """The SQL dialect in use."""
        return self._engine.dialect

    @contextmanager
    def read(self) -> Iterator[sa.Connection]:
        """A short read transaction: all reads see the same state, and inside a `Moment` that of its first one."""
        moment: Moment | None = getattr(_JOINED, "moment", None)
        if moment is None:
            with self.transaction() as connection:
                yield connection
            return
        with self._explaining():
            yield moment.connection(self)

    def transaction(self) -> AbstractContextManager[sa.Connection]:
        """A read transaction of its own."""
        return self._transaction(self._reader, "read", perf_counter())

    @contextmanager
    def write(self) -> Iterator[sa.Connection]:
        """A write transaction that holds the write lock from its beginning; commits at the end, or changes nothing."""
        # Threads of one process queue here: SQLite waits by sleeping for increasing times, which is unfair to early
        # waiters.
        began = perf_counter()
        until = began + BUSY_SECONDS  # for the turn here and the lock together
        self.require_same_file()
        with self._turn:
            if not self._turn.wait_for(lambda: self._refusing or not self._writing, BUSY_SECONDS):
                raise busy(self.location)
            self._require_admitted()
            self._writing = True
        try:
            writer = self._writer.execution_options(**{_WAIT: max(until - perf_counter(), 0.0)})
            with self._transaction(writer, "write", began) as connection:
                yield connection
        finally:
            with self._turn:
                self._writing = False
                self._turn.notify()

    @contextmanager
    def write_rows(self) -> Iterator[sa.Connection]:
        """A write transaction for rows that it locks itself: on a server it waits for no other writer.

        For a file it is a `write`.
        """
        if not self.on_server:
            with self.write() as connection:
                yield connection
            return
        self._require_admitted()
        with self._transaction(self._engine, "write", perf_counter()) as connection:
            yield connection

    def _require_admitted(self) -> None:
        if self._refusing:
            raise EndingError("the service is shutting down; nothing was written")

    def refuse_writes(self) -> None:
        """Refuse writes from now on: waiting ones get EndingError. The current one continues."""
        with self._turn:
            self._refusing = True
            self._turn.notify_all()

    @contextmanager
    def _transaction(self, engine: sa.Engine, kind: str, began: float) -> Iterator[sa.Connection]:
        with self._explaining(), engine.begin() as connection:
            if self.on_wait is not None:
                self.on_wait(kind, perf_counter() - began)
            yield connection

    def insert_blocks(self, connection: sa.Connection, place: Target, blocks: Iterable[Block]) -> None:
        """Insert rows of finished chunks, bypassing SQLAlchemy for speed."""
        insert = _postgres().copy_blocks if self.on_server else sqlite_files.insert_blocks
        insert(connection, place, blocks)

    @contextmanager
    def plain(self) -> Iterator[sa.Connection]:
        """A connection in autocommit mode, for statements that do not work in a transaction."""
        options = {"isolation_level": "AUTOCOMMIT"} if self.on_server else {}
        with (
            self._explaining(),
            self._engine.connect().execution_options(**{_BEGIN: ""}, **options) as connection,
        ):
            yield connection

    def checkpoint(self) -> None:
        """Move the write-ahead log into the file as far as no reader needs the old state; a server does so itself.

        Neither readers nor writers wait for it.
        """
        if not self.on_server:
            with self.plain() as connection:
                connection.exec_driver_sql("PRAGMA wal_checkpoint(PASSIVE)")

    def renew_log(self) -> None:
        """Let the log begin anew where its pages find their place in the file; nothing on a disk too full for that."""
        with suppress(DatabaseFullError):
            self.checkpoint()

    def server_lock(self, owner: str) -> ServerLock:
        """The presence of the dispatcher ``owner`` (a name for people) on a database server."""
        _postgres()
        from sprag_study.service.storage.database.server_lock import ServerLock

        return ServerLock(self.url, owner, BUSY_SECONDS)

    def news(self) -> News:
        """Notifications of changes."""
        news: News = _postgres().News(self.url, BUSY_SECONDS) if self.on_server else FileNews(self.path)
        return news

    @contextmanager
    def _explaining(self) -> Iterator[None]:
        """Errors of the driver are raised as DatabaseError where their cause is external."""
        try:
            yield
        except sa.exc.DBAPIError as error:
            raise self._explained(error) from error
        except UnicodeDecodeError as error:  # the driver's, for a message of SQLite that quotes damaged bytes
            if self._file is None:
                raise
            raise self._file.explained(error) from error

    def _explained(self, error: sa.exc.DBAPIError) -> Exception:
        if self._file is not None:
            return self._file.explained(error)
        return (_postgres().explained(error.orig, self.location) if error.orig else None) or error

    def close(self) -> None:
        """Close every connection."""
        self._engine.dispose()
        if self._file is not None:
            self._file.close()


def _postgres() -> ModuleType:
    """The module for servers; its driver is an optional dependency."""
    try:
        from sprag_study.service.storage.database import postgres
    except ImportError:
        raise DatabaseError(
            'PostgreSQL needs a driver that is not installed: pip install "sprag-study[postgres]"', "missing-extra"
        ) from None
    return postgres


def _begin(connection: sa.Connection) -> None:
    # The driver never begins a transaction by itself (isolation_level None). A read transaction cannot become a write
    # transaction once another process has written in between, so writers take the lock when they begin.
    options = connection.get_execution_options()
    if statement := options.get(_BEGIN):
        if _WAIT in options and connection.dialect.name == "sqlite":
            connection.exec_driver_sql(f"PRAGMA busy_timeout = {math.ceil(options[_WAIT] * 1000)}")
        connection.exec_driver_sql(statement)
