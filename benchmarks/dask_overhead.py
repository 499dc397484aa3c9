"""Overhead of a Dask cluster on this machine compared with the process pool, for chunks of about a second.

Both have the same number of warm processes and run the same chunks in turn, in one run of this program; what counts is
the ratio.

    python -m benchmarks.dask_overhead [--seconds 1.0] [--chunks 12] [--processes N] [--repeats 3]
"""

from __future__ import annotations

import argparse
import statistics
import time

from benchmarks.overhead import example
from sprag_study.service.settings import available_cores
from sprag_study.worker import models
from sprag_study.worker.executors.dask import DaskExecutor
from sprag_study.worker.executors.process_pool import ProcessPoolExecutor
from sprag_study.worker.ports import Chunk, Executor, Fate
from sprag_study.worker.study import Study


def load(executor: Executor, study: Study, processes: int) -> None:
    """Have the kernel loaded by every process."""
    while not executor.ready(study):
        executor.wait(0.05)
    run(executor, study, 8, 4 * processes)


def run(executor: Executor, study: Study, size: int, chunks: int) -> float:
    """Seconds for that many chunks, handed over as a dispatcher does: a new one for each that has ended."""
    begin = time.perf_counter()
    started = done = 0
    while done < chunks:
        while started < chunks and started - done < executor.capacity:
            executor.submit(started, study, Chunk(1, started * size % (study.cases - size), size))
            started += 1
        for outcome in executor.wait(1.0):
            assert outcome.fate is Fate.DONE, outcome.detail
            done += 1
    return time.perf_counter() - begin


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=1.0)
    parser.add_argument("--chunks", type=int, default=12)
    parser.add_argument("--processes", type=int, default=available_cores())
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    study = example(20_000, 20.0)
    models.warm_up(study)
    begin = time.perf_counter()
    models.run_chunk(study, 0, 400)
    size = max(1, round(400 * options.seconds / (time.perf_counter() - begin)))
    pool = ProcessPoolExecutor(options.processes, chunk_timeout=600.0)
    dask = DaskExecutor("", options.processes, chunk_timeout=600.0)
    try:
        times: dict[str, list[float]] = {"pool": [], "dask": []}
        for executor in (pool, dask):
            load(executor, study, options.processes)
        for _ in range(options.repeats):
            times["pool"].append(run(pool, study, size, options.chunks))
            times["dask"].append(run(dask, study, size, options.chunks))
            print(f"pool {times['pool'][-1]:6.2f} s   dask {times['dask'][-1]:6.2f} s", flush=True)
    finally:
        pool.close()
        dask.close()
    least, middle = (pick(times["dask"]) / pick(times["pool"]) for pick in (min, statistics.median))
    each = min(times["pool"]) * options.processes / options.chunks
    print(f"{options.chunks} chunks of {size} cases ({each:.2f} s each), {options.processes} processes")
    print(f"dask / pool: ratio of least times {least:.3f}, of medians {middle:.3f}")


if __name__ == "__main__":
    main()
