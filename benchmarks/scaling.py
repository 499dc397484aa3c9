"""Two processes against one, and eight pendulums against one."""

from __future__ import annotations

import time
from multiprocessing import get_context
from typing import Any

import numpy as np

from benchmarks.workloads import CASES, W1, Workload, cores, many_pendulums, pin, take_turns
from sprag_study.engine.run import Run
from sprag_study.engine.vibration_drive.results import result_infos
from sprag_study.engine.vibration_drive.simulate import simulate

_STEPS = [info.name for info in result_infos(1)].index("run.steps")


def _rate(core: int, seconds: float, barrier: Any, results: Any) -> None:
    """Run W1 over and over for some time on one core; report cases/s by wall and by processor time."""
    pin(core)
    columns, run = W1.columns(np.arange(CASES)), Run()
    simulate(columns, run, cases=CASES)
    barrier.wait()
    wall, cpu, done = time.perf_counter(), time.process_time(), 0
    while time.perf_counter() - wall < seconds:
        simulate(columns, run, cases=CASES)
        done += CASES
    results.put((done / (time.perf_counter() - wall), done / (time.process_time() - cpu)))


def _together(on: list[int], seconds: float) -> tuple[float, float]:
    context = get_context("spawn")
    barrier, results = context.Barrier(len(on)), context.Queue()
    processes = [context.Process(target=_rate, args=(core, seconds, barrier, results)) for core in on]
    for process in processes:
        process.start()
    rates = [results.get() for _ in processes]
    for process in processes:
        process.join()
    return sum(wall for wall, _ in rates), sum(cpu for _, cpu in rates)


def processes(repeats: int, seconds: float = 2.0) -> None:
    """One process on each of two cores alone, then both at once; the best of the repeats of each."""
    available = cores()
    if len(available) < 2:
        print("two processes: this machine lends one core only")
        return
    pair = [available[0], available[-1]]
    alone: dict[int, list[tuple[float, float]]] = {core: [] for core in pair}
    both = []
    for _ in range(repeats):
        for core in pair:
            alone[core].append(_together([core], seconds))
        both.append(_together(pair, seconds))
    for k, clock in enumerate(("wall clock", "processor time")):
        one = sum(max(rates[k] for rates in alone[core]) for core in pair) / 2.0
        two = max(rates[k] for rates in both)
        print(f"two processes, {clock}: {one:.0f} -> {two:.0f} W1 cases/s, {two / one:.2f} times one")


def pendulums(repeats: int) -> None:
    """The cost of a case and of a case-step with 1, 2 and 8 pendulums, over the same grid."""
    cases = np.arange(CASES)
    workloads = {n: many_pendulums(n) for n in (1, 2, 8)}

    def job(workload: Workload) -> Any:
        return simulate(workload.columns(cases), Run(), cases=CASES)

    for workload in workloads.values():
        simulate(workload.columns(cases[:16]), Run(), cases=16)
    runs = take_turns({str(n): lambda w=w: job(w) for n, w in workloads.items()}, repeats)
    first = runs["1"][0].cpu
    for n, (timing, batch) in runs.items():
        steps = float(batch.values[:, _STEPS].sum())
        print(
            f"n = {n}: {CASES / timing.cpu:6.0f} cases/s, {timing.cpu / first:5.2f} times n = 1; "
            f"{steps / CASES:.0f} steps a case, {timing.cpu / steps * 1e9:.0f} ns a case-step"
        )
