"""Columns of the rows of studies, which answers about many cases need: read once and kept."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any, BinaryIO, Final

import numpy as np
import platformdirs
from cachetools import LRUCache

from sprag_study.service.stale_files import marked, sweep
from sprag_study.service.storage.database.private_files import PRIVATE_FOLDER_MODE
from sprag_study.service.storage.rows.columns import RowColumns

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from sprag_study.service.storage.rows.columns import RowColumns
    from sprag_study.service.storage.store import Store
    from sprag_study.service.storage.studies.records import StudyRecord

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


#: Bytes of columns kept in the memory of a process, of all studies together: those of a study that runs, or is small.
_KEPT: Final = 32_000_000
#: Cases above which the columns of an ended study are kept in files.
LARGE: Final = 20_000
#: Ended large studies, the latest ones, whose columns are read before anybody asks.
_AHEAD: Final = 10


class Columns:
    """Columns of studies, each read once until the study has other rows: for 10^6 cases that takes seconds.

    Those of large ended studies are kept in ``files``, for all processes and beyond their end; others in memory.
    """

    def __init__(self, store: Store, files: ColumnFiles | None = None) -> None:
        self._store = store
        self._files = files or ColumnFiles(default_folder())
        self._lock = Lock()
        self._kept: LRUCache[tuple[str, int], RowColumns] = LRUCache(
            _KEPT, getsizeof=lambda rows: 1_000 + len(rows.cases) * (12 + 8 * len(rows.values))
        )

    def of(self, study_id: str, names: Sequence[str]) -> RowColumns:
        """The rows of a study with at least these results; raises StudyNotFoundError."""
        record = self._store.studies.get(study_id)
        if record.finished_at is None or record.done <= LARGE:
            return self._in_memory(record, names)
        key = _key(record)
        found, missing = self._files.read(key, names)
        if found is not None and not missing:
            return found
        read = self._store.rows.columns(study_id, missing)
        # A study that was run again since has other rows.
        if self._store.studies.get(study_id).finished_at == record.finished_at:
            self._files.write(key, read)
        return read if found is None else replace(read, values={**found.values, **read.values})

    def waiting(self) -> list[str]:
        """Large ended studies, latest first, whose usual columns have no files yet."""
        found = self._store.studies.ended(LARGE, _AHEAD)
        return [record.id for record in found if not self._files.has(_key(record))]

    def _in_memory(self, record: StudyRecord, names: Sequence[str]) -> RowColumns:
        key = (record.id, record.revision)
        with self._lock:
            kept = self._kept.get(key)
        missing = [name for name in names if kept is None or name not in kept.values]
        if kept is not None and not missing:
            return kept
        read = self._store.rows.columns(record.id, missing)
        # Rows that were added between the two readings belong to a later revision.
        if kept is not None and len(read.cases) == len(kept.cases):
            read = replace(read, values={**kept.values, **read.values})
        elif kept is not None:
            read = self._store.rows.columns(record.id, list(names))
        with self._lock, suppress(ValueError):  # too large to be kept
            self._kept[key] = read
        return read


def _key(record: StudyRecord) -> str:
    """Name of the rows of an ended study: other ones are there only after it has run and ended again."""
    finished = record.finished_at.timestamp() if record.finished_at else 0.0
    return f"{record.id}-{finished * 1e6:.0f}-{record.done}"
