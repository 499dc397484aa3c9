"""The lock that admits one dispatcher at a time to a database; it is released when its process ends in any way."""

from __future__ import annotations

import fcntl
import os
import select
import signal
import socket
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Final, Protocol

from sprag_study.service.storage.database.private_files import create_private
from sprag_study.worker.pool.process_table import start_time

if TYPE_CHECKING:
    from collections.abc import Set as AbstractSet

#: Seconds to wait for a killed process to exit.
_KILL_SECONDS: Final = 10.0


class Presence(Protocol):
    """The dispatchers at work on a database that admits several; each has a lock of its own while it lives."""

    def enter(self, epoch: int) -> None:
        """Be present as the dispatcher of this epoch until the connection ends or `release`."""

    def present(self) -> AbstractSet[int]:
        """Epochs of the dispatchers that are present. Raises DatabaseError when our own presence was lost."""


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
        self._file = file
        note = f"{os.getpid()} {start_time(os.getpid()) or ''} {socket.gethostname()}\n".encode()
        with suppress(OSError):  # full disk: the lock holds without its note; an old one has room for it
            os.pwrite(file, note, 0)
            os.ftruncate(file, len(note))
        return True

    def seize(self) -> None:
        """Take the lock from whoever has it, which only the epoch then keeps from the database.

        The file is replaced, so that the old holder keeps a lock on nothing and the next one finds ours.
        """
        while not self.take():
            self.path.unlink(missing_ok=True)

    def holder(self) -> str:
        """Process id of whoever took the lock last, "" where nobody did."""
        return self._noted().partition(" ")[0]

    def _noted(self) -> str:
        try:
            return self.path.read_text(encoding="ascii", errors="replace").strip()
        except OSError:
            return ""

    def end_holder(self) -> bool:
        """End the process that has the lock, at once, where it runs on this host; whether it was ended.

        A process is ended only if it is the very one that took the lock: its id may be another's by now, so the time of
        its start must be the same, too.
        """
        pid, start, host = [*self._noted().split(" "), "", "", ""][:3]
        if host != socket.gethostname() or not (pid.isdecimal() and start.isdecimal()) or int(pid) == os.getpid():
            return False
        try:
            process = os.pidfd_open(int(pid))  # from here on the id cannot become another's
        except (AttributeError, OSError):
            return False
        try:
            if start_time(int(pid)) != int(start):
                return False
            signal.pidfd_send_signal(process, signal.SIGKILL)
            return bool(select.select([process], [], [], _KILL_SECONDS)[0])
        except OSError:
            return False
        finally:
            os.close(process)

    def release(self) -> None:
        """Release the lock."""
        if self._file is not None:
            os.close(self._file)
            self._file = None
