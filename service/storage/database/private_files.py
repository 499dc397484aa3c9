"""Files that only their owner may read: they contain token digests, the session key, and designs."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from pathlib import Path

PRIVATE_MODE: Final = 0o600
PRIVATE_FOLDER_MODE: Final = 0o700
#: Permission bits of group and others.
_OTHERS: Final = 0o077


def create_private(path: Path, flags: int = os.O_EXCL) -> int:
    """Create a file that only its owner may read, whatever the umask; returns a descriptor for reading and writing.

    Raises OSError, FileExistsError when the file exists and ``flags`` has ``O_EXCL``.
    """
    return os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | flags, PRIVATE_MODE)


def readable_by_others(path: Path) -> bool:
    """Whether the group or others have any permission for the file."""
    return bool(path.stat().st_mode & _OTHERS)


def sync_folder(folder: Path) -> None:
    """Flush the directory ``folder`` to disk, so that a file renamed into it survives a power failure."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
