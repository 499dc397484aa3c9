"""Whether the machine's clock is trusted: a clock that jumped ahead must not make recent data look old.

The last trusted time is kept in the database, so neither a restart nor a start with a wrong clock hides a jump.
"""

from __future__ import annotations

import logging
from datetime import datetime, timedelta
from threading import Lock
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from sprag_study.service.storage.work.dispatchers import Dispatchers

_LOG = logging.getLogger("sprag.clock")

#: A clock that is ahead of the expected time by more than this has jumped: while the worker runs, and between runs.
JUMP: Final = timedelta(hours=1)
LONGEST_PAUSE: Final = timedelta(days=60)
#: A clock that was put back is trusted after this time, within which network time has corrected a wrong start.
FOLLOWED_AFTER: Final = timedelta(hours=1)
#: Interval at which the trusted time is stored.
NOTE_AFTER: Final = timedelta(minutes=10)
MESSAGE: Final = (
    "The clock jumped ahead, from {} to {}: nothing is deleted by age until it is corrected, or until "
    "`sprag admin db clock` says that it is right"
)


class ClockWatch:
    """Compares the clock of the store with the elapsed time. Safe to use from several threads."""

    def __init__(self, dispatchers: Dispatchers) -> None:
        self._dispatchers = dispatchers
        self._lock = Lock()
        #: The latest trusted time, and the elapsed time at that moment.
        self._believed: tuple[datetime, float] | None = None
        self._noted: datetime | None = None
        #: The elapsed time when the clock was first found behind the trusted time.
        self._behind_since: float | None = None
        self._reported = False

    def believable(self) -> bool:
        """Check the clock: False while it is ahead of the expected time. Raises StoreError."""
        with self._lock:
            now, elapsed, noted = (
                self._dispatchers.clock.now(),
                self._dispatchers.clock.monotonic(),
                self._dispatchers.believed_clock(),
            )
            if self._believed is None or noted is None or noted != self._noted:  # the start, or `sprag admin db clock`
                expected, allowed = noted or now, LONGEST_PAUSE
            else:
                expected, allowed = self._believed[0] + timedelta(seconds=elapsed - self._believed[1]), JUMP
            if now - expected > allowed:
                if not self._reported:
                    self._reported = True
                    _LOG.error("%s.", jump_message(expected, now))
                return False
            if self._reported:
                _LOG.warning("The clock is trusted again: it is %s.", now.isoformat(timespec="seconds"))
                self._reported = False
            back = self._put_back(now, expected, elapsed)
            self._believed = now if back else max(expected, now), elapsed
            if back or noted is None or now - noted > NOTE_AFTER:
                self._dispatchers.note_clock(now)
                noted = now
            self._noted = noted
            return True

    def _put_back(self, now: datetime, expected: datetime, elapsed: float) -> bool:
        """Whether the clock has been behind the trusted time long enough to be followed. Otherwise its next jump to
        that time, which was wrong, would count as true.
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
    """The message about a jump."""
    return MESSAGE.format(*(moment.isoformat(timespec="seconds") for moment in (before, now)))


def distrust(dispatchers: Dispatchers) -> str | None:
    """Why nothing may be deleted by age now, from a single look at the clock; None where nothing speaks against it."""
    noted, now = dispatchers.believed_clock(), dispatchers.clock.now()
    if noted is not None and now - noted > LONGEST_PAUSE:
        return jump_message(noted, now)
    return clock_problem(dispatchers)


def clock_problem(dispatchers: Dispatchers) -> str | None:
    """Why the running worker does not trust the clock; None where it does, or no worker is running."""
    noted, worker, now = dispatchers.believed_clock(), dispatchers.latest(), dispatchers.clock.now()
    if noted is None or worker is None or now - noted <= 2 * JUMP or now - worker.heartbeat_at > JUMP:
        return None
    return jump_message(noted, now)
