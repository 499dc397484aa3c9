"""Overhead of the service: a study through dispatcher, pool and SQLite, compared with the engine alone.

Both run on the same number of warm processes, in turn, in one run of this program; what counts is the ratio.

    python -m benchmarks.overhead [--cases 20000] [--periods 20 | --settled] [--processes N] [--repeats 3]
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from multiprocessing import active_children, get_context
from multiprocessing.pool import Pool
from pathlib import Path
from typing import Any

import psutil

from sprag_study.service.jobs.dispatching import WorkerSettings, start_dispatcher_process
from sprag_study.service.presets import preset_text
from sprag_study.service.settings import available_cores
from sprag_study.service.spec.document import load_spec, parse_spec
from sprag_study.service.storage.store import Store
from sprag_study.worker import models
from sprag_study.worker.chunking import Chunking, spans
from sprag_study.worker.pool.processes import single_threaded_children
from sprag_study.worker.study import Axis, Study

#: The times are those in the database; looking more often would only take a core from the pool.
_POLL_SECONDS = 0.1
#: Longest wait for one study: whatever it is, the workers of a service that takes so long do not work.
_MOST_SECONDS = 3600


def timed(study: Study, duration: list[Any]) -> dict[str, Any]:
    """The run of a study as one of a given time."""
    return {"duration": duration, "window": None, **{name: study.run[name] for name in ("tolerance", "reset")}}


def example(cases: int, periods: float | None) -> Study:
    """The one-pendulum example, with the load and the frequency drawn finely enough for that many cases.

    Without a number of periods the cases are run until they are settled.
    """
    study = parse_spec(load_spec(preset_text("one_pendulum")[1], "json")).study
    loads = max(cases // 50, 1)
    axes = (
        Axis(("excitation.frequency",), tuple(20.0 + 15.0 * i / 49 for i in range(50))),
        Axis(("shaft.load",), tuple(0.5 * i / loads for i in range(loads))),
    )
    return replace(study, axes=axes, run=study.run if periods is None else timed(study, [periods, "periods"]))


def _compute(task: tuple[Study, int, int]) -> int:
    return models.run_chunk(*task).count


@contextmanager
def warm_pool(study: Study, processes: int) -> Iterator[Pool]:
    """Processes that have the kernel loaded."""
    with get_context("spawn").Pool(processes, models.warm_up, (study,)) as pool:
        pool.map(_compute, [(study, 0, 16)] * processes * 4, chunksize=1)
        yield pool


def engine_alone(pool: Pool, study: Study, chunk: int) -> float:
    """Seconds for all cases in chunks of the same size; the results go nowhere."""
    start = time.perf_counter()
    done = sum(pool.imap_unordered(_compute, [(study, *span) for span in spans(study.cases, chunk)]))
    assert done == study.cases
    return time.perf_counter() - start


def through_the_service(store: Store, study: Study) -> tuple[float, int]:
    """Seconds from submission to the last row in the database, and the cases of a chunk."""
    record = store.studies.create({}, study, fresh=True)
    limit = time.monotonic() + _MOST_SECONDS
    while not (record := store.studies.get(record.id)).state.terminal:
        assert time.monotonic() < limit, f"the study has not ended within {_MOST_SECONDS} s"
        time.sleep(_POLL_SECONDS)
    assert record.ok == study.cases, store.studies.progress(record.id)
    assert record.finished_at is not None
    return (record.finished_at - record.created_at).total_seconds(), record.chunk_cases


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=20_000)
    parser.add_argument("--periods", type=float, default=20.0)
    parser.add_argument("--settled", action="store_true", help="run cases until they are settled instead")
    parser.add_argument("--processes", type=int, default=available_cores())
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    single_threaded_children()
    study = example(options.cases, None if options.settled else options.periods)
    models.warm_up(study)
    with tempfile.TemporaryDirectory() as folder:
        url = f"sqlite:///{Path(folder) / 'overhead.sqlite3'}"
        with Store.open(url, chunking=Chunking(0, options.processes)) as store:
            dispatcher = start_dispatcher_process(WorkerSettings(url, options.processes, 600.0))
            try:
                through_the_service(store, example(50 * 16, 1.0))  # its processes load the kernel
                measure(store, study, options.processes, options.repeats, dispatcher.pid)
            finally:
                dispatcher.terminate()
                dispatcher.join()


def resident_mib(pid: int | None) -> float:
    """Resident memory of a process now, in MiB."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1024.0


def cpu_seconds(pids: Iterable[int | None]) -> float:
    """Processor time of processes and all their children so far."""
    family = [
        member for pid in pids for process in [psutil.Process(pid)] for member in (process, *process.children(True))
    ]
    return sum(sum(member.cpu_times()[:2]) for member in family)


def own_seconds(pid: int | None) -> float:
    """Processor time of a process without its children so far."""
    return sum(psutil.Process(pid).cpu_times()[:2])


def measure(store: Store, study: Study, processes: int, repeats: int, dispatcher: int | None) -> None:
    """Alternate the two; print every pair, and the ratios of the least times (the least disturbed) and the medians.

    The ratio of processor times is that of the times on a machine with nothing else to do and no core to spare.
    """
    alone, service, work, own = [], [], [], []
    with warm_pool(study, processes) as pool:
        members = [process.pid for process in active_children() if process.pid != dispatcher]
        for _ in range(repeats):
            before, own_before = cpu_seconds([dispatcher]), own_seconds(dispatcher)
            seconds, chunk = through_the_service(store, study)
            service.append(seconds)
            between = cpu_seconds([dispatcher])
            own.append(own_seconds(dispatcher) - own_before)
            start = cpu_seconds(members)
            alone.append(engine_alone(pool, study, chunk))
            work.append((between - before, cpu_seconds(members) - start))
            print(
                f"service {service[-1]:6.2f} s   engine alone {alone[-1]:6.2f} s   ratio {service[-1] / alone[-1]:.3f}"
                f"   processor time {work[-1][0]:6.2f} s against {work[-1][1]:6.2f} s"
                f"   dispatcher alone {own[-1]:.2f} s, {resident_mib(dispatcher):.0f} MiB"
            )
    ratios = [pick(service) / pick(alone) for pick in (min, statistics.median)]
    spent = min(ours for ours, _ in work) / min(theirs for _, theirs in work)
    print(f"{study.cases} cases, {processes} processes, chunks of {chunk}: {study.cases / min(service):.0f} cases/s")
    print(f"service / engine alone: ratio of least times {ratios[0]:.3f}, of medians {ratios[1]:.3f}")
    print(f"processor time, least of each: ratio {spent:.3f}")
    share = statistics.median(seconds / total for seconds, (total, _) in zip(own, work, strict=True))
    print(f"processor time of the dispatcher: {share:.1%} of the service's (median)")


if __name__ == "__main__":
    main()
