"""Effect of one reader, and of writers behind a lock, on everybody else: the waits for /livez and for a curve.

Run as ``python -m benchmarks.hostile --readers [--seconds 30] [--cases 100000]``. Each attack meets a service on a
database that it has for itself; its clients stay until they are answered, or leave when the time is over. Another user
asks for a curve again and again, a process of its own for /livez over new connections. The same is measured before the
attack; `--only exports` and so on name the attacks.
"""

from __future__ import annotations

import http.client
import multiprocessing
import socket
import statistics
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import httpx

from benchmarks.faults.harness import PATIENCE, Service, spec, until
from benchmarks.reading import build, grid
from sprag_study.service.formats import FORMATS
from sprag_study.service.storage.database.sqlite_files import sqlite_driver
from sprag_study.service.storage.people.scopes import TokenScope
from sprag_study.service.storage.store import Store

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

EXPORTS: Final = 45
STREAMS: Final = 200
WRITERS: Final = 40
HALF_SENT: Final = 800
_PAUSE: Final = 0.02


@dataclass(frozen=True, slots=True)
class Place:
    """A running service: its port, its database, a study of many rows and one that waits, and who asks."""

    port: int
    database: Path
    study: str
    waiting: str
    reader: str
    other: str
    writer: str

    def ask(self, method: str, path: str, token: str, patience: float, **further: str) -> str:
        """Ask for something and read the answer; its status, or that the client left."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=patience)
        until_then = time.monotonic() + patience
        try:
            connection.request(method, path, headers={"Authorization": f"Bearer {token}", **further})
            answer = connection.getresponse()
            while answer.read(1 << 20):
                if time.monotonic() > until_then:
                    return "left"
            return str(answer.status)
        except (OSError, http.client.HTTPException) as error:
            return "left" if isinstance(error, TimeoutError) else type(error).__name__
        finally:
            connection.close()


def probe(place: Place, path: str, over: Any, told: Any) -> None:
    """Ask for an address until ``over``, each time over a new connection, then tell how long the answers took (s)."""
    waits: list[float] = []
    told.send(None)
    while not over.wait(_PAUSE):
        began = time.perf_counter()
        status = place.ask("GET", path, place.other, PATIENCE)
        waits.append(time.perf_counter() - began if status == "200" else float("inf"))
    told.send(waits)


@contextmanager
def probing(place: Place) -> Iterator[dict[str, list[float]]]:
    """Ask for /livez and for a curve inside the block; the waits are there after it."""
    context = multiprocessing.get_context("spawn")
    axes = "excitation.frequency=16&at=excitation.amplitude_x=0.001"
    curve = f"/api/v1/studies/{place.study}/curves?x=shaft.load&y=shaft.speed.mean&at={axes}"
    over, found, running = context.Event(), dict[str, list[float]](), []
    for name, path in (("/livez", "/livez"), ("curve", curve)):
        ours, theirs = context.Pipe()
        process = context.Process(target=probe, args=(place, path, over, theirs))
        process.start()
        ours.recv()
        running.append((name, process, ours))
    try:
        yield found
    finally:
        over.set()
        for name, process, ours in running:
            found[name] = ours.recv()
            process.join()


def exports(place: Place, seconds: float, form: str, packed: str = "identity") -> Counter[str]:
    """All rows of the large study in a format, by one reader many times at once, as they are or as gzip."""
    path, encoding = f"/api/v1/studies/{place.study}/results?format={form}", {"Accept-Encoding": packed}
    return crowd(EXPORTS, lambda _: place.ask("GET", path, place.reader, seconds, **encoding))


def ranges(place: Place, seconds: float) -> Counter[str]:
    """Parts of a file that is not written yet."""

    def part(number: int) -> str:
        connection = http.client.HTTPConnection("127.0.0.1", place.port, timeout=seconds)
        first = 1000 * number
        headers = {"Authorization": f"Bearer {place.reader}", "Range": f"bytes={first}-{first + 999}"}
        try:
            connection.request("GET", f"/api/v1/studies/{place.study}/results?format=jsonl", headers=headers)
            answer = connection.getresponse()
            answer.read()
            return str(answer.status)
        except TimeoutError:
            return "left"
        finally:
            connection.close()

    return crowd(EXPORTS, part)


def streams(place: Place, seconds: float) -> Counter[str]:
    """Streams of the events of one study that is running, half of them by the reader, as many as it gets."""
    api = httpx.Client(base_url=f"http://127.0.0.1:{place.port}/api/v1", timeout=PATIENCE, trust_env=False)
    with api:
        api.headers["Authorization"] = f"Bearer {place.writer}"
        submitted = api.post("/studies", json=spec(1_000_000))
        assert submitted.status_code == 202, submitted.text
        study = f"/studies/{submitted.json()['id']}"
        until(lambda: api.get(study).json()["state"] == "running", "the study is running")
        head = f"GET /api/v1{study}/events HTTP/1.1\r\nHost: localhost\r\n"
        asked = [f"{head}Authorization: Bearer {token}\r\n\r\n".encode() for token in (place.reader, place.writer)]
        answers = held(place, STREAMS, asked, seconds)
        assert api.get(study).json()["state"] == "running", "it must not end before its streams"
        assert api.post(f"{study}:cancel").status_code == 202
    return answers


def half_sent(place: Place, seconds: float) -> Counter[str]:
    """Requests of which the second half never comes."""
    return held(place, HALF_SENT, [b"GET /api/v1/studies HTTP/1.1\r\nHost: local"], seconds)


def held(place: Place, number: int, sent: Sequence[bytes], seconds: float) -> Counter[str]:
    """Connections that send one of these each, in turn, and are held for a time; how many got an answer by then."""
    opened = []
    for at in range(number):
        connection = socket.create_connection(("127.0.0.1", place.port), timeout=PATIENCE)
        connection.sendall(sent[at % len(sent)])
        opened.append(connection)
    time.sleep(seconds)
    answers: Counter[str] = Counter()
    for connection in opened:
        connection.setblocking(False)
        try:
            answers[connection.recv(64)[9:12].decode() or "closed"] += 1
        except BlockingIOError:
            answers["held"] += 1
        except OSError:
            answers["closed"] += 1
        connection.close()
    return answers


def writers(place: Place, seconds: float) -> Counter[str]:
    """Changes while another process holds the write lock of the database."""
    holder = sqlite_driver().connect(place.database, isolation_level=None)
    holder.execute("BEGIN IMMEDIATE")
    path = f"/api/v1/studies/{place.waiting}:pause"
    try:
        return crowd(WRITERS, lambda _: place.ask("POST", path, place.writer, seconds))
    finally:
        holder.execute("ROLLBACK")
        holder.close()


def crowd(number: int, ask: Callable[[int], str]) -> Counter[str]:
    """The answers to so many clients at once."""
    with ThreadPoolExecutor(number) as clients:
        return Counter(clients.map(ask, range(number)))


ATTACKS: Final[dict[str, Callable[[Place, float], Counter[str]]]] = {
    **{f"exports {form}": partial(exports, form=form) for form in FORMATS},
    "exports csv as gzip": partial(exports, form="csv", packed="gzip"),
    "ranges": ranges,
    "streams": streams,
    "writers": writers,
    "half-sent": half_sent,
}


@contextmanager
def running(cases: int) -> Iterator[Place]:
    """A service with a large study that has ended, a small one that waits, and the tokens of three."""
    with tempfile.TemporaryDirectory() as name:
        service = Service(Path(name), "--processes", 1)
        study, _ = build(service.database, grid(cases))
        with Store.open(f"sqlite:///{service.database}") as store:
            scopes = {"reader": TokenScope.READ, "other": TokenScope.READ, "writer": TokenScope.WRITE}
            secrets = {who: store.people.create_token(who, scope)[0] for who, scope in scopes.items()}
        service.start()
        try:
            yield _place(service, study, secrets)
        finally:
            service.stop()


def _place(service: Service, study: str, secrets: dict[str, str]) -> Place:
    """A started service, once it accepts specs and has a study that waits."""
    port = service.http.base_url.port
    assert port is not None
    service.http.headers["Authorization"] = f"Bearer {secrets['writer']}"
    waiting = service.submit(spec(1_000))
    assert service.http.post(f"/studies/{waiting}:pause").status_code == 202
    place = Place(port, service.database, study, waiting, **secrets)
    until(lambda: place.ask("GET", "/readyz", place.other, PATIENCE) == "200", "specs can be checked")
    return place


def attack(name: str, cases: int, seconds: float) -> None:
    """Measure one attack, and the same service before it."""
    with running(cases) as place:
        with probing(place) as before:
            time.sleep(3.0)
        began = time.monotonic()
        with probing(place) as during:
            answers = ATTACKS[name](place, seconds)
            lasted = time.monotonic() - began
        texts = []
        for what, waits in during.items():
            alone = statistics.median(before[what])
            texts.append(
                f"{what} {1e3 * statistics.median(waits):.0f} ms in the median, {1e3 * max(waits):.0f} at most of "
                f"{len(waits)} ({1e3 * alone:.0f} ms and {1e3 * max(before[what]):.0f} before)"
            )
        print(f"{name}: {'; '.join(texts)}; {lasted:.0f} s, answers {dict(answers)}", flush=True)


def measure(cases: int, seconds: float, only: str) -> None:
    """Measure every attack whose name begins so."""
    for name in ATTACKS:
        if name.startswith(only):
            attack(name, cases, seconds)
