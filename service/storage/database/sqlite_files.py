"""The file of an SQLite database: its library, its place, its pragmas, and one sentence for whatever fails."""

from __future__ import annotations

import os
from contextlib import suppress
from itertools import chain
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa

from sprag_study.service.storage.database.blocks import tuples
from sprag_study.service.storage.database.one_name import HeldName, hold, linked
from sprag_study.service.storage.database.private_files import PRIVATE_FOLDER_MODE, create_private
from sprag_study.service.storage.database.reserve import spend_to_open
from sprag_study.service.storage.errors import (
    CREATED_BY,
    DatabaseBusyError,
    DatabaseError,
    DatabaseFullError,
    busy,
    in_use,
)
from sprag_study.worker.ports import StoreError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sqlalchemy.engine import URL

    from sprag_study.service.storage.database.blocks import Block, Target

#: Older libraries can corrupt a write-ahead log that several connections share.
SAFE_SQLITE: Final = (3, 51, 3)
#: Rows have about 45 to 150 numbers; pages larger than SQLite's 4 KiB hold several rows and keep the trees flat.
PAGE_BYTES: Final = 16_384
NETWORK_FILE_SYSTEMS: Final = frozenset(
    {"afs", "ceph", "cifs", "fuse.sshfs", "glusterfs", "nfs", "nfs4", "smb3", "smbfs"}
)


def sqlite_driver() -> Any:
    """The DB-API module for SQLite: pysqlite3, which includes its own library, otherwise Python's own."""
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
    """A warning when the SQLite library is older than the first safe version, otherwise None."""
    version = sqlite_version()
    if version >= SAFE_SQLITE:
        return None
    found, wanted = (".".join(map(str, numbers)) for numbers in (version, SAFE_SQLITE))
    return f"SQLite {found} is in use; versions before {wanted} can corrupt a database under load: install pysqlite3."


def file_system_of(path: Path, mounts: str | None = None) -> str:
    """Type of the file system that holds ``path``, as in Linux's mount table; "" where it is unknown."""
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


def _path_of(url: URL) -> Path:
    if url.query:
        raise DatabaseError(f"an SQLite URL takes no options ({', '.join(sorted(url.query))})", "invalid-database-url")
    if url.database in (None, "", ":memory:"):
        raise DatabaseError("the database must be a file: several processes work on it", "invalid-database-url")
    return Path(str(url.database)).absolute()


class DatabaseFile:
    """One database file, which is never another one than the file that was opened first.

    Without ``create`` it has to be there. ``alone``: on one connection, which nobody else may have beside it.

    Raises DatabaseError for a URL that is not understood, and where the place cannot hold a database.
    """

    def __init__(self, url: URL, busy_seconds: float, *, create: bool = True, alone: bool = False) -> None:
        self._may_create = create
        self._alone = alone
        self._given = _path_of(url)
        #: The file itself, where the given name is a symbolic link.
        self.path = Path(os.path.realpath(self._given))
        self._url = url.set(database=str(self.path))
        self._busy_seconds = busy_seconds
        self._name: HeldName | None = None
        self._naming = Lock()
        #: Device and number of the file that was opened first.
        self._first: tuple[int, int] | None = None
        #: Why the database can no longer be trusted; None while nothing wrong was found.
        self.damage: str | None = None
        self._check_place()

    def make_engine(self, connections: int) -> sa.Engine:
        """Connections to the file, which is created at the first of them."""
        engine = sa.create_engine(
            self._url,
            module=sqlite_driver(),
            connect_args={"timeout": self._busy_seconds, "isolation_level": None},
            pool_size=1 if self._alone else connections,
            max_overflow=0 if self._alone else 64,
        )
        sa.event.listen(engine, "do_connect", self._create)
        sa.event.listen(engine, "connect", self._prepare)
        return engine

    def _check_place(self) -> None:
        folder = self.path.parent
        if not self._may_create:
            self._require_present()
        try:
            folder.mkdir(PRIVATE_FOLDER_MODE, parents=True, exist_ok=True)
        except OSError as error:
            raise DatabaseError(f"the folder {folder} cannot be created: {error.strerror}", "write-failed") from None
        if self.path.is_dir():
            raise DatabaseError(f"{self.path} is a folder, not a database file", "not-a-database")
        if not os.access(folder, os.W_OK):
            raise DatabaseError(
                f"the folder {folder} is read-only, and the database needs to write beside its file: "
                f"`chmod u+w {folder}`, or name another place with --db",
                "database-read-only",
            )
        kind = file_system_of(self.path)
        if kind in NETWORK_FILE_SYSTEMS:
            raise DatabaseError(
                f"{self.path} lies on a network file system ({kind}), which cannot hold a database safely: "
                "name a file on a local disk with --db",
                "unsupported-database",
            )

    def _create(self, *_: object) -> None:
        """Create the database file before SQLite does, which would let others read it; the log gets the same rights.

        Raises DatabaseError where the file opened first is gone: it is never replaced by an empty one. And where
        somebody uses it under another name.
        """
        self.require_same()
        if not self._may_create:
            self._require_present()
        with suppress(OSError):  # it exists, or SQLite reports the error
            os.close(create_private(self.path))
        with self._naming:
            if self._name is None:
                self._name = hold(self.path)
                self._note()

    def _require_present(self) -> None:
        if not self.path.exists():
            raise DatabaseError(f"there is no database {self.path}: {CREATED_BY}", "database-unreachable")

    def _prepare(self, connection: Any, _record: object) -> None:
        """Set a new connection up; on a full disk, with room of the reserve."""
        while True:
            try:
                self._set_pragmas(connection)
            except sqlite_driver().OperationalError:
                if not spend_to_open(self.path):
                    raise
            else:
                return

    def _set_pragmas(self, connection: Any) -> None:
        cursor = connection.cursor()
        for pragma in (
            f"busy_timeout = {0 if self._alone else int(self._busy_seconds * 1000)}",
            # Before the first look at the file: then not even a reader may have it open.
            f"locking_mode = {'EXCLUSIVE' if self._alone else 'NORMAL'}",
            f"page_size = {PAGE_BYTES}",
            "journal_mode = WAL",
            "synchronous = FULL",
            "foreign_keys = ON",
        ):
            cursor.execute(f"PRAGMA {pragma}")
        cursor.close()

    def _note(self) -> None:
        if self._first is None:
            with suppress(OSError):
                found = self.path.stat()
                self._first = found.st_dev, found.st_ino

    def second_name(self) -> DatabaseError | None:
        """The error of a file that has got another name (a hard link) while it was in use; None for one name."""
        try:
            names = self.path.stat().st_nlink
        except OSError:
            return None
        return linked(self.path, names) if names > 1 else None

    def close(self) -> None:
        """Give the name of the file up; every connection is closed by then."""
        with self._naming:
            held, self._name = self._name, None
        if held is not None:
            held.release()

    def require_same(self) -> None:
        """Raise DatabaseError when the file is not the one that was opened: what is written would be lost with it."""
        if self._first is None:
            return
        try:
            found = self._given.stat()
        except OSError:
            raise DatabaseError(
                f"the database file {self.path} was deleted or moved while it was in use: stop Sprag, put the file or "
                "a backup in its place, and start again",
                "database-replaced",
            ) from None
        if self._first != (found.st_dev, found.st_ino):
            raise DatabaseError(
                f"the database file {self.path} was replaced while it was in use: stop Sprag, delete the files beside "
                "it that end in -wal and -shm if it is a backup, and start again",
                "database-replaced",
            )

    def can_write(self, seconds: float) -> bool:
        """Whether a write transaction could begin within ``seconds``. Raises DatabaseError."""
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
            found = self.explained(sa.exc.DBAPIError("", None, error))
            if isinstance(found, DatabaseBusyError):
                return False
            raise (found if isinstance(found, StoreError) else DatabaseError(str(error))) from error
        return True

    def explained(self, error: sa.exc.DBAPIError | UnicodeDecodeError) -> Exception:
        """A DatabaseError with one sentence where the cause is external, otherwise the error itself."""
        # SQLite reports all kinds of errors when the file and its log no longer belong together.
        try:
            self.require_same()
        except DatabaseError as moved:
            return moved
        text = error.object.decode(errors="replace") if isinstance(error, UnicodeDecodeError) else str(error.orig)
        known = {
            "database is locked": in_use(str(self.path)) if self._alone else busy(str(self.path)),
            "database or disk is full": DatabaseFullError(f"the disk that holds {self.path} is full"),
            "disk I/O error": DatabaseFullError(
                f"the disk that holds {self.path} reports an error on reading or writing"
            ),
            "readonly database": DatabaseError(
                f"the database {self.path} is read-only: `chmod u+w {self.path}`, and its folder too",
                "database-read-only",
            ),
            "unable to open database": DatabaseError(
                f"the database {self.path} cannot be opened; check the folder's rights", "database-unreachable"
            ),
            "Could not decode": DatabaseError(
                f"a text in the database {self.path} changed on the disk; `sprag admin db check` tells where",
                "database-damaged",
            ),
            "file is not a database": DatabaseError(
                f"{self.path} is not a Sprag database; name another file with --db", "not-a-database"
            ),
        }
        if any(phrase in text for phrase in ("malformed", "foreign key mismatch", "no such column")):
            return self.damaged()
        return next((explanation for phrase, explanation in known.items() if phrase in text), error)

    def damaged(self) -> DatabaseError:
        """The error of a database that is damaged, which is not trusted any more from now on."""
        self.damage = (
            f"the database {self.path} is damaged; `sprag admin db check` tells where: put the latest copy that "
            "`sprag admin db backup` wrote in its place"
        )
        return DatabaseError(self.damage, "database-damaged")


def insert_blocks(connection: sa.Connection, place: Target, blocks: Iterable[Block]) -> None:
    """Insert rows; the driver takes one after the other, so that they are never all in memory as Python's numbers.

    Raises sqlalchemy.exc.DBAPIError.
    """
    marks = ", ".join("?" * len(place.columns))
    statement = f"INSERT INTO {place.table} ({', '.join(place.columns)}) VALUES ({marks})"  # noqa: S608
    driver = connection.connection.driver_connection
    assert driver is not None
    try:
        driver.executemany(statement, chain.from_iterable(map(tuples, blocks)))
    except sqlite_driver().Error as error:
        raise sa.exc.DBAPIError(statement, None, error) from error
