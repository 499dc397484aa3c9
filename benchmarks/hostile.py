"""Effect of hostile clients on a service: the longest wait for /livez, memory, and the shutdown time.

Run as ``python -m benchmarks.hostile [--clients N]``. Each bomb is within every limit of a spec; all are sent at once
by clients that leave after five seconds, or wait for their answers, to a service with its default settings. With
``--readers`` the attacks are those of `benchmarks.hostile_readers`, each by one reader.
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

from benchmarks.faults.harness import PATIENCE, Service, until
from benchmarks.hostile_readers import measure
from sprag_study.service.presets import preset_text

_LEAVE = 5.0
_STAY = PATIENCE


def press(formula: str) -> dict[str, Any]:
    """The preset of the press with a formula in the place of its operation, and no mechanism."""
    made: dict[str, Any] = tomllib.loads(preset_text("press")[1])
    del made["base"]["mechanism"]
    made["base"]["operation"] = {"quantity": "torque", "formula": formula}
    return made


def long_axis(values: int = 1_000_000) -> dict[str, Any]:
    """The preset of the one pendulum with an axis of a million values, or of some other number."""
    made: dict[str, Any] = json.loads(preset_text("one_pendulum")[1])
    made["axes"] = [{"path": "shaft.load", "linspace": [0.01, 0.5, values]}]
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
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=_STAY)
    told.send(None)
    while not over.wait(0.02):
        began = time.perf_counter()
        connection.request("GET", "/livez")
        answer = connection.getresponse()
        answer.read()
        assert answer.status == 200
        waits.append(time.perf_counter() - began)
    told.send(waits)


def weight(service: Service) -> tuple[int, int]:
    """Memory (bytes) of a service: of the process that answers, and of all its processes.

    Pages that several of them share count once in all: it is the proportional set size (/proc/PID/smaps_rollup).
    """
    own = psutil.Process(service.process.pid)
    sizes = []
    for process in (own, *own.children(recursive=True)):
        with suppress(psutil.Error):
            sizes.append(process.memory_full_info().pss)
    return sizes[0], sum(sizes)


class Watch:
    """Asks /livez again and again, and looks at the memory of the service."""

    def __init__(self, service: Service) -> None:
        self._service = service
        self._port = port_of(service)
        self.waits: list[float] = []
        self.memory = self.family = 0
        self._over = threading.Event()

    def weigh(self) -> None:
        """Until the end: the largest memory of the process that answers, and of the whole service."""
        while not self._over.wait(0.1):
            with suppress(psutil.Error, IndexError):
                own, family = weight(self._service)
                self.memory, self.family = max(self.memory, own), max(self.family, family)

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


def request(port: int, method: str, path: str, body: bytes | None, patience: float) -> str:
    """Ask for something; the status of the answer, which is read whole, or that the client left before."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=patience)
    try:
        connection.request(method, path, body, {"Content-Type": "application/json"} if body else {})
        answer = connection.getresponse()
        answer.read()
        return str(answer.status)
    except TimeoutError:
        return "left"
    finally:
        connection.close()


def send(port: int, made: bytes, patience: float) -> str:
    """Preview a spec; the status of the answer, or that the client left before."""
    return request(port, "POST", "/api/v1/studies:preview", made, patience)


def throw(service: Service, made: dict[str, Any], patience: float, clients: int) -> tuple[Watch, Counter[str], float]:
    """Send a bomb from all clients at once."""
    watch, port, body = Watch(service), port_of(service), json.dumps(made).encode()
    began = time.perf_counter()
    with watch.watching(), ThreadPoolExecutor(clients) as crowd:
        answers = Counter(crowd.map(lambda _: send(port, body, patience), range(clients)))
    return watch, answers, time.perf_counter() - began


def report(name: str, watch: Watch, clients: int, seconds: float, answers: Counter[str]) -> None:
    """Print the measurements of one attack."""
    print(
        f"{name}: {clients} clients in {seconds:.1f} s, answers {dict(answers)}; "
        f"/livez at most {1e3 * max(watch.waits):.0f} ms of {len(watch.waits)}; "
        f"answering process {watch.memory / 1e6:.0f} MB, whole service {watch.family / 1e6:.0f} MB",
        flush=True,
    )


def come_and_go(service: Service, clients: int) -> None:
    """Clients that send a bomb and leave at once, each ten times, and one that stays; how long that one waits."""
    watch, port, body = Watch(service), port_of(service), json.dumps(long_axis()).encode()
    children = {child.pid for child in psutil.Process(service.process.pid).children()}
    began = time.perf_counter()
    with watch.watching(), ThreadPoolExecutor(clients + 1) as crowd:
        leavers = [crowd.submit(send, port, body, 0.05) for _ in range(10 * clients)]
        stayed = send(port, json.dumps(press("1")).encode(), _STAY)
        waited = time.perf_counter() - began
        answers = Counter(leaver.result() for leaver in leavers)
    report("clients that leave at once", watch, clients, time.perf_counter() - began, answers)
    anew = {child.pid for child in psutil.Process(service.process.pid).children()} - children
    print(f"clients that leave at once: one that stays got {stayed} after {waited:.1f} s; {len(anew)} processes anew")


def look_at_stored(service: Service, clients: int) -> None:
    """Clients that open, copy, extend and export a stored study of nearly a million values."""
    study = service.submit(long_axis(900_000))
    service.http.post(f"/studies/{study}:pause")
    extension = json.dumps({"axes": [{"path": "shaft.load", "values": [0.7]}]}).encode()
    ways = [
        ("GET", f"/api/v1/studies/{study}", None),
        ("GET", f"/studies/{study}", None),
        ("GET", f"/new?clone={study}", None),
        ("POST", f"/api/v1/studies/{study}:extend", extension),
        ("GET", f"/api/v1/studies/{study}/results?format=csv", None),
        ("GET", f"/api/v1/studies/{study}/curves?x=shaft.load&y=shaft.speed.mean", None),
    ]
    watch, began = Watch(service), time.perf_counter()
    with watch.watching(), ThreadPoolExecutor(clients) as crowd:
        asked = [ways[number % len(ways)] for number in range(3 * clients)]
        answers = Counter(crowd.map(lambda way: request(port_of(service), *way, _STAY), asked))
    report("stored study of a million values", watch, clients, time.perf_counter() - began, answers)


def main() -> None:
    """Throw every bomb, then end a service under fire."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--clients", type=int, default=40)
    parser.add_argument("--readers", action="store_true", help="the attacks of readers instead")
    parser.add_argument("--only", default="", help="attacks of readers whose names begin so")
    parser.add_argument("--cases", type=int, default=100_000, help="cases of the study that readers export")
    parser.add_argument("--seconds", type=float, default=30.0, help="time after which readers leave")
    options = parser.parse_args()
    if options.readers:
        measure(options.cases, options.seconds, options.only)
        return
    clients = options.clients
    for name, (made, patience) in BOMBS.items():
        with running() as service:
            watch, answers, seconds = throw(service, made, patience, clients)
            report(name, watch, clients, seconds, answers)
            sent = threading.Barrier(clients + 1)
            crowd = [threading.Thread(target=_fire, args=(service, made, sent)) for _ in range(clients)]
            for thread in crowd:
                thread.start()
            sent.wait()
            print(f"{name}: ended {service.stop():.1f} s after SIGTERM under fire", flush=True)
            for thread in crowd:
                thread.join()
    for attack in (come_and_go, look_at_stored):
        with running() as service:
            attack(service, clients)
            service.stop()


@contextmanager
def running() -> Iterator[Service]:
    """A service that is ready to check specs; the caller stops it."""
    with tempfile.TemporaryDirectory() as folder:
        service = Service(Path(folder))
        service.start()
        until(lambda: request(port_of(service), "GET", "/readyz", None, _STAY) == "200", "specs can be checked")
        yield service


def _fire(service: Service, made: dict[str, Any], sent: threading.Barrier) -> None:
    """Send a preview, wait until everybody has, and take whatever comes back."""
    connection = http.client.HTTPConnection("127.0.0.1", port_of(service), timeout=_STAY)
    connection.request("POST", "/api/v1/studies:preview", json.dumps(made), {"Content-Type": "application/json"})
    sent.wait()
    with suppress(OSError, http.client.HTTPException):
        connection.getresponse().read()
    connection.close()


if __name__ == "__main__":
    main()
