"""Selections of cases as bytes that are ready to be sent; the columns they need are read once and kept."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from threading import Lock
from typing import TYPE_CHECKING, Any, Final

from cachetools import LRUCache

from sprag.service.faults import refused
from sprag.service.jobs.column_files import ColumnFiles, default_folder
from sprag.service.jobs.reading import reading_of
from sprag.service.json_text import to_bytes
from sprag.service.results.explore import ExploreQuery, explore, explored_csv, explored_json, plan_of
from sprag.service.results.figures.explore import explore_figure
from sprag.service.results.figures.read import read_figure
from sprag.service.results.pictures import curves as pictures
from sprag.service.spec.design import points_spec
from sprag.service.spec.stored import accepted

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag.service.jobs.checks import Library
    from sprag.service.reading.reader import Choice
    from sprag.service.results.explore import Explored
    from sprag.service.storage.columns import RowColumns
    from sprag.service.storage.records import StudyRecord
    from sprag.service.storage.store import Store

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
        record = self._store.get_study(study_id)
        if record.finished_at is None or record.done <= LARGE:
            return self._in_memory(record, names)
        key = _key(record)
        found, missing = self._files.read(key, names)
        if found is not None and not missing:
            return found
        read = self._store.row_columns(study_id, missing)
        # A study that was run again since has other rows.
        if self._store.get_study(study_id).finished_at == record.finished_at:
            self._files.write(key, read)
        return read if found is None else replace(read, values={**found.values, **read.values})

    def waiting(self) -> list[str]:
        """Large ended studies, latest first, whose usual columns have no files yet."""
        found = self._store.ended_studies(LARGE, _AHEAD)
        return [record.id for record in found if not self._files.has(_key(record))]

    def _in_memory(self, record: StudyRecord, names: Sequence[str]) -> RowColumns:
        key = (record.id, record.revision)
        with self._lock:
            kept = self._kept.get(key)
        missing = [name for name in names if kept is None or name not in kept.values]
        if kept is not None and not missing:
            return kept
        read = self._store.row_columns(record.id, missing)
        # Rows that were added between the two readings belong to a later revision.
        if kept is not None and len(read.cases) == len(kept.cases):
            read = replace(read, values={**kept.values, **read.values})
        elif kept is not None:
            read = self._store.row_columns(record.id, list(names))
        with self._lock, suppress(ValueError):  # too large to be kept
            self._kept[key] = read
        return read


def _key(record: StudyRecord) -> str:
    """Name of the rows of an ended study: other ones are there only after it has run and ended again."""
    finished = record.finished_at.timestamp() if record.finished_at else 0.0
    return f"{record.id}-{finished * 1e6:.0f}-{record.done}"


def read_ahead(library: Library, study_id: str) -> None:
    """Read the columns that people see first; raises StudyNotFoundError."""
    study = library.store.study(study_id)
    library.columns.of(study_id, plan_of(study, ExploreQuery()).results)


def explored(library: Library, study_id: str, query: ExploreQuery) -> Explored:
    """The cases that a question selects; raises StudyNotFoundError, and SelectionError as `plan_of` does."""
    study = library.store.study(study_id)
    plan = plan_of(study, query)
    return explore(study, plan, library.columns.of(study_id, plan.results))


def selection_spec(library: Library, study_id: str, query: ExploreQuery) -> dict[str, Any]:
    """The spec of a study of the first rows; raises SelectionError where there are none, or nothing varies."""
    found = explored(library, study_id, query)
    cases = found.rows.cases[found.order].tolist()
    if not cases:
        raise refused("where", "empty", "no case is selected")
    try:
        return points_spec(accepted(library.store.spec(study_id), found.study), found.study, cases)
    except ValueError as error:
        raise refused("study", "nothing-varies", "no parameter of this study varies") from error


def explored_as_json(library: Library, study_id: str, query: ExploreQuery) -> bytes:
    """The selection as JSON text."""
    return to_bytes(explored_json(study_id, explored(library, study_id, query)))


def explore_picture(
    library: Library,
    study_id: str,
    query: ExploreQuery,
    x: str,
    y: str,
    choice: Choice,
    title: str,
    form: pictures.Picture,
) -> bytes:
    """Two quantities of all cases as a picture."""
    figure = explore_figure(explored(library, study_id, query), x, y)
    return pictures.draw_figure(read_figure(figure, reading_of(library.store, study_id, choice)), title, form)


def explored_as_csv(library: Library, study_id: str, query: ExploreQuery, choice: Choice) -> bytes:
    """The first rows as a table."""
    reading = reading_of(library.store, study_id, choice)
    return explored_csv(library.store.study(study_id), explored(library, study_id, query), reading)
