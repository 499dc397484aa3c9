"""Columns of large ended studies as files beside the database: mapped into memory instead of being read row by row.

They repeat what the database has, so they may be deleted at any time. A folder holds one study as it ended: ``case``,
``kind``, ``kinds.json`` and one file for each result, in numpy's format.
"""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Final

import numpy as np
import platformdirs

from sprag_study.service.stale_files import marked, sweep
from sprag_study.service.storage.database.private_files import PRIVATE_FOLDER_MODE
from sprag_study.service.storage.rows.columns import RowColumns

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

#: Bytes of all files together: eight results of thirty studies of a million cases. The least recently used go first.
MOST_BYTES: Final = 2_000_000_000
_PART: Final = ".part-"
_CASE, _KIND, _KINDS = "case.npy", "kind.npy", "kinds.json"


def default_folder() -> Path:
    """The folder of this user: ``$XDG_CACHE_HOME/sprag/columns`` on Linux."""
    return Path(platformdirs.user_cache_dir("sprag", appauthor=False)) / "columns"


class ColumnFiles:
    """Files of columns in a folder, of at most ``most`` bytes together; none where the folder cannot be written."""

    def __init__(self, folder: Path, most: int = MOST_BYTES) -> None:
        self._folder = folder
        self._most = most

    def read(self, key: str, names: Sequence[str]) -> tuple[RowColumns | None, list[str]]:
        """The columns of a study that are there, with those of ``names`` that have a file, and the other names."""
        own = self._folder / key
        try:
            kinds = tuple((str(ending), str(flags)) for ending, flags in json.loads((own / _KINDS).read_text("utf-8")))
            values = {name: _mapped(own / f"{name}.npy") for name in names if (own / f"{name}.npy").exists()}
            found = RowColumns(_mapped(own / _CASE), kinds, _mapped(own / _KIND), values)
            if any(array.shape != found.cases.shape for array in (found.kind, *values.values())):
                raise ValueError("columns of different lengths")
            os.utime(own)
        except (OSError, ValueError, EOFError, TypeError):  # none, or deleted meanwhile, or damaged
            shutil.rmtree(own, ignore_errors=True)
            return None, list(names)
        return found, [name for name in names if name not in values]

    def has(self, key: str) -> bool:
        """Whether there are columns of that study."""
        return (self._folder / key / _KINDS).exists()

    def write(self, key: str, rows: RowColumns) -> None:
        """Keep the columns of a study beside those that are there; failures are silent: the database has everything."""
        with suppress(OSError):
            self._folder.mkdir(mode=PRIVATE_FOLDER_MODE, parents=True, exist_ok=True)
            sweep(self._folder.glob(f"*{_PART}*"))
            own = self._folder / key
            part = Path(tempfile.mkdtemp(prefix=f"{key}{_PART}", dir=self._folder))
            try:
                with marked(part):
                    _fill(part, rows)
                    self._publish(part, own, rows)
            finally:
                shutil.rmtree(part, ignore_errors=True)
            self._trim(own)

    @staticmethod
    def _publish(part: Path, own: Path, rows: RowColumns) -> None:
        if not (own / _KINDS).exists():
            with suppress(OSError):  # another process was first
                part.rename(own)
                return
        for name in rows.values:
            (part / f"{name}.npy").replace(own / f"{name}.npy")

    def _trim(self, newest: Path) -> None:
        """Delete the least recently used studies beyond the limit."""
        folders = [path for path in self._folder.iterdir() if _PART not in path.name and path != newest]
        room = self._most - _size(newest)
        for path in sorted(folders, key=lambda path: path.stat().st_mtime, reverse=True):
            room -= _size(path)
            if room < 0:
                shutil.rmtree(path, ignore_errors=True)


def _fill(folder: Path, rows: RowColumns) -> None:
    arrays: dict[str, NDArray[Any]] = {_CASE: rows.cases, _KIND: rows.kind}
    arrays |= {f"{name}.npy": values for name, values in rows.values.items()}
    for name, values in arrays.items():
        with _lasting(folder / name) as file:
            np.save(file, values)
    with _lasting(folder / _KINDS) as file:
        file.write(json.dumps(rows.kinds).encode())


@contextmanager
def _lasting(path: Path) -> Iterator[BinaryIO]:
    """A new file to write: one whose name survives a power failure must have its content."""
    with path.open("xb") as file:
        yield file
        file.flush()
        os.fsync(file.fileno())


def _mapped(path: Path) -> NDArray[Any]:
    values: NDArray[Any] = np.load(path, mmap_mode="r", allow_pickle=False)
    return values


def _size(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.iterdir())
