"""What hostile clients can do to a service: the longest wait for /livez, memory, and the time to its end.

Run as ``python -m benchmarks.hostile [--clients N]``. Each bomb is within every limit of a spec; all are sent at once
by clients that leave after five seconds, or wait for their answers, to a service with its default settings.
"""

from __future__ import annotations

import argparse
import http.client
import json
import multiprocessing
import tempfile
import threading
import time
import tomllib
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import psutil

from benchmarks.faults.harness import Service
from service.presets import preset_text

_LEAVE = 5.0
_STAY = 600.0


def press(formula: str) -> dict[str, Any]:
    """The preset of the press with a formula in the place of its operation, and no mechanism."""
    made: dict[str, Any] = tomllib.loads(preset_text("press")[1])
    del made["base"]["mechanism"]
    made["base"]["operation"] = {"quantity": "torque", "formula": formula}
    return made


def long_axis() -> dict[str, Any]:
    """The preset of the one pendulum with an axis of a million values."""
    made: dict[str, Any] = json.loads(preset_text("one_pendulum")[1])
    made["axes"] = [{"path": "shaft.load", "linspace": [0.01, 0.5, 1_000_000]}]
    return made


def _nested(inner: str) -> str:
    smallest = ",".join([inner] * 16)
    return f"max({','.join([f'min({smallest})'] * 16)})"


BOMBS = {
    "formula of 256 arguments": (press(_nested("phi")), _LEAVE),
    "formula of many jumps": (press("+".join(["floor(9e5*phi)"] * 90)), _LEAVE),
    "axis of a million values": (long_axis(), _STAY),
}


def ask(port: int, over: Any, told: Any) -> None:
    """Ask /livez again and again until ``over``, then tell how long each answer took (s). For a process of its own."""
    waits = []
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    told.send(None)
    while not over.wait(0.02):
        began = time.perf_counter()
        connection.request("GET", "/livez")
        answer = connection.getresponse()
        answer.read()
        assert answer.status == 200
        waits.append(time.perf_counter() - began)
    told.send(waits)


class Watch:
    """Asks /livez again and again, and looks at the memory of the service."""

    def __init__(self, service: Service) -> None:
        self._port = port_of(service)
        self._process = psutil.Process(service.process.pid)
        self.waits: list[float] = []
        self.memory = self.family = 0
        self._over = threading.Event()

    def weigh(self) -> None:
        """Until the end: the largest memory of the service, and with the processes that check for it."""
        dispatcher = self._dispatcher()
        while not self._over.wait(0.1):
            with suppress(psutil.Error):
                checking = [child for child in self._process.children() if child.pid != dispatcher]
                own = self._process.memory_info().rss
                family = sum(part.memory_full_info().pss for part in (self._process, *checking))
                self.memory, self.family = max(self.memory, own), max(self.family, family)

    def _dispatcher(self) -> int | None:
        with suppress(psutil.Error):
            return next((child.pid for child in self._process.children() if child.children()), None)
        return None

    @contextmanager
    def watching(self) -> Iterator[None]:
        """Ask and weigh inside the block."""
        context = multiprocessing.get_context("spawn")
        over, (ours, theirs) = context.Event(), context.Pipe()
        asking = context.Process(target=ask, args=(self._port, over, theirs))
        weighing = threading.Thread(target=self.weigh)
        asking.start()
        weighing.start()
        ours.recv()
        try:
            yield
        finally:
            over.set()
            self._over.set()
            self.waits = ours.recv()
            weighing.join()
            asking.join()


def port_of(service: Service) -> int:
    """The port that a service listens on."""
    port = service.http.base_url.port
    assert port is not None
    return port


def send(port: int, made: bytes, patience: float) -> str:
    """Preview a spec; the status of the answer, or that the client left before."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=patience)
    try:
        connection.request("POST", "/api/v1/studies:preview", made, {"Content-Type": "application/json"})
        return str(connection.getresponse().status)
    except TimeoutError:
        return "left"
    finally:
        connection.close()


def throw(service: Service, made: dict[str, Any], patience: float, clients: int) -> tuple[Watch, Counter[str], float]:
    """Send a bomb from all clients at once."""
    watch, port, body = Watch(service), port_of(service), json.dumps(made).encode()
    began = time.perf_counter()
    with watch.watching(), ThreadPoolExecutor(clients) as crowd:
        answers = Counter(crowd.map(lambda _: send(port, body, patience), range(clients)))
    return watch, answers, time.perf_counter() - began


def main() -> None:
    """Throw every bomb, then end a service under fire."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--clients", type=int, default=40)
    clients = parser.parse_args().clients
    for name, (made, patience) in BOMBS.items():
        with tempfile.TemporaryDirectory() as folder:
            service = Service(Path(folder))
            service.start()
            send(port_of(service), json.dumps(press("1")).encode(), _STAY)  # until the processes that check are there
            watch, answers, seconds = throw(service, made, patience, clients)
            print(
                f"{name}: {clients} clients in {seconds:.1f} s, answers {dict(answers)}; "
                f"/livez at most {1e3 * max(watch.waits):.0f} ms of {len(watch.waits)}; "
                f"service {watch.memory / 1e6:.0f} MB, with its checking processes {watch.family / 1e6:.0f} MB",
                flush=True,
            )
            crowd = [threading.Thread(target=_fire, args=(service, made)) for _ in range(clients)]
            for thread in crowd:
                thread.start()
            time.sleep(1.0)
            print(f"{name}: ended {service.stop():.1f} s after SIGTERM under fire", flush=True)
            for thread in crowd:
                thread.join()


def _fire(service: Service, made: dict[str, Any]) -> None:
    with suppress(OSError, http.client.HTTPException):
        send(port_of(service), json.dumps(made).encode(), _STAY)


if __name__ == "__main__":
    main()
