"""An estimate for 10^9 cases on 1,000 workers and one database: what saturates first?

Measures on this machine the time of a chunk in the transactions that store and claim groups of chunks, with a real
store: all dispatchers of a database take turns at these, so their number does not matter. Also measured are the size of
a chunk's task and result on the network, and the time of Dask's scheduler per task. Then it simulates the queue of
chunks with these numbers.

    python -m benchmarks.cluster_simulation [--db URL] [--workers 1000] [--cases 1e9] [--per-case 0.001]

``--db`` is a PostgreSQL database of its own; without it, SQLite in a temporary folder.
"""

from __future__ import annotations

import argparse
import heapq
import pickle
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from distributed import Client, LocalCluster

from sprag_study.service.storage.store import Store
from sprag_study.worker import models
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.models import ChunkResult
from sprag_study.worker.ports import Finished
from sprag_study.worker.study import Axis, Study

#: Bytes/s of the dispatcher's link: 10 Gbit/s.
LINK = 1.25e9
#: Chunks of a group: of 4,000 cases, as many as the dispatcher stores at once.
GROUP = 5
#: Chunks played through for each line: the queue is in its steady state long before.
PLAYED = 200_000


@dataclass(frozen=True)
class Costs:
    """What was measured: seconds a chunk and seconds a case at the database, scheduler seconds a task, bytes."""

    dispatch_chunk: float
    dispatch_case: float
    schedule: float
    bytes_chunk: float
    bytes_case: float


def study_of(cases: int) -> Study:
    """A one-pendulum study over the load; it is not run."""
    base = {"excitation.frequency": 25.0, "excitation.amplitude_y": 2e-3, "pendulums.0.inertia": 1e-3}
    base |= {"shaft.inertia": 2e-3, "clutch.coefficients.0": 0.0, "clutch.coefficients.1": 200.0}
    run = {"duration": [3.0, "periods"], "window": None, "tolerance": 1e-9, "reset": "contact"}
    return Study("vibration-drive", "estimate", base, run, (Axis(("shaft.load",), tuple(np.arange(cases) * 1e-3)),))


def made_up(first: int, count: int) -> ChunkResult:
    """A result whose numbers have all their digits."""
    values = np.random.default_rng(first).random((count, len(models.result_infos("vibration-drive", "1"))))
    return ChunkResult(first, ["ok"] * count, [""] * count, values)


def dispatch_seconds(url: str, size: int, groups: int = 6) -> float:
    """Least time of a chunk of that many cases, when `GROUP` of them are stored and as many claimed at once."""
    chunks = groups * GROUP
    with Store.open(url, chunking=Chunking(cases=size)) as store:
        record = store.studies.create({}, study_of(size * chunks), fresh=True)
        epoch = store.work.take_over("benchmark")
        waiting, times = store.work.open_chunks(record.number), []
        claimed = store.work.claim(epoch, waiting[:GROUP])
        for first in range(GROUP, chunks + GROUP, GROUP):
            finished = [Finished(chunk, made_up(chunk.first, chunk.count)) for chunk in claimed]
            begin = time.perf_counter()
            stored, claimed = store.work.exchange(epoch, finished, waiting[first : first + GROUP])
            times.append((time.perf_counter() - begin) / GROUP)
            assert len(stored) == GROUP
        store.work.settle(epoch, record.number)
        store.studies.delete(record.id)
        store.purging.purge()
    return min(times[:-1])  # the last transaction claims nothing


def schedule_seconds(tasks: int = 2000) -> float:
    """Seconds of the whole path of an empty task over a scheduler, with several under way."""
    with (
        LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address="127.0.0.1:0", memory_limit=0) as cluster,
        Client(cluster) as client,
    ):
        client.submit(int, key="warm").result()
        begin = time.perf_counter()
        client.gather([client.submit(int, key=f"task-{index}") for index in range(tasks)])
        return (time.perf_counter() - begin) / tasks


def line(small: float, large: float, sizes: tuple[int, int]) -> tuple[float, float]:
    """Fixed part and part of each case, from two sizes."""
    each = (large - small) / (sizes[1] - sizes[0])
    return max(small - each * sizes[0], 0.0), each


def measured(url: str) -> Costs:
    """Every cost, on this machine."""
    sizes = (100, 4000)
    chunk, case = line(*(dispatch_seconds(url, size) for size in sizes), sizes=sizes)
    weights = []
    for size in sizes:
        task = models.chunk_task(study_of(size), 0, size)
        weights.append(float(len(pickle.dumps(task)) + len(pickle.dumps(made_up(0, size)))))
    bytes_chunk, bytes_case = line(*weights, sizes=sizes)
    return Costs(chunk, case, schedule_seconds(), bytes_chunk, bytes_case)


def play(costs: Costs, workers: int, seconds: float, size: int) -> tuple[float, dict[str, float]]:
    """Chunks/s, and how busy each part is: workers feed a scheduler, a link and a database, one after the other."""
    random = np.random.default_rng(1)
    service = {
        "scheduler": costs.schedule,
        "network": (costs.bytes_chunk + costs.bytes_case * size) / LINK,
        "database": costs.dispatch_chunk + costs.dispatch_case * size,
    }
    free, busy = dict.fromkeys(service, 0.0), dict.fromkeys(service, 0.0)
    lengths = seconds * random.gamma(25.0, 1.0 / 25.0, PLAYED + workers)  # chunks differ by a fifth
    ends = [float(seconds) for seconds in lengths[:workers] * random.random(workers)]
    heapq.heapify(ends)
    computing = moment = 0.0
    for index in range(PLAYED):
        moment = heapq.heappop(ends)
        for name, cost in service.items():
            moment = max(moment, free[name]) + cost
            free[name] = moment
            busy[name] += cost
        # The worker has its next chunk when this one has gone all the way: what is in hand is limited.
        heapq.heappush(ends, moment + lengths[workers + index])
        computing += lengths[workers + index]
    load = {name: seconds / moment for name, seconds in busy.items()}
    return PLAYED / moment, {"workers": min(computing / moment / workers, 1.0), **load}


def main() -> None:
    """Measure, play, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--db", default="")
    parser.add_argument("--workers", type=int, default=1000)
    parser.add_argument("--cases", type=float, default=1e9)
    parser.add_argument("--per-case", type=float, default=1e-3, help="seconds of a case on one worker")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        costs = measured(options.db or f"sqlite:///{Path(folder) / 'a.sqlite3'}")
    print(
        f"measured: database {costs.dispatch_chunk * 1e3:.2f} ms a chunk + {costs.dispatch_case * 1e6:.1f} us a case, "
        f"Dask {costs.schedule * 1e3:.2f} ms a task; "
        f"network {costs.bytes_chunk:.0f} B a chunk + {costs.bytes_case:.0f} B a case"
    )
    ideal = options.cases * options.per_case / options.workers
    print(
        f"{options.cases:.0e} cases of {options.per_case:g} s, {options.workers} workers: {ideal:.0f} s if none waits"
    )
    for seconds in (1.0, 10.0, 60.0):
        size = max(1, round(seconds / options.per_case))
        rate, load = play(costs, options.workers, seconds, size)
        parts = ", ".join(f"{name} {share:.0%}" for name, share in load.items())
        print(f"chunks of {seconds:g} s ({size} cases): {options.cases / size / rate:.0f} s; busy: {parts}", flush=True)


if __name__ == "__main__":
    main()
