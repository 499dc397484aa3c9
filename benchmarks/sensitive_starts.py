"""Flags of sensitive starts against the regimes of disturbed starts, and what the examination costs.

    python -m benchmarks.sensitive_starts [disturbed starts of each case]

For W1 and W2: cases with an orbit, those with the flag, and those that have another regime or another motion from a
start that is disturbed by 1e-9; among the latter, how many have the flag. The cost is that of a search with the
examination over one without, in excitation periods and in processor time of the same run, in turn.
"""

from __future__ import annotations

import sys
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.workloads import CASES, W1, W2, Workload, take_turns
from sprag_study.engine.run import SettledRun
from sprag_study.engine.vibration_drive.settle import SettledBatch, settle

#: Relative difference of mean speeds (the first result) from which motions differ.
OTHER = 1e-4


def _differs(batch: SettledBatch, other: SettledBatch) -> NDArray[np.bool_]:
    """Cases with an orbit that come to another motion in the other batch."""
    speed, reached = batch.values[:, 0], other.values[:, 0]
    same = other.repeats & (batch.orders == other.orders)
    return np.asarray(batch.repeats & ~(same & (np.abs(speed - reached) <= OTHER * np.maximum(np.abs(speed), 1e-3))))


def measure(workload: Workload, starts: int) -> None:
    """Print the lines of one workload."""
    columns: dict[str, Any] = workload.columns(np.arange(CASES))
    run = partial(settle, columns, SettledRun(), cases=CASES)
    jobs = {"plain": run, "examined": partial(run, examine_starts=True)}
    for job in jobs.values():
        job()  # compiles
    done = take_turns(jobs, 5)
    (plain_time, plain), (time, batch) = done["plain"], done["examined"]
    assert np.array_equal(plain.values, batch.values, equal_nan=True)
    flagged = batch.sensitive
    generator = np.random.default_rng(1)
    other = np.zeros(CASES, dtype=np.bool_)
    for _ in range(starts):
        disturbed = dict(columns)
        for i in range(workload.pendulums):
            disturbed[f"pendulums.{i}.initial_angle"] = 1e-9 * generator.standard_normal(CASES)
            disturbed[f"pendulums.{i}.initial_speed"] = 1e-7 * generator.standard_normal(CASES)
        other |= _differs(batch, settle(disturbed, SettledRun(), cases=CASES))
    print(
        f"{workload.name}: {batch.repeats.sum()} cases with an orbit, with the flag: {np.flatnonzero(flagged).tolist()}"
    )
    print(f"  otherwise from {starts} disturbed starts: {np.flatnonzero(other).tolist()}, ", end="")
    print(f"of these with the flag: {(other & flagged).sum()}")
    print(f"  periods x {batch.spent.sum() / plain.spent.sum():.3f}, time x {time.cpu / plain_time.cpu:.3f}")


if __name__ == "__main__":
    for chosen in (W1, W2):
        measure(chosen, int(sys.argv[1]) if len(sys.argv) > 1 else 16)
