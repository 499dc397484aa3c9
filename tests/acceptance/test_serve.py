"""`sprag serve` as real processes: its worker is replaced when it dies, and nothing outlives the service."""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Callable
from pathlib import Path

import httpx
import psutil
import pytest

from tests.acceptance.processes import EXAMPLES, SECONDS, Service, service


def until(condition: Callable[[], bool]) -> None:
    """Wait until ``condition`` holds; fails when it takes far too long."""
    deadline = time.monotonic() + SECONDS
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.1)


def worker_of(running: Service) -> psutil.Process:
    """The dispatcher's process: the child that has children of its own."""
    until(lambda: any(child.children() for child in psutil.Process(running.process.pid).children()))
    return next(child for child in psutil.Process(running.process.pid).children() if child.children())


def submit_and_finish(running: Service, duration: str) -> None:
    """A study of that time, which no other study has, goes through."""
    spec = json.loads((EXAMPLES / "one_pendulum.json").read_text())
    spec["run"] = {"duration": duration}
    with httpx.Client(base_url=running.address, timeout=SECONDS) as client:
        address = client.post("/api/v1/studies", json=spec).headers["location"]
        with client.stream("GET", f"{address}/events") as events:
            assert "event: end" in events.iter_lines()
        assert client.get(address).json()["state"] == "finished"


def test_a_killed_worker_is_replaced_and_nothing_outlives_a_killed_service(tmp_path: Path) -> None:
    folder = tmp_path / "killed"
    folder.mkdir()
    alive: list[psutil.Process] = []
    with pytest.raises(AssertionError), service(folder, "--processes", 1) as running:  # noqa: PT012 - it fails at its end
        first = worker_of(running)
        family = [first, *first.children(recursive=True)]
        first.kill()
        assert psutil.wait_procs(family, timeout=SECONDS)[1] == []
        submit_and_finish(running, "4 periods")
        assert worker_of(running) != first
        family = psutil.Process(running.process.pid).children(recursive=True)
        running.process.send_signal(signal.SIGKILL)
        alive = psutil.wait_procs(family, timeout=SECONDS)[1]
        running.process.wait(SECONDS)
    assert (alive, running.process.returncode) == ([], -signal.SIGKILL)
    with service(folder, "--processes", 1) as again:
        submit_and_finish(again, "5 periods")
        family = psutil.Process(again.process.pid).children(recursive=True)
    assert psutil.wait_procs(family, timeout=SECONDS)[1] == []
