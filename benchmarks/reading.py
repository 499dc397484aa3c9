"""Reading from a large database: pages and curves, and the whole study in every format, from a running service.

Builds its own database of synthetic rows of one pendulum, then starts `sprag serve` on it and sends requests as a
client.

    python -m benchmarks.reading [--cases 1000000] [--requests 200] [--formats parquet,csv] [--folder DIR]
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import httpx
import numpy as np

from sprag.service.formats import FORMATS
from sprag.service.presets import preset_text
from sprag.service.spec.document import load_spec, parse_spec
from sprag.service.storage.store import Store
from sprag.worker import models
from sprag.worker.chunking import Chunking
from sprag.worker.models import ChunkResult
from sprag.worker.study import Axis, Study

#: Requests to each kind of answer before those that count.
_WARM = 20


def grid(cases: int) -> Study:
    """The one-pendulum example over frequency, amplitude and load, about as many values on each."""
    side = round(cases ** (1.0 / 3.0))
    last = cases // (side * side)
    study = parse_spec(load_spec(preset_text("one_pendulum")[1], "json")).study
    axes = (
        Axis(("excitation.frequency",), tuple((16.0 + 19.0 * np.arange(side) / side).tolist())),
        Axis(
            ("excitation.amplitude_x", "excitation.amplitude_y"), tuple((1e-3 + 2e-3 * np.arange(side) / side).tolist())
        ),
        Axis(("shaft.load",), tuple((0.5 * np.arange(last) / last).tolist())),
    )
    return replace(study, axes=axes)


def build(path: Path, study: Study) -> tuple[str, float]:
    """A finished study of random doubles in the database at ``path``: its id, and the seconds its commits took."""
    infos = models.study_results(study)
    counts = [index for index, info in enumerate(infos) if info.kind == "count"]
    categories = [index for index, info in enumerate(infos) if info.kind == "category"]
    numbers = np.random.default_rng(3)
    seconds = 0.0
    with Store.open(f"sqlite:///{path}", chunking=Chunking(5_000)) as store:
        record = store.create_study({"sprag": 1}, study)
        epoch = store.take_over("benchmark")
        for chunk in store.claim(epoch, store.open_chunks(record.number)):
            values = numbers.normal(size=(chunk.count, len(infos)))
            values[:, counts] = numbers.integers(0, 5_000, (chunk.count, len(counts)))
            values[:, categories] = numbers.integers(1, 3, (chunk.count, len(categories)))
            result = ChunkResult(chunk.first, ["ok"] * chunk.count, [""] * chunk.count, values)
            start = time.perf_counter()
            store.commit(epoch, chunk, result)
            seconds += time.perf_counter() - start
        store.settle(epoch, record.number)
    return record.id, seconds


@contextmanager
def serving(path: Path) -> Iterator[tuple[str, int]]:
    """A service on the database; its address and process id."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [
        sys.executable,
        "-m",
        "sprag.service.cli",
        "serve",
        "--db",
        str(path),
        "--port",
        str(port),
        "--processes",
        "1",
    ]
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    address = f"http://127.0.0.1:{port}"
    try:
        for _ in range(300):
            try:
                httpx.get(f"{address}/readyz").raise_for_status()
                break
            except httpx.HTTPError:
                time.sleep(0.1)
        else:
            raise AssertionError("the service does not get ready")
        yield address, process.pid
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait(30)


def peak_mib(pid: int) -> float:
    """Largest resident memory of a process since `forget_peak`, in MiB."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 1024.0


def forget_peak(pid: int) -> None:
    """Begin to measure the peak anew."""
    Path(f"/proc/{pid}/clear_refs").write_text("5")


def ask(name: str, requests: int, get: Callable[[], httpx.Response]) -> None:
    """Time many requests of a kind; print their median and the 95th percentile."""
    times = []
    for index in range(_WARM + requests):
        start = time.perf_counter()
        response = get()
        if index >= _WARM:
            times.append(1e3 * (time.perf_counter() - start))
        response.raise_for_status()
    p95 = statistics.quantiles(times, n=20)[-1]
    print(f"{name:52} median {statistics.median(times):6.1f} ms   p95 {p95:6.1f} ms   {len(response.content):9,} bytes")


def read(client: httpx.Client, study_id: str, study: Study, requests: int) -> None:
    """Lists and curves at values drawn at random, so that no answer is one that was given before."""
    own = f"/api/v1/studies/{study_id}"
    draw = random.Random(5)
    frequency, amplitude, load = study.axes

    def at(axis: Axis) -> str:
        return f"{axis.paths[0]}={draw.choice(axis.values)!r}"

    def curve(x: Axis, held: tuple[Axis, ...], by: Axis | None = None) -> httpx.Response:
        query = [("x", x.paths[0]), ("y", "shaft.speed.mean"), ("y", "shaft.speed.max")]
        query += [("at", at(axis)) for axis in held] + ([("by", by.paths[0])] if by else [])
        return client.get(f"{own}/curves", params=query)

    ask("studies", requests, lambda: client.get("/api/v1/studies"))
    ask("study", requests, lambda: client.get(own))
    ask(
        "100 cases anywhere",
        requests,
        lambda: client.get(f"{own}/cases", params={"page_token": draw.randrange(study.cases - 200)}),
    )
    ask(f"curve over {len(load)} loads", requests, lambda: curve(load, (frequency, amplitude)))
    ask(f"curve over {len(frequency)} frequencies", requests, lambda: curve(frequency, (amplitude, load)))
    ask(f"curve over {len(amplitude)} amplitudes", requests, lambda: curve(amplitude, (frequency, load)))
    ask(
        f"{len(frequency)} curves over {len(load)} loads",
        max(requests // 10, 10),
        lambda: curve(load, (amplitude,), frequency),
    )


def export(client: httpx.Client, study_id: str, form: str, pid: int) -> None:
    """Take the whole study in a format; print time, size, and the service's largest memory meanwhile."""
    forget_peak(pid)
    start, size = time.perf_counter(), 0
    with client.stream("GET", f"/api/v1/studies/{study_id}/results", params={"format": form}, timeout=3600) as answer:
        answer.raise_for_status()
        for piece in answer.iter_raw(1 << 20):
            size += len(piece)
    seconds = time.perf_counter() - start
    print(f"{form:8} {seconds:7.1f} s   {size / 1e6:8.1f} MB   resident at most {peak_mib(pid):6.0f} MiB")


def main() -> None:
    """Build, serve, ask, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=1_000_000)
    parser.add_argument("--requests", type=int, default=200)
    parser.add_argument("--formats", default=",".join(FORMATS))
    parser.add_argument("--folder", help="where the database is made; by default where temporary files go")
    options = parser.parse_args()
    study = grid(options.cases)
    with tempfile.TemporaryDirectory(dir=options.folder) as folder:
        path = Path(folder) / "reading.sqlite3"
        study_id, seconds = build(path, study)
        size = os.path.getsize(path)
        print(
            f"{study.cases:,} cases of {len(models.study_results(study))} results: {size / study.cases:.0f} bytes a "
            f"case, committed at {study.cases / seconds:,.0f} cases/s"
        )
        with serving(path) as (address, pid), httpx.Client(base_url=address) as client:
            read(client, study_id, study, options.requests)
            for form in options.formats.split(","):
                export(client, study_id, form, pid)


if __name__ == "__main__":
    main()
