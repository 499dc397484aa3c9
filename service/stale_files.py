"""What a killed process left behind: found by a lock that goes with its process, removed by the next one that comes."""

from __future__ import annotations

import fcntl
import os
import shutil
import time
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

#: Seconds for which nothing is stale: between its making and its lock a file looks like one.
YOUNG_SECONDS = 60.0


def mark(descriptor: int) -> None:
    """Mark an open file or folder as in use until it is closed, which the end of the process does."""
    with suppress(OSError):  # some file systems have no locks: nothing is swept there
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


@contextmanager
def marked(folder: Path) -> Iterator[None]:
    """Mark a folder as in use inside the context."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_CLOEXEC)
    try:
        mark(descriptor)
        yield
    finally:
        os.close(descriptor)


def sweep(candidates: Iterable[Path]) -> None:
    """Remove those of the files and folders that nobody uses any more; what cannot be removed stays, without a word."""
    for path in candidates:
        with suppress(OSError):
            _sweep(path)


def _sweep(path: Path) -> None:
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
