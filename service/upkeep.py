"""Upkeep at night, beside a dispatcher: a backup of the database, the latest of which are kept; old studies deleted.

A backup's name tells when it was made, and from the names follows whether one is due: nothing else is remembered.
"""

from __future__ import annotations

import logging
import re
import threading
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Final

from service.leftovers import sweep
from service.schedules.times import Timing, read_time_of_day
from service.storage.errors import StoreError
from service.storage.maintenance import PART_SUFFIX
from service.storage.private_files import PRIVATE_FOLDER_MODE

if TYPE_CHECKING:
    from service.storage.store import Store

_LOG = logging.getLogger("sprag.upkeep")

#: Seconds between two looks at the clock, and before something that failed is tried again.
LOOK_SECONDS = 20.0
AGAIN_SECONDS = 600.0
_NAME: Final = re.compile(r"sprag-(\d{8}T\d{6}Z)\.sqlite3")
_STAMP: Final = "%Y%m%dT%H%M%SZ"


@dataclass(frozen=True, slots=True)
class UpkeepPlan:
    """Where backups go (None: there are none) and how many stay; days ended studies stay (0: for ever); when."""

    folder: Path | None = None
    keep: int = 14
    study_days: int = 0
    time: str = "02:30"
    zone: str = "UTC"

    @property
    def timing(self) -> Timing:
        """Every night at the time."""
        at = read_time_of_day(self.time)
        return Timing(f"{at.minute} {at.hour} * * *", None, self.zone)

    @property
    def wanted(self) -> bool:
        """Whether there is anything to do."""
        return self.folder is not None or self.study_days > 0


def backups(folder: Path) -> list[tuple[datetime, Path]]:
    """The backups in ``folder`` with the times at which they were made, oldest first."""
    if not folder.is_dir():
        return []
    found = ((_NAME.fullmatch(path.name), path) for path in folder.iterdir())
    return sorted(
        (datetime.strptime(match[1], _STAMP).replace(tzinfo=UTC), path) for match, path in found if match is not None
    )


class Upkeep(threading.Thread):
    """Does what the plan says, every night by the store's clock, until `stop`."""

    def __init__(self, store: Store, plan: UpkeepPlan) -> None:
        super().__init__(name="sprag-upkeep", daemon=True)
        self._store = store
        self._plan = plan
        self._ending = threading.Event()
        #: The due time that is done with, and the time before which nothing is tried again.
        self._done = plan.timing.latest_until(store.clock.now())
        self._wait_until: datetime | None = None

    def run(self) -> None:
        """Look, and again."""
        if not self._plan.wanted:
            return
        self.begin()
        while not self._ending.wait(LOOK_SECONDS):
            self.look()

    def stop(self) -> None:
        """End the thread; returns when it has ended, after a backup that is being written."""
        self._ending.set()
        if self.is_alive():
            self.join()

    def begin(self) -> None:
        """Make up for a backup that was due while nothing was running."""
        if self._plan.folder is not None:
            made = backups(self._plan.folder)
            if not made or (self._done is not None and made[-1][0] < self._done):
                self._done = None
        self.look()

    def look(self) -> None:
        """Do what is due; what fails is said, and tried again later."""
        now = self._store.clock.now()
        due = self._plan.timing.latest_until(now)
        if due == self._done or (self._wait_until is not None and now < self._wait_until):
            return
        try:
            if self._plan.folder is not None:
                self._back_up(self._plan.folder, now)
            if self._plan.study_days:
                self._prune(now)
        except (StoreError, OSError) as error:
            _LOG.error("The nightly upkeep failed and is tried again in 10 minutes: %s", error)
            self._wait_until = now + timedelta(seconds=AGAIN_SECONDS)
            return
        self._done, self._wait_until = due, None

    def _back_up(self, folder: Path, now: datetime) -> None:
        folder.mkdir(PRIVATE_FOLDER_MODE, parents=True, exist_ok=True)
        sweep(folder.glob(f".sprag-*.sqlite3.*{PART_SUFFIX}"))
        target = folder / f"sprag-{now.astimezone(UTC):{_STAMP}}.sqlite3"
        if not target.exists():
            self._store.backup(target)
            _LOG.info("Backup: %s (%.3g MB).", target, target.stat().st_size / 1e6)
        for _, path in backups(folder)[: -self._plan.keep]:
            path.unlink()

    def _prune(self, now: datetime) -> None:
        gone = self._store.prune(now - timedelta(days=self._plan.study_days))
        if gone:
            _LOG.info("Deleted, because they ended more than %d days ago: %s.", self._plan.study_days, ", ".join(gone))
