"""Access to the stored studies, and what takes seconds to find in their rows, computed once for all views of it."""

from __future__ import annotations

from contextlib import suppress
from functools import lru_cache, partial
from threading import Lock
from typing import TYPE_CHECKING, Final, Generic, TypeVar

from cachetools import LRUCache

from sprag_study.service.reading.quantities import TYPED, read_units
from sprag_study.service.reading.reader import Choice, Reading, reading_for
from sprag_study.service.results.calibration import calibration_of
from sprag_study.service.results.fronts import designs_of
from sprag_study.service.results.unaffected import unaffecting
from sprag_study.service.storage.store import Store
from sprag_study.service.views.columns import Columns
from sprag_study.worker.pool.child_process import uncounted

if TYPE_CHECKING:
    from collections.abc import Callable

    from sprag_study.service.reading.reader import Phrase
    from sprag_study.service.results.calibration import Calibration
    from sprag_study.service.results.fronts import Designs
    from sprag_study.service.results.headlines.headline import Headline
    from sprag_study.service.results.key_answers import ReadAnswer, StudyAnswers
    from sprag_study.service.storage.store import Store
    from sprag_study.service.storage.studies.records import StudyRecord
    from sprag_study.worker.chunking import Chunking

Key = TypeVar("Key")
Derived = TypeVar("Derived")

#: Calibrations that are kept.
_CALIBRATIONS: Final = 16
#: Designs that are kept, of all studies together: some 20 MB.
_DESIGNS: Final = 50_000


class Kept(Generic[Key, Derived]):
    """What has been found, by a key, for all threads."""

    def __init__(self, cache: LRUCache[Key, Derived]) -> None:
        self._lock = Lock()
        self._cache = cache

    def get(self, key: Key) -> Derived | None:
        """What is kept of the key."""
        with self._lock:
            return self._cache.get(key)

    def put(self, key: Key, found: Derived) -> Derived:
        """Keep what has been found, and return it."""
        with self._lock, suppress(ValueError):  # too large to be kept
            self._cache[key] = found
        return found

    def of(self, key: Key, find: Callable[[], Derived]) -> Derived:
        """What is kept of the key, otherwise what ``find`` finds."""
        known = self.get(key)
        return self.put(key, find()) if known is None else known


class _OfRows(Generic[Derived]):
    """What is found in the rows of a study, anew only when it has other rows."""

    def __init__(self, store: Store, cache: LRUCache[tuple[object, ...], Derived]) -> None:
        self._store = store
        self._kept = Kept(cache)

    def _of(self, study_id: str, find: Callable[..., Derived], **options: bool) -> Derived:
        store = self._store

        def made() -> Derived:
            fetch = partial(store.rows.for_cases, study_id)
            return find(store.studies.study(study_id), store.studies.rounds(study_id), fetch, **options)

        return self._kept.of((study_id, store.studies.get(study_id).revision, *options.values()), made)


class Calibrations(_OfRows["Calibration"]):
    """Calibrations, each followed through its rows again, which takes a second, only when it has other rows."""

    def __init__(self, store: Store) -> None:
        super().__init__(store, LRUCache(_CALIBRATIONS))

    def of(self, study_id: str) -> Calibration:
        """A calibration; raises StudyNotFoundError, and FaultError for a study that is not one."""
        return self._of(study_id, calibration_of)


class Fronts(_OfRows["Designs"]):
    """The designs of studies, each ranked anew only when the study has other rows.

    Ranking takes a time that grows faster than the number of designs, seconds for tens of thousands; a page with its
    figures and files asks for the same designs several times.
    """

    def __init__(self, store: Store) -> None:
        super().__init__(store, LRUCache(_DESIGNS, getsizeof=lambda found: 100 + len(found.numbers)))

    def of(self, study_id: str, *, exact: bool) -> Designs:
        """The designs of a study; raises StudyNotFoundError, and FaultError for a study without a goal."""
        return self._of(study_id, designs_of, exact=exact)


#: Headlines that are kept: of questions, and of listed studies.
_TOLD: Final = 512
_LISTED: Final = 2000
#: Ended studies of which it is kept which axes change nothing.
_UNAFFECTED: Final = 256
#: Numbers of answers that are kept with their curves, for what one page shows of them: some 16 MB.
_ANSWERS: Final = 2_000_000


def _numbers(answers: StudyAnswers) -> int:
    """How many numbers the curves of answers have, roughly."""
    if answers.drawn is None:
        return 1_000
    chosen = answers.drawn.selection
    return 1_000 + len(answers.drawn.curves) * len(chosen.x_values) * len(chosen.results)


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
        self.answers: Kept[tuple[object, ...], StudyAnswers] = Kept(LRUCache(_ANSWERS, getsizeof=_numbers))
        #: Extremes among all cases by study and its revision.
        self.overall: Kept[tuple[str, int], tuple[ReadAnswer, ...]] = Kept(LRUCache(_TOLD))
        self._unaffected: Kept[tuple[str, int], tuple[str, ...]] = Kept(LRUCache(_UNAFFECTED))
        #: Of listed studies the revision, and headline and description where they have them (`views.listed`).
        self.headlines: Kept[str, tuple[int, tuple[Headline, Phrase] | None]] = Kept(LRUCache(_LISTED))

    def unaffected(self, record: StudyRecord) -> tuple[str, ...]:
        """The sentences about axes of a study that change no result; none before its end."""
        if not record.state.terminal or not record.done:  # else each poll would take the place of an ended study
            return ()
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
