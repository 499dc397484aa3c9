"""A database file in use has one name: a lock on the file itself tells every process under which.

The log of an SQLite database lies beside its file and is found by the file's name. Processes that use two names for one
file would each have a log of their own, and destroy the database. So whoever opens it locks a byte of the file (far
behind its end) that stands for the name, shared with all others of that name, and looks for locks on other bytes. The
locks belong to an open file, not to a process (``F_OFD_SETLK``), and the system releases them when the process ends.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import struct
import threading
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from sprag_study.service.storage.errors import DatabaseError

if TYPE_CHECKING:
    from pathlib import Path

#: The bytes that stand for names: they begin far behind any byte that SQLite reads, writes or locks.
_FIRST: Final = 1 << 62
_NAMES: Final = 1 << 48
#: Linux's ``struct flock``: type, base of the offset, offset, length, process.
_FLOCK: Final = struct.Struct("hhqqi4x")
#: Absent outside Linux, where only links are refused.
_SET: Final[int | None] = getattr(fcntl, "F_OFD_SETLK", None)
_GET: Final[int | None] = getattr(fcntl, "F_OFD_GETLK", None)


@dataclass(slots=True)
class _Opened:
    """A file that this process has open for its locks, and how many sessions need it."""

    descriptor: int
    sessions: int = 0


#: By device and number of the file. A descriptor is closed with the last session of its file and not before: closing
#: any descriptor of a file drops all locks that SQLite has on it in this process.
_OPENED: Final[dict[tuple[int, int], _Opened]] = {}
_GUARD: Final = threading.Lock()
#: Files whose sessions have ended. The garbage collector may close a session anywhere, inside of `hold` too, where it
#: must not wait for the lock that its own thread has: whoever has the lock next gives these up.
_ENDED: Final[deque[tuple[int, int]]] = deque()


class HeldName:
    """A name under which a session uses a database file, from `hold` until `release`."""

    def __init__(self, file: tuple[int, int]) -> None:
        self._file = file

    def release(self) -> None:
        """Give the name up; all connections of the session are closed by then. Never waits."""
        _ENDED.append(self._file)
        _give_up()


def _give_up() -> None:
    """Give the names of ended sessions up, unless somebody has the lock, who does it afterwards."""
    while _ENDED and _GUARD.acquire(blocking=False):
        try:
            while _ENDED:
                file = _ENDED.popleft()
                opened = _OPENED[file]
                opened.sessions -= 1
                if not opened.sessions:
                    del _OPENED[file]
                    os.close(opened.descriptor)
        finally:
            _GUARD.release()


def hold(path: Path) -> HeldName | None:
    """Hold the name ``path`` (absolute, without symbolic links) of a file; None where it cannot be opened.

    Raises DatabaseError for a file with several names, and where a process uses it under another one.
    """
    try:
        with _GUARD:
            held, used = _held(path)
    finally:
        _give_up()
    if held is not None and used:
        held.release()
        raise DatabaseError(
            f"another process uses the database {path} under another name (it was moved, or its file is mounted "
            "elsewhere), and two names destroy a database: stop that process, or use the other name",
            "database-in-use",
        )
    return held


def _held(path: Path) -> tuple[HeldName | None, bool]:
    """The name, and whether another process uses the file under another one; with the lock."""
    try:
        status = path.stat()
        if status.st_nlink > 1:
            raise linked(path, status.st_nlink)
        file = status.st_dev, status.st_ino
        opened = _OPENED.get(file) or _Opened(os.open(path, os.O_RDONLY | os.O_CLOEXEC))
        place = _place_of(path)
    except OSError:  # SQLite reports what is wrong
        return None, False
    _OPENED[file] = opened
    opened.sessions += 1
    held = HeldName(file)
    _lock(opened.descriptor, place)
    used = any(
        _is_locked(opened.descriptor, first, length)
        for first, length in ((0, place), (place + 1, _NAMES - place - 1))
        if length
    )
    return held, used


def linked(path: Path, names: int) -> DatabaseError:
    """The error of a file that has several names."""
    return DatabaseError(
        f"the database file {path} has {names} names (hard links), and used under two it is destroyed: keep one "
        f"of them (`find DIRECTORY -samefile {path}` lists them); a copy is made by `sprag admin db backup`",
        "unsupported-database",
    )


def _place_of(path: Path) -> int:
    """The byte of a name. A folder may have several names itself, such as in containers: its number counts."""
    name = f"{path.parent.stat().st_ino}/{path.name}"
    return int.from_bytes(hashlib.blake2b(name.encode(errors="surrogateescape"), digest_size=8).digest()) % _NAMES


def _lock(descriptor: int, place: int) -> None:
    if _SET is not None:
        with suppress(OSError):  # a file system without such locks
            fcntl.fcntl(descriptor, _SET, _FLOCK.pack(fcntl.F_RDLCK, os.SEEK_SET, _FIRST + place, 1, 0))


def _is_locked(descriptor: int, first: int, length: int) -> bool:
    """Whether any other process has locked one of these bytes."""
    if _GET is None:
        return False
    wanted = _FLOCK.pack(fcntl.F_WRLCK, os.SEEK_SET, _FIRST + first, length, 0)
    with suppress(OSError):
        return bool(_FLOCK.unpack(fcntl.fcntl(descriptor, _GET, wanted))[0] != fcntl.F_UNLCK)
    return False
