"""kill -9 of the parts of a Dask cluster while a study runs on it, at moments drawn from a seed."""

from __future__ import annotations

import random
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import psutil

from benchmarks.faults import harness
from benchmarks.faults.cache import own_cache

#: What is killed, and how often in relation. A host takes its worker and that worker's nanny with it.
TARGETS = {"worker": 6, "host": 2, "scheduler": 2}
#: Starts a command again when it has ended, as systemd would: a nanny ends with a worker that dies while it starts, and
#: with its link to the scheduler.
_AGAIN = ("sh", "-c", 'while :; do "$@"; sleep 0.2; done', "again")


class Cluster:
    """A scheduler at ``host`` and its workers, as processes; ``begin`` comes before their commands."""

    def __init__(self, host: str = "127.0.0.1", protocol: str = "tcp", **environment: str) -> None:
        self.port = harness.free_port()
        self.host = host
        self._protocol = protocol
        self._environment = environment
        self.scheduler: subprocess.Popen[bytes] | None = None
        self.workers: list[subprocess.Popen[bytes]] = []

    @property
    def url(self) -> str:
        """Its address for the service."""
        return f"dask://{self.host}:{self.port}"

    def start_scheduler(self, begin: Sequence[str] = ()) -> None:
        """Start the scheduler, which knows nothing of one before it."""
        self.scheduler = self._start(
            begin, "scheduler", "--port", self.port, "--no-dashboard", "--dashboard-address", "127.0.0.1:0",
            "--host", self.host, "--protocol", self._protocol,
        )  # fmt: skip

    def start_worker(self, begin: Sequence[str] = (), host: str = "127.0.0.1") -> None:
        """Start a worker with its nanny, again and again."""
        scheduler = f"{self._protocol}://{self.host}:{self.port}"
        begun = self._start(
            [*begin, *_AGAIN], "worker", scheduler, "--nthreads", 1, "--no-dashboard", "--memory-limit", 0,
            "--host", host, "--death-timeout", harness.PATIENCE,
        )  # fmt: skip
        self.workers.append(begun)

    def _start(self, begin: Sequence[str], part: str, *options: object) -> subprocess.Popen[bytes]:
        command = [*begin, sys.executable, "-W", "ignore", "-m", f"distributed.cli.dask_{part}", *map(str, options)]
        return subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            env=harness.environment(**self._environment),
        )  # fmt: skip

    def computing(self) -> list[psutil.Process]:
        """The processes that run chunks, children of the nannies."""
        found = []
        for worker in self.workers:
            with suppress(psutil.Error):
                children = psutil.Process(worker.pid).children(recursive=True)
                found += [child for child in children if "spawn_main" in " ".join(child.cmdline())]
        return found

    def close(self) -> None:
        """Kill everything."""
        for process in (*self.workers, self.scheduler):
            if process is not None:
                harness.kill_family(process)
        self.workers.clear()


@contextmanager
def clusters(host: str = "127.0.0.1", protocol: str = "tcp", **environment: str) -> Iterator[Cluster]:
    """An empty cluster, whose processes are all ended on exit."""
    made = Cluster(host, protocol, **environment)
    try:
        yield made
    finally:
        made.close()


def cluster(
    folder: Path, *, cases: int, count: int, seed: int, periods: float, workers: int = 2, chunk: int = 50
) -> dict[str, Any]:
    """Run a study of ``cases`` cases under ``count`` kills; gives the figures."""
    draw = random.Random(seed)
    made = harness.spec(cases, periods)
    # Two deaths in a row make a host throw its kernels away: here not those of the user.
    cache = {"SPRAG_KERNEL_CACHE": str(own_cache(folder, made))}
    killed: Counter[str] = Counter()
    with clusters(**cache) as dask:
        dask.start_scheduler()
        for _ in range(workers):
            dask.start_worker()
        settings = {"SPRAG_CHUNK_CASES": str(chunk), "SPRAG_EXECUTOR": dask.url, **cache}
        with harness.running(folder, "--processes", workers, **settings) as service:
            study = service.submit(made)
            begin = time.monotonic()
            for share in sorted(draw.uniform(0.02, 0.95) for _ in range(count)):
                harness.until(
                    lambda share=share: harness.done(service.database, study) >= share * cases, "the study goes on"
                )
                time.sleep(draw.uniform(0.0, 0.5))
                killed[_kill(dask, draw)] += 1
            service.finish(study)
            seconds = time.monotonic() - begin
        log = service.log.read_text()
        harness.compare(service.database, study, made)
    return {
        "cases": cases,
        "kills": dict(killed),
        "missing, duplicate and wrong rows": 0,
        "times the scheduler was found gone": log.count("cannot be reached; retrying"),
        "times kernels were compiled anew": log.count("compiles its kernels anew") + log.count("are compiled anew"),
        "seconds": round(seconds, 1),
    }


def _kill(dask: Cluster, draw: random.Random) -> str:
    target = draw.choices(list(TARGETS), list(TARGETS.values()))[0]
    if target == "scheduler" and dask.scheduler is not None:
        count = len(dask.workers)
        dask.close()  # workers end without their scheduler, in their own time
        dask.start_scheduler()
        for _ in range(count):
            dask.start_worker()
    elif target == "host":
        harness.kill_family(dask.workers.pop(draw.randrange(len(dask.workers))))
        dask.start_worker()
    else:
        harness.until(dask.computing, "there is a worker")
        with suppress(psutil.Error):
            draw.choice(dask.computing()).kill()
    return target
