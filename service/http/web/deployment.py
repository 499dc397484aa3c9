"""What the page of workers and backups says of schedules and backups, and a backup that somebody asks for."""

from __future__ import annotations

import logging
import threading
from contextlib import suppress
from contextvars import copy_context
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from sprag_study.sentences import Sentence
from sprag_study.service.http.problems import ApiError
from sprag_study.service.http.schedule_views import listed
from sprag_study.service.jobs.maintenance import backups, make_backup
from sprag_study.service.jobs.nights import night
from sprag_study.service.languages import recorded
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
    lately = night(store, HEALTH_DAYS * 24)
    late = {run["schedule"] for run in lately["late"]}
    found = []
    for schedule in listed(store)["schedules"]:
        runs = [run for run in lately["runs"] if run["schedule"] == schedule["id"]]
        trouble = sum(run["outcome"]["trouble"] for run in runs)
        found.append(Health(schedule, len(runs), trouble, schedule["id"] in late))
    return sorted(found, key=lambda health: not (health.late or health.trouble))


def backups_listed(folder: str) -> list[tuple[datetime, str, int]]:
    """When the backups were made, their names and sizes (bytes), latest first; none where the folder cannot be read."""
    try:
        made = backups(Path(folder).expanduser()) if folder else []
        return [(when, path.name, path.stat().st_size) for when, path in reversed(made)]
    except OSError:
        return []


def is_being_backed_up() -> bool:
    """Whether a backup is being made that somebody asked for."""
    return _MAKING.locked()


def begin_backup(context: Context) -> None:
    """Begin a backup in a thread; raises ApiError where there can be none. One that is being made is enough."""
    folder, store = context.settings.backup_folder, context.store
    if not folder or store.session.on_server:
        raise ApiError("not-found", Sentence("No backups are made here: SPRAG_BACKUP_FOLDER is not set."))
    if not _MAKING.acquire(blocking=False):
        return

    def make() -> None:
        try:
            path = make_backup(store, Path(folder).expanduser(), store.clock.now())
            store.audit.note("database.backup", path.name, bytes=path.stat().st_size)
            store.alerts.end("backup")
        except (StoreError, OSError) as error:
            _LOG.error("A backup failed: %s", error)
            problem = Sentence(recorded.BACKUP_FAILED, problem=str(error).removesuffix("."))
            with suppress(StoreError):
                store.alerts.begin("backup", problem, context.settings.alert_to, context.settings.zone)
        finally:
            _MAKING.release()

    threading.Thread(target=copy_context().run, args=(make,), name="sprag-backup", daemon=True).start()
