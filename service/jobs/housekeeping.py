"""Housekeeping of an open database: removes deleted studies and checkpoints the write-ahead log."""

from __future__ import annotations

import logging
import threading
import time
from typing import TYPE_CHECKING, Final

from sprag_study.service.storage.errors import StoreError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from sprag_study.service.storage.store import Store

_LOG = logging.getLogger("sprag.housekeeping")

#: Seconds between two checks while nothing is deleted.
LOOK_SECONDS: Final = 30.0
#: Rest after rows were looked over, in times of how long that took.
REST_TIMES: Final = 50.0


class Scrubbing:
    """Looks over the rows of one study after the other, and has those run again that changed on the disk.

    One study at a time, when `Housekeeping` asks, but resting for `REST_TIMES` as long as it took; after the last one
    it begins anew.
    """

    def __init__(self, store: Store) -> None:
        self._store = store
        self._last = 0
        self._next = 0.0

    def look(self) -> None:
        """Look over the next one, when it is time. Raises StoreError."""
        began = self._store.clock.monotonic()
        if began < self._next:
            return
        try:
            self._look()
        finally:
            now = self._store.clock.monotonic()
            self._next = now + REST_TIMES * (now - began)

    def _look(self) -> None:
        found = self._store.digests.with_rows_after(self._last)
        self._last = 0 if found is None else found[0]
        if found is not None and not self._store.digests.run_damaged_again(found[1]):
            self._store.digests.count_endings_again(found[1])


class Housekeeping(threading.Thread):
    """Removes deleted studies that cannot be restored, promptly and in turns with other writers, until `stop`.

    Each of ``also`` is called each time and once more at the end; what fails is logged.

    What another process deleted but did not live to remove is removed by the next dispatcher that starts.
    """

    def __init__(self, store: Store, *also: Callable[[], None]) -> None:
        super().__init__(name="sprag-housekeeping", daemon=True)
        self._store = store
        self._also = also
        self._ending = threading.Event()
        self._failed = False

    def run(self) -> None:
        """Remove them at the start, after each deletion, and periodically."""
        self.purge()
        self.add_keys()
        while not self._ending.is_set():
            deleted = self._store.studies.deleted.wait(LOOK_SECONDS)
            self._do_also()
            if self._ending.is_set():
                return
            self.purge()
            if not (deleted or self._failed):
                self.checkpoint()

    def stop(self) -> None:
        """Stop the thread; returns when it has ended, after the current step."""
        self._ending.set()
        self._store.studies.deleted.set()
        if self.is_alive():
            self.join()

    def purge(self) -> None:
        """Remove deleted studies."""
        self._store.studies.deleted.clear()
        self._failed = not self._done(self._store.purging.steps, "Deleted studies will be removed later: %s")

    def add_keys(self) -> None:
        """Give keys of their cases to studies that have none yet."""
        self._done(self._store.reuse.key_steps, "Studies of before get the keys of their cases at the next start: %s")

    def _done(self, steps: Callable[[], Iterable[object]], otherwise: str) -> bool:
        """Whether nothing fails in these steps; after each, leave the database to others for as long as it took."""
        try:
            began = time.monotonic()
            for _ in steps():
                if self._ending.wait(time.monotonic() - began):
                    break
                began = time.monotonic()
        except StoreError as error:
            _LOG.warning(otherwise, error)
            return False
        return True

    def _do_also(self) -> None:
        for each in self._also:
            try:
                each()
            except StoreError as error:
                _LOG.warning("Part of the housekeeping is done later: %s", error)
            except Exception:
                _LOG.exception("Part of the housekeeping failed and is tried again later")

    def checkpoint(self) -> None:
        """Checkpoint the write-ahead log, so that the database file alone is nearly up to date."""
        try:
            self._store.session.checkpoint()
        except StoreError as error:
            _LOG.warning("The write-ahead log cannot be checkpointed for now: %s", error)
