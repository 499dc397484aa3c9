"""The dispatcher of a database, run alone (`sprag admin worker`) or as a child of the service (`sprag serve`)."""

from __future__ import annotations

import logging
import os
import signal
import socket
import time
from dataclasses import dataclass, field, replace
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING

from sprag_study.service import logs
from sprag_study.service.delivery import Delivery
from sprag_study.service.jobs.chores import Chores
from sprag_study.service.jobs.housekeeping import Housekeeping, Scrubbing
from sprag_study.service.jobs.maintenance import Maintenance, MaintenancePlan
from sprag_study.service.jobs.reports.reporter import Reporter
from sprag_study.service.jobs.reports.watchdog import Watchdog
from sprag_study.service.jobs.scheduler import Scheduler
from sprag_study.service.logs import LogFormat
from sprag_study.service.storage.database.lock import DispatcherLock
from sprag_study.service.storage.database.session import file_of
from sprag_study.service.storage.errors import DatabaseError
from sprag_study.service.storage.part import SILENT_SECONDS, SystemClock
from sprag_study.service.storage.people.people import Quota, quota_of
from sprag_study.service.storage.readiness import LOCKED_SECONDS
from sprag_study.service.storage.store import Store
from sprag_study.worker import models, traces
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.dispatcher import Dispatcher
from sprag_study.worker.pool.processes import end_with_parent, ignore_interrupts, interrupts_held_back
from sprag_study.worker.ports import EpochLostError, ExecutorError, StoreError

if TYPE_CHECKING:
    from collections.abc import Callable
    from multiprocessing.context import SpawnProcess
    from types import FrameType

    from sprag_study.service.settings import Settings
    from sprag_study.service.storage.database.server_lock import ServerLock
    from sprag_study.worker.ports import Executor

_LOG = logging.getLogger("sprag.service")

#: Seconds between two attempts of a standby to take the lock.
STANDBY_SECONDS = 0.3
#: Seconds without a heartbeat after which a worker that is to be replaced counts as hung.
HUNG_SECONDS = 20.0


@dataclass(frozen=True, slots=True)
class WorkerSettings:
    """Settings of a dispatcher: database (SQLAlchemy URL), processes of the pool, time limit of a chunk (s), ..."""

    database_url: str
    processes: int
    chunk_timeout: float
    #: Cases of one chunk of the studies that schedules submit; 0: about a second of work.
    chunk_cases: int = 0
    maintenance: MaintenancePlan = field(default_factory=MaintenancePlan)
    log_format: LogFormat = "text"
    #: Where chunks run (`Settings.executor`).
    executor: str = "pool"
    #: Of the users whose schedules submit studies.
    quota: Quota = field(default_factory=Quota)
    #: How the reports of schedules leave.
    delivery: Delivery = field(default_factory=Delivery)


def worker_settings(settings: Settings) -> WorkerSettings:
    """The part of ``settings`` that a dispatcher needs."""
    folder = Path(settings.backup_folder).expanduser().absolute() if settings.backup_folder else None
    nightly = (settings.nightly_at, settings.zone)
    plan = MaintenancePlan(
        folder,
        settings.backup_keep,
        settings.keep_days,
        *nightly,
        settings.audit_days,
        settings.disk_free * 2**20,
        settings.alert_to,
    )
    return WorkerSettings(
        settings.database_url,
        settings.pool_processes,
        settings.chunk_timeout,
        settings.chunk_cases,
        plan,
        settings.log_format,
        settings.executor,
        quota_of(settings),
        settings.reports,
    )


class StopFlag:
    """Set by a signal or another thread, asked by the dispatcher's loop."""

    def __init__(self) -> None:
        self._set = False

    def set(self) -> None:
        """Request the end."""
        self._set = True

    def __call__(self) -> bool:
        return self._set


def owner_name() -> str:
    """Host and id of this process, for display."""
    return f"{socket.gethostname()}:{os.getpid()}"


def pool(settings: WorkerSettings) -> Executor:
    """The executor of these settings: Dask, or a process pool whose processes start with the first chunk."""
    if settings.executor != "pool":
        return _cluster(settings)
    from sprag_study.worker.executors.process_pool import ProcessPoolExecutor

    return ProcessPoolExecutor(settings.processes, chunk_timeout=settings.chunk_timeout)


def _cluster(settings: WorkerSettings, *, renew: bool = False) -> Executor:
    try:
        from sprag_study.worker.executors.dask import DaskExecutor
    except ImportError:
        raise ExecutorError('Dask is not installed: pip install "sprag-study[cluster]"') from None
    url = settings.executor if "://" in settings.executor else ""
    return DaskExecutor(url, settings.processes, chunk_timeout=settings.chunk_timeout, renew=renew)


def renewed_pool(settings: WorkerSettings) -> Executor:
    """A new pool whose processes compile every kernel anew; the caches of all hosts are cleared."""
    if "://" in settings.executor:
        return _cluster(settings, renew=True)
    models.discard_compiled()
    return pool(settings)


def run_dispatcher(
    settings: WorkerSettings,
    stopping: Callable[[], bool],
    *,
    say: Callable[[str], None] = _LOG.info,
    executor: Callable[[WorkerSettings], Executor] = pool,
    renewed: Callable[[WorkerSettings], Executor] = renewed_pool,
    take_over: bool = False,
) -> None:
    """Run the studies of the database until ``stopping()``.

    On a server it shares them with the other dispatchers. Of a file, it waits as a standby while another dispatcher is
    active. With ``take_over`` it does not wait: the other one can no longer store anything and ends when it notices; a
    hung one on this host is killed. On a server ``take_over`` ends those that have not responded for `HUNG_SECONDS`.

    Raises StoreError (EpochLostError when another dispatcher took over) and ExecutorError, each with one sentence.
    """
    traces.start()
    chunking = Chunking(settings.chunk_cases, settings.processes, settings.chunk_timeout)
    with Store.open(settings.database_url, chunking=chunking, create=False) as store:
        store.require_sound()
        store.people.default_quota = settings.quota
        lock = lock_of(store)
        plan = _possible(store, settings.maintenance, say)
        maintenance = Maintenance(store, plan, delivery=settings.delivery)
        reports = [Reporter(store, settings.delivery)] if settings.delivery.wanted else []
        chores = Chores(
            lock,
            [Scheduler(store), maintenance, Housekeeping(store, Watchdog(store).look, Scrubbing(store).look), *reports],
        )
        try:
            if take_over:
                if isinstance(lock, DispatcherLock):
                    _take_over(store, lock, say)
                else:
                    _end_silent(store, lock, say)
            if not _stand_by(store, lock, stopping, say):
                return
            who = f"{settings.processes} processes" if settings.executor == "pool" else settings.executor
            say(f"worker with {who} is working on {store.session.location}")
            dispatcher = Dispatcher(
                store.work,
                executor(settings),
                SystemClock(),
                owner=owner_name(),
                renew=lambda: renewed(settings),
                news=store.session.news(),
            )
            chores.start()
            dispatcher.run(stopping)
        finally:
            chores.stop()
            lock.release()
            traces.stop()


def _possible(store: Store, plan: MaintenancePlan, say: Callable[[str], None]) -> MaintenancePlan:
    """The plan, without backups for a database on a server."""
    if plan.folder is None or not store.session.on_server:
        return plan
    say(f"no backups are made of {store.session.location}: use PostgreSQL's own tools, such as pg_dump")
    return replace(plan, folder=None)


def lock_of(store: Store) -> DispatcherLock | ServerLock:
    """What makes this process a dispatcher of the database: the lock of its file, or its presence on the server."""
    if not store.session.on_server:
        return DispatcherLock(store.session.path)
    store.dispatchers.presence = lock = store.session.server_lock(owner_name())
    return lock


def _end_silent(store: Store, lock: ServerLock, say: Callable[[str], None]) -> None:
    """End the dispatchers on a server that do not respond, and a transaction that blocks all others."""
    if not store.session.can_write(LOCKED_SECONDS) and lock.end_writer():
        say("a hung transaction that blocked all others was ended")
    now = store.clock.now()
    silent = [
        record
        for record in store.dispatchers.all()
        if record.ended_at is None and (now - record.heartbeat_at).total_seconds() > HUNG_SECONDS
    ]
    lock.end([record.epoch for record in silent])
    for record in silent:
        say(f"process {record.owner} did not respond and was ended; its studies are taken over")


def _stand_by(
    store: Store, lock: DispatcherLock | ServerLock, stopping: Callable[[], bool], say: Callable[[str], None]
) -> bool:
    """Wait for the lock; False when ``stopping()`` came first. A holder that no longer responds is reported once."""
    if lock.take():
        return True
    say(f"another worker (process {lock.holder()}) is working on {store.session.location}; waiting for it to stop")
    reported = False
    while not lock.take():
        if stopping():
            return False
        if not reported and (silence := store.dispatchers.silence() or 0.0) > SILENT_SECONDS:
            reported = True
            say(
                f"process {lock.holder()} has not responded for {silence:.0f} s; stop it, or continue without it: "
                "`sprag admin worker --take-over`"
            )
        time.sleep(STANDBY_SECONDS)
    return True


def _take_over(store: Store, lock: DispatcherLock, say: Callable[[str], None]) -> None:
    """Take the lock from its holder. A hung holder is ended, because its transaction may block all others."""
    if lock.take():
        return
    holder = lock.holder()
    hung = (store.dispatchers.silence() or 0.0) > HUNG_SECONDS or not store.session.can_write(LOCKED_SECONDS)
    if hung and lock.end_holder():
        say(f"process {holder} hung and was ended")
    lock.seize()


def stop_on_signals() -> StopFlag:
    """A flag set by SIGTERM and SIGINT, so that the loop ends cleanly; for the main thread of a process."""
    flag = StopFlag()

    def ask(_number: int, _frame: FrameType | None) -> None:
        flag.set()

    signal.signal(signal.SIGTERM, ask)
    signal.signal(signal.SIGINT, ask)
    return flag


def start_dispatcher_process(settings: WorkerSettings) -> SpawnProcess:
    """Start a dispatcher as a child of this process, which it does not outlive; ``terminate()`` ends it cleanly."""
    process = get_context("spawn").Process(
        target=_child, args=(settings, os.getpid()), name="sprag-dispatcher", daemon=False
    )
    with interrupts_held_back():
        process.start()
    return process


def require_file(url: str) -> None:
    """Raise DatabaseError where the service's database file is gone: a worker must not create an empty one."""
    file = file_of(url)
    if file is not None and not file.exists():
        raise DatabaseError(f"the database file {file} was deleted or moved", "database-replaced")


def _child(settings: WorkerSettings, parent: int) -> None:
    flag = stop_on_signals()
    ignore_interrupts()
    end_with_parent(parent, signal.SIGTERM)
    logs.configure(settings.log_format, requests=False)
    try:
        require_file(settings.database_url)
        run_dispatcher(settings, flag)
    except (EpochLostError, StoreError, ExecutorError) as error:
        _LOG.error("the worker ends: %s", error)
        raise SystemExit(3) from None
