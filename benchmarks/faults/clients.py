"""Many clients write and read while a study runs: no request fails because the database is locked."""

from __future__ import annotations

import random
import threading
import time
from pathlib import Path
from typing import Any

import httpx
import numpy as np

from benchmarks.faults import harness

_CURVE = {"x": "shaft.load", "y": ["shaft.speed.mean", "torque.mean"]}


class _Client(threading.Thread):
    """Sends requests until the end; records the time of each answer, and every failure."""

    def __init__(self, address: str, study: str, writes: bool, seed: int, end: float) -> None:
        super().__init__()
        self._address, self._study, self._writes, self._end = address, study, writes, end
        self._draw = random.Random(seed)
        self.seconds: list[float] = []
        self.wrong: list[str] = []

    def run(self) -> None:
        """Ask until the end, and until there is an answer."""
        with httpx.Client(base_url=self._address, timeout=harness.PATIENCE, trust_env=False) as http:
            while time.monotonic() < self._end or not (self.seconds or self.wrong):
                begin = time.monotonic()
                try:
                    answer = self._write(http) if self._writes else self._read(http)
                except httpx.HTTPError as error:
                    self.wrong.append(f"{type(error).__name__}: {error}")
                    continue
                self.seconds.append(time.monotonic() - begin)
                # A study that has come to its end meanwhile has no priority any more.
                ended = answer.status_code == 409 and "wrong-state" in answer.text
                if answer.status_code not in (200, 202) and not ended:
                    self.wrong.append(f"{answer.status_code} {answer.text}")

    def _read(self, http: httpx.Client) -> httpx.Response:
        return http.get(f"/studies/{self._study}/curves", params=_CURVE)

    def _write(self, http: httpx.Client) -> httpx.Response:
        """Submit a study of two cases, or change the priority of the one that runs."""
        if self._draw.random() < 0.5:
            key = {"Idempotency-Key": f"drill-{self._draw.getrandbits(64):x}"}
            return http.post("/studies", json=harness.spec(2, 4.0), headers=key)
        return http.post(f"/studies/{self._study}:prioritize", params={"priority": self._draw.randint(-9, 9)})


def clients(folder: Path, *, readers: int, writers: int, seconds: float, cases: int, periods: float) -> dict[str, Any]:
    """Let clients write and read for that time while a study runs; gives the figures."""
    made = harness.spec(cases, periods)
    with harness.running(folder, "--processes", 1) as service:
        study = service.submit(made)
        harness.until(lambda: harness.done(service.database, study) > 0, "the study runs")
        end = time.monotonic() + seconds
        address = str(service.http.base_url)
        crowd = [_Client(address, study, number < writers, number, end) for number in range(writers + readers)]
        for client in crowd:
            client.start()
        for client in crowd:
            client.join()
        still = service.look(study)["state"]
        wrong = [line for client in crowd for line in client.wrong]
        assert not wrong, f"{len(wrong)} wrong answers, the first: {wrong[:3]}"
        service.finish(study)
        submitted = harness.asked(service.database, "SELECT count(*) FROM studies WHERE cases = 2")
        harness.until(
            lambda: not harness.asked(service.database, "SELECT count(*) FROM studies WHERE finished_at IS NULL"),
            "every study ends",
        )
    assert "locked" not in service.log.read_text()
    harness.compare(service.database, study, made)
    figures: dict[str, Any] = {"readers": readers, "writers": writers, "seconds": seconds, "study meanwhile": still}
    for name, group in (("write", crowd[:writers]), ("read a curve", crowd[writers:])):
        times = np.array([value for client in group for value in client.seconds]) * 1e3
        figures[f"{name}: answers"] = len(times)
        for percent in (50, 99, 100):
            figures[f"{name}: {percent} % within ms"] = round(float(np.percentile(times, percent)), 1)
    return figures | {"studies submitted and finished": submitted, "wrong answers": 0}
