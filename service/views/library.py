"""Access to the stored studies, in whatever process."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final

from cachetools import LRUCache

from sprag_study.service.reading.quantities import TYPED, read_units
from sprag_study.service.reading.reader import Choice, Reading, reading_for
from sprag_study.service.results.unaffected import unaffecting
from sprag_study.service.storage.store import Store
from sprag_study.service.views.columns import Columns
from sprag_study.service.views.kept import Calibrations, Fronts, Kept
from sprag_study.worker.pool.child_process import uncounted

if TYPE_CHECKING:
    from collections.abc import Callable

    from sprag_study.service.reading.reader import Phrase
    from sprag_study.service.results.headlines.headline import Headline
    from sprag_study.service.results.key_answers import StudyAnswers
    from sprag_study.service.storage.studies.records import StudyRecord
    from sprag_study.worker.chunking import Chunking

#: Headlines that are kept: of questions, and of listed studies.
_TOLD: Final = 512
_LISTED: Final = 2000
#: Ended studies of which it is kept which axes change nothing.
_UNAFFECTED: Final = 256
#: Answers that are kept with their curves, for what one page shows of them.
_ANSWERS: Final = 8


def reading_of(store: Store, study_id: str, choice: Choice) -> Reading:
    """The reading of a choice; raises StudyNotFoundError, and SelectionError for units that cannot be shown."""
    spec = store.studies.spec(study_id) if read_units(choice.units)[0] == TYPED else {}
    return reading_for(store.studies.study(study_id), spec, choice)


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
        #: Headlines by study, its revision, and the question.
        self.told: Kept[tuple[object, ...], Headline] = Kept(LRUCache(_TOLD))
        #: Answers of curves by study, its revision, and the question.
        self.answers: Kept[tuple[object, ...], StudyAnswers] = Kept(LRUCache(_ANSWERS))
        self._unaffected: Kept[tuple[str, int], tuple[str, ...]] = Kept(LRUCache(_UNAFFECTED))
        #: Of listed studies the revision, and headline and description where they have them (`views.listed`).
        self.headlines: Kept[str, tuple[int, tuple[Headline, Phrase] | None]] = Kept(LRUCache(_LISTED))

    def unaffected(self, record: StudyRecord) -> tuple[str, ...]:
        """The sentences about axes of a study that change no result; none before its end."""
        return self._unaffected.of((record.id, record.revision), lambda: unaffecting(self.store, record))

    def __reduce__(self) -> tuple[Callable[[str, Chunking], Library], tuple[str, Chunking]]:
        return _library, (
            self.store.session.url.render_as_string(hide_password=False),
            self.store.dispatchers.base_chunking,
        )


@lru_cache(maxsize=1)
def _library(url: str, chunking: Chunking) -> Library:
    with uncounted():
        return Library(Store.open(url, chunking=chunking, create=False))
