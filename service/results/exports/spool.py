"""Files that cannot be written sequentially: built in a folder of their own, then read piece by piece."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

from sprag.service.stale_files import marked, sweep

_PREFIX: Final = "sprag-export-"
_PIECE: Final = 1 << 20


def spooled(write: Callable[[Path], Path]) -> Iterator[bytes]:
    """The bytes of the file that ``write`` creates in the given folder; the folder is deleted with the last piece.

    Folders left behind by killed processes are removed.
    """
    sweep(Path(tempfile.gettempdir()).glob(f"{_PREFIX}*"))
    with (
        tempfile.TemporaryDirectory(prefix=_PREFIX) as folder,
        marked(Path(folder)),
        write(Path(folder)).open("rb") as file,
    ):
        while piece := file.read(_PIECE):
            yield piece
