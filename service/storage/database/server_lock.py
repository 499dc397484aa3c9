"""Advisory locks of a PostgreSQL server by which dispatchers know of each other."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

import psycopg

from sprag_study.service.storage.database.postgres import (
    CHORES,
    EPOCHS,
    LOCKS,
    LOST_SECONDS,
    USERS,
    WRITER,
    connect,
    explained,
    location,
)
from sprag_study.service.storage.errors import DatabaseError

if TYPE_CHECKING:
    from collections.abc import Collection

    from sqlalchemy.engine import URL

#: Granted locks of this database of one kind (first key).
_HELD: Final = (
    "FROM pg_locks AS l JOIN pg_stat_activity AS a ON a.pid = l.pid "
    "WHERE l.locktype = 'advisory' AND l.granted AND l.classid = %s::oid "
    "AND l.database = (SELECT oid FROM pg_database WHERE datname = current_database())"
)


class ServerLock:
    """The presence of one dispatcher among others, on a connection of its own.

    The server releases its locks when that connection ends: at once when the process is killed, after about
    `LOST_SECONDS` when its host or its link is gone. A dispatcher that has lost its connection ends itself when it
    notices; until then its epoch, which others have ended, keeps it from writing.
    """

    def __init__(self, url: URL, owner: str, lock_seconds: float) -> None:
        self._url = url
        self._owner = owner
        self._lock_seconds = lock_seconds
        self._connection: psycopg.Connection[Any] | None = None
        self._shared = False
        self._epoch: int | None = None

    def take(self) -> bool:
        """Whether dispatchers may be at work; False while somebody has the database alone. Raises DatabaseError."""
        return self._shared or self._try("pg_try_advisory_lock_shared", LOCKS, USERS, keep=True)

    def take_alone(self) -> bool:
        """Keep dispatchers off the database until `release`; False while any is at work. Raises DatabaseError."""
        return self._try("pg_try_advisory_lock", LOCKS, USERS)

    def holder(self) -> str:
        """Names of those who keep others off the database or are at work on it."""
        rows = self._ask(f"SELECT DISTINCT a.application_name {_HELD} AND l.objid = %s::oid", LOCKS, USERS)
        return ", ".join(sorted(str(name) for (name,) in rows))

    def clients(self) -> list[str]:
        """Process ids of the server's other connections to this database by Sprag. Raises DatabaseError."""
        statement = (
            "SELECT pid::text FROM pg_stat_activity WHERE datname = current_database() AND pid <> pg_backend_pid() "
            "AND (application_name = 'sprag' OR pid IN (SELECT pid FROM pg_locks WHERE locktype = 'advisory' "
            "AND classid IN (%s::oid, %s::oid))) ORDER BY pid"
        )
        return [f"connection {pid}" for (pid,) in self._ask(statement, LOCKS, EPOCHS)]

    def _try(self, function: str, kind: int, purpose: int, *, keep: bool = False) -> bool:
        done = bool(self._ask(f"SELECT {function}(%s::int, %s::int)", kind, purpose)[0][0])
        self._shared = self._shared or (done and keep)
        return done

    def enter(self, epoch: int) -> None:
        """Be present as the dispatcher of this epoch. Raises DatabaseError."""
        if not self._try("pg_try_advisory_lock", EPOCHS, epoch):
            raise DatabaseError(f"the lock of epoch {epoch} is taken by another process", "database-busy")
        self._epoch = epoch

    def present(self) -> frozenset[int]:
        """Epochs of the dispatchers that are present. Raises DatabaseError when our connection was lost."""
        found = frozenset(epoch for (epoch,) in self._ask(f"SELECT l.objid::int {_HELD}", EPOCHS))
        if self._epoch is not None and self._epoch not in found:
            raise DatabaseError(
                f"the connection to {location(self._url)} by which others know of this worker was lost",
                "database-unreachable",
            )
        return found

    def take_chores(self) -> bool:
        """Whether the work that is done once for all dispatchers is this one's: until its connection ends."""
        return self._try("pg_try_advisory_lock", LOCKS, CHORES)

    def end(self, epochs: Collection[int]) -> None:
        """End the connections of the dispatchers of these epochs, which are then absent.

        Raises DatabaseError when the server does not permit this user to do so.
        """
        ending = f"SELECT pg_terminate_backend(a.pid, {LOST_SECONDS * 1000}) {_HELD} AND l.objid = ANY(%s::oid[])"
        self._ask(ending, EPOCHS, list(epochs))

    def end_writer(self) -> bool:
        """End the connection of a hung process whose transaction blocks all writers; whether there was one."""
        frozen = "AND a.state LIKE 'idle in transaction%%' AND clock_timestamp() - a.state_change > interval '1 s'"
        ending = f"SELECT pg_terminate_backend(a.pid, {LOST_SECONDS * 1000}) {_HELD} AND l.objid = %s::oid {frozen}"
        return bool(self._ask(ending, LOCKS, WRITER))

    def _ask(self, statement: str, *values: object) -> list[tuple[Any, ...]]:
        if self._connection is None:
            self._connection = connect(self._url, self._lock_seconds, self._owner)
        try:
            return self._connection.execute(statement.encode(), values).fetchall()
        except psycopg.Error as error:
            self.release()
            raise explained(error, location(self._url)) or error from None

    def release(self) -> None:
        """Release all locks; never fails."""
        connection, self._connection, self._shared = self._connection, None, False
        if connection is not None:
            with suppress(psycopg.Error):  # takes effect now; the server notices the end of a connection a little later
                connection.execute("SELECT pg_advisory_unlock_all()")
            with suppress(psycopg.Error):
                connection.close()
