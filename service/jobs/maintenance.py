"""Nightly maintenance beside a dispatcher: backups, of which the latest are kept, and deletion of old studies.

The name of a backup contains its time, and the names alone determine whether one is due; nothing else is stored.
"""

from __future__ import annotations

import logging
import re
import shutil
import socket
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from sprag_study.sentences import Amount, Sentence
from sprag_study.service.actor import Actor, Door, act_as
from sprag_study.service.languages import recorded
from sprag_study.service.schedules.times import Timing, read_time_of_day
from sprag_study.service.stale_files import sweep
from sprag_study.service.storage.clock_watch import ClockWatch
from sprag_study.service.storage.database.private_files import PRIVATE_FOLDER_MODE
from sprag_study.service.storage.errors import StoreError
from sprag_study.service.storage.maintenance import PART_SUFFIX

if TYPE_CHECKING:
    from sprag_study.service.delivery import Delivery
    from sprag_study.service.storage.alerts import AlertKind
    from sprag_study.service.storage.store import Store

_LOG = logging.getLogger("sprag.maintenance")

#: Seconds between two checks of the clock, and before a failed task is retried.
LOOK_SECONDS = 20.0
AGAIN = timedelta(minutes=10)
#: Backups are made every night: the latest one is no older.
OLDEST_BACKUP: Final = timedelta(hours=49)
#: For so long the reports of schedules are kept after they were sent or given up.
REPORTS_KEPT: Final = timedelta(days=90)
_NAME: Final = re.compile(r"sprag-(\d{8}T\d{6}Z)\.sqlite3")
_STAMP: Final = "%Y%m%dT%H%M%SZ"
_BACKUP: Final = "backup"
#: All is well again when so many times the least is free: a disk at the limit is said once.
_WELL: Final = 1.1


@dataclass(frozen=True, slots=True)
class MaintenancePlan:
    """Folder of the backups (None: no backups) and how many to keep; days to keep ended studies (0: for ever); time;
    days to keep the audit log (0: for ever); bytes that should be free on the disks (0: any number will do), and who
    is told when less is, or a backup fails (`Alerts.begin`).
    """

    folder: Path | None = None
    keep: int = 14
    study_days: int = 0
    time: str = "02:30"
    zone: str = "UTC"
    audit_days: int = 0
    least_free: int = 1024 * 2**20
    alert_to: tuple[str, ...] = ()

    @property
    def timing(self) -> Timing:
        """Every night at the time."""
        at = read_time_of_day(self.time)
        return Timing(f"{at.minute} {at.hour} * * *", None, self.zone)


def backups(folder: Path) -> list[tuple[datetime, Path]]:
    """The backups in ``folder`` with the times at which they were made, oldest first."""
    if not folder.is_dir():
        return []
    found = []
    for path in folder.iterdir():
        if match := _NAME.fullmatch(path.name):
            with suppress(ValueError):  # the name of a backup with an invalid date
                found.append((datetime.strptime(match[1], _STAMP).replace(tzinfo=UTC), path))
    return sorted(found)


def make_backup(store: Store, folder: Path, now: datetime) -> Path:
    """Write a backup of ``now`` into ``folder``, which is made where it is missing; raises StoreError and OSError."""
    folder.mkdir(PRIVATE_FOLDER_MODE, parents=True, exist_ok=True)
    sweep(folder.glob(f".sprag-*.sqlite3.*{PART_SUFFIX}"))
    target = folder / f"sprag-{now.astimezone(UTC):{_STAMP}}.sqlite3"
    for problem in store.backup(target):
        _LOG.error("In the backup: %s.", problem)
    _LOG.info("Backup: %s (%.3g MB).", target, target.stat().st_size / 1e6)
    return target


def backup_failed(error: Exception) -> Sentence:
    """That a backup failed, and why."""
    problem = str(error).strip().removesuffix(".") or type(error).__name__
    return Sentence(recorded.BACKUP_FAILED, problem=problem)


def alert(
    store: Store, plan: MaintenancePlan, delivery: Delivery | None, kind: AlertKind, problem: Sentence | None
) -> None:
    """Begin the alert, or end it where there is no problem; a copy of the deployment says nothing to anybody.

    Reports go where the ``plan`` says, as far as ``delivery`` reaches; None reaches all.
    """
    try:
        if problem is None:
            if store.alerts.end(kind):
                _LOG.info("All is well again: %s.", kind)
            return
        copy = store.deployment.is_copy()
        if not copy and store.alerts.begin(kind, problem, plan.alert_to, plan.zone, delivery):
            _LOG.error("%s", problem)
    except StoreError as error:
        _LOG.warning("An alert is noted later: %s", error)


def _free(folder: Path) -> int | None:
    """Free bytes of the disk of ``folder``; None where there is no such folder, or its disk does not say."""
    try:
        return shutil.disk_usage(folder).free if folder.is_dir() else None
    except OSError as error:
        _LOG.warning("The free space of %s is not known: %s", folder, error)
        return None


@dataclass(slots=True)
class _Task:
    """A nightly task; `do` gets the time, the due time and whether the clock is trusted, and returns whether it was
    done.

    ``done`` is the last due time that was handled, ``wait_until`` the time before which it is not retried.
    """

    name: str
    do: Callable[[datetime, datetime, bool], bool]
    done: datetime | None = None
    wait_until: datetime | None = None


class Maintenance(threading.Thread):
    """Carries out the plan every night by the store's clock, until `stop`."""

    def __init__(
        self,
        store: Store,
        plan: MaintenancePlan,
        watch: ClockWatch | None = None,
        delivery: Delivery | None = None,
    ) -> None:
        super().__init__(name="sprag-maintenance", daemon=True)
        self._store = store
        self._plan = plan
        self._delivery = delivery
        self._watch = watch or ClockWatch(store.dispatchers)
        self._ending = threading.Event()
        self._tasks: list[_Task] = []
        #: What was wrong when it was still watched; another worker of the database may watch it, so that it ends once.
        self._unwatched: list[AlertKind] = []
        if not (plan.least_free and self._folders()):
            self._unwatched.append("disk")
        if plan.folder is None:
            self._unwatched.append(_BACKUP)
        self._tasks.append(_Task("deletion of old reports", self._prune_reports))
        if plan.folder is not None:
            self._tasks.append(_Task(_BACKUP, partial(self._back_up, plan.folder)))
        if plan.study_days:
            self._tasks.append(_Task("deletion of old studies", self._prune))
        if plan.audit_days:
            self._tasks.append(_Task("deletion of old rows of the audit log", self._prune_audit))

    def run(self) -> None:
        """Run until stopped; watch the clock even where nothing else is enabled. Missed tasks are done immediately."""
        self.look()
        while not self._ending.wait(LOOK_SECONDS):
            self.look()

    def stop(self) -> None:
        """Stop the thread; returns when it has ended, after any backup in progress."""
        self._ending.set()
        if self.is_alive():
            self.join()

    def look(self) -> None:
        """Run the due tasks independently; failures are logged and retried later."""
        with act_as(Actor(Door.SERVICE, "maintenance", socket.gethostname())):
            self._look(self._store.clock.now())

    def _look(self, now: datetime) -> None:
        due = self._plan.timing.latest_until(now)
        assert due is not None, "a time of day comes every day"
        while self._unwatched:
            self._alert(self._unwatched.pop(), None)
        self._look_at_disks()
        try:
            believed = self._watch.believable()
        except StoreError as error:
            _LOG.error("The clock cannot be judged, and nothing is deleted: %s", error)
            believed = False
        for task in self._tasks:
            if task.done == due or (task.wait_until is not None and task.wait_until - AGAIN <= now < task.wait_until):
                continue
            try:
                if not task.do(now, due, believed):
                    continue
            except Exception as error:  # no failure may prevent the other tasks or later nights
                known = isinstance(error, StoreError | OSError)
                _LOG.error(
                    "The nightly %s failed and is retried in 10 minutes: %s",
                    task.name,
                    error,
                    exc_info=None if known else error,
                )
                task.wait_until = now + AGAIN
                if task.name == _BACKUP:
                    self._alert(_BACKUP, backup_failed(error))
                continue
            if task.name == _BACKUP:
                self._alert(_BACKUP, None)
            task.done, task.wait_until = due, None

    def _folders(self) -> list[Path]:
        """Those of the database and of the backups on this machine."""
        session, folder = self._store.session, self._plan.folder
        return [*([] if session.on_server else [session.path.parent]), *([folder] if folder else [])]

    def _look_at_disks(self) -> None:
        """Begin or end the alert of the disks of the database and of the backups."""
        least = self._plan.least_free
        free = {folder: size for folder in self._folders() if (size := _free(folder)) is not None}
        if not (least and free):
            return
        fullest = min(free, key=lambda folder: free[folder])
        if free[fullest] < least:
            megabytes = {"free": Amount(free[fullest] / 1e6, digits=3), "least": Amount(least / 1e6, digits=4)}
            self._alert("disk", Sentence(recorded.DISK_LOW, path=str(fullest), **megabytes))
        elif free[fullest] >= _WELL * least:
            self._alert("disk", None)

    def _alert(self, kind: AlertKind, problem: Sentence | None) -> None:
        alert(self._store, self._plan, self._delivery, kind, problem)

    def _back_up(self, folder: Path, now: datetime, due: datetime, believed: bool) -> bool:
        """Write a backup unless there is one since ``due``; then remove the oldest."""
        folder.mkdir(PRIVATE_FOLDER_MODE, parents=True, exist_ok=True)
        if not any(due <= when <= now for when, _ in backups(folder)):
            make_backup(self._store, folder, now)
        if believed:
            # A backup with a future name was made under a wrong clock: it is neither removed nor counted.
            for _, path in [made for made in backups(folder) if made[0] <= now][: -self._plan.keep]:
                path.unlink()
        return True

    def _prune(self, now: datetime, _due: datetime, believed: bool) -> bool:
        if not believed:
            return False
        gone = self._store.purging.prune(now - timedelta(days=self._plan.study_days))
        if gone:
            _LOG.info("Deleted studies that ended more than %d days ago: %s.", self._plan.study_days, ", ".join(gone))
        return True

    def _prune_audit(self, now: datetime, _due: datetime, believed: bool) -> bool:
        if believed:
            self._store.audit.prune(now - timedelta(days=self._plan.audit_days))
        return believed

    def _prune_reports(self, now: datetime, _due: datetime, believed: bool) -> bool:
        if believed:
            self._store.reports.prune(now - REPORTS_KEPT)
        return believed
