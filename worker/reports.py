"""What an executor reports of its workers: which can be used, which are refused and why, and how fast each host is."""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import asdict, dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Mapping

#: Seconds over which the rate of a host is averaged.
RATE_SECONDS: Final = 60.0
#: Most refused workers that are listed with their reasons.
MAX_REFUSED: Final = 100


@cache
def processor() -> str:
    """The processor of this machine as LLVM names it, for example "znver5"."""
    import llvmlite.binding as llvm

    return str(llvm.get_host_cpu_name())


@dataclass(frozen=True, slots=True)
class WorkerReport:
    """One process that runs chunks, or wants to.

    Attributes
    ----------
    address, host : str
    usable : bool
        Whether it is given chunks; False while it is examined, too.
    busy : bool
        Whether it runs a chunk or loads a kernel.
    threads : int
        Its threads, of which it uses one.
    refusal : str
        Why it is refused, as a clause; "" where it is not.
    processor : str
        As its own `processor` names it; "" before it has told.
    """

    address: str
    host: str
    usable: bool
    busy: bool = False
    threads: int = 1
    refusal: str = ""
    processor: str = ""


@dataclass(frozen=True, slots=True)
class ExecutorReport:
    """The workers of an executor at one moment.

    Attributes
    ----------
    executor : str
        "pool", "dask" or "inline".
    workers : tuple of WorkerReport
    cases : Mapping[str, int]
        Cases run on each host since the executor began.
    shortage : str
        Why nothing can be run at present, as a sentence; "" where chunks can run.
    scheduler, dashboard : str
        Address of the scheduler and URL of its dashboard; "" where there is none.
    """

    executor: str
    workers: tuple[WorkerReport, ...]
    cases: Mapping[str, int]
    shortage: str = ""
    scheduler: str = ""
    dashboard: str = ""


@dataclass(slots=True)
class _Host:
    """The workers of one host in the stored report."""

    host: str
    processor: str = ""
    workers: int = 0
    usable: int = 0
    refused: int = 0
    busy: int = 0
    idle_threads: int = 0
    cases_per_second: float = 0.0


@dataclass(slots=True)
class Reporter:
    """Sums up the workers of each host, with their rates over the last `RATE_SECONDS`."""

    _past: deque[tuple[float, Counter[str]]] = field(default_factory=deque)

    def summary(self, report: ExecutorReport, chunks_in_flight: int, now: float) -> dict[str, Any]:
        """The workers as JSON data, by host; called at each heartbeat, with the time of a monotonic clock (s)."""
        hosts: dict[str, _Host] = {}
        for worker in report.workers:
            host = hosts.setdefault(worker.host, _Host(worker.host))
            host.processor = host.processor or worker.processor
            host.workers += 1
            host.usable += worker.usable
            host.refused += bool(worker.refusal)
            host.busy += worker.busy
            host.idle_threads += worker.threads - worker.busy if worker.usable else 0
        for name, rate in self._rates(report.cases, now).items():
            if name in hosts:
                hosts[name].cases_per_second = rate
        refused = [worker for worker in report.workers if worker.refusal]
        return {
            "executor": report.executor,
            "scheduler": report.scheduler,
            "dashboard": report.dashboard,
            "shortage": report.shortage,
            "chunks_in_flight": chunks_in_flight,
            "hosts": [asdict(host) for _, host in sorted(hosts.items())],
            "refused": [
                {"address": worker.address, "host": worker.host, "reason": worker.refusal}
                for worker in refused[:MAX_REFUSED]
            ],
        }

    def _rates(self, cases: Mapping[str, int], now: float) -> dict[str, float]:
        counts = Counter(cases)
        while len(self._past) > 1 and now - self._past[1][0] >= RATE_SECONDS:
            self._past.popleft()
        self._past.append((now, counts))
        since, before = self._past[0]
        if now <= since:
            return {}
        return {host: (count - before[host]) / (now - since) for host, count in counts.items()}
