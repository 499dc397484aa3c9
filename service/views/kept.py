"""What takes seconds to find in the rows of a study, computed once for all that is shown of it."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from threading import Lock
from typing import TYPE_CHECKING, Any, Final, Generic, TypeVar

from cachetools import LRUCache

from sprag.service.results.calibration import calibration_of
from sprag.service.results.fronts import designs_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from sprag.service.results.calibration import Calibration
    from sprag.service.results.fronts import Designs
    from sprag.service.storage.store import Store

Found = TypeVar("Found")

#: Calibrations that are kept.
_CALIBRATIONS: Final = 16
#: Headlines that are kept.
_HEADLINES: Final = 512
#: Designs that are kept, of all studies together: some 20 MB.
_DESIGNS: Final = 50_000


class _Kept(Generic[Found]):
    """What is found in the rows of a study, anew only when it has other rows."""

    def __init__(self, store: Store, kept: LRUCache[tuple[object, ...], Found]) -> None:
        self._store = store
        self._lock = Lock()
        self._kept = kept

    def _of(self, study_id: str, find: Callable[..., Found], **options: bool) -> Found:
        store = self._store
        key = (study_id, store.studies.get(study_id).revision, *options.values())
        with self._lock:
            found = self._kept.get(key)
        if found is None:
            fetch = partial(store.rows.for_cases, study_id)
            found = find(store.studies.study(study_id), store.studies.rounds(study_id), fetch, **options)
            with self._lock, suppress(ValueError):  # too large to be kept
                self._kept[key] = found
        return found


class Calibrations(_Kept["Calibration"]):
    """Calibrations, each followed through its rows again, which takes a second, only when it has other rows."""

    def __init__(self, store: Store) -> None:
        super().__init__(store, LRUCache(_CALIBRATIONS))

    def of(self, study_id: str) -> Calibration:
        """A calibration; raises StudyNotFoundError, and FaultError for a study that is not one."""
        return self._of(study_id, calibration_of)


class Headlines:
    """The headlines of studies, each found anew only when its study has other rows."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._kept: LRUCache[tuple[object, ...], Any] = LRUCache(_HEADLINES)

    def of(self, key: tuple[object, ...], find: Callable[[], Found]) -> Found:
        """What is kept of the key, which has the revision of the study, or what ``find`` finds."""
        with self._lock:
            known: Found | None = self._kept.get(key)
        if known is None:
            known = find()
            with self._lock:
                self._kept[key] = known
        return known


class Fronts(_Kept["Designs"]):
    """The designs of studies, each ranked anew only when the study has other rows.

    Ranking takes a time that grows faster than the number of designs, seconds for tens of thousands; a page with its
    figures and files asks for the same designs several times.
    """

    def __init__(self, store: Store) -> None:
        super().__init__(store, LRUCache(_DESIGNS, getsizeof=lambda found: 100 + len(found.numbers)))

    def of(self, study_id: str, *, exact: bool) -> Designs:
        """The designs of a study; raises StudyNotFoundError, and FaultError for a study without a goal."""
        return self._of(study_id, designs_of, exact=exact)
