"""The reserve: a file beside the database whose room is given up when a full disk would keep people from making it.

Opening a database needs some room, too, for the index of its log; without it nobody could make any after a restart.
"""

from __future__ import annotations

import os
from contextlib import suppress
from typing import TYPE_CHECKING, Final

from sprag_study.service.storage.database.private_files import create_private

if TYPE_CHECKING:
    from pathlib import Path

#: Size in bytes of the reserve file, and of what is left of it when studies were held on a full disk.
RESERVE_FILE_BYTES: Final = 2 * 1024 * 1024
REST_BYTES: Final = RESERVE_FILE_BYTES // 2
#: What an opening takes of it at a time: the index of the log has 32 KiB, a first page of the log 16 KiB.
OPENING_BYTES: Final = 128 * 1024


def _place(database: Path) -> Path:
    return database.with_name(f"{database.name}.reserve")


def keep_reserve(database: Path) -> None:
    """Create the reserve file for a full disk."""
    place = _place(database)
    with suppress(OSError):
        if place.stat().st_size >= RESERVE_FILE_BYTES:
            return
    with suppress(OSError), os.fdopen(create_private(place, flags=0), "r+b") as file:
        file.write(os.urandom(RESERVE_FILE_BYTES))  # a file of zeros could be sparse
        os.fsync(file.fileno())


def spend_share(database: Path) -> None:
    """Give up the share of the reserve that holding studies may use; the rest is left for people who make room."""
    with suppress(OSError):
        if (place := _place(database)).stat().st_size > REST_BYTES:
            os.truncate(place, REST_BYTES)


def spend(database: Path) -> None:
    """Give up all of it."""
    _place(database).unlink(missing_ok=True)


def spend_to_open(database: Path) -> bool:
    """Give up a part of the reserve for opening a database on a full disk; False where that cannot help."""
    try:
        disk = os.statvfs(database.parent)
        if disk.f_bavail * disk.f_frsize >= OPENING_BYTES or not (size := _place(database).stat().st_size):
            return False
        os.truncate(_place(database), max(size - OPENING_BYTES, 0))
    except OSError:
        return False
    return True
