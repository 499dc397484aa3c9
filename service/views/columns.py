"""Columns of the rows of studies, which answers about many cases need: read once and kept."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from threading import Lock
from typing import TYPE_CHECKING, Final

from cachetools import LRUCache

from sprag_study.service.views.column_files import ColumnFiles, default_folder

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.storage.rows.columns import RowColumns
    from sprag_study.service.storage.store import Store
    from sprag_study.service.storage.studies.records import StudyRecord

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
