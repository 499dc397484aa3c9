"""Whether the machine's clock can be believed: one that jumped ahead must not make old what is young.

The last moment that could be believed is kept in the database, so that neither a restart nor a start under a wrong
clock makes a jump pass for the truth.
"""

from __future__ import annotations

import logging
from datetime import datetime, timedelta
from threading import Lock
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from sprag.service.storage.store import Store

_LOG = logging.getLogger("sprag.clock")

#: A clock that is ahead of itself by more than this has jumped, while the worker runs and between two of its runs.
JUMP: Final = timedelta(hours=1)
LONGEST_PAUSE: Final = timedelta(days=60)
#: A clock that was put back is followed after this time: one that the network sets after the start is right by then.
FOLLOWED_AFTER: Final = timedelta(hours=1)
#: The believed moment is written down after this time.
NOTE_AFTER: Final = timedelta(minutes=10)
MESSAGE: Final = (
    "The clock jumped ahead, from {} to {}: nothing is deleted by age until it is corrected, or until "
    "`sprag db clock` says that it is right"
)


class ClockWatch:
    """Compares the store's clock with the time that has passed. Safe to use from several threads."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._lock = Lock()
        #: The latest believed moment, and how much time had passed then.
        self._believed: tuple[datetime, float] | None = None
        self._noted: datetime | None = None
        #: How much time had passed when the clock was first seen behind what was believed.
        self._behind_since: float | None = None
        self._told = False

    def believable(self) -> bool:
        """Look at the clock: False as long as it is ahead of what it can be. Raises StoreError."""
        with self._lock:
            now, elapsed, noted = self._store.clock.now(), self._store.clock.monotonic(), self._store.believed_clock()
            if self._believed is None or noted is None or noted != self._noted:  # the start, or the user's word
                expected, allowed = noted or now, LONGEST_PAUSE
            else:
                expected, allowed = self._believed[0] + timedelta(seconds=elapsed - self._believed[1]), JUMP
            if now - expected > allowed:
                if not self._told:
                    self._told = True
                    _LOG.error("%s.", jump_message(expected, now))
                return False
            if self._told:
                _LOG.warning("The clock is trusted again: it is %s.", now.isoformat(timespec="seconds"))
                self._told = False
            back = self._put_back(now, expected, elapsed)
            self._believed = now if back else max(expected, now), elapsed
            if back or noted is None or now - noted > NOTE_AFTER:
                self._store.note_clock(now)
                noted = now
            self._noted = noted
            return True

    def _put_back(self, now: datetime, expected: datetime, elapsed: float) -> bool:
        """Whether the clock has been behind what was believed for so long that it is followed: else its next jump to
        that time, which was a wrong one, would pass for the truth.
        """
        if expected - now <= JUMP:
            self._behind_since = None
            return False
        if self._behind_since is None:
            self._behind_since = elapsed
        if elapsed - self._behind_since < FOLLOWED_AFTER.total_seconds():
            return False
        self._behind_since = None
        return True


def jump_message(before: datetime, now: datetime) -> str:
    """What is said of a jump."""
    return MESSAGE.format(*(moment.isoformat(timespec="seconds") for moment in (before, now)))


def distrust(store: Store) -> str | None:
    """Why nothing may be deleted by age now, for somebody who looks at the clock once; None where nothing is known."""
    noted, now = store.believed_clock(), store.clock.now()
    if noted is not None and now - noted > LONGEST_PAUSE:
        return jump_message(noted, now)
    return clock_problem(store)


def clock_problem(store: Store) -> str | None:
    """Why the clock is not believed by the worker that is at work; None where it is, or no worker is at work."""
    noted, worker, now = store.believed_clock(), store.dispatcher(), store.clock.now()
    if noted is None or worker is None or now - noted <= 2 * JUMP or now - worker.heartbeat_at > JUMP:
        return None
    return jump_message(noted, now)
