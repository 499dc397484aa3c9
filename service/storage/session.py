"""Opening the database: driver, pragmas, transactions, and one sentence for whatever fails.

What is particular to a PostgreSQL server is in `sprag.service.storage.postgres`; here are SQLite's files.
"""

from __future__ import annotations

import os
import re
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Condition
from time import perf_counter
from typing import TYPE_CHECKING, Any

import sqlalchemy as sa
from sqlalchemy.engine import URL, make_url

from sprag.service.storage.errors import DatabaseBusyError, DatabaseError, DatabaseFullError, EndingError
from sprag.service.storage.lock import DispatcherLock
from sprag.service.storage.private_files import PRIVATE_FOLDER_MODE, create_private
from sprag.worker.ports import StoreError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from types import ModuleType

    from sprag.service.storage.lock import OneHolder
    from sprag.worker.ports import News

#: Seconds a connection waits for another writer before it gives up.
BUSY_SECONDS = 30.0
#: Older libraries can corrupt a write-ahead log that several connections share.
SAFE_SQLITE = (3, 51, 3)
#: Rows have some 45 to 150 numbers; larger pages than SQLite's 4 KiB hold several of them and keep the trees flat.
PAGE_BYTES = 16_384
POOL_CONNECTIONS = 8
NETWORK_FILE_SYSTEMS = frozenset({"afs", "ceph", "cifs", "fuse.sshfs", "glusterfs", "nfs", "nfs4", "smb3", "smbfs"})

_BEGIN = "sprag_begin"
_BUSY = "another process kept the database {} busy for too long; try again"


def sqlite_driver() -> Any:
    """The DB-API module for SQLite: pysqlite3, which brings its own library, else Python's own."""
    try:
        from pysqlite3 import dbapi2
    except ImportError:
        from sqlite3 import dbapi2
    return dbapi2


def sqlite_version() -> tuple[int, ...]:
    """Version of the SQLite library in use."""
    version: tuple[int, ...] = tuple(sqlite_driver().sqlite_version_info)
    return version


def sqlite_warning() -> str | None:
    """A sentence when the SQLite library is older than the one that is safe, else None."""
    version = sqlite_version()
    if version >= SAFE_SQLITE:
        return None
    found, wanted = (".".join(map(str, numbers)) for numbers in (version, SAFE_SQLITE))
    return f"SQLite {found} is in use; versions before {wanted} can corrupt a database under load: install pysqlite3."


def file_system_of(path: Path, mounts: str | None = None) -> str:
    """Type of the file system that holds ``path``, as Linux's table of mounts names it; "" where that is not known."""
    if mounts is None:
        try:
            mounts = Path("/proc/self/mounts").read_text(encoding="utf-8", errors="surrogateescape")
        except OSError:
            return ""
    target, best, kind = str(path), -1, ""
    for line in mounts.splitlines():
        fields = line.split(" ")
        if len(fields) < 3:
            continue
        mount = fields[1].replace("\\040", " ").rstrip("/")
        if (target == mount or target.startswith(mount + "/")) and len(mount) >= best:
            best, kind = len(mount), fields[2]
    return kind


def _without_password(url: str) -> str:
    """A text that should have been a URL, without what stands between its scheme and the last @."""
    return re.sub(r"(://).*@", r"\1...@", url)


class Session:
    """Connections to one database.

    ``url`` is a SQLAlchemy URL of an SQLite file or of a database on a PostgreSQL server. Raises DatabaseError, with
    one sentence, when it cannot be used. ``location`` is the database as it may be shown to people.
    """

    def __init__(self, url: str) -> None:
        try:
            self.url: URL = make_url(url)
        except (sa.exc.ArgumentError, ValueError):  # the latter of a port that is no number
            raise DatabaseError(
                f"{_without_password(url)!r} is not a database URL; one looks like sqlite:////path/to/sprag.sqlite3 or "
                "postgresql://user@host:5432/database",
                "invalid-database-url",
            ) from None
        if "@" in (self.url.host or ""):
            raise DatabaseError(
                "the database URL has more than one @ before its host: "
                "in a name or password write @ as %40 and / as %2F",
                "invalid-database-url",
            )
        self._path: Path | None = None
        #: Device and number of the file that was opened first.
        self._file: tuple[int, int] | None = None
        #: Why the database cannot be trusted any more; None where nothing wrong was met.
        self.damage: str | None = None
        match self.url.get_backend_name():
            case "sqlite":
                self._engine = self._open_file()
                begin = {"read": "BEGIN", "write": "BEGIN IMMEDIATE"}
                reading: dict[str, Any] = {}
            case "postgresql":
                self._engine = self._open_server()
                begin = {"read": "", "write": _postgres().TAKE_WRITER}
                reading = {"isolation_level": "REPEATABLE READ", "postgresql_readonly": True}
            case other:
                raise DatabaseError(
                    f"databases of kind {other!r} are not supported; use sqlite or postgresql", "invalid-database-url"
                )
        sa.event.listen(self._engine, "begin", _begin)
        self._turn = Condition()
        self._writing = self._refusing = False
        #: Told how long ("read" or "write", s) each transaction waited for its beginning.
        self.on_wait: Callable[[str, float], None] | None = None
        self._reader = self._engine.execution_options(**{_BEGIN: begin["read"]}, **reading)
        self._writer = self._engine.execution_options(**{_BEGIN: begin["write"]})

    def _open_file(self) -> sa.Engine:
        if self.url.query:
            raise DatabaseError(
                f"a database URL takes no options here ({', '.join(sorted(self.url.query))})", "invalid-database-url"
            )
        if self.url.database in (None, "", ":memory:"):
            raise DatabaseError("the database must be a file: several processes work on it", "invalid-database-url")
        self._path = Path(str(self.url.database)).absolute()
        self.location = str(self._path)
        self._check_place()
        engine = sa.create_engine(
            self.url,
            module=sqlite_driver(),
            connect_args={"timeout": BUSY_SECONDS, "isolation_level": None},
            pool_size=POOL_CONNECTIONS,
            max_overflow=64,
        )
        sa.event.listen(engine, "do_connect", self._create_file)
        sa.event.listen(engine, "connect", _set_pragmas)
        sa.event.listen(engine, "connect", self._note_file)
        return engine

    def _create_file(self, *_: object) -> None:
        """Create the database file before SQLite would, which lets others read it; the log beside it follows suit.

        Raises DatabaseError where the file that was opened first is gone: it is never replaced by an empty one.
        """
        self.require_same_file()
        with suppress(OSError):  # it exists, or SQLite tells what is wrong
            os.close(create_private(self.path))

    def _open_server(self) -> sa.Engine:
        postgres = _postgres()
        self.url = postgres.checked(self.url)
        self.location = postgres.location(self.url)
        engine: sa.Engine = postgres.make_engine(self.url, lock_seconds=BUSY_SECONDS, connections=POOL_CONNECTIONS)
        return engine

    @property
    def on_server(self) -> bool:
        """Whether the database is on a PostgreSQL server and not in a file here."""
        return self._path is None

    @property
    def path(self) -> Path:
        """The file of an SQLite database; only for code that has asked `on_server`."""
        assert self._path is not None
        return self._path

    def _check_place(self) -> None:
        folder = self.path.parent
        try:
            folder.mkdir(PRIVATE_FOLDER_MODE, parents=True, exist_ok=True)
        except OSError as error:
            raise DatabaseError(f"the folder {folder} cannot be made: {error.strerror}", "write-failed") from None
        if self.path.is_dir():
            raise DatabaseError(f"{self.path} is a folder, not a database file", "not-a-database")
        if not os.access(folder, os.W_OK):
            raise DatabaseError(
                f"the folder {folder} is read-only, and the database needs to write beside its file: "
                f"`chmod u+w {folder}`, or name another place with --db",
                "database-read-only",
            )
        kind = file_system_of(self.path.resolve())
        if kind in NETWORK_FILE_SYSTEMS:
            raise DatabaseError(
                f"{self.path} lies on a network file system ({kind}), which cannot hold a database safely: "
                "name a file on a local disk with --db",
                "unsupported-database",
            )

    def _note_file(self, _connection: Any, _record: object) -> None:
        if self._file is None:
            found = self.path.stat()
            self._file = found.st_dev, found.st_ino

    def require_same_file(self) -> None:
        """Raise DatabaseError when the file is not the one that was opened: what is written would be lost with it."""
        if self._file is None:
            return
        try:
            found = self.path.stat()
        except OSError:
            raise DatabaseError(
                f"the database file {self.path} was deleted or moved while it was in use: stop Sprag, put the file or "
                "a backup in its place, and start again",
                "database-replaced",
            ) from None
        if self._file != (found.st_dev, found.st_ino):
            raise DatabaseError(
                f"the database file {self.path} was replaced while it was in use: stop Sprag, delete the files beside "
                "it that end in -wal and -shm if it is a backup, and start again",
                "database-replaced",
            )

    def can_write(self, seconds: float) -> bool:
        """Whether a write transaction could begin within ``seconds``. Raises DatabaseError."""
        if self.on_server:
            with self.plain() as connection:
                return bool(_postgres().writer_is_free(connection, seconds))
        driver = sqlite_driver()
        try:
            connection = driver.connect(
                f"{self.path.as_uri()}?mode=rw", uri=True, timeout=seconds, isolation_level=None
            )
            try:
                connection.execute("BEGIN IMMEDIATE")
                connection.execute("ROLLBACK")
            finally:
                connection.close()
        except driver.Error as error:
            found = self._explained(sa.exc.DBAPIError("", None, error))
            if isinstance(found, DatabaseBusyError):
                return False
            raise (found if isinstance(found, StoreError) else DatabaseError(str(error))) from error
        return True

    @property
    def dialect(self) -> sa.engine.Dialect:
        """The SQL dialect in use."""
        return self._engine.dialect

    @contextmanager
    def read(self) -> Iterator[sa.Connection]:
        """A short read transaction: everything read inside is of one moment."""
        with self._transaction(self._reader, "read", perf_counter()) as connection:
            yield connection

    @contextmanager
    def write(self) -> Iterator[sa.Connection]:
        """A write transaction, with the write lock from its first moment; commits at the end, or changes nothing."""
        # Threads of one process queue here: SQLite's own waiting is by sleeping ever longer, and the last wakes last.
        began = perf_counter()
        self.require_same_file()
        with self._turn:
            if not self._turn.wait_for(lambda: self._refusing or not self._writing, BUSY_SECONDS):
                raise DatabaseBusyError(_BUSY.format(self.location))
            if self._refusing:
                raise EndingError("the service is shutting down; nothing was written")
            self._writing = True
        try:
            with self._transaction(self._writer, "write", began) as connection:
                yield connection
        finally:
            with self._turn:
                self._writing = False
                self._turn.notify()

    def refuse_writes(self) -> None:
        """Let no write begin from now on: EndingError for those that wait. The one under way goes on."""
        with self._turn:
            self._refusing = True
            self._turn.notify_all()

    @contextmanager
    def _transaction(self, engine: sa.Engine, kind: str, began: float) -> Iterator[sa.Connection]:
        try:
            with engine.begin() as connection:
                if self.on_wait is not None:
                    self.on_wait(kind, perf_counter() - began)
                yield connection
        except sa.exc.DBAPIError as error:
            raise self._explained(error) from error

    def insert_rows(
        self, connection: sa.Connection, table: str, columns: Sequence[str], rows: Sequence[tuple[Any, ...]]
    ) -> None:
        """Insert rows into one of our own tables; they go past SQLAlchemy for speed."""
        if self.on_server:
            _postgres().copy_in(connection, table, columns, rows)
            return
        marks = ", ".join("?" * len(columns))
        connection.exec_driver_sql(f"INSERT INTO {table} ({', '.join(columns)}) VALUES ({marks})", list(rows))  # noqa: S608

    @contextmanager
    def plain(self) -> Iterator[sa.Connection]:
        """A connection outside any transaction, for statements that do not work inside one."""
        try:
            options = {"isolation_level": "AUTOCOMMIT"} if self.on_server else {}
            with self._engine.connect().execution_options(**{_BEGIN: ""}, **options) as connection:
                yield connection
        except sa.exc.DBAPIError as error:
            raise self._explained(error) from error

    def server_lock(self, owner: str) -> OneHolder:
        """The dispatcher's lock of a database on a server, for ``owner`` (a name for people)."""
        lock: OneHolder = _postgres().ServerLock(self.url, owner, BUSY_SECONDS)
        return lock

    def news(self) -> News | None:
        """What tells of changes at once; None where one has to look for them."""
        news: News | None = _postgres().News(self.url, BUSY_SECONDS) if self.on_server else None
        return news

    def _explained(self, error: sa.exc.DBAPIError) -> Exception:
        if self.on_server:
            return (_postgres().explained(error.orig, self.location) if error.orig else None) or error
        # SQLite reports all kinds of errors when the file and its log no longer belong together.
        try:
            self.require_same_file()
        except DatabaseError as moved:
            return moved
        if "malformed" in str(error.orig):
            self.damage = damaged(self.path)
        return explained(error, self.path)

    def close(self) -> None:
        """Close every connection."""
        self._engine.dispose()


def damaged(path: Path) -> str:
    """What is to be said of a damaged database."""
    return (
        f"the database {path} is damaged; `sprag db check` tells where: put the latest copy that `sprag db backup` "
        "wrote in its place"
    )


def _postgres() -> ModuleType:
    """The module for servers, whose driver is installed only where it is wanted."""
    try:
        from sprag.service.storage import postgres
    except ImportError:
        raise DatabaseError(
            "PostgreSQL needs a driver that is not installed: pip install 'sprag[postgres]'", "missing-extra"
        ) from None
    return postgres


def explained(error: sa.exc.DBAPIError, path: Path) -> Exception:
    """The error with one sentence for a user where its cause is outside the program, else the error itself."""
    text = str(error.orig)
    known = {
        "database is locked": DatabaseBusyError(_BUSY.format(path)),
        "database or disk is full": DatabaseFullError(f"the disk that holds {path} is full"),
        "disk I/O error": DatabaseFullError(f"the disk that holds {path} reports an error on reading or writing"),
        "readonly database": DatabaseError(
            f"the database {path} is read-only: `chmod u+w {path}`, and its folder too", "database-read-only"
        ),
        "unable to open database": DatabaseError(
            f"the database {path} cannot be opened; check the folder's rights", "database-unreachable"
        ),
        "file is not a database": DatabaseError(
            f"{path} is not a Sprag database; name another file with --db", "not-a-database"
        ),
        "malformed": DatabaseError(damaged(path), "database-damaged"),
    }
    return next((explanation for phrase, explanation in known.items() if phrase in text), error)


def _set_pragmas(connection: Any, _record: object) -> None:
    cursor = connection.cursor()
    for pragma in (
        f"busy_timeout = {int(BUSY_SECONDS * 1000)}",
        f"page_size = {PAGE_BYTES}",
        "journal_mode = WAL",
        "synchronous = FULL",
        "foreign_keys = ON",
    ):
        cursor.execute(f"PRAGMA {pragma}")
    cursor.close()


def _begin(connection: sa.Connection) -> None:
    # The driver never begins by itself (isolation_level None). A transaction that began as a reader could not become
    # a writer once another process has written in between, so writers take the lock at once.
    if statement := connection.get_execution_options().get(_BEGIN):
        connection.exec_driver_sql(statement)


def lock_of(session: Session, owner: str) -> OneHolder:
    """The dispatcher's lock of a database: a file beside an SQLite file, an advisory lock of a server."""
    return session.server_lock(owner) if session.on_server else DispatcherLock(session.path)
