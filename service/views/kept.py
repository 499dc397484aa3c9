"""What takes seconds to find in the rows of a study, computed once for all that is shown of it."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from threading import Lock
from typing import TYPE_CHECKING, Final, Generic, TypeVar

from cachetools import LRUCache

from sprag_study.service.results.calibration import calibration_of
from sprag_study.service.results.fronts import designs_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from sprag_study.service.results.calibration import Calibration
    from sprag_study.service.results.fronts import Designs
    from sprag_study.service.storage.store import Store

Key = TypeVar("Key")
Found = TypeVar("Found")

#: Calibrations that are kept.
_CALIBRATIONS: Final = 16
#: Designs that are kept, of all studies together: some 20 MB.
_DESIGNS: Final = 50_000


class Kept(Generic[Key, Found]):
    """What has been found, by a key, for all threads."""

    def __init__(self, cache: LRUCache[Key, Found]) -> None:
        self._lock = Lock()
        self._cache = cache

    def get(self, key: Key) -> Found | None:
        """What is kept of the key."""
        with self._lock:
            return self._cache.get(key)

    def put(self, key: Key, found: Found) -> Found:
        """Keep what has been found, and return it."""
        with self._lock, suppress(ValueError):  # too large to be kept
            self._cache[key] = found
        return found

    def of(self, key: Key, find: Callable[[], Found]) -> Found:
        """What is kept of the key, otherwise what ``find`` finds."""
        known = self.get(key)
        return self.put(key, find()) if known is None else known


class _OfRows(Generic[Found]):
    """What is found in the rows of a study, anew only when it has other rows."""

    def __init__(self, store: Store, cache: LRUCache[tuple[object, ...], Found]) -> None:
        self._store = store
        self._kept = Kept(cache)

    def _of(self, study_id: str, find: Callable[..., Found], **options: bool) -> Found:
        store = self._store

        def made() -> Found:
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
