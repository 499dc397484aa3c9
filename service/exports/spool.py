"""Files that cannot be written sequentially: built in a folder of their own, then read piece by piece."""

from __future__ import annotations

import errno
import os
import re
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from sprag_study.service.faults import FaultError
from sprag_study.service.stale_files import marked, sweep

_PREFIX: Final = "sprag-export-"
_PIECE: Final = 1 << 20
_NO_ROOM: Final = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG})
#: How libraries that hide the number of the error name it (HDF5: "errno = 28").
_NAMED: Final = re.compile(
    rf"\berrno = ({'|'.join(map(str, sorted(_NO_ROOM)))})\b|{re.escape(os.strerror(errno.ENOSPC))}"
)


def spooled(write: Callable[[Path], Path], folder: Path | None = None) -> Iterator[bytes]:
    """The bytes of the file that ``write`` creates in ``folder``, which its owner removes.

    By default it is a new folder, deleted with the last piece; those left behind by killed processes are removed.
    """
    if folder is not None:
        yield from _bytes_of(write(folder))
        return
    sweep(Path(tempfile.gettempdir()).glob(f"{_PREFIX}*"))
    with (
        tempfile.TemporaryDirectory(prefix=_PREFIX) as name,
        marked(Path(name)),
    ):
        yield from _bytes_of(write(Path(name)))


def _bytes_of(path: Path) -> Iterator[bytes]:
    with path.open("rb") as file:
        while piece := file.read(_PIECE):
            yield piece


def require_room(folder: Path, size: int) -> None:
    """Raise OSError where the disk of a folder has no room for a file of that many bytes.

    For libraries that do not survive a failing write: HDF5 ends its process.
    """
    reserve = folder / "reserve"
    descriptor = os.open(reserve, os.O_WRONLY | os.O_CREAT, 0o600)
    try:
        if hasattr(os, "posix_fallocate"):
            os.posix_fallocate(descriptor, 0, size)
        elif shutil.disk_usage(folder).free < size:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(folder))
    finally:
        os.close(descriptor)
        reserve.unlink()


@contextmanager
def room_required(folder: str) -> Iterator[None]:
    """Raise FaultError "storage-full" where what is written into a folder inside the context has no room."""
    try:
        yield
    except FaultError:
        raise
    except Exception as error:
        if not _lacks_room(error):
            raise
        detail = f"The folder for temporary files, {folder}, has no room for the file."
        raise FaultError("storage-full", detail) from error


def _lacks_room(error: BaseException) -> bool:
    """Whether a full disk, or a quota of one, is the cause of an error."""
    causes, seen = [error], set[int]()
    while causes:
        cause = causes.pop()
        seen.add(id(cause))
        if (isinstance(cause, OSError) and cause.errno in _NO_ROOM) or _NAMED.search(str(cause)):
            return True
        causes += [one for one in (cause.__cause__, cause.__context__) if one is not None and id(one) not in seen]
    return False
