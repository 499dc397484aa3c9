"""What calibrations have found, computed once for all that is shown of it."""

from __future__ import annotations

from functools import partial
from threading import Lock
from typing import TYPE_CHECKING, Final

from cachetools import LRUCache

from sprag.service.results.calibration import calibration_of

if TYPE_CHECKING:
    from sprag.service.results.calibration import Calibration
    from sprag.service.storage.store import Store

_KEPT: Final = 16


class Calibrations:
    """Calibrations, each followed through its rows again, which takes a second, only when it has other rows."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._lock = Lock()
        self._kept: LRUCache[tuple[str, int], Calibration] = LRUCache(_KEPT)

    def of(self, study_id: str) -> Calibration:
        """A calibration; raises StudyNotFoundError, and FaultError for a study that is not one."""
        store = self._store
        key = (study_id, store.studies.get(study_id).revision)
        with self._lock:
            found = self._kept.get(key)
        if found is None:
            found = calibration_of(
                store.studies.study(study_id), store.studies.rounds(study_id), partial(store.rows.for_cases, study_id)
            )
            with self._lock:
                self._kept[key] = found
        return found
