"""Selections of cases as bytes that are ready to be sent; the columns they need are read once and kept."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from threading import Lock
from typing import TYPE_CHECKING, Final

from cachetools import LRUCache

from sprag.service.json_text import to_bytes
from sprag.service.results.explore import explore, explored_csv, explored_json, plan_of
from sprag.service.results.figures.explore import explore_figure
from sprag.service.results.pictures import curves as pictures

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag.service.jobs.checks import Library
    from sprag.service.results.explore import Explored, ExploreQuery
    from sprag.service.storage.columns import RowColumns
    from sprag.service.storage.store import Store

#: Bytes of columns that are kept, of all studies together: ten results of a million cases, and more.
_KEPT: Final = 256_000_000


class Columns:
    """Columns of studies, each read once until the study has other rows; reading takes some seconds for 10^6 cases."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._lock = Lock()
        self._kept: LRUCache[tuple[str, int], RowColumns] = LRUCache(
            _KEPT, getsizeof=lambda rows: 1_000 + len(rows.cases) * (12 + 8 * len(rows.values))
        )

    def of(self, study_id: str, names: Sequence[str]) -> RowColumns:
        """The rows of a study with at least these results; raises StudyNotFoundError."""
        key = (study_id, self._store.get_study(study_id).revision)
        with self._lock:
            kept = self._kept.get(key)
        missing = [name for name in names if kept is None or name not in kept.values]
        if kept is not None and not missing:
            return kept
        read = self._store.row_columns(study_id, missing)
        # Rows that were added between the two readings belong to a later revision.
        if kept is not None and len(read.cases) == len(kept.cases):
            read = replace(read, values={**kept.values, **read.values})
        elif kept is not None:
            read = self._store.row_columns(study_id, list(names))
        with self._lock, suppress(ValueError):  # too large to be kept
            self._kept[key] = read
        return read


def explored(library: Library, study_id: str, query: ExploreQuery) -> Explored:
    """The cases that a question selects; raises StudyNotFoundError, and SelectionError as `plan_of` does."""
    study = library.store.study(study_id)
    plan = plan_of(study, query)
    return explore(study, plan, library.columns.of(study_id, plan.results))


def explored_as_json(library: Library, study_id: str, query: ExploreQuery) -> bytes:
    """The selection as JSON text."""
    return to_bytes(explored_json(study_id, explored(library, study_id, query)))


def explore_picture(
    library: Library, study_id: str, query: ExploreQuery, x: str, y: str, title: str, form: pictures.Picture
) -> bytes:
    """Two quantities of all cases as a picture."""
    return pictures.draw_figure(explore_figure(explored(library, study_id, query), x, y), title, form)


def explored_as_csv(library: Library, study_id: str, query: ExploreQuery) -> bytes:
    """The first rows as a table."""
    return explored_csv(library.store.study(study_id), explored(library, study_id, query))
