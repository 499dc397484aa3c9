"""Metrics of what keeps a service running: schedules, backups, disks, queues, and the executor with its workers."""

from __future__ import annotations

import shutil
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from prometheus_client.core import GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from sprag_study.service.jobs.maintenance import backups
from sprag_study.service.jobs.nights import why_off
from sprag_study.service.schedules.outcomes import Result
from sprag_study.service.storage.schedules.runs import RunState

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from sprag_study.service.http.shares import Shares
    from sprag_study.service.settings import Settings
    from sprag_study.service.storage.schedules.runs import ScheduleRecord
    from sprag_study.service.storage.store import Store

#: States of workers in the reports of executors.
WORKER_STATES: Final = ("usable", "busy", "refused")
#: Values of the labels of one number.
Labels = tuple[str, ...]
#: Labels of a schedule: `worker.limits.MAX_SCHEDULES` bounds their number.
_SCHEDULE: Final = ("schedule", "name")


@dataclass(frozen=True, slots=True)
class Queue:
    """A queue inside the service, by name."""

    name: str
    shares: Shares


class OperationCollector(Collector):
    """Metrics of schedules, backups, disks, queues and the executor.

    Parameters
    ----------
    settings : Settings
        `backup_folder`.
    store : Store
    queues : iterable of Queue
    """

    def __init__(self, settings: Settings, store: Store, queues: Iterable[Queue] = ()) -> None:
        self._store = store
        self._queues = tuple(queues)
        server = store.session.on_server  # which is backed up with its own tools, and reports no free space
        folder = settings.backup_folder
        self._backups = Path(folder).expanduser().absolute() if folder and not server else None
        self._disks: dict[str, Path] = {} if server else {"database": store.session.path.parent}
        if self._backups is not None:
            self._disks["backups"] = self._backups

    def describe(self) -> Iterable[Metric]:
        """Describe nothing, so that registration reads nothing."""
        return ()

    def collect(self) -> Iterator[Metric]:
        """Read the metrics; raises StoreError."""
        yield from _schedules(self._store.schedules.all(), off=why_off(self._store) is not None)
        yield from self._backup_files()
        yield from self._space()
        lengths = _family("queue_requests", "Requests that wait for a process or are worked on by one.", "queue")
        for queue in self._queues:
            lengths.add_metric((queue.name,), queue.shares.requests)
        yield lengths
        alive = [record for record in self._store.dispatchers.all() if not (record.ended_at or record.silent)]
        yield _gauge("dispatchers", "Dispatchers that respond.", len(alive))
        yield from _executors([record.report for record in alive if record.report])

    def _backup_files(self) -> Iterator[Metric]:
        """The nightly backups; nothing where the service makes none."""
        if self._backups is None:
            return
        found = []
        with suppress(OSError):  # the folder cannot be read: there is no backup that could be used
            found = backups(self._backups)
        yield _gauge("backups", "Backups in the folder.", len(found))
        with suppress(IndexError, OSError):
            when, file = found[-1]
            yield _gauge("backup_last_size_bytes", "Size of the latest backup.", file.stat().st_size)
            yield _gauge("backup_last_timestamp_seconds", "When the latest backup was made.", when.timestamp())

    def _space(self) -> Iterator[Metric]:
        yield _gauge("database_size_bytes", "Size of the database.", self._store.figures.database_bytes())
        free = _family("disk_free_bytes", "Free space on the disk of the database and of the backups.", "disk")
        size = _family("disk_size_bytes", "Size of the disk of the database and of the backups.", "disk")
        for name, folder in self._disks.items():
            with suppress(OSError):
                usage = shutil.disk_usage(folder)
                free.add_metric((name,), usage.free)
                size.add_metric((name,), usage.total)
        yield free
        yield size


def _schedules(records: Iterable[ScheduleRecord], *, off: bool) -> Iterator[Metric]:
    """Each schedule: when it is due next unless all are ``off``, when its last was, and its outcome."""
    due = _family("schedule_next_due_timestamp_seconds", "When the schedule is due next.", *_SCHEDULE)
    last = _family("schedule_last_run_timestamp_seconds", "When its last due time was taken up.", *_SCHEDULE)
    outcome = _family("schedule_last_run", "1 for the outcome of its last due time.", *_SCHEDULE, "outcome")
    result = _family("schedule_last_result", "1 for what became of its last due time and study.", *_SCHEDULE, "result")
    trouble = _family("schedule_last_trouble", "1 where somebody should look at its last run.", *_SCHEDULE)
    missed = _family("schedule_last_run_missed", "Due times before the last one that were missed.", *_SCHEDULE)
    for record in records:
        labels = (record.id, record.fields.name)
        if record.next_due is not None and not off:
            due.add_metric(labels, record.next_due.timestamp())
        if record.last is not None:
            last.add_metric(labels, record.last.begun_at.timestamp())
            missed.add_metric(labels, record.last.missed)
            trouble.add_metric(labels, float(record.last.outcome.trouble))
            for each in Result:
                result.add_metric((*labels, each.value), float(record.last.outcome.result is each))
            for state in RunState:
                outcome.add_metric((*labels, state.value), float(record.last.state is state))
    yield from (due, last, outcome, result, trouble, missed)


def _executors(reports: Sequence[Mapping[str, Any]]) -> Iterator[Metric]:
    """What the dispatchers reported: workers by host, their rates, chunks and shortages; nothing without a report."""
    if not reports:
        return
    label = "executor"
    workers, rates, idle, flight = Counter[Labels](), Counter[Labels](), Counter[Labels](), Counter[Labels]()
    short: dict[str, bool] = {}
    for report in reports:
        kind = report["executor"]
        for host in report["hosts"]:
            place = (kind, host["host"])
            workers.update({(*place, state): host[state] for state in WORKER_STATES})
            rates[place] += host["cases_per_second"]
            idle[place] += host["idle_threads"]
        flight[kind,] += report["chunks_in_flight"]
        short[kind] = short.get(kind, True) and bool(report["shortage"])
    yield _filled(workers, "workers", "Processes that run chunks, by host.", label, "host", "state")
    yield _filled(rates, "host_cases_per_second", "Cases per second of a host over the last minute.", label, "host")
    yield _filled(idle, "idle_threads", "Threads of usable workers that run nothing.", label, "host")
    yield _filled(flight, "executor_chunks_in_flight", "Chunks that were given to the executor.", label)
    yield _filled(
        {(kind,): float(none) for kind, none in short.items()},
        "executor_shortage",
        "1 while no dispatcher with such an executor can run anything.",
        label,
    )


def _filled(values: Mapping[Labels, float], name: str, help_text: str, *labels: str) -> GaugeMetricFamily:
    family = _family(name, help_text, *labels)
    for texts, value in values.items():
        family.add_metric(texts, value)
    return family


def _gauge(name: str, help_text: str, value: float) -> GaugeMetricFamily:
    return GaugeMetricFamily(f"sprag_{name}", help_text, value)


def _family(name: str, help_text: str, *labels: str) -> GaugeMetricFamily:
    return GaugeMetricFamily(f"sprag_{name}", help_text, labels=labels)
