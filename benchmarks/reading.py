"""Reading from a large database: pages and curves, and the whole study in every format, from a running service.

Builds its own database of synthetic rows of one pendulum, then starts `sprag serve` on it and sends requests as a
client. Medians are also given relative to a trivial request, for `/livez`.

    python -m benchmarks.reading [--cases 1000000] [--requests 200] [--formats parquet,csv] [--folder DIR]
"""

from __future__ import annotations

import argparse
import json
import os
import random
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import httpx
import numpy as np

from benchmarks.faults.harness import COMMAND, PATIENCE, environment, kill_family, until
from sprag_study.service.formats import FORMATS
from sprag_study.service.presets import preset_text
from sprag_study.service.spec.document import load_spec, parse_spec
from sprag_study.service.storage.store import Store
from sprag_study.worker import models
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.models import ChunkResult
from sprag_study.worker.study import Axis, Study

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
        record = store.studies.create({"sprag": 1}, study)
        epoch = store.work.take_over("benchmark")
        for chunk in store.work.claim(epoch, store.work.open_chunks(record.number)):
            values = numbers.normal(size=(chunk.count, len(infos)))
            values[:, counts] = numbers.integers(0, 5_000, (chunk.count, len(counts)))
            values[:, categories] = numbers.integers(1, 3, (chunk.count, len(categories)))
            result = ChunkResult(chunk.first, ["ok"] * chunk.count, [""] * chunk.count, values)
            start = time.perf_counter()
            store.work.commit(epoch, chunk, result)
            seconds += time.perf_counter() - start
        store.work.settle(epoch, record.number)
    return record.id, seconds


@contextmanager
def serving(path: Path) -> Iterator[tuple[str, int]]:
    """A service on the database, without the user's settings and with one process; its address and process id."""
    command = [*COMMAND, "serve", "--json", "--port", "0", "--db", str(path), "--processes", "1"]
    log = path.with_name("service.log")
    with log.open("wb") as errors:
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, env=environment())
    try:
        assert process.stdout is not None
        with process.stdout as output:
            line = output.readline()
        assert line, log.read_text()
        address = json.loads(line)["address"]
        with httpx.Client(base_url=address, timeout=PATIENCE, trust_env=False) as client:
            until(lambda: client.get("/readyz").is_success, "the service is ready")
        yield address, process.pid
        process.terminate()
        process.wait(PATIENCE)
    finally:
        kill_family(process)


def peak_mib(pid: int) -> float:
    """Largest resident memory of a process since `forget_peak`, in MiB."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 1024.0


def forget_peak(pid: int) -> None:
    """Begin to measure the peak anew."""
    Path(f"/proc/{pid}/clear_refs").write_text("5")


def ask(name: str, requests: int, get: Callable[[], httpx.Response], trivial: float = 0.0) -> float:
    """Time many requests of a kind; print their median, the 95th percentile and the ratio to a trivial one (ms).

    Gives the median.
    """
    times = []
    for index in range(_WARM + requests):
        start = time.perf_counter()
        response = get()
        if index >= _WARM:
            times.append(1e3 * (time.perf_counter() - start))
        response.raise_for_status()
    median, p95 = statistics.median(times), statistics.quantiles(times, n=20)[-1]
    ratio = median / (trivial or median)
    told = f"median {median:6.1f} ms   p95 {p95:6.1f} ms   {len(response.content):9,} bytes   {ratio:6.1f} x trivial"
    print(f"{name:32} {told}")
    return median


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

    def cases() -> httpx.Response:
        return client.get(f"{own}/cases", params={"page_token": draw.randrange(study.cases - 200)})

    trivial = ask("trivial: /livez", requests, lambda: client.get("/livez"))
    questions: dict[str, Callable[[], httpx.Response]] = {
        "studies": lambda: client.get("/api/v1/studies"),
        "study": lambda: client.get(own),
        "100 cases anywhere": cases,
        f"curve over {len(load)} loads": lambda: curve(load, (frequency, amplitude)),
        f"curve over {len(frequency)} frequencies": lambda: curve(frequency, (amplitude, load)),
        f"curve over {len(amplitude)} amplitudes": lambda: curve(amplitude, (frequency, load)),
    }
    for name, get in questions.items():
        ask(name, requests, get, trivial)
    curves = f"{len(frequency)} curves over {len(load)} loads"
    ask(curves, max(requests // 10, 10), lambda: curve(load, (amplitude,), frequency), trivial)


def export(client: httpx.Client, study_id: str, form: str, pid: int) -> None:
    """Take the whole study in a format; print time, size, and the service's largest memory meanwhile."""
    forget_peak(pid)
    start, size = time.perf_counter(), 0
    with client.stream("GET", f"/api/v1/studies/{study_id}/results", params={"format": form}) as answer:
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
        with (
            serving(path) as (address, pid),
            httpx.Client(base_url=address, timeout=PATIENCE, trust_env=False) as client,
        ):
            read(client, study_id, study, options.requests)
            for form in options.formats.split(","):
                export(client, study_id, form, pid)


if __name__ == "__main__":
    main()
