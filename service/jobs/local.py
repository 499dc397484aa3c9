"""Running one study to its end without a server: `sprag run`."""

from __future__ import annotations

import signal
import tempfile
import threading
import time
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sprag_study.service.jobs.dispatching import (
    STANDBY_SECONDS,
    StopFlag,
    WorkerSettings,
    lock_of,
    owner_name,
    pool,
    renewed_pool,
)
from sprag_study.service.stale_files import marked, sweep
from sprag_study.service.storage.part import SystemClock
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.work.dispatchers import run_owner
from sprag_study.service.storage.work.room import GOES_ON
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.dispatcher import Dispatcher
from sprag_study.worker.executors.inline import InlineExecutor
from sprag_study.worker.models import estimate_seconds_per_case
from sprag_study.worker.planning import most_cases
from sprag_study.worker.ports import ExecutorError, StoreError
from sprag_study.worker.states import StudyState, TransitionError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from datetime import datetime
    from types import FrameType

    from sprag_study.service.storage.studies.records import Progress, StudyRecord
    from sprag_study.worker.ports import Executor
    from sprag_study.worker.study import Study

_FOLDER_PREFIX = "sprag-run-"
#: Endings of the reason of a study held for lack of space; they apply to services, not here.
_LATER = (f"; {GOES_ON}", "; it is retried from time to time")
#: Shortest estimated time (s) of a study for which a pool pays off.
_NO_POOL_SECONDS = 1.0
#: Seconds between two reports of progress.
REPORT_SECONDS = 0.25


class StudyHeldError(StoreError):
    """The study was held before its end; the message says why."""


class RunInterruptedError(KeyboardInterrupt):
    """The run was interrupted and its study cancelled; ``record`` shows what is kept."""

    def __init__(self, record: StudyRecord) -> None:
        super().__init__()
        self.record = record


@dataclass(frozen=True, slots=True)
class LocalRun:
    """A study that was run to its end, and the store that holds its rows while the context lasts."""

    store: Store
    record: StudyRecord


@contextmanager
def run_folder() -> Iterator[Path]:
    """A temporary folder, deleted with the context; those that killed processes left behind are deleted before."""
    sweep(Path(tempfile.gettempdir()).glob(f"{_FOLDER_PREFIX}*"))
    with tempfile.TemporaryDirectory(prefix=_FOLDER_PREFIX) as folder, marked(Path(folder)):
        yield Path(folder)


@contextmanager
def opened(database_url: str | None, chunking: Chunking, content: bytes | None = None) -> Iterator[Store]:
    """The store of a database, or of a temporary one, which is deleted with the context.

    ``content`` is the file of the temporary one, empty by default.
    """
    with run_folder() as folder:
        file = folder / "run.sqlite3"
        if content is not None:
            file.write_bytes(content)
        with Store.open(database_url or f"sqlite:///{file}", chunking=chunking) as store:
            yield store


@contextmanager
def run_here(
    spec: Mapping[str, Any],
    study: Study,
    *,
    processes: int,
    database_url: str | None = None,
    chunk_cases: int = 0,
    chunk_timeout: float = 600.0,
    warnings: Sequence[str] = (),
    fresh: bool = False,
    finish_by: datetime | None = None,
    on_progress: Callable[[Progress], None] | None = None,
    setting: str = "pool",
    executor: Executor | None = None,
) -> Iterator[LocalRun]:
    """Run ``study`` to its end on ``processes`` processes and return its rows.

    Without ``database_url`` the database is temporary and is deleted with the context. Otherwise as `run_stored`, whose
    errors it raises.
    """
    with opened(database_url, Chunking(chunk_cases, max(processes, 1), chunk_timeout)) as store, _noted() as noted:
        record = store.studies.create(spec, study, warnings=warnings, fresh=fresh, finish_by=finish_by)
        kept, settings = database_url is not None, _settings(store, processes, chunk_timeout, setting)
        yield LocalRun(store, _run(store, record, settings, noted, kept, on_progress, executor))
        if noted():
            raise KeyboardInterrupt


def run_stored(
    store: Store,
    record: StudyRecord,
    *,
    processes: int,
    chunk_timeout: float,
    kept: bool,
    on_progress: Callable[[Progress], None] | None = None,
) -> StudyRecord:
    """Run a study of a database to its end; ``kept``: the database outlives this process.

    When another dispatcher is active on the database, it runs the study while this process waits. ``processes`` 0 runs
    the cases in this process, which suits small studies; 1 or more start a pool. At its deadline the study ends with
    what is done. Raises StoreError and ExecutorError, each with one sentence, and RunInterruptedError on Ctrl-C; the
    study is then cancelled, so that no later worker continues it.
    """
    with _noted() as noted:
        return _run(store, record, _settings(store, processes, chunk_timeout, "pool"), noted, kept, on_progress, None)


def _settings(store: Store, processes: int, chunk_timeout: float, setting: str) -> WorkerSettings:
    url = store.session.url.render_as_string(hide_password=False)
    return WorkerSettings(url, processes, chunk_timeout, executor=setting)


def _run(
    store: Store,
    record: StudyRecord,
    settings: WorkerSettings,
    noted: Callable[[], bool],
    kept: bool,
    on_progress: Callable[[Progress], None] | None,
    executor: Executor | None,
) -> StudyRecord:
    watch = _Watch(store, record.id, on_progress, noted)
    lock = lock_of(store)
    owner = run_owner(owner_name(), record.id)
    pooled = executor is None and settings.processes > 0
    try:
        while not watch.ended():
            if lock.take():
                runner = executor or (pool(settings) if pooled else InlineExecutor())
                renew = partial(renewed_pool, settings) if pooled else None
                news = store.session.news()
                Dispatcher(
                    store.work, runner, SystemClock(), owner=owner, only=record.number, renew=renew, news=news
                ).run(watch.ended)
            else:
                time.sleep(STANDBY_SECONDS)
    except (KeyboardInterrupt, ExecutorError) as error:
        ended = _cancelled(store, record.id, ours=lock.take())
        if isinstance(error, KeyboardInterrupt) and kept:
            raise RunInterruptedError(ended) from None
        raise
    finally:
        lock.release()
    return watch.final(passing=not kept)


@contextmanager
def _noted() -> Iterator[StopFlag]:
    """A flag that is set by every signal that raises KeyboardInterrupt.

    Python drops exceptions that a signal raises in a finaliser or in a callback from C, so the exception alone is not
    reliable.
    """
    flag = StopFlag()

    def note(number: int, frame: FrameType | None) -> None:
        flag.set()
        signal.default_int_handler(number, frame)

    numbers = signal.valid_signals() if threading.current_thread() is threading.main_thread() else ()
    interrupting = [number for number in numbers if signal.getsignal(number) is signal.default_int_handler]
    try:
        for number in interrupting:
            signal.signal(number, note)
        yield flag
    finally:
        for number in interrupting:
            signal.signal(number, signal.default_int_handler)


def pool_size(study: Study, most: int, *, asked: bool) -> int:
    """Number of processes: ``most``, or 0 (this process) where starting a pool takes longer than the study.

    ``asked`` states that the user gave the number.
    """
    if not asked and most_cases(study) * estimate_seconds_per_case(study) < _NO_POOL_SECONDS:
        return 0
    return most


def _cancelled(store: Store, study_id: str, *, ours: bool) -> StudyRecord:
    """Cancel the study unless it has ended; ``ours``: no other dispatcher is there to end it."""
    with suppress(TransitionError):
        record = store.studies.cancel(study_id)
        if ours:
            store.work.settle(store.work.take_over(owner_name()), record.number)
    return store.studies.get(study_id)


class _Watch:
    """Polls one study: reports its progress, detects its end."""

    def __init__(
        self, store: Store, study_id: str, report: Callable[[Progress], None] | None, interrupted: Callable[[], bool]
    ) -> None:
        self._store = store
        self._id = study_id
        self._report = report
        self._interrupted = interrupted
        self._next_report = 0.0

    def ended(self) -> bool:
        """Whether nothing more will be run; raises KeyboardInterrupt where an interrupt was lost."""
        if self._interrupted():
            raise KeyboardInterrupt
        now = time.monotonic()
        if self._report is not None and now >= self._next_report:
            self._report(self._store.studies.progress(self._id))
            self._next_report = now + REPORT_SECONDS
        state = self._store.studies.get(self._id).state
        return state.terminal or state is StudyState.PAUSED

    def final(self, *, passing: bool) -> StudyRecord:
        """The study at its end; raises StudyHeldError when it was held instead; a ``passing`` database loses its rows.

        Nothing resumes by itself here, unlike in a service.
        """
        record = self._store.studies.get(self._id)
        if self._report is not None:
            self._report(self._store.studies.progress(self._id))
        if not record.over:
            raise StudyHeldError(f"the study was held: {_why_held(record, passing=passing)}")
        return record


def _why_held(record: StudyRecord, *, passing: bool) -> str:
    """Why the study was held, and what to do where it was for lack of space."""
    reason = record.reason or "it was paused"
    cause = next((reason.removesuffix(later) for later in _LATER if reason.endswith(later)), None)
    if cause is None:
        return reason
    if passing:
        return f"{cause}; nothing of it is kept: free some space, or name another place with TMPDIR or --db"
    return (
        f"{cause}; {record.done} of {record.cases} cases are kept as {record.id}, and `sprag admin worker` or `sprag "
        "serve` with this database continues it when there is room"
    )
