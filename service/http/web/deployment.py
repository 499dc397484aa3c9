"""What the page of workers and backups says of schedules and backups, and a backup that somebody asks for."""

from __future__ import annotations

import logging
import threading
from collections import Counter
from contextlib import suppress
from contextvars import copy_context
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Final

from sprag_study.sentences import Sentence
from sprag_study.service.http.problems import ApiError
from sprag_study.service.http.schedule_views import listed
from sprag_study.service.jobs.dispatching import worker_settings
from sprag_study.service.jobs.maintenance import alert, backup_failed, backups, make_backup
from sprag_study.service.jobs.nights import whole_outcome
from sprag_study.service.jobs.reports.watchdog import late_runs
from sprag_study.service.storage.errors import StoreError

if TYPE_CHECKING:
    from datetime import datetime

    from sprag_study.service.answers.schedules import ScheduleSummary
    from sprag_study.service.http.context import Context
    from sprag_study.service.storage.store import Store

_LOG = logging.getLogger("sprag.maintenance")

#: Days whose runs are counted.
HEALTH_DAYS: Final = 7
#: Held while a backup is made that somebody asked for.
_MAKING: Final = threading.Lock()


@dataclass(frozen=True, slots=True)
class Health:
    """How a schedule fares: its runs of the last days, and how many of them need attention."""

    schedule: ScheduleSummary
    runs: int
    trouble: int
    late: bool


def schedule_health(store: Store) -> list[Health]:
    """Every schedule; first those that need attention, otherwise newest first."""
    until = store.clock.now()
    runs, trouble = Counter[str](), Counter[str]()
    for run in store.runs.between(until - timedelta(days=HEALTH_DAYS), until):
        runs[run.schedule] += 1
        trouble[run.schedule] += whole_outcome(store, run).trouble
    late = {late.run.id for late in late_runs(store)}
    health = [
        Health(schedule, runs[schedule["id"]], trouble[schedule["id"]], schedule["id"] in late)
        for schedule in listed(store)["schedules"]
    ]
    return sorted(health, key=lambda item: not (item.late or item.trouble))


def backup_files(folder: str) -> list[tuple[datetime, Path]]:
    """When the backups were made, and their files, latest first; none where the folder cannot be read."""
    try:
        return backups(Path(folder).expanduser())[::-1] if folder else []
    except OSError:
        return []


def backups_listed(folder: str) -> list[tuple[datetime, str, int]]:
    """When the backups were made, their names and sizes (bytes), latest first; those that go meanwhile are left out."""
    listed = []
    for when, path in backup_files(folder):
        with suppress(OSError):
            listed.append((when, path.name, path.stat().st_size))
    return listed


def is_being_backed_up() -> bool:
    """Whether a backup is being made that somebody asked for."""
    return _MAKING.locked()


def begin_backup(context: Context) -> None:
    """Begin a backup in a thread; raises ApiError where there can be none. One that is being made is enough."""
    settings, store = worker_settings(context.settings), context.store
    plan, folder = settings.maintenance, settings.maintenance.folder
    if store.session.on_server:
        text = Sentence("No backups are made of a database on a server: use PostgreSQL's own tools, such as pg_dump.")
        raise ApiError("not-found", text)
    if folder is None:
        raise ApiError("not-found", Sentence("No backups are made here: SPRAG_BACKUP_FOLDER is not set."))
    if not _MAKING.acquire(blocking=False):
        return

    def make() -> None:
        try:
            path = make_backup(store, folder, store.clock.now())
            store.audit.note("database.backup", path.name, bytes=path.stat().st_size)
            alert(store, plan, settings.delivery, "backup", None)
        except (StoreError, OSError) as error:
            _LOG.error("A backup failed: %s", error)
            alert(store, plan, settings.delivery, "backup", backup_failed(error))
        finally:
            _MAKING.release()

    threading.Thread(target=copy_context().run, args=(make,), name="sprag-backup", daemon=True).start()
