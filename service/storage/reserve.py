"""The reserve: a file beside the database whose room is given up when a full disk would keep people from making it.

Opening a database needs some room, too, for the index of its log; without it nobody could make any after a restart.
"""

from __future__ import annotations

import os
from contextlib import suppress
from functools import wraps
from typing import TYPE_CHECKING, Concatenate, Final, ParamSpec, TypeVar

from sprag.service.storage.errors import DatabaseFullError
from sprag.service.storage.private_files import create_private

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from sprag.service.storage.part import Part
    from sprag.service.storage.session import Session

_A = ParamSpec("_A")
_R = TypeVar("_R")
_P = TypeVar("_P", bound="Part")

#: Size in bytes of the reserve file, and of what is left of it when studies were held on a full disk.
RESERVE_FILE_BYTES: Final = 2 * 1024 * 1024
REST_BYTES: Final = RESERVE_FILE_BYTES // 2
#: What an opening takes of it at a time: the index of the log has 32 KiB, a first page of the log 16 KiB.
OPENING_BYTES: Final = 128 * 1024


def _place(database: Path) -> Path:
    return database.with_name(f"{database.name}.reserve")


def keep_reserve(session: Session) -> None:
    """Create the reserve file for a full disk; a server has to provide for that itself."""
    if session.on_server:
        return
    place = _place(session.path)
    with suppress(OSError):
        if place.stat().st_size >= RESERVE_FILE_BYTES:
            return
    with suppress(OSError), os.fdopen(create_private(place, flags=0), "r+b") as file:
        file.write(os.urandom(RESERVE_FILE_BYTES))  # a file of zeros could be sparse
        os.fsync(file.fileno())


def _renew_log(session: Session) -> None:
    """Let the write-ahead log begin anew where its pages find their place in the file: the next write needs no room.

    Before the reserve is spent, which the pages would take up.
    """
    with suppress(DatabaseFullError), session.plain() as connection:
        connection.exec_driver_sql("PRAGMA wal_checkpoint(PASSIVE)")


def _spend_share(session: Session) -> None:
    """Give up the share of the reserve that holding studies may use; the rest is left for people who make room."""
    with suppress(OSError):
        if (place := _place(session.path)).stat().st_size > REST_BYTES:
            os.truncate(place, REST_BYTES)


def _spend(session: Session) -> None:
    _place(session.path).unlink(missing_ok=True)


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


def holds(method: Callable[Concatenate[_P, _A], _R]) -> Callable[Concatenate[_P, _A], _R]:
    """A method, one write transaction, that holds studies: on a full disk it may use its share of the reserve."""
    return _with(method, _renew_log, _spend_share)


def makes_room(method: Callable[Concatenate[_P, _A], _R]) -> Callable[Concatenate[_P, _A], _R]:
    """A method, one write transaction, that is a step to more room: on a full disk it may use all of the reserve.

    What makes no room must not: the reserve is there once.
    """
    return _with(method, _renew_log, _spend_share, _spend)


def _with(
    method: Callable[Concatenate[_P, _A], _R], *gains: Callable[[Session], None]
) -> Callable[Concatenate[_P, _A], _R]:
    """The method, tried again after each of ``gains`` while the disk is full."""

    @wraps(method)
    def with_reserve(self: _P, /, *args: _A.args, **options: _A.kwargs) -> _R:
        for gain in gains:
            try:
                return method(self, *args, **options)
            except DatabaseFullError:
                if self.session.on_server:
                    raise
                gain(self.session)
        return method(self, *args, **options)

    return with_reserve
