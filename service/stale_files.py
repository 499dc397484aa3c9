"""Files left behind by killed processes: recognised by the missing lock of their process, removed by a later one."""

from __future__ import annotations

import os
import shutil
import time
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path
    from types import ModuleType

#: Minimum age of a stale file in s, because a new file is unlocked for a moment.
YOUNG_SECONDS = 60.0


def _locks() -> ModuleType | None:
    """The module for locks of files; None where there is none: nothing is marked there, and nothing removed."""
    try:
        import fcntl
    except ImportError:
        return None
    return fcntl


def mark(descriptor: int) -> None:
    """Mark an open file or folder as in use until it is closed, at the latest by the end of the process."""
    fcntl = _locks()
    if fcntl is None:
        return
    with suppress(OSError):  # some file systems have no locks; nothing is removed there
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


@contextmanager
def marked(folder: Path) -> Iterator[None]:
    """Mark a folder as in use inside the context."""
    if _locks() is None:
        yield
        return
    descriptor = os.open(folder, os.O_RDONLY | os.O_CLOEXEC)
    try:
        mark(descriptor)
        yield
    finally:
        os.close(descriptor)


def sweep(candidates: Iterable[Path]) -> None:
    """Remove the files and folders that are no longer in use; those that cannot be removed are silently kept."""
    fcntl = _locks()
    if fcntl is None:
        return
    for path in candidates:
        with suppress(OSError):
            _sweep(path, fcntl)


def _sweep(path: Path, fcntl: ModuleType) -> None:
    descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK)
    try:
        found = os.fstat(descriptor)
        if found.st_uid != os.getuid() or time.time() - found.st_mtime < YOUNG_SECONDS:
            return
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink()
    finally:
        os.close(descriptor)
