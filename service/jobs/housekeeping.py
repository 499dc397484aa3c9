"""What keeps a database in order while it is open: deleted studies removed, the write-ahead log moved to its place."""

from __future__ import annotations

import logging
import threading
import time
from typing import TYPE_CHECKING, Final

from sprag.service.storage.errors import StoreError

if TYPE_CHECKING:
    from sprag.service.storage.store import Store

_LOG = logging.getLogger("sprag.housekeeping")

#: Seconds between two looks where nothing was deleted.
LOOK_SECONDS: Final = 30.0


class Housekeeping(threading.Thread):
    """Removes deleted studies at once and in turns with other writers, until `stop`.

    What another process deleted, and did not live to remove, is removed by the dispatcher that starts next.
    """

    def __init__(self, store: Store) -> None:
        super().__init__(name="sprag-housekeeping", daemon=True)
        self._store = store
        self._ending = threading.Event()
        self._failed = False

    def run(self) -> None:
        """Remove what is there at the start; then look whenever something is deleted, and now and then."""
        self.purge()
        while not self._ending.is_set():
            deleted = self._store.deleted.wait(LOOK_SECONDS)
            if self._ending.is_set():
                return
            if deleted or self._failed:
                self.purge()
            else:
                self.checkpoint()

    def stop(self) -> None:
        """End the thread; returns when it has ended, after the step that is under way."""
        self._ending.set()
        self._store.deleted.set()
        if self.is_alive():
            self.join()

    def purge(self) -> None:
        """Remove what is deleted, and leave the database to others for as long as each step took."""
        self._store.deleted.clear()
        self._failed = False
        try:
            began = time.monotonic()
            for _ in self._store.purge_steps():
                if self._ending.wait(time.monotonic() - began):
                    return
                began = time.monotonic()
        except StoreError as error:
            self._failed = True
            _LOG.warning("Deleted studies are removed later: %s", error)

    def checkpoint(self) -> None:
        """Move the log to its place, so that the file by itself is never far behind."""
        try:
            self._store.checkpoint()
        except StoreError as error:
            _LOG.warning("The write-ahead log stays where it is for now: %s", error)
