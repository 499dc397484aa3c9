"""Access to the stored studies, in whatever process."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

from cachetools import LRUCache

from sprag.service.reading.reader import Choice, Reading, reading_for
from sprag.service.results.unaffected import Unaffected
from sprag.service.storage.store import Store
from sprag.service.views.columns import Columns
from sprag.service.views.kept import Calibrations, Fronts, Headlines
from sprag.worker.pool.child_process import uncounted

if TYPE_CHECKING:
    from collections.abc import Callable

    from sprag.worker.chunking import Chunking


#: Headlines that are kept.
_HEADLINES: Final = 2000


def reading_of(store: Store, study_id: str, choice: Choice) -> Reading:
    """The reading of a choice; raises StudyNotFoundError, and SelectionError for units that cannot be shown."""
    return reading_for(store.studies.study(study_id), store.studies.spec(study_id), choice)


class Library:
    """Access to the stored studies; a process that receives it opens its own store.

    Parameters
    ----------
    store : Store
    """

    def __init__(self, store: Store) -> None:
        self.store = store
        self.fronts = Fronts(store)
        self.columns = Columns(store)
        self.calibrations = Calibrations(store)
        self.told = Headlines()
        self.unaffected = Unaffected()
        #: Revision, headline and description of listed studies (`views.listed`).
        self.headlines: LRUCache[str, Any] = LRUCache(_HEADLINES)

    def __reduce__(self) -> tuple[Callable[[str, Chunking], Library], tuple[str, Chunking]]:
        return _library, (
            self.store.session.url.render_as_string(hide_password=False),
            self.store.dispatchers.base_chunking,
        )


@lru_cache(maxsize=1)
def _library(url: str, chunking: Chunking) -> Library:
    with uncounted():
        return Library(Store.open(url, chunking=chunking, create=False))
