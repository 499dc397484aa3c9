"""The lock that lets one dispatcher at a time work on a database: it goes with its process, however that ends."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from service.storage.private_files import create_private

if TYPE_CHECKING:
    from service.storage.session import Session


class OneHolder(Protocol):
    """Held by at most one process; it goes with that process."""

    def take(self) -> bool:
        """Take the lock if it is free; True when it is ours."""

    def seize(self) -> None:
        """Take the lock from whoever has it, which only the epoch then keeps from the database."""

    def holder(self) -> str:
        """Whoever took the lock last, "" where nobody did."""

    def release(self) -> None:
        """Give the lock up."""


def lock_of(session: Session, owner: str) -> OneHolder:
    """The dispatcher's lock of a database: a file beside an SQLite file, an advisory lock of a server."""
    return session.server_lock(owner) if session.on_server else DispatcherLock(session.path)


class DispatcherLock:
    """An advisory lock on a file beside the database at ``database``."""

    def __init__(self, database: Path) -> None:
        self.path = database.with_name(f"{database.name}.lock")
        self._file: int | None = None

    def take(self) -> bool:
        """Take the lock if it is free; True when it is ours."""
        if self._file is not None:
            return True
        file = create_private(self.path, flags=0)
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(file)
            return False
        os.ftruncate(file, 0)
        os.write(file, f"{os.getpid()}\n".encode())
        self._file = file
        return True

    def seize(self) -> None:
        """Take the lock from whoever has it, which only the epoch then keeps from the database.

        The file is replaced, so that the old holder keeps a lock on nothing and the next one finds ours.
        """
        while not self.take():
            self.path.unlink(missing_ok=True)

    def holder(self) -> str:
        """Process id of whoever took the lock last, "" where nobody did."""
        try:
            return self.path.read_text(encoding="ascii").strip()
        except OSError:
            return ""

    def release(self) -> None:
        """Give the lock up."""
        if self._file is not None:
            os.close(self._file)
            self._file = None
