"""Response times of pages on a database of a million cases, against the simplest request of the same service.

    python -m benchmarks.pages [--cases 1000000] [--requests 30]

The rows are synthetic (`benchmarks.scaling` measures their computation); the service is a separate process.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from pathlib import Path
from urllib.parse import urlencode

import httpx
import numpy as np

from benchmarks.faults.harness import PATIENCE
from benchmarks.reading import serving
from sprag_study.service.http.api.examples import SPEC
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.storage.store import Store
from sprag_study.worker import models
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.models import ChunkResult

_CURVE = 100_000
#: One case in so many ends otherwise than ok.
_RARE = 997


def fill(store: Store, axes: list[dict[str, object]], name: str) -> str:
    """A finished study with made-up rows; its id."""
    parsed = parse_spec({**SPEC, "axes": axes, "name": name})
    record = store.studies.create(parsed.spec, parsed.study)
    infos = models.study_results(parsed.study)
    random = np.random.default_rng(1)
    epoch = store.work.take_over("benchmark")
    while chunks := store.work.open_chunks(record.number)[:50]:
        for chunk in store.work.claim(epoch, chunks):
            values = random.normal(size=(chunk.count, len(infos)))
            for column, info in enumerate(infos):
                if info.kind != "real":
                    values[:, column] = 1 + chunk.first % 7 if info.kind == "count" else 1  # no order is 0
            endings = [
                "chatter" if case % _RARE == 0 else "ok" for case in range(chunk.first, chunk.first + chunk.count)
            ]
            values[[ending != "ok" for ending in endings]] = np.nan
            store.work.commit(epoch, chunk, ChunkResult(chunk.first, endings, [""] * chunk.count, values))
    store.work.settle(epoch, record.number)
    return record.id


def pages(big: str, line: str, cases: int) -> dict[str, str]:
    """The requested addresses by name."""
    own = f"/studies/{big}"
    held = urlencode([("at", "excitation.frequency=20"), ("sort", "-efficiency")])
    return {
        "trivial: /livez": "/livez",
        "list of studies": "/",
        "new study": "/new",
        "new study from an example": "/new?preset=one_pendulum",
        "clone": f"/new?clone={big}",
        "study": own,
        f"study: curve of {_CURVE:,} points, thinned": f"/studies/{line}",
        "study: map": f"{own}?z=-",
        "rows, first": f"{own}/rows",
        "rows, last": f"{own}/rows?skip={cases - 50}",
        "rows, rare ending": f"{own}/rows?ending=chatter",
        "rows of one frequency, sorted": f"{own}/rows?{held}",
        "what matters": f"{own}/matters",
        "case": f"{own}/cases/{cases // 2}",
        "compare": f"/compare?study={big}&study={line}",
    }


def measure(client: httpx.Client, address: str, requests: int) -> tuple[float, float, int]:
    """Median and slowest time (s) of ``requests`` requests after one that is not counted, and bytes of the answer."""
    answer = client.get(address)
    answer.raise_for_status()
    times = []
    for _ in range(requests):
        start = time.perf_counter()
        client.get(address)
        times.append(time.perf_counter() - start)
    return statistics.median(times), max(times), len(answer.content)


def main() -> None:
    """Fill a database, start a service on it, measure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=1_000_000)
    parser.add_argument("--requests", type=int, default=30)
    given = parser.parse_args()
    side = round(given.cases**0.5)
    with tempfile.TemporaryDirectory() as folder:
        database = Path(folder) / "pages.sqlite3"
        start = time.perf_counter()
        with Store.open(f"sqlite:///{database}", chunking=Chunking(cases=5000)) as store:
            loads = {"path": "shaft.load", "linspace": [0, 1, side]}
            big = fill(store, [{"path": "excitation.frequency", "linspace": [20, 35, side]}, loads], "A million cases")
            line = fill(store, [{"path": "shaft.load", "linspace": [0, 1, _CURVE]}], "A long curve")
        size = database.stat().st_size / 1e6
        print(f"{side * side + _CURVE:,} rows, {size:,.0f} MB, written in {time.perf_counter() - start:.0f} s")
        with (
            serving(database) as (address, _),
            httpx.Client(base_url=address, timeout=PATIENCE, trust_env=False) as client,
        ):
            trivial = 0.0
            print(f"{'':44} median ms  slowest ms     kB  x trivial")
            for name, path in pages(big, line, side * side).items():
                median, slowest, size = measure(client, path, given.requests)
                trivial = trivial or median
                times = f"{median * 1e3:9.1f} {slowest * 1e3:11.1f}"
                print(f"{name:44} {times} {size / 1e3:6.0f} {median / trivial:10.1f}")


if __name__ == "__main__":
    main()
