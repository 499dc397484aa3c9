"""The work beside a dispatcher that is done once for a database, such as schedules and nightly maintenance."""

from __future__ import annotations

import logging
import threading
from typing import TYPE_CHECKING, Final, Protocol

from sprag_study.service.storage.database.lock import DispatcherLock
from sprag_study.service.storage.errors import StoreError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.storage.database.server_lock import ServerLock

_LOG = logging.getLogger("sprag.chores")

#: Seconds between two attempts to take the work over from another dispatcher.
LOOK_SECONDS: Final = 2.0


class Part(Protocol):
    """A part of this work, usually a thread."""

    def start(self) -> None:
        """Begin."""

    def stop(self) -> None:
        """End, if it was begun; returns when it has."""


class Chores(threading.Thread):
    """Does this work until `stop`, as soon as no other dispatcher does it.

    The dispatcher of a file is the only one. On a server the lock belongs to the connection by which the dispatcher is
    present: who loses it is ended by the others, and one of them takes the work over.
    """

    def __init__(self, lock: DispatcherLock | ServerLock, work: Sequence[Part]) -> None:
        super().__init__(name="sprag-chores", daemon=True)
        self._lock = lock
        self._ending = threading.Event()
        self._work = work

    def run(self) -> None:
        """Wait until the work is ours, and start it."""
        while not self._ours():
            if self._ending.wait(LOOK_SECONDS):
                return
        for part in self._work:
            part.start()

    def _ours(self) -> bool:
        if isinstance(self._lock, DispatcherLock):
            return True
        try:
            return self._lock.take_chores()
        except StoreError as error:
            _LOG.warning("Schedules and maintenance wait: %s", error)
            return False

    def stop(self) -> None:
        """Stop all of it; returns when it has ended."""
        self._ending.set()
        if self.is_alive():
            self.join()
        for part in self._work:
            part.stop()
