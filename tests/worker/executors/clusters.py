"""Small Dask clusters on this machine, as processes."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

import psutil
import pytest

from benchmarks.faults.harness import free_port, kill_family
from tests.conftest import ROOT

DEADLINE = 600.0
#: Connections that Dask gives up while a scheduler dies are closed by the garbage collector, which warns of each.
LEAVES_CONNECTIONS = pytest.mark.filterwarnings("ignore:unclosed <socket:ResourceWarning")
#: Without a dashboard there is still a server of health and metrics; any port will do.
_QUIET = ("--dashboard-address", "127.0.0.1:0")


@dataclass
class Cluster:
    """Processes of a cluster on this machine."""

    port: int
    scheduler: subprocess.Popen[bytes] | None = None
    workers: list[subprocess.Popen[bytes]] = field(default_factory=list)

    @property
    def url(self) -> str:
        return f"dask://127.0.0.1:{self.port}"

    def start_scheduler(self) -> None:
        self.scheduler = _dask("scheduler", "--host", "127.0.0.1", "--port", self.port, "--no-dashboard", *_QUIET)

    def start_worker(self, count: int = 1, folder: Path = ROOT, **environment: str) -> None:
        """Start workers that import Sprag from ``folder``."""
        options = ("--nthreads", 1, "--nworkers", count, "--no-dashboard", "--memory-limit", 0, "--host", "127.0.0.1")
        arguments = ("worker", f"tcp://127.0.0.1:{self.port}", *options, "--death-timeout", DEADLINE)
        self.workers.append(_dask(*arguments, folder=folder, **environment))

    def computing(self) -> list[psutil.Process]:
        """The processes that run chunks: children of the workers' nannies."""
        found = []
        for worker in self.workers:
            with suppress(psutil.NoSuchProcess):
                found += [c for c in psutil.Process(worker.pid).children() if "spawn_main" in " ".join(c.cmdline())]
        return found


def _dask(*arguments: object, folder: Path = ROOT, **environment: str) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-W", "ignore", "-m", "distributed.cli.dask_" + str(arguments[0])]
    return subprocess.Popen(
        [*command, *map(str, arguments[1:])], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        cwd=folder, env={**os.environ, "PYTHONPATH": str(folder), **environment},
    )  # fmt: skip


@contextmanager
def clusters() -> Iterator[Cluster]:
    made = Cluster(free_port())
    try:
        yield made
    finally:
        for process in (*made.workers, made.scheduler):
            if process is not None:
                kill_family(process)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ResourceWarning)
            gc.collect()
