"""Whether the file of an SQLite database has changed, without reading it."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, Final

from sprag_study.service.storage.database.sqlite_files import sqlite_driver

if TYPE_CHECKING:
    from pathlib import Path

#: Least seconds between two reports of a change: the commits of the dispatcher itself count as changes, too.
LEAST_SECONDS: Final = 0.1


class FileNews:
    """Changes committed by any other connection, of this process or another. Implements
    `sprag_study.worker.ports.News`.

    SQLite counts the commits that a connection has not made itself (``PRAGMA data_version``): asking takes
    microseconds, where reading the unfinished studies takes milliseconds.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._connection: Any = None
        self._version: int | None = None
        self._next = 0.0

    def wait(self, timeout: float) -> bool:
        """Whether something has or may have changed since it was last reported; waits at most ``timeout`` s.

        True at the first call, and where the file cannot be asked: reading it then says why.
        """
        if self._changed():
            return True
        if timeout <= 0.0:
            return False
        time.sleep(timeout)
        return self._changed()

    def _changed(self) -> bool:
        now = time.monotonic()
        if now < self._next:
            return False
        try:
            version = self._data_version()
        except sqlite_driver().Error:
            self.close()
            version = None
        if version is not None and version == self._version:
            return False
        self._version, self._next = version, now + LEAST_SECONDS
        return True

    def _data_version(self) -> int:
        if self._connection is None:
            # An absent file must not be created.
            uri = f"{self._path.as_uri()}?mode=rw"
            self._connection = sqlite_driver().connect(uri, uri=True, isolation_level=None)
            self._version = None
        cursor = self._connection.execute("PRAGMA data_version")
        version: int = cursor.fetchone()[0]
        cursor.close()
        return version

    def close(self) -> None:
        """Stop asking."""
        connection, self._connection = self._connection, None
        if connection is not None:
            connection.close()
