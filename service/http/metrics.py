"""Metrics of the service in the text format of Prometheus. Labels are few and never ids of studies or requests.

Other processes run the cases; their outcomes are read from the database when the metrics are requested.
"""

from __future__ import annotations

import bisect
import threading
from collections import deque
from collections.abc import Iterable, Iterator
from importlib.metadata import version
from typing import TYPE_CHECKING, Final

from prometheus_client import CONTENT_TYPE_LATEST, CollectorRegistry, Counter, Gauge, Histogram, Info, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, HistogramMetricFamily, Metric
from prometheus_client.registry import Collector

from sprag_study.service.jobs.reports.watchdog import late_runs
from sprag_study.worker import models
from sprag_study.worker.states import StudyState

if TYPE_CHECKING:
    from datetime import datetime

    from sprag_study.service.storage.figures import FinishedWork
    from sprag_study.service.storage.store import Store

CONTENT_TYPE: Final = CONTENT_TYPE_LATEST
METHODS: Final = frozenset({"GET", "HEAD", "POST", "PATCH", "DELETE"})
#: Upper bounds in s for one case, for an answer, for waiting for the database.
CASE_BOUNDS: Final = (0.0001, 0.0003, 0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0)
REQUEST_BOUNDS: Final = (0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0)
WAIT_BOUNDS: Final = (0.0001, 0.001, 0.01, 0.1, 1.0, 10.0, 30.0)
#: Seconds over which the current rate is averaged.
RATE_SECONDS: Final = 60.0


class Metrics:
    """The metrics of one service on ``store``, and those that ``more`` collects."""

    def __init__(self, store: Store, *more: Collector) -> None:
        self._registry = CollectorRegistry()
        self._requests = Counter(
            "sprag_http_requests",
            "Requests answered.",
            ("method", "route", "status"),
            registry=self._registry,
        )
        self._seconds = Histogram(
            "sprag_http_request_seconds", "Time to answer.", ("route",), buckets=REQUEST_BOUNDS, registry=self._registry
        )
        self._wait = Histogram(
            "sprag_database_wait_seconds",
            "Time that the service waited for the database to begin reading or writing.",
            ("kind",),
            buckets=WAIT_BOUNDS,
            registry=self._registry,
        )
        self._in_progress = Gauge(
            "sprag_http_requests_in_progress", "Requests that are being answered.", registry=self._registry
        )
        for collector in (StudyCollector(store), *more):
            self._registry.register(collector)
        about = Info("sprag", "The program that answers.", registry=self._registry)
        about.info({"version": version("sprag-study"), "engine": models.ENGINE_VERSION})
        store.session.on_wait = self.waited

    def begun(self) -> None:
        """Count a request that is being answered, until `answered`."""
        self._in_progress.inc()

    def answered(self, method: str, route: str, status: int, seconds: float) -> None:
        """Count a request; ``route`` is the pattern of its URL."""
        self._in_progress.dec()
        # Arbitrary input of clients must not create new series.
        self._requests.labels(method if method in METHODS else "other", route, str(status)).inc()
        self._seconds.labels(route).observe(seconds)

    def waited(self, kind: str, seconds: float) -> None:
        """Count a wait for the database; ``kind`` is "read" or "write"."""
        self._wait.labels(kind).observe(seconds)

    def text(self) -> bytes:
        """All metrics in the text format; raises StoreError."""
        return generate_latest(self._registry)


class StudyCollector(Collector):
    """Metrics of studies and cases from the database.

    Finished cases are counted from the start of the collector, so that deleting studies does not reduce the count.
    """

    def __init__(self, store: Store) -> None:
        self._store = store
        self._lock = threading.Lock()
        self._since = store.clock.now()
        self._began = self._since
        self._cases = 0
        self._sum = 0.0
        self._counts = [0] * (len(CASE_BOUNDS) + 1)
        self._recent: deque[FinishedWork] = deque()

    def describe(self) -> Iterable[Metric]:
        """Describe nothing, so that registration reads nothing."""
        return ()

    def collect(self) -> Iterator[Metric]:
        """Read the metrics; raises StoreError."""
        now = self._store.clock.now()
        with self._lock:
            self._look(now)
            yield CounterMetricFamily("sprag_cases_done", "Cases that came to an ending.", value=self._cases)
            buckets, total = [], 0
            for bound, count in zip((*map(str, CASE_BOUNDS), "+Inf"), self._counts, strict=True):
                total += count
                buckets.append((bound, float(total)))
            yield HistogramMetricFamily(
                "sprag_case_seconds", "Time of a chunk from claim to commit over its cases.", buckets, self._sum
            )
            period = min(RATE_SECONDS, max((now - self._began).total_seconds(), 1e-9))
            rate = sum(work.cases for work in self._recent) / period if self._recent else 0.0
        yield GaugeMetricFamily("sprag_cases_per_second", "Cases per second over the last minute.", rate)
        figures = self._store.figures.current()
        studies = GaugeMetricFamily("sprag_studies", "Studies by their state.", labels=("state",))
        for state in StudyState:
            studies.add_metric((state.value,), figures.studies.get(state.value, 0))
        yield studies
        yield GaugeMetricFamily(
            "sprag_queue_cases",
            "Cases still to be run, of all studies that have not ended.",
            figures.waiting,
        )
        endings = GaugeMetricFamily("sprag_stored_cases", "Cases in the database by their ending.", labels=("ending",))
        for ending, cases in figures.endings.items():
            endings.add_metric((ending,), cases)
        yield endings
        yield GaugeMetricFamily(
            "sprag_reused_cases", "Cases in the database that were taken from other studies.", figures.reused
        )
        yield GaugeMetricFamily(
            "sprag_schedules_late",
            "Due times of schedules at which nothing has run although it should.",
            len(late_runs(self._store)),
        )
        if figures.heartbeat is not None:
            age = (now - figures.heartbeat).total_seconds()
            said = "Seconds since the last heartbeat; of several dispatchers, the longest."
            yield GaugeMetricFamily("sprag_worker_heartbeat_age_seconds", said, age)

    def _look(self, now: datetime) -> None:
        for work in self._store.figures.finished_since(self._since):
            each = work.seconds / work.cases
            self._counts[bisect.bisect_left(CASE_BOUNDS, each)] += work.cases
            self._cases += work.cases
            self._sum += work.seconds
            self._since = max(self._since, work.finished_at)
            self._recent.append(work)
        while self._recent and (now - self._recent[0].finished_at).total_seconds() > RATE_SECONDS:
            self._recent.popleft()
